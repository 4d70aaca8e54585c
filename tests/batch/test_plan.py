"""Plans of runs: sweeps, their combinations and their limits."""

import tracemalloc
from collections.abc import Sequence
from itertools import islice
from pathlib import Path

import pytest

from sandbox.batch import plan as module
from sandbox.batch.job import Job
from sandbox.batch.plan import MAX_FAILED, Plan
from sandbox.batch.sampling import Sampling, sampled_axis
from sandbox.batch.sweep import SampledRange, SweepAxis, parse_sweep
from sandbox.scene.errors import SceneError
from sandbox.scene.files.overrides import AddressError

BALL = '[[ball]]\nname = "a"\nposition = [0, 0]\nradius = 1\n'

SPARKS = """
[[emitter]]
position = [0.0, 3.0]
count = 3
velocity_min = [-1.0, -1.0]
velocity_max = [1.0, 1.0]
"""


@pytest.fixture
def scene(tmp_path: Path) -> tuple[str, str]:
    path = tmp_path / "scene.toml"
    path.write_text(BALL)
    return "label", str(path)


def plan_of(
    scenes: list[tuple[str, str]],
    engines: list[str] | None = None,
    overrides: Sequence[str] = (),
    sweeps: Sequence[str] = (),
    seeds: int | None = None,
) -> Plan:
    return Plan(scenes, engines, overrides, [SweepAxis.of(*parse_sweep(sweep)) for sweep in sweeps], seeds)


def plan(
    scenes: list[tuple[str, str]],
    engines: list[str] | None = None,
    overrides: Sequence[str] = (),
    sweeps: Sequence[str] = (),
    seeds: int | None = None,
) -> list[Job]:
    """Return the jobs of a plan that was checked."""
    planned = plan_of(scenes, engines, overrides, sweeps, seeds)
    planned.check()
    jobs = [run.job() for run in planned]
    assert len(jobs) == len(planned)
    return jobs


def test_excessive_number_of_runs_is_counted_without_creating_jobs(scene: tuple[str, str]) -> None:
    with pytest.raises(AddressError, match=r"multiply to 1,000,000,000 runs"):
        plan([scene], None, sweeps=["world.duration=1:2:1000000", "solver.dt=1:2:1000"])
    with pytest.raises(AddressError, match=r"multiply to 10\^300 runs"):
        plan([scene], None, sweeps=["solver.dt=1:2:1000000"] * 50)


def test_a_million_equal_seeds_are_one_run(scene: tuple[str, str]) -> None:
    large = plan_of([scene], None, seeds=1_000_000)
    large.check()
    (run,) = large
    assert run.job().seeds == 1_000_000  # nothing is random
    assert len(large) == 1


@pytest.mark.nightly  # 11 s
def test_ten_million_runs_take_no_memory(scene: tuple[str, str]) -> None:
    ranges = [SampledRange.parse("ball.a.mass=1:2"), SampledRange.parse("ball.a.radius=0.5:2:log")]
    sample = sampled_axis([each for each in ranges if each is not None], Sampling.parse("10000:sobol"))
    tracemalloc.start()
    large = Plan([scene], ["pymunk"], (), [SweepAxis.of(*parse_sweep("solver.dt=0.001:0.01:1000")), sample])
    assert len(large) == 10_000_000
    large.check()
    found = [run.values for run in islice(large, 10)]
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 100e6  # checked scenes, at most 2,000 of them, and a block of 4,096 points; 10⁷ runs would take 10 GB
    assert {dict(values)["solver.dt"] for values in found} == {0.001}
    assert len({dict(values)["ball.a.mass"] for values in found}) == 10


