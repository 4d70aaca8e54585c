"""Scenes to drive: small, without surprises, and seen where no words cover them."""

from pathlib import Path

_WALLS = """
[solver]
dt = 0.01

[[wall]]
name = "room"
points = [[-2.0, -1.5], [2.0, -1.5], [2.0, 1.5], [-2.0, 1.5]]
closed = true
restitution = 1.0
"""

_REST = """
[[ball]]
name = "a"
position = [-1.0, 0.0]
radius = 0.4
"""

AT_REST = f'title = "Rest"\n[world]\nduration = 5.0\n{_WALLS}{_REST}'
"""A ball at rest, without gravity."""

MOVING = f'title = "Moving"\n[world]\nduration = 1.5\n{_WALLS}{_REST}velocity = [1.0, 0.0]\nrestitution = 1.0\n'
"""It goes to and fro between two walls, a metre a second, for ever."""

FALLING = """
title = "Falling"
[world]
gravity = [0.0, -10.0]
duration = 1.0
[solver]
dt = 0.1
[[wall]]
points = [[-4.0, -0.5], [4.0, -0.5], [4.0, 7.0], [-4.0, 7.0]]
closed = true
[[ball]]
name = "a"
position = [-1.0, 5.0]
radius = 0.5
"""
"""A step of explicit Euler is late by ½·g·dt² = 5 cm; ½·g·dt·t at time t."""

RESTING = """
title = "Resting"
[world]
gravity = [0.0, -10.0]
duration = 1.0
bounds = [[-3.0, -0.5], [3.0, 4.0]]
[solver]
dt = 0.01
[[plane]]
point = [0.0, 0.0]
normal = [0.0, 1.0]
[[ball]]
name = "a"
position = [-1.0, 0.3]
velocity = [3.0, 0.0]
radius = 0.3
"""
"""A ball that lies on the ground, pressed to it by its weight, and slides along."""

LEAVING = """
title = "Leaving"
[world]
duration = 1.0
[solver]
dt = 0.1
[[plane]]
point = [0.0, 0.0]
normal = [0.0, 1.0]
[[ball]]
name = "a"
position = [0.0, 1.0]
velocity = [2e7, 0.0]
radius = 0.5
"""
"""After 0.3 s the ball is where pymunk's half-planes have ended."""


def written(folder: Path, text: str, name: str = "room.toml") -> Path:
    """Write a scene's file."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path
