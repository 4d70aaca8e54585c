"""Driver: runs the jobs of a plan on an executor, and is the only one that writes to the store.

Jobs are looked up in the store first, then grouped into tasks of at least `TASK_TIME`, submitted as slots become free,
and stored as their outcomes arrive. A worker that dies or hangs costs its own run only: the run is tried again up to
`ATTEMPTS` times and then recorded as failed, with the reason; the next command tries it again.
"""

import math
import statistics
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from dataclasses import dataclass, replace

from sandbox.batch.executors import (
    Executor,
    ExecutorError,
    JobFailure,
    JobOutcome,
    RunTask,
    TaskLostError,
    VersionMismatchError,
)
from sandbox.batch.job import (
    CompletedRun,
    Job,
    RunOptions,
    RunRecord,
    failed_run,
    fetch,
    identify,
    is_sufficient,
    store_run,
    with_earlier_audit,
)
from sandbox.batch.plan import PlannedRun
from sandbox.batch.run_row import RunRow
from sandbox.batch.store import Store, StoreError
from sandbox.provenance import versions
from sandbox.resource_limits import TooLargeError
from sandbox.scene.errors import SceneError
from sandbox.signals import defer_interrupt

ATTEMPTS = 3
"""Attempts at a run whose worker dies: a cause that is not the run, such as an out-of-memory killer that ends any
process, seldom hits one run three times."""
TASK_TIME = 0.05
"""s that a task takes at least: many times as long as its messages."""
MAX_GROUP = 512
"""Jobs of a task"""
MAX_GROUP_BODIES = 20_000
"""Bodies of their scenes, about 10 MB of a message"""
MAX_TIMED = 9
"""Latest runs whose median time decides how many jobs make a task; the first one of a worker compiles"""
CHECK_INTERVAL = 1.0
"""s between two looks at the executor"""


class JobError(Exception):
    """A job cannot be run, which ends all others: its scene or game has faults, or the store cannot be used."""

    def __init__(self, label: str, error: Exception) -> None:
        super().__init__(f"{label}: {error}")
        self.label, self.error = label, error


@dataclass(frozen=True)
class Result:
    """A completed run of the plan."""

    index: int
    """in the order of the plan, from 0"""
    row: RunRow
    record: RunRecord | None = None
    """the run, if it was computed in this process or is stored"""


@dataclass
class _Attempt:
    """A job to be run, and what has happened to it."""

    index: int
    job: Job
    options: RunOptions
    damaged: str | None = None
    """fault of the stored run that it replaces"""
    deaths: int = 0
    """of workers that ran it"""
    is_suspect: bool = False
    """it was in a task that was lost, so it is run alone"""


