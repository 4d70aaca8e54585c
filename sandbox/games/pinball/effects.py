"""Effects: what machines answer with, and the one shape that all machines have."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

from sandbox.action import Action
from sandbox.games.pinball.sheet import Sheet
from sandbox.games.pinball.switches import Hit
from sandbox.scene.description.play import Role
from sandbox.trajectory import Frame

POINTS: dict[Role, int] = {
    "bumper": 500,
    "drop": 2_500,
    "kicker": 5_000,
    "ramp": 10_000,
    "rollover": 1_000,
    "slingshot": 110,
    "spinner": 250,
    "standup": 2_000,
}
"""of elements that state none"""


class Award(NamedTuple):
    """Points, and the news of what they are for, which every machine hears."""

    kind: str
    """a role, or what a machine makes of several: `bank`, `lanes`, `standups`, `jackpot` …"""
    points: int
    group: str | None = None
    bonus: int = 0
    """added to what is counted at the end of the ball"""
    ball: int | None = None
    """whose deed it was"""


class Cue(NamedTuple):
    """A sound, by its name."""

    name: str


class Say(NamedTuple):
    """A line for the player, for a few seconds."""

    text: str


class Take(NamedTuple):
    """A ball goes from the table to the trough, at once."""

    ball: int


class Serve(NamedTuple):
    """Balls are put onto the table, one after the other, and launched by themselves."""

    balls: int


class Save(NamedTuple):
    """Balls that drain within a time, s, come back."""

    seconds: float


class Again(NamedTuple):
    """The player shoots again after this ball, for a reason that counts once a game."""

    reason: str


Effect: TypeAlias = Award | Cue | Say | Take | Serve | Save | Again | Action


class Light(NamedTuple):
    """That a lamp is lit."""

    name: str
    """of its element"""
    blinks: bool = False
    """Call for the player; for half of the time such a lamp is dark, also where another machine has lit it."""


@dataclass
class Now:
    """How things stand at a look."""

    time: float
    """s"""
    frame: Frame
    sheet: Sheet
    """of who plays"""
    live: tuple[int, ...] = ()
    """the balls in play, in the lane too"""
    loose: tuple[int, ...] = ()
    """of these, the ones that neither wait in the lane nor are held in a hole"""
    lane: dict[int, bool] = field(default_factory=dict)
    """whether a ball lies where the plunger is, of those that were asked about"""
    waiting: int = 0
    """balls that are about to be served"""
    up: frozenset[str] = field(default_factory=frozenset)
    """the sides whose flippers are held up"""


class Machine:
    """Something on the table that has a state. Each method yields what comes of it; none is a must."""

    def hit(self, hit: Hit, now: Now) -> Iterator[Effect]:
        """Answer a switch that closed."""
        return iter(())

    def heard(self, award: Award, now: Now) -> Iterator[Effect]:
        """Answer what any machine has awarded."""
        return iter(())

    def tick(self, now: Now) -> Iterator[Effect]:
        """Let time pass."""
        return iter(())

    def begin(self, now: Now) -> Iterator[Effect]:
        """Make ready for a new ball."""
        return iter(())

    def lights(self, now: Now) -> Iterator[Light]:
        """Tell which lamps are lit by it."""
        return iter(())


def points_of(hit: Hit) -> int:
    """Return what an element states, or what its role is worth."""
    return hit.element.score or POINTS.get(hit.element.role, 0)
