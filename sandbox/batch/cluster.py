"""Executor on a Dask cluster: workers on other computers, which `dask scheduler` and `dask worker` have started.

Tasks and outcomes travel by value, so workers need the same versions of the sandbox and its packages, but neither the
scene files nor the store. Worker processes should have one thread each.
"""

import importlib
import logging
import re
import uuid
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple

from sandbox.batch.executors import (
    AnyTask,
    ExecutorError,
    JobOutcome,
    TaskLostError,
    VersionMismatchError,
    hang_time,
    mismatch_text,
    run_task,
)
from sandbox.batch.job import timeout_reason
from sandbox.echo import MAX_NAMED
from sandbox.provenance import versions

CONNECT_TIME = 10.0
"""s for the connection to the scheduler"""
LOST_TIME = 15.0
"""s without a connection, after which the scheduler is lost"""
LOOK_INTERVAL = 5.0
"""s between two looks at the workers"""
ADDRESS = re.compile(r"(tcp|tls|ws|wss|ucx)://[^\s/]+:\d{1,5}")
RETRIES = 2
"""Further attempts at a task that ended with an exception, such as of a broken connection"""


class _Submitted(NamedTuple):
    """A task that the scheduler has."""

    ours: "Future[tuple[JobOutcome, ...]]"
    theirs: Any
    """future of Dask"""
    task: AnyTask
    workers: frozenset[str]
    """addresses of the workers that may run it; empty for all"""


