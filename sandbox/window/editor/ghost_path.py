"""Ghost path: where a body will be in the next seconds, predicted in a background thread while it is being edited."""

import threading
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.registry import USUAL, able, start
from sandbox.scene.compile.scene import Scene

SECONDS = 2.0
"""s of motion that are predicted"""
MAX_POINTS = 200
"""Points of a path"""
MAX_BODIES = 300
"""Bodies of a scene up to which paths are predicted: more would slow the window down while it is edited"""
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


def predict_path(scene: Scene, body: int, seconds: float = SECONDS) -> GhostPath | None:
    """Return the path of a body from the start of a scene; None if no engine can run it, or it is too large.

    The engine `exact` predicts it where it can, whose answer does not depend on the time step; otherwise pymunk, or the
    first engine that can. The path is shorter where the body is removed, or where the work would exceed its limits.

    Args:
        scene: a valid scene, or one that is being edited and may be refused.
        body: index of the body.
        seconds: duration, s.
    """
    engines = able(scene) if len(scene.bodies) <= MAX_BODIES else ()
    name = next((each for each in ("exact", USUAL) if each in engines), engines[0] if engines else None)
    if name is None:
        return None
    try:
        simulation = start(scene, name)
    except Refusal:
        return None
    until = perf_counter() + MAX_TIME
    try:
        dt = simulation.settings.dt
        steps = min(max(round(seconds / dt), 1), max(MAX_WORK // max(len(scene.bodies), 1), 1))
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
    """Predicts the path of the latest scene that was submitted, in a thread of its own."""

    def __init__(self) -> None:
        self._condition = threading.Condition()
        self._next: tuple[Scene, int] | None = None
        self._submitted: tuple[Scene, int] | None = None
        self._is_closed = False
        self._thread: threading.Thread | None = None
        self.path: GhostPath | None = None
        """latest path; it may be of an earlier scene for a moment"""
        self.fault: str | None = None
        """an unexpected error of the prediction, to be reported once"""

    def submit(self, scene: Scene, body: int | None) -> None:
        """Predict the path of a body, unless that was submitted last; without a body there is no path."""
        if body is None:
            self.path = self._submitted = None
            return
        if self._submitted is not None and self._submitted[0] is scene and self._submitted[1] == body:
            return
        self._submitted = scene, body
        with self._condition:
            self._next = self._submitted
            self._condition.notify()
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="sandbox ghost path", daemon=True)
            self._thread.start()

    def close(self) -> None:
        """End the thread, after the present prediction."""
        with self._condition:
            self._is_closed = True
            self._condition.notify()

    def _work(self) -> None:
        while True:
            with self._condition:
                while self._next is None and not self._is_closed:
                    self._condition.wait()
                if self._is_closed:
                    return
                assert self._next is not None
                (scene, body), self._next = self._next, None
            try:
                path = predict_path(scene, body)
            except (ArithmeticError, ValueError):  # a preview that is not a valid scene
                path = None
            except Exception as error:  # noqa: BLE001, reported by the owner
                path, self.fault = None, f"the path cannot be predicted: {type(error).__name__}: {error}"
            if self._submitted is not None:
                self.path = path
