"""Comparisons with swept values: rows, truths, engines, and rejected arguments."""

from typing import Any

import pytest

import sandbox
from sandbox.scene.compile.scene import Scene

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

FALL = """
title = "Fall"
world = { gravity = [0, -10], duration = 0.5 }
ball = [{ name = "a", position = [0, 10], radius = 0.5 }]
"""


@pytest.fixture(scope="module")
def fall() -> Scene:
    return sandbox.loads(FALL)


def test_integrator_sweep_has_rows_of_the_only_engine_with_all_of_them(fall: Scene) -> None:
    found = sandbox.compare(fall, sweep={"solver.integrator": ["explicit_euler", "semi_implicit_euler", "rk4"]})
    assert [(row.engine, row.set["solver.integrator"], row.status) for row in found.rows] == [
        ("reference", "explicit_euler", "ok"),
        ("reference", "semi_implicit_euler", "ok"),
        ("reference", "rk4", "ok"),
    ]
    euler, other, rk4 = (row.score.max_position for row in found.rows)
    # g·h·T/2 = 10 · 0.01 · 0.5 / 2 m, behind and ahead; rk4 is exact for a parabola.
    assert (euler, other) == (pytest.approx(0.025, rel=1e-9), pytest.approx(0.025, rel=1e-9))
    assert rk4 < 1e-12
    assert (found.truth, len(found.trajectories)) == ("closed_form", 3)
    assert list(found.trajectories) == [row.name for row in found.rows]
    assert found.rows[2].name == "reference, integrator rk4"


def test_step_sweep_has_truths_at_the_frames_of_each_step(fall: Scene) -> None:
    found = sandbox.compare(fall, ["pymunk"], sweep={"solver.dt": [0.01, 0.005, 0.0025]})
    errors = [row.score.max_position for row in found.rows]
    assert errors == [pytest.approx(0.5 * 10 * 0.5 * h, rel=1e-6) for h in (0.01, 0.005, 0.0025)]
    truths = [found.truth_of(row.name) for row in found.rows]
    assert [len(each.trajectory.time) for each in truths if each is not None] == [51, 101, 201]
    assert found.same_scene


def test_sweeps_are_combined_and_each_changed_scene_has_its_truth(fall: Scene) -> None:
    sweep = {"world.gravity": [[0.0, -10.0], [0.0, -20.0]], "solver.dt": [0.01, 0.005]}
    found = sandbox.compare(fall, ["pymunk"], sweep=sweep)
    assert [(tuple(row.set["world.gravity"]), row.set["solver.dt"]) for row in found.rows] == [
        ((0.0, -10.0), 0.01), ((0.0, -10.0), 0.005), ((0.0, -20.0), 0.01), ((0.0, -20.0), 0.005),
    ]  # fmt: skip
    errors = [row.score.max_position for row in found.rows]
    assert errors == [pytest.approx(0.5 * g * 0.5 * h, rel=1e-6) for g in (10, 20) for h in (0.01, 0.005)]
    assert not found.same_scene


def test_every_engine_that_can_run_all_values_is_compared(fall: Scene) -> None:
    found = sandbox.compare(fall, sweep={"solver.dt": [0.01, 0.005]})
    assert [row.engine for row in found.rows] == [*sandbox.ENGINES, *sandbox.ENGINES]


def test_representation_lists_the_rows_in_few_lines(fall: Scene) -> None:
    found = sandbox.compare(fall, ["pymunk"], sweep={"solver.dt": [0.01, 0.005, 0.004, 0.002, 0.001]})
    lines = repr(found).splitlines()
    assert len(lines) == 5
    assert lines[0] == "<Comparison 'Fall': truth closed_form, trusted until 0.5 s of 0.5 s; tolerance 0.005 m"
    assert lines[1] == "  pymunk, dt 0.01: ok, max error 0.025 m"
    assert lines[4].endswith("; and 1 more rows>")


@pytest.mark.parametrize(
    ("key", "values", "words"),
    [("integrator", [], "needs a sequence of values"), ("integrator", "rk4", "needs a sequence of values"),
     ("dt", [0.01], "both swept and set"), ("integratr", ["rk4"], "integratr")],
)  # fmt: skip
def test_faulty_sweep_is_rejected(fall: Scene, key: str, values: list[Any], words: str) -> None:
    with pytest.raises(sandbox.SceneError if key == "integratr" else ValueError, match=words):
        sandbox.compare(fall, sweep={f"solver.{key}": values}, dt=0.1)
