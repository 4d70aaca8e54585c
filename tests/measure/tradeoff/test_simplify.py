"""Proposals: cheaper models, told of only where they keep to the tolerance. Costs are made by hand; errors are not."""

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
APART = f"""{LOW}
[[ball]]
name = "b"
position = [3.0, 0.6]
radius = 0.5
restitution = 0.5
"""
"""Two balls that both bounce, and never meet."""

DRAGGED = DROP.replace("duration = 0.4", "duration = 0.2\nlinear_drag = {}")


def price(scene: Scene, engine: str, settings: Settings) -> float:
    """Every demand costs a second: what demands less is cheaper, on whatever machine."""
    return float(len(demands(scene)))


def finest(scene: Scene) -> Truth:
    """Return the finest answer as the truth, whether or not a second method confirms it: that is tested elsewhere."""
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


def test_balls_that_never_meet_need_not_look_for_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    # By the fine step, first order, it is g·h·T/2 = 0.001 m off, with what the bounce adds.
    found = proposed(monkeypatch, APART, tolerance=0.01)
    (fixed,) = [each for each in found if "fixed" in each.what]
    assert fixed.engine == "pymunk"
    assert fixed.error <= 0.01
    assert fixed.ratio < 1.0
    apart = scene_of(APART)
    assert Demand.BALL_BALL in demands(apart)
    assert fixed.ratio == (len(demands(apart)) - 1) / len(demands(apart))


def test_balls_that_meet_on_another_seed_have_to_look(monkeypatch: pytest.MonkeyPatch) -> None:
    meeting = APART.replace("[3.0, 0.6]", "[1.2, 0.6]\nvelocity = [-2.0, 0.0]")
    assert not [each for each in proposed(monkeypatch, APART, meeting, tolerance=10.0) if "fixed" in each.what]


def test_drag_that_does_nothing_may_go_and_drag_that_does_may_not(monkeypatch: pytest.MonkeyPatch) -> None:
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
        for text in (APART, DRAGGED.format("0.1")):
            assert all(each.error <= tolerance for each in proposed(monkeypatch, text, tolerance=tolerance))


def test_what_is_no_cheaper_is_not_proposed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_COST_RATIO", 0.0)
    assert proposed(monkeypatch, APART, tolerance=10.0) == []


def test_metric_that_says_nothing_proposes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    assert proposed(monkeypatch, APART, tolerance=10.0, metric="joint_error") == []


def test_scene_without_anything_to_leave_out_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(DROP)
    monkeypatch.setattr(timing, "run_seconds", price)
    replaced = ReplacedSetting("pymunk", scene.solver, METRICS["energy"], 1.0, 60.0)
    assert model_simplifications([EvaluationContext(scene, None, 1.0)], replaced) == []


def test_document_is_json(monkeypatch: pytest.MonkeyPatch) -> None:
    (first, *_) = proposed(monkeypatch, DROP)
    document = json.loads(json.dumps(to_json(first), allow_nan=False))
    assert set(document) == {"what", "engine", "error", "cost_ms_per_second", "ratio", "sentence"}
    assert "max_position 0 m" in document["sentence"]
