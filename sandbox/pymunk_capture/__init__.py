"""Capture of pymunk: a space as a scene, and a running game as a recording."""
