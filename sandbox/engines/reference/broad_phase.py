"""Broad phase: candidate pairs by all pairs, bounding circles, a uniform grid, or sort and sweep.

A pair is one integer key. Candidates come in ascending order of their keys, so results do not depend on the method.

BROAD_PHASES is the table of broad phases. Each is a kernel (order, position, radius, collision_mask, moves, margin,
most, keys) -> (found, tests). It writes the keys of candidate pairs into `keys` (C,), each once, in any order, up to
its capacity. It returns the number of candidates found and the number of cheap tests, or `EXCEEDED` if it stopped after
`most` tests. Every pair nearer than the margin is found, so all broad phases agree after the narrow phase. `order` is
the broad phase's own order of the balls that can collide with anything; it is kept from step to step.

Grid: balls are sorted into square cells as wide as the widest of them; only neighbouring cells are looked at.

O(N) for balls of one size. One huge ball among small ones makes all cells huge: then the sweep is the better choice.

Sweep: boxes sorted along x; only those whose x ranges overlap are tested in y (Baraff 1992, sort and sweep).

O(N log N + pairs that overlap in x). Suits scenes that are wide, and balls of very different sizes.

Segments: a broad phase of its own for walls and posts, which never move.

Their boxes are sorted from left to right once. A ball looks only at those that begin no farther left than the widest
of them reaches.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.body_store import ALL, FIXED, NOTHING
from sandbox.engines.common.colliders import StaticColliders
from sandbox.engines.common.kernel import bare_kernel, kernel

FIRST = 30
"""Bits below the first number in the key of a pair: a scene holds fewer bodies, and fewer segments, than 2³⁰."""
SECOND = (1 << FIRST) - 1
"""The bits of the second."""

ROUNDING = 1e-15
"""Rounding error of two edges, x ± r, relative to their terms: four roundings, and a margin.
Boxes are widened by it, or far from the origin they would lose pairs whose centres are near enough."""

EXCEEDED, UNSORTED = -1, -2
"""Returned in place of the number of tests: the limit of pairs was exceeded; the order must be sorted anew."""


@bare_kernel
def pair_key(i: int, j: int) -> int:
    """Return the key of a pair; keys ascend as pairs do."""
    return (i << FIRST) + j


@bare_kernel
def contains_key(keys: IntArray, key: int) -> bool:
    """Return whether a key is among ascending keys (K,)."""
    low, high = 0, len(keys)
    while low < high:
        middle = (low + high) // 2
        if keys[middle] < key:
            low = middle + 1
        else:
            high = middle
    return low < len(keys) and keys[low] == key


@bare_kernel
def can_collide(mask_a: int, moves_a: bool, mask_b: int, moves_b: bool) -> bool:
    """Return whether two bodies can collide.

    Either both move and collide with everything, or one is fixed and the other collides with fixed bodies.
    """
    if moves_a and moves_b:
        return mask_a == ALL and mask_b == ALL
    if moves_a:
        return mask_a >= FIXED and mask_b == ALL
    return moves_b and mask_b >= FIXED and mask_a == ALL


@kernel
def all_pairs(
    order: IntArray,  # noqa: ARG001, all broad phases are called alike
    position: FloatArray,
    radius: FloatArray,  # noqa: ARG001
    collision_mask: IntArray,
    moves: BoolArray,
    margin: float,  # noqa: ARG001
    most: int,  # noqa: ARG001, the finder counts these pairs beforehand
    keys: IntArray,
) -> tuple[int, int]:
    """Emit every pair that can touch."""
    found = 0
    for i in range(len(position)):
        if collision_mask[i] == NOTHING:  # particles may be many
            continue
        for j in range(i + 1, len(position)):
            if can_collide(collision_mask[i], moves[i], collision_mask[j], moves[j]):
                if found < len(keys):
                    keys[found] = pair_key(i, j)
                found += 1
    return found, 0


@kernel
def circles(
    order: IntArray,  # noqa: ARG001, all broad phases are called alike
    position: FloatArray,
    radius: FloatArray,
    collision_mask: IntArray,
    moves: BoolArray,
    margin: float,
    most: int,  # noqa: ARG001, the finder counts these pairs beforehand
    keys: IntArray,
) -> tuple[int, int]:
    """Emit the pairs whose bounding circles, widened by the margin, overlap."""
    found, tests = 0, 0
    for i in range(len(position)):
        if collision_mask[i] == NOTHING:  # particles may be many
            continue
        for j in range(i + 1, len(position)):
            if can_collide(collision_mask[i], moves[i], collision_mask[j], moves[j]):
                tests += 1
                x, y = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
                reach = radius[i] + radius[j] + margin
                if x * x + y * y <= reach * reach:
                    if found < len(keys):
                        keys[found] = pair_key(i, j)
                    found += 1
    return found, tests


FARTHEST_CELL = 4e18
"""Cells beyond are merged: cell numbers are 64-bit."""

LOW = 2**31 - 1
"""The low bits of a cell's number: more than any table has slots."""


