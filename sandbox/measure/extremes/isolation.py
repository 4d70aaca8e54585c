"""Isolated worker: one worker process for many tasks, replaced when it hangs or crashes.

If a signal from outside kills a worker, its task is not the cause, and another worker repeats it.
"""

import json
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from queue import Empty, SimpleQueue
from time import monotonic
from types import TracebackType
from typing import Self

from sandbox.jsonable import to_json
from sandbox.measure.extremes.outcome import Outcome, Task
from sandbox.measure.extremes.worker import exit_text

COMPILE_TIME = 300.0
"""s, additional time of a task once its worker has reported that it compiles."""
START_TIME = 120.0
"""s, time limit for the start of a worker."""
SINGLE_THREADED = {
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
}
"""Environment of a worker: the workers share the cores, and idle threads take address space."""
MAX_ATTEMPTS = 3
"""Attempts at a task whose worker is killed from outside."""
OUTSIDE_SIGNALS = ("SIGKILL", "SIGTERM", "SIGINT", "SIGHUP", "SIGQUIT")
"""Signals that come from outside: exceeding a limit of time or memory raises none of them."""
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
        self._process: subprocess.Popen[str] | None = None
        self._lines: SimpleQueue[str | None] = SimpleQueue()
        self._stderr = tempfile.TemporaryFile()  # noqa: SIM115, closed with the worker
        self._closed = False
        self._was_killed = False
        """whether a signal from outside ended the last task"""
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
            self._was_killed = False
            outcome = self._submit_once(task)
            if not self._was_killed:
                break
        return outcome

    def _submit_once(self, task: Task) -> Outcome:
        process = self._running_process()
        assert process.stdin is not None
        self._stderr.seek(0)
        self._stderr.truncate()
        line = json.dumps({"task": to_json(task), "seconds": self._seconds})
        try:
            process.stdin.write(line + "\n")
            process.stdin.flush()
        except (BrokenPipeError, OSError):
            return self._crash_outcome()
        until = monotonic() + self._seconds
        while True:
            try:
                answer = self._lines.get(timeout=max(until - monotonic(), 0.0))
            except Empty:
                self._end_process()
                reason = f"took longer than {self._seconds:g} s, and was stopped"
                return Outcome("failed", reason, "process", seconds=self._seconds, slow=True)
            if answer is None:
                return self._crash_outcome()
            document = json.loads(answer)
            if "compiling" in document:
                until = max(until, monotonic() + COMPILE_TIME)
            else:
                return Outcome.from_json({"predicted": (), **document})

    def close(self) -> None:
        """End the process; a thread that waits for it gets an `InterruptedError`."""
        with self._lock:
            self._closed = True
            self._end_process()
            self._stderr.close()

    def __enter__(self) -> Self:
        """Return the worker."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Close the worker."""
        self.close()

    def _running_process(self) -> "subprocess.Popen[str]":
        """Return the process; start one if there is none, again if a signal from outside ended it at its start.

        Raises:
            WorkerError: no process can be started.
            InterruptedError: the worker has been closed meanwhile.
        """
        if self._process is not None and self._process.poll() is None:
            return self._process
        reason: str | None = None
        for _ in range(MAX_ATTEMPTS):
            process = self._start_process()
            if process is not None:
                return process
            reason = self._crash_outcome().reason
            if not self._was_killed:
                break
        raise WorkerError(f"no worker process could be started: {reason}", self._was_killed)

    def _start_process(self) -> "subprocess.Popen[str] | None":
        """Start a process and return it when it is ready; None if it ended or hung before."""
        with self._lock:
            if self._closed:
                raise InterruptedError
            self._lines = SimpleQueue()
            self._process = subprocess.Popen(
                self._command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._stderr,
                text=True,
                env={**os.environ, **SINGLE_THREADED},
                start_new_session=True,  # Ctrl-C reaches only the parent process, which ends the worker
            )
        self.started += 1
        threading.Thread(target=_read_lines, args=(self._process, self._lines), daemon=True).start()
        try:
            first = self._lines.get(timeout=START_TIME)
        except Empty:
            self._process.kill()
            first = None
        if first is not None:
            return self._process
        if self._closed:
            raise InterruptedError
        return None

    def _crash_outcome(self) -> Outcome:
        """Return the outcome of a task whose process crashed."""
        if self._closed:
            raise InterruptedError
        assert self._process is not None
        status = self._process.wait()
        self._stderr.seek(0)
        text = self._stderr.read().decode("utf-8", "replace").strip()
        last_line = text.splitlines()[-1].strip()[-STDERR_TAIL:] if text else ""
        self._end_process()
        reason = exit_text(status)
        self._was_killed = reason.endswith(OUTSIDE_SIGNALS)
        return Outcome("failed", f"{reason}: {last_line}" if last_line else reason, "process")

    def _end_process(self) -> None:
        """Kill the process and close its pipes."""
        if self._process is None:
            return
        self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                try:
                    stream.close()
                except BrokenPipeError:  # unsent data, which the dead process no longer needs
                    continue
        self._process = None


def _read_lines(process: "subprocess.Popen[str]", lines: "SimpleQueue[str | None]") -> None:
    """Put each line of a process into a queue, and None at its end."""
    assert process.stdout is not None
    try:
        for line in process.stdout:
            lines.put(line)
    except ValueError:  # the stream was closed while it was read: the worker has ended the process
        pass
    lines.put(None)
