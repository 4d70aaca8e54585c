"""Member runs: the rows of runs that are computed in one call are those of ordinary runs."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandbox.arrays import BoolArray
from sandbox.batch import member_runs
from sandbox.batch.driver import MAX_MEMBERS, Driver, Result
from sandbox.batch.executors import AnyTask, InProcessExecutor, JobOutcome, TaskLostError, run_task
from sandbox.batch.job import CompletedRun, RunOptions
from sandbox.batch.member_runs import MemberTask
from sandbox.batch.plan import Plan
from sandbox.batch.process_pool import ProcessExecutor
from sandbox.batch.store import Store
from sandbox.batch.stored_run import StoredRun
from sandbox.batch.sweep import SweepAxis, parse_sweep
from sandbox.engines.contract import Members
from sandbox.scene.errors import SceneError
from tests.batch.test_driver import ScriptedExecutor

BALLS = """
title = "Balls"
world = { gravity = [0, -9.81], duration = 0.4 }
solver = { dt = 0.01, record_every = 7 }
[[plane]]
point = [0, 0]
normal = [0, 1]
restitution = 0.7
friction = 0.3
[[ball]]
name = "a"
position = [0, 0.3]
velocity = [1, 0]
radius = 0.1
restitution = 0.9
[[grid]]
origin = [0.5, 0.2]
columns = 3
spacing = [0.3, 0.3]
jitter = 0.03
velocity_jitter = 1
radius = 0.1
"""

END = RunOptions(audit=False, keep="end")
ORDINARY = replace(END, time_limit=1e3)
"""A time limit lets the plan make ordinary runs only."""


def plan_of(
    path: Path, engines: list[str], sweeps: list[str], seeds: int | None = None, keeps_ends: bool = True
) -> Plan:
    axes = [SweepAxis.of(*parse_sweep(sweep)) for sweep in sweeps]
    plan = Plan([("balls", str(path))], engines, (), axes, seeds, keeps_ends=keeps_ends)
    plan.check()
    return plan


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "balls.toml"
    path.write_text(BALLS)
    return path


def driven(
    plan: Plan, store: Store | None, executor: Any = None, options: RunOptions = END
) -> tuple[list[Result], set[str]]:
    """Run a plan; return the results in its order, and the engines that computed members."""
    found: list[Result] = []
    computed: set[str] = set()
    executor = executor or InProcessExecutor()

    def note(_label: str, engine: str) -> None:
        computed.add(engine)

    Driver(plan, len(plan), executor, options, store, found.append, computed=note).run()
    assert sorted(result.index for result in found) == list(range(len(plan)))
    return sorted(found, key=lambda result: result.index), computed


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
    assert [result.row.id for result in members] == [result.row.id for result in ordinary]
    assert [result.row.set for result in members] == [result.row.set for result in ordinary]
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
        assert [result.record.repeated for result in results] == [True] * 10 + [False] * 20
        assert len(store.rows()) == 30
        more, _ = driven(
            plan_of(scene, ["exact"], [], 30, keeps_ends=False), store, options=replace(END, keep="summary")
        )
        assert not any(result.record.repeated for result in more)  # contacts are wanted now
        again, _ = driven(plan_of(scene, ["exact"], [], 30), store)
        assert all(result.record.repeated for result in again)
        assert {row.contacts is None for row in store.rows()} == {False}


def test_starts_that_an_engine_refuses_are_ordinary_runs(scene: Path, tmp_path: Path) -> None:
    sweeps = ["ball.a.position=[0,0.3],[0.1,0.3],[0.5,0.2],[0,0.4]"]  # the third is inside a ball of the grid
    plan = plan_of(scene, ["exact"], sweeps, 9)
    results, computed = driven(plan, None)
    statuses = [result.row.status for result in results]
    assert statuses == (["ok"] * 18 + ["refused"] * 9 + ["ok"] * 9)
    assert computed == {"exact"}


def test_faults_of_scenes_that_were_not_checked_are_reported(scene: Path) -> None:
    values = ",".join(f"[{k},0.3]" for k in range(1200)) + ",[0,-2000]"
    plan = plan_of(scene, ["exact"], [f"ball.a.position={values}"])
    faults: list[SceneError] = []
    results: list[Result] = []
    Driver(plan, 1201, InProcessExecutor(), END, None, results.append, faulty=faults.append).run()
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
        assert [result.row.status for result in results] == ["ok"] * 40
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
