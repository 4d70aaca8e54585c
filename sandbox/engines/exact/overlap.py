"""Overlap: what stands in one another. An engine without steps has nothing that would part it."""

from collections.abc import Iterator

import numpy as np

from sandbox.engines.fixtures import Fixtures
from sandbox.scene.near import near_pairs
from sandbox.trajectory import BoolArray, FloatArray

TOUCH = 1e-9
"""m: bodies that overlap by no more than this touch."""

ROUNDING = 4.0 * 2.0**-52
"""What two coordinates and their difference may be off by, as a share of them."""


def allowed(*coordinates: FloatArray) -> FloatArray:
    """Return the overlap (K,) that counts as touching at places (K, 2), m."""
    largest = np.max([np.abs(each).max(axis=-1) for each in coordinates], axis=0)
    return np.asarray(TOUCH + ROUNDING * largest)


def overlapping_balls(
    position: FloatArray, radius: FloatArray, to_all: BoolArray, to_fixed: BoolArray, fixed: BoolArray
) -> tuple[int, int, float] | None:
    """Return the first two balls that can meet and overlap, and how deep, m; None where none do.

    Args:
        position: (N, 2) m.
        radius: (N,) m.
        to_all: (N,) meets everything.
        to_fixed: (N,) meets fixed things alone.
        fixed: (N,) never moves.
    """
    chosen = np.flatnonzero(to_all | to_fixed)
    if len(chosen) < 2:
        return None
    found: list[tuple[int, int, float]] = []
    for a, b in near_pairs(position[chosen], 2.0 * float(radius[chosen].max()) * (1.0 + 1e-9)):
        i, j = chosen[np.minimum(a, b)], chosen[np.maximum(a, b)]
        apart = position[j] - position[i]
        depth = radius[i] + radius[j] - np.hypot(apart[:, 0], apart[:, 1])
        meet = (to_all[i] & to_all[j] & ~(fixed[i] & fixed[j])) | (to_all[i] & fixed[i] & ~fixed[j])
        meet |= to_all[j] & fixed[j] & ~fixed[i]
        deep = np.flatnonzero(meet & (depth > allowed(position[i], position[j])))
        if len(deep):
            first = deep[np.lexsort((j[deep], i[deep]))[0]]
            found.append((int(i[first]), int(j[first]), float(depth[first])))
    return min(found, default=None)


def overlapping_things(position: FloatArray, radius: FloatArray, fixtures: Fixtures) -> tuple[int, int, float] | None:
    """Return the first fixed thing that a ball overlaps, as (ball, thing, m); None where there is none.

    Args:
        position: (N, 2) m, of balls that can meet it.
        radius: (N,) m.
        fixtures: what is fixed.
    """
    if not len(position):
        return None
    for thing, gap, reach in _gaps(position, fixtures):
        deep = np.flatnonzero(radius - gap > allowed(position, reach))
        if len(deep):
            ball = int(deep[0])
            return ball, thing, float(radius[ball] - gap[ball])
    return None


def _gaps(position: FloatArray, fixtures: Fixtures) -> Iterator[tuple[int, FloatArray, FloatArray]]:
    """Yield each plane's and segment's thing, the gaps (N,) of centres to it, and the coordinates that matter."""
    for (px, py, nx, ny), thing in zip(fixtures.planes, fixtures.plane_thing.tolist(), strict=True):
        point = np.array([px, py])
        yield thing, (position[:, 0] - px) * nx + (position[:, 1] - py) * ny, np.broadcast_to(point, position.shape)
    for (ax, ay, bx, by, half), thing in zip(fixtures.segments, fixtures.segment_thing.tolist(), strict=True):
        dx, dy = bx - ax, by - ay
        square = dx * dx + dy * dy
        x, y = position[:, 0] - ax, position[:, 1] - ay
        along = np.clip((x * dx + y * dy) / square, 0.0, 1.0) if square > 0.0 else np.zeros(len(x))
        corners = np.broadcast_to(np.array([ax, ay, bx, by]), (len(x), 4))
        yield thing, np.hypot(x - along * dx, y - along * dy) - half, corners


def told(first: str, second: str, depth: float) -> str:
    """Say who overlaps whom."""
    return f"{first!r} and {second!r} overlap by {depth:.3g} m, and it has no way to part what overlaps"
