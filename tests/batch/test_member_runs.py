"""Member runs: start states of many runs, and rows of runs computed in one call, are those of ordinary runs."""

import math
from dataclasses import replace
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sandbox
from sandbox.arrays import BoolArray
from sandbox.batch import member_runs
from sandbox.batch.driver import MAX_MEMBERS, Driver
from sandbox.batch.executors import AnyTask, InProcessExecutor, JobOutcome, TaskLostError, run_task
from sandbox.batch.job import CompletedRun, RunOptions, RunRecord
from sandbox.batch.member_runs import MemberTask
from sandbox.batch.plan import Plan
from sandbox.batch.process_pool import ProcessExecutor
from sandbox.batch.start_states import SEED, StartStates, is_start_key
from sandbox.batch.store import Store
from sandbox.batch.stored_run import StoredRun
from sandbox.batch.sweep import SweepAxis, parse_sweep
from sandbox.engines.contract import Members
from sandbox.engines.reference.compiled_stepper import OPTIONAL_KERNELS
from sandbox.scene.errors import SceneError
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import loads
from tests.batch.test_driver import ScriptedExecutor

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of `exact` and of many worlds

BALLS = """
title = "Balls"
world = { gravity = [0, -9.81], duration = 0.4 }
solver = { dt = 0.01, record_every = 7 }
plane = [{ point = [0, 0], normal = [0, 1], restitution = 0.7, friction = 0.3 }]
ball = [{ name = "a", position = [0, 0.3], velocity = [1, 0], radius = 0.1, restitution = 0.9 }]
grid = [
  { origin = [0.5, 0.2], columns = 3, spacing = [0.3, 0.3], jitter = 0.03, velocity_jitter = 1, radius = 0.1 },
]
"""

END = RunOptions(audit=False, keep="end")


def plan_of(
    path: Path, engines: list[str], sweeps: list[str], seeds: int | None = None, keeps_ends: bool = True
) -> Plan:
    axes = [SweepAxis.of(*parse_sweep(sweep)) for sweep in sweeps]
    plan = Plan([("balls", str(path))], engines, (), axes, seeds, keeps_ends=keeps_ends)
    plan.check()
    return plan


@pytest.fixture(scope="module", autouse=True)
def compiled_steps() -> None:
    """Compile the steps of the reference engine, without which it computes no members, here and for workers."""
    for kernel in OPTIONAL_KERNELS:
        kernel.spent = math.inf
    sandbox.run(loads(BALLS), "reference")


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "balls.toml"
    path.write_text(BALLS)
    return path


def driven(
    plan: Plan, store: Store | None, executor: Any = None, options: RunOptions = END
) -> tuple[list[RunRecord], set[str]]:
    """Run a plan; return the results in its order, and the engines that computed members."""
    found: list[tuple[int, RunRecord]] = []
    computed: set[str] = set()
    executor = executor or InProcessExecutor()

    def note(_label: str, engine: str) -> None:
        computed.add(engine)

    Driver(plan, len(plan), executor, options, store, lambda *each: found.append(each), computed=note).run()
    assert sorted(index for index, _ in found) == list(range(len(plan)))
    return [record for _, record in sorted(found, key=itemgetter(0))], computed


def outcome(row: StoredRun) -> StoredRun:
    """Return a row without the times of the run, which are measured."""
    return replace(row, created="", seconds=None)


@pytest.mark.parametrize("workers", [0, 2])
def test_rows_are_those_of_ordinary_runs(scene: Path, tmp_path: Path, workers: int) -> None:
    sweeps = ["ball.a.velocity=[0,0],[1,-2],[-1,0.5]", "world.gravity=[0,-9.81],[0,-1]"]
    engines = ["exact", "reference", "pymunk"]
    stores = [Store(tmp_path / name) for name in ("members", "ordinary")]
    executor = ProcessExecutor(workers) if workers else InProcessExecutor()
    members, computed = driven(plan_of(scene, engines, sweeps, 12), stores[0], executor)
    ordinary, none = driven(plan_of(scene, engines, sweeps, 12, keeps_ends=False), stores[1])
    assert (computed, none) == ({"exact", "reference"}, set())
    assert len(members) == 3 * 2 * 12 * 3
    assert [result.row().id for result in members] == [result.row().id for result in ordinary]
    assert [result.row().set for result in members] == [result.row().set for result in ordinary]
    rows = [sorted((outcome(row) for row in store.rows()), key=lambda row: row.id) for store in stores]
    assert rows[0] == rows[1]
    assert {row.contacts for row in rows[0]} == {None}
    assert {row.status for row in rows[0]} == {"ok"}
    for store in stores:
        store.close()


