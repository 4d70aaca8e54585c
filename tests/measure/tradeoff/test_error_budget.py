"""The error budget: parts of model, time step and iterations, in cases where each part is known."""

import json

import pytest

from sandbox.jsonable import to_json
from sandbox.measure.compare.ground_truth import Truth, truth_of
from sandbox.measure.tradeoff.error_budget import error_budget
from sandbox.measure.tradeoff.metrics import EvaluationContext
from sandbox.scene.compile.scene import Scene
from tests.measure.tradeoff.evaluations_by_hand import context_of
from tests.runs_by_hand import scene_of

pytestmark = pytest.mark.full  # long runs and sweeps

FLIGHT = """
[world]
gravity = [0.0, -10.0]
duration = 0.4
[solver]
dt = 0.02
[[ball]]
name = "a"
position = [0.0, 0.0]
velocity = [1.0, 3.0]
radius = 0.1
"""
BULLET = """
[world]
duration = 0.02
[solver]
dt = 0.01
[[wall]]
name = "wall"
points = [[1.0, -1.0], [1.0, 1.0]]
thickness = 0.00002
[[ball]]
name = "bullet"
position = [0.05, 0.0]
velocity = [100.0, 0.0]
radius = 0.00001
"""
"""The wall is so thin that even 16 times the substeps do not detect it."""
CRADLE = """
[world]
gravity = [0.0, -10.0]
duration = 0.2
[solver]
dt = 0.01
iterations = 1
[[rope]]
name = "chain"
kind = "rods"
start = [0.0, 0.0]
end = [1.0, 0.0]
links = 6
radius = 0.02
mass = 1.0
fix = ["start"]
"""


def context_for(scene: Scene) -> EvaluationContext:
    return EvaluationContext(scene, truth_of(scene, scene.solver, 1e-4), 100.0)


@pytest.mark.parametrize("engine", ["pymunk"])
def test_error_of_euler_is_attributed_to_the_time_step(engine: str) -> None:
    scene = scene_of(FLIGHT)
    found = error_budget(context_for(scene), engine, scene.solver, 60.0)
    assert found is not None
    total = 10.0 * 0.02 * 0.4 / 2.0  # g·h·T/2: velocities are one step behind
    assert found.total == pytest.approx(total, rel=1e-9)  # a sum of 20 steps, and rounding
    assert found.substep_factor == 16
    assert found.time_step == pytest.approx(total * 15.0 / 16.0, rel=1e-9)  # a sixteenth of the step leaves 1/16 of it
    assert found.residual == pytest.approx(total / 16.0, rel=1e-9)
    assert found.solver == 0.0
    assert found.model is None  # the residual still halves with the step


def test_error_at_an_undetected_wall_is_attributed_to_the_model() -> None:
    scene = scene_of(BULLET)
    found = error_budget(context_for(scene), "pymunk", scene.solver, 60.0)
    assert found is not None
    assert found.model == found.residual
    # The bullet passes the wall by 1.05 m, where it should have stopped (restitution 0).
    assert found.model == pytest.approx(1.05, abs=1e-3)
    assert found.time_step == pytest.approx(0.0, abs=1e-12)  # straight flight, rounding


def test_error_of_a_chain_with_one_iteration_is_attributed_to_the_solver() -> None:
    scene = scene_of(CRADLE)
    context = context_of(scene, until=0.0)
    settings = scene.solver
    from sandbox.measure.run.runner import run

    truth = run(scene, "pymunk", audit=False, **settings.replace(iterations=100, substeps=8).model_dump())
    context = EvaluationContext(scene, Truth("refined", "by hand", truth, 0.2), 100.0)
    found = error_budget(context, "pymunk", settings, 60.0)
    assert found is not None
    assert found.solver > 0.5 * found.total > 0.0
    assert found.total <= found.solver + found.time_step + found.residual + 1e-12  # triangle inequality; rounding


def test_there_is_no_budget_without_truth_or_time_or_if_refused() -> None:
    scene = scene_of(FLIGHT)
    assert error_budget(context_of(scene, until=0.0), "pymunk", scene.solver, 60.0) is None
    assert error_budget(context_for(scene), "pymunk", scene.solver, 0.0) is None
    assert error_budget(context_for(scene), "pymunk", scene.solver.replace(integrator="rk4"), 60.0) is None


def test_document_is_json_and_has_every_part() -> None:
    scene = scene_of(FLIGHT)
    found = error_budget(context_for(scene), "pymunk", scene.solver, 60.0)
    assert found is not None
    document = json.loads(json.dumps(to_json(found), allow_nan=False))
    assert set(document) == {"engine", "settings", "total", "solver", "time_step", "model", "left", "finest"}
    assert document["settings"]["dt"] == 0.02
