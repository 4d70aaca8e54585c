"""Worker: computes on a thread of its own, so that the window stays alive while kernels compile.

Nothing runs at the same time: the window's thread waits for each job. Only while a job compiles, or takes long, does
it draw a progress note and take events in; it touches nothing of what is being computed then.
"""

import threading
from collections.abc import Callable
from concurrent.futures import Future
from queue import SimpleQueue
from time import perf_counter
from typing import Protocol, TypeVar

from sandbox.engines.common.compile_clock import COMPILE_CLOCK

T = TypeVar("T")

LONG = 0.5
"""s that a job may take before the window looks after itself"""


class Compute(Protocol):
    """Calls a function that may have to compile or to compute for long, and returns what it returns."""

    def __call__(self, job: Callable[[], T]) -> T:
        """Call it; what it raises is raised here."""


def compute_here(job: Callable[[], T]) -> T:
    """Call a function on the present thread."""
    return job()


class Worker:
    """A thread that computes while its owner waits."""

    def __init__(self, on_wait: Callable[[Callable[[float], bool]], None]) -> None:
        """Start the thread.

        Args:
            on_wait: called on the owner's thread when a job compiles or takes long. It has to call its argument, which
                waits for some seconds and returns whether the job is done, until that is so.
        """
        self._on_wait = on_wait
        self._jobs: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._stirred, self._done = threading.Event(), threading.Event()
        self._done.set()
        self.kernels = 0
        """kernels that the present job has begun to compile"""
        # A daemon: a second Ctrl+C ends the process without waiting for it.
        self._thread = threading.Thread(target=self._work, name="sandbox worker", daemon=True)
        self._thread.start()

    def compute(self, job: Callable[[], T]) -> T:
        """Run a job to its end and return its result; raise what it raises."""
        if threading.current_thread() is self._thread:
            return job()
        self._stirred.clear()
        self._done.clear()
        self.kernels = 0
        found: Future[T] = Future()

        def run() -> None:
            try:
                found.set_result(job())
            except BaseException as error:  # noqa: BLE001, raised again where the owner waits
                found.set_exception(error)

        self._jobs.put(run)
        self._stirred.wait(LONG)
        if not self._done.is_set():
            self._on_wait(self._done.wait)
        return found.result()

    @property
    def is_busy(self) -> bool:
        """Whether a job is under way, as after its owner was interrupted while waiting."""
        return not self._done.is_set()

    def note_compiling(self, _: str) -> None:
        """Take note that a kernel is about to be compiled; `COMPILE_CLOCK.on_begin`."""
        if threading.current_thread() is self._thread:
            self.kernels += 1
            self._stirred.set()

    def _work(self) -> None:
        while (job := self._jobs.get()) is not None:
            job()
            self._done.set()
            self._stirred.set()

    def close(self) -> None:
        """End the thread once it has nothing to do."""
        self._jobs.put(None)


class Wait:
    """How long the window has waited for a job."""

    def __init__(self, worker: Worker) -> None:
        self._worker, self._began, self._compiled = worker, perf_counter(), COMPILE_CLOCK.seconds

    @property
    def compiled(self) -> bool:
        """Whether anything was compiled meanwhile."""
        return self._worker.kernels > 0 or COMPILE_CLOCK.seconds > self._compiled

    def told(self) -> str:
        """Return what is being done, and for how long."""
        seconds = f"{perf_counter() - self._began:.0f} s"
        if not self._worker.kernels:
            return f"computing … {seconds}"
        return f"compiling, on first use only … function {self._worker.kernels}, {seconds}"
