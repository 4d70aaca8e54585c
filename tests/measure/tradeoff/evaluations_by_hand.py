"""Evaluation contexts, evaluations and shifted runs made for tests."""

from collections.abc import Mapping
from typing import Any

from sandbox.arrays import FloatArray
from sandbox.measure.compare.ground_truth import Truth
from sandbox.measure.compare.metrics import METRICS, EvaluationContext
from sandbox.measure.tradeoff.configuration import Configuration, Evaluation
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Trajectory
from tests.runs_by_hand import run_of


def context_of(
    scene: Scene, truth: Trajectory | None = None, until: float | None = None, zoom: float = 100.0
) -> EvaluationContext:
    """Return a context whose truth is a given run, by default one without motion; without a truth if `until` is 0."""
    if until == 0.0:
        return EvaluationContext(scene, None, zoom)
    run = run_of(scene) if truth is None else truth
    return EvaluationContext(
        scene, Truth("exact", "by hand", run, scene.world.duration if until is None else until), zoom
    )


def shifted(run: Trajectory, frames: slice | int, body: int, by: tuple[float, float]) -> FloatArray:
    """Return the positions of a run with one body displaced in some frames."""
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
) -> Evaluation:
    """Return an evaluation of a cost in ms per simulated second; its counted cost is the same by default."""
    resolved = Settings(**settings)
    metrics: Mapping[str, float | None] = dict.fromkeys(METRICS)
    return Evaluation(
        configuration=Configuration.of(engine, resolved),
        engine=engine,
        asked=resolved,
        settings=resolved,
        changes=settings,
        error=error,
        cost=cost,
        cost_median=cost,
        repeats=repeats,
        counted=counted or cost,
        is_own=False,
        status="ok",
        reason=None,
        metrics=metrics,
        work={},
    )
