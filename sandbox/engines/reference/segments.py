"""Segments: a broad phase of its own for walls and posts, which never move.

Their boxes are sorted from left to right once. A ball looks only at those that begin no farther left than the widest
of them reaches.
"""

import numpy as np

from sandbox.engines.fixtures import Fixtures
from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.engines.reference.meeting import ROUNDING, pair_key
from sandbox.trajectory import BoolArray, FloatArray, IntArray


class SegmentBoxes:
    """The boxes around G segments, sorted."""

    def __init__(self, fixtures: Fixtures) -> None:
        ends = fixtures.segments[:, :4].reshape(-1, 2, 2)
        half = fixtures.segments[:, 4:5]
        low, high = ends.min(axis=1) - half, ends.max(axis=1) + half
        self.index: IntArray = np.argsort(low[:, 0], kind="stable")
        self.box: FloatArray = np.hstack((low, high))[self.index]
        self.widest = float((high - low)[:, 0].max(initial=0.0))

    def __len__(self) -> int:
        return len(self.index)


@kernel
def near_segments(
    position: FloatArray,
    radius: FloatArray,
    able: BoolArray,
    box: FloatArray,
    index: IntArray,
    widest: float,
    margin: float,
    keys: IntArray,
) -> tuple[int, int]:
    """Write the keys of balls and segments whose boxes, widened by the margin, overlap; return how many, and tests."""
    found, tests = 0, 0
    for i in range(len(position)):
        if not able[i]:
            continue
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
