"""Isolated workers: a task that hangs, exhausts memory, aborts or crashes fails with its reason; the next one runs."""

import sys
from pathlib import Path

import pytest

from sandbox.measure.extremes.isolation import MAX_ATTEMPTS, IsolatedWorker, WorkerError
from sandbox.measure.extremes.outcome import Task

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

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


def isolated_worker(folder: Path, seconds: float = 20.0) -> IsolatedWorker:
    script = folder / "worker.py"
    script.write_text(MISBEHAVING, encoding="utf-8")
    return IsolatedWorker(seconds, 1024, [sys.executable, str(script), str(folder / "marks")])


def task(case: str) -> Task:
    return Task(case, {}, "pymunk")


def test_every_failure_is_reported_and_the_next_task_runs(tmp_path: Path) -> None:
    outcomes = {}
    with isolated_worker(tmp_path) as worker:
        for case in ("well", "memory", "abort", "crash", "quit", "chatter", "raise"):
            outcome = worker.submit(task(case))
            outcomes[case] = outcome.verdict, outcome.rule, outcome.reason
            assert worker.submit(task("well")).verdict == "exact"
        assert worker.started == 5  # the first, and one after each crash
    assert outcomes["well"] == outcomes["chatter"] == ("exact", None, "well")
    assert outcomes["memory"] == ("failed", "process", "out of memory")
    assert outcomes["abort"] == ("failed", "process", "the process was killed by SIGABRT: Aborting: it was too much")
    assert outcomes["crash"] == ("failed", "process", "the process was killed by SIGSEGV")
    assert outcomes["quit"] == ("failed", "process", "the process ended with status 3")
    assert outcomes["raise"][2].endswith("ValueError: made up")


def test_task_whose_worker_is_killed_from_outside_is_repeated(tmp_path: Path) -> None:
    with isolated_worker(tmp_path) as worker:
        assert worker.submit(task("killed once")).verdict == "exact"
        assert worker.started == 2
        (tmp_path / "marks").unlink()
        outcome = worker.submit(task("killed"))
        assert (outcome.verdict, outcome.reason) == ("failed", "the process was killed by SIGKILL")
        assert (tmp_path / "marks").read_text() == "!" * MAX_ATTEMPTS
        assert worker.submit(task("well")).verdict == "exact"


def test_task_that_hangs_is_stopped_at_the_time_limit(tmp_path: Path) -> None:
    with isolated_worker(tmp_path, seconds=0.5) as worker:
        for case in ("sleep", "stop"):  # or whose process a signal stops
            outcome = worker.submit(task(case))
            assert outcome.reason == "took longer than 0.5 s, and was stopped"
            assert (outcome.verdict, outcome.rule, outcome.slow) == ("failed", "process", True)
            assert worker.submit(task("well")).verdict == "exact"


def test_worker_that_cannot_start_raises_with_its_last_output() -> None:
    command = [sys.executable, "-c", "raise SystemExit('no such thing')"]
    with IsolatedWorker(5.0, 1024, command) as worker, pytest.raises(WorkerError, match="status 1: no such thing"):
        worker.submit(task("well"))


@pytest.mark.parametrize("kills", [1, MAX_ATTEMPTS])
def test_worker_that_is_killed_while_it_starts_is_started_again(kills: int, tmp_path: Path) -> None:
    script = tmp_path / "worker.py"
    die = "marks = open(sys.argv[1], 'a+')\ncount = marks.tell()\nmarks.write('!')\nmarks.close()\n"
    die += f"if count < {kills}:\n    os.kill(os.getpid(), 9)\n"
    script.write_text(MISBEHAVING.replace("serve(answer", f"{die}serve(answer"), encoding="utf-8")
    with IsolatedWorker(20.0, 1024, [sys.executable, str(script), str(tmp_path / "marks")]) as worker:
        if kills < MAX_ATTEMPTS:
            assert worker.submit(task("well")).verdict == "exact"
            assert worker.started == kills + 1
        else:
            with pytest.raises(WorkerError, match="SIGKILL") as caught:
                worker.submit(task("well"))
            assert caught.value.was_killed


def test_submit_to_a_closed_worker_raises_interrupted_error(tmp_path: Path) -> None:
    worker = isolated_worker(tmp_path)
    worker.close()
    with pytest.raises(InterruptedError):
        worker.submit(task("well"))
