"""Rules of extremes: each is violated by a synthetic run made for it, and not by one within its limits."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sandbox.measure.extremes.checks import RULES, RunUnderTest, classify
from sandbox.measure.extremes.experiment import Scenario, default_energy_scale
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Trajectory

FLOOR = {"point": [0.0, 0.0], "normal": [0.0, 1.0]}
RESTING = {
    "world": {"gravity": [0.0, -10.0], "duration": 1.0},
    "solver": {"dt": 0.1},
    "plane": [FLOOR],
    "ball": [{"name": "a", "position": [0.0, 0.5], "radius": 0.5}],
}
PAIR = {
    "world": {"duration": 1.0},
    "solver": {"dt": 0.1},
    "ball": [
        {"name": "a", "position": [0.0, 0.0], "velocity": [1.0, 0.0], "radius": 0.5},
        {"name": "b", "position": [5.0, 0.0], "radius": 0.5},
    ],
}


def run_under_test(document: dict[str, Any], rules: set[str], **arrays: Any) -> RunUnderTest:
    """Return a run of a scene in which no body moves, with some of its arrays replaced."""
    scene = from_document(document)
    resolved = scene.solver.replace(slop=0.01)
    result = run(scene, audit=False)
    resting = {
        "position": np.repeat(scene.bodies.position[None], len(result.time), axis=0),
        "velocity": np.zeros_like(result.velocity),
    }
    return RunUnderTest(case(rules), scene, resolved, replace(result, **{**resting, **arrays}))


def case(rules: set[str], **more: Any) -> Scenario:
    return Scenario("made up", "", {}, lambda _: {}, frozenset(rules), **more)


def displaced(document: dict[str, Any], body: int, **moved: tuple[int, float]) -> np.ndarray[Any, Any]:
    """Return positions in which the coordinates of one body change at a frame."""
    start = from_document(document).bodies.position
    position = np.repeat(start[None], 11, axis=0)
    for axis, (frame, value) in moved.items():
        position[frame:, body, "xy".index(axis)] = value
    return position


def speeds(bodies: int, body: int, frame: int, value: float) -> np.ndarray[Any, Any]:
    velocity = np.zeros((11, bodies, 2))
    velocity[frame:, body, 0] = value
    return velocity


def test_run_without_motion_violates_no_rule() -> None:
    evidence = run_under_test(RESTING, set(RULES))
    assert {name: rule(evidence) for name, rule in RULES.items()} == dict.fromkeys(RULES)
    assert classify(evidence).verdict == "degraded"  # because its error is not measured


@pytest.mark.parametrize(
    ("rule", "document", "arrays", "words"),
    [
        ("bounded", RESTING, {"position": displaced(RESTING, 0, x=(5, np.inf))}, "not finite"),
        ("bounded", RESTING, {"velocity": speeds(1, 0, 5, np.nan)}, "not finite"),
        ("bounded", RESTING, {"position": displaced(RESTING, 0, x=(5, 71.0))}, "'a' moved 71 m; the limit is 60 m"),
        (
            "energy",
            RESTING,
            {"velocity": speeds(1, 0, 5, 1.0)},
            "energy rose by 0.05 of the 10 J available; the limit is 0.01",
        ),
        ("momentum", PAIR, {"velocity": speeds(2, 0, 1, 1.0)}, "momentum changed by 1"),
        ("overlap", RESTING, {"position": displaced(RESTING, 0, y=(5, 0.3))}, "an overlap of 0.2 m at 0.5 s"),
        ("overlap", PAIR, {"position": displaced(PAIR, 1, x=(5, 0.9))}, "an overlap of 0.1 m at 0.5 s"),
        ("parted", RESTING, {"position": displaced(RESTING, 0, y=(10, 0.47))}, "an overlap of 0.03 m remains"),
        ("stands", RESTING, {"position": displaced(RESTING, 0, x=(5, 0.6))}, "'a' moved by 0.6 of its width"),
        ("settles", RESTING, {"velocity": speeds(1, 0, 10, 0.1)}, "'a' still moves at 0.1 m/s after 1 s"),
    ],
)
def test_violated_rule_is_reported_with_its_reason(rule, document, arrays, words):
    evidence = run_under_test(document, {rule}, **arrays)
    violation = RULES[rule](evidence)
    assert violation is not None
    assert words in violation
    outcome = classify(evidence)
    assert (outcome.verdict, outcome.rule, outcome.reason) == ("failed", rule, violation)
    if rule != "bounded":  # rules that a scenario does not list are not checked
        assert classify(replace(evidence, case=case(set()))).verdict == "degraded"


@pytest.mark.parametrize(
    ("rule", "arrays"),
    [
        ("bounded", {"position": displaced(RESTING, 0, x=(5, 59.0))}),
        ("energy", {"velocity": speeds(1, 0, 5, 0.4)}),
        ("overlap", {"position": displaced(RESTING, 0, y=(5, 0.39))}),  # 2 slop + g·h² = 0.12 m
        ("parted", {"position": displaced(RESTING, 0, y=(5, 0.485))}),
        ("stands", {"position": displaced(RESTING, 0, x=(5, 0.4))}),
        ("settles", {"velocity": speeds(1, 0, 10, 0.05)}),  # √(g·width) is 3.2 m/s
        ("settles", {"velocity": np.concatenate((speeds(1, 0, 0, 9.0)[:10], np.zeros((1, 1, 2))))}),
    ],
)
def test_rule_within_its_limit_is_not_reported(rule: str, arrays: dict[str, Any]) -> None:
    assert RULES[rule](run_under_test(RESTING, {rule}, **arrays)) is None


def test_joint_error_above_1_percent_violates_the_rule() -> None:
    evidence = run_under_test(RESTING, {"joints"})
    for error, is_violated in ((None, False), (0.0099, False), (0.0101, True), (np.inf, True)):
        info = {**evidence.run.info, "joint_error": error}
        violation = RULES["joints"](replace(evidence, run=replace(evidence.run, info=info)))
        assert (violation is not None) == is_violated


def test_scenario_decides_whether_a_body_got_through() -> None:
    evidence = run_under_test(RESTING, {"through"})
    assert RULES["through"](evidence) is None
    behind = replace(evidence, case=case({"through"}, through=lambda scene, run: "gone"))
    assert classify(behind).reason == "gone"


@pytest.mark.parametrize(
    ("error", "verdict", "rule"),
    [(0.0, "exact", None), (1e-6, "exact", None), (1.1e-6, "degraded", None), (0.5, "degraded", None),
     (0.51, "failed", "truth")],
)  # fmt: skip
def test_verdict_is_exact_degraded_or_failed_by_error(error: float, verdict: str, rule: str | None) -> None:
    def measured(scene: Scene, run: Trajectory) -> float:
        return error

    evidence = replace(
        run_under_test(RESTING, set()), case=case(set(), error=measured, error_of="the way", fail_above=0.5)
    )
    outcome = classify(evidence)
    assert (outcome.verdict, outcome.rule, outcome.error) == (verdict, rule, error)
    assert "of the way" in outcome.reason


@pytest.mark.parametrize(("status", "rule"), [("diverged", "bounded"), ("failed", "work")])
def test_run_that_ended_early_failed_with_its_reason(status: str, rule: str) -> None:
    evidence = run_under_test(RESTING, set(RULES))
    info = {**evidence.run.info, "status": status, "reason": "at 0.1 s: it was too much"}
    outcome = classify(replace(evidence, run=replace(evidence.run, info=info)))
    assert (outcome.verdict, outcome.rule, outcome.reason) == ("failed", rule, "at 0.1 s: it was too much")


def test_energy_scale_is_kinetic_energy_plus_possible_fall() -> None:
    assert default_energy_scale(from_document(PAIR)) == 0.5
    assert default_energy_scale(from_document(RESTING)) == 10.0  # it cannot fall: a fall by its width
    high = {**RESTING, "ball": [{"position": [0.0, 3.0], "radius": 0.5, "mass": 2.0}]}
    assert default_energy_scale(from_document(high)) == 60.0
