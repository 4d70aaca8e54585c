"""Arc: where the centre of a body on a hinge is, and what its weight does there."""

import math

from sandbox.scene.part import Point


def about(hinge: Point, angle: float) -> Point:
    """Return the way from a hinge, m in the body's own frame, to the body's centre of mass at an angle, rad: m."""
    x, y = hinge
    cos, sin = math.cos(angle), math.sin(angle)
    return sin * y - cos * x, -sin * x - cos * y


def seated(hinge: Point, seat: Point, angle: float, spin: float) -> tuple[Point, Point]:
    """Return where the centre of mass is, m, and how fast, m/s.

    Args:
        hinge: in the body's own frame, m.
        seat: where the hinge is in the world, m.
        angle: rad.
        spin: rad/s.
    """
    dx, dy = about(hinge, angle)
    return (seat[0] + dx, seat[1] + dy), (0.0 - spin * dy, 0.0 + spin * dx)  # no −0, which is another state bit by bit


def heaviness(hinge: Point, angle: float, mass: float, gravity: Point) -> float:
    """Return the torque, N·m, of a body's weight about its hinge; mass in kg, gravity in m/s²."""
    gx, gy = gravity
    if not (gx or gy):
        return 0.0
    dx, dy = about(hinge, angle)
    return mass * (dx * gy - dy * gx)
