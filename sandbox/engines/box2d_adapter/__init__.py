"""Adapter onto Box2D, through its binding pyb2d3."""
