"""Breaks: which joints have broken by a time, and what is to be said of it."""

import numpy as np

from sandbox.scene.potential import parted
from sandbox.trajectory import FloatArray

TELL_EVERY = 1.0
"""s of the scene between two notes"""


def broken_by(breaks: FloatArray, time: float) -> list[int]:
    """Return the numbers of the joints that have broken by a time, s; `breaks` (J,) says when each does."""
    return np.flatnonzero(parted(breaks, np.asarray([time]))[0]).tolist() if len(breaks) else []


class BreakNotes:
    """Says how many joints broke, the first at once, then once a second: a cloth tears on and on."""

    def __init__(self) -> None:
        self._told, self._when = 0, 0.0

    def told(self, broken: int, now: float) -> list[tuple[str, str]]:
        """Return what is to be said, (level, text), where so many are broken at a time, s."""
        if broken < self._told or now < self._when:  # it has gone back
            self._told, self._when = broken, now
        more = broken - self._told
        if not more or not (self._told == 0 or now >= self._when + TELL_EVERY):
            return []
        self._told, self._when = broken, now
        return [("info", "a joint broke" if more == 1 else f"{more:,} joints broke")]
