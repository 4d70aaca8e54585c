"""Breaks: when joints broke, which have by a time, and what is to be said of it."""

from collections.abc import Mapping

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.scene.compile.potential import parted

TELL_EVERY = 1.0
"""s of the scene between two notes"""


def broken_by(breaks: FloatArray, time: float) -> list[int]:
    """Return the numbers of the joints that have broken by a time, s; `breaks` (J,) says when each does."""
    return np.flatnonzero(parted(breaks, np.asarray([time]))[0]).tolist() if len(breaks) else []


class BreakTimes:
    """When each joint broke, as far as it has been seen."""

    def __init__(self, joints: int) -> None:
        """None of so many has."""
        self.times: FloatArray = np.full(joints, np.inf)
        """(J,) s, inf where it never did; what was handed out does not change"""

    def note(self, broken: Mapping[int, float]) -> None:
        """Learn when joints broke, s. Those that broke later than now are kept: the same way leads there again."""
        numbers = list(broken)
        if numbers and not np.isfinite(self.times[numbers]).all():
            self.times = self.times.copy()
            self.times[numbers] = list(broken.values())

    def forget(self) -> None:
        """Forget all of them."""
        self.times = np.full(len(self.times), np.inf)


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
