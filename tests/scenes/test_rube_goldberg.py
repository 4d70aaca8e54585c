"""The Rube Goldberg machine: each stage triggers the next, up to the bell, for several step lengths."""

from itertools import pairwise

import pytest

import sandbox
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

STAGES = [
    ("marble", "domino-1"), ("domino-1", "domino-2"), ("domino-8", "domino-9"), ("domino-9", "pusher"),
    ("pusher", "first beam"), ("runner", "cradle-1"), ("cradle-4", "cradle-5"), ("cradle-5", "third"),
    ("third", "paddle wheel"), ("arm", "fourth"), ("fourth", "tray"), ("tray", "second beam"), ("leaper", "flag"),
    ("flag", "bell"),
]  # fmt: skip
"""Pairs of bodies that touch, in order."""

UNTIL = "world.duration=15.0"


def run_machine(*changes: str) -> tuple[list[float], sandbox.Trajectory]:
    """Return the time of each stage, s, and the run."""
    scene = load(find("rube_goldberg"), [UNTIL, *changes])
    run = sandbox.run(scene, audit=False)
    names = [*scene.bodies.names, *reversed(scene.fixed_names)]  # index −1 is the first fixed element
    first: dict[frozenset[str], float] = {}
    for time, (a, b) in zip(run.contact_time.tolist(), run.contact_pair.tolist(), strict=True):
        first.setdefault(frozenset((names[a], names[b])), time)
    return [first[frozenset(stage)] for stage in STAGES], run


@pytest.fixture(scope="module")
def machine() -> tuple[list[float], sandbox.Trajectory]:
    return run_machine()


def test_stages_happen_in_order(machine: tuple[list[float], sandbox.Trajectory]) -> None:
    times, _ = machine
    assert all(before < after for before, after in pairwise(times)), dict(zip(STAGES, times, strict=True))
    assert times[0] > 1.0  # no stage starts at the beginning
    assert times[-1] < 15.0


def test_threads_tear_when_the_ball_lands_and_the_flag_rises(machine: tuple[list[float], sandbox.Trajectory]) -> None:
    times, run = machine
    landed = times[STAGES.index(("fourth", "tray"))]
    torn = sorted(time for time in run.broken_time.tolist() if time == time)  # nan for joints that hold
    assert len(torn) == 2
    assert torn == pytest.approx([landed, landed], abs=0.05)  # a few steps
    flag = list(run.names).index("flag")
    assert run.angle[-1, flag] < -0.6  # rad: it leans on the bell, 0.7 from its initial angle


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param(["solver.dt=0.005"], marks=pytest.mark.nightly),
        pytest.param(["solver.iterations=40"], marks=pytest.mark.nightly),
        pytest.param(["solver.dt=0.004", "solver.iterations=30"], marks=pytest.mark.nightly),
        ["solver.substeps=2"],
    ],
)
def test_stage_times_depend_little_on_the_step(
    machine: tuple[list[float], sandbox.Trajectory], changes: list[str]
) -> None:
    times, _ = run_machine(*changes)
    assert all(before < after for before, after in pairwise(times))
    # each stage starts from rest, so the errors of detection times do not accumulate
    assert times == pytest.approx(machine[0], abs=0.1)
