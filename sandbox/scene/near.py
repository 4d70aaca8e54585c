"""Pairs of points that lie near each other, found through a uniform grid of cells."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

CHUNK = 1 << 20
"""Candidates handled at once: bounds memory, large enough to hide numpy's overhead."""

_HALF_RING = ((0, 1), (1, -1), (1, 0), (1, 1))
"""With the cell itself, half of the eight neighbours meets every pair of cells once."""


def near_pairs(position: FloatArray, reach: float) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield, in chunks, every pair (i, j) of points less than `reach` apart, and some that are farther.

    Args:
        position: centres (N, 2), m, finite.
        reach: m, positive.

    Yields:
        Two index arrays (K,) each, K about `CHUNK` at most unless one cell alone holds more; no pair twice.
        Cost: O(N log N) and the candidates, which are all pairs of points in the same or in touching cells.
    """
    if len(position) < 2:
        return
    column, row = (_compressed(np.floor(position[:, axis] / reach)) for axis in (0, 1))
    stride = int(row.max()) + 3  # so that row ± 1 never runs into the next column
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
    """Number cells so that neighbours stay neighbours and wide gaps shrink to two: no overflow far out."""
    distinct, place = np.unique(cell, return_inverse=True)
    number = np.concatenate(([0], np.cumsum(np.minimum(np.diff(distinct), 2.0)))).astype(np.int64)
    return np.asarray(number[place.reshape(-1)], dtype=np.int64)
