"""Small scenes for driven windows; no text of the window covers their bodies."""

from pathlib import Path

_ROOM = """
[solver]
dt = 0.01
[[wall]]
name = "room"
points = [[-2.0, -1.5], [2.0, -1.5], [2.0, 1.5], [-2.0, 1.5]]
closed = true
restitution = 1.0
[[ball]]
name = "a"
position = [-1.0, 0.0]
radius = 0.4
"""
BALL_START = (-1.0, 0.0)
AT_REST = f'title = "Rest"\n[world]\nduration = 5.0\n{_ROOM}'
"""A ball at rest, without gravity."""
MOVING = f'title = "Moving"\n[world]\nduration = 5.0\n{_ROOM}velocity = [1.0, 0.0]\nrestitution = 1.0\n'
"""A ball that moves between two walls at 1 m/s without loss."""


def write_scene(folder: Path, text: str) -> Path:
    """Write a scene file, and return its path."""
    path = folder / "room.toml"
    path.write_text(text, encoding="utf-8")
    return path
