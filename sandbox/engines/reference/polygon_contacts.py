"""Convex pieces in world coordinates, and their contacts with each other and with static colliders.

A contact has up to two points, each of which is a row of manifolds. The lowest bit of a key is the index of the point,
so that the points of a pair are adjacent.

An oriented box encloses a piece more tightly than a disc or an axis-aligned box if the piece is long. A test of two
boxes needs four axes, independently of the number of corners.
"""

import math
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.body_store import NOTHING, BodyStore
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.contract import Exhaustion
from sandbox.engines.reference.broad_phase import FIRST, ROUNDING, SECOND, contains_key, pair_key
from sandbox.engines.reference.internal_edges import correct_internal_edge
from sandbox.engines.reference.manifold import KIND, Manifolds, is_covered, write_surfaces
from sandbox.engines.reference.polygon import collide_half_plane, collide_pieces, next_corner
from sandbox.resource_limits import MEMORY
from sandbox.scene.compile.joint_arrays import JointArrays

BYTES_PER_PAIR = 6 * 8
"""B: two indices, a key, and the sorted key"""


class ConvexHulls(NamedTuple):
    """P pieces in world coordinates; the first S belong to bodies, the others are wall segments."""

    corner: FloatArray
    """(V, 2) m"""
    first: IntArray
    """(P + 1,) row of the first corner of each piece"""
    radius: FloatArray
    """(P,) m"""
    body: IntArray
    """(S,) index of the body of each piece"""
    surface: IntArray
    """(S,)"""


class WorldPieces:
    """S pieces of bodies and G segments of static colliders, which are pieces of two corners."""

    def __init__(self, store: BodyStore) -> None:
        shapes, segments = store.bodies.shapes, store.static_colliders.segments
        self.count = len(shapes)
        self.body: IntArray = shapes.body
        self.surface: IntArray = store.contact_matrix.surfaces.of_shape
        self.local: FloatArray = shapes.corner
        self.local_middle: FloatArray = shapes.middle
        if store.has_driven:  # poses are those of hinges
            self.local = shapes.corner - np.repeat(store.hinge[shapes.body], np.diff(shapes.first), axis=0)
            self.local_middle = shapes.middle - store.hinge[shapes.body]
        self.bounding_radius: FloatArray = shapes.bounding_radius
        self.radius: FloatArray = np.concatenate((shapes.radius, segments[:, 4]))
        ends = segments[:, :4].reshape(-1, 2)
        self.first: IntArray = np.concatenate((shapes.first, shapes.first[-1] + 2 * np.arange(1, len(segments) + 1)))
        self.corner: FloatArray = np.concatenate((self.local, ends))
        """(V + 2G, 2) m, in the world, at the poses of the last `update`"""
        self.middle: FloatArray = np.empty((self.count, 2))
        """(S, 2) m, centres of the bounding circles, likewise"""
        self.collision_mask: IntArray = store.collision_mask[self.body]
        self.moves: BoolArray = store.mobile[self.body]
        self.can_touch: BoolArray = store.moving[self.body] & (self.collision_mask > NOTHING)
        self.excluded: IntArray = excluded_pair_keys(store.joints)
        if store.has_driven:
            self.can_touch = self.can_touch & ~store.kinematic[self.body]
            self.excluded = np.union1d(self.excluded, kinematic_pair_keys(store))
        self.group: IntArray = store.bodies.group
        """(N,) collision group of each body"""

    @property
    def hulls(self) -> ConvexHulls:
        """Present positions and shapes."""
        return ConvexHulls(self.corner, self.first, self.radius, self.body, self.surface)

    def update(self, position: FloatArray, angle: FloatArray) -> None:
        """Transform corners and middles to the poses of the bodies, (N, ≥ 2) m and (N,) rad."""
        transform_pieces(
            self.body, self.first, self.local, self.local_middle, position, angle, self.corner, self.middle
        )


def excluded_pair_keys(joints: JointArrays) -> IntArray:
    """Return the keys of the pairs of bodies that joints exclude from collision, (K,), ascending."""
    return np.sort([pair_key(a, b) for a, b in joints.apart().tolist()]).astype(np.int64)


def kinematic_pair_keys(store: BodyStore) -> IntArray:
    """Return the keys of all pairs of kinematic bodies with kinematic or fixed bodies, (K,), ascending.

    Raises:
        Exhaustion: there are too many.
    """
    immovable = np.flatnonzero(store.kinematic | store.bodies.fixed)
    kinematic = np.flatnonzero(store.kinematic)
    refusal = MEMORY.refusal(
        "the table of pairs of driven and fixed bodies takes", len(immovable) * len(kinematic) * BYTES_PER_PAIR
    )
    if refusal is not None:
        raise Exhaustion(refusal)
    a, b = np.repeat(kinematic, len(immovable)), np.tile(immovable, len(kinematic))
    keys = (np.minimum(a, b) << FIRST) + np.maximum(a, b)
    return np.unique(keys[a != b])


