"""The command line as a child process that handles SIGINT, even if the tests were started with SIGINT ignored."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

# A shell may start its children with SIGINT ignored; their own children inherit that.
_MAIN = """
import runpy, signal
signal.signal(signal.SIGINT, signal.default_int_handler)
runpy.run_module("sandbox", run_name="__main__", alter_sys=True)
"""


def interruptible(*words: str) -> list[str]:
    """Return the command that runs the command line in a process that handles SIGINT."""
    return [sys.executable, "-c", _MAIN, *words]


def interrupted(words: Sequence[str], ready: Callable[[], bool], folder: Path | None = None) -> tuple[int, str, str]:
    """Run a command in a folder, send SIGINT once `ready` returns true; return its exit status, stdout and stderr."""
    pipe = subprocess.PIPE
    command = subprocess.Popen(interruptible(*words), stdout=pipe, stderr=pipe, text=True, cwd=folder)
    try:
        while not ready():
            assert command.poll() is None
            time.sleep(0.001)
        command.send_signal(signal.SIGINT)
        out, err = command.communicate(timeout=120)
    finally:
        command.kill()
    return command.returncode, out, err


def worker_processes(pid: int) -> list[int]:
    """Return the worker processes that a process has started, without the resource tracker of multiprocessing."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
            words = (folder / "cmdline").read_text()
        except (FileNotFoundError, ProcessLookupError):
            continue
        if parent == pid and "spawn_main" in words:
            found.append(int(folder.name))
    return found
