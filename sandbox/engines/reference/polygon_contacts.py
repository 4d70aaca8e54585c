"""Convex pieces in world coordinates, and their contacts with each other and with static colliders.

Contacts of convex pieces, from the candidates of the broad phases: up to two points each, written as manifolds.

Keys hold the pair and, in the lowest bit, which of its two points: the points of a pair stand one after the other.

Oriented boxes: a rectangle around each convex piece, turned with it, and whether two of them are apart.

Tighter than a disc or an axis-aligned box around a long piece, and four axes are tested whatever the number of corners.
"""

import math
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.body_store import NOTHING, BodyStore
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.contract import Exhaustion
from sandbox.engines.reference.broad_phase import FIRST, ROUNDING, SECOND, contains_key, pair_key
from sandbox.engines.reference.internal_edges import smooth
from sandbox.engines.reference.manifold import KIND, Manifolds, is_covered
from sandbox.engines.reference.polygon import collide_half_plane, collide_pieces, next_corner
from sandbox.resource_limits import MEMORY
from sandbox.scene.compile.joint_arrays import JointArrays

BYTES_PER_PAIR = 6 * 8
"""Both numbers, the key, and sorting it."""


class ConvexHulls(NamedTuple):
    """P pieces in the world, of which the first S belong to bodies."""

    corner: FloatArray
    """(V, 2) m"""
    first: IntArray
    """(P + 1,) row of each one's first corner"""
    radius: FloatArray
    """(P,) m"""
    body: IntArray
    """(S,) number of each one's body"""
    surface: IntArray
    """(S,)"""


class WorldPieces:
    """S pieces of bodies and G segments, which a piece of two corners or one is just as well."""

    def __init__(self, store: BodyStore) -> None:
        shapes, segments = store.bodies.shapes, store.fixtures.segments
        self.count = len(shapes)
        self.body: IntArray = shapes.body
        self.surface: IntArray = store.contact_matrix.surfaces.of_shape
        self.local: FloatArray = shapes.corner
        self.local_middle: FloatArray = shapes.middle
        if store.held:  # poses are those of hinges
            self.local = shapes.corner - np.repeat(store.hinge[shapes.body], np.diff(shapes.first), axis=0)
            self.local_middle = shapes.middle - store.hinge[shapes.body]
        self.reach: FloatArray = shapes.reach
        self.radius: FloatArray = np.concatenate((shapes.radius, segments[:, 4]))
        ends = segments[:, :4].reshape(-1, 2)
        self.first: IntArray = np.concatenate((shapes.first, shapes.first[-1] + 2 * np.arange(1, len(segments) + 1)))
        self.corner: FloatArray = np.concatenate((self.local, ends))
        """(V + 2G, 2) m, in the world, at the poses of the last call of `lay_out`"""
        self.middle: FloatArray = np.empty((self.count, 2))
        """(S, 2) m, likewise"""
        self.collision_mask: IntArray = store.collision_mask[self.body]
        self.moves: BoolArray = store.mobile[self.body]
        self.can_touch: BoolArray = store.moving[self.body] & (self.collision_mask > NOTHING)
        self.apart: IntArray = apart_keys(store.links)
        if store.held:
            self.can_touch = self.can_touch & ~store.led[self.body]
            self.apart = np.union1d(self.apart, led_keys(store))
        self.group: IntArray = store.bodies.group
        """(N,) of each body"""

    @property
    def hulls(self) -> ConvexHulls:
        """Present positions and shapes."""
        return ConvexHulls(self.corner, self.first, self.radius, self.body, self.surface)

    def lay_out(self, position: FloatArray, angle: FloatArray) -> None:
        """Put corners and middles where bodies now lie, at (N, ≥ 2) m and (N,) rad."""
        lay_out(self.body, self.first, self.local, self.local_middle, position, angle, self.corner, self.middle)


def apart_keys(links: JointArrays) -> IntArray:
    """Return the keys of the pairs of bodies that joints exclude from collision, (K,), ascending."""
    return np.sort([pair_key(a, b) for a, b in links.apart().tolist()]).astype(np.int64)


