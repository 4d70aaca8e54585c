"""Parts of an error, each known, and simplified models, proposed only within the tolerance."""

import pytest

from sandbox.measure.compare.ground_truth import Truth, truth_of
from sandbox.measure.compare.metrics import METRICS, EvaluationContext
from sandbox.measure.compare.self_convergence import refine
from sandbox.measure.tradeoff import simplify as module
from sandbox.measure.tradeoff import timing
from sandbox.measure.tradeoff.error_budget import error_budget
from sandbox.measure.tradeoff.simplify import ReplacedSetting, Simplification, model_simplifications
from sandbox.scene.compile.demands import Demand, demands
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from tests.measure.tradeoff.evaluations_by_hand import context_of
from tests.runs_by_hand import DROP, scene_of

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps


FLIGHT = """
world = { gravity = [0.0, -10.0], duration = 0.4 }
solver = { dt = 0.02 }
ball = [{ name = "a", position = [0.0, 0.0], velocity = [1.0, 3.0], radius = 0.1 }]
"""
BULLET = """
world = { duration = 0.02 }
solver = { dt = 0.01 }
wall = [{ name = "wall", points = [[1.0, -1.0], [1.0, 1.0]], thickness = 2e-05 }]
ball = [{ name = "bullet", position = [0.05, 0.0], velocity = [100.0, 0.0], radius = 1e-05 }]
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
    total = 10.0 * 0.02 * 0.4 / 2.0  # g·h·T/2: velocities are one step behind
    assert found.total == pytest.approx(total, rel=1e-9)  # a sum of 20 steps, and rounding
    assert found.substep_factor == 16
    assert found.time_step == pytest.approx(total * 15.0 / 16.0, rel=1e-9)  # a sixteenth of the step leaves 1/16 of it
    assert found.residual == pytest.approx(total / 16.0, rel=1e-9)
    assert found.residual_before == pytest.approx(total / 8.0, rel=1e-9)
    assert found.solver == 0.0


def test_error_at_an_undetected_wall_is_left_at_the_finest_step() -> None:
    scene = scene_of(BULLET)
    found = error_budget(context_for(scene), "pymunk", scene.solver, 60.0)
    assert found.residual_before == found.residual
    # The bullet passes the wall by 1.05 m, where it should have stopped (restitution 0).
    assert found.residual == pytest.approx(1.05, abs=1e-3)
    assert found.time_step == pytest.approx(0.0, abs=1e-12)  # straight flight, rounding


def test_error_of_a_chain_with_one_iteration_is_attributed_to_the_solver() -> None:
    scene = scene_of(CRADLE)
    context = context_of(scene, until=0.0)
    settings = scene.solver
    from sandbox.measure.run.runner import run

    truth = run(scene, "pymunk", audit=False, **settings.replace(iterations=100, substeps=8).model_dump())
    context = EvaluationContext(scene, Truth("refined", "by hand", truth, 0.2), 100.0)
    found = error_budget(context, "pymunk", settings, 60.0)
    assert found.solver > 0.5 * found.total > 0.0
    assert found.total <= found.solver + found.time_step + found.residual + 1e-12  # triangle inequality; rounding


def test_there_is_no_budget_without_truth_or_time_or_if_refused() -> None:
    scene = scene_of(FLIGHT)
    assert error_budget(context_of(scene, until=0.0), "pymunk", scene.solver, 60.0) is None
    assert error_budget(context_for(scene), "pymunk", scene.solver, 0.0) is None
    assert error_budget(context_for(scene), "pymunk", scene.solver.replace(integrator="rk4"), 60.0) is None


LOW = DROP.replace("position = [0.0, 1.0]", "position = [0.0, 0.6]")
SEPARATE = f"""{LOW}
[[ball]]
name = "b"
position = [3.0, 0.6]
radius = 0.5
restitution = 0.5
"""
"""Two bouncing balls that never collide."""

DRAGGED = DROP.replace("duration = 0.4", "duration = 0.2\nlinear_drag = {}")


def price(scene: Scene, engine: str, settings: Settings) -> float:
    """Return a cost of one second per demand: fewer demands are cheaper on any machine."""
    return float(len(demands(scene)))


def finest(scene: Scene) -> Truth:
    """Return the finest refinement as the truth, even if no second method confirms it, which is tested elsewhere."""
    found = refine(scene, scene.solver, 1e-6)
    return Truth("refined", "by hand", found.trajectory, scene.world.duration)


def proposed(
    monkeypatch: pytest.MonkeyPatch, *texts: str, tolerance: float = 1e-3, metric: str = "max_position"
) -> list[Simplification]:
    monkeypatch.setattr(timing, "run_seconds", price)
    contexts = []
    for text in texts:
        scene = scene_of(text)
        contexts.append(EvaluationContext(scene, truth_of(scene, scene.solver, 1e-6) or finest(scene), 100.0))
    settings = contexts[0].scene.solver.replace(substeps=32)
    replaced = ReplacedSetting("pymunk", settings, METRICS[metric], tolerance, 60.0, repeats=2)
    return model_simplifications(contexts, replaced)


def test_ball_collisions_can_be_disabled_for_balls_that_never_collide(monkeypatch: pytest.MonkeyPatch) -> None:
    # The first-order error of the fine step is g·h·T/2 = 0.001 m, plus that of the bounce.
    found = proposed(monkeypatch, SEPARATE, tolerance=0.01)
    (fixed,) = [each for each in found if "fixed" in each.what]
    assert fixed.engine == "pymunk"
    assert fixed.error <= 0.01
    assert fixed.ratio < 1.0
    separate = scene_of(SEPARATE)
    assert Demand.BALL_BALL in demands(separate)
    assert fixed.ratio == (len(demands(separate)) - 1) / len(demands(separate))


def test_ball_collisions_are_kept_if_balls_collide_in_a_second_scene(monkeypatch: pytest.MonkeyPatch) -> None:
    colliding = SEPARATE.replace("[3.0, 0.6]", "[1.2, 0.6]\nvelocity = [-2.0, 0.0]")
    assert not [each for each in proposed(monkeypatch, SEPARATE, colliding, tolerance=10.0) if "fixed" in each.what]


@pytest.mark.parametrize(("key", "weak", "strong"), [("linear_drag", "1e-4", "5.0"), ("damping", "0.9999", "0.01")])
def test_only_negligible_losses_can_be_omitted(key: str, weak: str, strong: str, monkeypatch) -> None:
    without = f"no {key.removeprefix('linear_')}"
    for value, is_negligible in ((weak, True), (strong, False)):
        found = proposed(monkeypatch, DRAGGED.format(value).replace("linear_drag", key), tolerance=2e-3)
        assert (without in [each.what for each in found]) == is_negligible


def test_closed_form_is_proposed_first(monkeypatch: pytest.MonkeyPatch) -> None:
    found = proposed(monkeypatch, DROP)
    assert found[0].engine is None
    assert "closed-form" in found[0].what
    assert found[0].error == 0.0
    assert [each.ratio for each in found] == sorted(each.ratio for each in found)


def test_nothing_beyond_the_tolerance_is_proposed(monkeypatch: pytest.MonkeyPatch) -> None:
    for tolerance in (1e-12, 1e-4, 1e-2):
        for text in (SEPARATE, DRAGGED.format("0.1")):
            assert all(each.error <= tolerance for each in proposed(monkeypatch, text, tolerance=tolerance))


def test_simplification_that_is_no_cheaper_or_not_measured_is_not_proposed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert proposed(monkeypatch, SEPARATE, tolerance=10.0, metric="joint_error") == []
    monkeypatch.setattr(module, "MAX_COST_RATIO", 0.0)
    assert proposed(monkeypatch, SEPARATE, tolerance=10.0) == []


def test_scene_without_removable_features_has_no_proposals(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(DROP)
    monkeypatch.setattr(timing, "run_seconds", price)
    replaced = ReplacedSetting("pymunk", scene.solver, METRICS["energy"], 1.0, 60.0)
    assert model_simplifications([EvaluationContext(scene, None, 1.0)], replaced) == []
