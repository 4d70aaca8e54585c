"""Contacts of convex pieces, from the candidates of the broad phases: up to two points each, written as manifolds.

Keys hold the pair and, in the lowest bit, which of its two points: the points of a pair stand one after the other.
"""

from typing import NamedTuple

from sandbox.engines.kernel import bare_kernel as kernel
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
def meet_bodies(
    keys: IntArray,
    hulls: Hulls,
    position: FloatArray,
    look: Look,
    out: Manifolds,
    at: int,
) -> int:
    """Write the pairs of pieces that are near from row `at` on; return the next free row."""
    body, surface, scratch = hulls.body, hulls.surface, look.scratch
    for k in range(len(keys)):
        p, q = keys[k] >> FIRST, keys[k] & SECOND
        count = meet_pieces(hulls.corner, hulls.first, hulls.radius, p, q, look.reach, scratch)
        for n in range(count):
            if at < len(out.key):
                i, j = body[p], body[q]
                out.key[at] = 2 * keys[k] + int(scratch[n, 5])
                out.first[at], out.second[at] = i, j
                _place(out, at, scratch, n, position[i, 0], position[i, 1], position[j, 0], position[j, 1])
                out.coefficient[at, 0] = look.restitution[surface[p], surface[q]]
                out.coefficient[at, 1] = look.friction[surface[p], surface[q]]
            at += 1
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
    body, surface, scratch = hulls.body, hulls.surface, look.scratch
    for p in range(len(body)):
        if not able[p]:
            continue
        i = body[p]
        for s in range(len(planes)):
            px, py, nx, ny = planes[s, 0], planes[s, 1], planes[s, 2], planes[s, 3]
            count = meet_half_plane(hulls.corner, hulls.first, hulls.radius, p, px, py, nx, ny, look.reach, scratch)
            for n in range(count):
                if at < len(out.key):
                    other = thing_surface[thing[s]]
                    out.key[at] = (1 << KIND) + 2 * pair_key(p, s) + int(scratch[n, 5])
                    out.first[at], out.second[at] = i, -1 - thing[s]
                    _place(out, at, scratch, n, position[i, 0], position[i, 1], px, py)
                    out.coefficient[at, 0] = look.restitution[surface[p], other]
                    out.coefficient[at, 1] = look.friction[surface[p], other]
                at += 1
    return at


@kernel
def meet_fixed_segments(
    keys: IntArray,
    hulls: Hulls,
    position: FloatArray,
    thing: IntArray,
    thing_surface: IntArray,
    look: Look,
    out: Manifolds,
    at: int,
) -> int:
    """Write the pieces near segments from row `at` on; return the next free row."""
    body, surface, scratch = hulls.body, hulls.surface, look.scratch
    for k in range(len(keys)):
        p, s = keys[k] >> FIRST, keys[k] & SECOND
        count = meet_pieces(hulls.corner, hulls.first, hulls.radius, p, len(body) + s, look.reach, scratch)
        for n in range(count):
            if at < len(out.key):
                i, other = body[p], thing_surface[thing[s]]
                out.key[at] = (2 << KIND) + 2 * keys[k] + int(scratch[n, 5])
                out.first[at], out.second[at] = i, -1 - thing[s]
                _place(out, at, scratch, n, position[i, 0], position[i, 1], scratch[n, 3], scratch[n, 4])
                out.coefficient[at, 0] = look.restitution[surface[p], other]
                out.coefficient[at, 1] = look.friction[surface[p], other]
            at += 1
    return at


@kernel
def _place(out: Manifolds, at: int, scratch: FloatArray, n: int, ax: float, ay: float, bx: float, by: float) -> None:
    """Write a point as two centres see it: the lever of each ends on its own surface."""
    nx, ny, separation, x, y = scratch[n, 0], scratch[n, 1], scratch[n, 2], scratch[n, 3], scratch[n, 4]
    out.normal[at, 0], out.normal[at, 1] = nx, ny
    out.separation[at] = separation
    out.point[at, 0], out.point[at, 1] = x, y
    half = 0.5 * separation
    out.arm[at, 0] = (x - ax) * nx + (y - ay) * ny - half
    out.arm[at, 1] = (bx - x) * nx + (by - y) * ny - half
    out.offset[at, 0] = (y - ay) * nx - (x - ax) * ny
    out.offset[at, 1] = (y - by) * nx - (x - bx) * ny
