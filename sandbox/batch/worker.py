"""Worker process of a `ProcessExecutor`: runs one job after the other, and sends back a row for each.

A worker ignores SIGINT between jobs: Ctrl-C is for the parent, which forwards it to workers that run a job.
"""

import os
import signal
import threading
import traceback
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import parent_process
from multiprocessing.connection import Connection, wait
from pathlib import Path
from time import monotonic, sleep
from types import FrameType
from typing import Any, Literal

from sandbox.batch.job import RunOptions, run_or_fetch
from sandbox.batch.plan import Job
from sandbox.batch.store import Notice, Store, StoreError
from sandbox.resource_limits import TooLargeError
from sandbox.scene.errors import SceneError

SHUTDOWN_TIME = 5.0
"""s, in which workers end by themselves after an interrupt: far longer than a step and than storing a run. Those that
still run are killed."""
INTERRUPT_INTERVAL = 0.1
"""s between two interrupts of a worker; one that arrives between two jobs is ignored, so that they are repeated."""

WorkerMessage = tuple[Literal["ready", "notice", "row", "failed", "error"], Any]
"""Message of a worker, by kind: it is ready; a notice for the user; the row of its run; the reason why a run failed;
an exception that ends all runs."""


def serve(pipe: Connection, options: RunOptions) -> None:
    """Receive jobs from a pipe and send back messages, until the other end is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "setsid"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        os.setsid()  # Ctrl-C of the terminal reaches only the parent
    threading.Thread(target=_exit_with_parent, daemon=True).start()
    runner = _JobRunner(options, lambda message: pipe.send(("notice", message)))
    try:
        with suppress(EOFError, BrokenPipeError, ConnectionResetError, KeyboardInterrupt):
            pipe.send(("ready", None))
            while True:
                pipe.send(runner.run(pipe.recv()))
    finally:
        runner.close()


class _JobRunner:
    """Runs jobs, and opens the store for the first of them."""

    def __init__(self, options: RunOptions, notice: Notice) -> None:
        self._options, self._notice = options, notice
        self._store: Store | None = None

    def run(self, job: Job) -> WorkerMessage:
        """Run a job; SIGINT interrupts it."""
        options = self._options
        signal.signal(signal.SIGINT, raise_once())
        try:
            if options.store is not None and self._store is None:
                self._store = Store(options.store, self._notice)
            return "row", run_or_fetch(job, self._store, options).row(options.final, options.ledger)
        except (SceneError, StoreError, TooLargeError) as error:
            return "error", error
        except MemoryError:
            return "failed", "out of memory; use fewer workers"
        except (BrokenPipeError, ConnectionResetError):  # of a notice: the parent has ended
            raise
        except Exception as error:  # noqa: BLE001, the parent reports it with the run
            return "failed", _located(error)
        finally:
            signal.signal(signal.SIGINT, signal.SIG_IGN)

    def close(self) -> None:
        """Close the store."""
        if self._store is not None:
            self._store.close()


def raise_once() -> Callable[[int, FrameType | None], None]:
    """Return a signal handler that raises KeyboardInterrupt for the first signal only.

    The parent repeats its signal: a second exception would interrupt the clean-up after the first.
    """
    is_raised = False

    def handle(_number: int, _frame: FrameType | None) -> None:
        nonlocal is_raised
        if not is_raised:
            is_raised = True
            raise KeyboardInterrupt

    return handle


def _exit_with_parent() -> None:
    """Wait for the end of the parent; then interrupt the job, and exit if that does not end this process."""
    parent = parent_process()
    assert parent is not None
    wait([parent.sentinel])
    until = monotonic() + SHUTDOWN_TIME
    while monotonic() < until:
        os.kill(os.getpid(), signal.SIGINT)  # between two jobs it is ignored, and the closed pipe ends this process
        sleep(INTERRUPT_INTERVAL)
    os._exit(1)


def _located(error: Exception) -> str:
    """Return an internal error in one line, with the line of code that raised it."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    where = f"{Path(frame.filename).name}:{frame.lineno}"
    return f"internal error: {type(error).__name__} in {where}: {str(error)[:200]}; run with --workers 1 to see more"