class Driver:
    """Runs the jobs of a plan.

    Args:
        runs: the runs of the plan.
        count: their number, or an upper bound.
        executor: where they are run.
        options: how they are run.
        store: where they are looked up and stored.
        done: called in this thread with each result as it completes, in any order. It is a callback and not an iterator
            so that a run that is stored while Ctrl-C arrives is still reported.
        started: called with each job when it is submitted.
        faulty: called with the faults of a scene that was not checked before; default: they end the batch.
    """

    def __init__(
        self,
        runs: Iterable[PlannedRun],
        count: int,
        executor: Executor,
        options: RunOptions,
        store: Store | None,
        done: Callable[[Result], None],
        started: Callable[[Job], None] = lambda _: None,
        faulty: Callable[[SceneError], None] | None = None,
    ) -> None:
        self._runs, self._executor, self._options, self._store = enumerate(runs), executor, options, store
        self._done, self._started, self._faulty = done, started, faulty
        self._unseen = count
        """runs of the plan that were not looked up yet"""
        self._again: deque[_Attempt] = deque()
        self._pending: dict[Future[tuple[JobOutcome, ...]], list[_Attempt]] = {}
        self._times: deque[float] = deque(maxlen=MAX_TIMED)
        self._running: set[str] = set()
        """ids of the runs that were begun and are not stored yet"""
        self._equal: dict[str, list[tuple[int, PlannedRun]]] = {}
        """further planned runs with these ids, which are looked up again once the run is stored"""
        self._due: deque[tuple[int, PlannedRun]] = deque()
        """planned runs whose equal run has been stored"""

    def run(self) -> None:
        """Run all jobs.

        A run that fails by itself, or whose worker dies repeatedly, completes with the status `failed`.

        Raises:
            JobError: a job cannot be run. The jobs that have not completed are dropped.
            ExecutorError: no job can be run any more.
            KeyboardInterrupt: the jobs that have not completed are dropped.
        """
        is_complete = False
        try:
            while self._submit_tasks() or self._pending:
                completed, _ = wait(self._pending, CHECK_INTERVAL, FIRST_COMPLETED)
                for future in completed:
                    self._handle(future)
                self._executor.check()
            is_complete = True
        finally:
            if not is_complete:
                for future in self._pending:
                    future.cancel()
            with defer_interrupt():
                self._executor.shut_down()

    def _submit_tasks(self) -> bool:
        """Submit tasks until each slot has one that runs and one that waits; return whether any was submitted."""
        slots, before = self._executor.slots, len(self._pending)
        while len(self._pending) < (2 * slots if self._executor.is_remote else 1):
            group = self._next_group()
            if not group:
                break
            for each in group:
                self._started(each.job)
            task = RunTask(tuple(each.job for each in group), group[0].options, dict(versions()))
            self._pending[self._executor.submit(task)] = group
        return len(self._pending) > before

    def _next_group(self) -> list[_Attempt]:
        """Return the jobs of the next task, which are run with the same options; empty if there are none left."""
        group: list[_Attempt] = []
        for attempt in self._next_attempts():
            if group and (attempt.is_suspect or attempt.options != group[0].options):
                self._again.appendleft(attempt)
                break
            group.append(attempt)
            bodies = sum(len(each.job.scene.bodies) for each in group)
            is_full = len(group) >= self._group_size() or bodies > MAX_GROUP_BODIES
            if attempt.is_suspect or is_full:
                break
        return group

    def _group_size(self) -> int:
        """Return the number of jobs that take `TASK_TIME`; fewer at the end, so that all workers finish together."""
        slots = self._executor.slots
        if not (self._executor.is_remote and self._times):
            return 1
        size = math.ceil(TASK_TIME / max(statistics.median(self._times), 1e-6))
        return max(min(size, MAX_GROUP, math.ceil(self._unseen / (2 * slots))), 1)

    def _next_attempts(self) -> Iterator[_Attempt]:
        """Yield jobs that must be run; those that are stored are reported."""
        while self._again:
            yield self._again.popleft()
        while (item := self._next_planned()) is not None:
            index, planned = item
            try:
                attempt = self._looked_up(index, planned)
            except SceneError as error:
                if self._faulty is None:
                    raise JobError(planned.label, error) from error
                self._faulty(error)
                continue
            except (StoreError, TooLargeError) as error:
                raise JobError(planned.label, error) from error
            if attempt is not None:
                yield attempt

    def _next_planned(self) -> tuple[int, PlannedRun] | None:
        """Return the next planned run and its index; None if there are none left for now."""
        if self._due:
            return self._due.popleft()
        self._unseen = max(self._unseen - 1, 0)
        return next(self._runs, None)

    def _looked_up(self, index: int, planned: PlannedRun) -> _Attempt | None:
        """Return the job of a planned run, or report its stored run and return None."""
        store = self._store
        if store is None:
            return _Attempt(index, planned.job(), self._options)
        if planned.plan_key is not None:
            found = store.find_planned(planned.plan_key)
            if found is not None and is_sufficient(found, self._options) and store.fault_of_file(found) is None:
                file = store.file(found)
                self._report_stored(index, RunRecord(planned.label, planned.values, found, file, repeated=True))
                return None
        job = planned.job()
        run_id = identify(job)[1]
        if run_id in self._running:
            self._equal.setdefault(run_id, []).append((index, planned))
            return None
        job = replace(job, run_id=run_id)
        record = fetch(job, store, self._options)
        if isinstance(record, RunRecord):
            self._report_stored(index, record)
            return None
        self._running.add(run_id)
        return _Attempt(index, job, with_earlier_audit(job, store, self._options), record)

    def _report_stored(self, index: int, record: RunRecord) -> None:
        self._done(Result(index, record.row(self._options.final, self._options.ledger), record))

    def _handle(self, future: "Future[tuple[JobOutcome, ...]]") -> None:
        """Store the outcomes of a task, and queue what was lost again."""
        group = self._pending.pop(future)
        try:
            outcomes, lost = future.result(), None
        except TaskLostError as error:
            outcomes, lost = error.outcomes, error
        except VersionMismatchError as error:
            raise ExecutorError(
                f"a worker has other versions, so its runs would differ: {error}; install the same ones there"
            ) from None
        except ExecutorError:
            raise
        except CancelledError:
            raise ExecutorError("the tasks were cancelled") from None
        except Exception as error:
            raise ExecutorError(f"a worker cannot run tasks: {type(error).__name__}: {str(error)[:300]}") from error
        for attempt, outcome in zip(group, outcomes, strict=False):
            self._complete(attempt, outcome)
        if lost is not None:
            self._requeue(group[len(outcomes) :], lost)

    def _requeue(self, rest: list[_Attempt], lost: TaskLostError) -> None:
        """Queue the jobs of a lost task again, each in a task of its own if any of them may be the cause."""
        guilty = rest[0] if rest and (lost.knows_job or len(rest) == 1) else None
        for attempt in reversed(rest if guilty is None else rest[1:]):
            attempt.is_suspect |= guilty is None
            self._again.appendleft(attempt)
        if guilty is None:
            return
        guilty.deaths += 1
        guilty.is_suspect = True
        if lost.is_timeout or lost.is_final:
            self._store_run(guilty, failed_run(guilty.job, lost.reason))
        elif guilty.deaths < ATTEMPTS:
            self._again.appendleft(guilty)
        else:
            remedy = "; if memory is the cause, use fewer workers" if "SIGKILL" in lost.reason else ""
            reason = f"{lost.reason}, in the last of {ATTEMPTS} attempts{remedy}"
            self._store_run(guilty, failed_run(guilty.job, reason))

    def _complete(self, attempt: _Attempt, outcome: JobOutcome) -> None:
        if isinstance(outcome, CompletedRun):
            self._times.append(outcome.elapsed)
            self._store_run(attempt, outcome)
        elif isinstance(outcome, JobFailure) and outcome.error is not None:
            raise JobError(attempt.job.label, outcome.error)
        else:
            self._store_run(attempt, failed_run(attempt.job, outcome.reason))

    def _store_run(self, attempt: _Attempt, completed: CompletedRun) -> None:
        """Store a run and report it; no interrupt comes between the two."""
        with defer_interrupt():
            if self._store is None:
                stored, run = completed.stored, completed.trajectory
                record = RunRecord.of(attempt.job, stored, None, repeated=False, computed=run)
            else:
                try:
                    record = store_run(self._store, attempt.job, completed, attempt.damaged)
                except StoreError as error:
                    raise JobError(attempt.job.label, error) from error
            if attempt.job.run_id is not None:
                self._running.discard(attempt.job.run_id)
                self._due.extend(self._equal.pop(attempt.job.run_id, ()))
            row = record.row(self._options.final, self._options.ledger)
            self._done(Result(attempt.index, row, record if completed.trajectory is not None else None))
