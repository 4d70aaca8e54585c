"""Touching: which pairs an engine found in contact at the end of a substep."""

import numpy as np

from sandbox.trajectory import BoolArray, IntArray


class Touching:
    """The pairs (K, 2) in contact, numbered as in `Contacts`, to be asked for some of them.

    Nothing is sorted before somebody asks: most substeps nobody does.
    """

    def __init__(self, pairs: IntArray) -> None:
        self._pairs = pairs

    def has(self, pair: IntArray) -> BoolArray:
        """Return which of pairs (M, 2) are among them, (M,)."""
        if not len(pair) or not len(self._pairs):
            return np.zeros(len(pair), dtype=np.bool_)
        both = np.concatenate((self._pairs, pair))
        second = both[:, 1] - both[:, 1].min()
        code = both[:, 0] * (second.max() + 1) + second
        return np.isin(code[len(self._pairs) :], code[: len(self._pairs)])
