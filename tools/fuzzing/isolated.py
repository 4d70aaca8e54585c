"""Isolated cases: worker processes that run one case after the other with limits on CPU time and memory.

A worker is a Python process in which warnings are errors. The parent waits for the answer to each case and starts
another worker if one died or exceeded a limit. Limits are those of POSIX (`resource`); on other systems only the wall
clock limits a case.
"""

import faulthandler
import gc
import importlib
import json
import math
import os
import queue
import re
import signal
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from sandbox.worker_process import MEBIBYTE, ProcessEndedError, WorkerProcess, limit_memory, private_stdout

try:
    import resource
except ImportError:  # not on Windows
    resource = None  # type: ignore[assignment]

ROOT = Path(__file__).resolve().parents[2]
MAX_DETAIL = 8000  # characters of a traceback that are kept

Kind = Literal["ok", "refused", "traceback", "violation", "abort", "hang", "memory"]
FAILURES: frozenset[Kind] = frozenset({"traceback", "violation", "abort", "hang", "memory"})
UNCERTAIN: frozenset[Kind] = frozenset({"hang", "memory"})
"""Possible effects of compiling or of the memory of earlier cases; they count only if a fresh worker confirms them."""


class Violation(AssertionError):  # noqa: N818, a finding, not an error of the reporting program
    """A check of a result failed. `check` names the check; failures are grouped by it."""

    def __init__(self, check: str, detail: str) -> None:
        super().__init__(f"{check}: {detail}")
        self.check = check


@dataclass(frozen=True)
class Limits:
    """Limits on the resources of one case."""

    cpu: float = 20.0
    """CPU time of one stage (loading, the run of one engine, a check), s"""
    memory: int = 4 * 2**30
    """address space of the worker, bytes"""

    @property
    def wall(self) -> float:
        """Wall-clock time of one case, s; several times the CPU time, because machines are shared."""
        return 12.0 * self.cpu + 30.0


@dataclass(frozen=True)
class Case:
    """A function and its argument, a JSON value."""

    function: str
    """`module:name`; tools/ is on the path"""
    argument: Any
    about: str = ""

    def to_json(self) -> str:
        """Return the case as the text of a case file."""
        return json.dumps({"function": self.function, "argument": self.argument, "about": self.about}, indent=1) + "\n"

    @classmethod
    def load(cls, path: Path) -> "Case":
        """Read a case file."""
        document = json.loads(path.read_text(encoding="utf-8"))
        return cls(document["function"], document["argument"], document.get("about", ""))


@dataclass(frozen=True)
class Outcome:
    """Result of a case."""

    kind: Kind
    what: str = ""
    """type of the error, name of the check, or signal"""
    location: str = ""
    """innermost frame in the package, `file:line in function`"""
    detail: str = ""
    """traceback, or the last lines of standard error"""
    cpu: float = 0.0
    """CPU time if the worker survived, s"""

    @property
    def failed(self) -> bool:
        """Whether the case failed."""
        return self.kind in FAILURES

    @property
    def group(self) -> str:
        """Key by which failures are grouped."""
        return " ".join(part for part in (self.kind, self.what, self.location) if part)


# --- the worker -----------------------------------------------------------------------------------------------------


def serve(limits: Limits) -> None:
    """Run the cases on standard input, one JSON line each; answer each with a JSON line."""
    replies = private_stdout()
    faulthandler.enable()
    if resource is not None:
        limit_memory(limits.memory // MEBIBYTE)
        faulthandler.register(signal.SIGXCPU, chain=True)  # writes the stack; the default action then ends the process
    unraisable: list[BaseException] = []
    sys.unraisablehook = lambda hooked: unraisable.append(hooked.exc_value or AssertionError(str(hooked.err_msg)))
    global _stage_limit
    _stage_limit = limits.cpu
    for line in sys.stdin:
        case = json.loads(line)
        module, _, name = case["function"].partition(":")
        function = getattr(importlib.import_module(module), name)
        unraisable.clear()
        start_time = time.process_time()
        begin_stage()
        outcome = _outcome(function, case["argument"], unraisable)
        outcome["cpu"] = time.process_time() - start_time
        replies.write(json.dumps(outcome) + "\n")


_stage_limit: float | None = None
"""CPU time limit of one stage, s, if this process is a worker."""


def begin_stage() -> None:
    """Begin another stage of the current case: the limit of CPU time applies to each stage."""
    if resource is not None and _stage_limit is not None:
        soft = math.ceil(time.process_time() + _stage_limit)
        resource.setrlimit(resource.RLIMIT_CPU, (soft, resource.getrlimit(resource.RLIMIT_CPU)[1]))


def extend_cpu_limit(seconds: int) -> None:
    """Raise the CPU time limit of the current case, for example for compiling, which is done once."""
    if resource is not None:
        soft, hard = resource.getrlimit(resource.RLIMIT_CPU)
        if soft != resource.RLIM_INFINITY:
            resource.setrlimit(resource.RLIMIT_CPU, (soft + seconds, hard))


def _outcome(function: Any, argument: Any, unraisable: list[BaseException]) -> dict[str, Any]:
    try:
        refused = function(argument)
        if unraisable:
            raise unraisable[0]
    except MemoryError as error:
        return {"kind": "memory", **_description(error)}
    except Violation as violation:
        return {"kind": "violation", **_description(violation), "what": violation.check, "location": ""}
    except BaseException as error:  # noqa: BLE001, any exception is the outcome of the case
        return {"kind": "traceback", **_description(error)}
    finally:
        gc.collect(1)
    return {"kind": "refused", "what": refused} if refused else {"kind": "ok"}


def _description(error: BaseException) -> dict[str, str]:
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if _is_ours(frame.filename)]
    location = f"{_short(frames[-1].filename)}:{frames[-1].lineno} in {frames[-1].name}" if frames else ""
    detail = "".join(traceback.format_exception(error, limit=-12))
    return {"what": type(error).__name__, "location": location, "detail": detail[-MAX_DETAIL:]}


