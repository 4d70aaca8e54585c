"""Isolated worker: one worker process for many tasks, replaced when it hangs or crashes.

If a signal from outside kills a worker, its task is not the cause, and another worker repeats it.
"""

import sys
import threading
from collections.abc import Sequence
from time import monotonic
from types import TracebackType
from typing import NamedTuple, Self

from sandbox.jsonable import to_json
from sandbox.measure.extremes.outcome import Outcome, Task
from sandbox.worker_process import OUTSIDE_SIGNALS, ProcessEndedError, WorkerProcess, exit_text

COMPILE_TIME = 300.0
"""s, additional time of a task once its worker has reported that it compiles."""
START_TIME = 120.0
"""s, time limit for the start of a worker."""
MAX_ATTEMPTS = 3
"""Attempts at a task whose worker is killed from outside."""
STDERR_TAIL = 200
"""Characters of the last line of standard error in the reason for a crash."""


class WorkerError(RuntimeError):
    """No worker process can be started."""

    def __init__(self, message: str, was_killed: bool = False) -> None:
        super().__init__(message)
        self.was_killed = was_killed
        """whether a signal from outside ended each attempt, rather than a fault or a limit of the worker"""


class IsolatedWorker:
    """Worker process with limits of time and memory; a crash becomes the outcome of the task that caused it.

    One process serves many tasks, because starting it takes far longer than most of them.
    """

    def __init__(self, seconds: float, memory: int, command: Sequence[str] | None = None) -> None:
        """Set the limits; the first task starts the process.

        Args:
            seconds: time limit of a task, s.
            memory: memory limit of the process, MiB.
            command: command that starts the process; default: that of this package.
        """
        own = (sys.executable, "-m", "sandbox.measure.extremes.worker", str(memory))
        self._seconds, self._memory, self._command = seconds, memory, tuple(command or own)
        self._process: WorkerProcess | None = None
        self._closed = False
        self._lock = threading.Lock()
        self.started = 0
        """number of processes started"""

    def submit(self, task: Task) -> Outcome:
        """Return the outcome of a task; if its process hung or crashed, a failure with the reason.

        Raises:
            WorkerError: no process can be started.
            InterruptedError: the worker has been closed meanwhile.
        """
        for _ in range(MAX_ATTEMPTS):
            try:
                return self._submit_once(task)
            except ProcessEndedError:
                crash = self._end_crashed()
                if not crash.is_from_outside:
                    break
        return Outcome("failed", crash.reason, "process")

    def _submit_once(self, task: Task) -> Outcome:
        process = self._running_process()
        process.send({"task": to_json(task), "seconds": self._seconds})
        until = monotonic() + self._seconds
        while True:
            try:
                document = process.receive(until - monotonic())
            except TimeoutError:
                self._end_process()
                reason = f"took longer than {self._seconds:g} s, and was stopped"
                return Outcome("failed", reason, "process", seconds=self._seconds, slow=True)
            if "compiling" not in document:
                return Outcome.from_json({"predicted": (), **document})
            until = max(until, monotonic() + COMPILE_TIME)

    def close(self) -> None:
        """End the process; a thread that waits for it gets an `InterruptedError`."""
        with self._lock:
            self._closed = True
            self._end_process()

    def __enter__(self) -> Self:
        """Return the worker."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Close the worker."""
        self.close()

    def _running_process(self) -> WorkerProcess:
        """Return the process; start one if there is none, again if a signal from outside ended it at its start.

        Raises:
            WorkerError: no process can be started.
            InterruptedError: the worker has been closed meanwhile.
        """
        if self._process is not None and self._process.is_running:
            return self._process
        for _ in range(MAX_ATTEMPTS):
            self._end_process()
            with self._lock:
                if self._closed:
                    raise InterruptedError
                self._process = process = WorkerProcess(self._command)
            self.started += 1
            try:
                process.receive(START_TIME)  # it is ready
            except TimeoutError:
                process.kill()
            except ProcessEndedError:
                pass
            else:
                return process
            crash = self._end_crashed()
            if not crash.is_from_outside:
                break
        raise WorkerError(f"no worker process could be started: {crash.reason}", crash.is_from_outside)

    def _end_crashed(self) -> "_Crash":
        """End the process that has crashed, and return how it ended.

        Raises:
            InterruptedError: the worker has been closed.
        """
        if self._closed:
            raise InterruptedError
        assert self._process is not None
        code, text = self._process.exit_code(), self._process.error_output().strip()
        self._end_process()
        last_line = text.splitlines()[-1].strip()[-STDERR_TAIL:] if text else ""
        reason = f"{exit_text(code)}: {last_line}" if last_line else exit_text(code)
        return _Crash(reason, code in OUTSIDE_SIGNALS)

    def _end_process(self) -> None:
        """End the process, if there is one."""
        if self._process is not None:
            self._process.end()
            self._process = None


class _Crash(NamedTuple):
    """End of a process that did not answer."""

    reason: str
    is_from_outside: bool
    """whether a signal from outside ended it, rather than a fault or a limit"""
