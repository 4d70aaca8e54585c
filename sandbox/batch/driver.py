"""Driver: runs the jobs of a plan on an executor, and is the only one that writes to the store.

Runs are looked up in the store first, then grouped into tasks of at least `TASK_TIME`, submitted as slots become free,
and stored as their outcomes arrive. Runs of one family (`PlannedRun.family`) are members of one task, which many
engines compute in one call; the members that are not computed so are queued again as ordinary runs.

A worker that dies or hangs costs its own run only: the run is tried again up to `ATTEMPTS` times and then recorded as
failed, with the reason; the next command tries it again.
"""

import math
import statistics
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from dataclasses import dataclass, field, replace
from functools import cached_property

from sandbox.batch.executors import (
    AnyTask,
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
from sandbox.batch.plan import Plan, PlannedRun
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
MAX_MEMBERS, MIN_MEMBERS = 512, 32
"""Runs of a member task"""
MAX_FAMILIES = 16
"""Families whose runs are collected at the same time"""
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
    record: RunRecord
    options: RunOptions

    @cached_property
    def row(self) -> RunRow:
        """Figures of the run; made when they are first asked for, which takes as long as storing a row."""
        return self.record.row(self.options.final, self.options.ledger)


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


@dataclass
class _MemberGroup:
    """Runs of one family that become members of one task, with their indices in the plan."""

    runs: list[tuple[int, PlannedRun]] = field(default_factory=list)


class Driver:
    """Runs the jobs of a plan.

    Args:
        plan: the runs.
        count: their number, or an upper bound.
        executor: where they are run.
        options: how they are run.
        store: where they are looked up and stored.
        done: called in this thread with each result as it completes, in any order. It is a callback and not an iterator
            so that a run that is stored while Ctrl-C arrives is still reported.
        started: called with the label of each run when it is submitted.
        faulty: called with the faults of a scene that was not checked before; default: they end the batch.
        computed: called with the label and the engine of each family that an engine computes in one call.
    """

    def __init__(
        self,
        plan: Plan,
        count: int,
        executor: Executor,
        options: RunOptions,
        store: Store | None,
        done: Callable[[Result], None],
        started: Callable[[str], None] = lambda _: None,
        faulty: Callable[[SceneError], None] | None = None,
        computed: Callable[[str, str], None] = lambda _label, _engine: None,
    ) -> None:
        self._plan, self._runs = plan, enumerate(plan)
        self._executor, self._options, self._store = executor, options, store
        self._done, self._started, self._faulty, self._computed = done, started, faulty, computed
        self._unseen = count
        """runs of the plan that were not looked up yet"""
        self._again: deque[_Attempt] = deque()
        self._pending: dict[Future[tuple[JobOutcome, ...]], list[_Attempt] | _MemberGroup] = {}
        self._families: dict[str, _MemberGroup] = {}
        """members that wait for their task, by family"""
        self._ordinary_families: set[str] = set()
        """families whose runs are ordinary ones, because their members were not computed in one call"""
        self._times: deque[float] = deque(maxlen=MAX_TIMED)
        self._running: set[str] = set()
        """ids of the runs that were begun and are not stored yet"""
        self._equal: dict[str, list[tuple[int, PlannedRun]]] = {}
        """further planned runs with these ids, which are looked up again once the run is stored"""
        self._due: deque[tuple[int, PlannedRun]] = deque()
        """planned runs whose equal run has been stored, and members that become ordinary runs"""
        self._full_groups: deque[_MemberGroup] = deque()
        """members whose task is submitted next"""

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
            task: AnyTask
            if isinstance(group, _MemberGroup):
                self._started(group.runs[0][1].label)
                task = self._plan.member_task([planned for _, planned in group.runs], self._options)
            else:
                for each in group:
                    self._started(each.job.label)
                task = RunTask(tuple(each.job for each in group), group[0].options, dict(versions()))
            self._pending[self._executor.submit(task)] = group
        return len(self._pending) > before

    def _next_group(self) -> list[_Attempt] | _MemberGroup | None:
        """Return the runs of the next task; None if there are none left.

        Those of a list are run with the same options.
        """
        group: list[_Attempt] = []
        for attempt in self._next_attempts():
            if isinstance(attempt, _MemberGroup):
                if group:
                    self._full_groups.append(attempt)
                    break
                return attempt
            if group and (attempt.is_suspect or attempt.options != group[0].options):
                self._again.appendleft(attempt)
                break
            group.append(attempt)
            bodies = sum(len(each.job.scene.bodies) for each in group)
            is_full = len(group) >= self._group_size() or bodies > MAX_GROUP_BODIES
            if attempt.is_suspect or is_full:
                break
        return group or None

    def _group_size(self) -> int:
        """Return the number of jobs that take `TASK_TIME`; fewer at the end, so that all workers finish together."""
        slots = self._executor.slots
        if not (self._executor.is_remote and self._times):
            return 1
        size = math.ceil(TASK_TIME / max(statistics.median(self._times), 1e-6))
        return max(min(size, MAX_GROUP, math.ceil(self._unseen / (2 * slots))), 1)

    def _next_attempts(self) -> Iterator[_Attempt | _MemberGroup]:
        """Yield runs that must be made, members in full groups; runs that are stored are reported."""
        while self._full_groups:
            yield self._full_groups.popleft()
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
        while self._families:  # the plan has ended
            yield self._families.pop(next(iter(self._families)))

    def _next_planned(self) -> tuple[int, PlannedRun] | None:
        """Return the next planned run and its index; None if there are none left for now."""
        if self._due:
            return self._due.popleft()
        self._unseen = max(self._unseen - 1, 0)
        return next(self._runs, None)

    def _looked_up(self, index: int, planned: PlannedRun) -> _Attempt | _MemberGroup | None:
        """Return a planned run that must be made, as a job or in a full group of members.

        None if it is stored, which is reported, if an equal run is running, or if its group is not full yet.
        """
        store = self._store
        if store is not None and planned.plan_key is not None:
            found = store.find_planned(planned.plan_key)
            if found is not None and is_sufficient(found, self._options) and store.fault_of_file(found) is None:
                file = store.file(found)
                self._report_stored(index, RunRecord(planned.label, planned.values, found, file, repeated=True))
                return None
        if planned.family is not None and planned.family not in self._ordinary_families:
            return self._collected(index, planned, planned.family)
        if store is None:
            return _Attempt(index, planned.job(), self._options)
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

    def _collected(self, index: int, planned: PlannedRun, family: str) -> _MemberGroup | None:
        """Add a run to the members of its family, and return a group that is full or has waited for long."""
        group = self._families.setdefault(family, _MemberGroup())
        group.runs.append((index, planned))
        left = (self._unseen + len(group.runs)) / (2 * self._executor.slots)
        if len(group.runs) >= max(min(math.ceil(left), MAX_MEMBERS), MIN_MEMBERS):
            return self._families.pop(family)
        if len(self._families) > MAX_FAMILIES:
            return self._families.pop(next(iter(self._families)))
        return None

    def _report_stored(self, index: int, record: RunRecord) -> None:
        self._done(Result(index, record, self._options))

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
        if isinstance(group, _MemberGroup):
            self._complete_members(group, outcomes, is_lost=lost is not None)
            return
        for attempt, outcome in zip(group, outcomes, strict=False):
            assert outcome is not None
            self._complete(attempt, outcome)
        if lost is not None:
            self._requeue(group[len(outcomes) :], lost)

    def _complete_members(self, group: _MemberGroup, outcomes: tuple[JobOutcome, ...], is_lost: bool) -> None:
        """Store the members of a task that were computed, and queue the others as ordinary runs."""
        family, first = group.runs[0][1].family, group.runs[0][1]
        assert family is not None
        completed = [
            (index, planned, outcome)
            for (index, planned), outcome in zip(group.runs, outcomes, strict=False)
            if isinstance(outcome, CompletedRun)
        ]
        with defer_interrupt():
            if self._store is not None:
                try:
                    self._store.add_rows([(run.stored, dict(planned.values)) for _, planned, run in completed])
                except StoreError as error:
                    raise JobError(first.label, error) from error
            for index, planned, run in completed:
                record = RunRecord(planned.label, planned.values, run.stored, None, repeated=False)
                self._done(Result(index, record, self._options))
        if len(completed) > 1:
            self._computed(first.label, first.engine)
        elif not is_lost and len(group.runs) > 1:
            self._ordinary_families.add(family)
        done = {index for index, _, _ in completed}
        self._due.extend((index, replace(planned, family=None)) for index, planned in group.runs if index not in done)

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

    def _complete(self, attempt: _Attempt, outcome: CompletedRun | JobFailure) -> None:
        if isinstance(outcome, CompletedRun):
            self._times.append(outcome.elapsed)
            self._store_run(attempt, outcome)
        elif outcome.error is not None:
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
            self._done(Result(attempt.index, record, self._options))
