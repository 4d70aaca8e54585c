"""Executor of worker processes on this computer.

`ProcessExecutor` has a thread, a process and a pipe per worker, in place of `concurrent.futures.ProcessPoolExecutor`.
There, the death of one worker ends the runs of all others; a worker that hangs cannot be killed; and a worker that is
killed while it sends a result larger than the pipe's buffer leaves the pool, and the exit of the program, waiting
without end, because the parent holds the write end of the pipe open too (CPython 3.11). Here its end of the pipe is
closed, and exactly one run is lost.
"""

import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from queue import SimpleQueue
from typing import Any, Literal

from sandbox.batch.executors import AnyTask, ExecutorError, JobOutcome, TaskLostError, hang_time, outcomes_of
from sandbox.batch.job import timeout_reason
from sandbox.worker_process import exit_text

MAX_STARTS = 3
"""Attempts at starting a worker, if no other one runs"""
EXIT_TIME = 5.0
"""s, in which a killed process has ended"""

WorkerMessage = tuple[Literal["ready", "outcome", "end", "error"], Any]
"""Message of a worker, by kind: it is ready; the outcome of a job; the task is done; an exception that ended it."""

_Queue = SimpleQueue["tuple[AnyTask, Future[tuple[JobOutcome, ...]]] | None"]


class ProcessExecutor:
    """Runs tasks in worker processes, which are started (`spawn`) when they are needed.

    Workers end with the process that started them, even if that is killed.

    Args:
        workers: number of worker processes.
    """

    is_remote = True

    def __init__(self, workers: int) -> None:
        self._size = workers
        self._queue: _Queue = SimpleQueue()
        self._threads: list[threading.Thread] = []
        self._lock = threading.Lock()
        self._workers: set[_Worker] = set()
        self._submitted = self._failed_starts = 0
        self._is_closed = False

    @property
    def slots(self) -> int:
        """Number of worker processes; fewer than asked for where no more could be started."""
        return self._size

    def submit(self, task: AnyTask) -> "Future[tuple[JobOutcome, ...]]":
        """Queue a task; a worker is started for it while there are fewer than `slots`."""
        future: Future[tuple[JobOutcome, ...]] = Future()
        self._queue.put((task, future))
        self._submitted += 1
        if len(self._threads) < min(self._size, self._submitted):
            thread = threading.Thread(target=self._serve, daemon=True, name=f"worker-{len(self._threads) + 1}")
            self._threads.append(thread)
            thread.start()
        return future

    def check(self) -> None:
        """Do nothing: each thread looks after its worker."""

    def shut_down(self) -> None:
        """Kill all workers, and wait for their end. Nothing is lost: only this process writes to the store."""
        with self._lock:
            self._is_closed = True
            workers = list(self._workers)
        for _ in self._threads:
            self._queue.put(None)
        for worker in workers:
            worker.process.kill()
        for thread in self._threads:  # which wait for their processes
            thread.join(EXIT_TIME)

    def _serve(self) -> None:
        """Run tasks in one worker process, and start another one where it has died."""
        worker: _Worker | None = None
        while (item := self._queue.get()) is not None:
            task, future = item
            if not future.set_running_or_notify_cancel():
                continue
            if worker is None:
                worker = self._started(future)
                if worker is None:
                    if future.done():
                        continue
                    self._resubmit(task, future)
                    return
            try:
                future.set_result(worker.run(task))
            except Exception as error:  # noqa: BLE001, the future carries it
                if isinstance(error, TaskLostError):
                    self._forget(worker)
                    worker = None
                future.set_exception(error)
        if worker is not None:
            self._forget(worker)

    def _started(self, future: "Future[tuple[JobOutcome, ...]]") -> "_Worker | None":
        """Start a worker; if that fails, return None, and give the future an exception if no other worker runs."""
        while not self._is_closed:
            try:
                with self._lock:
                    if self._is_closed:
                        break
                    worker = _Worker()
                    self._workers.add(worker)
            except OSError as error:  # no memory, no process or no file descriptor is left
                cause = str(error.strerror or error)
            else:
                if worker.wait_until_ready():
                    self._failed_starts = 0
                    return worker
                cause = exit_text(worker.exit_code())
                self._forget(worker)
            with self._lock:
                self._failed_starts += 1
                if any(each.is_ready for each in self._workers):  # where memory is short, fewer may fit
                    self._size = max(self._size - 1, 1)
                    return None
            if self._failed_starts >= MAX_STARTS:
                future.set_exception(ExecutorError(f"no worker process could be started: {cause}"))
                return None
        future.set_exception(TaskLostError("the executor was shut down"))
        return None

    def _resubmit(self, task: AnyTask, future: "Future[tuple[JobOutcome, ...]]") -> None:
        """Let another worker run a task, with the same future."""
        again: Future[tuple[JobOutcome, ...]] = Future()

        def copy(done: "Future[tuple[JobOutcome, ...]]") -> None:
            error = done.exception()
            if error is None:
                future.set_result(done.result())
            else:
                future.set_exception(error)

        again.add_done_callback(copy)
        self._queue.put((task, again))

    def _forget(self, worker: "_Worker") -> None:
        """End a worker, and drop it."""
        worker.close()
        with self._lock:
            self._workers.discard(worker)