def test_resume_makes_the_missing_runs_only(scene: Path, tmp_path: Path) -> None:
    with Store(tmp_path / "runs") as store:
        driven(plan_of(scene, ["exact"], [], 10), store)
        results, _ = driven(plan_of(scene, ["exact"], [], 30), store)
        assert [result.repeated for result in results] == [True] * 10 + [False] * 20
        assert len(store.rows()) == 30
        more, _ = driven(
            plan_of(scene, ["exact"], [], 30, keeps_ends=False), store, options=replace(END, keep="summary")
        )
        assert not any(result.repeated for result in more)  # contacts are wanted now
        again, _ = driven(plan_of(scene, ["exact"], [], 30), store)
        assert all(result.repeated for result in again)
        assert {row.contacts is None for row in store.rows()} == {False}


def test_starts_that_an_engine_refuses_are_ordinary_runs(scene: Path, tmp_path: Path) -> None:
    sweeps = ["ball.a.position=[0,0.3],[0.1,0.3],[0.5,0.2],[0,0.4]"]  # the third is inside a ball of the grid
    plan = plan_of(scene, ["exact"], sweeps, 9)
    results, computed = driven(plan, None)
    statuses = [result.row().status for result in results]
    assert statuses == (["ok"] * 18 + ["refused"] * 9 + ["ok"] * 9)
    assert computed == {"exact"}


def test_faults_of_scenes_that_were_not_checked_are_reported(scene: Path) -> None:
    values = ",".join(f"[{k},0.3]" for k in range(1200)) + ",[0,-2000]"
    plan = plan_of(scene, ["exact"], [f"ball.a.position={values}"])
    faults: list[SceneError] = []
    results: dict[int, RunRecord] = {}
    Driver(plan, 1201, InProcessExecutor(), END, None, results.__setitem__, faulty=faults.append).run()
    assert len(results) == 1200
    assert "behind the plane" in str(faults[0].faults[0])


def test_members_of_a_lost_task_are_run_again(scene: Path, tmp_path: Path) -> None:
    def answer(task: AnyTask) -> tuple[JobOutcome, ...]:
        if isinstance(task, MemberTask):
            raise TaskLostError("the process was killed by SIGKILL", run_task(task)[:5], knows_job=True)
        return run_task(task)

    executor = ScriptedExecutor(answer)
    with Store(tmp_path / "runs") as store:
        results, _ = driven(plan_of(scene, ["exact"], [], 40), store, executor)
        assert [result.row().status for result in results] == ["ok"] * 40
        assert len(store.rows()) == 40
    assert sum(isinstance(task, MemberTask) for task in executor.tasks) == 2


