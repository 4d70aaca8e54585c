"""Swept geometry: exact geometry of a point that moves along a straight line in one substep, from `start` by `move`.

A circle that moves against a circle, or against a wall with round ends, is such a point against a centre or a segment,
with the radii added up. All functions take K rows and return new arrays.
"""

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.scene.geometry.vectors import offset_from_segment

TOLERANCE = 5e-3
"""Depth as a fraction of the contact distance up to which a contact does not count: between equal balls 1 % of a
radius, the overlap that the slop of an engine leaves. The closing speed of so shallow a graze is at most 0.1 of the
relative speed. Smaller values cost more and find hardly more contacts: down to 1e-6, the count of a settling pile
changed by less than an eighth.
"""

CLEAR = 1 - TOLERANCE / 2
"""A pair is clear if its distance is at least this fraction of its contact distance; bodies placed in contact are
clear.
"""

DEEP = 1 - TOLERANCE
"""A pair is deep in contact if its distance is below this fraction of its contact distance."""

JUMP = float(np.sqrt(CLEAR**2 - DEEP**2))
"""Shortest path, as a fraction of the contact distance, from clear to beyond the closest approach of a deep contact:
half a chord. The distance to a convex shape is curved by at most 1/distance, so that at x before the closest approach q
it is at most √(q² + x²), hence x² ≥ CLEAR² − DEEP².
"""

PARALLEL = 1e-9
"""Sine of the angle below which a path counts as neither approaching nor leaving: far above rounding (1e-16), and far
below any angle of an approach.
"""


def dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the dot products of rows, (…, 2) and (…, 2) to (…)."""
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1])


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross products of rows, (…, 2) and (…, 2) to (…)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def closest_to_origin(start: FloatArray, move: FloatArray) -> FloatArray:
    """Return the squared distance of each path from the origin, m².

    Within the path it is cross² / move², which keeps its digits in a graze, where a discriminant loses them.
    """
    length2, along = dot(move, move), dot(start, move)
    inside = (along < 0) & (-along < length2)
    across = cross(start, move) / np.sqrt(np.where(inside, length2, 1.0))
    end = start + move
    return np.where(inside, across * across, np.minimum(dot(start, start), dot(end, end)))


def approaching(offset: FloatArray, move: FloatArray) -> BoolArray:
    """Return whether a move decreases an offset by more than rounding."""
    return np.asarray(dot(offset, move) < -PARALLEL * np.sqrt(dot(offset, offset) * dot(move, move)))


def crosses(start: FloatArray, end: FloatArray, tail: FloatArray, along: FloatArray) -> BoolArray:
    """Return whether each path crosses its segment from one side to the other.

    A path that begins or ends on the line of the segment does not.
    """
    sides = np.sign(cross(along, start - tail)) * np.sign(cross(along, end - tail))
    path = end - start
    ends = np.sign(cross(path, tail - start)) * np.sign(cross(path, tail + along - start))
    return np.asarray((sides < 0) & (ends <= 0))


def closest_to_segment(
    start: FloatArray, end: FloatArray, tail: FloatArray, along: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Return the squared distance of each path from its segment, m², and whether it crosses it.

    Two segments that do not cross are closest at an end of one of them.
    """
    crossed = crosses(start, end, tail, along)
    path = end - start
    gaps = (
        offset_from_segment(start, tail, along),
        offset_from_segment(end, tail, along),
        offset_from_segment(tail, start, path),
        offset_from_segment(tail + along, start, path),
    )
    nearest = np.minimum.reduce([dot(gap, gap) for gap in gaps])
    return np.where(crossed, 0.0, nearest), crossed
