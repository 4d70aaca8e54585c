"""Past: what a game showed at earlier times, for who looks back: its rules know the present alone."""

from bisect import bisect_right
from typing import NamedTuple

MOST = 10_000
"""moments that are kept; of what was long ago, where there are more, every second"""


class Board(NamedTuple):
    """What is shown of a game."""

    score: str
    lines: tuple[tuple[str, str], ...]
    """labels and texts"""
    over: str | None
    """why it is over; None while it goes on"""


class Shown(NamedTuple):
    """A moment of a game, as it is seen."""

    board: Board
    lit: frozenset[str]
    """names of the parts whose lamps are lit"""


class Past:
    """What was shown, by its time; a moment that shows what the one before did is not kept."""

    def __init__(self) -> None:
        self._times: list[float] = []
        self._shown: list[Shown] = []

    def note(self, time: float, end: float, shown: Shown) -> None:
        """Take note of what is shown at a time, s; what was beyond the end, s, of all that has been is forgotten."""
        known = bisect_right(self._times, end)
        del self._times[known:], self._shown[known:]
        place = bisect_right(self._times, time)
        if place and self._shown[place - 1] == shown:
            return
        if place and self._times[place - 1] == time:
            self._shown[place - 1] = shown
            return
        self._times.insert(place, time)
        self._shown.insert(place, shown)
        if len(self._times) > MOST:
            half = MOST // 2
            self._times[:half], self._shown[:half] = self._times[:half:2], self._shown[:half:2]

    def at(self, time: float) -> Shown | None:
        """Return what was shown at a time, s, or first of all; None if nothing was yet."""
        return self._shown[max(bisect_right(self._times, time) - 1, 0)] if self._shown else None
