"""Crew: processes that make the runs of a plan side by side, each run in one of them from start to end.

A worker that is killed from outside takes its run with it; another worker makes that run again, a bounded number of
times. A worker ends with the process that started it, even if that was killed; one that is stopped (SIGSTOP) when its
parent is killed stays until it is continued.
"""

import os
import signal
import threading
import traceback
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from pathlib import Path
from time import monotonic, sleep
from types import FrameType
from typing import Any, Literal

from sandbox.batch.outcome import execute, give_up
from sandbox.batch.plan import Job
from sandbox.batch.store import Notice, Store, StoreError
from sandbox.interrupt import uninterrupted
from sandbox.measure.recorder import TooLargeError
from sandbox.scene.errors import SceneError

PATIENCE = 5.0
"""s, for all workers together to leave their runs once they are dismissed; then they are killed."""
ATTEMPTS = 3
"""times that a run is made whose worker dies, and that a worker is started where none can be."""

Done = Callable[[int, dict[str, Any]], None]
"""Called with the place of a job, and the row that tells of its run."""

Message = tuple[Literal["ready", "notice", "row", "failed", "error"], Any]
"""From a worker: that it is ready; a message for the user; the row of its run; why its run has none; an error that ends
all runs."""


class CrewError(RuntimeError):
    """No worker can be started; `str()` says how the last one ended."""


class MakingError(Exception):
    """A run could not be made."""

    def __init__(self, job: Job, error: Exception) -> None:
        super().__init__(f"{job.label}: {error}")
        self.job, self.error = job, error


@dataclass(frozen=True)
class Making:
    """How runs are made and told of, as `execute` and `Outcome.row` have it."""

    store: Path | None = None
    audit: bool = True
    ledger: bool = False
    final: bool = True


class Worker:
    """A process that makes one run after the other."""

    def __init__(self, making: Making) -> None:
        context = get_context("spawn")  # a fork would inherit what the window, numba and threads hold
        self.pipe, theirs = context.Pipe()
        self.process: SpawnProcess = context.Process(target=_serve, args=(theirs, making), daemon=True)
        with _blocked():
            self.process.start()
        theirs.close()
        self.is_ready = False
        """Whether it has started, and so can be given a job."""
        self.place: int | None = None
        """of the job that it is at"""

    def hand(self, place: int, job: Job) -> None:
        """Have it make a run."""
        self.place = place
        with suppress(BrokenPipeError, ConnectionResetError):  # it has ended: `receive` finds that
            self.pipe.send(job)

    def receive(self) -> Message | None:
        """Return its next message; None where it has ended instead."""
        try:
            message: Message = self.pipe.recv()
        except (EOFError, OSError):  # an end in the middle of a message is an OSError
            self.process.kill()
            self.process.join()
            self.pipe.close()
            return None
        return message


def make(jobs: Sequence[Job], workers: int, making: Making, done: Done, notice: Notice | None = None) -> None:
    """Make runs, in the order of their jobs as workers are free; each is reported as it is done.

    A run whose worker dies `ATTEMPTS` times, or meets a fault of this program, is reported as failed; the others are
    made all the same.

    Args:
        jobs: what to run.
        workers: how many at the same time.
        making: how.
        done: called with each run.
        notice: called with the messages of a store.

    Raises:
        MakingError: a run could not be made. Runs that are under way are left undone.
        CrewError: no worker can be started.
    """
    crew = _Crew(jobs, workers, making, done, notice)
    try:
        crew.work()
    finally:
        crew.dismiss()


