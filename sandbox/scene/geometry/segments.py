"""Nearest point of a segment, and rotation of vectors.

The functions are plain Python, and importing them imports no compiler. `engines.common.geometry` has them compiled, for
kernels.
"""

from typing import TypeVar

import numpy as np

from sandbox.arrays import FloatArray

Number = TypeVar("Number", float, FloatArray)


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


def rotate(cos: Number, sin: Number, x: Number, y: Number) -> tuple[Number, Number]:
    """Return vectors (x, y), numbers or arrays of one shape, rotated by the angle of a cosine and sine."""
    return cos * x - sin * y, sin * x + cos * y
