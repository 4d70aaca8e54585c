"""Lighting: which lamps of a game were lit when, kept with a run: who sees it again has no rules that would tell."""

from bisect import bisect_right
from collections.abc import Sequence
from typing import Any, NamedTuple

from sandbox.games.rules import Lit, Rules

APART = 0.04
"""s between two looks, as between the pictures of a film; a flash lasts longer, and a look at each step would tell in
a game's time"""

ROUNDING = 1e-9
"""s, of times of steps"""


class Lighting:
    """Looks at the lamps of a game from time to time, and keeps what has changed; of a game without lamps nothing."""

    def __init__(self, rules: Rules) -> None:
        """Begin, with all of them dark."""
        self._rules = rules if isinstance(rules, Lit) else None
        self._lit: frozenset[str] = frozenset()
        self._next = 0.0
        self._changes: list[tuple[float, list[str]]] = []

    def look(self, time: float) -> None:
        """Look, if it is time to, s."""
        if self._rules is None or time < self._next - ROUNDING:
            return
        self._next = time + APART
        lit = self._rules.lit()
        if lit != self._lit:
            self._changes.append((time, sorted(lit ^ self._lit)))
            self._lit = lit

    def told(self) -> list[list[Any]]:
        """Return as JSON values when, s, which lamps were lit or went out."""
        return [list(change) for change in self._changes]


class Lightings(NamedTuple):
    """The same to be looked up."""

    times: list[float]
    """s, in order"""
    lit: list[frozenset[str]]
    """from then on"""

    @classmethod
    def of(cls, told: Sequence[Any]) -> "Lightings":
        """Read what `Lighting.told` has returned.

        Raises:
            ValueError: it is something else.
        """
        times, states = list[float](), list[frozenset[str]]()
        now: frozenset[str] = frozenset()
        try:
            for time, names in told:
                now = now.symmetric_difference(names)
                times.append(float(time))
                states.append(now)
        except (TypeError, ValueError):
            raise ValueError("invalid lamp record: each change is a time and a list of names") from None
        return cls(times, states)

    def at(self, time: float) -> frozenset[str]:
        """Return the lamps that are lit at a time, s."""
        place = bisect_right(self.times, time) - 1
        return self.lit[place] if place >= 0 else frozenset()
