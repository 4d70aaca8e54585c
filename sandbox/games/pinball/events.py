"""Effects: what machines answer with, and the one shape that all machines have.

Sheet: where one player stands.

Switches: the hits in what an engine noted of a step, each told once.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

from sandbox.action import Action
from sandbox.games.contract import StepInfo
from sandbox.games.pinball.playfield import Playfield, PlayfieldElement
from sandbox.scene.description.play import Role
from sandbox.trajectory import Frame

BALLS = 3
"""of a game"""

MOST = 6
"""times that a bonus counts"""


@dataclass
class PlayerState:
    """What a player has."""

    score: int = 0
    ball: int = 1
    """which is played, from 1; one more than there are once all were played"""
    again: int = 0
    """how often the player shoots again"""
    bonus: int = 0
    """points that are counted at the end of the ball"""
    times: int = 1
    """how often the bonus counts"""
    locked: int = 0
    """balls waiting for multiball"""
    lit: bool = False
    """whether the next ball in the lock counts"""
    modes: int = 0
    """how many were begun"""
    had: set[str] = field(default_factory=set)
    """reasons for which an extra ball was given"""

    @property
    def done(self) -> bool:
        """Whether all balls were played."""
        return self.ball > BALLS

    def ended(self) -> None:
        """Go on to the next ball, or shoot again."""
        if self.again:
            self.again -= 1
        else:
            self.ball += 1
        self.bonus, self.times = 0, 1


LOOKS = 2
"""In so many looks from its first touch a hit gives its impulse: one, or two where it spans the end of a step. What
comes later is the weight of a ball that leans."""


class Hit(NamedTuple):
    """A switch that closed."""

    time: float
    """s"""
    ball: int
    """number of the body"""
    element: PlayfieldElement
    speed: float
    """of the ball, after the step, m/s"""


class Touch(NamedTuple):
    """A contact that has been seen: how often, and what it has given, as impulse over mass along its normal, m/s."""

    looks: int
    given: float
    told: bool


class Switches:
    """Reads hits. A contact is known by its first touch and its pair, as engines tell one that lasts again.

    Whether a struck switch closes is a matter of the speed v with which the ball came, which neither frame shows: a
    ball may meet three things in one step. The contact's impulse does: J/m = (1 + e)·v, and more where the thing
    kicks, but a thing kicks only above its threshold. So the switch closes where J/m exceeds (1 + e) times its own.
    """

    def __init__(self, board: Playfield) -> None:
        self._board = board
        self._open: dict[tuple[float, int, int], Touch] = {}

    def read(self, seen: StepInfo) -> list[Hit]:
        """Return the switches that closed since the last look, in the order of their first touch."""
        now: dict[tuple[float, int, int], Touch] = {}
        hits = []
        for time, (first, second), _, normal, impulse in seen.contacts:
            element = self._board.switches.get(second)
            mass = self._board.mass.get(first)
            if element is None or mass is None:
                continue
            key = (time, first, second)
            touch = now.get(key) or self._open.get(key) or Touch(0, 0.0, False)
            given = touch.given + (impulse[0] * normal[0] + impulse[1] * normal[1]) / mass
            closes = not touch.told and touch.looks < LOOKS and (not element.least or given > element.least)
            now[key] = Touch(touch.looks + 1, given, touch.told or closes)
            if closes:
                hits.append(Hit(time, first, element, math.hypot(*seen.frame.velocity[first].tolist())))
        self._open = now
        return hits


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


class PlaySound(NamedTuple):
    """A sound, by its name."""

    name: str


class ShowMessage(NamedTuple):
    """A line for the player, for a few seconds."""

    text: str


class RemoveBall(NamedTuple):
    """A ball goes from the table to the trough, at once."""

    ball: int


class ServeBalls(NamedTuple):
    """Balls are put onto the table, one after the other, and launched by themselves."""

    balls: int


class BallSave(NamedTuple):
    """Balls that drain within a time, s, come back."""

    seconds: float


class ExtraBall(NamedTuple):
    """The player shoots again after this ball, for a reason that counts once a game."""

    reason: str


Effect: TypeAlias = Award | PlaySound | ShowMessage | RemoveBall | ServeBalls | BallSave | ExtraBall | Action


class Light(NamedTuple):
    """That a lamp is lit."""

    name: str
    """of its element"""
    blinks: bool = False
    """Call for the player; for half of the time such a lamp is dark, also where another machine has lit it."""


@dataclass
class StepContext:
    """How things stand at a look."""

    time: float
    """s"""
    frame: Frame
    sheet: PlayerState
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


class Device:
    """Something on the table that has a state. Each method yields what comes of it; none is a must."""

    def hit(self, hit: Hit, now: StepContext) -> Iterator[Effect]:
        """Answer a switch that closed."""
        return iter(())

    def heard(self, award: Award, now: StepContext) -> Iterator[Effect]:
        """Answer what any machine has awarded."""
        return iter(())

    def tick(self, now: StepContext) -> Iterator[Effect]:
        """Let time pass."""
        return iter(())

    def begin(self, now: StepContext) -> Iterator[Effect]:
        """Make ready for a new ball."""
        return iter(())

    def lights(self, now: StepContext) -> Iterator[Light]:
        """Tell which lamps are lit by it."""
        return iter(())


def points_of(hit: Hit) -> int:
    """Return what an element states, or what its role is worth."""
    return hit.element.score or POINTS.get(hit.element.role, 0)
