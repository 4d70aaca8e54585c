"""Warden: keeps one worker, asks it, and starts another where it hangs or dies.

A worker that was killed from outside says nothing of its task, which another worker gets again.
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

from sandbox.measure.extremes.cell import Outcome, Task
from sandbox.measure.extremes.confine import cause_of_death

COMPILING = 300.0
"""s more, once a worker has said that it compiles."""
STARTING = 120.0
"""s until a worker has to be ready."""
ALONE = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
"""Workers share the cores among themselves, and threads that do nothing take address space."""
ATTEMPTS = 3
"""times that a task is asked whose worker is killed from outside"""
OUTSIDE = ("SIGKILL", "SIGTERM", "SIGINT", "SIGHUP", "SIGQUIT")
"""Signals that come from outside: a limit of time or memory that a task exceeds raises none of them."""
LAST_WORDS = 200
"""Characters of what a worker said before it died."""


class WorkerError(RuntimeError):
    """A worker does not even start."""


class Warden:
    """Asks one worker at a time; each death is told as the outcome of the task that it died of.

    A worker serves many tasks, as to start one takes far longer than most of them.
    """

    def __init__(self, seconds: float, memory: int, command: Sequence[str] | None = None) -> None:
        """Take note of the limits; the first task starts a worker.

        Args:
            seconds: that a task may take.
            memory: MiB that a worker may have.
            command: starts a worker; by default this package's own.
        """
        own = (sys.executable, "-m", "sandbox.measure.extremes.worker", str(memory))
        self._seconds, self._memory, self._command = seconds, memory, tuple(command or own)
        self._process: subprocess.Popen[str] | None = None
        self._said: SimpleQueue[str | None] = SimpleQueue()
        self._complaints = tempfile.TemporaryFile()  # noqa: SIM115, closed with the warden
        self._closed = False
        self._was_killed = False
        """whether the task asked last ended by a signal from outside"""
        self._lock = threading.Lock()
        self.started = 0
        """how many workers there have been"""

    def ask(self, task: Task) -> Outcome:
        """Return the outcome of a task; of one that hung, died or wrote nonsense, that it failed, and of what.

        Raises:
            WorkerError: no worker can be started.
            InterruptedError: the warden has been closed meanwhile.
        """
        for _ in range(ATTEMPTS):
            self._was_killed = False
            outcome = self._asked(task)
            if not self._was_killed:
                break
        return outcome

    def _asked(self, task: Task) -> Outcome:
        """Ask once."""
        process = self._running()
        assert process.stdin is not None
        self._complaints.seek(0)
        self._complaints.truncate()
        line = json.dumps({"task": task.document(), "seconds": self._seconds})
        try:
            process.stdin.write(line + "\n")
            process.stdin.flush()
        except (BrokenPipeError, OSError):
            return self._dead()
        until = monotonic() + self._seconds
        while True:
            try:
                said = self._said.get(timeout=max(until - monotonic(), 0.0))
            except Empty:
                self._end()
                reason = f"took longer than {self._seconds:g} s, and was stopped"
                return Outcome("failed", reason, "process", seconds=self._seconds, slow=True)
            if said is None:
                return self._dead()
            told = json.loads(said)
            if "compiling" in told:
                until = max(until, monotonic() + COMPILING)
            else:
                return Outcome.read({"predicted": (), **told})

    def close(self) -> None:
        """End the worker; whoever waits for it is interrupted."""
        with self._lock:
            self._closed = True
            self._end()
            self._complaints.close()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Close it."""
        self.close()

    def _running(self) -> "subprocess.Popen[str]":
        if self._process is not None and self._process.poll() is None:
            return self._process
        with self._lock:
            if self._closed:
                raise InterruptedError
            self._said = SimpleQueue()
            self._process = subprocess.Popen(
                self._command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._complaints,
                text=True,
                env={**os.environ, **ALONE},
                start_new_session=True,  # Ctrl-C is for whoever waits
            )
        self.started += 1
        threading.Thread(target=_listen, args=(self._process, self._said), daemon=True).start()
        try:
            first = self._said.get(timeout=STARTING)
        except Empty:
            first = None
        if first is None:
            if self._closed:
                raise InterruptedError
            why = self._dead().reason
            raise WorkerError(f"no worker process could be started: {why}")
        return self._process

    def _dead(self) -> Outcome:
        """Return the outcome of a task that its worker died of."""
        if self._closed:
            raise InterruptedError
        assert self._process is not None
        status = self._process.wait()
        self._complaints.seek(0)
        text = self._complaints.read().decode("utf-8", "replace").strip()
        words = text.splitlines()[-1].strip()[-LAST_WORDS:] if text else ""
        self._end()
        reason = cause_of_death(status)
        self._was_killed = reason.endswith(OUTSIDE)
        return Outcome("failed", f"{reason}: {words}" if words else reason, "process")

    def _end(self) -> None:
        """Kill the worker and take leave of it."""
        if self._process is None:
            return
        self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                try:
                    stream.close()
                except BrokenPipeError:  # what was to be written is for nobody
                    continue
        self._process = None


def _listen(process: "subprocess.Popen[str]", said: "SimpleQueue[str | None]") -> None:
    """Pass on each line that a worker says, and None at its end."""
    assert process.stdout is not None
    try:
        for line in process.stdout:
            said.put(line)
    except ValueError:  # closed while it was read: the warden has ended it
        pass
    said.put(None)
