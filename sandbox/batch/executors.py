"""Executors: where tasks are run. In this process, in worker processes (`process_pool`), on a cluster (`cluster`).

A task is a few jobs, so that each takes long enough to be worth a message. `submit(task)` returns a future of
`concurrent.futures` with the outcome of each job; outcomes do not depend on the executor, bit for bit.
"""

import traceback
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

from sandbox.batch.job import CompletedRun, Job, RunOptions, run_job
from sandbox.batch.member_runs import MemberTask
from sandbox.batch.observables import ObservableError
from sandbox.provenance import versions
from sandbox.resource_limits import TooLargeError
from sandbox.scene.errors import SceneError


class ExecutorError(RuntimeError):
    """An executor cannot run tasks at all; `str()` has the cause."""


class TaskLostError(Exception):
    """A task has ended without all of its outcomes: its process died, or did not answer within the time limit."""

    def __init__(
        self,
        reason: str,
        outcomes: "tuple[JobOutcome, ...]" = (),
        *,
        is_timeout: bool = False,
        knows_job: bool = False,
        is_final: bool = False,
        was_killed: bool = False,
    ) -> None:
        """Describe the loss.

        Args:
            reason: how the task ended.
            outcomes: of its first jobs, which were completed.
            is_timeout: the time limit was exceeded.
            knows_job: the job after the outcomes was running; otherwise any of the others was.
            is_final: the executor has tried the task several times.
            was_killed: SIGKILL ended the process, as it does where memory is short.
        """
        super().__init__(reason)
        self.reason, self.outcomes, self.knows_job = reason, outcomes, knows_job
        self.is_timeout, self.is_final, self.was_killed = is_timeout, is_final, was_killed


class VersionMismatchError(Exception):
    """A worker has other versions than this process, so its runs would not be those that the plan names."""

    def __init__(self, differences: str) -> None:
        super().__init__(differences)
        self.differences = differences


@dataclass(frozen=True)
class RunTask:
    """Jobs that one worker runs, one after the other. Picklable."""

    jobs: tuple[Job, ...]
    options: RunOptions
    versions: Mapping[str, str]
    """of the process that submits the task"""

    @property
    def runs(self) -> int:
        """Number of runs."""
        return len(self.jobs)

    def outcomes(self) -> "Iterator[JobOutcome]":
        """Run the jobs, and yield the outcome of each."""
        for job in self.jobs:
            yield _outcome(job, self.options)


@dataclass(frozen=True)
class JobFailure:
    """A job that could not be run."""

    reason: str
    error: SceneError | ObservableError | None = None
    """faults of the job or its observable: no attempt can succeed"""


JobOutcome = CompletedRun | JobFailure | None
"""None for a member of a task that must be run as a job of its own."""
AnyTask = RunTask | MemberTask


class Executor(Protocol):
    """Runs tasks. Tasks and outcomes travel by value, so an executor may use other processes or other machines."""

    @property
    def slots(self) -> int:
        """Number of tasks that run at the same time."""
        ...

    @property
    def is_remote(self) -> bool:
        """Whether tasks run elsewhere, so that it pays to group jobs and to queue tasks ahead."""
        ...

    def submit(self, task: AnyTask) -> "Future[tuple[JobOutcome, ...]]":
        """Queue a task.

        Returns:
            The outcome of each job. Its exception is `TaskLostError`, `VersionMismatchError` or `ExecutorError`.
        """
        ...

    def check(self) -> None:
        """Look after the tasks; called about once a second.

        Raises:
            ExecutorError: no task can be run any more.
        """
        ...

    def shut_down(self) -> None:
        """Drop all tasks, and end the workers that the executor has started."""
        ...


class InProcessExecutor:
    """Runs each task in this process, when it is submitted.

    Args:
        progress: called with the fraction of the run that is done.
    """

    slots = 1
    is_remote = False

    def __init__(self, progress: Callable[[float], None] | None = None) -> None:
        self._progress = progress

    def submit(self, task: AnyTask) -> "Future[tuple[JobOutcome, ...]]":
        """Run a task."""
        future: Future[tuple[JobOutcome, ...]] = Future()
        if isinstance(task, MemberTask):
            future.set_result(tuple(task.outcomes()))
        else:
            future.set_result(tuple(self._run(job, task.options) for job in task.jobs))
        return future

    def _run(self, job: Job, options: RunOptions) -> JobOutcome:
        try:
            return run_job(job, options, self._progress)
        except (SceneError, ObservableError) as error:
            return JobFailure(str(error), error)
        except TooLargeError as error:
            return JobFailure(str(error))

    def check(self) -> None:
        """Do nothing: no task is running."""

    def shut_down(self) -> None:
        """Do nothing: no task is running."""


def run_task(task: AnyTask) -> tuple[JobOutcome, ...]:
    """Run a task in a worker, and return its outcomes.

    Raises:
        VersionMismatchError: this worker has other versions.
    """
    return tuple(outcomes_of(task))


def outcomes_of(task: AnyTask) -> Iterator[JobOutcome]:
    """Yield the outcome of each run of a task in a worker.

    Raises:
        VersionMismatchError: this worker has other versions.
    """
    differences = version_differences(task.versions)
    if differences:
        raise VersionMismatchError(differences)
    yield from task.outcomes()


def _outcome(job: Job, options: RunOptions) -> JobOutcome:
    try:
        return replace(run_job(job, options), trajectory=None)
    except (SceneError, ObservableError) as error:
        return JobFailure(str(error), error)
    except TooLargeError as error:
        return JobFailure(str(error))
    except MemoryError:
        return JobFailure("out of memory; use fewer workers")
    except Exception as error:  # noqa: BLE001, the driver reports it with the run
        return JobFailure(_located(error))


def version_differences(wanted: Mapping[str, str]) -> str:
    """Return the versions of this process that differ from the wanted ones; empty if none do."""
    own = versions()
    names = [name for name in {**wanted, **own} if wanted.get(name) != own.get(name)]
    return ", ".join(f"{name} {own.get(name, 'missing')} instead of {wanted.get(name, 'none')}" for name in names)


def mismatch_text(differences: str) -> str:
    """Return the message about a worker with other versions, from these differences."""
    return f"a worker has other versions, so its runs would differ: {differences}; install the same ones there"


def _located(error: Exception) -> str:
    """Return an internal error in one line, with the line of code that raised it."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    where = f"{Path(frame.filename).name}:{frame.lineno}"
    return f"internal error: {type(error).__name__} in {where}: {str(error)[:200]}; run with --workers 1 to see more"


def hang_time(limit: float) -> float:
    """Return the time without an answer after which a worker hangs, s: a run that is stopped by itself is earlier.

    Args:
        limit: time limit of a run, s.
    """
    return 2.0 * limit + COMPILING


COMPILING = 60.0
"""s, more than the compilation of all kernels takes, which does not count towards the time limit"""
