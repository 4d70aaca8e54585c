"""Balls and pucks on a horizontal surface: motion, collisions, and a fixed-step solver."""
