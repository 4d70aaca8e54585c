"""Broad phase: candidate pairs by all pairs, bounding circles, a uniform grid, or sort and sweep.

A pair is one integer key. Candidates come in ascending order of their keys, so results do not depend on the method.

BROAD_PHASES is the table of broad phases. Each is a kernel (order, position, radius, collision_mask, moves, margin,
most, keys) -> (found, tests). It writes the keys of candidate pairs into `keys` (C,), each once, in any order, up to
its capacity. It returns the number of candidates found and the number of cheap tests, or `EXCEEDED` if it stopped after
`max_tests` tests. Every pair nearer than the margin is found, so all broad phases agree after the narrow phase. `order`
is the broad phase's own memory, kept from step to step: for `sweep` the order of the balls that can collide with
anything.

- `grid` sorts balls into square cells as wide as the largest ball and tests neighbouring cells only. It is O(N) for
  balls of equal size. One huge ball among small ones makes all cells huge; then `sweep` is faster.
- `sweep` sorts boxes along x and tests those whose x ranges overlap in y (Baraff 1992, sort and sweep). It is O(N log N
  + pairs that overlap in x) and suits wide scenes and balls of very different sizes.
- `near_segments` is the broad phase of walls and posts, which do not move. Their boxes are sorted from left to right
  once; a binary search finds the first box that can overlap a ball.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.body_store import ALL, FIXED, NOTHING
from sandbox.engines.common.colliders import StaticColliders
from sandbox.engines.common.kernel import bare_kernel

FIRST = 30
"""Number of bits below the first index in the key of a pair: a scene has fewer than 2³⁰ bodies and segments"""
SECOND = (1 << FIRST) - 1
"""Mask of the bits of the second index"""

ROUNDING = 1e-15
"""Rounding error of two edges, x ± r, relative to their terms: four roundings, and a margin. Boxes are widened by it,
because far from the origin they would otherwise miss pairs that touch."""

EXCEEDED, UNSORTED = -1, -2
"""Returned in place of the number of tests: the limit of pairs was exceeded; the order must be sorted again."""


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


@bare_kernel
def all_pairs(
    order: IntArray,  # noqa: ARG001, all broad phases are called alike
    position: FloatArray,
    radius: FloatArray,  # noqa: ARG001
    collision_mask: IntArray,
    moves: BoolArray,
    margin: float,  # noqa: ARG001
    max_tests: int,  # noqa: ARG001, the pipeline checks the number of pairs beforehand
    keys: IntArray,
) -> tuple[int, int]:
    """Write every pair that can collide."""
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


@bare_kernel
def circles(
    order: IntArray,  # noqa: ARG001, all broad phases are called alike
    position: FloatArray,
    radius: FloatArray,
    collision_mask: IntArray,
    moves: BoolArray,
    margin: float,
    max_tests: int,  # noqa: ARG001, as above
    keys: IntArray,
) -> tuple[int, int]:
    """Write the pairs whose bounding circles, widened by the margin, overlap."""
    found, tests = 0, 0
    for i in range(len(position)):
        if collision_mask[i] == NOTHING:  # particles may be many
            continue
        for j in range(i + 1, len(position)):
            if can_collide(collision_mask[i], moves[i], collision_mask[j], moves[j]):
                tests += 1
                x, y = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
                limit = radius[i] + radius[j] + margin
                if x * x + y * y <= limit * limit:
                    if found < len(keys):
                        keys[found] = pair_key(i, j)
                    found += 1
    return found, tests


MAX_CELL = 4e18
"""Largest cell number: cell numbers are 64-bit integers. Farther cells are merged."""

LOW = 2**31 - 1
"""Mask of the low bits of a cell number: more than any table has slots"""


@bare_kernel
def cell_of(coordinate: float, width: float) -> int:
    """Return the number of the cell that a coordinate lies in."""
    if math.isnan(coordinate):  # a body that has diverged touches nothing; the step ends with a Divergence
        return 0
    return math.floor(min(max(coordinate / width, -MAX_CELL), MAX_CELL))


@bare_kernel
def slot_of(column: int, row: int, mask: int) -> int:
    """Return the slot of a cell in a table of mask + 1 slots (Teschner et al. 2003, their two primes)."""
    # From the low bits only, so that no product overflows. The low bits of a product depend on nothing else.
    return int((((column & LOW) * 73856093) ^ ((row & LOW) * 19349663)) & mask)


def grid_memory(count: int) -> int:
    """Return the number of integers of scratch memory that `grid` needs for a number of balls."""
    return 8 * count + 8


@bare_kernel
def grid(
    order: IntArray,
    position: FloatArray,
    radius: FloatArray,
    collision_mask: IntArray,
    moves: BoolArray,
    margin: float,
    max_tests: int,
    keys: IntArray,
) -> tuple[int, int]:
    """Write the pairs whose bounding circles, widened by the margin, overlap.

    `order` is scratch memory of `grid_memory(N)` integers.
    """
    count, max_radius = len(position), 0.0
    for i in range(count):
        if collision_mask[i] > 0:
            max_radius = max(max_radius, radius[i])
    width = 2.0 * max_radius + margin
    if width <= 0.0:
        return 0, 0
    mask = 1
    while mask < 2 * count:
        mask *= 2
    mask -= 1

    # Counting sort: `begin[s]` … `begin[s + 1]` are the rows in `member` of the balls of slot s.
    column, row, slot = order[:count], order[count : 2 * count], order[2 * count : 3 * count]
    member, begin = order[3 * count : 4 * count], order[4 * count : 4 * count + mask + 3]
    begin[:] = 0
    for i in range(count):
        if collision_mask[i] > 0:
            column[i], row[i] = cell_of(position[i, 0], width), cell_of(position[i, 1], width)
            slot[i] = slot_of(column[i], row[i], mask)
            begin[slot[i] + 2] += 1
    for s in range(2, mask + 3):
        begin[s] += begin[s - 1]
    for i in range(count):
        if collision_mask[i] > 0:
            member[begin[slot[i] + 1]] = i
            begin[slot[i] + 1] += 1

    found, tests, visited = 0, 0, 0
    for i in range(count):
        if collision_mask[i] == 0:
            continue
        if visited > max_tests:
            return found, EXCEEDED
        x, y = position[i, 0], position[i, 1]
        # At most 3 × 3 cells. Far from the origin the numbers of neighbouring cells can round to the same value.
        for across in range(cell_of(x - width, width), cell_of(x + width, width) + 1):
            for up in range(cell_of(y - width, width), cell_of(y + width, width) + 1):
                s = slot_of(across, up, mask)
                visited += begin[s + 1] - begin[s]
                for slot_index in range(begin[s], begin[s + 1]):
                    j = member[slot_index]
                    # Another cell may share the slot.
                    if j <= i or column[j] != across or row[j] != up:
                        continue
                    if can_collide(collision_mask[i], moves[i], collision_mask[j], moves[j]):
                        tests += 1
                        dx, dy = position[j, 0] - x, position[j, 1] - y
                        limit = radius[i] + radius[j] + margin
                        if dx * dx + dy * dy <= limit * limit:
                            if found < len(keys):
                                keys[found] = pair_key(i, j)
                            found += 1
    return found, tests


MEAN_SHIFTS = 100
"""Mean number of positions that a box may move in the order before sorting is faster than insertion"""


@bare_kernel
def sweep(
    order: IntArray,
    position: FloatArray,
    radius: FloatArray,
    collision_mask: IntArray,
    moves: BoolArray,
    margin: float,
    max_tests: int,
    keys: IntArray,
) -> tuple[int, int]:
    """Write the pairs whose axis-aligned boxes, widened by the margin, overlap.

    `order` is the order from left to right of the last step. It is updated by insertion sort, which is nearly linear
    because little changes in a step. If too much has changed, `UNSORTED` is returned.
    """
    shifts, max_shifts = 0, MEAN_SHIFTS * (len(order) + MEAN_SHIFTS)
    for k in range(1, len(order)):
        if shifts > max_shifts:
            return 0, UNSORTED
        moving, target = order[k], k
        left = position[moving, 0] - radius[moving]
        while target > 0 and position[order[target - 1], 0] - radius[order[target - 1]] > left:
            order[target] = order[target - 1]
            target -= 1
        order[target] = moving
        shifts += k - target

    found, tests, visited = 0, 0, 0
    for k in range(len(order)):
        if visited > max_tests:
            return found, EXCEEDED
        i = order[k]
        limit = radius[i] + margin
        right = position[i, 0] + limit + ROUNDING * (abs(position[i, 0]) + limit)
        for next_k in range(k + 1, len(order)):
            j = order[next_k]
            if position[j, 0] - radius[j] > right:
                break
            visited += 1
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
    """Axis-aligned boxes of G segments, sorted from left to right."""

    def __init__(self, static: StaticColliders) -> None:
        ends = static.segments[:, :4].reshape(-1, 2, 2)
        half = static.segments[:, 4:5]
        low, high = ends.min(axis=1) - half, ends.max(axis=1) + half
        self.index: IntArray = np.argsort(low[:, 0], kind="stable")
        self.box: FloatArray = np.hstack((low, high))[self.index]
        self.max_width = float((high - low)[:, 0].max(initial=0.0))
        self.max_top = float(high[:, 1].max(initial=-math.inf))

    def __len__(self) -> int:
        return len(self.index)

    @property
    def sorted(self) -> tuple[FloatArray, IntArray, float, float]:
        """The boxes (G, 4), m, from left to right, the index of each segment, the largest width and highest top, m."""
        return self.box, self.index, self.max_width, self.max_top


@bare_kernel
def near_segments(
    position: FloatArray,
    radius: FloatArray,
    can_touch: BoolArray,
    box: FloatArray,
    index: IntArray,
    max_width: float,
    max_top: float,
    margin: float,
    max_tests: int,
    keys: IntArray,
) -> tuple[int, int]:
    """Write the keys of balls and segments whose boxes, widened by the margin, overlap; return their number, and tests.

    The number of tests is replaced by `EXCEEDED` if there were more than `max_tests`.
    """
    found, tests = 0, 0
    for i in range(len(position)):
        if not can_touch[i]:
            continue
        if tests > max_tests:
            return found, EXCEEDED
        x, y, limit = position[i, 0], position[i, 1], radius[i] + margin
        limit += ROUNDING * (abs(x) + abs(y) + limit + max_width)
        if y - limit > max_top:
            continue
        low, high = 0, len(box)
        while low < high:  # the first that begins at x − reach − widest or farther right
            middle = (low + high) // 2
            if box[middle, 0] < x - limit - max_width:
                low = middle + 1
            else:
                high = middle
        for row in range(low, len(box)):
            if box[row, 0] > x + limit:
                break
            tests += 1
            if box[row, 2] >= x - limit and box[row, 1] <= y + limit and box[row, 3] >= y - limit:
                if found < len(keys):
                    keys[found] = pair_key(i, index[row])
                found += 1
    return found, tests
