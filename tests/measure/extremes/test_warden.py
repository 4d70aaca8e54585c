"""Wardens: a task that hangs, eats memory, aborts or crashes is told with its reason, and the next one runs."""

import sys
from pathlib import Path

import pytest

from sandbox.measure.extremes.cell import Task
from sandbox.measure.extremes.confine import cause_of_death
from sandbox.measure.extremes.warden import ATTEMPTS, Warden, WorkerError

MISBEHAVING = """
import ctypes, os, signal, sys, time
from sandbox.measure.extremes.worker import serve

def answer(task):
    match task["case"]:
        case "sleep":
            time.sleep(60)
        case "memory":
            bytearray(4 * 2**30)
        case "abort":
            print("Aborting: it was too much", file=sys.stderr, flush=True)
            os.abort()
        case "crash":
            ctypes.string_at(0)
        case "quit":
            os._exit(3)
        case "chatter":
            print("this is no answer", flush=True)
            os.write(1, b"nor is this\\n")
        case "stop":
            os.kill(os.getpid(), signal.SIGSTOP)
        case "killed" | "killed once" as case:
            marks = open(sys.argv[1], "a+")
            first = not marks.tell()
            marks.write("!")
            marks.close()
            if first or case == "killed":
                os.kill(os.getpid(), 9)
        case "raise":
            raise ValueError("made up")
    return {"verdict": "exact", "reason": "well"}

serve(answer, 1024)
"""


def warden(folder: Path, seconds: float = 20.0) -> Warden:
    script = folder / "worker.py"
    script.write_text(MISBEHAVING, encoding="utf-8")
    return Warden(seconds, 1024, [sys.executable, str(script), str(folder / "marks")])


def task(case: str) -> Task:
    return Task(case, {}, "pymunk")


def test_whatever_happens_is_told_and_the_run_goes_on(tmp_path: Path) -> None:
    told = {}
    with warden(tmp_path) as keeper:
        for case in ("well", "memory", "abort", "crash", "quit", "chatter", "raise"):
            outcome = keeper.ask(task(case))
            told[case] = outcome.verdict, outcome.rule, outcome.reason
            assert keeper.ask(task("well")).verdict == "exact"
        assert keeper.started == 5  # the first, and one after each death
    assert told["well"] == told["chatter"] == ("exact", None, "well")
    assert told["memory"] == ("failed", "process", "out of memory")
    assert told["abort"] == ("failed", "process", "the process was killed by SIGABRT: Aborting: it was too much")
    assert told["crash"] == ("failed", "process", "the process was killed by SIGSEGV")
    assert told["quit"] == ("failed", "process", "the process ended with status 3")
    assert told["raise"][2].endswith("ValueError: made up")


def test_task_whose_worker_is_killed_from_outside_is_asked_again(tmp_path: Path) -> None:
    with warden(tmp_path) as keeper:
        assert keeper.ask(task("killed once")).verdict == "exact"
        assert keeper.started == 2
        (tmp_path / "marks").unlink()
        outcome = keeper.ask(task("killed"))
        assert (outcome.verdict, outcome.reason) == ("failed", "the process was killed by SIGKILL")
        assert (tmp_path / "marks").read_text() == "!" * ATTEMPTS
        assert keeper.ask(task("well")).verdict == "exact"


def test_worker_that_is_stopped_is_ended_in_time(tmp_path: Path) -> None:
    with warden(tmp_path, seconds=0.5) as keeper:
        assert keeper.ask(task("well")).verdict == "exact"
        assert keeper.ask(task("stop")).slow
        assert keeper.ask(task("well")).verdict == "exact"


def test_task_that_hangs_is_stopped_in_time(tmp_path: Path) -> None:
    with warden(tmp_path, seconds=0.5) as keeper:
        outcome = keeper.ask(task("sleep"))
        assert outcome.reason == "took longer than 0.5 s, and was stopped"
        assert (outcome.verdict, outcome.rule, outcome.slow) == ("failed", "process", True)
        assert keeper.ask(task("well")).verdict == "exact"


def test_worker_that_cannot_start_is_an_error_with_its_last_words() -> None:
    command = [sys.executable, "-c", "raise SystemExit('no such thing')"]
    with Warden(5.0, 1024, command) as keeper, pytest.raises(WorkerError, match="status 1: no such thing"):
        keeper.ask(task("well"))


def test_closed_warden_interrupts_who_asks(tmp_path: Path) -> None:
    keeper = warden(tmp_path)
    keeper.close()
    with pytest.raises(InterruptedError):
        keeper.ask(task("well"))


def test_causes_of_death_have_names() -> None:
    assert cause_of_death(-9) == "the process was killed by SIGKILL"
    assert cause_of_death(-64) in ("the process was killed by SIGRTMAX", "the process was killed by signal 64")
    assert cause_of_death(1) == "the process ended with status 1"
