"""Ramps: made by a ball that comes in at the foot and leaves at the end."""

from collections.abc import Iterator

from sandbox.games.pinball.board import Board
from sandbox.games.pinball.effects import Award, Cue, Effect, Machine, Now, points_of
from sandbox.games.pinball.switches import Hit

LONGEST = 6.0
"""s, from entry to exit; what takes longer was no shot"""


class Ramps(Machine):
    """All the ramps of a table, and which balls are on their way."""

    def __init__(self, board: Board) -> None:
        self.last: dict[str, int] = {}
        """group → the step of its exit; the entry has the least"""
        self.first: dict[str, int] = {}
        for name, members in board.groups("ramp").items():
            self.first[name], self.last[name] = members[0].step, members[-1].step
        self.entered: dict[tuple[str, int], float] = {}
        """group and ball → when, s"""

    def hit(self, hit: Hit, now: Now) -> Iterator[Effect]:
        """Follow a ball on a ramp."""
        element = hit.element
        if element.role != "ramp":
            return
        if element.group is None or self.first[element.group] == self.last[element.group]:
            yield from _made(hit)
        elif element.step == self.first[element.group]:
            self.entered[element.group, hit.ball] = hit.time
            yield Cue("ramp entry")
        elif element.step == self.last[element.group]:
            began = self.entered.pop((element.group, hit.ball), None)
            if began is not None and hit.time - began <= LONGEST:
                yield from _made(hit)

    def begin(self, now: Now) -> Iterator[Effect]:
        """Forget balls that did not arrive."""
        self.entered.clear()
        return iter(())


def _made(hit: Hit) -> Iterator[Effect]:
    yield Cue("ramp")
    yield Award("ramp", points_of(hit), hit.element.group, 1_000, hit.ball)
