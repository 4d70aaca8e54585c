"""Judges, points and runs moved by hand, as a test wants them."""

from collections.abc import Mapping
from typing import Any

from runs_by_hand import run_of

from sandbox.arrays import FloatArray
from sandbox.measure.compare.truth import Truth
from sandbox.measure.tradeoff.judge import Judge
from sandbox.measure.tradeoff.metrics import METRICS
from sandbox.measure.tradeoff.point import Point
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory


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


def point_of(
    cost: float,
    error: float | None,
    engine: str = "pymunk",
    counted: float | None = None,
    repeats: int = 1,
    **settings: Any,
) -> Point:
    """Return a point of a cost, ms per simulated second; it is counted as what it takes, if nothing else is said."""
    chosen = Settings(**settings)
    metrics: Mapping[str, float | None] = dict.fromkeys(METRICS)
    return Point(
        engine, chosen, chosen, settings, "ok", None, metrics, error, cost, cost, repeats, counted or cost, False, {}
    )
