"""Pairs of nearby points, found with a uniform grid of cells."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from sandbox.arrays import FloatArray, IntArray

CHUNK = 1 << 20
"""Candidate pairs handled at once: bounds memory, and is large enough to hide numpy's overhead."""

_HALF_RING = ((0, 1), (1, -1), (1, 0), (1, 1))
"""Offsets of half of the eight neighbouring cells; with the cell itself they give every pair of cells once."""


def near_pairs(position: FloatArray, distance: float) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield, in chunks, every pair (i, j) of points less than `distance` apart, and some that are farther apart.

    Args:
        position: points (N, 2), m, finite.
        distance: m, positive; size of a cell.

    Yields:
        Two index arrays (K,) each; no pair occurs twice. K is at most about `CHUNK`, unless a single cell holds more.
        Cost: O(N log N) plus the number of candidates, which are all pairs of points in the same or in adjacent cells.
    """
    if len(position) < 2:
        return
    column, row = (_compressed(np.floor(position[:, axis] / distance)) for axis in (0, 1))
    stride = int(row.max()) + 3  # so that row ± 1 stays in its column
    key = column * stride + row + 1
    order = np.argsort(key, kind="stable")
    key = key[order]
    index = np.arange(len(key))

    ranges = [(index + 1, np.searchsorted(key, key, side="right"))]
    for across, up in _HALF_RING:
        neighbour = key + across * stride + up
        ranges.append((np.searchsorted(key, neighbour), np.searchsorted(key, neighbour, side="right")))

    for first, last in ranges:
        total = np.cumsum(last - first)
        start = 0
        while start < len(key):
            done = total[start - 1] if start else 0
            stop = max(int(np.searchsorted(total, done + CHUNK)), start + 1)
            count = (last - first)[start:stop]
            if count.any():
                i = np.repeat(index[start:stop], count)
                within = np.arange(len(i)) - np.repeat(np.cumsum(count) - count, count)
                yield order[i], order[np.repeat(first[start:stop], count) + within]
            start = stop


def _compressed(cell: npt.NDArray[Any]) -> IntArray:
    """Number cells so that adjacent cells stay adjacent and wide gaps shrink to two, which avoids integer overflow."""
    distinct, index = np.unique(cell, return_inverse=True)
    number = np.concatenate(([0], np.cumsum(np.minimum(np.diff(distinct), 2.0)))).astype(np.int64)
    return np.asarray(number[index.reshape(-1)], dtype=np.int64)
