"""Search: what a table does when it has not heard of its ball for too long."""

import math
from collections.abc import Iterator

from sandbox.action import Drive, Impulse
from sandbox.games.pinball.board import Board
from sandbox.games.pinball.drops import Drops
from sandbox.games.pinball.effects import Cue, Effect, Machine, Now, Save, Say, Serve, Take
from sandbox.games.pinball.holes import Holes
from sandbox.games.pinball.switches import Hit
from sandbox.games.pinball.trough import SLOW
from sandbox.scene.random_streams import Stream, draws

PATIENCE = 10.0
"""s without a switch, the balls slow"""

LONGEST = 30.0
"""s without a switch, however fast they are"""

PULSE, BETWEEN = 0.12, 0.25
"""s, that a coil is on, and from one to the next"""

KICK = 0.5
"""m/s, that the second round gives to a ball"""

ROUNDS = 3
"""the first pulses every coil, the second also kicks the balls, the third takes them back to the plunger"""


class Search(Machine):
    """Pulses every coil in turn, as tables do; what does not help is followed by what does."""

    def __init__(self, board: Board, holes: Holes, banks: tuple[Drops, ...]) -> None:
        self.board, self.holes, self.banks = board, holes, banks
        self.flippers = tuple(each.name for each in board.of_role("flipper"))
        self.heard_of = 0.0
        """when there was a switch, or reason to wait, s"""
        self.round = 0
        self.next: tuple[int, float] | None = None
        """the coil that is next in this round, and when, s"""
        self.off: dict[str, float] = {}
        """drive that is on → when it goes off, s"""
        self.chance = draws(Stream.BALL_SEARCH, board.seed)

    def hit(self, hit: Hit, now: Now) -> Iterator[Effect]:
        """Be content: the ball is about."""
        self._content(now.time)
        return iter(())

    def begin(self, now: Now) -> Iterator[Effect]:
        """Be content."""
        self._content(now.time)
        return iter(())

    def tick(self, now: Now) -> Iterator[Effect]:
        """Wait, or search on."""
        for drive in sorted(drive for drive, when in self.off.items() if when <= now.time):
            del self.off[drive]
            yield Drive(time=now.time, drive=drive, level=0.0)
        if now.up or not now.loose:  # a ball may be cradled, or waits for the player
            self._content(now.time)
            return
        if self.next is not None:
            yield from self._searched(now)
            return
        silent = now.time - self.heard_of
        slow = all(math.hypot(*now.frame.velocity[ball].tolist()) < SLOW for ball in now.loose)
        if silent >= LONGEST or (slow and silent >= PATIENCE):
            self.next = (0, now.time)
            self.round += 1
            yield Say("ball search")

    def _content(self, time: float) -> None:
        self.heard_of, self.next, self.round = time, None, 0

    def _searched(self, now: Now) -> Iterator[Effect]:
        """Pulse the next coil, when it is time; after the last, do what the round adds."""
        assert self.next is not None
        coil, when = self.next
        if now.time < when:
            return
        self.next = (coil + 1, now.time + BETWEEN)
        holes = sorted(self.holes.held)
        if coil < len(self.flippers):
            yield Cue("coil")
            yield Drive(time=now.time, drive=self.flippers[coil], level=1.0)
            self.off[self.flippers[coil]] = now.time + PULSE
        elif coil < len(self.flippers) + len(self.banks):
            yield from self.banks[coil - len(self.flippers)].raised(now)
        elif holes:
            yield from self.holes.thrown(holes[0], now)
        else:
            yield from self._ended(now)

    def _ended(self, now: Now) -> Iterator[Effect]:
        """End a round: wait half as long for a switch as before the first."""
        self.next, self.heard_of = None, now.time - PATIENCE / 2.0
        if self.round == ROUNDS - 1:
            for ball in now.loose:
                angle = self.chance.uniform(0.0, 2.0 * math.pi)
                push = KICK * self.board.mass[ball]
                impulse = (push * math.cos(angle), push * math.sin(angle))
                yield Impulse(time=now.time, body=self.board.names[ball], impulse=impulse)
        elif self.round >= ROUNDS:
            self._content(now.time)
            for ball in now.loose:
                yield Take(ball)
            yield Serve(len(now.loose))
            yield Save(0.0)
            yield Say("ball found")
