"""Isolated cases: worker processes that run one case after the other under limits of CPU time and memory.

A worker is a Python process in which warnings are errors. The parent waits for the answer to each case, and starts
another worker where one died or exceeded a limit. Limits are those of POSIX (`resource`); elsewhere only the wall
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
import tempfile
import threading
import time
import traceback
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

try:
    import resource
except ImportError:  # not on Windows
    resource = None  # type: ignore[assignment]

ROOT = Path(__file__).resolve().parents[2]
MAX_DETAIL = 8000  # characters of a traceback that are kept

Kind = Literal["ok", "refused", "traceback", "violation", "abort", "hang", "memory"]
FAILURES: frozenset[Kind] = frozenset({"traceback", "violation", "abort", "hang", "memory"})
UNCERTAIN: frozenset[Kind] = frozenset({"hang", "memory"})
"""They may come of compiling, or of the memory of earlier cases: they count where a fresh worker confirms them."""


class Violation(AssertionError):  # noqa: N818, a finding, not an error of the program that reports it
    """A check of a result failed. `check` names the check; failures are grouped by it."""

    def __init__(self, check: str, detail: str) -> None:
        super().__init__(f"{check}: {detail}")
        self.check = check


@dataclass(frozen=True)
class Limits:
    """What one case may use."""

    cpu: float = 20.0
    """s of CPU time of one stage: loading, the run of one engine, a check"""
    memory: int = 4 * 2**30
    """bytes of address space of the worker"""

    @property
    def wall(self) -> float:
        """Seconds by the clock; several times the CPU time, as machines are shared."""
        return 12.0 * self.cpu + 30.0


@dataclass(frozen=True)
class Case:
    """A function and the JSON value that it is called with."""

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
    """How a case ended."""

    kind: Kind
    what: str = ""
    """type of the error, name of the check, or signal"""
    place: str = ""
    """innermost frame in the package, `file:line in function`"""
    detail: str = ""
    """traceback, or the last lines of standard error"""
    cpu: float = 0.0
    """s of CPU time, where the worker survived"""

    @property
    def failed(self) -> bool:
        """Whether the case broke something."""
        return self.kind in FAILURES

    @property
    def group(self) -> str:
        """By what failures are grouped."""
        return " ".join(part for part in (self.kind, self.what, self.place) if part)


# --- the worker -----------------------------------------------------------------------------------------------------


def serve(limits: Limits) -> None:
    """Run the cases that arrive on standard input, one JSON line each; answer with one JSON line each."""
    replies = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what a case prints is no answer
    faulthandler.enable()
    if resource is not None:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_AS, (limits.memory, limits.memory))
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
        began = time.process_time()
        begin_stage()
        outcome = _outcome(function, case["argument"], unraisable)
        outcome["cpu"] = time.process_time() - began
        replies.write(json.dumps(outcome) + "\n")
        replies.flush()


_stage_limit: float | None = None
"""s of CPU time of one stage of a case, where this process is a worker"""


def begin_stage() -> None:
    """Begin another stage of the present case: the limit of CPU time is of each stage."""
    if resource is not None and _stage_limit is not None:
        soft = math.ceil(time.process_time() + _stage_limit)
        resource.setrlimit(resource.RLIMIT_CPU, (soft, resource.getrlimit(resource.RLIMIT_CPU)[1]))


def extend_cpu_limit(seconds: int) -> None:
    """Let the present case use more CPU time, as for compiling, which is done once."""
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
        return {"kind": "memory", **_told(error)}
    except Violation as violation:
        return {"kind": "violation", **_told(violation), "what": violation.check, "place": ""}
    except BaseException as error:  # noqa: BLE001, whatever leaves a case is its outcome
        return {"kind": "traceback", **_told(error)}
    finally:
        gc.collect(1)
    return {"kind": "refused", "what": refused} if refused else {"kind": "ok"}


def _told(error: BaseException) -> dict[str, str]:
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if _is_ours(frame.filename)]
    place = f"{_short(frames[-1].filename)}:{frames[-1].lineno} in {frames[-1].name}" if frames else ""
    detail = "".join(traceback.format_exception(error, limit=-12))
    return {"what": type(error).__name__, "place": place, "detail": detail[-MAX_DETAIL:]}


def _is_ours(file: str) -> bool:
    return "/sandbox/" in file.replace("\\", "/") and "site-packages" not in file


def _short(file: str) -> str:
    return "sandbox/" + file.replace("\\", "/").rpartition("/sandbox/")[2]


# --- the parent -----------------------------------------------------------------------------------------------------


class Worker:
    """A worker process, restarted where it dies."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._process: subprocess.Popen[str] | None = None
        self._complaints = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115, closed in stop

    def run(self, case: Case) -> Outcome:
        """Run one case; a hang and a lack of memory are confirmed in a fresh worker."""
        outcome = self._attempt(case)
        if outcome.kind in UNCERTAIN:
            self._end()
            outcome = self._attempt(case)
        if outcome.kind == "memory":
            self._end()
        return outcome

    def stop(self) -> None:
        """End the process, whatever it does."""
        self._end()
        self._complaints.close()

    def interrupt(self) -> None:
        """End the process from another thread; the case that it runs fails."""
        process = self._process
        if process is not None:
            process.kill()

    def _attempt(self, case: Case) -> Outcome:
        process = self._process or self._begin()
        assert process.stdin is not None
        assert process.stdout is not None
        late = threading.Event()

        def end_late() -> None:
            late.set()
            process.send_signal(signal.SIGABRT)  # faulthandler writes the stack

        timer = threading.Timer(self._limits.wall, end_late)
        timer.start()
        try:
            process.stdin.write(json.dumps({"function": case.function, "argument": case.argument}) + "\n")
            process.stdin.flush()
            line = process.stdout.readline()
        except OSError:
            line = ""
        finally:
            timer.cancel()
        if line:
            return Outcome(**json.loads(line))
        return self._post_mortem(late.is_set())

    def _begin(self) -> subprocess.Popen[str]:
        self._complaints.seek(0)
        self._complaints.truncate()
        code = (
            "from tools.fuzzing.isolated import Limits, serve; "
            f"serve(Limits({self._limits.cpu!r}, {self._limits.memory!r}))"
        )
        path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
        self._process = subprocess.Popen(
            [sys.executable, "-W", "error", "-c", code],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._complaints,
            text=True,
            encoding="utf-8",
            env={**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"},
            start_new_session=True,  # Ctrl-C is the parent's
        )
        return self._process

    def _post_mortem(self, late: bool) -> Outcome:
        """Say what a process died of."""
        process = self._process
        assert process is not None
        try:
            status = process.wait(10)
        except subprocess.TimeoutExpired:
            status = 0
        self._end()
        self._complaints.seek(0)
        text = self._complaints.read()
        found = re.search(r'File "([^"]*/sandbox/(?!.*site-packages)[^"]*)", line (\d+) in (\S+)', text)
        place = f"{_short(found[1])}:{found[2]} in {found[3]}" if found else ""
        if late or (hasattr(signal, "SIGXCPU") and status == -signal.SIGXCPU):
            return Outcome("hang", "", place, text[-MAX_DETAIL:])
        name = signal.Signals(-status).name if status < 0 else f"exit {status}"
        short_of_memory = "MemoryError" in text or "bad_alloc" in text
        return Outcome("memory" if short_of_memory else "abort", name, place, text[-MAX_DETAIL:])

    def _end(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            for stream in (process.stdin, process.stdout):
                if stream is not None:
                    try:
                        stream.close()
                    except BrokenPipeError:  # a request that nobody will read
                        continue


def run_cases(cases: Iterable[Case], limits: Limits, workers: int = 2) -> Iterator[tuple[Case, Outcome]]:
    """Yield each case with its outcome, in the order in which they end. Closing the iterator ends the workers."""
    source, lock, stop = iter(cases), threading.Lock(), threading.Event()
    ended: queue.Queue[tuple[Case, Outcome] | BaseException | None] = queue.Queue(maxsize=4 * workers)
    crew = [Worker(limits) for _ in range(workers)]

    def work(worker: Worker) -> None:
        try:
            while not stop.is_set():
                with lock:
                    case = next(source, None)
                if case is None:
                    break
                outcome = worker.run(case)
                if not stop.is_set():
                    ended.put((case, outcome))
        except BaseException as error:  # noqa: BLE001, raised again by the iterator
            ended.put(error)
        finally:
            worker.stop()
            ended.put(None)

    threads = [threading.Thread(target=work, args=(worker,), daemon=True) for worker in crew]
    for thread in threads:
        thread.start()
    try:
        left = workers
        while left:
            item = ended.get()
            if item is None:
                left -= 1
            elif isinstance(item, BaseException):
                raise item
            else:
                yield item
    finally:
        stop.set()
        for worker in crew:
            worker.interrupt()
        while any(thread.is_alive() for thread in threads):
            try:
                ended.get(timeout=0.05)
            except queue.Empty:
                continue


@dataclass(frozen=True)
class Failure:
    """Cases that failed at the same place."""

    count: int
    case: Case
    """the smallest of them"""
    outcome: Outcome

    def joined_by(self, case: Case, outcome: Outcome) -> "Failure":
        """Return these and one more."""
        if len(case.to_json()) < len(self.case.to_json()):
            return Failure(self.count + 1, case, outcome)
        return replace(self, count=self.count + 1)
