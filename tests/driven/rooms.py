"""Small scenes for driven windows; no text of the window covers their bodies."""

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
"""A ball that moves between two walls at 1 m/s without loss."""

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
"""A falling ball. Explicit Euler lags by ½·g·dt² = 5 cm a step, which is ½·g·dt·t at time t."""

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
"""A ball that slides on the ground under its weight."""

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
"""After 0.3 s the ball is beyond the end of pymunk's half-planes."""


def write_scene(folder: Path, text: str, name: str = "room.toml") -> Path:
    """Write a scene file, and return its path."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path
