"""Forecast: what the exact engine says a stroke would lead to, for the lines that are drawn while aiming.

Cue: how the next stroke would be.

Aim: what is drawn of the next stroke, as a plain value.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from sandbox.arrays import FloatArray
from sandbox.engines.contract import Exhaustion, Refusal
from sandbox.engines.exact.tabletop.shots import Table
from sandbox.scene.description.base import Point
from sandbox.scene.description.surface import MISCUE, Shot, Stroke
from sandbox.scene.scene import Scene

SLOWEST, FASTEST = 0.05, 10.0
"""m/s, of the cue: the least that is a stroke, and a hard break"""
EDGE = 0.999 * MISCUE
"""of the radius, how far from the middle the tip may be"""
DEFAULT_SPEED = 2.5
"""m/s, with which a game begins"""


@dataclass
class CueState:
    """A cue behind a ball."""

    aim: float = 0.0
    """rad, from +x"""
    speed: float = DEFAULT_SPEED
    """m/s, of the stroke that Space plays"""
    side: float = 0.0
    """of the radius, to the right"""
    height: float = 0.0
    """of the radius, above the middle"""
    back: float = 0.0
    """m, how far it is drawn back just now"""

    @classmethod
    def laid(cls, shot: Shot) -> "CueState":
        """Return a cue laid ready for a shot of the scene."""
        return cls(shot.aim, min(max(shot.speed, SLOWEST), FASTEST), shot.side, shot.height)

    @property
    def stroke(self) -> Stroke:
        """The stroke that it would play."""
        return Stroke(aim=self.aim, speed=self.speed, side=self.side, height=self.height)

    @property
    def power(self) -> float:
        """The speed as a share of the greatest."""
        return self.speed / FASTEST

    @power.setter
    def power(self, share: float) -> None:
        self.speed = min(max(share * FASTEST, SLOWEST), FASTEST)

    @property
    def way(self) -> tuple[float, float]:
        """Where it points, of length 1."""
        return math.cos(self.aim), math.sin(self.aim)

    def tip_at(self, side: float, height: float) -> None:
        """Set where the tip meets the ball, no farther out than it would hold."""
        off = math.hypot(side, height)
        share = min(1.0, EDGE / off) if off > 0.0 else 1.0
        self.side, self.height = side * share, height * share

    def centre(self) -> None:
        """Forget the english of the last stroke."""
        self.side = self.height = self.back = 0.0


SPACING = 0.05
"""m between the points of a way"""


class ShotPrediction(NamedTuple):
    """A stroke that was tried."""

    way: FloatArray
    """(K, 2) m, of the cue ball"""
    ghost: Point | None
    """where its centre is as it first touches another ball, m"""
    hit: int | None
    """number of that ball"""
    onward: FloatArray | None
    """(K, 2) m, the way of that ball"""
    falls: tuple[int, ...]
    """numbers of these two that fall"""


class ShotPredictor:
    """Tries strokes on the exact engine, whichever plays. One that cannot play a scene forecasts nothing."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._table: Table | None = None
        self._refused = False
        self._known: tuple[object, ShotPrediction | None] | None = None

    def of(self, stroke: Stroke, ball: int, position: tuple[Point, ...]) -> ShotPrediction | None:
        """Return what a stroke leads to.

        Args:
            stroke: how.
            ball: number of the one that is struck.
            position: of every body, m; all are at rest.
        """
        key = (stroke, ball, position)
        if self._known is None or self._known[0] != key:
            self._known = key, self._tried(stroke, ball, position)
        return self._known[1]

    def _tried(self, stroke: Stroke, ball: int, position: tuple[Point, ...]) -> ShotPrediction | None:
        if self._refused:
            return None
        try:
            if self._table is None:
                self._table = Table(self._scene)
            names = self._table.names
            stands = self._table.with_balls(dict(zip(names, position, strict=False)))
            outcome = stands.shoot(stroke, names[ball], ways=True)
        except (Refusal, Exhaustion) as error:
            self._refused = isinstance(error, Refusal)
            return None
        name, hit, ghost = names[ball], None, None
        for event in outcome.events:
            if event.kind == "ball" and name in (event.ball, event.partner):
                other = event.partner if event.ball == name else event.ball
                hit = names.index(other) if other is not None else None
                break
        if hit is not None:
            x, y = event.point
            own, its = (float(self._scene.bodies.radius[each]) for each in (ball, hit))
            bx, by = position[hit]  # it has not moved before
            share = own / its  # the point of touch divides the line of centres by the radii
            ghost = x + (x - bx) * share, y + (y - by) * share
        fallen = outcome.pocketed
        return ShotPrediction(
            outcome.way(name, SPACING),
            ghost,
            hit,
            outcome.way(names[hit], SPACING) if hit is not None else None,
            tuple(k for k in (ball, hit) if k is not None and names[k] in fallen),
        )


@dataclass(frozen=True, eq=False)
class CueAim:
    """A cue behind a ball, and what its stroke would lead to."""

    ball: int
    """number of the one that is struck"""
    place: Point
    """of its centre, m"""
    angle: float
    """rad, of the cue's way, from +x"""
    side: float
    """of the radius, where the tip is to the right of the middle"""
    back: float
    """m, how far the cue is drawn back"""
    forecast: ShotPrediction | None = None
    carried: bool = False
    """the ball is in a hand: no cue is behind it"""
    refused: bool = False
    """it may not be put where the hand is"""
    called: tuple[Point, float] | None = None
    """centre and radius of the pocket that was called, m"""
    nominated: int | None = None
    """number of the ball that was called"""
