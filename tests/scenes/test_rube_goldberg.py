"""The Rube Goldberg machine: each thing is moved by the one before, up to the bell, whatever the step."""

from itertools import pairwise

import pytest

import sandbox
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find

pytestmark = pytest.mark.full  # long runs and sweeps

STAGES = [
    ("marble", "domino-1"), ("domino-1", "domino-2"), ("domino-8", "domino-9"), ("domino-9", "pusher"),
    ("pusher", "first beam"), ("runner", "cradle-1"), ("cradle-4", "cradle-5"), ("cradle-5", "third"),
    ("third", "paddle wheel"), ("arm", "fourth"), ("fourth", "tray"), ("tray", "second beam"), ("leaper", "flag"),
    ("flag", "bell"),
]  # fmt: skip
"""Who touches whom, in order."""

UNTIL = "world.duration=15.0"


def played(*changes: str) -> tuple[list[float], sandbox.Trajectory]:
    """Return when each stage happens, s, and the run."""
    scene = load(find("rube_goldberg"), [UNTIL, *changes])
    run = sandbox.run(scene, audit=False)
    names = [*scene.bodies.names, *reversed(scene.fixed_names)]  # −1 is the first of those that are fixed
    first: dict[frozenset[str], float] = {}
    for time, (a, b) in zip(run.contact_time.tolist(), run.contact_pair.tolist(), strict=True):
        first.setdefault(frozenset((names[a], names[b])), time)
    return [first[frozenset(stage)] for stage in STAGES], run


@pytest.fixture(scope="module")
def machine() -> tuple[list[float], sandbox.Trajectory]:
    return played()


def test_each_thing_is_moved_by_the_one_before(machine: tuple[list[float], sandbox.Trajectory]) -> None:
    times, _ = machine
    assert all(before < after for before, after in pairwise(times)), dict(zip(STAGES, times, strict=True))
    assert times[0] > 1.0  # nothing goes off by itself
    assert times[-1] < 15.0


def test_the_threads_tear_as_the_ball_lands_and_the_flag_stands(
    machine: tuple[list[float], sandbox.Trajectory],
) -> None:
    times, run = machine
    landed = times[STAGES.index(("fourth", "tray"))]
    torn = sorted(time for time in run.broken_time.tolist() if time == time)  # others are nan
    assert len(torn) == 2
    assert torn == pytest.approx([landed, landed], abs=0.05)  # within a few steps
    flag = list(run.names).index("flag")
    assert run.angle[-1, flag] < -0.6  # rad: it leans on the bell, 0.7 from where it lay


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param(["solver.dt=0.005"], marks=pytest.mark.slow),
        pytest.param(["solver.iterations=40"], marks=pytest.mark.slow),
        pytest.param(["solver.dt=0.004", "solver.iterations=30"], marks=pytest.mark.slow),
        ["solver.substeps=2"],
    ],
)
def test_the_machine_hangs_on_no_rounding_error(
    machine: tuple[list[float], sandbox.Trajectory], changes: list[str]
) -> None:
    times, _ = played(*changes)
    assert all(before < after for before, after in pairwise(times))
    # each stage begins anew from rest, so what a step does to when a hit is found does not add up to more
    assert times == pytest.approx(machine[0], abs=0.1)
