"""Forecast: what the exact engine says a stroke would lead to, for the lines that are drawn while aiming."""

from typing import NamedTuple

from sandbox.arrays import FloatArray
from sandbox.engines.contract import Exhaustion, Refusal
from sandbox.engines.exact.tabletop.shots import Table
from sandbox.scene.description.base import Point
from sandbox.scene.description.surface import Stroke
from sandbox.scene.scene import Scene

SPACING = 0.05
"""m between the points of a way"""


class Forecast(NamedTuple):
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


class Forecaster:
    """Tries strokes on the exact engine, whichever plays. One that cannot play a scene forecasts nothing."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._table: Table | None = None
        self._refused = False
        self._known: tuple[object, Forecast | None] | None = None

    def of(self, stroke: Stroke, ball: int, position: tuple[Point, ...]) -> Forecast | None:
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

    def _tried(self, stroke: Stroke, ball: int, position: tuple[Point, ...]) -> Forecast | None:
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
        return Forecast(
            outcome.way(name, SPACING),
            ghost,
            hit,
            outcome.way(names[hit], SPACING) if hit is not None else None,
            tuple(k for k in (ball, hit) if k is not None and names[k] in fallen),
        )