@kernel
def cell_of(coordinate: float, width: float) -> int:
    """Return the number of the cell that a coordinate lies in."""
    if math.isnan(coordinate):  # a body that has diverged touches nothing; the step ends with a Divergence
        return 0
    return math.floor(min(max(coordinate / width, -FARTHEST_CELL), FARTHEST_CELL))


@kernel
def slot_of(column: int, row: int, mask: int) -> int:
    """Return the slot of a cell in a table of mask + 1 slots (Teschner et al. 2003, their two primes)."""
    # By their low bits alone, so that no product overflows; of a product, they depend on nothing else.
    return int((((column & LOW) * 73856093) ^ ((row & LOW) * 19349663)) & mask)


@kernel
def grid(
    order: IntArray,
    position: FloatArray,
    radius: FloatArray,
    collision_mask: IntArray,
    moves: BoolArray,
    margin: float,
    most: int,
    keys: IntArray,
) -> tuple[int, int]:
    """Emit the pairs whose bounding circles, widened by the margin, overlap; `order` (N,) is used for scratch."""
    count, widest = len(position), 0.0
    for i in range(count):
        if collision_mask[i] > 0:
            widest = max(widest, radius[i])
    width = 2.0 * widest + margin
    if width <= 0.0:
        return 0, 0
    mask = 1
    while mask < 2 * count:
        mask *= 2
    mask -= 1

    # Counting sort: `begin[s]` … `begin[s + 1]` are the places in `order` of the balls of slot s.
    column, row, slot = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count, np.int64)
    begin = np.zeros(mask + 3, np.int64)
    for i in range(count):
        if collision_mask[i] > 0:
            column[i], row[i] = cell_of(position[i, 0], width), cell_of(position[i, 1], width)
            slot[i] = slot_of(column[i], row[i], mask)
            begin[slot[i] + 2] += 1
    for s in range(2, mask + 3):
        begin[s] += begin[s - 1]
    for i in range(count):
        if collision_mask[i] > 0:
            order[begin[slot[i] + 1]] = i
            begin[slot[i] + 1] += 1

    found, tests, looked = 0, 0, 0
    for i in range(count):
        if collision_mask[i] == 0:
            continue
        if looked > most:
            return found, EXCEEDED
        x, y = position[i, 0], position[i, 1]
        # Three by three cells at most; distinguished by positions: far out, neighbouring cell numbers round to one.
        for across in range(cell_of(x - width, width), cell_of(x + width, width) + 1):
            for up in range(cell_of(y - width, width), cell_of(y + width, width) + 1):
                s = slot_of(across, up, mask)
                looked += begin[s + 1] - begin[s]
                for place in range(begin[s], begin[s + 1]):
                    j = order[place]
                    # Another cell may share the slot.
                    if j <= i or column[j] != across or row[j] != up:
                        continue
                    if can_collide(collision_mask[i], moves[i], collision_mask[j], moves[j]):
                        tests += 1
                        dx, dy = position[j, 0] - x, position[j, 1] - y
                        reach = radius[i] + radius[j] + margin
                        if dx * dx + dy * dy <= reach * reach:
                            if found < len(keys):
                                keys[found] = pair_key(i, j)
                            found += 1
    return found, tests


FEW_SHIFTS = 100
"""Places that a box is moved by in the order, on average, up to which insertion beats sorting anew."""


