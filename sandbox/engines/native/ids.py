"""Ids: from pymunk's body ids, which are addresses, to the numbers of a scene."""

import numpy as np

from sandbox.trajectory import IntArray

LARGEST_TABLE = 1 << 22
"""Slots; 32 MB. A process whose memory is more scattered than that is searched instead."""


class IdTable:
    """Maps ids to numbers: with a table where the addresses lie close together, else by searching."""

    def __init__(self, numbers: dict[int, int]) -> None:
        """Take over what number each id stands for."""
        pairs = np.array(sorted(numbers.items()), dtype=np.int64).reshape(-1, 2)
        self._ids, self._numbers = pairs[:, 0].copy(), pairs[:, 1].copy()
        self._base = int(self._ids[0]) if len(pairs) else 0
        slots = self._slots(self._ids)
        self._table: IntArray | None = None
        if len(pairs) and int(slots[-1]) < LARGEST_TABLE:
            self._table = np.zeros(int(slots[-1]) + 1, np.int64)
            self._table[slots] = self._numbers

    def _slots(self, ids: IntArray) -> IntArray:
        """Return a slot for each id: objects lie 32 bytes apart or more, so no two share one."""
        return (ids - self._base) >> 4

    def numbers(self, ids: IntArray) -> IntArray:
        """Return the number of each id (K,); every id must be known."""
        if self._table is not None:
            return self._table[self._slots(ids)]
        return self._numbers[np.searchsorted(self._ids, ids)]
