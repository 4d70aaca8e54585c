"""Distance: how far apart two convex pieces are, frame by frame, each the hull of its corners."""

import numpy as np

from sandbox.arrays import FloatArray

CHUNK = 1_000_000
"""Frames × corners × corners worked on at once."""


def hull_distance(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the distance of two hulls in each of T frames, (T,) m; negative, the least way out, where they overlap.

    Overlap is told by separating axes, which are normals of edges. Apart, one of the two is nearest with a corner.

    Args:
        first: (T, A, 2) m, counter-clockwise; one corner is a point, two are a segment.
        second: (T, B, 2) m, likewise.
    """
    frames = len(first)
    step = max(1, CHUNK // (first.shape[1] * second.shape[1]))
    parts = [_distance(first[k : k + step], second[k : k + step]) for k in range(0, frames, step)]
    return np.concatenate((np.empty(0), *parts))


def _distance(first: FloatArray, second: FloatArray) -> FloatArray:
    with np.errstate(over="ignore", invalid="ignore"):
        apart = np.minimum(_corners_off(first, second), _corners_off(second, first))
        separation = np.maximum(_separation(first, second), _separation(second, first))
    return np.where(separation < 0.0, np.where(np.isneginf(separation), apart, separation), apart)


def _corners_off(corners: FloatArray, hull: FloatArray) -> FloatArray:
    """Return the least distance of any corner from any edge, (T,) m."""
    along = np.roll(hull, -1, axis=1) - hull
    squared = (along * along).sum(axis=2)
    offset = corners[:, :, None] - hull[:, None]
    share = (offset * along[:, None]).sum(axis=3) / np.where(squared > 0.0, squared, 1.0)[:, None]
    away = offset - share.clip(0.0, 1.0)[..., None] * along[:, None]
    return np.asarray(np.hypot(away[..., 0], away[..., 1]).min(axis=(1, 2)))


def _separation(hull: FloatArray, corners: FloatArray) -> FloatArray:
    """Return how far all corners are beyond one edge of a hull, at best, (T,) m; −inf of a point, which has none."""
    if hull.shape[1] < 2:
        return np.full(len(hull), -np.inf)
    along = np.roll(hull, -1, axis=1) - hull
    length = np.hypot(along[..., 0], along[..., 1])
    normal = np.stack((along[..., 1], -along[..., 0]), axis=2) / np.where(length > 0.0, length, 1.0)[..., None]
    beyond = ((corners[:, None] - hull[:, :, None]) * normal[:, :, None]).sum(axis=3)
    return np.asarray(beyond.min(axis=2).max(axis=1))
