"""Distances of convex hulls."""

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.scene.geometry.vectors import offset_from_segment

CHUNK = 1_000_000
"""Frames × corners × corners that are processed at once."""


def hull_distance(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the distance of two convex hulls in T frames, (T,) m; minus the penetration depth if they overlap.

    Overlap is found by separating axes, the normals of the edges. Otherwise a corner of one hull is nearest to the
    other.

    Args:
        first: (T, A, 2) m, counter-clockwise; one corner is a point, two are a segment.
        second: (T, B, 2) m, counter-clockwise.
    """
    frames = len(first)
    step = max(1, CHUNK // (first.shape[1] * second.shape[1]))
    parts = [_frame_hull_distance(first[k : k + step], second[k : k + step]) for k in range(0, frames, step)]
    return np.concatenate((np.empty(0), *parts))


def _frame_hull_distance(first: FloatArray, second: FloatArray) -> FloatArray:
    with np.errstate(over="ignore", invalid="ignore"):
        apart = np.minimum(_corners_off(first, second), _corners_off(second, first))
        separation = np.maximum(_separation(first, second), _separation(second, first))
    return np.where(separation < 0.0, np.where(np.isneginf(separation), apart, separation), apart)


def _corners_off(corners: FloatArray, hull: FloatArray) -> FloatArray:
    """Return the smallest distance of any corner from any edge, (T,) m."""
    along = np.roll(hull, -1, axis=1) - hull
    away = offset_from_segment(corners[:, :, None], hull[:, None], along[:, None])
    return np.asarray(np.hypot(away[..., 0], away[..., 1]).min(axis=(1, 2)))


def _separation(hull: FloatArray, corners: FloatArray) -> FloatArray:
    """Return the largest separation by an edge of a hull, (T,) m; −inf for a point, which has no edge."""
    if hull.shape[1] < 2:
        return np.full(len(hull), -np.inf)
    along = np.roll(hull, -1, axis=1) - hull
    length = np.hypot(along[..., 0], along[..., 1])
    normal = np.stack((along[..., 1], -along[..., 0]), axis=2) / np.where(length > 0.0, length, 1.0)[..., None]
    beyond = ((corners[:, None] - hull[:, :, None]) * normal[:, :, None]).sum(axis=3)
    return np.asarray(beyond.min(axis=2).max(axis=1))
