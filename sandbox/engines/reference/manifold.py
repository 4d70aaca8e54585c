"""Contact manifolds as arrays, and those of circles with circles, half-planes and segments.

Each narrow-phase function takes two shapes with their poses and returns the separation, m, which is negative in
overlap, and the unit normal from the first shape to the second. A contact of a circle has one point, on the normal
through the centre.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.geometry import nearest_fraction
from sandbox.engines.common.kernel import bare_kernel, inline_kernel, kernel
from sandbox.engines.reference.broad_phase import FIRST, SECOND, pair_key

Manifold = tuple[float, float, float]
"""separation, m, and normal x, y"""


@kernel
def circle_circle(ax: float, ay: float, a_radius: float, bx: float, by: float, b_radius: float) -> Manifold:
    """Return separation and normal of two circles; coincident centres have the normal (1, 0), as in Munk2D."""
    x, y = bx - ax, by - ay
    distance = math.sqrt(x * x + y * y)
    if distance == 0.0:
        return -(a_radius + b_radius), 1.0, 0.0
    # By the reciprocal, with the same roundings as Munk2D.
    inverse = 1.0 / distance
    return distance - (a_radius + b_radius), x * inverse, y * inverse


@kernel
def circle_half_plane(x: float, y: float, radius: float, px: float, py: float, nx: float, ny: float) -> Manifold:
    """Return separation and normal of a circle and a half-plane, solid behind its normal: the tutorial's example 4.

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
    """Return separation and normal of a circle and a segment with round ends. A segment of length 0 is a circle.

    If the centre lies on the segment, the normal points to the right of it; if its length is 0, along x.
    """
    along_x, along_y = bx - ax, by - ay
    length2 = along_x * along_x + along_y * along_y
    fraction = nearest_fraction(ax, ay, bx, by, x, y)
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


CLEARLY_APART = 1e-9
"""Relative distance beyond a limit at which rounding, 1e-16, does not matter"""

CONTACT_ROUNDING = 1e-12
"""Overlap as a fraction of the contact distance, and change of velocity as a fraction of the speed, that is rounding"""