def led_keys(store: BodyStore) -> IntArray:
    """Return keys of the pairs of bodies of which nothing moves either, (K,), ascending: led ones, and fixed ones.

    Raises:
        Exhaustion: there are too many.
    """
    firm = np.flatnonzero(store.led | store.bodies.fixed)
    led = np.flatnonzero(store.led)
    refusal = MEMORY.refusal(
        "the table of pairs of driven and fixed bodies takes", len(firm) * len(led) * BYTES_PER_PAIR
    )
    if refusal is not None:
        raise Exhaustion(refusal)
    a, b = np.repeat(led, len(firm)), np.tile(firm, len(led))
    keys = (np.minimum(a, b) << FIRST) + np.maximum(a, b)
    return np.unique(keys[a != b])


@kernel
def lay_out(
    body: IntArray,
    first: IntArray,
    local: FloatArray,
    local_middle: FloatArray,
    position: FloatArray,
    angle: FloatArray,
    corner: FloatArray,
    middle: FloatArray,
) -> None:
    """Turn and move the corners and middles of pieces into the world."""
    for p in range(len(body)):
        b = body[p]
        x, y, cos, sin = position[b, 0], position[b, 1], np.cos(angle[b]), np.sin(angle[b])
        for k in range(first[p], first[p + 1]):
            u, v = local[k, 0], local[k, 1]
            corner[k, 0], corner[k, 1] = x + cos * u - sin * v, y + sin * u + cos * v
        u, v = local_middle[p, 0], local_middle[p, 1]
        middle[p, 0], middle[p, 1] = x + cos * u - sin * v, y + sin * u + cos * v


OrientedBox = tuple[float, float, float, float, float, float]
"""centre x, y, m; unit axis x, y; half the extent along that axis and along its normal, m"""


@kernel
def box_of(corner: FloatArray, first: IntArray, radius: FloatArray, p: int) -> OrientedBox:
    """Return the box around piece p that lies along its longest face: the piece itself where that is a rectangle.

    It is not always the smallest: an outline has one of least area along some face, not always the longest.
    """
    start, end, wide = first[p], first[p + 1], radius[p]
    longest, ax, ay = 0.0, 1.0, 0.0
    for k in range(start, end):
        after = next_corner(start, end, k)
        dx, dy = corner[after, 0] - corner[k, 0], corner[after, 1] - corner[k, 1]
        length = math.sqrt(dx * dx + dy * dy)
        if length > longest:
            longest, ax, ay = length, dx / length, dy / length
    x, y = corner[start, 0], corner[start, 1]
    left = right = low = high = 0.0
    for k in range(start + 1, end):
        dx, dy = corner[k, 0] - x, corner[k, 1] - y
        along, across = dx * ax + dy * ay, ax * dy - ay * dx
        left, right = min(left, along), max(right, along)
        low, high = min(low, across), max(high, across)
    along, across = 0.5 * (left + right), 0.5 * (low + high)
    return (
        x + along * ax - across * ay,
        y + along * ay + across * ax,
        ax,
        ay,
        0.5 * (right - left) + wide,
        0.5 * (high - low) + wide,
    )


@kernel
def boxes_apart(a: OrientedBox | FloatArray, b: OrientedBox | FloatArray, margin: float) -> bool:
    """Tell whether two boxes, or rows that hold them, are farther apart than the margin, m, along one of their axes.

    Two whose nearest points are corners may be farther apart than that and still be reported.
    """
    x, y = b[0] - a[0], b[1] - a[1]
    cos, sin = abs(a[2] * b[2] + a[3] * b[3]), abs(a[2] * b[3] - a[3] * b[2])
    # What centres and extents are rounded by must not part two that touch.
    margin += 8.0 * ROUNDING * (abs(a[0]) + abs(a[1]) + abs(b[0]) + abs(b[1]) + a[4] + a[5] + b[4] + b[5])
    return bool(
        abs(x * a[2] + y * a[3]) > a[4] + b[4] * cos + b[5] * sin + margin
        or abs(a[2] * y - a[3] * x) > a[5] + b[4] * sin + b[5] * cos + margin
        or abs(x * b[2] + y * b[3]) > b[4] + a[4] * cos + a[5] * sin + margin
        or abs(b[2] * y - b[3] * x) > b[5] + a[4] * sin + a[5] * cos + margin
    )


