"""Executors: the same outcomes from each; workers that die, hang, cannot start or have other versions."""

import os
import pickle
import signal
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import Any, NoReturn

import pytest

from sandbox.batch import executors, process_pool
from sandbox.batch.executors import (
    Executor,
    ExecutorError,
    InProcessExecutor,
    JobFailure,
    JobOutcome,
    RunTask,
    TaskLostError,
    VersionMismatchError,
    run_task,
)
from sandbox.batch.job import CompletedRun, Job, RunOptions
from sandbox.batch.process_pool import ProcessExecutor
from sandbox.batch.store import StoreError
from sandbox.batch.stored_run import StoredRun
from sandbox.provenance import versions
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import loads

DROP = """
[world]
gravity = [0.0, -10.0]
duration = 0.05
[[ball]]
name = "a"
position = [0, {height}]
radius = 1
"""
LARGE = 10_000_000
"""Bytes of a message, far more than the buffer of a pipe"""


def jobs(count: int) -> list[Job]:
    return [Job(f"drop {k}", loads(DROP.format(height=k)), "pymunk") for k in range(count)]


def task_of(*submitted: Job, **options: Any) -> RunTask:
    return RunTask(submitted, RunOptions(**options), dict(versions()))


def reproducible(stored: StoredRun) -> StoredRun:
    """Return a row without the figures that depend on the machine and on the time."""
    return replace(stored, seconds=None, created="")


@contextmanager
def pool(workers: int = 1) -> Iterator[ProcessExecutor]:
    executor = ProcessExecutor(workers)
    try:
        yield executor
    finally:
        executor.shut_down()


def completed(future: "Future[tuple[JobOutcome, ...]]") -> list[CompletedRun]:
    outcomes = future.result(120)
    assert all(isinstance(each, CompletedRun) for each in outcomes)
    return [each for each in outcomes if isinstance(each, CompletedRun)]


@pytest.mark.fail_slow(60)  # takes over half a second
def test_worker_processes_have_the_outcomes_of_this_process() -> None:
    submitted = jobs(6)
    here = completed(InProcessExecutor().submit(task_of(*submitted)))
    with pool(2) as executor:
        futures = [executor.submit(task_of(*submitted[k : k + 2])) for k in (0, 2, 4)]
        there = [each for future in futures for each in completed(future)]
    for one, other in zip(here, there, strict=True):
        assert reproducible(one.stored) == reproducible(other.stored)
        assert one.trajectory is not None
        assert other.trajectory is None
        assert one.arrays is not None and other.arrays is not None
    assert {each.stored.scene for each in there} == {job.label for job in submitted}


def test_tasks_and_outcomes_can_be_pickled() -> None:
    (job,) = jobs(1)
    (outcome,) = run_task(task_of(job))
    errors = (StoreError("a: b"), SceneError([Fault("a.toml", 3, "ball.a", "is none")]))
    lost = TaskLostError("a", (outcome,), knows_job=True)
    for value in (task_of(job), outcome, lost, JobFailure("b"), *errors):
        again = pickle.loads(pickle.dumps(value))
        assert vars(again) == vars(value) if isinstance(value, Exception) else again == value


def test_progress_of_a_run_in_this_process_ends_at_one() -> None:
    fractions: list[float] = []
    InProcessExecutor(fractions.append).submit(task_of(*jobs(1))).result()
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0


def test_worker_with_other_versions_runs_nothing() -> None:
    task = RunTask(tuple(jobs(1)), RunOptions(), {**versions(), "pymunk": "0.1"})
    with pytest.raises(VersionMismatchError, match=r"pymunk .* instead of 0\.1"):
        run_task(task)


def test_job_with_faults_is_a_failure_with_its_error(monkeypatch: pytest.MonkeyPatch) -> None:
    error = SceneError([Fault("a.toml", 1, "b", "c")])

    def fail(*_: object) -> NoReturn:
        raise error

    monkeypatch.setattr(executors, "run_job", fail)
    for outcomes in (run_task(task_of(*jobs(1))), InProcessExecutor().submit(task_of(*jobs(1))).result()):
        assert outcomes == (JobFailure("a.toml:1: b: c", error),)


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (MemoryError(), "out of memory; use fewer workers"),
        (ZeroDivisionError("division"), "internal error: ZeroDivisionError in test_executors.py:"),
    ],
)
def test_job_that_raises_is_a_failure_with_the_reason(error, reason, monkeypatch):
    def fail(job: Job, *_: object) -> Any:
        if job.label == "drop 1":
            raise error
        return run(job)

    run = executors.run_job
    monkeypatch.setattr(executors, "run_job", fail)
    first, second, third = run_task(task_of(*jobs(3)))
    assert isinstance(first, CompletedRun)
    assert isinstance(third, CompletedRun)
    assert isinstance(second, JobFailure)
    assert second.error is None
    assert second.reason.startswith(reason)


def test_process_that_cannot_be_started_raises_executor_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def start(_: SpawnProcess) -> NoReturn:
        raise OSError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(SpawnProcess, "start", start)
    with pool(2) as executor, pytest.raises(ExecutorError, match="Resource temporarily unavailable"):
        executor.submit(task_of(*jobs(1))).result(60)


