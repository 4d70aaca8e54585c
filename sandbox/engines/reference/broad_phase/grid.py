"""Grid: balls are sorted into square cells as wide as the widest of them; only neighbouring cells are looked at.

O(N) for balls of one size. One huge ball among small ones makes all cells huge: then the sweep is the better choice.
"""

import math

import numpy as np

from sandbox.engines.kernel import kernel
from sandbox.engines.reference.meeting import may_meet, pair_key
from sandbox.trajectory import BoolArray, FloatArray, IntArray

FARTHEST_CELL = 4e18
"""Cells beyond fall together: the numbers of cells are 64-bit."""

LOW = 2**31 - 1
"""The low bits of a cell's number: more than any table has slots."""


@kernel
def cell_of(coordinate: float, width: float) -> int:
    """Return the number of the cell that a coordinate lies in."""
    if math.isnan(coordinate):  # a body that has diverged meets nobody; the step ends with saying so
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
    meets: IntArray,
    moves: BoolArray,
    margin: float,
    keys: IntArray,
) -> tuple[int, int]:
    """Hand on the pairs whose bounding circles, widened by the margin, overlap; `order` (N,) is used for scratch."""
    count, widest = len(position), 0.0
    for i in range(count):
        if meets[i] > 0:
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
        if meets[i] > 0:
            column[i], row[i] = cell_of(position[i, 0], width), cell_of(position[i, 1], width)
            slot[i] = slot_of(column[i], row[i], mask)
            begin[slot[i] + 2] += 1
    for s in range(2, mask + 3):
        begin[s] += begin[s - 1]
    for i in range(count):
        if meets[i] > 0:
            order[begin[slot[i] + 1]] = i
            begin[slot[i] + 1] += 1

    found, tests = 0, 0
    for i in range(count):
        if meets[i] == 0:
            continue
        x, y = position[i, 0], position[i, 1]
        # Three by three cells at most; told by positions, as far out neighbouring numbers would be rounded apart.
        for across in range(cell_of(x - width, width), cell_of(x + width, width) + 1):
            for up in range(cell_of(y - width, width), cell_of(y + width, width) + 1):
                s = slot_of(across, up, mask)
                for place in range(begin[s], begin[s + 1]):
                    j = order[place]
                    # Another cell may share the slot.
                    if j <= i or column[j] != across or row[j] != up:
                        continue
                    if may_meet(meets[i], moves[i], meets[j], moves[j]):
                        tests += 1
                        dx, dy = position[j, 0] - x, position[j, 1] - y
                        reach = radius[i] + radius[j] + margin
                        if dx * dx + dy * dy <= reach * reach:
                            if found < len(keys):
                                keys[found] = pair_key(i, j)
                            found += 1
    return found, tests