class NarrowPhaseInput(NamedTuple):
    """How to look."""

    friction: FloatArray
    """(S, S) of pairs of surfaces"""
    reach: float
    """m, separation of two pieces below which there is a contact"""
    scratch: FloatArray
    """(2, 6)"""


@kernel
def drop(keys: IntArray, body: IntArray, apart: IntArray, group: IntArray) -> int:
    """Keep, at the front, the pairs of pieces that can collide, and return their number.

    They are of two bodies, which are neither joined nor of one group.
    """
    kept = 0
    for k in range(len(keys)):
        a, b = body[keys[k] >> FIRST], body[keys[k] & SECOND]
        if a == b or (group[a] != 0 and group[a] == group[b]):
            continue
        if not contains_key(apart, pair_key(min(a, b), max(a, b))):
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
def find_body_contacts(
    keys: IntArray, hulls: ConvexHulls, position: FloatArray, look: NarrowPhaseInput, out: Manifolds, at: int
) -> int:
    """Write the pairs of pieces that are near from row `at` on; return the next free row."""
    for k in range(len(keys)):
        p, q = keys[k] >> FIRST, keys[k] & SECOND
        j = hulls.body[q]
        count = collide_pieces(hulls.corner, hulls.first, hulls.radius, p, q, look.reach, look.scratch)
        at = _write(hulls, look, count, 2 * keys[k], p, j, hulls.surface[q], position, out, at)
    return at


@kernel
def find_half_plane_contacts(
    hulls: ConvexHulls,
    can_touch: BoolArray,
    position: FloatArray,
    planes: FloatArray,
    collider: IntArray,
    collider_surface: IntArray,
    look: NarrowPhaseInput,
    out: Manifolds,
    at: int,
) -> int:
    """Write the pieces near half-planes from row `at` on; return the next free row."""
    for p in range(len(hulls.body)):
        if not can_touch[p]:
            continue
        for s in range(len(planes)):
            px, py, nx, ny = planes[s, 0], planes[s, 1], planes[s, 2], planes[s, 3]
            count = collide_half_plane(
                hulls.corner, hulls.first, hulls.radius, p, px, py, nx, ny, look.reach, look.scratch
            )
            key, other = (1 << KIND) + 2 * pair_key(p, s), collider_surface[collider[s]]
            at = _write(hulls, look, count, key, p, -1 - collider[s], other, position, out, at)
    return at


@kernel
def find_fixed_segment_contacts(
    keys: IntArray,
    hulls: ConvexHulls,
    position: FloatArray,
    joints: FloatArray,
    collider: IntArray,
    collider_surface: IntArray,
    look: NarrowPhaseInput,
    out: Manifolds,
    at: int,
) -> int:
    """Write the pieces near segments from row `at` on; return the next free row."""
    for k in range(len(keys)):
        p, s = keys[k] >> FIRST, keys[k] & SECOND
        q = len(hulls.body) + s
        count = collide_pieces(hulls.corner, hulls.first, hulls.radius, p, q, look.reach, look.scratch)
        if count > 0 and joints[s].any():
            count = _smoothed(hulls, p, q, joints[s], count, look)
        key, other = (2 << KIND) + 2 * keys[k], collider_surface[collider[s]]
        at = _write(hulls, look, count, key, p, -1 - collider[s], other, position, out, at)
    return at


@kernel
def _smoothed(hulls: ConvexHulls, p: int, q: int, joints: FloatArray, count: int, look: NarrowPhaseInput) -> int:
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
    hulls: ConvexHulls,
    look: NarrowPhaseInput,
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
            bx, by = x, y  # static bodies do not turn
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
            out.friction[at] = look.friction[surface, other]
            out.surface_pair[at] = surface * len(look.friction) + other
        at += 1
    return at
