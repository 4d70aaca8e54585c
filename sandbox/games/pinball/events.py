"""Device, the base class of everything on a table that has state, and the effects that devices return.

PlayerState: score, balls and locks of one player.

Switches: detects hits in the contacts of a step; each is reported once.
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

BALL_COUNT = 3
"""number of balls of a game"""

MAX_BONUS_MULTIPLIER = 6


@dataclass
class PlayerState:
    """Score, balls and locks of a player."""

    score: int = 0
    ball: int = 1
    """number of the ball, from 1; `BALL_COUNT` + 1 after the last one"""
    extra_balls: int = 0
    """number of extra balls"""
    bonus: int = 0
    """points that are added at the end of the ball"""
    bonus_multiplier: int = 1
    """multiplier of the bonus"""
    locked: int = 0
    """balls locked for multiball"""
    is_lock_lit: bool = False
    """whether the lock is lit"""
    modes: int = 0
    """number of modes started"""
    awarded_reasons: set[str] = field(default_factory=set)
    """reasons for which extra balls were awarded"""

    @property
    def done(self) -> bool:
        """Whether all balls have been played."""
        return self.ball > BALL_COUNT

    def end_ball(self) -> None:
        """Advance to the next ball, or use an extra ball."""
        if self.extra_balls:
            self.extra_balls -= 1
        else:
            self.ball += 1
        self.bonus, self.bonus_multiplier = 0, 1


IMPACT_STEPS = 2
"""Steps from the first touch in which an impact gives its impulse: one, or two if it spans the end of a step. Later
impulses are the weight of a ball that rests on the element."""


class Hit(NamedTuple):
    """A switch that closed."""

    time: float
    """s"""
    ball: int
    """index of the body"""
    element: PlayfieldElement
    speed: float
    """m/s, of the ball after the step"""


class OpenContact(NamedTuple):
    """An open contact."""

    steps: int
    """number of steps since the first touch"""
    impulse: float
    """sum of the impulses along the normal, over the mass of the ball, m/s"""
    is_reported: bool
    """whether it has closed its switch"""


class Switches:
    """Detects hits. A contact is identified by its pair and the time of its first touch.

    A switch closes above a threshold of the impact speed v. Frames do not show v, because a ball may hit three elements
    in one step. The impulse of the contact does: J/m = (1 + e)·v, and more if the element kicks, which it does only
    above its threshold. So the switch closes if J/m exceeds (1 + e) times the threshold.
    """

    def __init__(self, board: Playfield) -> None:
        self._board = board
        self._open: dict[tuple[float, int, int], OpenContact] = {}

    def read(self, info: StepInfo) -> list[Hit]:
        """Return the switches that closed in the last step, in the order of their first touch."""
        now: dict[tuple[float, int, int], OpenContact] = {}
        hits = []
        for time, (first, second), _, normal, impulse in info.contacts:
            element = self._board.switches.get(second)
            mass = self._board.mass.get(first)
            if element is None or mass is None:
                continue
            key = (time, first, second)
            touch = now.get(key) or self._open.get(key) or OpenContact(0, 0.0, False)
            given = touch.impulse + (impulse[0] * normal[0] + impulse[1] * normal[1]) / mass
            closes = (
                not touch.is_reported
                and touch.steps < IMPACT_STEPS
                and (not element.min_closing_speed or given > element.min_closing_speed)
            )
            now[key] = OpenContact(touch.steps + 1, given, touch.is_reported or closes)
            if closes:
                hits.append(Hit(time, first, element, math.hypot(*info.frame.velocity[first].tolist())))
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
"""points of elements without `score`"""


class Award(NamedTuple):
    """Points and their reason; every device is notified of it."""

    kind: str
    """a role, or a combination that a device detects: `bank`, `lanes`, `standups`, `jackpot` …"""
    points: int
    group: str | None = None
    bonus: int = 0
    """points added to the bonus"""
    ball: int | None = None
    """index of the ball that scored"""


class PlaySound(NamedTuple):
    """A sound, by its name."""

    name: str


class ShowMessage(NamedTuple):
    """Message shown to the player for a few seconds."""

    text: str


class RemoveBall(NamedTuple):
    """Moves a ball from the table to the trough."""

    ball: int


class ServeBalls(NamedTuple):
    """Puts balls onto the table, one after the other, and launches them automatically."""

    balls: int


class BallSave(NamedTuple):
    """Returns balls that drain within a time, s."""

    seconds: float


class ExtraBall(NamedTuple):
    """Awards an extra ball; each reason counts once a game."""

    reason: str


Effect: TypeAlias = Award | PlaySound | ShowMessage | RemoveBall | ServeBalls | BallSave | ExtraBall | Action


class Light(NamedTuple):
    """A lit lamp."""

    name: str
    """name of its element"""
    blinks: bool = False
    """whether the lamp blinks, to draw the player's attention; it is then dark half of the time"""


@dataclass
class StepContext:
    """State of the table in one step."""

    time: float
    """s"""
    frame: Frame
    sheet: PlayerState
    """state of the present player"""
    balls_in_play: tuple[int, ...] = ()
    """balls in play, including the plunger lane"""
    loose_balls: tuple[int, ...] = ()
    """balls in play that are neither in the lane nor held by a kicker"""
    lane: dict[int, bool] = field(default_factory=dict)
    """ball → whether it is in the plunger lane; cache"""
    waiting: int = 0
    """number of balls to be served"""
    raised_sides: frozenset[str] = field(default_factory=frozenset)
    """sides whose flippers are up"""


class Device:
    """Element or mechanism of a table with state. Each method yields effects; all are optional."""

    def on_hit(self, hit: Hit, now: StepContext) -> Iterator[Effect]:
        """Respond to a switch that closed."""
        return iter(())

    def on_award(self, award: Award, now: StepContext) -> Iterator[Effect]:
        """Respond to an award of any device."""
        return iter(())

    def tick(self, now: StepContext) -> Iterator[Effect]:
        """Advance by one step."""
        return iter(())

    def start_ball(self, now: StepContext) -> Iterator[Effect]:
        """Reset for a new ball."""
        return iter(())

    def lights(self, now: StepContext) -> Iterator[Light]:
        """Return the lamps that the device lights."""
        return iter(())


def points_of(hit: Hit) -> int:
    """Return the score of an element, by default that of its role."""
    return hit.element.score or POINTS.get(hit.element.role, 0)
