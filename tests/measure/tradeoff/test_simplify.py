"""Simplified models, proposed only within the tolerance. Costs are synthetic; errors are measured."""

import json

import pytest

from sandbox.jsonable import to_json
from sandbox.measure.compare.ground_truth import Truth, truth_of
from sandbox.measure.compare.self_convergence import refine
from sandbox.measure.tradeoff import simplify as module
from sandbox.measure.tradeoff import timing
from sandbox.measure.tradeoff.metrics import METRICS, EvaluationContext
from sandbox.measure.tradeoff.simplify import ReplacedSetting, Simplification, model_simplifications
from sandbox.scene.compile.demands import Demand, demands
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from tests.runs_by_hand import DROP, scene_of

pytestmark = pytest.mark.full  # long runs and sweeps

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
    assert found is not None
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


def test_only_negligible_damping_can_be_omitted(monkeypatch: pytest.MonkeyPatch) -> None:
    document = DROP.replace("duration = 0.4", "duration = 0.2\ndamping = {}")
    weak, strong = (proposed(monkeypatch, document.format(each), tolerance=2e-3) for each in ("0.9999", "0.01"))
    assert "no damping" in [each.what for each in weak]
    assert "no damping" not in [each.what for each in strong]


def test_only_negligible_drag_can_be_omitted(monkeypatch: pytest.MonkeyPatch) -> None:
    weak, strong = (proposed(monkeypatch, DRAGGED.format(drag), tolerance=2e-3) for drag in ("1e-4", "5.0"))
    assert "no drag" in [each.what for each in weak]
    assert "no drag" not in [each.what for each in strong]
    (sentence,) = [each.sentence for each in weak if each.what == "no drag"]
    assert sentence.startswith("the scene can also be simulated without drag: max_position ")


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


def test_simplification_that_is_no_cheaper_is_not_proposed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_COST_RATIO", 0.0)
    assert proposed(monkeypatch, SEPARATE, tolerance=10.0) == []


def test_undefined_metric_yields_no_proposals(monkeypatch: pytest.MonkeyPatch) -> None:
    assert proposed(monkeypatch, SEPARATE, tolerance=10.0, metric="joint_error") == []


def test_scene_without_removable_features_has_no_proposals(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(DROP)
    monkeypatch.setattr(timing, "run_seconds", price)
    replaced = ReplacedSetting("pymunk", scene.solver, METRICS["energy"], 1.0, 60.0)
    assert model_simplifications([EvaluationContext(scene, None, 1.0)], replaced) == []


def test_document_is_json(monkeypatch: pytest.MonkeyPatch) -> None:
    (first, *_) = proposed(monkeypatch, DROP)
    document = json.loads(json.dumps(to_json(first), allow_nan=False))
    assert set(document) == {"what", "engine", "error", "cost_ms_per_second", "ratio", "sentence"}
    assert "max_position 0 m" in document["sentence"]
