"""Driver: what is run, grouped, tried again, stored and reported, on executors that lose tasks in every way."""

import random
from collections.abc import Callable
from concurrent.futures import Future
from operator import itemgetter
from pathlib import Path

import pytest

from sandbox.batch.driver import ATTEMPTS, Driver, JobError
from sandbox.batch.executors import (
    ExecutorError,
    JobFailure,
    JobOutcome,
    RunTask,
    TaskLostError,
    VersionMismatchError,
    run_task,
)
from sandbox.batch.job import CompletedRun, RunOptions, RunRecord, failed_run
from sandbox.batch.plan import Plan
from sandbox.batch.store import Store
from sandbox.batch.sweep import SweepAxis, parse_sweep
from sandbox.scene.errors import Fault, SceneError

SCENE = """
world = { duration = 0.05 }
ball = [{ name = "a", position = [0, 0], velocity = [1, 0], radius = 1 }]
"""

DEFAULT = RunOptions()
Answer = Callable[[RunTask], tuple[JobOutcome, ...]]


class ScriptedExecutor:
    """Executor that answers each task with a function, and notes the tasks."""

    def __init__(self, answer: Answer, slots: int = 2, is_remote: bool = True) -> None:
        self._answer, self.slots, self.is_remote = answer, slots, is_remote
        self.tasks: list[RunTask] = []
        self.is_shut_down = False

    def submit(self, task: RunTask) -> "Future[tuple[JobOutcome, ...]]":
        self.tasks.append(task)
        future: Future[tuple[JobOutcome, ...]] = Future()
        try:
            future.set_result(self._answer(task))
        except Exception as error:  # noqa: BLE001, the future carries it
            future.set_exception(error)
        return future

    def check(self) -> None:
        """Find nothing."""

    def shut_down(self) -> None:
        self.is_shut_down = True


@pytest.fixture
def plan(tmp_path: Path) -> Callable[[int], Plan]:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)

    def of(count: int) -> Plan:
        planned = Plan(
            [("scene", str(path))], ["pymunk"], (), [SweepAxis.of(*parse_sweep(f"ball.a.mass=1:{count}:{count}"))]
        )
        planned.check()
        return planned

    return of


def driven(
    plan: Plan, executor: ScriptedExecutor, store: Store | None = None, options: RunOptions = DEFAULT
) -> list[RunRecord]:
    """Run a plan, check that each of its runs is reported once, and return the results in the order of the plan."""
    found: list[tuple[int, RunRecord]] = []
    Driver(plan, len(plan), executor, options, store, lambda *each: found.append(each)).run()
    assert sorted(index for index, _ in found) == list(range(len(plan)))
    assert executor.is_shut_down
    return [record for _, record in sorted(found, key=itemgetter(0))]


def quick(task: RunTask) -> tuple[JobOutcome, ...]:
    """Return an outcome for each job without running it."""
    return tuple(completed(failed_run(job, "not run")) for job in task.jobs)


def completed(run: CompletedRun, elapsed: float = 1e-3) -> CompletedRun:
    return CompletedRun(run.stored, None, elapsed)


def mass_of(task: RunTask, k: int = 0) -> float:
    return task.jobs[k].scene.balls[0].mass or 0.0


@pytest.mark.fail_slow(60)  # takes over half a second
def test_short_jobs_are_grouped_and_long_ones_are_not(plan: Callable[[int], Plan]) -> None:
    executor = ScriptedExecutor(quick)
    driven(plan(1000), executor)
    sizes = [len(task.jobs) for task in executor.tasks]
    assert max(sizes) == 50  # of 1 ms, so that a task takes 50 ms
    assert sizes[-1] == 1  # both workers finish together
    long = ScriptedExecutor(lambda task: tuple(completed(failed_run(job, ""), 0.2) for job in task.jobs))
    driven(plan(20), long)
    assert {len(task.jobs) for task in long.tasks} == {1}
    local = ScriptedExecutor(quick, is_remote=False)
    driven(plan(20), local)
    assert {len(task.jobs) for task in local.tasks} == {1}


def test_lost_job_is_tried_again_and_then_recorded_as_failed(plan: Callable[[int], Plan], tmp_path: Path) -> None:
    def answer(task: RunTask) -> tuple[JobOutcome, ...]:
        at = next((k for k in range(len(task.jobs)) if mass_of(task, k) == 3.0), None)
        if at is None:
            return run_task(task)
        raise TaskLostError("the process was killed by SIGKILL", run_task(task)[:at], knows_job=True)

    executor = ScriptedExecutor(answer)
    with Store(tmp_path / "runs") as store:
        results = driven(plan(9), executor, store)
        assert [result.row().status for result in results] == ["ok", "ok", "failed", *["ok"] * 6]
        reason = results[2].row().reason or ""
        assert reason.startswith(f"the process was killed by SIGKILL, in the last of {ATTEMPTS} attempts")
        assert len(store.rows()) == 9
        assert sum(any(mass_of(task, k) == 3.0 for k in range(len(task.jobs))) for task in executor.tasks) == ATTEMPTS
        again = driven(plan(9), ScriptedExecutor(run_task), store)  # only the failed one is made again
        assert [result.row().repeated for result in again] == [True, True, False, *[True] * 6]
        assert {result.row().status for result in again} == {"ok"}


def test_job_that_hangs_is_recorded_as_failed_at_once(plan: Callable[[int], Plan]) -> None:
    def answer(task: RunTask) -> tuple[JobOutcome, ...]:
        if mass_of(task) == 3.0:
            raise TaskLostError("stopped at the time limit of 1 s", is_timeout=True, knows_job=True)
        return quick(task)

    executor = ScriptedExecutor(answer)
    results = driven(plan(4), executor, options=RunOptions(time_limit=1.0))
    assert results[2].row().reason == "stopped at the time limit of 1 s"
    assert len(executor.tasks) == 4


