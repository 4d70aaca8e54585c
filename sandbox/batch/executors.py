"""Executors: run jobs in this process or in worker processes, and report each result as it completes.

`ProcessExecutor` has its own pool, a pipe per worker, in place of `concurrent.futures.ProcessPoolExecutor`. There,
the death of one worker ends the runs of all others; and a worker that is killed while it sends a row larger than the
pipe's buffer leaves the pool, and the exit of the program, waiting without end, because the parent holds the write end
of the pipe open too (CPython 3.11). Here its end of the pipe is closed, and exactly one run is lost and made again.
"""

import os
import signal
from collections import Counter, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from time import monotonic
from typing import Protocol

from sandbox.batch.job import RunOptions, RunRecord, record_failure, run_or_fetch
from sandbox.batch.plan import Job
from sandbox.batch.run_row import RunRow
from sandbox.batch.store import Notice, Store, StoreError
from sandbox.batch.worker import INTERRUPT_INTERVAL, SHUTDOWN_TIME, WorkerMessage, serve
from sandbox.resource_limits import TooLargeError
from sandbox.scene.errors import SceneError
from sandbox.signals import defer_interrupt

ATTEMPTS = 3
"""Attempts at a run whose worker dies, and at starting a first worker: a cause that is not the run, such as an
out-of-memory killer that ends any process, seldom hits one run three times."""


class ExecutorError(RuntimeError):
    """The executor cannot run jobs: no worker process can be started. `str()` has the cause."""


class JobError(Exception):
    """A job cannot be run, which ends all others: its scene or game has faults, or the store cannot be used."""

    def __init__(self, job: Job, error: Exception) -> None:
        super().__init__(f"{job.label}: {error}")
        self.job, self.error = job, error


@dataclass(frozen=True)
class Result:
    """A completed job."""

    index: int
    """of the job, in the order of submission, from 0"""
    row: RunRow
    record: RunRecord | None = None
    """the run with its trajectory; None if it was made in another process"""


Done = Callable[[Result], None]
"""Callback for a completed job."""


class Executor(Protocol):
    """Runs jobs, and reports a row for each. Rows do not depend on the executor.

    Jobs and rows are picklable and travel by value, so an executor may use other processes or other machines.
    """

    def submit(self, job: Job) -> int:
        """Queue a job and return its index, from 0."""
        ...

    def wait(self, done: Done) -> None:
        """Run all queued jobs.

        A run that fails by itself, or whose process dies repeatedly, completes with the status `failed`.

        Args:
            done: called in this thread with each result as it completes, in any order. It is a callback and not an
                iterator so that a run that is stored while Ctrl-C arrives is still reported.

        Raises:
            JobError: a job cannot be run. The jobs that have not completed are dropped.
            ExecutorError: no job can be run at all.
            KeyboardInterrupt: the jobs that have not completed are dropped.
        """
        ...


class InProcessExecutor:
    """Runs one job after the other in this process.

    Args:
        options: how to run them.
        store: where runs are looked up and stored.
        progress: called with the index of the job that is running, and the fraction of it that is done.
    """

    def __init__(
        self, options: RunOptions, store: Store | None = None, progress: Callable[[int, float], None] | None = None
    ) -> None:
        self._options, self._store, self._progress = options, store, progress
        self._queue: deque[tuple[int, Job]] = deque()
        self._submitted = 0

    def submit(self, job: Job) -> int:
        """Queue a job and return its index."""
        self._queue.append((self._submitted, job))
        self._submitted += 1
        return self._submitted - 1

    def wait(self, done: Done) -> None:
        """Run all queued jobs, in their order."""
        while self._queue:
            index, job = self._queue.popleft()
            progress = None if self._progress is None else partial(self._progress, index)
            if progress is not None:
                progress(0.0)
            try:
                run_or_fetch(job, self._store, self._options, progress, partial(self._report, done, index))
            except (SceneError, StoreError, TooLargeError) as error:
                raise JobError(job, error) from error

    def _report(self, done: Done, index: int, record: RunRecord) -> None:
        done(Result(index, record.row(self._options.final, self._options.ledger), record))


