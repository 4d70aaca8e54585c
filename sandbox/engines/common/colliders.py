"""Static colliders: the planes, walls and posts of a scene as arrays, for the hand-written engines.

Where two segments of a wall join, their ends are internal: a body that slides or rolls from one to the other must not
collide with a corner there. So points in line with their neighbours are removed, and each segment stores the far ends
of its neighbours (ghost vertices, as in Box2D's chain shapes). The ends of an open wall, and corners, are solid.
"""

import math
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.scene.compile.derived import derived_once
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import Point
from sandbox.scene.description.fixed import Plane, Wall

IN_LINE = 4 * 2.0**-52
"""Distance of a point from the line through its neighbours, as a fraction of its coordinates, up to which it is in
line: two roundings of each coordinate."""

LEAN = 1e-9
"""Sine of the angle up to which a contact normal does not lean over a joint of a wall: smaller angles are rounding."""


class StaticColliders(NamedTuple):
    """Static colliders. Collider k (planes, walls, posts in scene order) has index k here and −1 − k in contacts."""

    planes: FloatArray
    """(P, 4) a point of the surface, m, and the unit normal pointing out of the solid"""
    plane_collider: IntArray
    """(P,) index of the collider of each plane"""
    segments: FloatArray
    """(G, 5) both ends and half the thickness, m; a post is a segment of length 0"""
    segment_collider: IntArray
    """(G,) index of the collider that each segment belongs to"""
    joints: FloatArray
    """(G, 4) m, from the two ends of a segment to the far ends of its neighbours; 0 where the wall ends"""


class WallSegment(NamedTuple):
    """Straight part of a wall."""

    a: Point
    b: Point
    before: Point | None
    """m, the other end of the segment that ends at `a`; None where the wall begins"""
    after: Point | None
    """m, the other end of the segment that begins at `b`; None where the wall ends"""

    @property
    def joints(self) -> tuple[float, float, float, float]:
        """Displacements from the two ends to the far ends of the neighbours, m; 0 where the wall ends."""
        before, after = self.before or self.a, self.after or self.b
        return before[0] - self.a[0], before[1] - self.a[1], after[0] - self.b[0], after[1] - self.b[1]


def wall_segments(wall: Wall) -> list[WallSegment]:
    """Return the straight parts of a wall in order. Points in line with their neighbours do not divide it."""
    points = straightened(wall)
    is_closed = points[0] == points[-1] and len(points) > 3
    segments = []
    for k in range(len(points) - 1):
        before = points[k - 1] if k > 0 else points[-2] if is_closed else None
        after = points[k + 2] if k + 2 < len(points) else points[1] if is_closed else None
        segments.append(WallSegment(points[k], points[k + 1], before, after))
    return segments


def straightened(wall: Wall) -> tuple[Point, ...]:
    """Return the points of a wall without those in line with their neighbours.

    A closed wall ends with its first point.
    """
    points = (*wall.points, wall.points[0]) if wall.closed else wall.points
    kept = [points[0]]
    for k in range(1, len(points) - 1):
        if not _in_line(kept[-1], points[k], points[k + 1]):
            kept.append(points[k])
    return *kept, points[-1]


def _in_line(a: Point, b: Point, c: Point) -> bool:
    """Return whether b lies between a and c, on the line through them up to rounding."""
    ux, uy, vx, vy = b[0] - a[0], b[1] - a[1], c[0] - b[0], c[1] - b[1]
    if ux * vx + uy * vy <= 0.0:
        return False
    distance = abs(ux * vy - uy * vx) / math.hypot(c[0] - a[0], c[1] - a[1])
    return distance <= IN_LINE * max(map(abs, (*a, *b, *c)))


def static_colliders(start: Scene | Setup, everything: bool = False) -> StaticColliders:
    """Return a scene's static colliders as arrays: the solid ones, or all with `everything`.

    They are derived once for each scene or setup and shared, so that their arrays must not be changed. A scene is
    compiled for that; a setup is compiled already.
    """
    return _all_colliders(start) if everything else _solid_colliders(start)


def _collect(scene: Scene, everything: bool) -> StaticColliders:
    planes, segments, joints = [], [], []
    for k, collider in enumerate(scene.fixed):
        if not (isinstance(collider, Plane) or collider.solid or everything):
            continue
        if isinstance(collider, Plane):
            # Scale first: the square of a very long or short normal would overflow or underflow.
            largest = max(abs(collider.normal[0]), abs(collider.normal[1]))
            x, y = collider.normal[0] / largest, collider.normal[1] / largest
            length = math.hypot(x, y)
            planes.append((k, *collider.point, x / length, y / length))
        elif isinstance(collider, Wall):
            parts = wall_segments(collider)
            segments += [(k, *part.a, *part.b, collider.thickness / 2.0) for part in parts]
            joints += [part.joints for part in parts]
        else:
            segments.append((k, *collider.position, *collider.position, collider.radius))
            joints.append((0.0, 0.0, 0.0, 0.0))
    plane_rows = np.asarray(planes, dtype=np.float64).reshape(-1, 5)
    segment_rows = np.asarray(segments, dtype=np.float64).reshape(-1, 6)
    return StaticColliders(
        plane_rows[:, 1:].copy(),
        plane_rows[:, 0].astype(np.int64),
        segment_rows[:, 1:].copy(),
        segment_rows[:, 0].astype(np.int64),
        np.asarray(joints, dtype=np.float64).reshape(-1, 4),
    )


_solid_colliders = derived_once(lambda setup: _collect(setup.scene, everything=False))
_all_colliders = derived_once(lambda setup: _collect(setup.scene, everything=True))
