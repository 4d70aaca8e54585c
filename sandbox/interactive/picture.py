"""What a front end draws: the static picture of a scene, and the poses of its bodies as JSON."""

import math
from typing import Any

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.contract import Divergence, Exhaustion
from sandbox.engines.registry import start
from sandbox.report.html.replay_data import Bounds, static_geometry, viewport
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Frame

MAX_BODIES = 2000
"""Bodies that are drawn; of more, a part."""
MAX_STEPS, MAX_BODY_STEPS = 4000, 20_000
"""Limits of the trial run that finds the region of the bodies: steps, and steps times bodies."""
RESOLUTION = 1e-6
"""Rounding of coordinates, as a fraction of the size of the view: less than a pixel at the largest zoom."""


class Picture:
    """A scene as a front end draws it: which bodies, in which region, relative to which origin."""

    def __init__(self, scene: Scene, view: Bounds) -> None:
        moving = np.flatnonzero(~scene.bodies.fixed)
        self.drawn: IntArray = moving[:: max(1, math.ceil(len(moving) / MAX_BODIES))]
        """(n,) indices of the drawn bodies"""
        self.is_complete = len(self.drawn) == len(moving)
        """whether all moving bodies are drawn"""
        self.view = view
        left, bottom, right, top = view
        self.origin = (0.5 * (left + right), 0.5 * (bottom + top))
        """m, subtracted from all positions, so that no digits are lost far from the origin of the world"""
        self._digits = max(0, -math.floor(math.log10(RESOLUTION * max(right - left, top - bottom))))
        self._scene = scene

    def document(self) -> dict[str, Any]:
        """Return the static geometry and the view as JSON."""
        (x, y), (left, bottom, right, top) = self.origin, self.view
        return {
            "title": self._scene.title or "Untitled scene",
            "geometry": static_geometry(self._scene, self.drawn, self.origin),
            "bodies": len(self.drawn),
            "body_names": [self._scene.bodies.names[k] for k in self.drawn.tolist()],
            "view": [left - x, bottom - y, right - x, top - y],
            "is_complete": self.is_complete,
        }

    def pose(self, frame: Frame) -> list[float | None]:
        """Return x, y (m, relative to the origin) and angle (rad) of each drawn body; None for an absent one."""
        position, angle = frame.position[self.drawn] - self.origin, frame.angle[self.drawn]
        shown = frame.present[self.drawn] & np.isfinite(position).all(axis=1) & np.isfinite(angle)
        rows = np.empty((len(shown), 3))
        with np.errstate(invalid="ignore"):
            rows[:, :2] = np.round(position, self._digits)
            rows[:, 2] = np.round(np.mod(angle, 2.0 * math.pi), 5)
        values: list[float | None] = list(rows.reshape(-1).tolist())
        for k in np.flatnonzero(~shown).tolist():
            values[3 * k : 3 * k + 3] = (None, None, None)
        return values

    def to_world(self, point: tuple[float, float]) -> tuple[float, float]:
        """Return a point of the front end in the world, m."""
        return point[0] + self.origin[0], point[1] + self.origin[1]


def find_view(scene: Scene, engine: str, settings: Settings) -> Bounds:
    """Return the region to show: that which the scene states, else that of a trial run on an engine that can."""
    stated = scene.play.view or scene.play.area
    if stated is not None:
        (left, bottom), (right, top) = stated
        margin = 0.0 if scene.play.view is not None else 0.12 * min(right - left, top - bottom)  # the rails of a table
        return left - margin, bottom - margin, right + margin, top + margin
    return viewport(scene, [_trial(scene, engine, settings)])


def _trial(scene: Scene, engine: str, settings: Settings) -> FloatArray:
    """Return positions (T, N, 2), m, of a run, as long as the limits permit."""
    count = int(np.count_nonzero(~scene.bodies.fixed))
    steps = min(round(scene.world.duration / settings.dt), MAX_STEPS, MAX_BODY_STEPS // max(count, 1))
    path, every = [scene.bodies.position], max(1, steps // 200)
    simulation = start(scene, engine, settings)
    try:
        for k in range(steps if count else 0):
            simulation.step()
            if k % every:
                continue
            frame = simulation.frame()
            path.append(np.where(frame.present[:, None], frame.position, np.nan))
    except (Divergence, Exhaustion):
        pass  # the region up to then
    finally:
        simulation.close()
    return np.asarray(path)
