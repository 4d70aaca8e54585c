"""Looks: which pairs an engine found in contact, at the end of each of some substeps."""

import numpy as np

from sandbox.arrays import BoolArray, IntArray


class Looks:
    """The pairs (K, 2) in contact at each look, numbered as in `Contacts`, to be asked for some of them.

    Nothing is sorted before somebody asks: of most looks nobody does.
    """

    def __init__(self) -> None:
        self._pairs: list[IntArray] = []

    def __len__(self) -> int:
        return len(self._pairs)

    def add(self, pairs: IntArray) -> None:
        """Append what one more look found."""
        self._pairs.append(pairs.copy())

    def forget(self) -> None:
        """Drop all but the last look."""
        del self._pairs[:-1]

    def found(self, when: IntArray, pairs: IntArray) -> BoolArray:
        """Return which of pairs (M, 2) were found at look number `when` (M,), from 0."""
        found = np.zeros(len(pairs), dtype=np.bool_)
        for look in np.unique(when).tolist():
            if len(self._pairs[look]):
                asked = when == look
                known, wanted = np.sort(_coded(self._pairs[look])), _coded(pairs[asked])
                place = np.searchsorted(known, wanted)
                found[asked] = known[np.minimum(place, len(known) - 1)] == wanted
        return found


def _coded(pairs: IntArray) -> IntArray:
    """Return a number for each pair; those of bodies and fixed things are below 2³¹."""
    return np.asarray(pairs[:, 0] * (1 << 32) + pairs[:, 1], dtype=np.int64)