def _is_ours(file: str) -> bool:
    return "/sandbox/" in file.replace("\\", "/") and "site-packages" not in file


def _short(file: str) -> str:
    return "sandbox/" + file.replace("\\", "/").rpartition("/sandbox/")[2]


# --- the parent -----------------------------------------------------------------------------------------------------


class Worker:
    """A worker process, restarted if it dies."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._process: WorkerProcess | None = None

    def run(self, case: Case) -> Outcome:
        """Run one case; a hang or a lack of memory is confirmed in a fresh worker."""
        outcome = self._attempt(case)
        if outcome.kind in UNCERTAIN:
            self._end()
            outcome = self._attempt(case)
        if outcome.kind == "memory":
            self._end()
        return outcome

    def stop(self) -> None:
        """Kill the process."""
        self._end()

    def interrupt(self) -> None:
        """Kill the process from another thread; its current case fails."""
        process = self._process
        if process is not None:
            process.kill()

    def _attempt(self, case: Case) -> Outcome:
        process = self._process or self._begin()
        try:
            process.send({"function": case.function, "argument": case.argument})
            return Outcome(**process.receive(self._limits.wall))
        except TimeoutError:
            process.send_signal(signal.SIGABRT)  # faulthandler writes the stack
            return self._post_mortem(process, timed_out=True)
        except ProcessEndedError:
            return self._post_mortem(process, timed_out=False)

    def _begin(self) -> WorkerProcess:
        code = (
            "from tools.fuzzing.isolated import Limits, serve; "
            f"serve(Limits({self._limits.cpu!r}, {self._limits.memory!r}))"
        )
        path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
        self._process = WorkerProcess([sys.executable, "-W", "error", "-c", code], {"PYTHONPATH": path})
        return self._process

    def _post_mortem(self, process: WorkerProcess, timed_out: bool) -> Outcome:
        """Return the outcome of a process that died."""
        try:
            status = process.exit_code(10.0)
        except subprocess.TimeoutExpired:
            status = 0
        text = process.error_output()
        self._end()
        found = re.search(r'File "([^"]*/sandbox/(?!.*site-packages)[^"]*)", line (\d+) in (\S+)', text)
        location = f"{_short(found[1])}:{found[2]} in {found[3]}" if found else ""
        if timed_out or (hasattr(signal, "SIGXCPU") and status == -signal.SIGXCPU):
            return Outcome("hang", "", location, text[-MAX_DETAIL:])
        name = signal.Signals(-status).name if status < 0 else f"exit {status}"
        short_of_memory = "MemoryError" in text or "bad_alloc" in text
        return Outcome("memory" if short_of_memory else "abort", name, location, text[-MAX_DETAIL:])

    def _end(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.end()


def run_cases(cases: Iterable[Case], limits: Limits, workers: int = 2) -> Iterator[tuple[Case, Outcome]]:
    """Yield each case with its outcome, in the order of completion. Closing the iterator ends the workers."""
    source, lock, stop = iter(cases), threading.Lock(), threading.Event()
    results: queue.Queue[tuple[Case, Outcome] | BaseException | None] = queue.Queue(maxsize=4 * workers)
    pool = [Worker(limits) for _ in range(workers)]

    def work(worker: Worker) -> None:
        try:
            while not stop.is_set():
                with lock:
                    case = next(source, None)
                if case is None:
                    break
                outcome = worker.run(case)
                if not stop.is_set():
                    results.put((case, outcome))
        except BaseException as error:  # noqa: BLE001, raised again by the iterator
            results.put(error)
        finally:
            worker.stop()
            results.put(None)

    threads = [threading.Thread(target=work, args=(worker,), daemon=True) for worker in pool]
    for thread in threads:
        thread.start()
    try:
        running = workers
        while running:
            item = results.get()
            if item is None:
                running -= 1
            elif isinstance(item, BaseException):
                raise item
            else:
                yield item
    finally:
        stop.set()
        for worker in pool:
            worker.interrupt()
        while any(thread.is_alive() for thread in threads):
            try:
                results.get(timeout=0.05)
            except queue.Empty:
                continue


@dataclass(frozen=True)
class Failure:
    """Cases that failed at the same location."""

    count: int
    case: Case
    """the smallest case"""
    outcome: Outcome

    def joined_by(self, case: Case, outcome: Outcome) -> "Failure":
        """Return this failure with one more case."""
        if len(case.to_json()) < len(self.case.to_json()):
            return Failure(self.count + 1, case, outcome)
        return replace(self, count=self.count + 1)
