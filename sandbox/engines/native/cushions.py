"""Cushions: what balls on a floor meet that never moves, for kernels, and how far they are from it."""

import math
from typing import NamedTuple

import numpy as np

from sandbox.engines.fixtures import fixtures_of
from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.scene.model import Post, Scene, Wall
from sandbox.trajectory import FloatArray, IntArray


class Cushions(NamedTuple):
    """F fixed things; the first P are planes."""

    planes: FloatArray
    """(P, 4) a point of the surface, m, and the unit normal out of the solid"""
    segments: FloatArray
    """(G, 5) both ends and half the thickness, m; a post is a segment of no length"""
    first: IntArray
    """(F + 1,) the first segment of each thing; the last entry is their number"""
    height: FloatArray
    """(F,) m, of the nose above the floor; 0 is that of the ball's centre"""
    surface: IntArray
    """(F,)"""


def cushions_of(scene: Scene, surface: IntArray) -> Cushions:
    """Lay out a scene's fixed things, which have surfaces (F,)."""
    fixtures = fixtures_of(scene)
    first = np.searchsorted(fixtures.segment_thing, np.arange(len(scene.fixed) + 1))
    height = [thing.height or 0.0 if isinstance(thing, Wall | Post) else 0.0 for thing in scene.fixed]
    return Cushions(fixtures.planes, fixtures.segments, first, np.asarray(height, dtype=np.float64), surface)


@kernel
def gap_to(cushions: Cushions, k: int, x: float, y: float, vx: float, vy: float) -> tuple[float, float, float]:
    """Return how far a point is from a thing's surface, m, and the unit normal into it.

    Args:
        cushions: all things.
        k: which.
        x: of the point, m.
        y: likewise.
        vx: the way that it goes; on the very middle of a wall that is taken for the normal.
        vy: likewise.
    """
    if k < len(cushions.planes):
        plane = cushions.planes[k]
        return (x - plane[0]) * plane[2] + (y - plane[1]) * plane[3], -plane[2], -plane[3]
    best, nx, ny = math.inf, 0.0, 0.0
    for j in range(cushions.first[k], cushions.first[k + 1]):
        segment = cushions.segments[j]
        ax, ay, half = segment[0], segment[1], segment[4]
        ux, uy = segment[2] - ax, segment[3] - ay
        length2 = ux * ux + uy * uy
        share = ((x - ax) * ux + (y - ay) * uy) / length2 if length2 > 0.0 else 0.0
        share = min(max(share, 0.0), 1.0)
        dx, dy = ax + share * ux - x, ay + share * uy - y
        distance = math.sqrt(dx * dx + dy * dy)
        if distance - half < best:
            best = distance - half
            nx, ny = (dx / distance, dy / distance) if distance > 0.0 else (0.0, 0.0)
    if nx == 0.0 and ny == 0.0:
        speed = math.sqrt(vx * vx + vy * vy)
        nx, ny = (vx / speed, vy / speed) if speed > 0.0 else (1.0, 0.0)
    return best, nx, ny
