"""Turns: what the rules have made of each stroke, by the number of strokes before it.

A session is its scene and its actions; so is a game. Whoever goes back in the session finds the turn of then, and who
strikes there goes another way.
"""

from dataclasses import replace

from sandbox.arrays import FloatArray
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.call import Call
from sandbox.scene.description.base import Point
from sandbox.trajectory import Contacts


class Turns:
    """Matches as they stood before each stroke, and what was called of it."""

    def __init__(self, first: Match) -> None:
        self._matches, self._calls = [first], [Call()]

    def __len__(self) -> int:
        return len(self._matches)

    def match(self, strokes: int) -> Match:
        """Return the match as it stands after so many strokes, or as far as it is known."""
        return self._matches[min(strokes, len(self._matches) - 1)]

    def call(self, strokes: int) -> Call:
        """Return what is called of the next stroke."""
        return self._calls[min(strokes, len(self._calls) - 1)]

    def go_another_way(self, strokes: int, match: Match) -> None:
        """Go on with another match after so many strokes; what came later is forgotten."""
        call = self.call(strokes) if match.state is self.match(strokes).state else Call()
        self._matches[strokes:], self._calls[strokes:] = [match], [call]

    def say(self, strokes: int, call: Call) -> None:
        """Call something of the next stroke."""
        self._matches[strokes + 1 :] = []
        self._calls[strokes:] = [call]

    def lie(self, strokes: int, position: tuple[Point, ...]) -> None:
        """Take over where the balls are, m; hands may have moved them."""
        match = self._matches[strokes]
        if match.position != position:
            self._matches[strokes] = replace(match, position=position)

    def judge(self, strokes: int, contacts: Contacts, position: FloatArray, began: float) -> Match:
        """Let the rules say what came of the last of so many strokes, and return the match after it.

        Strokes that nobody has judged, of a session that was opened again, count as this one.

        Args:
            strokes: that have been played.
            contacts: since the last.
            position: (N, 2) m, where the balls have come to rest.
            began: when that stroke was, s.

        Raises:
            GameError: it was none that could be played.
        """
        before, call = self.match(strokes - 1), self.call(strokes - 1)
        return self.record(strokes, before.played(contacts, position, call, began))

    def record(self, strokes: int, match: Match) -> Match:
        """Keep a match as that after so many strokes."""
        missing = strokes + 1 - len(self._matches)
        self._matches += [match] * missing
        self._calls += [Call()] * (strokes + 1 - len(self._calls))
        return match
