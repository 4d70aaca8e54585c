"""Driver: runs the jobs of a plan on an executor, and is the only one that writes to the store.

Runs are looked up in the store first, then grouped into tasks of at least `TASK_TIME`, submitted as slots become free,
and stored as their outcomes arrive. Runs of one family (`PlannedRun.family`) are members of one task, which many
engines compute in one call.

A run is in one state at a time:

    planned    in the queue, or not taken from the plan yet
      → done       it is stored
      → waiting    an equal run is ready or submitted
      → collected  it has a family
      → ready      otherwise
    waiting    behind the equal run
      → planned    that is done
    collected  among the members of its family
      → submitted  they are enough for a task
    ready      in the queue, with its job
      → submitted  it is its turn
    submitted  in a pending task
      → done       its outcome has arrived
      → ready      the task was lost, and it has been tried less than `ATTEMPTS` times
      → planned    without its family: it is a member that was not computed
    done       reported, and stored if there is a store

A worker that dies or hangs costs its own run only: the run is tried again up to `ATTEMPTS` times and then recorded as
failed, with the reason; the next command tries it again.
"""

import math
import statistics
from collections import deque
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from dataclasses import dataclass, replace

from sandbox.batch.executors import (
    AnyTask,
    Executor,
    ExecutorError,
    JobFailure,
    JobOutcome,
    RunTask,
    TaskLostError,
    VersionMismatchError,
    mismatch_text,
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
from sandbox.batch.observables import ObservableError
from sandbox.batch.plan import Plan, PlannedRun
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


@dataclass
class _Run:
    """A planned run, and what has happened to it."""

    index: int
    """in the order of the plan, from 0"""
    planned: PlannedRun
    family: str | None = None
    """family of the planned run, unless it is an ordinary run"""
    job: Job | None = None
    """what is to be run, once it is ready"""
    options: RunOptions | None = None
    """how it is run, once it is ready"""
    damaged: str | None = None
    """fault of the stored run that it replaces"""
    deaths: int = 0
    """of workers that ran it"""
    is_suspect: bool = False
    """it was in a task that was lost, so it is run alone"""

    @property
    def label(self) -> str:
        """The scene as the user named it."""
        return self.planned.label


@dataclass
class _Members:
    """Runs of one family that are the members of one task."""

    runs: list[_Run]


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
        done: Callable[[int, RunRecord], None],
        started: Callable[[str], None] = lambda _: None,
        faulty: Callable[[SceneError], None] | None = None,
        computed: Callable[[str, str], None] = lambda _label, _engine: None,
    ) -> None:
        self._plan, self._runs = plan, enumerate(plan)
        self._executor, self._options, self._store = executor, options, store
        self._done, self._started, self._faulty, self._computed = done, started, faulty, computed
        self._unseen = count
        """runs of the plan that were not looked up yet"""
        self._queue: deque[_Run | _Members] = deque()
        """planned and ready runs, and members whose task is submitted next, before those of the plan"""
        self._pending: dict[Future[tuple[JobOutcome, ...]], list[_Run] | _Members] = {}
        """submitted runs by their task"""
        self._waiting: dict[str, list[_Run]] = {}
        """runs that wait, by the id of the equal run that is ready or submitted"""
        self._families: dict[str, _Members] = {}
        """collected runs"""
        self._ordinary_families: set[str] = set()
        """families whose runs are ordinary ones, because their members were not computed in one call"""
        self._times: deque[float] = deque(maxlen=MAX_TIMED)

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
            if group is None:
                break
            self._pending[self._executor.submit(self._task(group))] = group
        return len(self._pending) > before

    def _task(self, group: list[_Run] | _Members) -> AnyTask:
        """Return the task of some runs, and announce them."""
        if isinstance(group, _Members):
            self._started(group.runs[0].label)
            return self._plan.member_task([each.planned for each in group.runs], self._options)
        for each in group:
            self._started(each.label)
        jobs = tuple(each.job for each in group if each.job is not None)
        return RunTask(jobs, group[0].options or self._options, dict(versions()))

    def _next_group(self) -> list[_Run] | _Members | None:
        """Return the runs of the next task; None if there are none left. Those of a list have the same options."""
        group: list[_Run] = []
        bodies = 0
        while (ready := self._next_ready()) is not None:
            if isinstance(ready, _Members):
                if not group:
                    return ready
                self._queue.appendleft(ready)
                break
            if group and (ready.is_suspect or ready.options != group[0].options):
                self._queue.appendleft(ready)
                break
            assert ready.job is not None
            group.append(ready)
            bodies += len(ready.job.scene.bodies)
            if ready.is_suspect or len(group) >= self._group_size() or bodies > MAX_GROUP_BODIES:
                break
        return group or None

    def _group_size(self) -> int:
        """Return the number of jobs that take `TASK_TIME`; fewer at the end, so that all workers finish together."""
        slots = self._executor.slots
        if not (self._executor.is_remote and self._times):
            return 1
        size = math.ceil(TASK_TIME / max(statistics.median(self._times), 1e-6))
        return max(min(size, MAX_GROUP, math.ceil(self._unseen / (2 * slots))), 1)

    def _next_ready(self) -> _Run | _Members | None:
        """Return the next run that is ready, or the members of a task; None if there are none left for now.

        Runs on the way to it are looked up: those that are stored are reported, others wait or are collected.
        """
        while (each := self._next_queued()) is not None:
            if isinstance(each, _Members) or each.job is not None:
                return each
            try:
                ready = self._looked_up(each)
            except SceneError as error:
                if self._faulty is None:
                    raise JobError(each.label, error) from error
                self._faulty(error)
                continue
            except (StoreError, TooLargeError, ObservableError) as error:
                raise JobError(each.label, error) from error
            if ready is not None:
                return ready
        return None

    def _next_queued(self) -> _Run | _Members | None:
        """Return the next of the queue, else of the plan, else members that were too few for a task before."""
        if self._queue:
            return self._queue.popleft()
        self._unseen = max(self._unseen - 1, 0)
        if (item := next(self._runs, None)) is not None:
            return _Run(*item, family=item[1].family)
        return self._families.pop(next(iter(self._families))) if self._families else None

    def _looked_up(self, run: _Run) -> _Run | _Members | None:
        """Look a planned run up; return it if it is ready, or a full group of members.

        None if it is stored, which is reported, if it waits for an equal run, or if it is collected.
        """
        store, planned = self._store, run.planned
        if store is not None and planned.plan_key is not None:
            found = store.find_planned(planned.plan_key)
            if found is not None and is_sufficient(found, self._options) and store.fault_of_file(found) is None:
                file = store.file(found)
                self._report(run, RunRecord(planned.label, planned.values, found, file, repeated=True))
                return None
        if run.family is not None and run.family not in self._ordinary_families:
            return self._collected(run, run.family)
        job = planned.job()
        if store is None:
            return replace(run, job=job, options=self._options)
        run_id = identify(job)[1]
        if run_id in self._waiting:
            self._waiting[run_id].append(run)
            return None
        job = replace(job, run_id=run_id)
        record = fetch(job, store, self._options)
        if isinstance(record, RunRecord):
            self._report(run, record)
            return None
        self._waiting[run_id] = []
        return replace(run, job=job, options=with_earlier_audit(job, store, self._options), damaged=record)

    def _collected(self, run: _Run, family: str) -> _Members | None:
        """Add a run to the members of its family, and return a group that is full or has waited for long."""
        group = self._families.setdefault(family, _Members([]))
        group.runs.append(run)
        left = (self._unseen + len(group.runs)) / (2 * self._executor.slots)
        if len(group.runs) >= max(min(math.ceil(left), MAX_MEMBERS), MIN_MEMBERS):
            return self._families.pop(family)
        if len(self._families) > MAX_FAMILIES:
            return self._families.pop(next(iter(self._families)))
        return None

    def _report(self, run: _Run, record: RunRecord) -> None:
        """Report a run that is done."""
        self._done(run.index, record)

    def _handle(self, future: "Future[tuple[JobOutcome, ...]]") -> None:
        """Store the outcomes of a task, and queue what was lost again."""
        group = self._pending.pop(future)
        try:
            outcomes, lost = future.result(), None
        except TaskLostError as error:
            outcomes, lost = error.outcomes, error
        except VersionMismatchError as error:
            raise ExecutorError(mismatch_text(str(error))) from None
        except ExecutorError:
            raise
        except CancelledError:
            raise ExecutorError("the tasks were cancelled") from None
        except Exception as error:
            raise ExecutorError(f"a worker cannot run tasks: {type(error).__name__}: {str(error)[:300]}") from error
        if isinstance(group, _Members):
            self._complete_members(group, outcomes, is_lost=lost is not None)
            return
        for run, outcome in zip(group, outcomes, strict=False):
            assert outcome is not None
            self._complete(run, outcome)
        if lost is not None:
            self._requeue(group[len(outcomes) :], lost)

    def _complete_members(self, group: _Members, outcomes: tuple[JobOutcome, ...], is_lost: bool) -> None:
        """Store the members of a task that were computed, and queue the others as ordinary runs."""
        family, first = group.runs[0].family, group.runs[0].planned
        assert family is not None
        pairs = zip(group.runs, outcomes, strict=False)
        completed = [(run, outcome.stored) for run, outcome in pairs if isinstance(outcome, CompletedRun)]
        with defer_interrupt():
            if self._store is not None:
                try:
                    self._store.add_rows([(stored, dict(run.planned.values)) for run, stored in completed])
                except StoreError as error:
                    raise JobError(first.label, error) from error
            for run, stored in completed:
                self._report(run, RunRecord(run.label, run.planned.values, stored, None, repeated=False))
        if len(completed) > 1:
            self._computed(first.label, first.engine)
        elif not is_lost and len(group.runs) > 1:
            self._ordinary_families.add(family)
        done = {run.index for run, _ in completed}
        self._queue.extend(replace(run, family=None) for run in group.runs if run.index not in done)

    def _requeue(self, rest: list[_Run], lost: TaskLostError) -> None:
        """Queue the runs of a lost task again, each in a task of its own if any of them may be the cause."""
        guilty = rest[0] if rest and (lost.knows_job or len(rest) == 1) else None
        for run in reversed(rest if guilty is None else rest[1:]):
            run.is_suspect |= guilty is None
            self._queue.appendleft(run)
        if guilty is None:
            return
        guilty.deaths += 1
        guilty.is_suspect = True
        if lost.is_timeout or lost.is_final:
            self._store_failure(guilty, lost.reason)
        elif guilty.deaths < ATTEMPTS:
            self._queue.appendleft(guilty)
        else:
            remedy = "; if memory is the cause, use fewer workers" if lost.was_killed else ""
            self._store_failure(guilty, f"{lost.reason}, in the last of {ATTEMPTS} attempts{remedy}")

    def _complete(self, run: _Run, outcome: CompletedRun | JobFailure) -> None:
        """Store the outcome of a run."""
        if isinstance(outcome, CompletedRun):
            self._times.append(outcome.elapsed)
            self._store_run(run, outcome)
        elif outcome.error is not None:
            raise JobError(run.label, outcome.error)
        else:
            self._store_failure(run, outcome.reason)

    def _store_failure(self, run: _Run, reason: str) -> None:
        """Store a run that failed, with the reason."""
        assert run.job is not None
        self._store_run(run, failed_run(run.job, reason))

    def _store_run(self, run: _Run, completed: CompletedRun) -> None:
        """Store a run and report it; no interrupt comes between the two."""
        assert run.job is not None
        with defer_interrupt():
            if self._store is None:
                stored, trajectory = completed.stored, completed.trajectory
                record = RunRecord.of(run.job, stored, None, repeated=False, computed=trajectory)
            else:
                try:
                    record = store_run(self._store, run.job, completed, run.damaged)
                except StoreError as error:
                    raise JobError(run.label, error) from error
            if run.job.run_id is not None:
                self._queue.extend(self._waiting.pop(run.job.run_id, ()))
            self._report(run, record)
