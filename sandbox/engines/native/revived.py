"""Revived: what `memory.py` says of contacts that begin again, worked out from listings where that can be.

Where two bodies touch in one place at most, a pair's contact is one point, and what it starts again at is what it had
at the end of the last substep in which it touched, along the normal and across it: c = J/n as complex numbers, and
then c·n' about the new normal. To hear of each beginning from pymunk takes as long as a sixth of the step of a pile.
"""

import numpy as np

from sandbox.engines.native.reader import Reader
from sandbox.engines.rows import RowTable
from sandbox.engines.touching import NOTHING, Touching
from sandbox.trajectory import IntArray

Pair = tuple[int, int]
"""Two bodies or fixed things by their numbers, the lower first."""


class Revived:
    """Pairs that have parted and that pymunk still remembers."""

    def __init__(self, reader: Reader, things: int) -> None:
        """Begin with a first look, at which nobody may be remembered yet.

        Args:
            reader: of the space; it keeps each listing until the next but one from now on.
            things: how many fixed things there are.
        """
        self._reader, self._things = reader, things
        self._rows = RowTable()
        self._last = NOTHING
        self._parted: dict[Pair, complex] = {}
        """pair → what it had, N·s, in the frame of its normal"""
        reader.keep_last = True

    def correct(self, found: Touching) -> Touching:
        """Return what touches, which are others than at the last look, without impulses that are counted twice."""
        last = self._last
        lower, higher = np.minimum(found.a, found.b), np.maximum(found.a, found.b)  # pymunk may list them either way
        row, new = self._rows.find(lower + self._things, higher + self._things)
        self._rows.keep(np.arange(len(found.a)))
        self._last = found
        ended = np.ones(len(last.a), np.bool_)
        goes_on = np.ones(len(found.a), np.bool_)
        goes_on[new] = False
        ended[row[goes_on]] = False
        gone = np.flatnonzero(ended)
        if len(gone):
            impulse, normal = self._reader.last_vectors(gone)
            for pair, had in zip(_pairs(last, gone), (impulse / normal).tolist(), strict=True):
                self._parted[pair] = had
        if not self._parted:
            return found
        again = [
            (k, self._parted.pop(pair))
            for k, pair in zip(new.tolist(), _pairs(found, new), strict=True)
            if pair in self._parted
        ]
        if self._parted:  # what pymunk no longer remembers begins at nothing
            cached = set(map(_pair, *self._reader.cached().T.tolist()))
            self._parted = {pair: had for pair, had in self._parted.items() if pair in cached}
        if not again:
            return found
        impulse = found.impulse.copy()
        for k, had in again:
            impulse[k] -= had * found.normal[k]
        return found._replace(impulse=impulse)


def _pairs(touching: Touching, rows: IntArray) -> list[Pair]:
    return list(map(_pair, touching.a[rows].tolist(), touching.b[rows].tolist()))


def _pair(a: int, b: int) -> Pair:
    return (a, b) if a < b else (b, a)