@kernel
def sweep(
    order: IntArray,
    position: FloatArray,
    radius: FloatArray,
    collision_mask: IntArray,
    moves: BoolArray,
    margin: float,
    most: int,
    keys: IntArray,
) -> tuple[int, int]:
    """Emit the pairs whose axis-aligned boxes, widened by the margin, overlap.

    `order` was the order from left to right a step ago; it is brought up to date. Little changes in a step, so that
    insertion is nearly linear; `UNSORTED` is returned where it is not.
    """
    shifts, most_shifts = 0, FEW_SHIFTS * (len(order) + FEW_SHIFTS)
    for k in range(1, len(order)):
        if shifts > most_shifts:
            return 0, UNSORTED
        moving, place = order[k], k
        left = position[moving, 0] - radius[moving]
        while place > 0 and position[order[place - 1], 0] - radius[order[place - 1]] > left:
            order[place] = order[place - 1]
            place -= 1
        order[place] = moving
        shifts += k - place

    found, tests, looked = 0, 0, 0
    for k in range(len(order)):
        if looked > most:
            return found, EXCEEDED
        i = order[k]
        reach = radius[i] + margin
        right = position[i, 0] + reach + ROUNDING * (abs(position[i, 0]) + reach)
        for next_k in range(k + 1, len(order)):
            j = order[next_k]
            if position[j, 0] - radius[j] > right:
                break
            looked += 1
            if can_collide(collision_mask[i], moves[i], collision_mask[j], moves[j]):
                tests += 1
                if abs(position[j, 1] - position[i, 1]) <= radius[i] + radius[j] + margin:
                    if found < len(keys):
                        keys[found] = pair_key(min(i, j), max(i, j))
                    found += 1
    return found, tests


BroadPhase = Callable[[IntArray, FloatArray, FloatArray, IntArray, BoolArray, float, int, IntArray], tuple[int, int]]

BROAD_PHASES: dict[str, BroadPhase] = {
    "all_pairs": all_pairs,
    "circles": circles,
    "sweep": sweep,
    "grid": grid,
}


class CandidatePairs(NamedTuple):
    """Candidate pairs of the broad phase, by ascending key. Every body is a candidate for every plane."""

    balls: IntArray
    """(B,) keys of two balls, or two pieces"""
    segments: IntArray
    """(S,) keys of a ball, or a piece, and a segment"""


class SegmentBoxes:
    """The boxes around G segments, sorted."""

    def __init__(self, fixtures: StaticColliders) -> None:
        ends = fixtures.segments[:, :4].reshape(-1, 2, 2)
        half = fixtures.segments[:, 4:5]
        low, high = ends.min(axis=1) - half, ends.max(axis=1) + half
        self.index: IntArray = np.argsort(low[:, 0], kind="stable")
        self.box: FloatArray = np.hstack((low, high))[self.index]
        self.widest = float((high - low)[:, 0].max(initial=0.0))

    def __len__(self) -> int:
        return len(self.index)

    @property
    def sorted(self) -> tuple[FloatArray, IntArray, float]:
        """The boxes (G, 4), m, from left to right, the number of each one's segment, and the largest width, m."""
        return self.box, self.index, self.widest


@bare_kernel
def near_segments(
    position: FloatArray,
    radius: FloatArray,
    able: BoolArray,
    box: FloatArray,
    index: IntArray,
    widest: float,
    margin: float,
    most: int,
    keys: IntArray,
) -> tuple[int, int]:
    """Write the keys of balls and segments whose boxes, widened by the margin, overlap; return how many, and tests.

    In place of the tests it returns `EXCEEDED` where there are more than `most`.
    """
    found, tests = 0, 0
    for i in range(len(position)):
        if not able[i]:
            continue
        if tests > most:
            return found, EXCEEDED
        x, y, reach = position[i, 0], position[i, 1], radius[i] + margin
        reach += ROUNDING * (abs(x) + abs(y) + reach + widest)
        low, high = 0, len(box)
        while low < high:  # the first that begins at x − reach − widest or farther right
            middle = (low + high) // 2
            if box[middle, 0] < x - reach - widest:
                low = middle + 1
            else:
                high = middle
        for place in range(low, len(box)):
            if box[place, 0] > x + reach:
                break
            tests += 1
            if box[place, 2] >= x - reach and box[place, 1] <= y + reach and box[place, 3] >= y - reach:
                if found < len(keys):
                    keys[found] = pair_key(i, index[place])
                found += 1
    return found, tests
