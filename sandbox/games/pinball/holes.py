"""Holes: kickers that hold a ball for a moment and throw it out again."""

from collections.abc import Iterator

from sandbox.action import Move
from sandbox.games.pinball.board import Board, Element
from sandbox.games.pinball.coil import Coil
from sandbox.games.pinball.effects import Award, Cue, Effect, Machine, Now, points_of
from sandbox.games.pinball.switches import Hit

HOLD = 0.8
"""s"""


class Holes(Machine):
    """All the holes of a table, and which balls are in them."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self.coil = Coil(board.seed, 1)
        self.held: dict[int, tuple[Element, float]] = {}
        """ball → its hole, and when it is thrown out, s"""

    def hit(self, hit: Hit, now: Now) -> Iterator[Effect]:
        """Hold a ball."""
        if hit.element.role != "kicker" or hit.ball in self.held:
            return
        self.held[hit.ball] = (hit.element, hit.time + HOLD)
        yield Cue("kicker")
        yield Award("kicker", points_of(hit), hit.element.group, 500, hit.ball)

    def tick(self, now: Now) -> Iterator[Effect]:
        """Throw out what has been held long enough."""
        for ball in sorted(ball for ball, (_, when) in self.held.items() if when <= now.time):
            yield from self.thrown(ball, now)

    def thrown(self, ball: int, now: Now) -> Iterator[Effect]:
        """Throw out a ball from where it is held."""
        hole, _ = self.held.pop(ball)
        x, y = now.frame.position[ball].tolist()
        yield Cue("eject")
        yield Move(time=now.time, body=self.board.names[ball], position=(x, y), velocity=self.coil.throw(hole.out))

    def forget(self, ball: int) -> None:
        """Hold a ball no more: it was taken elsewhere."""
        self.held.pop(ball, None)
