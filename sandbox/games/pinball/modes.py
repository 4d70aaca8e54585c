"""Modes: timed objectives with points of their own. Multiball: locked balls that are released together."""

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
"""balls of multiball, if the table has as many"""

LOCK_POINTS = 10_000
"""points for locking a ball"""

JACKPOT_POINTS = 50_000

MULTIBALL_SAVE = 12.0
"""s, ball save at the start of multiball"""

BALL_SAVE_AFTER_LOCK = 6.0
"""s, ball save of the ball that follows a locked one"""

LOCK_GROUP = "lock"
"""group of the kickers that lock balls"""


class Multiball(Device):
    """Locks and jackpots.

    A completed bank or set of targets lights the lock. A ball that enters the lit lock is locked: it is removed, and
    another is served and launched automatically. The last lock starts multiball. Each player keeps a number of locked
    balls from turn to turn; the balls themselves are in the trough and shared.
    """

    def __init__(self, board: Playfield) -> None:
        self.holes = tuple(each.name for each in board.of_role("kicker") if each.group == LOCK_GROUP)
        self.locks = bool(self.holes)
        self.size = min(MAX_LOCKED, len(board.balls)) if self.locks else 1
        self.jackpots = "ramp" if board.of_role("ramp") else "bank" if board.of_role("drop") else "standups"
        self.on = False

    def on_award(self, award: Award, now: StepContext) -> Iterator[Effect]:
        """Light the lock, lock a ball, start multiball, or score a jackpot."""
        if self.size < 2:
            return
        if self.on:
            if award.kind == self.jackpots:
                yield PlaySound("jackpot")
                yield ShowMessage("jackpot")
                yield Award("jackpot", JACKPOT_POINTS, bonus=2_000)
        elif award.kind in ("bank", "standups") and not now.sheet.is_lock_lit:
            now.sheet.is_lock_lit = True
            yield PlaySound("ready")
            yield ShowMessage("lock is lit")
        elif award.kind == "kicker" and award.group == LOCK_GROUP and now.sheet.is_lock_lit and award.ball is not None:
            now.sheet.is_lock_lit = False
            now.sheet.locked += 1
            yield Award("lock", LOCK_POINTS)
            if now.sheet.locked < self.size:
                yield PlaySound("lock")
                yield ShowMessage(f"ball {now.sheet.locked} of {self.size} locked")
                yield RemoveBall(award.ball)
                yield ServeBalls(1)
                yield BallSave(BALL_SAVE_AFTER_LOCK)
            else:
                yield from self._start(now)

    def tick(self, now: StepContext) -> Iterator[Effect]:
        """End multiball when one ball is left."""
        if self.on and len(now.balls_in_play) + now.waiting <= 1:
            self.on = False
            yield ShowMessage("multiball is over")

    def start_ball(self, now: StepContext) -> Iterator[Effect]:
        """End multiball."""
        self.on = False
        return iter(())

    def lights(self, now: StepContext) -> Iterator[Light]:
        """Light the lock."""
        return (Light(name) for name in self.holes if now.sheet.is_lock_lit and not self.on)

    def _start(self, now: StepContext) -> Iterator[Effect]:
        """Start multiball: serve all other balls; the kicker releases its ball."""
        self.on, now.sheet.locked = True, 0
        yield PlaySound("multiball")
        yield ShowMessage("multiball")
        yield BallSave(MULTIBALL_SAVE)
        yield ServeBalls(self.size - 1)


class TimedMode(NamedTuple):
    """A timed objective."""

    name: str
    roles: tuple[Role, ...]
    """roles whose hits count; a table without them does not have this mode"""
    needed: int
    seconds: float
    each: int
    """points of each hit, in addition to those of the element"""
    reward: int
    """points for completing the mode"""


MODES = (
    TimedMode("bumper fever", ("bumper",), 12, 30.0, 1_000, 50_000),
    TimedMode("target hunt", ("standup", "drop"), 5, 30.0, 5_000, 75_000),
    TimedMode("ramp rush", ("ramp",), 2, 40.0, 20_000, 100_000),
    TimedMode("spinner storm", ("spinner",), 20, 30.0, 500, 60_000),
)

READYING_AWARDS = ("bank", "lanes", "standups")
"""awards that make the next mode ready"""

TIME_ROUNDING = 1e-9
"""s, rounding error of sums of steps"""


class Modes(Device):
    """The running mode, if any. A completed set makes the next one ready; a kicker starts it, if the table has one."""

    def __init__(self, board: Playfield) -> None:
        self.board = board
        self.modes = tuple(mode for mode in MODES if board.of_role(*mode.roles))
        self.holes = bool(board.of_role("kicker"))
        self.ready = False
        self.mode: TimedMode | None = None
        self.left = 0.0
        """s"""
        self.to_go = 0

    def on_award(self, award: Award, now: StepContext) -> Iterator[Effect]:
        """Make a mode ready, start it, or count a hit."""
        if self.mode is not None and award.kind in self.mode.roles:
            yield from self._count_hit(self.mode, now)
        elif self.mode is None and self.modes:
            if award.kind in READYING_AWARDS and not self.ready:
                self.ready = True
                yield PlaySound("ready")
                yield ShowMessage("shoot the hole" if self.holes else "mode ready")
            if self.ready and (award.kind == "kicker" or not self.holes):
                yield from self._start(now)

    def tick(self, now: StepContext) -> Iterator[Effect]:
        """Advance the clock while a ball is loose."""
        if self.mode is None or not now.loose_balls:
            return
        self.left -= self.board.dt
        if self.left <= TIME_ROUNDING:
            yield ShowMessage(f"{self.mode.name} is over")
            self.mode = None

    def start_ball(self, now: StepContext) -> Iterator[Effect]:
        """End the mode with the ball."""
        self.mode, self.ready = None, False
        return iter(())

    def lights(self, now: StepContext) -> Iterator[Light]:
        """Light the elements that the mode counts, or the kickers that start a mode."""
        if self.mode is not None:
            return (Light(each.name, True) for each in self.board.of_role(*self.mode.roles))
        return (Light(each.name, True) for each in self.board.of_role("kicker") if self.ready)

    def _start(self, now: StepContext) -> Iterator[Effect]:
        self.mode = self.modes[now.sheet.modes % len(self.modes)]
        self.left, self.to_go, self.ready = self.mode.seconds, self.mode.needed, False
        now.sheet.modes += 1
        yield PlaySound("mode")
        yield ShowMessage(self.mode.name)

    def _count_hit(self, mode: TimedMode, now: StepContext) -> Iterator[Effect]:
        self.to_go -= 1
        yield Award("mode", mode.each)
        if not self.to_go:
            self.mode = None
            yield PlaySound("reward")
            yield ShowMessage(f"{mode.name} complete")
            yield Award("mode done", mode.reward, bonus=5_000)
