"""Compiled calls end by counted work, so that Ctrl-C and limits of time act between them."""

import math
from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.engines.contract import Members
from sandbox.engines.reference.compiled_stepper import MAX_WORK, OPTIONAL_KERNELS, CompiledStepper
from sandbox.engines.registry import ENGINES
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.files.load import from_document

pytestmark = pytest.mark.fail_slow(60)  # compiles the kernels


@pytest.fixture(autouse=True)
def _compiled_steps() -> None:
    """Compile the optional kernels at once; they are otherwise compiled only after a while."""
    for kernel in OPTIONAL_KERNELS:
        kernel.spent = math.inf


def stack(iterations: int, substeps: int) -> Scene:
    """Return a wall of 30 boxes, which has some 100 contacts."""
    boxes = [{"position": [1.01 * column, 0.5 + row], "size": [1.0, 1.0]} for column in range(6) for row in range(5)]
    return from_document(
        {
            "world": {"gravity": [0.0, -9.81], "duration": 1.0},
            "solver": {"dt": 0.01, "iterations": iterations, "substeps": substeps, "record_every": 1000},
            "plane": [{"point": [0.0, 0.0], "normal": [0.0, 1.0]}],
            "box": boxes,
        }
    )


@pytest.mark.parametrize(("iterations", "substeps"), [(2000, 1), (200, 20)])
def test_call_is_bounded_by_counted_work(iterations: int, substeps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Half of the work at most is not foreseen: a box has up to four points of contact, and two are assumed."""
    work, original = [], CompiledStepper.advance

    def counted(self: CompiledStepper, *arguments: Any, **named: Any) -> Any:
        before = self._world.work["contact_iterations"]
        found = original(self, *arguments, **named)
        work.append(self._world.work["contact_iterations"] - before)
        return found

    monkeypatch.setattr(CompiledStepper, "advance", counted)
    done = sandbox.run(stack(iterations, substeps), "reference", audit=False)
    assert done.status == "ok"
    assert sum(work) > MAX_WORK  # otherwise nothing is bounded
    assert max(work) <= 2 * MAX_WORK


def test_member_runs_stop_between_two_calls() -> None:
    """A stop within a run leaves its start as it was, and ends the others."""
    scene = stack(2000, 1)
    calls = 0

    def is_stopped() -> bool:
        nonlocal calls
        calls += 1
        return calls > 3

    simulation = ENGINES["reference"].start(Setup.of(scene), scene.solver)
    state = simulation.frame()
    starts = [np.stack([each, each]) for each in (state.position, state.velocity, state.angle, state.angular_velocity)]
    members = Members(*(each.copy() for each in starts))
    done = simulation.run_members(members, 1000.0, is_stopped)
    assert done.tolist() == [False, False]
    assert calls <= 5
    for start, end in zip(starts, members, strict=True):
        assert np.array_equal(start, end)
