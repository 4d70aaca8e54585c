"""Crew: processes that make the runs of a plan side by side, each run in one of them from start to end.

A worker ends with the process that started it: it hears of it as the end of its pipe.
"""

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from pathlib import Path
from time import monotonic
from typing import Any

from sandbox.batch.outcome import execute
from sandbox.batch.plan import Job
from sandbox.batch.store import Store, StoreError
from sandbox.interrupt import uninterrupted
from sandbox.measure.recorder import TooLargeError
from sandbox.scene.faults import SceneError

PATIENCE = 5.0
"""s, for a worker to leave what it is at when it is sent away; then it is ended"""

Done = Callable[[int, dict[str, Any]], None]
"""Called with the place of a job, and the row that tells of its run."""


class CrewError(RuntimeError):
    """A worker has ended by itself, as one does that the system took the memory from; `str()` tells."""


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
        self.at: int | None = None
        """the place of the job that it is at"""

    def hand(self, place: int, job: Job) -> None:
        """Have it make a run."""
        self.at = place
        with suppress(BrokenPipeError):  # it has ended: that is found where its answer is awaited
            self.pipe.send(job)

    def answer(self) -> dict[str, Any]:
        """Return the row of the run that it was handed.

        Raises:
            CrewError: it has ended.
            SceneError, StoreError, TooLargeError: as `execute` raises them.
        """
        try:
            answer = self.pipe.recv()
        except (EOFError, ConnectionResetError):
            self.process.join()
            raise CrewError(f"a worker has ended with status {self.process.exitcode}; fewer may fit") from None
        if isinstance(answer, Exception):
            raise answer
        self.at = None
        row: dict[str, Any] = answer
        return row

    def dismiss(self) -> None:
        """Send it away; what it is at is left undone, but what it stores is stored whole."""
        self.pipe.close()
        until = monotonic() + PATIENCE
        while self.process.is_alive() and monotonic() < until:
            if self.at is not None and self.process.pid is not None:
                os.kill(self.process.pid, signal.SIGINT)  # again and again: between two runs it hears of none
            self.process.join(0.1)
        self.process.kill()
        self.process.join()


def make(jobs: Sequence[Job], workers: int, making: Making, done: Done) -> None:
    """Make runs, in the order of their jobs as workers are free; each is told of as it is done.

    Raises:
        MakingError: a run could not be made, or its worker has ended. Runs that are under way are left undone.
    """
    waiting = iter(enumerate(jobs))
    crew = [Worker(making) for _ in range(min(workers, len(jobs)))]
    try:
        busy = {worker.pipe: worker for worker in crew if _handed(worker, waiting)}
        while busy:
            for pipe in wait(list(busy)):
                assert isinstance(pipe, Connection)
                worker = busy.pop(pipe)
                place = worker.at
                assert place is not None
                try:
                    row = worker.answer()
                except (CrewError, SceneError, StoreError, TooLargeError) as error:
                    raise MakingError(jobs[place], error) from error
                done(place, row)
                if _handed(worker, waiting):
                    busy[pipe] = worker
    finally:
        with uninterrupted():
            for worker in crew:
                worker.dismiss()


class MakingError(Exception):
    """A run could not be made."""

    def __init__(self, job: Job, error: Exception) -> None:
        super().__init__(f"{job.label}: {error}")
        self.job, self.error = job, error


def _handed(worker: Worker, waiting: Iterator[tuple[int, Job]]) -> bool:
    """Hand a worker the next job; tell whether there was one."""
    following = next(waiting, None)
    if following is not None:
        worker.hand(*following)
    return following is not None


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
    """Make runs until nobody asks for more. Ctrl-C is for whoever waits, who passes it on to a run under way."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "setsid"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        os.setsid()
    store = None if making.store is None else Store(making.store)
    try:
        with suppress(EOFError, BrokenPipeError, ConnectionResetError, KeyboardInterrupt):
            while True:
                pipe.send(_made(pipe.recv(), store, making))
    finally:
        if store is not None:
            store.close()


def _made(job: Job, store: Store | None, making: Making) -> dict[str, Any] | Exception:
    """Return the row of a run, or why there is none; whoever waits may interrupt it."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return execute(job, store, None, making.audit, making.ledger).row(making.final, making.ledger)
    except (SceneError, StoreError, TooLargeError) as error:
        return error
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