class _Crew:
    """The workers, the jobs that wait for them, and how often each has lost its worker."""

    def __init__(self, jobs: Sequence[Job], workers: int, making: Making, done: Done, notice: Notice | None) -> None:
        self._jobs, self._making, self._done, self._notice = jobs, making, done, notice
        self._waiting = deque(range(len(jobs)))
        self._size = workers
        self._workers: dict[Connection, Worker] = {}
        self._deaths: Counter[int] = Counter()
        self._failed_starts = 0
        """since the last worker that was ready"""
        self._noticed: set[str] = set()

    def work(self) -> None:
        """Have all jobs done."""
        while True:
            for worker in self._workers.values():
                if worker.is_ready and worker.place is None and self._waiting:
                    place = self._waiting.popleft()
                    worker.hand(place, self._jobs[place])
            busy = sum(worker.place is not None for worker in self._workers.values())
            if not busy and not self._waiting:
                return
            while len(self._workers) < min(self._size, busy + len(self._waiting)):
                with uninterrupted():  # a worker that is not in the table would not be dismissed
                    worker = Worker(self._making)
                    self._workers[worker.pipe] = worker
            for pipe in wait(list(self._workers)):
                assert isinstance(pipe, Connection)
                self._handle_message(self._workers[pipe])

    def _handle_message(self, worker: Worker) -> None:
        message = worker.receive()
        if message is None:
            del self._workers[worker.pipe]
            self._handle_death(worker)
            return
        kind, content = message
        if kind == "notice":
            if self._notice is not None and content not in self._noticed:  # every worker has the same to say
                self._noticed.add(content)
                self._notice(content)
            return
        place, worker.place = worker.place, None
        if kind == "ready":
            worker.is_ready = True
            self._failed_starts = 0
        else:
            assert place is not None
            if kind == "error":
                raise MakingError(self._jobs[place], content) from content
            self._done(place, content if kind == "row" else self._failed(place, content))

    def _handle_death(self, worker: Worker) -> None:
        """Put the job of a dead worker back, or count it as failed."""
        from sandbox.measure.extremes.confine import cause_of_death  # its package is large, and workers rarely die

        assert worker.process.exitcode is not None
        cause = cause_of_death(worker.process.exitcode)
        place = worker.place
        if not worker.is_ready:
            self._failed_starts += 1
            if self._workers:
                self._size = len(self._workers)  # where memory is short, fewer may fit
            elif self._failed_starts >= ATTEMPTS:
                raise CrewError(f"no worker process could be started: {cause}")
            return
        if place is None:
            return
        self._deaths[place] += 1
        if self._deaths[place] < ATTEMPTS:
            self._waiting.appendleft(place)
            return
        remedy = "; if memory is the cause, use fewer workers" if "SIGKILL" in cause else ""
        self._done(place, self._failed(place, f"{cause}, in the last of {ATTEMPTS} attempts{remedy}"))

    def _failed(self, place: int, reason: str) -> dict[str, Any]:
        """Return the row of a run that no worker could make."""
        job, making = self._jobs[place], self._making
        store = None
        try:
            store = None if making.store is None else Store(making.store, self._notice)
            return give_up(job, store, reason).row(making.final, making.ledger)
        except StoreError as error:
            raise MakingError(job, error) from error
        finally:
            if store is not None:
                store.close()

    def dismiss(self) -> None:
        """End all workers, in bounded time. Their runs are left undone; what they store is stored whole.

        A second Ctrl-C kills them at once.
        """
        with uninterrupted() as held:
            workers = list(self._workers.values())
            for worker in workers:
                worker.pipe.close()
                if not worker.is_ready:
                    worker.process.kill()  # it has nothing to lose
            until = monotonic() + PATIENCE
            while (alive := [each for each in workers if each.process.is_alive()]) and monotonic() < until and not held:
                for worker in alive:
                    _interrupt(worker)  # again and again: between two runs it hears of none
                wait([worker.process.sentinel for worker in alive], 0.1)
            for worker in workers:
                worker.process.kill()
            for worker in workers:
                worker.process.join()


def _interrupt(worker: Worker) -> None:
    """Send SIGINT to a worker that is at a run; one that is stopped is continued, or it would not get it."""
    pid = worker.process.pid
    assert pid is not None
    if worker.place is not None:
        os.kill(pid, signal.SIGINT)
    if hasattr(signal, "SIGCONT"):
        os.kill(pid, signal.SIGCONT)


@contextmanager
def _blocked() -> Iterator[None]:
    """Block SIGINT, where a system can: a process that is started meanwhile has it blocked until it says otherwise."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(pipe: Connection, making: Making) -> None:
    """Make runs until no more are asked for. Ctrl-C is for the parent, which passes it on to a run under way."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "setsid"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        os.setsid()
    threading.Thread(target=_end_with_parent, daemon=True).start()
    maker = _Maker(making, lambda message: pipe.send(("notice", message)))
    try:
        with suppress(EOFError, BrokenPipeError, ConnectionResetError, KeyboardInterrupt):
            pipe.send(("ready", None))
            while True:
                pipe.send(maker.make(pipe.recv()))
    finally:
        maker.close()


def _raise_once() -> Callable[[int, FrameType | None], None]:
    """Return a handler that raises KeyboardInterrupt for the first signal only.

    The parent repeats its signal: a second exception would fall into the clean-up that the first one set off.
    """
    is_raised = False

    def handle(_number: int, _frame: FrameType | None) -> None:
        nonlocal is_raised
        if not is_raised:
            is_raised = True
            raise KeyboardInterrupt

    return handle


def _end_with_parent() -> None:
    """End this process once its parent has: interrupt its run, and where that does not help, exit."""
    parent = parent_process()
    assert parent is not None
    wait([parent.sentinel])
    until = monotonic() + PATIENCE
    while monotonic() < until:
        os.kill(os.getpid(), signal.SIGINT)  # between two runs it is ignored, and the end of the pipe is found
        sleep(0.1)
    os._exit(1)


class _Maker:
    """Makes runs in a worker, and opens the store for the first of them."""

    def __init__(self, making: Making, notice: Notice) -> None:
        self._making, self._notice = making, notice
        self._store: Store | None = None

    def make(self, job: Job) -> Message:
        """Make a run; the parent may interrupt it."""
        making = self._making
        signal.signal(signal.SIGINT, _raise_once())
        try:
            if making.store is not None and self._store is None:
                self._store = Store(making.store, self._notice)
            outcome = execute(job, self._store, None, making.audit, making.ledger)
            return "row", outcome.row(making.final, making.ledger)
        except (SceneError, StoreError, TooLargeError) as error:
            return "error", error
        except MemoryError:
            return "failed", "out of memory; use fewer workers"
        except (BrokenPipeError, ConnectionResetError):  # of a notice: the parent has gone
            raise
        except Exception as error:  # noqa: BLE001, a process cannot raise in another: the parent reports it
            return "failed", _located(error)
        finally:
            signal.signal(signal.SIGINT, signal.SIG_IGN)

    def close(self) -> None:
        """Close the store."""
        if self._store is not None:
            self._store.close()


def _located(error: Exception) -> str:
    """Return an error of this program in one line, with where it was raised."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    where = f"{Path(frame.filename).name}:{frame.lineno}"
    return f"internal error: {type(error).__name__} in {where}: {str(error)[:200]}; run with --workers 1 to see more"