class _Worker:
    """A worker process, as its executor sees it."""

    def __init__(self) -> None:
        context = get_context("spawn")  # a fork would inherit the state of the window, of numba and of threads
        self._pipe, theirs = context.Pipe()
        self.process: SpawnProcess = context.Process(target=serve, args=(theirs,), daemon=True)
        with _interrupts_blocked():
            self.process.start()
        theirs.close()  # so that the death of the worker ends the pipe, even in the middle of a message
        self.is_ready = False
        """it has started, and can take a task"""

    def wait_until_ready(self) -> bool:
        """Wait for the first message; return False if the process has ended before."""
        with suppress(EOFError, OSError):
            self.is_ready = self._pipe.recv()[0] == "ready"
        return self.is_ready

    def run(self, task: AnyTask) -> tuple[JobOutcome, ...]:
        """Run a task and return its outcomes.

        Raises:
            TaskLostError: the process has died, or a job exceeds the time limit and does not end by itself.
        """
        limit = task.options.time_limit
        outcomes: list[JobOutcome] = []
        try:
            self._pipe.send(task)
            while True:
                if limit is not None and not self._pipe.poll(hang_time(limit)):
                    self.process.kill()
                    raise TaskLostError(timeout_reason(limit), tuple(outcomes), is_timeout=True, knows_job=True)
                kind, content = self._pipe.recv()
                if kind == "end":
                    return tuple(outcomes)
                if kind == "error":
                    raise content
                outcomes.append(content)
        except (EOFError, OSError):  # an end in the middle of a message is an OSError
            code = self.exit_code()
            was_killed = hasattr(signal, "SIGKILL") and code == -signal.SIGKILL
            raise TaskLostError(exit_text(code), tuple(outcomes), knows_job=True, was_killed=was_killed) from None

    def exit_code(self) -> int:
        """Return the exit code of the process, which has ended; it is killed if it has only closed its pipe."""
        self.process.join(EXIT_TIME)
        if self.process.exitcode is None:
            self.process.kill()
            self.process.join()
        assert self.process.exitcode is not None
        return self.process.exitcode

    def close(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.join()
        self._pipe.close()


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


def serve(pipe: Connection) -> None:
    """Receive tasks from a pipe and send back their outcomes, until the other end is closed; runs in the worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, which kills its workers
    if hasattr(os, "setsid"):
        os.setsid()
    threading.Thread(target=_exit_with_parent, daemon=True).start()
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        pipe.send(("ready", None))
        while True:
            task: AnyTask = pipe.recv()
            try:
                for outcome in outcomes_of(task):
                    pipe.send(("outcome", outcome))
                pipe.send(("end", None))
            except OSError:  # of the pipe: the parent has ended
                raise
            except Exception as error:  # noqa: BLE001, the parent raises it
                pipe.send(("error", error))


def _exit_with_parent() -> None:
    """Wait for the end of the parent, then exit at once: nothing is written here."""
    parent = parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(1)
