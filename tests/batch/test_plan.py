"""Plans of runs: sweeps, their combinations and their limits."""

from pathlib import Path

import pytest

from sandbox.batch.plan import MAX_FAILED, plan
from sandbox.scene.errors import SceneError
from sandbox.scene.files.overrides import AddressError
from sandbox.scene.files.shipped_scenes import find

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


def test_excessive_number_of_runs_is_counted_without_creating_jobs(scene: tuple[str, str]) -> None:
    with pytest.raises(AddressError, match=r"multiply to 1,000,000,000 runs"):
        plan([scene], None, sweeps=["world.duration=1:2:1000000", "solver.dt=1:2:1000"])
    with pytest.raises(AddressError, match=r"multiply to 10\^300 runs"):
        plan([scene], None, sweeps=["solver.dt=1:2:1000000"] * 50)


def test_scenes_too_large_for_memory_are_rejected_at_the_first(scene: tuple[str, str]) -> None:
    Path(scene[1]).write_text(BALL + SPARKS.replace("3\n", "100000\n"))
    with pytest.raises(SceneError, match="200,000 runs of 100,001 bodies"):
        plan([scene], None, sweeps=["world.duration=1:2:1000"], seeds=200)
    Path(scene[1]).write_text(BALL)
    assert plan([scene], None, seeds=1_000_000)[0].seeds == 1_000_000  # one run, because nothing is random


@pytest.mark.full
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


def test_plan_without_options_is_the_unchanged_scene(scene: tuple[str, str]) -> None:
    (job,) = plan([scene], ["pymunk"])
    assert (job.scene.world.seed, job.scene.solver.dt, job.engine, job.actions) == (0, 0.01, "pymunk", ())


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


def test_too_many_runs_are_rejected_before_creating_jobs(scene: tuple[str, str]) -> None:
    sweeps = ["solver.dt=0.1:1:1001", "ball.a.mass=1:2:1000"]
    with pytest.raises(AddressError, match="multiply to 1,001,000 runs"):
        plan([scene], ["pymunk"], sweeps=sweeps)


def test_jobs_have_the_swept_values() -> None:
    jobs = plan([("bounce", str(find("bounce")))], ["pymunk"], sweeps=["ball.ball.restitution=0,1"], seeds=2)
    assert [dict(job.point) for job in jobs] == [{"ball.ball.restitution": e, "world.seed": 1} for e in (0, 1)]
    assert [job.seeds for job in jobs] == [2, 2]  # nothing is random


def test_seeds_are_merged_into_one_run_only_if_nothing_is_random(scene: tuple[str, str]) -> None:
    Path(scene[1]).write_text(BALL + SPARKS)
    jobs = plan([scene], ["pymunk"], sweeps=["emitter.0.velocity_max=[1.0,1.0],[-1.0,-1.0]"], seeds=3)
    assert [(job.scene.emitters[0].velocity_max[0], job.scene.world.seed, job.seeds) for job in jobs] == [
        (1.0, 1, 1),
        (1.0, 2, 1),
        (1.0, 3, 1),
        (-1.0, 1, 3),
    ]
