"""Event-driven simulation of balls and pucks on a horizontal surface."""
