"""Fixtures: the planes, walls and posts of a scene as arrays, for the engines written by hand.

Where two segments of a wall join, neither end is an edge of the wall: what slides or rolls from one to the other meets
no corner there. So points in line with their neighbours are left out, and each segment knows how the wall runs on from
its ends (ghost vertices, as in Box2D's chain shapes). The ends of an open wall, and corners, are solid.
"""

import math
from typing import NamedTuple

import numpy as np

from sandbox.scene.model import Plane, Scene, Wall
from sandbox.scene.part import Point
from sandbox.trajectory import FloatArray, IntArray

IN_LINE = 4 * 2.0**-52
"""Part of its coordinates by which a point may lie off the line through its neighbours: two roundings of each."""


class Fixtures(NamedTuple):
    """What never moves. Fixed thing k (planes, walls, posts in scene order) is numbered k here, −1 − k in contacts."""

    planes: FloatArray
    """(P, 4) a point of the surface, m, and the unit normal out of the solid"""
    plane_thing: IntArray
    """(P,) which fixed thing each is"""
    segments: FloatArray
    """(G, 5) both ends and half the thickness, m; a post is a segment of no length"""
    segment_thing: IntArray
    """(G,) which fixed thing each belongs to"""
    joints: FloatArray
    """(G, 4) m, from both ends of a segment to the far ends of its neighbours; 0 where the wall ends"""


class WallSegment(NamedTuple):
    """A straight part of a wall."""

    a: Point
    b: Point
    before: Point | None
    """the other end of the segment that ends at `a`, m; none where the wall begins there"""
    after: Point | None
    """the other end of the segment that begins at `b`, m; none where the wall ends there"""

    @property
    def joints(self) -> tuple[float, float, float, float]:
        """From both ends to the far ends of the neighbours, m; 0 where the wall ends."""
        before, after = self.before or self.a, self.after or self.b
        return before[0] - self.a[0], before[1] - self.a[1], after[0] - self.b[0], after[1] - self.b[1]


def wall_segments(wall: Wall) -> list[WallSegment]:
    """Return the straight parts of a wall, in its order: points in line with their neighbours divide nothing."""
    line = straightened(wall)
    looped = line[0] == line[-1] and len(line) > 3
    found = []
    for k in range(len(line) - 1):
        before = line[k - 1] if k > 0 else line[-2] if looped else None
        after = line[k + 2] if k + 2 < len(line) else line[1] if looped else None
        found.append(WallSegment(line[k], line[k + 1], before, after))
    return found


def straightened(wall: Wall) -> tuple[Point, ...]:
    """Return the points of a wall, the first one again at the end of a closed one, without those in line."""
    points = (*wall.points, wall.points[0]) if wall.closed else wall.points
    kept = [points[0]]
    for k in range(1, len(points) - 1):
        if not _in_line(kept[-1], points[k], points[k + 1]):
            kept.append(points[k])
    return *kept, points[-1]


def _in_line(a: Point, b: Point, c: Point) -> bool:
    """Tell whether b lies between a and c, on the line through them but for rounding."""
    ux, uy, vx, vy = b[0] - a[0], b[1] - a[1], c[0] - b[0], c[1] - b[1]
    if ux * vx + uy * vy <= 0.0:
        return False
    off = abs(ux * vy - uy * vx) / math.hypot(c[0] - a[0], c[1] - a[1])
    return off <= IN_LINE * max(map(abs, (*a, *b, *c)))


def fixtures_of(scene: Scene, everything: bool = False) -> Fixtures:
    """Lay out a scene's fixed things: those that are solid, or everything."""
    planes, segments, joints = [], [], []
    for k, thing in enumerate(scene.fixed):
        if not (isinstance(thing, Plane) or thing.solid or everything):
            continue
        if isinstance(thing, Plane):
            # Scaled first: the square of a very long or short normal would leave the range of doubles.
            largest = max(abs(thing.normal[0]), abs(thing.normal[1]))
            x, y = thing.normal[0] / largest, thing.normal[1] / largest
            length = math.hypot(x, y)
            planes.append((k, *thing.point, x / length, y / length))
        elif isinstance(thing, Wall):
            parts = wall_segments(thing)
            segments += [(k, *part.a, *part.b, thing.thickness / 2.0) for part in parts]
            joints += [part.joints for part in parts]
        else:
            segments.append((k, *thing.position, *thing.position, thing.radius))
            joints.append((0.0, 0.0, 0.0, 0.0))
    flat = np.asarray(planes, dtype=np.float64).reshape(-1, 5)
    thin = np.asarray(segments, dtype=np.float64).reshape(-1, 6)
    return Fixtures(
        flat[:, 1:].copy(),
        flat[:, 0].astype(np.int64),
        thin[:, 1:].copy(),
        thin[:, 0].astype(np.int64),
        np.asarray(joints, dtype=np.float64).reshape(-1, 4),
    )
