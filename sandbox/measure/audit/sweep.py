"""Sweeps: exact geometry of a point that moves along a straight line, from `start` by `move`, in one substep.

A circle that moves against a circle or against a wall with round ends is such a point against a centre or a
segment, with the radii added up. All functions take K rows at once and return new arrays.
"""

import numpy as np

from sandbox.arrays import BoolArray, FloatArray

TOLERANCE = 5e-3
"""Depth, as a part of the contact distance, up to which a contact does not count: between equal balls 1 % of a
radius, the overlap that an engine's slop lets bodies keep for good. So shallow a graze meets with 0.1 of the
relative speed at most. Smaller figures cost more and find hardly more: down to 1e-6 a settling pile's count
stayed within one in eight."""

CLEAR = 1 - TOLERANCE / 2
"""A pair this part of its contact distance apart is clear: bodies that were laid out to touch are."""

DEEP = 1 - TOLERANCE
"""A pair nearer than this part of its contact distance is deep in contact."""

JUMP = float(np.sqrt(CLEAR**2 - DEEP**2))
"""The shortest path, as a part of the contact distance, that leads from clear to past the closest approach of a
contact that is deep there: half a chord. Distance to anything convex is curved by 1/distance at most; so, going
back by x from the closest approach q, it is at most √(q² + x²), hence x² ≥ CLEAR² − DEEP²."""

PARALLEL = 1e-9
"""Sine of the angle below which a path counts as neither nearing nor leaving: far above rounding (1e-16), far
below any angle at which a contact is an approach."""


def dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the dot products of rows, (…, 2) and (…, 2) to (…)."""
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1])


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross products of rows, (…, 2) and (…, 2) to (…)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def closest_to_origin(start: FloatArray, move: FloatArray) -> FloatArray:
    """Return how close each path comes to the origin, squared, m².

    Inside the path it is cross² / move², which keeps its digits in a graze where a discriminant loses them.
    """
    length2, along = dot(move, move), dot(start, move)
    inside = (along < 0) & (-along < length2)
    across = cross(start, move) / np.sqrt(np.where(inside, length2, 1.0))
    end = start + move
    return np.where(inside, across * across, np.minimum(dot(start, start), dot(end, end)))


def approaching(offset: FloatArray, move: FloatArray) -> BoolArray:
    """Return whether a move shortens the offset from what it may touch, by more than rounding."""
    return np.asarray(dot(offset, move) < -PARALLEL * np.sqrt(dot(offset, offset) * dot(move, move)))


def from_segment(point: FloatArray, tail: FloatArray, along: FloatArray) -> FloatArray:
    """Return the shortest offsets (…, 2) from segments, tail to tail + along, to points.

    A segment of no length is its tail.
    """
    offset = point - tail
    length2 = dot(along, along)
    share = np.clip(dot(offset, along) / np.where(length2 > 0, length2, 1.0), 0.0, 1.0)
    return np.asarray(offset - share[..., None] * along)


def crosses(start: FloatArray, end: FloatArray, tail: FloatArray, along: FloatArray) -> BoolArray:
    """Return whether each path passes from one side of its segment to the other, through it.

    A path that begins or ends on the segment's line does not.
    """
    sides = np.sign(cross(along, start - tail)) * np.sign(cross(along, end - tail))
    path = end - start
    ends = np.sign(cross(path, tail - start)) * np.sign(cross(path, tail + along - start))
    return np.asarray((sides < 0) & (ends <= 0))


def closest_to_segment(
    start: FloatArray, end: FloatArray, tail: FloatArray, along: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Return how close each path comes to its segment, squared, m², and whether it crosses it.

    Two segments that do not cross are nearest at an end of one of them.
    """
    crossed = crosses(start, end, tail, along)
    path = end - start
    gaps = (
        from_segment(start, tail, along),
        from_segment(end, tail, along),
        from_segment(tail, start, path),
        from_segment(tail + along, start, path),
    )
    nearest = np.minimum.reduce([dot(gap, gap) for gap in gaps])
    return np.where(crossed, 0.0, nearest), crossed
