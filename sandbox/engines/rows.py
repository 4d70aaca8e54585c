"""RowTable: which row belongs to a pair that touched a moment ago."""

import numpy as np

from sandbox.trajectory import IntArray

LARGEST_SQUARE = 4096
"""Bodies and fixed things up to which a square table serves: 64 MB at most, of which only what is touched is real."""


class RowTable:
    """Maps the pairs of one moment to the rows they were given a moment before.

    A pair that was not there the moment before counts as new, even if it once had a row. With few bodies a
    square table answers in one look; beyond, the pairs are searched in sorted order.
    """

    def __init__(self) -> None:
        self._row: IntArray = np.empty(0, np.int64)
        self.key: IntArray = np.empty(0, np.int64)
        self._table = np.zeros((0, 0), np.int32)  # place in `key`, never cleared

    def find(self, first: IntArray, second: IntArray) -> tuple[IntArray, IntArray]:
        """Look up the pairs of a new moment.

        Args:
            first: (K,) small whole numbers.
            second: (K,) likewise.

        Returns:
            Each pair's row (K,), unset where it is new; the places (M,) of the new ones.
        """
        key = (first << 32) | second
        row, new = np.empty(len(key), np.int64), np.arange(len(key))
        if len(key) and len(self.key):
            place = self._places(first, second, key)
            known = self.key[place] == key
            row, new = self._row[place], np.flatnonzero(~known)
        if len(key) and self._fits(first, second):
            self._table[first, second] = np.arange(len(key))
        self.key = key
        return row, new

    def keep(self, row: IntArray) -> None:
        """Say which row each pair of the last `find` has."""
        self._row = row

    def _places(self, first: IntArray, second: IntArray, key: IntArray) -> IntArray:
        """Return where each pair stood at the last moment; for one that was not there, anywhere."""
        last = len(self.key) - 1
        if self._fits(first, second):
            return np.minimum(self._table[first, second], last)
        order = np.argsort(self.key)
        return order[np.minimum(np.searchsorted(self.key, key, sorter=order), last)]

    def _fits(self, first: IntArray, second: IntArray) -> bool:
        """Tell whether the square table serves, growing it to hold the pairs."""
        highest = max(int(first.max()), int(second.max()))
        if highest >= LARGEST_SQUARE:
            return False
        old = len(self._table)
        if highest >= old:
            size = min(max(2 * old, highest + 1), LARGEST_SQUARE)
            table = np.zeros((size, size), np.int32)
            table[:old, :old] = self._table
            self._table = table
        return True