@pytest.mark.fail_slow(60)  # takes over half a second
def test_process_that_ends_at_its_start_raises_executor_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process_pool, "serve", end_at_once)
    with pool() as executor, pytest.raises(ExecutorError, match="ended with status 3"):
        executor.submit(task_of(*jobs(1))).result(120)


def end_at_once(_: object) -> NoReturn:
    os._exit(3)


@pytest.mark.fail_slow(60)  # takes over half a second
def test_fewer_workers_run_where_no_more_can_be_started(monkeypatch: pytest.MonkeyPatch) -> None:
    start, started = SpawnProcess.start, list[SpawnProcess]()

    def start_one(process: SpawnProcess) -> None:
        if started:
            raise OSError(12, "Cannot allocate memory")
        started.append(process)
        start(process)

    monkeypatch.setattr(SpawnProcess, "start", start_one)
    with pool(3) as executor:
        first = executor.submit(task_of(*jobs(1)))
        completed(first)  # the first worker is ready
        futures = [executor.submit(task_of(job)) for job in jobs(4)]
        assert len([each for future in futures for each in completed(future)]) == 4
        assert executor.slots < 3


@pytest.mark.fail_slow(60)  # takes over half a second
def test_killed_worker_loses_the_job_that_it_ran(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process_pool, "serve", partial(serve_with, die_at_drop_1))
    with pool() as executor:
        lost = executor.submit(task_of(*jobs(3))).exception(120)
        assert isinstance(lost, TaskLostError)
        assert (lost.reason, lost.knows_job, lost.is_timeout) == ("the process was killed by SIGKILL", True, False)
        assert len(lost.outcomes) == 1  # that of the job before
        assert len(completed(executor.submit(task_of(jobs(1)[0])))) == 1  # in another process


def serve_with(replacement: Callable[..., Any], pipe: Any) -> None:
    """Serve as a worker in which `run_job` is replaced."""
    executors.run_job = partial(replacement, executors.run_job)
    process_pool.serve(pipe)


def die_at_drop_1(run: Callable[..., CompletedRun], job: Job, *more: Any) -> CompletedRun:
    if job.label == "drop 1":
        os.kill(os.getpid(), signal.SIGKILL)
    return run(job, *more)


@pytest.mark.fail_slow(60)  # takes over half a second
def test_worker_that_hangs_is_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process_pool, "serve", partial(serve_with, hang_at_drop_1))
    monkeypatch.setattr(executors, "COMPILING", 20.0)
    with pool() as executor:
        lost = executor.submit(task_of(*jobs(3), time_limit=0.5)).exception(120)
        assert isinstance(lost, TaskLostError)
        assert (lost.reason, lost.is_timeout, len(lost.outcomes)) == ("stopped at the time limit of 0.5 s", True, 1)
        assert len(completed(executor.submit(task_of(jobs(1)[0])))) == 1


def hang_at_drop_1(run: Callable[..., CompletedRun], job: Job, *more: Any) -> CompletedRun:
    while job.label == "drop 1":
        time.sleep(1.0)
    return run(job, *more)


@pytest.mark.fail_slow(60)  # takes over half a second
def test_worker_killed_while_it_sends_an_outcome_does_not_block_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process_pool, "serve", partial(serve_with, large_run))
    with pool(2) as executor:
        futures = [executor.submit(task_of(job)) for job in jobs(3)]
        lost = futures[1].exception(120)
        assert isinstance(lost, TaskLostError)
        assert "SIGKILL" in lost.reason
        assert [len(each.stored.reason or "") for k in (0, 2) for each in completed(futures[k])] == [LARGE] * 2


def large_run(run: Callable[..., CompletedRun], job: Job, *more: Any) -> CompletedRun:
    """Return a run that takes long to send; that of the second job kills its process in the middle of the message."""
    found = run(job, *more)
    if job.label == "drop 1":
        Connection._send = send_half  # type: ignore[method-assign]
    return replace(found, stored=replace(found.stored, reason=" " * LARGE))


def send_half(pipe: Connection, data: Any, write: Callable[[int, Any], int] = os.write) -> None:
    half = memoryview(data)[: len(data) // 2] if len(data) > LARGE // 2 else memoryview(data)
    while half:
        half = half[write(pipe.fileno(), half) :]
    if len(data) > LARGE // 2:
        os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.fail_slow(60)  # takes over half a second
def test_shut_down_ends_workers_in_the_middle_of_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process_pool, "serve", partial(serve_with, hang_at_drop_1))
    with pool() as executor:
        running = executor.submit(task_of(*jobs(2)))
        time.sleep(1.0)
    assert isinstance(running.exception(60), TaskLostError)


def test_executors_have_the_members_of_the_protocol() -> None:
    found: list[Executor] = [InProcessExecutor(), ProcessExecutor(3)]
    assert [(each.slots, each.is_remote) for each in found] == [(1, False), (3, True)]
