"""Measuring: running scenes, and telling how right the answers are."""
