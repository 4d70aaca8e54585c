"""Shot prediction on the exact engine for the lines that are drawn while aiming, and the state of the cue."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from sandbox.arrays import FloatArray
from sandbox.engines.contract import Exhaustion, Refusal
from sandbox.engines.exact.tabletop.shots import Table
from sandbox.games.billiards.game import MAX_CUE_SPEED, MAX_TIP_OFFSET, MIN_CUE_SPEED
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.description.surface import Shot, Stroke

DEFAULT_SPEED = 2.5
"""m/s, cue speed at the start of a game"""


@dataclass
class CueState:
    """A cue behind a ball."""

    aim: float = 0.0
    """rad, from +x"""
    speed: float = DEFAULT_SPEED
    """m/s, speed of the stroke that Space plays"""
    side: float = 0.0
    """offset of the tip to the right, in radii"""
    height: float = 0.0
    """offset of the tip above the centre, in radii"""
    back: float = 0.0
    """m by which the cue is drawn back"""

    @classmethod
    def for_shot(cls, shot: Shot) -> "CueState":
        """Return the state of the cue for a shot of the scene."""
        return cls(shot.aim, min(max(shot.speed, MIN_CUE_SPEED), MAX_CUE_SPEED), shot.side, shot.height)

    @property
    def stroke(self) -> Stroke:
        """The stroke that the cue would play."""
        return Stroke(aim=self.aim, speed=self.speed, side=self.side, height=self.height)

    @property
    def power(self) -> float:
        """Speed as a fraction of `MAX_CUE_SPEED`."""
        return self.speed / MAX_CUE_SPEED

    @power.setter
    def power(self, fraction: float) -> None:
        self.speed = min(max(fraction * MAX_CUE_SPEED, MIN_CUE_SPEED), MAX_CUE_SPEED)

    @property
    def direction(self) -> tuple[float, float]:
        """Unit vector along the cue, towards the ball."""
        return math.cos(self.aim), math.sin(self.aim)

    def tip_at(self, side: float, height: float) -> None:
        """Set the offset of the tip in radii, limited to `MAX_TIP_OFFSET`."""
        offset = math.hypot(side, height)
        scale = min(1.0, MAX_TIP_OFFSET / offset) if offset > 0.0 else 1.0
        self.side, self.height = side * scale, height * scale

    def centre(self) -> None:
        """Reset english and draw-back."""
        self.side = self.height = self.back = 0.0


POINT_SPACING = 0.05
"""m between the points of a path"""


class ShotPrediction(NamedTuple):
    """Predicted result of a stroke."""

    cue_path: FloatArray
    """(K, 2) m, path of the cue ball"""
    ghost: Point | None
    """centre of the cue ball at its first contact with another ball, m"""
    hit: int | None
    """index of that ball"""
    object_path: FloatArray | None
    """(K, 2) m, path of that ball"""
    pocketed: tuple[int, ...]
    """indices of those of the two balls that are pocketed"""


class ShotPredictor:
    """Predicts strokes on the exact engine, whichever engine runs the session.

    There are no predictions for scenes that the exact engine refuses.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._table: Table | None = None
        self._refused = False
        self._last: tuple[object, ShotPrediction | None] | None = None

    def predict(self, stroke: Stroke, ball: int, position: tuple[Point, ...]) -> ShotPrediction | None:
        """Return the prediction of a stroke; None if it cannot be computed.

        Args:
            stroke: the stroke.
            ball: index of the ball that is struck.
            position: positions of all bodies at rest, m.
        """
        key = (stroke, ball, position)
        if self._last is None or self._last[0] != key:
            self._last = key, self._compute(stroke, ball, position)
        return self._last[1]

    def _compute(self, stroke: Stroke, ball: int, position: tuple[Point, ...]) -> ShotPrediction | None:
        if self._refused:
            return None
        try:
            if self._table is None:
                self._table = Table(self._scene)
            names = self._table.names
            table = self._table.with_balls(dict(zip(names, position, strict=False)))
            outcome = table.shoot(stroke, names[ball], record_paths=True)
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
            own_radius, other_radius = (float(self._scene.bodies.radius[each]) for each in (ball, hit))
            bx, by = position[hit]  # it has not moved yet
            ratio = own_radius / other_radius  # in which the contact point divides the line of centres
            ghost = x + (x - bx) * ratio, y + (y - by) * ratio
        return ShotPrediction(
            outcome.path_of(name, POINT_SPACING),
            ghost,
            hit,
            outcome.path_of(names[hit], POINT_SPACING) if hit is not None else None,
            tuple(k for k in (ball, hit) if k is not None and names[k] in outcome.pocketed),
        )


@dataclass(frozen=True, eq=False)
class CueAim:
    """Values to draw of the next stroke: the cue, its ball, and the prediction."""

    ball: int
    """index of the ball that is struck"""
    place: Point
    """centre of the ball, m"""
    angle: float
    """direction of the cue, rad from +x"""
    side: float
    """offset of the tip to the right, in radii"""
    back: float
    """m by which the cue is drawn back"""
    prediction: ShotPrediction | None = None
    carried: bool = False
    """whether the ball is being placed by hand; no cue is drawn then"""
    refused: bool = False
    """whether the place under the pointer is not allowed"""
    called: tuple[Point, float] | None = None
    """centre and radius of the called pocket, m"""
    nominated: int | None = None
    """index of the called ball"""
