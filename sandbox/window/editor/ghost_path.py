"""Ghost path: where a body will be in the next seconds, predicted in a background thread while it is being edited."""

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.registry import USUAL, able, start
from sandbox.scene.compile.scene import Scene
from sandbox.window.editor.latest_job import LatestJob

PREDICTED_TIME = 2.0
"""s of motion that are predicted"""
MAX_POINTS = 200
"""Points of a path"""
MAX_BODIES = 300
"""Bodies up to which paths follow the pointer, by `exact` if it can: more would slow the window down"""
MAX_BODIES_AT_REST = 3_000
"""Bodies up to which paths are predicted, by pymunk, once nothing is dragged any more"""
IDLE_TIME = 0.2
"""s without a change after which a path of more than `MAX_BODIES` is predicted"""
MAX_WORK = 50_000
"""Steps × bodies of a prediction; a scene with more bodies is predicted for a shorter time"""
MAX_TIME = 0.2
"""s of computing after which a prediction ends early"""


@dataclass(frozen=True)
class GhostPath:
    """Predicted centres of a body."""

    points: FloatArray
    """(K, 2) m, from the start, at equal intervals of time"""
    interval: float
    """s between two points"""
    engine: str


def predict_path(scene: Scene, body: int, seconds: float = PREDICTED_TIME) -> GhostPath | None:
    """Return the path of a body from the start of a scene; None if no engine can run it, or it is too large.

    The engine `exact` predicts it where it can, whose answer does not depend on the time step; otherwise, or in large
    scenes, pymunk, or the first engine that can. The path is shorter where the body is removed, or where the work would
    exceed its limits.

    Args:
        scene: a valid scene, or one that is being edited and may be refused.
        body: index of the body.
        seconds: duration, s.
    """
    count = len(scene.bodies)
    engines = able(scene) if count <= MAX_BODIES_AT_REST else ()
    preferred = ("exact", USUAL) if count <= MAX_BODIES else (USUAL,)
    name = next((each for each in preferred if each in engines), engines[0] if engines else None)
    if name is None:
        return None
    try:
        simulation = start(scene, name)
    except Refusal:
        return None
    until = perf_counter() + MAX_TIME
    try:
        dt = simulation.settings.dt
        steps = min(max(round(seconds / dt), 1), max(MAX_WORK // max(count, 1), 1))
        every = max(-(-steps // MAX_POINTS), 1)
        points = [scene.bodies.position[body]]
        for step in range(1, steps + 1):
            simulation.step()
            if step % every == 0:
                frame = simulation.frame()
                if not frame.present[body] or not np.isfinite(frame.position[body]).all():
                    break
                points.append(frame.position[body])
            if perf_counter() > until:
                break
    except (Divergence, Exhaustion, Refusal):
        pass  # the path ends there
    finally:
        simulation.close()
    return GhostPath(np.asarray(points), every * dt, name)


class GhostPredictor:
    """Predicts the path of the body that was submitted last, in a thread of its own."""

    def __init__(self) -> None:
        self._job: LatestJob[tuple[Scene, int], GhostPath | None] = LatestJob(self._predicted, "sandbox ghost path")
        self._submitted: tuple[Scene, int] | None = None
        self.fault: str | None = None
        """an unexpected error of the prediction, to be reported once"""

    @property
    def path(self) -> GhostPath | None:
        """Latest path; it may be of an earlier scene for a moment."""
        return self._job.result

    def submit(self, scene: Scene, body: int | None) -> None:
        """Predict the path of a body, unless that was submitted last; without a body there is no path."""
        if body is None:
            if self._submitted is not None:
                self._job.forget()
            self._submitted = None
        elif self._submitted is None or self._submitted[0] is not scene or self._submitted[1] != body:
            self._submitted = scene, body
            is_large = len(scene.bodies) > MAX_BODIES
            if is_large:
                self._job.forget()  # the former path would stay while the body is dragged
            self._job.submit(self._submitted, IDLE_TIME if is_large else 0.0)

    def close(self) -> None:
        """End the thread, after the present prediction."""
        self._job.close()

    def _predicted(self, submitted: tuple[Scene, int]) -> GhostPath | None:
        try:
            return predict_path(*submitted)
        except (ArithmeticError, ValueError):  # a preview that is not a valid scene
            return None
        except Exception as error:  # noqa: BLE001, reported by the owner
            self.fault = f"the path cannot be predicted: {type(error).__name__}: {error}"
            return None
