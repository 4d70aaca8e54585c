"""Contacts of convex pieces, from the candidates of the broad phases: up to two points each, written as manifolds.

Keys hold the pair and, in the lowest bit, which of its two points: the points of a pair stand one after the other.
"""

from typing import NamedTuple

from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.engines.reference.chains import is_covered, smooth
from sandbox.engines.reference.convex import meet_half_plane, meet_pieces
from sandbox.engines.reference.manifolds import KIND, Manifolds
from sandbox.engines.reference.meeting import FIRST, SECOND, listed, pair_key
from sandbox.engines.reference.oriented_boxes import box_of, boxes_apart
from sandbox.engines.reference.pieces import Hulls
from sandbox.trajectory import BoolArray, FloatArray, IntArray


class Look(NamedTuple):
    """How to look."""

    restitution: FloatArray
    """(S, S) of pairs of surfaces"""
    friction: FloatArray
    """(S, S) of pairs of surfaces"""
    reach: float
    """m, below which what parts two pieces is a contact"""
    scratch: FloatArray
    """(2, 6)"""


@kernel
def drop(keys: IntArray, body: IntArray, apart: IntArray, group: IntArray) -> int:
    """Keep, at the front, the pairs of pieces that may meet, and return how many.

    They are of two bodies, which are neither joined nor of one group.
    """
    kept = 0
    for k in range(len(keys)):
        a, b = body[keys[k] >> FIRST], body[keys[k] & SECOND]
        if a == b or (group[a] != 0 and group[a] == group[b]):
            continue
        if not listed(apart, pair_key(min(a, b), max(a, b))):
            keys[kept] = keys[k]
            kept += 1
    return kept


@kernel
def lay_boxes(corner: FloatArray, first: IntArray, radius: FloatArray, box: FloatArray) -> None:
    """Write the oriented box around each piece, a row of (P, 6) each."""
    for p in range(len(box)):
        x, y, ax, ay, along, across = box_of(corner, first, radius, p)
        box[p, 0], box[p, 1], box[p, 2], box[p, 3], box[p, 4], box[p, 5] = x, y, ax, ay, along, across


@kernel
def drop_apart(keys: IntArray, offset: int, box: FloatArray, margin: float) -> int:
    """Keep, at the front, the pairs whose oriented boxes, widened by the margin, overlap; return how many."""
    kept = 0
    for k in range(len(keys)):
        if not boxes_apart(box[keys[k] >> FIRST], box[offset + (keys[k] & SECOND)], margin):
            keys[kept] = keys[k]
            kept += 1
    return kept


@kernel
def meet_bodies(keys: IntArray, hulls: Hulls, position: FloatArray, look: Look, out: Manifolds, at: int) -> int:
    """Write the pairs of pieces that are near from row `at` on; return the next free row."""
    for k in range(len(keys)):
        p, q = keys[k] >> FIRST, keys[k] & SECOND
        j = hulls.body[q]
        count = meet_pieces(hulls.corner, hulls.first, hulls.radius, p, q, look.reach, look.scratch)
        at = _write(hulls, look, count, 2 * keys[k], p, j, hulls.surface[q], position, out, at)
    return at


@kernel
def meet_half_planes(
    hulls: Hulls,
    able: BoolArray,
    position: FloatArray,
    planes: FloatArray,
    thing: IntArray,
    thing_surface: IntArray,
    look: Look,
    out: Manifolds,
    at: int,
) -> int:
    """Write the pieces near half-planes from row `at` on; return the next free row."""
    for p in range(len(hulls.body)):
        if not able[p]:
            continue
        for s in range(len(planes)):
            px, py, nx, ny = planes[s, 0], planes[s, 1], planes[s, 2], planes[s, 3]
            count = meet_half_plane(
                hulls.corner, hulls.first, hulls.radius, p, px, py, nx, ny, look.reach, look.scratch
            )
            key, other = (1 << KIND) + 2 * pair_key(p, s), thing_surface[thing[s]]
            at = _write(hulls, look, count, key, p, -1 - thing[s], other, position, out, at)
    return at