KIND = 60
"""Number of bits below the kind of a pair in its key: 0 ball-ball, 1 ball-plane, 2 ball-segment"""


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
    """Return whether a circle touches an end of a segment at which the continuation of the wall is nearer to it.

    The neighbouring segment then has the contact. The rule is that of Munk2D's `cpSegmentShapeSetNeighbors`, in
    the same arithmetic.

    Args:
        x: centre of the circle, m.
        y: likewise.
        ax: first end of the segment, m.
        ay: likewise.
        bx: second end, m.
        by: likewise.
        nx: normal, from the circle to the segment.
        ny: likewise.
        before_x: continuation of the wall at the first end, away from the segment, m; 0 if the wall ends there.
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
    """K contacts, by ascending key. The second body of a pair may be a static collider."""

    key: IntArray
    """(K,) identifies the pair of shapes from step to step"""
    first: IntArray
    """(K,) body index"""
    second: IntArray
    """(K,) body index, or −1 − k of static collider k"""
    normal: FloatArray
    """(K, 2) from the first to the second"""
    separation: FloatArray
    """(K,) m; negative in overlap"""
    point: FloatArray
    """(K, 2) m, in the middle of the overlap"""
    rn: FloatArray
    """(K, 2) m, component along the normal of each arm r, the vector from a centre to the contact; positive towards the
    other body"""
    rt: FloatArray
    """(K, 2) m, component of each arm along the tangent, to the left of the normal; 0 for discs"""
    friction: FloatArray
    """(K,) coefficient of friction of the pair"""
    slip_target: FloatArray
    """(K,) m/s, velocity of the second body relative to the first, to the left of the normal, without slip; not 0 only
    if a surface moves"""
    surface_pair: IntArray
    """(K,) index of the pair of surfaces, row·S + column, in tables (S, S) of restitution, damping and falloff"""

    @property
    def size(self) -> int:
        """Number of contacts K."""
        return len(self.key)

    def of(self, which: IntArray | BoolArray | slice) -> "Manifolds":
        """Return some of the contacts."""
        columns: Any = (column[which] for column in self)
        return Manifolds(*columns)

    def joined(self, more: "Manifolds") -> "Manifolds":
        """Return these contacts followed by others; the keys need not ascend then."""
        columns: Any = (np.concatenate(pair) for pair in zip(self, more, strict=True))
        return Manifolds(*columns)


@bare_kernel
def find_ball_contacts(
    keys: IntArray,
    position: FloatArray,
    radius: FloatArray,
    surface: IntArray,
    tangential: FloatArray,
    max_separation: float,
    out: Manifolds,
    row: int,
) -> int:
    """Write the contacts of pairs of balls from row `row` on; return the next free row."""
    for k in range(len(keys)):
        i, j = keys[k] >> FIRST, keys[k] & SECOND
        x, y = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
        reach = (radius[i] + radius[j] + max_separation) * (1.0 + CLEARLY_APART)
        if x * x + y * y > reach * reach:  # saves the square root
            continue
        separation, nx, ny = circle_circle(
            position[i, 0], position[i, 1], radius[i], position[j, 0], position[j, 1], radius[j]
        )
        if separation < max_separation:
            if row < len(out.key):
                out.key[row] = keys[k]
                out.first[row], out.second[row] = i, j
                _write_circle_contact(
                    out, row, position[i, 0], position[i, 1], radius[i], radius[j], separation, nx, ny
                )
                write_surfaces(out, row, tangential, surface[i], surface[j])
            row += 1
    return row


@bare_kernel
def find_plane_contacts(
    position: FloatArray,
    radius: FloatArray,
    can_touch: BoolArray,
    surface: IntArray,
    planes: FloatArray,
    collider: IntArray,
    collider_surface: IntArray,
    tangential: FloatArray,
    max_separation: float,
    out: Manifolds,
    row: int,
) -> int:
    """Write the contacts of balls with half-planes from row `row` on; return the next free row."""
    for i in range(len(position)):
        if not can_touch[i]:
            continue
        for p in range(len(planes)):
            separation, nx, ny = circle_half_plane(
                position[i, 0], position[i, 1], radius[i], planes[p, 0], planes[p, 1], planes[p, 2], planes[p, 3]
            )
            if separation < max_separation:
                if row < len(out.key):
                    other = collider_surface[collider[p]]
                    out.key[row] = (1 << KIND) + pair_key(i, p)
                    out.first[row], out.second[row] = i, -1 - collider[p]
                    _write_circle_contact(out, row, position[i, 0], position[i, 1], radius[i], 0.0, separation, nx, ny)
                    write_surfaces(out, row, tangential, surface[i], other)
                row += 1
    return row


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
    tangential: FloatArray,
    max_separation: float,
    out: Manifolds,
    row: int,
) -> int:
    """Write the contacts of balls with segments from row `row` on; return the next free row."""
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
        if separation < max_separation and not is_covered(
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
            if row < len(out.key):
                other = collider_surface[collider[s]]
                out.key[row] = (2 << KIND) + keys[k]
                out.first[row], out.second[row] = i, -1 - collider[s]
                _write_circle_contact(
                    out, row, position[i, 0], position[i, 1], radius[i], segments[s, 4], separation, nx, ny
                )
                write_surfaces(out, row, tangential, surface[i], other)
            row += 1
    return row


@inline_kernel
def write_surfaces(out: Manifolds, row: int, tangential: FloatArray, first: int, second: int) -> None:
    """Write the surfaces of a contact whose normal has been written, and their coefficients, into row `row`.

    Args:
        out: buffer of manifolds.
        row: its row.
        tangential: (S, S, 4) as `BodyStore.tangential`.
        first: surface of the first body.
        second: surface of the second.
    """
    out.friction[row] = tangential[first, second, 0]
    across = tangential[first, second, 3] * out.normal[row, 0] - tangential[first, second, 2] * out.normal[row, 1]
    out.slip_target[row] = tangential[first, second, 1] + across
    out.surface_pair[row] = first * len(tangential) + second


@bare_kernel
def _write_circle_contact(
    out: Manifolds,
    row: int,
    x: float,
    y: float,
    rn_a: float,
    rn_b: float,
    separation: float,
    nx: float,
    ny: float,
) -> None:
    out.normal[row, 0], out.normal[row, 1] = nx, ny
    out.separation[row] = separation
    out.rn[row, 0], out.rn[row, 1] = rn_a, rn_b
    middle = rn_a + 0.5 * separation
    out.point[row, 0], out.point[row, 1] = x + nx * middle, y + ny * middle