class ClusterExecutor:
    """Runs tasks on the workers of a Dask cluster, and leaves the cluster running.

    Workers with other versions get no tasks.

    Args:
        address: of the scheduler, such as `tcp://host:8786`, or the path of its `--scheduler-file` (.json).
        notice: called with messages for the user.

    Raises:
        ExecutorError: distributed is not installed, the scheduler does not answer, or all workers have other versions.
    """

    is_remote = True

    def __init__(self, address: str, notice: Callable[[str], None] = lambda _: None) -> None:
        try:
            distributed: Any = importlib.import_module("distributed")  # its functions have no types
        except ImportError:
            raise ExecutorError("a cluster needs the package distributed: pip install -e '.[cluster]'") from None
        is_file = address.endswith(".json")
        if not (Path(address).is_file() if is_file else ADDRESS.fullmatch(address)):
            raise ExecutorError(
                f"{address[:MAX_NAMED]!r} is no scheduler: give its address, such as tcp://host:8786, or the path of "
                "its --scheduler-file (.json)"
            )
        for name in logging.root.manager.loggerDict:
            if name.startswith(("distributed", "tornado")):  # errors are reported once, by this class
                logging.getLogger(name).setLevel(logging.CRITICAL)
        where = {"scheduler_file": address} if is_file else {"address": address}
        try:
            self._client: Any = distributed.Client(**where, timeout=CONNECT_TIME, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            reason = str(error).partition("\n")[0] or type(error).__name__
            raise ExecutorError(
                f"{address}: no Dask scheduler answers: {reason[:200]}; start one with `dask scheduler`, and workers "
                "with `dask worker ADDRESS --nthreads 1`"
            ) from None
        self._address, self._notice = address, notice
        self._pool = self._client.get_executor(pure=False, retries=RETRIES)
        self._killed_worker: type[Exception] = distributed.scheduler.KilledWorker
        self._run, self._count = uuid.uuid4().hex[:8], 0
        self._pending: dict[str, _Submitted] = {}
        """tasks that the scheduler has, by key"""
        self._held: list[tuple[Future[tuple[JobOutcome, ...]], AnyTask]] = []
        """tasks that wait for a worker with the same versions"""
        self._workers: set[str] = set()
        """addresses of the workers that have the same versions"""
        self._excluded: dict[str, str] = {}
        """differences of the versions of all other workers, by address"""
        self._since: dict[str, float] = {}
        """when a task was first seen on a worker, by key"""
        self._connected = self._looked = monotonic()
        self._slots = 0
        self._look()
        if self._excluded and not self._workers:
            raise ExecutorError(mismatch_text(next(iter(self._excluded.values()))))
        if not self._slots:
            self._notice(f"{address}: the cluster has no workers yet; the runs start when there are some")

    @property
    def slots(self) -> int:
        """Number of threads of all workers with the same versions; they may come and go."""
        return max(self._slots, 1)

    def submit(self, task: AnyTask) -> "Future[tuple[JobOutcome, ...]]":
        """Queue a task on the scheduler."""
        ours: Future[tuple[JobOutcome, ...]] = Future()
        ours.set_running_or_notify_cancel()
        self._send(ours, task)
        return ours

    def _send(self, ours: "Future[tuple[JobOutcome, ...]]", task: AnyTask) -> None:
        """Send a task to the scheduler: for any worker, or, if some have other versions, for those that have not."""
        if self._excluded and not self._workers:
            self._held.append((ours, task))
            return
        self._count += 1
        key = f"sandbox-{self._run}-{self._count}"
        workers = sorted(self._workers) if self._excluded else []
        theirs = self._pool.submit(run_task, task, key=key, **({"workers": workers} if workers else {}))
        self._pending[key] = _Submitted(ours, theirs, task, frozenset(workers))
        theirs.add_done_callback(lambda done: self._finish(key, done))

    def check(self) -> None:
        """Look for a lost scheduler, for workers that came or went, and for tasks that hang.

        Raises:
            ExecutorError: the scheduler is lost.
        """
        now = monotonic()
        if self._client.status == "running":
            self._connected = now
        elif self._client.status == "closed" or now - self._connected > LOST_TIME:
            raise self._lost_scheduler()
        if (self._held or now - self._looked > LOOK_INTERVAL) and self._client.status == "running":
            self._looked = now
            self._look()

    def shut_down(self) -> None:
        """Cancel all tasks, and close the connection."""
        for each in list(self._pending.values()):
            each.theirs.cancel()
        self._pending.clear()
        self._held.clear()
        self._client.close(timeout=CONNECT_TIME)

    def _look(self) -> None:
        """Count the threads of the workers, exclude those with other versions, and end tasks that hang."""
        try:
            threads: dict[str, int] = self._client.nthreads()
            self._check_versions([each for each in threads if each not in self._workers | self._excluded.keys()])
            self._workers &= threads.keys()
            self._slots = sum(count for each, count in threads.items() if each in self._workers)
            self._send_again()
            limits = [each.task.options.time_limit for each in list(self._pending.values())]
            if any(limit is not None for limit in limits):
                self._end_hanging_tasks(self._client.processing())
        except (OSError, TimeoutError):  # the connection has broken; `check` waits for it
            return

    def _check_versions(self, new: list[str]) -> None:
        """Ask workers for their versions, and exclude those that differ from this process."""
        if not new:
            return
        wanted = dict(versions())

        def differences() -> str:  # a function within another one is sent by value
            from sandbox.batch.executors import version_differences

            return version_differences(wanted)

        for address, found in self._client.run(differences, workers=new, on_error="return").items():
            if found == "":
                self._workers.add(address)
                continue
            self._excluded[address] = found if isinstance(found, str) else f"{type(found).__name__}: {found}"[:300]
            self._notice(f"worker {address} is left out, as its runs would differ: {self._excluded[address]}")

    def _send_again(self) -> None:
        """Send the tasks that were held, and those whose workers have all left."""
        for key, each in list(self._pending.items()):
            if each.workers and not each.workers & self._workers and self._pending.pop(key, None) is not None:
                each.theirs.cancel()
                self._held.append((each.ours, each.task))
        held, self._held = self._held, []
        for ours, task in held:
            self._send(ours, task)

    def _end_hanging_tasks(self, processing: Any) -> None:
        """End tasks that are on a worker for too long, and restart their workers."""
        now = monotonic()
        hanging: list[str] = []
        for worker, keys in processing.items():
            for key in map(str, keys):
                if key not in self._pending:
                    continue
                submitted = self._pending[key]
                since = self._since.setdefault(key, now)
                limit = submitted.task.options.time_limit
                if limit is not None and now - since > hang_time(limit) * submitted.task.runs:
                    hanging.append(worker)
                    del self._pending[key]
                    submitted.theirs.cancel()
                    submitted.ours.set_exception(TaskLostError(timeout_reason(limit), is_timeout=True))
        if hanging:
            self._client.restart_workers(hanging, timeout=CONNECT_TIME, raise_for_error=False)

    def _lost_scheduler(self) -> ExecutorError:
        return ExecutorError(f"the scheduler at {self._address} is lost; give the same command again to go on")

    def _finish(self, key: str, done: "Future[tuple[JobOutcome, ...]]") -> None:
        """Pass the result of a task on; called in the thread of the client."""
        found = self._pending.pop(key, None)
        self._since.pop(key, None)
        if found is None:
            return
        ours = found.ours
        if done.cancelled():
            ours.set_exception(self._lost_scheduler())
        elif (error := done.exception()) is None:
            ours.set_result(done.result())
        elif isinstance(error, VersionMismatchError):  # of a worker that has just joined
            self._held.append((ours, found.task))
        elif isinstance(error, self._killed_worker):
            ours.set_exception(TaskLostError("the workers that ran it died", is_final=True))
        else:
            ours.set_exception(error)
