"""Adapter onto pymunk: scenes as pymunk spaces. Only this package imports pymunk."""
