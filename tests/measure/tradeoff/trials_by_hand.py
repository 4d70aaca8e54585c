"""Judges, runs and landscapes made by hand, as a test wants them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from sandbox.measure.compare.runs import frames_as_run
from sandbox.measure.compare.truth import Truth
from sandbox.measure.tradeoff.judge import Judge
from sandbox.measure.tradeoff.metrics import METRICS
from sandbox.measure.tradeoff.point import Point
from sandbox.scene.file import loads
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import Contacts, FloatArray, Trajectory

BALLS = """
[world]
gravity = [0.0, -10.0]
duration = 2.0
[solver]
dt = 0.1
[[plane]]
name = "ground"
point = [0.0, 0.0]
normal = [0.0, 1.0]
[[ball]]
name = "a"
position = [0.0, 5.0]
radius = 0.5
[[ball]]
name = "b"
position = [3.0, 5.0]
radius = 0.5
[[ball]]
name = "still"
position = [9.0, 5.0]
radius = 0.5
fixed = true
"""
"""Two balls that move and one that does not; 21 frames."""

DROP = """
[world]
gravity = [0.0, -10.0]
duration = 0.4
[solver]
dt = 0.02
[[plane]]
name = "ground"
point = [0.0, 0.0]
normal = [0.0, 1.0]
[[ball]]
name = "a"
position = [0.0, 1.0]
radius = 0.5
restitution = 0.5
"""
"""Half a metre above the ground, which is reached after 0.316 s. It has a closed form."""


def scene_of(text: str = BALLS) -> Scene:
    """Read a scene."""
    return loads(text)


def run_of(
    scene: Scene,
    position: FloatArray | None = None,
    *,
    every: int = 1,
    velocity: FloatArray | None = None,
    contacts: Sequence[tuple[float, tuple[int, int]]] = (),
    retired: Sequence[float] | None = None,
    **info: Any,
) -> Trajectory:
    """Make a run in which nothing moves, but for what is given.

    Args:
        scene: of what.
        position: (T, N, 2) m.
        every: a frame each so many steps.
        velocity: (T, N, 2) m/s.
        contacts: time and pair of each.
        retired: (N,) s.
        info: what differs in the run's `info`.
    """
    dt = scene.solver.dt * every
    when = np.arange(round(scene.world.duration / dt) + 1) * dt
    at = np.repeat(scene.bodies.position[None], len(when), axis=0) if position is None else position
    rows = Contacts(
        np.asarray([row[0] for row in contacts], dtype=np.float64),
        np.asarray([row[1] for row in contacts], dtype=np.int64).reshape(-1, 2),
        np.zeros((len(contacts), 2)),
        np.tile([0.0, -1.0], (len(contacts), 1)),
        np.zeros((len(contacts), 2)),
    )
    state = (at, np.zeros_like(at) if velocity is None else velocity, np.zeros(at.shape[:2]), np.zeros(at.shape[1]))
    gone = np.full(len(scene.bodies), np.nan) if retired is None else np.asarray(retired)
    run = frames_as_run(scene, scene.solver, when, state, rows, gone)
    run.info.update(info)  # type: ignore[attr-defined] # it is a dict
    return run


def judge_of(scene: Scene, truth: Trajectory | None = None, until: float | None = None, zoom: float = 100.0) -> Judge:
    """Return a judge whose truth is a run made by hand, by default one in which nothing moves; `until` 0 for none."""
    if until == 0.0:
        return Judge(scene, None, zoom)
    run = run_of(scene) if truth is None else truth
    return Judge(scene, Truth("exact", "by hand", run, scene.world.duration if until is None else until), zoom)


def shifted(run: Trajectory, frames: slice | int, body: int, by: tuple[float, float]) -> FloatArray:
    """Return a run's positions with one body moved in some frames."""
    found = run.position.copy()
    found[frames, body] += by
    return found


def point_of(cost: float, error: float | None, engine: str = "pymunk", **settings: Any) -> Point:
    """Return a point of a cost, ms per simulated second."""
    chosen = Settings(**settings)
    metrics: Mapping[str, float | None] = dict.fromkeys(METRICS)
    return Point(engine, chosen, chosen, settings, "ok", None, metrics, error, cost, cost, 1, {})