@kernel
def meet_fixed_segments(
    keys: IntArray,
    hulls: Hulls,
    position: FloatArray,
    joints: FloatArray,
    thing: IntArray,
    thing_surface: IntArray,
    look: Look,
    out: Manifolds,
    at: int,
) -> int:
    """Write the pieces near segments from row `at` on; return the next free row."""
    for k in range(len(keys)):
        p, s = keys[k] >> FIRST, keys[k] & SECOND
        q = len(hulls.body) + s
        count = meet_pieces(hulls.corner, hulls.first, hulls.radius, p, q, look.reach, look.scratch)
        if count > 0 and joints[s].any():
            count = _smoothed(hulls, p, q, joints[s], count, look)
        key, other = (2 << KIND) + 2 * keys[k], thing_surface[thing[s]]
        at = _write(hulls, look, count, key, p, -1 - thing[s], other, position, out, at)
    return at


@kernel
def _smoothed(hulls: Hulls, p: int, q: int, joints: FloatArray, count: int, look: Look) -> int:
    """Mend the contact of a piece with a segment where the wall runs on from that; return how many points it has."""
    corner, a, b = hulls.corner, hulls.first[p], hulls.first[q]
    if hulls.first[p + 1] - a > 1:
        radii = hulls.radius[p], hulls.radius[q]
        return smooth(
            corner, a, hulls.first[p + 1], radii[0], b, radii[1], joints, count, look.reach, look.scratch
        )  # fmt: skip
    ax, ay, bx, by = corner[b, 0], corner[b, 1], corner[b + 1, 0], corner[b + 1, 1]
    nx, ny = look.scratch[0, 0], look.scratch[0, 1]
    x, y = corner[a, 0], corner[a, 1]
    covered = is_covered(x, y, ax, ay, bx, by, nx, ny, joints[0], joints[1], joints[2], joints[3])
    return 0 if covered else count


@kernel
def _write(
    hulls: Hulls,
    look: Look,
    count: int,
    key: int,
    p: int,
    second: int,
    other: int,
    position: FloatArray,
    out: Manifolds,
    at: int,
) -> int:
    """Write the points found in `look.scratch` from row `at` on, as far as there is room; return the next free row.

    Args:
        hulls: the pieces.
        look: with the points of two of them.
        count: how many points.
        key: of the pair, its lowest bit left for the point.
        p: the first piece.
        second: number of the second body, or −1 − k.
        other: surface of the second.
        position: (N, ≥ 2) m, of bodies.
        out: where to.
        at: from where on.
    """
    i, surface = hulls.body[p], hulls.surface[p]
    ax, ay = position[i, 0], position[i, 1]
    for n in range(count):
        if at < len(out.key):
            nx, ny, separation = look.scratch[n, 0], look.scratch[n, 1], look.scratch[n, 2]
            x, y, half = look.scratch[n, 3], look.scratch[n, 4], 0.5 * separation
            bx, by = x, y  # what is fixed has no centre to turn about
            if second >= 0:
                bx, by = position[second, 0], position[second, 1]
            out.key[at] = key + int(look.scratch[n, 5])
            out.first[at], out.second[at] = i, second
            out.normal[at, 0], out.normal[at, 1] = nx, ny
            out.separation[at] = separation
            out.point[at, 0], out.point[at, 1] = x, y
            # The lever of each ends on its own surface.
            out.arm[at, 0] = (x - ax) * nx + (y - ay) * ny - half
            out.arm[at, 1] = (bx - x) * nx + (by - y) * ny - half
            out.offset[at, 0] = (y - ay) * nx - (x - ax) * ny
            out.offset[at, 1] = (y - by) * nx - (x - bx) * ny
            out.coefficient[at, 0] = look.restitution[surface, other]
            out.coefficient[at, 1] = look.friction[surface, other]
        at += 1
    return at