def test_compiled_ends_that_differ_are_not_used(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = plan_of(scene, ["exact"], [], 6)
    compute = member_runs.run_members

    def almost(setup: Any, engine: str, settings: Any, members: Members) -> BoolArray:
        done = compute(setup, engine, settings, members)
        members.position[0, 0, 0] = np.nextafter(members.position[0, 0, 0], 1.0)
        return done

    task = plan.member_task(list(plan), END)
    assert all(isinstance(each, CompletedRun) for each in task.outcomes())
    monkeypatch.setattr(member_runs, "run_members", almost)
    first, *others = task.outcomes()
    assert isinstance(first, CompletedRun)
    assert others == [None] * 5


def test_tasks_are_bounded_and_shared_between_workers(scene: Path) -> None:
    executor = ScriptedExecutor(run_task)
    driven(plan_of(scene, ["exact"], [], 600), None, executor)
    sizes = [task.runs for task in executor.tasks]
    assert sum(sizes) == 600
    assert sizes[0] == 150  # of 600 on two workers, with one task that waits for each
    assert max(sizes) <= MAX_MEMBERS


SCENE = """
title = "Start states"
[world]
gravity = [0, -9.81]
seed = 3
{bounds}
[[plane]]
point = [0, -5]
normal = [0, 2]
[[ball]]
name = "a"
position = [0, 4]
radius = 0.5
[[ball]]
position = [3, 4]
velocity = [1, -0.0]
radius = 0.25
angle = 1
[[grid]]
origin = [-8, 8]
columns = 3
rows = 2
spacing = [1, 1]
jitter = 0.2
velocity_jitter = 0.5
radius = 0.1
[[scatter]]
lower = [5, 5]
upper = [9, 9]
count = 7
radius = 0.2
[[box]]
position = [12, 0]
size = [1, 1]
[[stack]]
base = [20, 0]
columns = 3
rows = 3
size = [0.5, 0.5]
jitter = 0.01
"""

COORDINATES = st.floats(-1e4, 1e4) | st.integers(-20, 20) | st.sampled_from([0.0, -0.0, 1e16, 2e16, 1e13, True, "x"])
PAIRS = st.lists(COORDINATES, min_size=2, max_size=2)
KEYS: dict[str, st.SearchStrategy[Any]] = {
    SEED: st.integers(0, 2**63) | st.just(-1) | st.just(1.5), "ball.a.position": PAIRS | st.just([1.0]),
    "ball.a.velocity": PAIRS | st.just(1.0), "ball.a.angle": COORDINATES, "ball.1.velocity": PAIRS,
    "ball.1.angular_velocity": COORDINATES | st.just([1.0, 2.0]),
}  # fmt: skip


@given(st.data())
def test_start_states_are_those_of_the_scenes(data: st.DataObject) -> None:
    keys = tuple(data.draw(st.lists(st.sampled_from(sorted(KEYS)), min_size=1, unique=True)))
    bounds = data.draw(st.sampled_from(["", "bounds = [[-10, -10], [30, 30]]"]))
    text = SCENE.format(bounds=bounds)
    points = [tuple((key, data.draw(KEYS[key])) for key in keys) for _ in range(3)]
    states = StartStates.of(loads(text), keys)
    members, valid = states.members(points)
    for m, point in enumerate(points):
        try:
            scene = loads(text, overrides=point)
        except SceneError:
            assert not valid[m]  # so that an ordinary run reports the faults
            continue
        if valid[m]:
            for name, column in members._asdict().items():
                assert column[m].tobytes() == getattr(scene.bodies, name).tobytes()
            assert states.scene_document(point) == to_document(scene)


def test_values_within_bounds_are_valid() -> None:
    states = StartStates.of(loads(SCENE.format(bounds="")), [SEED, "ball.a.position"])
    points = [((SEED, seed), ("ball.a.position", [0.1 * seed, 5])) for seed in range(20)]
    assert states.members(points)[1].all()
    assert len({states.members([point])[0].position.tobytes() for point in points}) == 20


def test_paths_of_start_values() -> None:
    assert all(map(is_start_key, KEYS))
    assert is_start_key('ball."8 ball".position')
    others = ["ball.*.velocity", "ball.a.mass", "ball.a.velocity.0", "box.a.position", "solver.dt", "world.gravity"]
    assert not any(map(is_start_key, [*others, "ball", 'ball."']))


def test_scenes_with_other_dependences_are_left_out() -> None:
    text = SCENE.format(bounds="")
    joint = '[[joint]]\nkind = "rod"\nbetween = ["a", "ball-2"]\n'
    emitter = "[[emitter]]\nposition = [0, 0]\ncount = 3\nvelocity_min = [0, 0]\nvelocity_max = [1, 1]\n"
    passing = '[[ball]]\nname = "ghost"\nposition = [0, 9]\nradius = 0.1\ncollides = "fixed"\n'
    crowd = "[[grid]]\norigin = [50, 50]\ncolumns = 20\nrows = 20\nspacing = [1, 1]\nradius = 0.1\n"
    for more in (joint, emitter, passing, crowd):
        assert StartStates.of(loads(text + more), [SEED]) is None
    fixed = text.replace('name = "a"', 'name = "a"\nfixed = true')
    assert StartStates.of(loads(fixed), ["ball.a.position"]) is None
    assert StartStates.of(loads(text), ["ball.b.position"]) is None
