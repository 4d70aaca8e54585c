"""Parting: when two shots that began almost alike have come apart."""

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.exact.tabletop.shot_result import ShotResult

LOOKS = 4000
"""Moments at which two shots are compared; between the first that parts them and the one before, it is halved."""

HALVINGS = 40


class Parting:
    """Two shots of N balls, with their ways."""

    def __init__(self, one: ShotResult, other: ShotResult) -> None:
        """Look at two shots.

        Raises:
            ValueError: their ways were not kept.
        """
        self._shots = one, other
        self.end = max(one.duration, other.duration)
        """s, when both rest"""
        # Two that fall a moment apart are for that moment as far apart as the pocket is wide, which means nothing.
        fall_one, fall_other = _falls(one), _falls(other)
        self._until = np.full(len(one.names), np.inf)
        for number, name in enumerate(one.names):
            if name in fall_one and one.pocketed[name] == other.pocketed.get(name):
                self._until[number] = np.nextafter(min(fall_one[name], fall_other[name]), 0.0)

    def apart(self, times: FloatArray) -> FloatArray:
        """Return how far each ball of the one shot is from itself in the other, (T, N) m.

        Of a ball that falls into the same pocket in both, that stays as it was when it first did.
        """
        one, other = self._shots
        gaps = np.hypot(*np.moveaxis(one.at(times) - other.at(times), -1, 0))
        fallen = np.flatnonzero(np.isfinite(self._until))
        if len(fallen):
            last = np.hypot(*np.moveaxis(one.at(self._until[fallen]) - other.at(self._until[fallen]), -1, 0))
            for k, number in enumerate(fallen.tolist()):
                gaps[times > self._until[number], number] = last[k, number]
        return np.asarray(gaps)

    @property
    def farthest(self) -> float:
        """How far a ball is from itself at most, m."""
        return float(self._looks[1].max(initial=0.0))

    def beyond(self, tolerance: float) -> tuple[float, int] | None:
        """Return when a ball first is farther from itself than a tolerance, m: s, and which; None where none is."""
        times, gaps = self._looks
        over = np.flatnonzero((gaps > tolerance).any(axis=1))
        if not len(over):
            return None
        k = int(over[0])
        low, high = float(times[max(k - 1, 0)]), float(times[k])
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            if (self.apart(np.array([middle])) > tolerance).any():
                high = middle
            else:
                low = middle
        return high, int(self.apart(np.array([high]))[0].argmax())

    @cached_property
    def _looks(self) -> tuple[FloatArray, FloatArray]:
        """Moments throughout, (T,) s, and how far each ball is from itself then, (T, N) m."""
        times = np.linspace(0.0, self.end, LOOKS + 1)
        return times, self.apart(times)


def _falls(outcome: ShotResult) -> Mapping[str, float]:
    """Return when each ball fell, s."""
    return {event.ball: event.time for event in outcome.events if event.kind == "pocket"}
