"""Work counters of the engines: a change that makes an engine do more work is detected without timing."""

from collections.abc import Mapping
from functools import cache

import pytest

from sandbox import load, run
from sandbox.engines.switching import start
from sandbox.scene.files.shipped_scenes import find

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of `exact`

SLACK = 1.02
"""Contacts begin and end by rounding, which depends on the math library: a percent of work in the largest pile."""

EXPECTED_WORK = {
    ("gas", 0.5, "pymunk"): {"substeps": 100, "contact_iterations": 570},
    ("gas", 0.5, "reference"): {"broad_tests": 12_886, "pair_tests": 90_940, "contact_iterations": 980},
    ("gas", 0.5, "exact"): {"events": 57, "predictions": 325, "pair_tests": 74_425},
    ("pile", 0.25, "reference"): {"broad_tests": 101_080, "pair_tests": 98_286, "contact_iterations": 118_480},
    ("pile", 0.25, "pymunk"): {"substeps": 30, "contact_iterations": 59_220},
    ("tower", 0.05, "reference"): {"pair_tests": 2_730, "contact_iterations": 9_100},
    ("bridge", 0.25, "pymunk"): {"contact_iterations": 4_080, "joint_iterations": 151_200},
    ("bridge", 0.25, "reference"): {"broad_tests": 241, "pair_tests": 46_272, "joint_iterations": 151_200},
    ("hanging_chain", 0.1, "reference"): {"pair_tests": 0, "joint_iterations": 28_800},
    ("sparks", 0.5, "reference"): {"broad_tests": 0, "pair_tests": 61_200, "contact_iterations": 3_640},
}
"""Scene, duration in s and engine: its work counters at the last update."""


@cache
def work_of(name: str, seconds: float, engine: str) -> Mapping[str, int]:
    """Return the work of the first seconds of a shipped scene."""
    scene = load(find(name), [("world.duration", seconds)])
    found = run(scene, engine, audit=False)
    assert found.status == "ok", found.reason
    return found.info["work"]


def test_work_of_a_single_collision_equals_a_hand_count() -> None:
    # 500 substeps of 1 ms, one pair tested in each and at the start, one impact of 10 iterations.
    assert work_of("two_balls", 0.5, "reference") == {
        "substeps": 500,
        "broad_tests": 0,
        "pair_tests": 501,
        "contacts": 1,
        "contact_iterations": 10,
        "joint_iterations": 0,
    }
    native = {"substeps": 500, "contacts": 1, "contact_iterations": 10, "joint_iterations": 0}
    assert work_of("two_balls", 0.5, "pymunk") == native
    # Both balls predict at the start and after the impact, each over a list of two.
    assert work_of("two_balls", 0.5, "exact") == {"events": 1, "predictions": 4, "pair_tests": 8}


def test_impact_through_five_balls_is_four_events_with_two_predictions_each() -> None:
    assert work_of("newtons_cradle", 0.5, "exact") == {"events": 4, "predictions": 5 + 2 * 4, "pair_tests": 13 * 5}


def test_joint_is_solved_once_per_iteration_and_twice_by_rattle() -> None:
    for engine in ("pymunk", "reference"):
        assert work_of("pendulum_90", 0.5, engine)["joint_iterations"] == 500 * 10
    scene = load(find("pendulum_90"), [("world.duration", 0.5)])
    visits = {
        method: run(scene, "reference", audit=False, joints=method).info["work"]["joint_iterations"]
        for method in ("relaxation", "xpbd", "rattle")
    }
    assert visits == {"relaxation": 5000, "xpbd": 5000, "rattle": 10_000}


def test_shortened_last_substep_is_counted() -> None:
    scene = load(find("two_balls"), [("world.duration", 0.0125), ("solver.substeps", 4)])
    assert run(scene, "reference", audit=False).info["work"]["substeps"] == 12 * 4 + 2
    assert run(scene, "pymunk", audit=False).info["work"]["substeps"] == 13 * 4


def test_pymunk_counts_contacts_only_after_they_are_requested() -> None:
    scene = load(find("pile"))
    simulation = start(scene, "pymunk")
    for _ in range(20):
        simulation.step()
    assert simulation.work["contact_iterations"] == 0
    simulation.contacts()
    simulation.step()
    assert simulation.work["contact_iterations"] == simulation.work["contacts"] * scene.solver.iterations > 0


@pytest.mark.parametrize(("name", "seconds", "engine"), EXPECTED_WORK, ids=str)
def test_work_is_within_the_expected_amount(name: str, seconds: float, engine: str) -> None:
    found = work_of(name, seconds, engine)
    expected = EXPECTED_WORK[name, seconds, engine]
    assert {key: found[key] for key, amount in expected.items() if found[key] > SLACK * amount} == {}
    # Far less work is an improvement: lower the expected amount.
    assert {key: found[key] for key, amount in expected.items() if found[key] < amount / SLACK} == {}
