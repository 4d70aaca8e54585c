"""Distances and Minkowski differences of convex hulls."""

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.scene.geometry.vectors import offset_from_segment

CHUNK = 1_000_000
"""Frames × corners × corners that are processed at once."""


def convex_hull(points: FloatArray) -> FloatArray:
    """Return the corners of the convex hull of points, (V, 2) m, counter-clockwise, without those within an edge.

    By monotone chains (Andrew 1979). One corner is a point, two are a segment.

    Args:
        points: (K, 2) m, at least one.
    """
    ordered = np.unique(points, axis=0).tolist()
    if len(ordered) < 3:
        return np.asarray(ordered, np.float64)
    chains = [_chain(ordered), _chain(ordered[::-1])]
    return np.asarray(chains[0][:-1] + chains[1][:-1], np.float64)


def _chain(ordered: list[list[float]]) -> list[list[float]]:
    """Return the points of a chain that turns to the left at each of them."""
    chain: list[list[float]] = []
    for x, y in ordered:
        while len(chain) > 1:
            (ax, ay), (bx, by) = chain[-2:]
            if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0:
                break
            chain.pop()
        chain.append([x, y])
    return chain


def minkowski_difference(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the corners of the set of differences of the points of two convex hulls, (V, 2) m, counter-clockwise.

    Where the second hull is moved by a vector in it, the hulls touch or overlap.

    Args:
        first: (A, 2) m, corners.
        second: (B, 2) m, corners.
    """
    return convex_hull((first[:, None] - second).reshape(-1, 2))


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
