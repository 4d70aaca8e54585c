"""Bounded runs: counted work decides reproducibly whether a run is stopped. No test asserts on time."""

import math

import pytest

from sandbox.measure.run.bounded_run import RunTimeoutError, bounded_run
from tests.runs_by_hand import DROP, scene_of


@pytest.mark.parametrize("engine", ["pymunk", "reference", "exact"])
def test_counted_cost_is_reproducible_and_grows_with_the_steps(engine: str) -> None:
    scene = scene_of(DROP)
    (_, once), (_, again) = (bounded_run(scene, engine, scene.solver, math.inf) for _ in range(2))
    _, finer = bounded_run(scene, engine, scene.solver.replace(dt=0.005), math.inf)
    assert once == again > 0.0
    assert 2.0 * once < finer


@pytest.mark.parametrize("engine", ["pymunk", "reference", "exact"])
def test_run_beyond_the_work_limit_is_stopped_on_any_machine(engine: str) -> None:
    scene = scene_of(DROP)
    found, counted = bounded_run(scene, engine, scene.solver, math.inf)
    again, _ = bounded_run(scene, engine, scene.solver, counted)
    assert again.info["state_hash"] == found.info["state_hash"]
    with pytest.raises(RunTimeoutError, match="counted work"):
        bounded_run(scene, engine, scene.solver, math.nextafter(counted, 0.0))


def test_run_beyond_a_deadline_is_stopped() -> None:
    scene = scene_of(DROP)
    with pytest.raises(RunTimeoutError, match="time limit"):
        bounded_run(scene, "pymunk", scene.solver, math.inf, -math.inf)
