"""Modes: an objective against the clock, with points of its own."""

from collections.abc import Iterator
from typing import NamedTuple

from sandbox.games.pinball.board import Board
from sandbox.games.pinball.effects import Award, Cue, Effect, Light, Machine, Now, Say
from sandbox.scene.description.play import Role


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


class Modes(Machine):
    """The one mode that runs, if any. The next is readied by a full set, and begun by a hole, where there is one."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self.modes = tuple(mode for mode in MODES if board.of_role(*mode.roles))
        self.holes = bool(board.of_role("kicker"))
        self.ready = False
        self.mode: Mode | None = None
        self.left = 0.0
        """s"""
        self.to_go = 0

    def heard(self, award: Award, now: Now) -> Iterator[Effect]:
        """Ready a mode, begin it, or count towards its end."""
        if self.mode is not None and award.kind in self.mode.roles:
            yield from self._counted(self.mode, now)
        elif self.mode is None and self.modes:
            if award.kind in LIGHTS and not self.ready:
                self.ready = True
                yield Cue("ready")
                yield Say("shoot the hole" if self.holes else "mode ready")
            if self.ready and (award.kind == "kicker" or not self.holes):
                yield from self._begun(now)

    def tick(self, now: Now) -> Iterator[Effect]:
        """Run the clock, while a ball is loose."""
        if self.mode is None or not now.loose:
            return
        self.left -= self.board.dt
        if self.left <= LATE:
            yield Say(f"{self.mode.name} is over")
            self.mode = None

    def begin(self, now: Now) -> Iterator[Effect]:
        """End what runs with the ball."""
        self.mode, self.ready = None, False
        return iter(())

    def lights(self, now: Now) -> Iterator[Light]:
        """Show what to shoot at: what the mode counts, or the holes that begin one."""
        if self.mode is not None:
            return (Light(each.name, True) for each in self.board.of_role(*self.mode.roles))
        return (Light(each.name, True) for each in self.board.of_role("kicker") if self.ready)

    def _begun(self, now: Now) -> Iterator[Effect]:
        self.mode = self.modes[now.sheet.modes % len(self.modes)]
        self.left, self.to_go, self.ready = self.mode.seconds, self.mode.needed, False
        now.sheet.modes += 1
        yield Cue("mode")
        yield Say(self.mode.name)

    def _counted(self, mode: Mode, now: Now) -> Iterator[Effect]:
        self.to_go -= 1
        yield Award("mode", mode.each)
        if not self.to_go:
            self.mode = None
            yield Cue("reward")
            yield Say(f"{mode.name} complete")
            yield Award("mode done", mode.reward, bonus=5_000)
