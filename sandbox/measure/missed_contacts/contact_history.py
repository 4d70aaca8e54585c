"""Contact history: the pairs that an engine found in contact at the end of each substep."""

from collections.abc import Sequence

import numpy as np

from sandbox.arrays import BoolArray, IntArray


class ContactHistory:
    """Pairs (K, 2) in contact at the end of some substeps, with the indices of `Contacts`.

    Pairs are only sorted when they are queried, which rarely happens.
    """

    def __init__(self) -> None:
        self._pairs: list[IntArray] = []

    def __len__(self) -> int:
        return len(self._pairs)

    def add(self, pairs: IntArray) -> None:
        """Append the pairs of one more substep."""
        self._pairs.append(pairs.copy())

    def extend(self, pairs: Sequence[IntArray]) -> None:
        """Append the pairs of each of some more substeps; the arrays must not change."""
        self._pairs += pairs

    def forget(self) -> None:
        """Drop all but the last substep."""
        del self._pairs[:-1]

    def found(self, when: IntArray, pairs: IntArray) -> BoolArray:
        """Return which pairs (M, 2) were in contact in the entries `when` (M,), counted from 0."""
        found = np.zeros(len(pairs), dtype=np.bool_)
        for entry in np.unique(when).tolist():
            if len(self._pairs[entry]):
                selected = when == entry
                known, wanted = np.sort(pair_keys(*self._pairs[entry].T)), pair_keys(*pairs[selected].T)
                index = np.searchsorted(known, wanted)
                found[selected] = known[np.minimum(index, len(known) - 1)] == wanted
        return found


def pair_keys(first: IntArray, second: IntArray) -> IntArray:
    """Return a number for each pair of indices, (K,); indices of bodies and static objects are below 2³¹."""
    return np.asarray(first * (1 << 32) + second, dtype=np.int64)
