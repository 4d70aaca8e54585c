"""Rotation of plane vectors, nearest points of segments, and sides of bends. Angles are counter-clockwise.

Cosine and sine are arguments: numpy and the math module may round them differently, and a start state must not depend
on which function computes it. The functions are plain Python; `engines.common.geometry` has them compiled, for kernels.
"""

import math
from typing import TypeVar

import numpy as np

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


def nearest_fraction(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> float:
    """Return the fraction, 0 to 1, of the segment from a to b at its point nearest to (x, y); 0 if its length is 0."""
    ux, uy = bx - ax, by - ay
    length2 = ux * ux + uy * uy
    fraction = ((x - ax) * ux + (y - ay) * uy) / length2 if length2 > 0.0 else 0.0
    return min(max(fraction, 0.0), 1.0)


def nearest_fractions(ax: float, ay: float, bx: float, by: float, x: FloatArray, y: FloatArray) -> FloatArray:
    """Return `nearest_fraction` for points (x, y) as arrays (N,)."""
    ux, uy = bx - ax, by - ay
    length2 = ux * ux + uy * uy
    if not length2 > 0.0:
        return np.zeros(len(x))
    return np.clip(((x - ax) * ux + (y - ay) * uy) / length2, 0.0, 1.0)


def nearest_on_segment(point: Point, a: Point, b: Point) -> tuple[float, float]:
    """Return `nearest_fraction` of the segment from a to b, and the distance of the point from it, m."""
    fraction = nearest_fraction(*a, *b, *point)
    x, y = b[0] - a[0], b[1] - a[1]
    return fraction, math.hypot(point[0] - a[0] - fraction * x, point[1] - a[1] - fraction * y)


def offset_from_segment(point: FloatArray, tail: FloatArray, along: FloatArray) -> FloatArray:
    """Return the shortest offsets from segments, tail to tail + along, to points, (…, 2) m.

    A segment of length 0 is its tail. The arguments are broadcast.

    Args:
        point: (…, 2) m.
        tail: (…, 2) m.
        along: (…, 2) m.
    """
    offset = point - tail
    squared = along[..., 0] * along[..., 0] + along[..., 1] * along[..., 1]
    projection = offset[..., 0] * along[..., 0] + offset[..., 1] * along[..., 1]
    fraction = (projection / np.where(squared > 0.0, squared, 1.0)).clip(0.0, 1.0)
    return np.asarray(offset - fraction[..., None] * along)


def is_left_of_bend(x: float, y: float, in_x: float, in_y: float, out_x: float, out_y: float) -> bool:
    """Return whether a point is to the left of two half-lines that meet in the origin.

    Args:
        x: point, m.
        y: likewise.
        in_x: direction of the first half-line, towards the origin.
        in_y: likewise.
        out_x: direction of the second one, away from it.
        out_y: likewise.
    """
    left_of_first, left_of_second = in_x * y - in_y * x >= 0.0, out_x * y - out_y * x >= 0.0
    if in_x * out_y - in_y * out_x < 0.0:  # it turns to the right: the left side is the larger one
        return left_of_first or left_of_second
    return left_of_first and left_of_second
