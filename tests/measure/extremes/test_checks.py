"""Rules of extremes: each fires on a made-up run that breaks it, and keeps quiet on one that does not."""

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


def evidence(document: dict[str, Any], rules: set[str], **arrays: Any) -> RunUnderTest:
    """Return a run of a scene in which nobody moves, with some of its arrays put in place of what was."""
    scene = from_document(document)
    resolved = scene.solver.replace(slop=0.01)
    done = run(scene, audit=False)
    still = {
        "position": np.repeat(scene.bodies.position[None], len(done.time), axis=0),
        "velocity": np.zeros_like(done.velocity),
    }
    return RunUnderTest(case(rules), scene, resolved, replace(done, **{**still, **arrays}))


def case(rules: set[str], **more: Any) -> Scenario:
    return Scenario("made up", "", {}, lambda _: {}, frozenset(rules), **more)


def places(document: dict[str, Any], body: int, **moved: tuple[int, float]) -> np.ndarray[Any, Any]:
    """Return positions in which one body is elsewhere from a frame on."""
    start = from_document(document).bodies.position
    position = np.repeat(start[None], 11, axis=0)
    for axis, (frame, value) in moved.items():
        position[frame:, body, "xy".index(axis)] = value
    return position


def speeds(bodies: int, body: int, frame: int, value: float) -> np.ndarray[Any, Any]:
    velocity = np.zeros((11, bodies, 2))
    velocity[frame:, body, 0] = value
    return velocity


def test_run_in_which_nothing_moves_breaks_no_rule() -> None:
    seen = evidence(RESTING, set(RULES))
    assert {name: rule(seen) for name, rule in RULES.items()} == dict.fromkeys(RULES)
    assert classify(seen).verdict == "degraded"  # as nothing is known of it


@pytest.mark.parametrize(
    ("rule", "document", "arrays", "words"),
    [
        ("bounded", RESTING, {"position": places(RESTING, 0, x=(5, np.inf))}, "not finite"),
        ("bounded", RESTING, {"velocity": speeds(1, 0, 5, np.nan)}, "not finite"),
        ("bounded", RESTING, {"position": places(RESTING, 0, x=(5, 71.0))}, "'a' moved 71 m; the limit is 60 m"),
        (
            "energy",
            RESTING,
            {"velocity": speeds(1, 0, 5, 1.0)},
            "energy rose by 0.05 of the 10 J available; the limit is 0.01",
        ),
        ("momentum", PAIR, {"velocity": speeds(2, 0, 1, 1.0)}, "momentum changed by 1"),
        ("overlap", RESTING, {"position": places(RESTING, 0, y=(5, 0.3))}, "an overlap of 0.2 m at 0.5 s"),
        ("overlap", PAIR, {"position": places(PAIR, 1, x=(5, 0.9))}, "an overlap of 0.1 m at 0.5 s"),
        ("parted", RESTING, {"position": places(RESTING, 0, y=(10, 0.47))}, "an overlap of 0.03 m remains"),
        ("stands", RESTING, {"position": places(RESTING, 0, x=(5, 0.6))}, "'a' moved by 0.6 of its width"),
        ("settles", RESTING, {"velocity": speeds(1, 0, 10, 0.1)}, "'a' still moves at 0.1 m/s after 1 s"),
    ],
)
def test_rule_that_is_broken_is_told(rule: str, document: dict[str, Any], arrays: dict[str, Any], words: str) -> None:
    seen = evidence(document, {rule}, **arrays)
    told = RULES[rule](seen)
    assert told is not None
    assert words in told
    outcome = classify(seen)
    assert (outcome.verdict, outcome.rule, outcome.reason) == ("failed", rule, told)
    if rule != "bounded":  # who does not ask is not told
        assert classify(replace(seen, case=case(set()))).verdict == "degraded"


@pytest.mark.parametrize(
    ("rule", "arrays"),
    [
        ("bounded", {"position": places(RESTING, 0, x=(5, 59.0))}),
        ("energy", {"velocity": speeds(1, 0, 5, 0.4)}),
        ("overlap", {"position": places(RESTING, 0, y=(5, 0.39))}),  # 2 slop + g·h² = 0.12 m
        ("parted", {"position": places(RESTING, 0, y=(5, 0.485))}),
        ("stands", {"position": places(RESTING, 0, x=(5, 0.4))}),
        ("settles", {"velocity": speeds(1, 0, 10, 0.05)}),  # √(g·width) is 3.2 m/s
        ("settles", {"velocity": np.concatenate((speeds(1, 0, 0, 9.0)[:10], np.zeros((1, 1, 2))))}),
    ],
)
def test_rule_that_is_just_kept_is_not_told(rule: str, arrays: dict[str, Any]) -> None:
    assert RULES[rule](evidence(RESTING, {rule}, **arrays)) is None


def test_joint_that_is_off_by_more_than_a_hundredth_is_told() -> None:
    seen = evidence(RESTING, {"joints"})
    for error, broken in ((None, False), (0.0099, False), (0.0101, True), (np.inf, True)):
        info = {**seen.run.info, "joint_error": error}
        told = RULES["joints"](replace(seen, run=replace(seen.run, info=info)))
        assert (told is not None) == broken


def test_case_says_who_got_through() -> None:
    seen = evidence(RESTING, {"through"})
    assert RULES["through"](seen) is None
    behind = replace(seen, case=case({"through"}, through=lambda scene, run: "gone"))
    assert classify(behind).reason == "gone"


@pytest.mark.parametrize(
    ("error", "verdict", "rule"),
    [(0.0, "exact", None), (1e-6, "exact", None), (1.1e-6, "degraded", None), (0.5, "degraded", None),
     (0.51, "failed", "truth")],
)  # fmt: skip
def test_answer_is_exact_degraded_or_of_no_use(error: float, verdict: str, rule: str | None) -> None:
    def off(scene: Scene, run: Trajectory) -> float:
        return error

    seen = replace(evidence(RESTING, set()), case=case(set(), error=off, error_of="the way", fail_above=0.5))
    outcome = classify(seen)
    assert (outcome.verdict, outcome.rule, outcome.error) == (verdict, rule, error)
    assert "of the way" in outcome.reason


@pytest.mark.parametrize(("status", "rule"), [("diverged", "bounded"), ("failed", "work")])
def test_run_that_ended_early_failed_with_its_reason(status: str, rule: str) -> None:
    seen = evidence(RESTING, set(RULES))
    info = {**seen.run.info, "status": status, "reason": "at 0.1 s: it was too much"}
    outcome = classify(replace(seen, run=replace(seen.run, info=info)))
    assert (outcome.verdict, outcome.rule, outcome.reason) == ("failed", rule, "at 0.1 s: it was too much")


def test_stake_is_the_motion_and_the_fall_there_is() -> None:
    assert default_energy_scale(from_document(PAIR)) == 0.5
    assert default_energy_scale(from_document(RESTING)) == 10.0  # it cannot fall: its own width
    high = {**RESTING, "ball": [{"position": [0.0, 3.0], "radius": 0.5, "mass": 2.0}]}
    assert default_energy_scale(from_document(high)) == 60.0
