"""Multiball: balls that are locked one by one, and come back all at once."""

from collections.abc import Iterator

from sandbox.games.pinball.board import Board
from sandbox.games.pinball.effects import Award, Cue, Effect, Light, Machine, Now, Save, Say, Serve, Take

MOST = 3
"""balls, of a table that has so many"""

LOCK = 10_000
"""points of a locked ball"""

JACKPOT = 50_000

SAVED = 12.0
"""s, in which drained balls come back at first"""

NEXT = 6.0
"""s, in which the ball that follows a locked one comes back"""

LOCKS = "lock"
"""the group of the holes that lock"""


class Multiball(Machine):
    """Locks and jackpots.

    A full bank or set of targets lights the lock; a ball that enters it lit is locked: it goes below the table, and
    another comes to the plunger by itself. With the last one all are there. A player keeps locked balls from turn to
    turn, as a number: the balls themselves are in the trough, and anybody's.
    """

    def __init__(self, board: Board) -> None:
        self.holes = tuple(each.name for each in board.of_role("kicker") if each.group == LOCKS)
        self.locks = bool(self.holes)
        self.size = min(MOST, len(board.balls)) if self.locks else 1
        self.jackpots = "ramp" if board.of_role("ramp") else "bank" if board.of_role("drop") else "standups"
        self.on = False

    def heard(self, award: Award, now: Now) -> Iterator[Effect]:
        """Light the lock, lock a ball, begin, or score a jackpot."""
        if self.size < 2:
            return
        if self.on:
            if award.kind == self.jackpots:
                yield Cue("jackpot")
                yield Say("jackpot")
                yield Award("jackpot", JACKPOT, bonus=2_000)
        elif award.kind in ("bank", "standups") and not now.sheet.lit:
            now.sheet.lit = True
            yield Cue("ready")
            yield Say("lock is lit")
        elif award.kind == "kicker" and award.group == LOCKS and now.sheet.lit and award.ball is not None:
            now.sheet.lit = False
            now.sheet.locked += 1
            yield Award("lock", LOCK)
            if now.sheet.locked < self.size:
                yield Cue("lock")
                yield Say(f"ball {now.sheet.locked} of {self.size} locked")
                yield Take(award.ball)
                yield Serve(1)
                yield Save(NEXT)
            else:
                yield from self._begun(now)

    def tick(self, now: Now) -> Iterator[Effect]:
        """End with the last ball but one."""
        if self.on and len(now.live) + now.waiting <= 1:
            self.on = False
            yield Say("multiball is over")

    def begin(self, now: Now) -> Iterator[Effect]:
        """Begin a ball with one."""
        self.on = False
        return iter(())

    def lights(self, now: Now) -> Iterator[Light]:
        """Show the holes that lock."""
        return (Light(name) for name in self.holes if now.sheet.lit and not self.on)

    def _begun(self, now: Now) -> Iterator[Effect]:
        """Let out all the balls; the one in the hole is the last."""
        self.on, now.sheet.locked = True, 0
        yield Cue("multiball")
        yield Say("multiball")
        yield Save(SAVED)
        yield Serve(self.size - 1)
