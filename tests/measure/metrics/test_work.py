"""Work: counted, not timed, so that a change which makes an engine do more of it is seen without a clock."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from functools import cache

import pytest

from sandbox import load, run
from sandbox.engines.switching import start
from sandbox.scene.files.shipped_scenes import find

SLACK = 1.02
"""Contacts come and go by rounding, which a processor's libraries may do otherwise; a percent in the largest pile."""

WATCHED = {
    ("gas", 0.5, "pymunk"): {"substeps": 100, "contact_iterations": 570},
    ("gas", 0.5, "reference"): {"broad_tests": 12_886, "pair_tests": 90_940, "contact_iterations": 980},
    ("gas", 0.5, "exact"): {"events": 57, "predictions": 325, "pair_tests": 74_425},
    ("pile", 0.25, "reference"): {"broad_tests": 101_080, "pair_tests": 98_286, "contact_iterations": 118_480},
    ("pile", 0.25, "pymunk"): {"substeps": 30, "contact_iterations": 59_220},
    ("tower", 0.05, "reference"): {"pair_tests": 2_730, "contact_iterations": 94_800},
    ("bridge", 0.25, "pymunk"): {"contact_iterations": 4_080, "joint_iterations": 151_200},
    ("bridge", 0.25, "reference"): {"broad_tests": 241, "pair_tests": 46_272, "joint_iterations": 151_200},
    ("hanging_chain", 0.1, "reference"): {"pair_tests": 0, "joint_iterations": 28_800},
    ("sparks", 0.5, "reference"): {"broad_tests": 0, "pair_tests": 61_200, "contact_iterations": 3_640},
}
"""Scene, s of it, engine: how much of what it did when this was last looked at."""

NAMES = {
    "substeps",
    "broad_tests",
    "pair_tests",
    "contacts",
    "contact_iterations",
    "joint_iterations",
    "events",
    "predictions",
}


@cache
def work_of(name: str, seconds: float, engine: str) -> Mapping[str, int]:
    """Return the work of the first seconds of a shipped scene."""
    scene = load(find(name), [("world.duration", seconds)])
    found = run(scene, engine, audit=False)
    assert found.status == "ok", found.reason
    return found.info["work"]


@pytest.mark.parametrize("name", ["two_balls", "pendulum_90", "newtons_cradle"])
def test_counters_have_the_same_names_everywhere(name: str) -> None:
    counted = {"pymunk": {"substeps", "contacts", "contact_iterations", "joint_iterations"}}
    counted |= {"reference": NAMES - {"events", "predictions"}, "exact": {"events", "predictions", "pair_tests"}}
    for engine, names in counted.items():
        if (name, engine) != ("pendulum_90", "exact"):
            assert set(work_of(name, 0.5, engine)) == names


def test_two_balls_that_meet_once_cost_what_can_be_counted_by_hand() -> None:
    # 500 substeps of 1 ms, one pair looked at in each and at the start, one impact of 10 passes.
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
    # Both look ahead at the start and after the impact, each at a list of two.
    assert work_of("two_balls", 0.5, "exact") == {"events": 1, "predictions": 4, "pair_tests": 8}


def test_a_blow_through_five_balls_is_four_events_and_two_predictions_after_each() -> None:
    assert work_of("newtons_cradle", 0.5, "exact") == {"events": 4, "predictions": 5 + 2 * 4, "pair_tests": 13 * 5}


def test_a_joint_is_visited_once_a_pass_and_twice_where_it_is_held_twice() -> None:
    for engine in ("pymunk", "reference"):
        assert work_of("pendulum_90", 0.5, engine)["joint_iterations"] == 500 * 10
    scene = load(find("pendulum_90"), [("world.duration", 0.5)])
    visits = {
        how: run(scene, "reference", audit=False, joints=how).info["work"]["joint_iterations"]
        for how in ("relaxation", "xpbd", "rattle")
    }
    assert visits == {"relaxation": 5000, "xpbd": 5000, "rattle": 10_000}


def test_a_last_substep_that_is_cut_short_counts() -> None:
    scene = load(find("two_balls"), [("world.duration", 0.0125), ("solver.substeps", 4)])
    for engine in ("pymunk", "reference"):
        assert run(scene, engine, audit=False).info["work"]["substeps"] == 12 * 4 + 2


def test_pymunk_counts_contacts_only_while_somebody_asks_for_them() -> None:
    scene = load(find("pile"))
    simulation = start(scene, "pymunk")
    for _ in range(20):
        simulation.step()
    assert simulation.work["contact_iterations"] == 0
    simulation.contacts()
    simulation.step()
    assert simulation.work["contact_iterations"] == simulation.work["contacts"] * scene.solver.iterations > 0


@pytest.mark.parametrize(("name", "seconds", "engine"), WATCHED, ids=str)
def test_work_is_no_more_than_it_was(name: str, seconds: float, engine: str) -> None:
    found = work_of(name, seconds, engine)
    allowed = WATCHED[name, seconds, engine]
    assert {key: found[key] for key, most in allowed.items() if found[key] > SLACK * most} == {}
    # Far less is good news, and a reason to lower what is allowed.
    assert {key: found[key] for key, most in allowed.items() if found[key] < most / SLACK} == {}


@pytest.mark.parametrize("engine", ["pymunk", "reference", "exact"])
def test_work_is_the_same_at_every_repeat(engine: str) -> None:
    scene = load(find("gas"), [("world.duration", 0.5)])
    assert run(scene, engine, audit=False).info["work"] == work_of("gas", 0.5, engine)


def test_work_is_the_same_compiled_or_not() -> None:
    code = """
        import json
        from sandbox import load, run
        from sandbox.scene.files.shipped_scenes import find
        cases = [("newtons_cradle", 0.5), ("hanging_chain", 0.02)]
        works = []
        for name, seconds in cases:
            for engine in ("reference", "exact"):
                scene = load(find(name), [("world.duration", seconds)])
                works.append(run(scene, engine, audit=False).info["work"])
        print(json.dumps(works))
    """
    found = []
    for disabled in "01":
        environment = {**os.environ, "NUMBA_DISABLE_JIT": disabled}
        done = subprocess.run(
            [sys.executable, "-c", "\n".join(line[8:] for line in code.splitlines())],
            env=environment,
            capture_output=True,
            text=True,
            timeout=250,
            check=True,
        )
        found.append(json.loads(done.stdout))
    assert found[0] == found[1]
    assert found[0][0]["substeps"] == 500