def test_group_that_is_lost_is_divided_to_find_the_job_at_fault(plan: Callable[[int], Plan]) -> None:
    """As a cluster loses it, which does not say which job was running."""

    def answer(task: RunTask) -> tuple[JobOutcome, ...]:
        if any(mass_of(task, k) == 77.0 for k in range(len(task.jobs))):
            raise TaskLostError("the workers that ran it died", is_final=True)
        return quick(task)

    executor = ScriptedExecutor(answer)
    results = driven(plan(100), executor)
    assert [k for k, result in enumerate(results) if result.row().reason != "not run"] == [76]
    assert results[76].row().reason == "the workers that ran it died"


@pytest.mark.parametrize("seed", range(5))
def test_every_run_is_reported_once_whatever_is_lost(seed: int, plan: Callable[[int], Plan]) -> None:
    rng = random.Random(seed)

    def answer(task: RunTask) -> tuple[JobOutcome, ...]:
        outcomes = quick(task)
        if rng.random() < 0.3:
            kept = rng.randrange(len(outcomes))
            raise TaskLostError("lost", outcomes[:kept], knows_job=True, is_timeout=rng.random() < 0.2)
        if rng.random() < 0.1:
            raise TaskLostError("lost", is_final=rng.random() < 0.5)
        return outcomes

    driven(plan(60), ScriptedExecutor(answer, slots=rng.choice([1, 2, 8])))


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (VersionMismatchError("pymunk 6 instead of 7"), "a worker has other versions.*pymunk 6 instead of 7"),
        (ModuleNotFoundError("No module named 'sandbox'"), "a worker cannot run tasks: ModuleNotFoundError"),
        (ExecutorError("the scheduler is lost"), "the scheduler is lost"),
    ],
)
def test_worker_that_cannot_run_anything_ends_the_batch(error, message, plan):
    def fail(_: RunTask) -> tuple[JobOutcome, ...]:
        raise error

    executor = ScriptedExecutor(fail)
    with pytest.raises(ExecutorError, match=message):
        Driver(plan(3), 3, executor, RunOptions(), None, lambda *_: None).run()
    assert executor.is_shut_down


def test_job_with_faults_ends_the_batch(plan: Callable[[int], Plan]) -> None:
    error = SceneError([Fault("a.toml", 1, "b", "c")])
    executor = ScriptedExecutor(lambda _: (JobFailure("a.toml:1: b: c", error),))
    with pytest.raises(JobError, match=r"scene: a\.toml:1: b: c"):
        Driver(plan(3), 3, executor, RunOptions(), None, lambda *_: None).run()


def test_interrupt_keeps_what_is_complete_and_shuts_the_executor_down(plan, tmp_path):
    found: list[RunRecord] = []

    def interrupt(_index: int, record: RunRecord) -> None:
        found.append(record)
        if len(found) == 3:
            raise KeyboardInterrupt

    executor = ScriptedExecutor(run_task)
    with Store(tmp_path / "runs") as store:
        with pytest.raises(KeyboardInterrupt):
            Driver(plan(9), 9, executor, RunOptions(), store, interrupt).run()
        assert executor.is_shut_down
        assert {row.id for row in store.rows()} == {result.row().id for result in found}
        assert sum(result.row().repeated for result in driven(plan(9), ScriptedExecutor(run_task), store)) == 3


def test_scene_with_faults_that_was_not_checked_is_reported_and_left_out(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    unchecked = Plan([("scene", str(path))], ["pymunk"], (), [SweepAxis.of(*parse_sweep("ball.a.mass=1,-1,2"))])
    found: dict[int, RunRecord] = {}
    faults: list[SceneError] = []
    Driver(unchecked, 3, ScriptedExecutor(quick), RunOptions(), None, found.__setitem__, faulty=faults.append).run()
    assert sorted(found) == [0, 2]
    assert "is -1" in str(faults[0])


def test_audit_of_a_stored_run_is_kept_when_the_run_is_replaced(plan: Callable[[int], Plan], tmp_path: Path) -> None:
    without = RunOptions(audit=False)
    with Store(tmp_path / "runs") as store:
        driven(plan(2), ScriptedExecutor(run_task), store)
        results = driven(plan(4), ScriptedExecutor(run_task), store, RunOptions(audit=False, ledger=True))
        assert [result.row().repeated for result in results] == [False] * 4
        assert [result.row().missed_contacts for result in results] == [0, 0, None, None]
        assert all(result.row().repeated for result in driven(plan(4), ScriptedExecutor(run_task), store, without))


def test_equal_runs_of_a_plan_are_made_once(tmp_path: Path) -> None:
    """Also if the second one comes while the first one is running."""
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    scenes = [("one", str(path)), ("other", str(path)), ("third", str(path))]
    planned = Plan(scenes, ["pymunk"], (), [SweepAxis.of(*parse_sweep("ball.a.mass=1,2"))])
    planned.check()
    executor = ScriptedExecutor(run_task, slots=8)
    with Store(tmp_path / "runs") as store:
        results = driven(planned, executor, store)
        assert [result.row().scene for result in results] == ["one", "one", "other", "other", "third", "third"]
        assert [result.row().repeated for result in results] == [False, False, True, True, True, True]
        assert len({result.row().id for result in results}) == len(store.rows()) == 2
    assert sum(len(task.jobs) for task in executor.tasks) == 2