class ProcessExecutor:
    """Runs jobs in worker processes, each job in one of them from start to end.

    If a worker dies, another one makes its run again, up to `ATTEMPTS` times. Workers end with the process that
    started them, even if that is killed; one that is stopped (SIGSTOP) then ends once it is continued.

    Args:
        options: how to run the jobs.
        workers: number of worker processes.
        notice: called with messages of the store, each once.
    """

    def __init__(self, options: RunOptions, workers: int, notice: Notice | None = None) -> None:
        self._options, self._size, self._notice = options, workers, notice
        self._jobs: list[Job] = []
        self._waiting: deque[int] = deque()
        self._workers: dict[Connection, _Worker] = {}
        self._deaths: Counter[int] = Counter()
        """of workers, by the index of the job that they ran"""
        self._failed_starts = 0
        """since a worker was last ready"""
        self._noticed: set[str] = set()

    def submit(self, job: Job) -> int:
        """Queue a job and return its index."""
        self._jobs.append(job)
        self._waiting.append(len(self._jobs) - 1)
        return len(self._jobs) - 1

    def wait(self, done: Done) -> None:
        """Run all queued jobs; they start in their order. The workers end with this call."""
        try:
            while self._waiting or any(worker.index is not None for worker in self._workers.values()):
                self._assign_jobs()
                self._start_workers()
                for pipe in wait(list(self._workers)):
                    assert isinstance(pipe, Connection)
                    self._handle_message(self._workers[pipe], done)
        finally:
            self._waiting.clear()
            self._shut_down()

    def _assign_jobs(self) -> None:
        for worker in self._workers.values():
            if worker.is_ready and worker.index is None and self._waiting:
                index = self._waiting.popleft()
                worker.send(index, self._jobs[index])

    def _start_workers(self) -> None:
        busy = sum(worker.index is not None for worker in self._workers.values())
        while len(self._workers) < min(self._size, busy + len(self._waiting)):
            try:
                with defer_interrupt():  # a worker that is not in the table would not be ended by `_shut_down`
                    worker = _Worker(self._options)
                    self._workers[worker.pipe] = worker
            except OSError as error:  # no memory, no process or no file descriptor is left
                if not self._workers:
                    reason = error.strerror or error
                    raise ExecutorError(f"no worker process could be started: {reason}") from error
                self._size = len(self._workers)

    def _handle_message(self, worker: "_Worker", done: Done) -> None:
        message = worker.receive()
        if message is None:
            del self._workers[worker.pipe]
            self._handle_death(worker, done)
            return
        kind, content = message
        if kind == "notice":
            if self._notice is not None and content not in self._noticed:  # all workers have the same notices
                self._noticed.add(content)
                self._notice(content)
            return
        index, worker.index = worker.index, None
        if kind == "ready":
            worker.is_ready = True
            self._failed_starts = 0
        else:
            assert index is not None
            if kind == "error":
                raise JobError(self._jobs[index], content) from content
            done(Result(index, content if kind == "row" else self._failed_row(index, content)))

    def _handle_death(self, worker: "_Worker", done: Done) -> None:
        """Queue the job of a dead worker again, or report it as failed after the last attempt."""
        from sandbox.measure.extremes.worker import exit_text

        assert worker.process.exitcode is not None
        cause = exit_text(worker.process.exitcode)
        index = worker.index
        if not worker.is_ready:
            self._failed_starts += 1
            if self._workers:
                self._size = len(self._workers)  # where memory is short, fewer may fit
            elif self._failed_starts >= ATTEMPTS:
                raise ExecutorError(f"no worker process could be started: {cause}")
            return
        if index is None:
            return
        self._deaths[index] += 1
        if self._deaths[index] < ATTEMPTS:
            self._waiting.appendleft(index)
            return
        remedy = "; if memory is the cause, use fewer workers" if "SIGKILL" in cause else ""
        done(Result(index, self._failed_row(index, f"{cause}, in the last of {ATTEMPTS} attempts{remedy}")))

    def _failed_row(self, index: int, reason: str) -> RunRow:
        """Return the row of a run that no worker could make, and store it.

        Raises:
            JobError: the store cannot be used.
        """
        job, options = self._jobs[index], self._options
        store = None
        try:
            store = None if options.store is None else Store(options.store, self._notice)
            return record_failure(job, store, reason).row(options.final, options.ledger)
        except StoreError as error:
            raise JobError(job, error) from error
        finally:
            if store is not None:
                store.close()

    def _shut_down(self) -> None:
        """End all workers within `SHUTDOWN_TIME`. Their runs are dropped; runs that are being stored are completed.

        A second Ctrl-C kills them at once.
        """
        with defer_interrupt() as held:
            workers = list(self._workers.values())
            self._workers.clear()
            for worker in workers:
                worker.pipe.close()
                if not worker.is_ready:
                    worker.process.kill()  # it has no run
            until = monotonic() + SHUTDOWN_TIME
            while (alive := [each for each in workers if each.process.is_alive()]) and monotonic() < until and not held:
                for worker in alive:
                    worker.interrupt()
                wait([worker.process.sentinel for worker in alive], INTERRUPT_INTERVAL)
            for worker in workers:
                worker.process.kill()
            for worker in workers:
                worker.process.join()


class _Worker:
    """A worker process, as its executor sees it."""

    def __init__(self, options: RunOptions) -> None:
        context = get_context("spawn")  # a fork would inherit the state of the window, of numba and of threads
        self.pipe, theirs = context.Pipe()
        self.process: SpawnProcess = context.Process(target=serve, args=(theirs, options), daemon=True)
        with _interrupts_blocked():
            self.process.start()
        theirs.close()  # so that the death of the worker ends the pipe, even in the middle of a message
        self.is_ready = False
        """it has started, and can take a job"""
        self.index: int | None = None
        """of its job"""

    def send(self, index: int, job: Job) -> None:
        """Send it a job."""
        self.index = index
        with suppress(BrokenPipeError, ConnectionResetError):  # it has ended: `receive` finds that
            self.pipe.send(job)

    def receive(self) -> WorkerMessage | None:
        """Return its next message; None if it has ended."""
        try:
            message: WorkerMessage = self.pipe.recv()
        except (EOFError, OSError):  # an end in the middle of a message is an OSError
            self.process.kill()
            self.process.join()
            self.pipe.close()
            return None
        return message

    def interrupt(self) -> None:
        """Interrupt its job; a stopped process is continued, because it gets no signal before."""
        pid = self.process.pid
        assert pid is not None
        if self.index is not None:
            os.kill(pid, signal.SIGINT)
        if hasattr(signal, "SIGCONT"):
            os.kill(pid, signal.SIGCONT)


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Block SIGINT where the system can; a process that is started meanwhile inherits this until it unblocks it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