@kernel
def transform_pieces(
    body: IntArray,
    first: IntArray,
    local: FloatArray,
    local_middle: FloatArray,
    position: FloatArray,
    angle: FloatArray,
    corner: FloatArray,
    middle: FloatArray,
) -> None:
    """Transform the corners and middles of pieces to world coordinates."""
    for p in range(len(body)):
        b = body[p]
        x, y, cos, sin = position[b, 0], position[b, 1], np.cos(angle[b]), np.sin(angle[b])
        for k in range(first[p], first[p + 1]):
            u, v = local[k, 0], local[k, 1]
            corner[k, 0], corner[k, 1] = x + cos * u - sin * v, y + sin * u + cos * v
        u, v = local_middle[p, 0], local_middle[p, 1]
        middle[p, 0], middle[p, 1] = x + cos * u - sin * v, y + sin * u + cos * v


OrientedBox = tuple[float, float, float, float, float, float]
"""centre x, y, m; unit axis x, y; half extents along that axis and along its normal, m"""


@kernel
def oriented_box(corner: FloatArray, first: IntArray, radius: FloatArray, p: int) -> OrientedBox:
    """Return the box around piece p along its longest face, which for a rectangle is the piece itself.

    It is not always the smallest box: the box of least area lies along some face, not always the longest.
    """
    start, end, half = first[p], first[p + 1], radius[p]
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
        0.5 * (right - left) + half,
        0.5 * (high - low) + half,
    )


@kernel
def are_separated(a: OrientedBox | FloatArray, b: OrientedBox | FloatArray, margin: float) -> bool:
    """Return whether two boxes, or their rows, are separated by more than the margin, m, along one of their axes.

    Two boxes whose closest points are corners may have a larger distance and still not be separated along an axis.
    """
    x, y = b[0] - a[0], b[1] - a[1]
    cos, sin = abs(a[2] * b[2] + a[3] * b[3]), abs(a[2] * b[3] - a[3] * b[2])
    # Rounding errors of centres and extents must not separate boxes that touch.
    margin += 8.0 * ROUNDING * (abs(a[0]) + abs(a[1]) + abs(b[0]) + abs(b[1]) + a[4] + a[5] + b[4] + b[5])
    return bool(
        abs(x * a[2] + y * a[3]) > a[4] + b[4] * cos + b[5] * sin + margin
        or abs(a[2] * y - a[3] * x) > a[5] + b[4] * sin + b[5] * cos + margin
        or abs(x * b[2] + y * b[3]) > b[4] + a[4] * cos + a[5] * sin + margin
        or abs(b[2] * y - b[3] * x) > b[5] + a[4] * sin + a[5] * cos + margin
    )


class NarrowPhaseInput(NamedTuple):
    """Parameters of the narrow phase, and its scratch memory."""

    tangential: FloatArray
    """(S, S, 4) as `BodyStore.tangential`"""
    max_separation: float
    """m, separation below which there is a contact"""
    scratch: FloatArray
    """(2, 6)"""


@kernel
def drop_excluded(keys: IntArray, body: IntArray, excluded: IntArray, group: IntArray) -> int:
    """Move the pairs of pieces that can collide to the front, and return their number.

    They belong to two bodies that are neither joined nor of the same group.
    """
    kept = 0
    for k in range(len(keys)):
        a, b = body[keys[k] >> FIRST], body[keys[k] & SECOND]
        if a == b or (group[a] != 0 and group[a] == group[b]):
            continue
        if not contains_key(excluded, pair_key(min(a, b), max(a, b))):
            keys[kept] = keys[k]
            kept += 1
    return kept


@kernel
def write_boxes(corner: FloatArray, first: IntArray, radius: FloatArray, box: FloatArray) -> None:
    """Write the oriented box of each piece into its row of (P, 6)."""
    for p in range(len(box)):
        x, y, ax, ay, along, across = oriented_box(corner, first, radius, p)
        box[p, 0], box[p, 1], box[p, 2], box[p, 3], box[p, 4], box[p, 5] = x, y, ax, ay, along, across


@kernel
def drop_separated(keys: IntArray, offset: int, box: FloatArray, margin: float) -> int:
    """Move the pairs whose oriented boxes, widened by the margin, overlap to the front; return their number."""
    kept = 0
    for k in range(len(keys)):
        if not are_separated(box[keys[k] >> FIRST], box[offset + (keys[k] & SECOND)], margin):
            keys[kept] = keys[k]
            kept += 1
    return kept


@kernel
def find_body_contacts(
    keys: IntArray, hulls: ConvexHulls, position: FloatArray, query: NarrowPhaseInput, out: Manifolds, row: int
) -> int:
    """Write the contacts of pairs of pieces from row `row` on; return the next free row."""
    for k in range(len(keys)):
        p, q = keys[k] >> FIRST, keys[k] & SECOND
        j = hulls.body[q]
        count = collide_pieces(hulls.corner, hulls.first, hulls.radius, p, q, query.max_separation, query.scratch)
        row = _write(hulls, query, count, 2 * keys[k], p, j, hulls.surface[q], position, out, row)
    return row


