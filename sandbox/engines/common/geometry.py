"""Plane geometry of single points: the nearest point of a segment, and rotation.

The functions are plain Python, and importing them imports no compiler; kernels compile what they need of them.
"""

from typing import TypeVar

from sandbox.arrays import FloatArray

Number = TypeVar("Number", float, FloatArray)


def nearest_fraction(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> float:
    """Return the fraction, 0 to 1, of the segment from a to b at its point nearest to (x, y); 0 if its length is 0."""
    ux, uy = bx - ax, by - ay
    length2 = ux * ux + uy * uy
    fraction = ((x - ax) * ux + (y - ay) * uy) / length2 if length2 > 0.0 else 0.0
    return min(max(fraction, 0.0), 1.0)


def rotate(cos: Number, sin: Number, x: Number, y: Number) -> tuple[Number, Number]:
    """Return vectors (x, y), numbers or arrays of one shape, rotated by the angle of a cosine and sine."""
    return cos * x - sin * y, sin * x + cos * y
