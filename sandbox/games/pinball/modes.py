"""Modes: an objective against the clock, with points of its own.

Multiball: balls that are locked one by one, and come back all at once.
"""

from collections.abc import Iterator
from typing import NamedTuple

from sandbox.games.pinball.events import (
    Award,
    BallSave,
    Device,
    Effect,
    Light,
    PlaySound,
    RemoveBall,
    ServeBalls,
    ShowMessage,
    StepContext,
)
from sandbox.games.pinball.playfield import Playfield
from sandbox.scene.description.play import Role

MAX_LOCKED = 3
"""balls, of a table that has so many"""

LOCK = 10_000
"""points of a locked ball"""

JACKPOT = 50_000

MULTIBALL_SAVE = 12.0
"""s, in which drained balls come back at first"""

NEXT = 6.0
"""s, in which the ball that follows a locked one comes back"""

LOCKS = "lock"
"""the group of the holes that lock"""


class Multiball(Device):
    """Locks and jackpots.

    A full bank or set of targets lights the lock; a ball that enters it lit is locked: it goes below the table, and
    another comes to the plunger by itself. With the last one all are there. A player keeps locked balls from turn to
    turn, as a number: the balls themselves are in the trough, and anybody's.
    """

    def __init__(self, board: Playfield) -> None:
        self.holes = tuple(each.name for each in board.of_role("kicker") if each.group == LOCKS)
        self.locks = bool(self.holes)
        self.size = min(MAX_LOCKED, len(board.balls)) if self.locks else 1
        self.jackpots = "ramp" if board.of_role("ramp") else "bank" if board.of_role("drop") else "standups"
        self.on = False

    def heard(self, award: Award, now: StepContext) -> Iterator[Effect]:
        """Light the lock, lock a ball, begin, or score a jackpot."""
        if self.size < 2:
            return
        if self.on:
            if award.kind == self.jackpots:
                yield PlaySound("jackpot")
                yield ShowMessage("jackpot")
                yield Award("jackpot", JACKPOT, bonus=2_000)
        elif award.kind in ("bank", "standups") and not now.sheet.lit:
            now.sheet.lit = True
            yield PlaySound("ready")
            yield ShowMessage("lock is lit")
        elif award.kind == "kicker" and award.group == LOCKS and now.sheet.lit and award.ball is not None:
            now.sheet.lit = False
            now.sheet.locked += 1
            yield Award("lock", LOCK)
            if now.sheet.locked < self.size:
                yield PlaySound("lock")
                yield ShowMessage(f"ball {now.sheet.locked} of {self.size} locked")
                yield RemoveBall(award.ball)
                yield ServeBalls(1)
                yield BallSave(NEXT)
            else:
                yield from self._begun(now)

    def tick(self, now: StepContext) -> Iterator[Effect]:
        """End with the last ball but one."""
        if self.on and len(now.live) + now.waiting <= 1:
            self.on = False
            yield ShowMessage("multiball is over")

    def begin(self, now: StepContext) -> Iterator[Effect]:
        """Begin a ball with one."""
        self.on = False
        return iter(())

    def lights(self, now: StepContext) -> Iterator[Light]:
        """Show the holes that lock."""
        return (Light(name) for name in self.holes if now.sheet.lit and not self.on)

    def _begun(self, now: StepContext) -> Iterator[Effect]:
        """Let out all the balls; the one in the hole is the last."""
        self.on, now.sheet.locked = True, 0
        yield PlaySound("multiball")
        yield ShowMessage("multiball")
        yield BallSave(MULTIBALL_SAVE)
        yield ServeBalls(self.size - 1)


class Mode(NamedTuple):
    """What is to be done."""

    name: str
    roles: tuple[Role, ...]
    """of which each hit counts; a table that has none of them does without this mode"""
    needed: int
    seconds: float
    each: int
    """points, beside those of the hit itself"""
    reward: int
    """points, once all is done"""


MODES = (
    Mode("bumper fever", ("bumper",), 12, 30.0, 1_000, 50_000),
    Mode("target hunt", ("standup", "drop"), 5, 30.0, 5_000, 75_000),
    Mode("ramp rush", ("ramp",), 2, 40.0, 20_000, 100_000),
    Mode("spinner storm", ("spinner",), 20, 30.0, 500, 60_000),
)

LIGHTS = ("bank", "lanes", "standups")
"""what makes the next mode ready"""

LATE = 1e-9
"""s, of rounding in sums of steps"""


class Modes(Device):
    """The one mode that runs, if any. The next is readied by a full set, and begun by a hole, where there is one."""

    def __init__(self, board: Playfield) -> None:
        self.board = board
        self.modes = tuple(mode for mode in MODES if board.of_role(*mode.roles))
        self.holes = bool(board.of_role("kicker"))
        self.ready = False
        self.mode: Mode | None = None
        self.left = 0.0
        """s"""
        self.to_go = 0

    def heard(self, award: Award, now: StepContext) -> Iterator[Effect]:
        """Ready a mode, begin it, or count towards its end."""
        if self.mode is not None and award.kind in self.mode.roles:
            yield from self._counted(self.mode, now)
        elif self.mode is None and self.modes:
            if award.kind in LIGHTS and not self.ready:
                self.ready = True
                yield PlaySound("ready")
                yield ShowMessage("shoot the hole" if self.holes else "mode ready")
            if self.ready and (award.kind == "kicker" or not self.holes):
                yield from self._begun(now)

    def tick(self, now: StepContext) -> Iterator[Effect]:
        """Run the clock, while a ball is loose."""
        if self.mode is None or not now.loose:
            return
        self.left -= self.board.dt
        if self.left <= LATE:
            yield ShowMessage(f"{self.mode.name} is over")
            self.mode = None

    def begin(self, now: StepContext) -> Iterator[Effect]:
        """End what runs with the ball."""
        self.mode, self.ready = None, False
        return iter(())

    def lights(self, now: StepContext) -> Iterator[Light]:
        """Show what to shoot at: what the mode counts, or the holes that begin one."""
        if self.mode is not None:
            return (Light(each.name, True) for each in self.board.of_role(*self.mode.roles))
        return (Light(each.name, True) for each in self.board.of_role("kicker") if self.ready)

    def _begun(self, now: StepContext) -> Iterator[Effect]:
        self.mode = self.modes[now.sheet.modes % len(self.modes)]
        self.left, self.to_go, self.ready = self.mode.seconds, self.mode.needed, False
        now.sheet.modes += 1
        yield PlaySound("mode")
        yield ShowMessage(self.mode.name)

    def _counted(self, mode: Mode, now: StepContext) -> Iterator[Effect]:
        self.to_go -= 1
        yield Award("mode", mode.each)
        if not self.to_go:
            self.mode = None
            yield PlaySound("reward")
            yield ShowMessage(f"{mode.name} complete")
            yield Award("mode done", mode.reward, bonus=5_000)
