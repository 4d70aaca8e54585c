"""Rotation of plane vectors, and nearest points of segments. Angles are counter-clockwise.

Cosine and sine are arguments: numpy and the math module may round them differently, and a start state must not depend
on which function computes it.
"""

import math
from typing import TypeVar

from sandbox.arrays import FloatArray
from sandbox.scene.description.base import Point

Component = TypeVar("Component", float, FloatArray)


def rotate(x: Component, y: Component, cos: Component, sin: Component) -> tuple[Component, Component]:
    """Return the components of vectors rotated by an angle; with −sin, by the opposite angle.

    Args:
        x: numbers, or arrays of one shape.
        y: likewise.
        cos: cosine of the angle.
        sin: sine of the angle.
    """
    return cos * x - sin * y, sin * x + cos * y


def to_world(point: Point, cos: float, sin: float, origin: Point) -> Point:
    """Return the position in the world of a point in a frame with an origin, m, rotated by an angle.

    The origin comes first in each sum: start states are compared bit for bit.
    """
    return origin[0] + cos * point[0] - sin * point[1], origin[1] + sin * point[0] + cos * point[1]


def nearest_on_segment(point: Point, a: Point, b: Point) -> tuple[float, float]:
    """Return the point of a segment that is nearest to a point, as a fraction from a to b, and its distance, m.

    A segment of no length has the fraction 0.
    """
    x, y = b[0] - a[0], b[1] - a[1]
    length2 = x * x + y * y
    along = (point[0] - a[0]) * x + (point[1] - a[1]) * y
    fraction = min(max(along / length2, 0.0), 1.0) if length2 else 0.0
    return fraction, math.hypot(point[0] - a[0] - fraction * x, point[1] - a[1] - fraction * y)