@kernel
def find_half_plane_contacts(
    hulls: ConvexHulls,
    can_touch: BoolArray,
    position: FloatArray,
    planes: FloatArray,
    collider: IntArray,
    collider_surface: IntArray,
    query: NarrowPhaseInput,
    out: Manifolds,
    row: int,
) -> int:
    """Write the contacts of pieces with half-planes from row `row` on; return the next free row."""
    for p in range(len(hulls.body)):
        if not can_touch[p]:
            continue
        for s in range(len(planes)):
            px, py, nx, ny = planes[s, 0], planes[s, 1], planes[s, 2], planes[s, 3]
            count = collide_half_plane(
                hulls.corner, hulls.first, hulls.radius, p, px, py, nx, ny, query.max_separation, query.scratch
            )
            key, other = (1 << KIND) + 2 * pair_key(p, s), collider_surface[collider[s]]
            row = _write(hulls, query, count, key, p, -1 - collider[s], other, position, out, row)
    return row


@kernel
def find_fixed_segment_contacts(
    keys: IntArray,
    hulls: ConvexHulls,
    position: FloatArray,
    joints: FloatArray,
    collider: IntArray,
    collider_surface: IntArray,
    query: NarrowPhaseInput,
    out: Manifolds,
    row: int,
) -> int:
    """Write the contacts of pieces with segments from row `row` on; return the next free row."""
    for k in range(len(keys)):
        p, s = keys[k] >> FIRST, keys[k] & SECOND
        q = len(hulls.body) + s
        count = collide_pieces(hulls.corner, hulls.first, hulls.radius, p, q, query.max_separation, query.scratch)
        if count > 0 and joints[s].any():
            count = _correct_internal_edge(hulls, p, q, joints[s], count, query)
        key, other = (2 << KIND) + 2 * keys[k], collider_surface[collider[s]]
        row = _write(hulls, query, count, key, p, -1 - collider[s], other, position, out, row)
    return row


@kernel
def _correct_internal_edge(
    hulls: ConvexHulls, p: int, q: int, joints: FloatArray, count: int, query: NarrowPhaseInput
) -> int:
    """Correct the contact of a piece with a segment at a joint of its wall; return its number of points."""
    corner, a, b = hulls.corner, hulls.first[p], hulls.first[q]
    if hulls.first[p + 1] - a > 1:
        radii = hulls.radius[p], hulls.radius[q]
        return correct_internal_edge(
            corner, a, hulls.first[p + 1], radii[0], b, radii[1], joints, count, query.max_separation, query.scratch
        )  # fmt: skip
    ax, ay, bx, by = corner[b, 0], corner[b, 1], corner[b + 1, 0], corner[b + 1, 1]
    nx, ny = query.scratch[0, 0], query.scratch[0, 1]
    x, y = corner[a, 0], corner[a, 1]
    covered = is_covered(x, y, ax, ay, bx, by, nx, ny, joints[0], joints[1], joints[2], joints[3])
    return 0 if covered else count


@kernel
def _write(
    hulls: ConvexHulls,
    query: NarrowPhaseInput,
    count: int,
    key: int,
    p: int,
    second: int,
    other: int,
    position: FloatArray,
    out: Manifolds,
    row: int,
) -> int:
    """Write the points in `query.scratch` from row `row` on, up to the capacity; return the next free row.

    Args:
        hulls: the pieces.
        query: contains the points of the pair.
        count: number of points.
        key: of the pair; its lowest bit is 0.
        p: first piece.
        second: index of the second body, or −1 − k of a static collider.
        other: surface of the second piece.
        position: (N, ≥ 2) m, of bodies.
        out: buffer of manifolds.
        row: first row.
    """
    i, surface = hulls.body[p], hulls.surface[p]
    ax, ay = position[i, 0], position[i, 1]
    for n in range(count):
        if row < len(out.key):
            nx, ny, separation = query.scratch[n, 0], query.scratch[n, 1], query.scratch[n, 2]
            x, y, half = query.scratch[n, 3], query.scratch[n, 4], 0.5 * separation
            bx, by = x, y  # static bodies do not turn
            if second >= 0:
                bx, by = position[second, 0], position[second, 1]
            out.key[row] = key + int(query.scratch[n, 5])
            out.first[row], out.second[row] = i, second
            out.normal[row, 0], out.normal[row, 1] = nx, ny
            out.separation[row] = separation
            out.point[row, 0], out.point[row, 1] = x, y
            # Each anchor ends on the surface of its own body.
            out.rn[row, 0] = (x - ax) * nx + (y - ay) * ny - half
            out.rn[row, 1] = (bx - x) * nx + (by - y) * ny - half
            out.rt[row, 0] = (y - ay) * nx - (x - ax) * ny
            out.rt[row, 1] = (y - by) * nx - (x - bx) * ny
            write_surfaces(out, row, query.tangential, surface, other)
        row += 1
    return row