def test_large_plan_is_checked_along_each_axis(scene: tuple[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_CHECKED", 10)
    large = plan_of([scene], ["pymunk"], sweeps=["ball.a.mass=1,2,3,-1", "ball.a.radius=1,2,-3"])
    with pytest.raises(SceneError) as error:
        large.check()
    assert [fault.message.rpartition(" ")[2] for fault in error.value.faults] == ["-1", "-3"]


def test_stored_runs_are_planned_without_reading_their_scenes(scene, monkeypatch):
    Path(scene[1]).write_text(BALL + SPARKS)
    planned = plan_of([scene], ["pymunk"], sweeps=["solver.dt=0.1,0.2"], seeds=3)
    planned.check()
    keys = {run.plan_key for run in planned}
    assert len(keys) == 6
    assert None not in keys
    read: list[object] = []
    again = plan_of([scene], ["pymunk"], sweeps=["solver.dt=0.1,0.2"], seeds=3)
    original = again.read
    monkeypatch.setattr(again, "read", lambda *values: (read.append(values), original(*values))[1])
    again.check(lambda key: key in keys)
    assert [run.plan_key for run in again] == [run.plan_key for run in planned]
    assert len(read) == 1  # whether a game is played, which is known of the first scene


@pytest.mark.parametrize("change", ["text", "engine", "value", "set", "versions"])
def test_plan_key_depends_on_everything_that_determines_a_run(change, scene, monkeypatch):
    def key(engine: str = "pymunk", value: str = "1", overrides: Sequence[str] = ()) -> str | None:
        (run,) = plan_of([scene], [engine], overrides, [f"ball.a.mass={value}"])
        return run.plan_key

    before = key()
    assert before == key() is not None
    if change == "text":
        Path(scene[1]).write_text(BALL.replace("radius = 1", "radius = 2"))
    if change == "versions":
        monkeypatch.setattr(module, "versions", lambda engine: {"python": "4.0"})
    after = key(
        "exact" if change == "engine" else "pymunk",
        "2" if change == "value" else "1",
        ["ball.a.radius=3"] if change == "set" else (),
    )
    assert after != before


@pytest.mark.fail_slow(60)  # takes over half a second
def test_number_of_reported_faults_is_limited(scene: tuple[str, str]) -> None:
    with pytest.raises(SceneError) as error:
        plan([scene], None, sweeps=["solver.dt=-1:-2:1000000"])
    assert len(error.value.faults) == MAX_FAILED


def test_plan_combines_scenes_sweeps_seeds_and_engines_in_order(scene: tuple[str, str], tmp_path: Path) -> None:
    second = tmp_path / "second.toml"
    second.write_text(BALL.replace("1\n", "2\n") + SPARKS)
    Path(scene[1]).write_text(BALL + SPARKS)
    jobs = plan(
        [scene, ("second", str(second))],
        ["pymunk", "other"],
        sweeps=["solver.dt=0.1,0.01", "world.gravity=[0,-1],[0,-2]"],
        seeds=2,
    )
    found = [(j.label, j.scene.solver.dt, j.scene.world.gravity[1], j.scene.world.seed, j.engine) for j in jobs]
    assert found == [
        (label, dt, g, seed, engine)
        for label in ("label", "second")
        for dt in (0.1, 0.01)
        for g in (-1.0, -2.0)
        for seed in (1, 2)
        for engine in ("pymunk", "other")
    ]
    assert {job.scene.balls[0].radius for job in jobs if job.label == "second"} == {2.0}


def test_sweep_overrides_set_values_and_seeds_override_sweeps(scene: tuple[str, str]) -> None:
    jobs = plan([scene], ["pymunk"], ["solver.dt=1.0", "world.seed=9"], ["solver.dt=0.1,0.2", "world.seed=7"], seeds=1)
    assert [(job.scene.solver.dt, job.scene.world.seed) for job in jobs] == [(0.1, 1), (0.2, 1)]


def test_every_fault_is_reported_once(scene: tuple[str, str], tmp_path: Path) -> None:
    bad = tmp_path / "bad.toml"
    bad.write_text(BALL.replace("radius = 1", "radius = -1\nmass = -1"))
    with pytest.raises(SceneError) as caught:
        plan([scene, ("bad", str(bad))], ["pymunk"], sweeps=["solver.dt=-1,0.1,0"], seeds=3)
    found = [(fault.file, fault.line, fault.path) for fault in caught.value.faults]
    assert found == [
        (scene[1], None, "solver.dt (set)"),
        (scene[1], None, "solver.dt (set)"),
        (str(bad), 4, "ball.a.radius"),
        (str(bad), 5, "ball.a.mass"),
        (str(bad), None, "solver.dt (set)"),
        (str(bad), None, "solver.dt (set)"),
    ]


@pytest.mark.parametrize("path", ["nothing.at.all", "ball..radius", "ball.none.radius"])
def test_fault_of_an_unknown_path_names_its_option(scene: tuple[str, str], path: str) -> None:
    with pytest.raises(SceneError) as caught:
        plan([scene], None, [f"{path}=1"])
    assert {fault.path for fault in caught.value.faults} == {"--set"}
    with pytest.raises(SceneError) as caught:
        plan([scene], None, ["solver.none.x=3"], [f"{path}=1,2"])
    assert sorted(fault.path for fault in caught.value.faults) == ["--set", "--sweep"]


def test_seeds_are_merged_into_one_run_only_if_nothing_is_random(scene: tuple[str, str]) -> None:
    Path(scene[1]).write_text(BALL + SPARKS)
    jobs = plan([scene], ["pymunk"], sweeps=["emitter.0.velocity_max=[1.0,1.0],[-1.0,-1.0]"], seeds=3)
    assert [(job.scene.emitters[0].velocity_max[0], job.scene.world.seed, job.seeds) for job in jobs] == [
        (1.0, 1, 1),
        (1.0, 2, 1),
        (1.0, 3, 1),
        (-1.0, 1, 3),
    ]
