"""Worker thread for jobs that may compile kernels, so that the window stays responsive.

Access is never concurrent: the main thread waits for each job. During a job that compiles or takes long, the main
thread draws a progress notice and handles events, but does not touch the session.
"""

import threading
from collections.abc import Callable
from concurrent.futures import Future
from queue import SimpleQueue
from time import perf_counter
from typing import Protocol, TypeVar

from sandbox.engines.common.compile_clock import COMPILE_CLOCK

T = TypeVar("T")

MAX_SILENT_WAIT = 0.5
"""s after which a job counts as long and progress is shown"""


class Compute(Protocol):
    """Callable that runs a job that may compile or take long."""

    def __call__(self, job: Callable[[], T]) -> T:
        """Run the job and return its result; its exceptions are raised here."""


def compute_here(job: Callable[[], T]) -> T:
    """Run a job on the calling thread."""
    return job()


class Worker:
    """Thread that runs jobs while its owner waits."""

    def __init__(self, on_wait: Callable[[Callable[[float], bool]], None]) -> None:
        """Start the thread.

        Args:
            on_wait: called on the owner's thread when a job compiles or takes long. Its argument waits for a number of
                seconds and returns whether the job is done; `on_wait` must call it until that is so.
        """
        self._on_wait = on_wait
        self._jobs: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._woken, self._done = threading.Event(), threading.Event()
        self._done.set()
        self.kernels = 0
        """number of kernels whose compilation the present job has started"""
        self.part = ""
        """what the present job is doing, with the number of its parts; set by the job itself"""
        # A daemon, so that a second Ctrl+C ends the process without waiting for it.
        self._thread = threading.Thread(target=self._work, name="sandbox worker", daemon=True)
        self._thread.start()

    def compute(self, job: Callable[[], T]) -> T:
        """Run a job and return its result; its exceptions are raised here."""
        if threading.current_thread() is self._thread:
            return job()
        self._woken.clear()
        self._done.clear()
        self.kernels, self.part = 0, ""
        found: Future[T] = Future()

        def run() -> None:
            try:
                found.set_result(job())
            except BaseException as error:  # noqa: BLE001, raised again on the owner's thread
                found.set_exception(error)

        self._jobs.put(run)
        self._woken.wait(MAX_SILENT_WAIT)
        if not self._done.is_set():
            self._on_wait(self._done.wait)
        return found.result()

    @property
    def is_busy(self) -> bool:
        """Whether a job is still running, for example after the waiting owner was interrupted."""
        return not self._done.is_set()

    def note_compiling(self, _: str) -> None:
        """Count a kernel that is about to be compiled; set as `COMPILE_CLOCK.on_begin`."""
        if threading.current_thread() is self._thread:
            self.kernels += 1
            self._woken.set()

    def _work(self) -> None:
        while (job := self._jobs.get()) is not None:
            job()
            self._done.set()
            self._woken.set()

    def close(self) -> None:
        """End the thread after its last job."""
        self._jobs.put(None)


class Wait:
    """Progress of the job that the window waits for."""

    def __init__(self, worker: Worker) -> None:
        self._worker, self._began, self._compiled = worker, perf_counter(), COMPILE_CLOCK.seconds

    @property
    def compiled(self) -> bool:
        """Whether a kernel was compiled since the start of the wait."""
        return self._worker.kernels > 0 or COMPILE_CLOCK.seconds > self._compiled

    def text(self) -> str:
        """Return the text of the progress notice."""
        seconds = f"{perf_counter() - self._began:.0f} s"
        if not self._worker.kernels:
            return f"computing … {seconds}"
        part = f"{self._worker.part}, " if self._worker.part else ""
        return f"compiling, on first use only … {part}function {self._worker.kernels}, {seconds}"
