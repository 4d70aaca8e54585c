"""Contact manifolds as arrays, and those of circles with circles, half-planes and segments.

Narrow phase: whether and how a circle touches a half-plane, a segment or another circle.

Each function takes two shapes with their poses and returns a manifold: the separation (m; negative in overlap, and
only then is there contact) and the unit normal from the first shape to the second. For circles one point is enough:
it lies on the normal through the centre.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.kernel import bare_kernel, kernel
from sandbox.engines.reference.broad_phase import FIRST, SECOND, pair_key

Manifold = tuple[float, float, float]
"""separation, m, and normal x, y"""


@kernel
def circle_circle(ax: float, ay: float, a_radius: float, bx: float, by: float, b_radius: float) -> Manifold:
    """Return how two circles lie; coincident centres have the normal (1, 0), as in Munk2D."""
    x, y = bx - ax, by - ay
    distance = math.sqrt(x * x + y * y)
    if distance == 0.0:
        return -(a_radius + b_radius), 1.0, 0.0
    # By the reciprocal, as Munk2D divides: the same roundings.
    inverse = 1.0 / distance
    return distance - (a_radius + b_radius), x * inverse, y * inverse


@kernel
def circle_half_plane(x: float, y: float, radius: float, px: float, py: float, nx: float, ny: float) -> Manifold:
    """Return how a circle lies to a half-plane that is solid behind its normal: the tutorial's example 4.

    They intersect when the centre's height over the surface is less than the radius. With radius 1 over y = 0:

    >>> [circle_half_plane(0.0, y, 1.0, 0.0, 0.0, 0.0, 1.0)[0] < 0.0 for y in (2.0, 1.001, 1.0)]
    [False, False, False]
    >>> [circle_half_plane(0.0, y, 1.0, 0.0, 0.0, 0.0, 1.0)[0] < 0.0 for y in (0.999, 0.009, 0.0, -1.0)]
    [True, True, True, True]
    """
    return (x - px) * nx + (y - py) * ny - radius, -nx, -ny


@kernel
def circle_segment(
    x: float, y: float, radius: float, ax: float, ay: float, bx: float, by: float, half_thickness: float
) -> Manifold:
    """Return how a circle lies to a segment with round ends; one of no length is a circle.

    A centre on the segment itself leaves to its left; on one of no length, along x.
    """
    along_x, along_y = bx - ax, by - ay
    length2 = along_x * along_x + along_y * along_y
    fraction = 0.0
    if length2 > 0.0:
        fraction = min(max((along_x * (x - ax) + along_y * (y - ay)) / length2, 0.0), 1.0)
    dx, dy = ax + along_x * fraction - x, ay + along_y * fraction - y
    distance = math.sqrt(dx * dx + dy * dy)
    separation = distance - (radius + half_thickness)
    if distance > 0.0:
        inverse = 1.0 / distance
        return separation, dx * inverse, dy * inverse
    if length2 > 0.0:
        inverse = 1.0 / math.sqrt(length2)
        return separation, along_y * inverse, -along_x * inverse
    return separation, 1.0, 0.0


KIND = 60
"""Bits below the kind of a pair in its key: 0 ball-ball, 1 ball-plane, 2 ball-segment. Keys ascend."""


@bare_kernel
def is_covered(
    x: float,
    y: float,
    ax: float,
    ay: float,
    bx: float,
    by: float,
    nx: float,
    ny: float,
    before_x: float,
    before_y: float,
    after_x: float,
    after_y: float,
) -> bool:
    """Tell whether a circle touches an end of a segment beyond which the wall comes nearer to it.

    The contact is then left to the neighbouring segment. The rule is that of Munk2D's `cpSegmentShapeSetNeighbors`, in
    the same arithmetic.

    Args:
        x: of its centre, m.
        y: of its centre, m.
        ax: of the end at which the segment begins, m.
        ay: likewise.
        bx: of the end at which it ends, m.
        by: likewise.
        nx: of the normal, from the circle to the segment.
        ny: likewise.
        before_x: m, from the first end along the wall, away from the segment; 0 where the wall ends.
        before_y: likewise.
        after_x: likewise, from the second end.
        after_y: likewise.
    """
    along_x, along_y = bx - ax, by - ay
    length2 = along_x * along_x + along_y * along_y
    if length2 == 0.0 or (x == ax and y == ay) or (x == bx and y == by):
        return False
    fraction = (along_x * (x - ax) + along_y * (y - ay)) / length2
    if fraction <= 0.0:
        return nx * before_x + ny * before_y < 0.0
    return fraction >= 1.0 and nx * after_x + ny * after_y < 0.0


class Manifolds(NamedTuple):
    """K contacts, by ascending key. The second of a pair may be a static collider."""

    key: IntArray
    """(K,) says which pair of shapes, from step to step"""
    first: IntArray
    """(K,) body number"""
    second: IntArray
    """(K,) body number, or −1 − k"""
    normal: FloatArray
    """(K, 2) from the first to the second"""
    separation: FloatArray
    """(K,) m; negative in overlap"""
    point: FloatArray
    """(K, 2) m, midway in the overlap"""
    arm: FloatArray
    """(K, 2) m, from each centre to the contact along the normal, towards the other"""
    offset: FloatArray
    """(K, 2) m, how far to the left of the normal the contact lies from each centre; 0 for discs"""
    friction: FloatArray
    """(K,) coefficient of friction of the pair"""
    surface_pair: IntArray
    """(K,) index of the pair of surfaces, row·S + column, in a table (S, S): of restitution, damping or falloff"""

    @property
    def size(self) -> int:
        """K."""
        return len(self.key)

    def of(self, which: IntArray | BoolArray | slice) -> "Manifolds":
        """Return some of them."""
        columns: Any = (column[which] for column in self)
        return Manifolds(*columns)

    def joined(self, more: "Manifolds") -> "Manifolds":
        """Return these and more, one after the other: their keys need not ascend."""
        columns: Any = (np.concatenate(pair) for pair in zip(self, more, strict=True))
        return Manifolds(*columns)


@bare_kernel
def find_ball_contacts(
    keys: IntArray,
    position: FloatArray,
    radius: FloatArray,
    surface: IntArray,
    friction: FloatArray,
    reach: float,
    out: Manifolds,
    at: int,
) -> int:
    """Write the pairs of balls nearer than `reach` from row `at` on; return the next free row."""
    for k in range(len(keys)):
        i, j = keys[k] >> FIRST, keys[k] & SECOND
        separation, nx, ny = circle_circle(
            position[i, 0], position[i, 1], radius[i], position[j, 0], position[j, 1], radius[j]
        )
        if separation < reach:
            if at < len(out.key):
                out.key[at] = keys[k]
                out.first[at], out.second[at] = i, j
                _place(out, at, position[i, 0], position[i, 1], radius[i], radius[j], separation, nx, ny)
                out.friction[at] = friction[surface[i], surface[j]]
                out.surface_pair[at] = surface[i] * len(friction) + surface[j]
            at += 1
    return at


@bare_kernel
def find_plane_contacts(
    position: FloatArray,
    radius: FloatArray,
    can_touch: BoolArray,
    surface: IntArray,
    planes: FloatArray,
    collider: IntArray,
    collider_surface: IntArray,
    friction: FloatArray,
    reach: float,
    out: Manifolds,
    at: int,
) -> int:
    """Write the balls nearer than `reach` to half-planes from row `at` on; return the next free row."""
    for i in range(len(position)):
        if not can_touch[i]:
            continue
        for p in range(len(planes)):
            separation, nx, ny = circle_half_plane(
                position[i, 0], position[i, 1], radius[i], planes[p, 0], planes[p, 1], planes[p, 2], planes[p, 3]
            )
            if separation < reach:
                if at < len(out.key):
                    other = collider_surface[collider[p]]
                    out.key[at] = (1 << KIND) + pair_key(i, p)
                    out.first[at], out.second[at] = i, -1 - collider[p]
                    _place(out, at, position[i, 0], position[i, 1], radius[i], 0.0, separation, nx, ny)
                    out.friction[at] = friction[surface[i], other]
                    out.surface_pair[at] = surface[i] * len(friction) + other
                at += 1
    return at


@bare_kernel
def find_segment_contacts(
    keys: IntArray,
    position: FloatArray,
    radius: FloatArray,
    surface: IntArray,
    segments: FloatArray,
    joints: FloatArray,
    collider: IntArray,
    collider_surface: IntArray,
    friction: FloatArray,
    reach: float,
    out: Manifolds,
    at: int,
) -> int:
    """Write the balls nearer than `reach` to segments from row `at` on; return the next free row."""
    for k in range(len(keys)):
        i, s = keys[k] >> FIRST, keys[k] & SECOND
        separation, nx, ny = circle_segment(
            position[i, 0],
            position[i, 1],
            radius[i],
            segments[s, 0],
            segments[s, 1],
            segments[s, 2],
            segments[s, 3],
            segments[s, 4],
        )
        if separation < reach and not is_covered(
            position[i, 0],
            position[i, 1],
            segments[s, 0],
            segments[s, 1],
            segments[s, 2],
            segments[s, 3],
            nx,
            ny,
            joints[s, 0],
            joints[s, 1],
            joints[s, 2],
            joints[s, 3],
        ):
            if at < len(out.key):
                other = collider_surface[collider[s]]
                out.key[at] = (2 << KIND) + keys[k]
                out.first[at], out.second[at] = i, -1 - collider[s]
                _place(out, at, position[i, 0], position[i, 1], radius[i], segments[s, 4], separation, nx, ny)
                out.friction[at] = friction[surface[i], other]
                out.surface_pair[at] = surface[i] * len(friction) + other
            at += 1
    return at


@bare_kernel
def _place(
    out: Manifolds, at: int, x: float, y: float, a_arm: float, b_arm: float, separation: float, nx: float, ny: float
) -> None:
    out.normal[at, 0], out.normal[at, 1] = nx, ny
    out.separation[at] = separation
    out.arm[at, 0], out.arm[at, 1] = a_arm, b_arm
    middle = a_arm + 0.5 * separation
    out.point[at, 0], out.point[at, 1] = x + nx * middle, y + ny * middle
