"""Evaluation contexts, evaluations and runs moved by hand, as a test wants them."""

from collections.abc import Mapping
from typing import Any

from sandbox.arrays import FloatArray
from sandbox.measure.compare.ground_truth import Truth
from sandbox.measure.tradeoff.configuration import Configuration, Evaluation
from sandbox.measure.tradeoff.metrics import METRICS, EvaluationContext
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Trajectory
from tests.runs_by_hand import run_of


def context_of(
    scene: Scene, truth: Trajectory | None = None, until: float | None = None, zoom: float = 100.0
) -> EvaluationContext:
    """Return a context whose truth is a run made by hand, by default one in which nothing moves; `until` 0 for none."""
    if until == 0.0:
        return EvaluationContext(scene, None, zoom)
    run = run_of(scene) if truth is None else truth
    return EvaluationContext(
        scene, Truth("exact", "by hand", run, scene.world.duration if until is None else until), zoom
    )


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
) -> Evaluation:
    """Return a point of a cost, ms per simulated second; it is counted as what it takes, if nothing else is said."""
    chosen = Settings(**settings)
    metrics: Mapping[str, float | None] = dict.fromkeys(METRICS)
    return Evaluation(
        configuration=Configuration.of(engine, chosen),
        engine=engine,
        asked=chosen,
        settings=chosen,
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
