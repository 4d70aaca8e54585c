"""Touching: which pairs an engine found in contact at the end of a substep."""

from functools import cached_property

import numpy as np

from sandbox.trajectory import BoolArray, IntArray


class Touching:
    """The pairs (K, 2) in contact, numbered as in `Contacts`, to be asked for some of them.

    Nothing is sorted before somebody asks: in most substeps nobody does.
    """

    def __init__(self, pairs: IntArray) -> None:
        self._pairs = pairs.copy()

    def has(self, pairs: IntArray) -> BoolArray:
        """Return which of pairs (M, 2) are among them, (M,)."""
        if not len(pairs) or not len(self._pairs):
            return np.zeros(len(pairs), dtype=np.bool_)
        wanted = _coded(pairs)
        place = np.searchsorted(self._sorted, wanted)
        return np.asarray(self._sorted[np.minimum(place, len(self._sorted) - 1)] == wanted)

    @cached_property
    def _sorted(self) -> IntArray:
        return np.sort(_coded(self._pairs))


def _coded(pairs: IntArray) -> IntArray:
    """Return a number for each pair; those of bodies and fixed things are below 2³¹."""
    return np.asarray(pairs[:, 0] * (1 << 32) + pairs[:, 1], dtype=np.int64)
