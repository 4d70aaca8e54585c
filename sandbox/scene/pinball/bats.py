"""Bats: the outline of a flipper, two discs and what their common tangents enclose."""

import math

from sandbox.scene.part import Point
from sandbox.scene.pinball.rounding import Arc, flattened


def bat(length: float, base: float, tip: float, tolerance: float = 5e-5) -> tuple[Point, ...]:
    """Return the outline of a bat along x about its pivot, anticlockwise, m.

    The outer tangents of two discs touch both where their normals point: at the angle acos((base − tip) / length) to
    the line of centres.

    Args:
        length: between the centres of the discs, m; more than their radii differ by.
        base: radius of the disc about the pivot, m.
        tip: radius of the disc at the other end, m.
        tolerance: how far the outline may lie inside the arcs, m.
    """
    angle = math.acos((base - tip) / length)
    ends = Arc((length, 0.0), tip, -angle, 2.0 * angle), Arc((0.0, 0.0), base, angle, 2.0 * (math.pi - angle))
    return tuple(point for arc in ends for point in flattened(arc, tolerance))
