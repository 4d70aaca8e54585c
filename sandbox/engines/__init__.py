"""Engines: interchangeable ways to compute what a scene does."""
