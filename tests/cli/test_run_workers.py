"""`sandbox run --workers N`: equal runs and store; interrupts, dying workers, errors in workers."""

import os
import re
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from time import monotonic, sleep
from typing import Any, NoReturn

import pytest

from sandbox.batch import executors, process_pool
from sandbox.batch.job import CompletedRun, Job, run_job
from sandbox.batch.store import Store
from sandbox.trajectory import Trajectory
from tests.cli.calling import DROP, SPARKS, document_of, json_of, lines_of, write_scene
from tests.interruptible import interrupted, interruptible, worker_processes

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

TIMING_KEYS = ("seconds", "steps_per_second", "realtime_factor")
"""Keys of a row that depend on the machine."""


def test_runs_with_workers_are_equal_to_runs_without(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    sweep = ("--sweep", "ball.a.position=[0,1],[0,2],[0,3]", "--seeds", "2")
    words = ("run", write_scene(tmp_path, DROP + SPARKS), *sweep)
    serial_runs = json_of(capfd, *words)[1]["runs"]
    status, document, _ = json_of(capfd, *words, "--workers", "3", "--out", str(tmp_path / "runs"))
    assert status == 0
    for serial, parallel in zip(serial_runs, document["runs"], strict=True):
        assert {key: value for key, value in serial.items() if key not in (*TIMING_KEYS, "path")} == {
            key: value for key, value in parallel.items() if key not in (*TIMING_KEYS, "path")
        }
    with Store(tmp_path / "runs") as store:
        rows = {row.id: row for row in store.rows()}
        assert set(rows) == {run["id"] for run in serial_runs}
        for run in document["runs"]:
            assert Path(run["path"]) == store.file(rows[run["id"]])
            assert Trajectory.load(run["path"]).info["state_hash"] == run["state_hash"]


def test_interrupt_ends_workers_and_keeps_finished_runs(tmp_path: Path) -> None:
    scene, folder = write_scene(tmp_path, DROP.replace("duration = 0.5", "duration = 20.0") + SPARKS), tmp_path / "runs"
    words = ["run", scene, "--seeds", "500", "--workers", "2", "--json", "--out", str(folder)]
    status, out, err = interrupted(words, lambda: len(list(folder.glob("*.npz"))) >= 3)
    assert status == 130, err
    message = re.fullmatch(r"interrupted: (\d+) of 500 runs are complete and kept\n", err)
    assert message is not None, err  # no traceback
    runs = document_of(out)["runs"]
    assert len(runs) == int(message[1]) < 500
    with Store(folder) as store:
        rows = store.rows()
        assert {run["id"] for run in runs} <= {row.id for row in rows}  # a run may be stored after the last report
        assert all(Trajectory.load(store.file(row)).status == "ok" for row in rows)
    assert {path.name for path in folder.iterdir()} == {"runs.sqlite", *(row.path for row in rows)}


def pid_file(folder: Path) -> Path:
    return folder / "pids"


def die(job: Job, *_: object) -> NoReturn:
    """Replacement of `run_job`: record the attempt in a file and die by a signal."""
    with pid_file(Path(job.label).parent).open("a") as stream:
        stream.write(f"{os.getpid()}\n")
    os.kill(os.getpid(), signal.SIGSEGV if job.scene.world.seed == 2 else signal.SIGKILL)
    raise AssertionError("still alive")


def die_once(job: Job, *args: Any) -> CompletedRun:
    """Replacement of `run_job`: die only at the first attempt."""
    return run_job(job, *args) if pid_file(Path(job.label).parent).exists() else die(job, *args)


@pytest.fixture
def replace_run_job(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[..., CompletedRun]], None]:
    """Return a function that replaces `run_job` in all workers."""

    def replace(function: Callable[..., CompletedRun]) -> None:
        # A worker imports the function by its module; this folder is on its path.
        monkeypatch.setattr(process_pool, "serve", partial(serve_with, function))

    return replace


def serve_with(function: Callable[..., CompletedRun], pipe: Any) -> None:
    executors.run_job = function  # type: ignore[assignment]
    process_pool.serve(pipe)


def test_run_whose_worker_is_killed_is_repeated(tmp_path, capfd, replace_run_job):
    replace_run_job(die_once)
    words = ("run", write_scene(tmp_path, DROP + SPARKS), "--seeds", "4", "--workers", "2")
    status, document, err = json_of(capfd, *words)
    assert (status, err) == (0, [])
    assert [run["status"] for run in document["runs"]] == ["ok"] * 4
    assert pid_file(tmp_path).exists()


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


@contextmanager
def running_workers(tmp_path: Path) -> Iterator[tuple["subprocess.Popen[str]", list[int]]]:
    """Run a command with three workers in the middle of long runs; yield it and the pids of the workers."""
    long = DROP.replace("duration = 0.5", "duration = 20_000.0") + SPARKS + "[solver]\nrecord_every = 1000\n"
    folder = tmp_path / "runs"
    words = interruptible("run", write_scene(tmp_path, long), "--seeds", "9", "--workers", "3", "--out", str(folder))
    pipe = subprocess.PIPE
    with subprocess.Popen(words, stdout=pipe, stderr=pipe, text=True) as command:
        pids: list[int] = []
        try:
            wait_until(lambda: len(worker_processes(command.pid)) == 3)
            pids = worker_processes(command.pid)
            # A worker that serves is the leader of its own session.
            wait_until(lambda: all(os.getsid(pid) == pid for pid in pids))
            yield command, pids
        finally:
            for pid in (command.pid, *pids):
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)


def wait_until(ready: Callable[[], bool]) -> None:
    deadline = monotonic() + 120.0
    while not ready():
        assert monotonic() < deadline
        sleep(0.02)


@pytest.mark.nightly
def test_interrupt_ends_workers_that_are_stopped(tmp_path: Path) -> None:
    with running_workers(tmp_path) as (command, pids):
        for pid in pids:
            os.kill(pid, signal.SIGSTOP)
        command.send_signal(signal.SIGINT)
        _, err = command.communicate(timeout=120)
        assert command.returncode == 130, err
        assert err.startswith("interrupted: 0 of 9")
        assert not any(map(is_alive, pids))
    assert {path.name for path in (tmp_path / "runs").iterdir()} == {"runs.sqlite"}


@pytest.mark.nightly
@pytest.mark.parametrize("sent_signal", [signal.SIGTERM, signal.SIGKILL])
def test_workers_end_with_their_parent_in_the_middle_of_a_run(tmp_path: Path, sent_signal: signal.Signals) -> None:
    with running_workers(tmp_path) as (command, pids):
        command.send_signal(sent_signal)
        command.communicate(timeout=120)
        wait_until(lambda: not any(map(is_alive, pids)))


def test_failed_store_ends_the_command_with_status_2(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene, folder = write_scene(tmp_path), tmp_path / "runs"
    _, document, _ = json_of(capfd, "run", scene, "--out", str(folder))
    path = Path(document["runs"][0]["path"])
    path.unlink()
    path.mkdir()
    words = ("--sweep", "world.seed=0,7", "--workers", "2", "--quiet")
    status, _, err = lines_of(capfd, "run", scene, "--out", str(folder), *words)
    assert status == 2
    assert "Is a directory" in err[-1]
