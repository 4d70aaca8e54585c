"""Worker processes that answer one JSON line with another: limits, private output, and how a process ended.

The parent side is `WorkerProcess`; the functions below it are for the worker itself.
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Mapping, Sequence
from queue import Empty, SimpleQueue
from typing import TextIO

from sandbox.jsonable import JsonObject

MEBIBYTE = 2**20
SINGLE_THREADED = {
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
}
"""Environment of a worker: the workers share the cores, and idle threads take address space."""
OUTSIDE_SIGNALS = frozenset(
    -number
    for name in ("SIGKILL", "SIGTERM", "SIGINT", "SIGHUP", "SIGQUIT")
    if (number := getattr(signal, name, None)) is not None
)
"""Exit codes of signals that come from outside: exceeding a limit of time or memory raises none of them."""


class ProcessEndedError(Exception):
    """The process has ended instead of answering."""


class WorkerProcess:
    """A process that reads a JSON line from standard input for each request, and writes JSON lines as answers.

    It has a session of its own, so that Ctrl-C reaches only the parent. The end of its life is an exception of the
    request that it did not answer, after which `exit_code` and `error_output` say why.
    """

    def __init__(self, command: Sequence[str], environment: Mapping[str, str] | None = None) -> None:
        """Start the process.

        Args:
            command: command with its arguments.
            environment: variables that differ from those of this process and from `SINGLE_THREADED`.

        Raises:
            OSError: no process can be started.
        """
        self._stderr = tempfile.TemporaryFile()  # noqa: SIM115, closed in `end`
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._stderr,
                text=True,
                encoding="utf-8",
                env={**os.environ, **SINGLE_THREADED, **(environment or {})},
                start_new_session=True,
            )
        except OSError:
            self._stderr.close()
            raise
        self._lines: SimpleQueue[str | None] = SimpleQueue()
        threading.Thread(target=self._read_lines, daemon=True).start()

    @property
    def is_running(self) -> bool:
        """Whether the process has not ended."""
        return self._process.poll() is None

    def send(self, request: JsonObject) -> None:
        """Send a request, and forget the error output of the earlier ones.

        Raises:
            ProcessEndedError: the process has ended.
        """
        assert self._process.stdin is not None
        try:
            self._stderr.seek(0)
            self._stderr.truncate()
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()
        except (OSError, ValueError):  # `end` closes the streams, perhaps in another thread
            raise ProcessEndedError from None

    def receive(self, seconds: float) -> JsonObject:
        """Return the next answer.

        Raises:
            TimeoutError: there is none within the given time, s.
            ProcessEndedError: the process has ended.
        """
        try:
            line = self._lines.get(timeout=max(seconds, 0.0))
        except Empty:
            raise TimeoutError from None
        if line is None or not line.endswith("\n"):  # it has ended, perhaps within a line
            self._lines.put(None)
            raise ProcessEndedError
        answer: JsonObject = json.loads(line)
        return answer

    def send_signal(self, number: int) -> None:
        """Send a signal to the process; nothing happens if it has ended."""
        self._process.send_signal(number)

    def exit_code(self, seconds: float | None = None) -> int:
        """Wait for the end of the process, and return its exit code: minus the number of a signal, or its status.

        Raises:
            subprocess.TimeoutExpired: it has not ended within the given time, s.
        """
        return self._process.wait(seconds)

    def error_output(self) -> str:
        """Return the standard error since the last request."""
        self._stderr.seek(0)
        return self._stderr.read().decode("utf-8", "replace")

    def kill(self) -> None:
        """Kill the process. Another thread that waits for its answer gets a `ProcessEndedError`."""
        self._process.kill()

    def end(self) -> None:
        """Kill the process and close its streams."""
        self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                try:
                    stream.close()
                except BrokenPipeError:  # unsent data, which the dead process no longer needs
                    continue
        self._stderr.close()

    def _read_lines(self) -> None:
        """Put each line of the process into the queue, and None at its end."""
        assert self._process.stdout is not None
        try:
            for line in self._process.stdout:
                self._lines.put(line)
        except ValueError:  # the stream was closed while it was read: `end` was called
            pass
        self._lines.put(None)


def exit_text(code: int) -> str:
    """Return how a process ended, from its exit code: the name of a signal, or the exit status."""
    if code >= 0:
        return f"the process ended with status {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = f"signal {-code}"
    return f"the process was killed by {name}"


def private_stdout() -> TextIO:
    """Return a stream for the answers; all other output, also of C libraries, goes to standard error."""
    output = os.fdopen(os.dup(1), "w", buffering=1, encoding="utf-8")
    os.dup2(2, 1)
    return output


def limit_memory(mebibytes: int) -> None:
    """Limit the address space of this process, and disable core files; does nothing on Windows.

    Args:
        mebibytes: the limit, MiB.
    """
    if sys.platform == "win32":
        return
    import resource

    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    wanted = mebibytes * MEBIBYTE
    resource.setrlimit(resource.RLIMIT_AS, (wanted if hard == resource.RLIM_INFINITY else min(wanted, hard), hard))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def limit_cpu_time(seconds: float) -> None:
    """Limit the processor time of this process from now on; the operating system ends the process beyond it.

    The parent process limits the wall-clock time. This limit ends a process whose parent no longer exists.

    Args:
        seconds: the limit, s.
    """
    if sys.platform == "win32":
        return
    import resource

    used = resource.getrusage(resource.RUSAGE_SELF)
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    wanted = int(used.ru_utime + used.ru_stime + seconds) + 1
    resource.setrlimit(resource.RLIMIT_CPU, (wanted if hard == resource.RLIM_INFINITY else min(wanted, hard), hard))
