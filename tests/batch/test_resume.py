"""Sweeps that are killed: each resume makes exactly the runs that are missing; two drivers share a folder."""

import os
import random
import signal
import sqlite3
import subprocess
import sys
from contextlib import closing
from functools import partial
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import numpy as np
import pytest

from sandbox.batch import executors, process_pool
from sandbox.batch.job import CompletedRun, Job, run_job
from sandbox.batch.store import Store
from sandbox.cli.main import call
from sandbox.trajectory import Trajectory
from tests.environment import with_root_on_path
from tests.interruptible import worker_processes

SCENE = """
title = "Sparks"
world = { duration = 0.2, gravity = [0.0, -10.0] }
plane = [{ point = [0.0, 0.0], normal = [0.0, 1.0], restitution = 0.8 }]
[[emitter]]
position = [0.0, 1.0]
count = 5
velocity_min = [-1.0, -1.0]
velocity_max = [1.0, 1.0]
"""
SCRIPT = "import sys; from tests.batch.test_resume import main; main(sys.argv[1], sys.argv[2:])"


def main(log: str, words: list[str]) -> None:
    """Call the command line with workers that note each run that they begin."""
    process_pool.serve = partial(serve_with_log, log)  # type: ignore[assignment]
    sys.exit(call(words))


def serve_with_log(log: str, pipe: Any) -> None:
    executors.run_job = partial(note_and_run, log)
    ORIGINAL_SERVE(pipe)


ORIGINAL_SERVE = process_pool.serve


def note_and_run(log: str, job: Job, *more: Any) -> CompletedRun:
    with Path(log).open("a", encoding="ascii") as stream:
        stream.write(f"{job.scene.world.seed}\n")
    return run_job(job, *more)


def start(log: Path, *words: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", SCRIPT, str(log), *words]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, env=with_root_on_path())


def stored(folder: Path) -> list[tuple[int, int, str]]:
    """Return number, seed and creation time of each stored run."""
    if not (folder / "runs.sqlite").is_file():
        return []
    with closing(sqlite3.connect(folder / "runs.sqlite", timeout=60.0)) as database:
        if not database.execute("SELECT count(*) FROM sqlite_master WHERE name = 'runs'").fetchone()[0]:
            return []
        return database.execute("SELECT rowid, seed, created FROM runs ORDER BY rowid").fetchall()


def seeds_of(log: Path) -> list[int]:
    return [int(line) for line in log.read_text().split()] if log.exists() else []


@pytest.fixture
def scene(tmp_path: Path) -> str:
    path = tmp_path / "sparks.toml"
    path.write_text(SCENE)
    return str(path)


@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    ("runs", "times"),
    [pytest.param(60, 2, marks=pytest.mark.fail_slow(60)), pytest.param(400, 19, marks=pytest.mark.nightly)],
)
def test_killed_driver_is_resumed_and_makes_exactly_the_missing_runs(runs, times, scene, tmp_path):
    folder, rng = tmp_path / "runs", random.Random(4)
    words = ("run", scene, "--seeds", str(runs), "--workers", "2", "--out", str(folder), "--quiet")
    kills = sorted(rng.sample(range(1, runs - 5), times))
    for k, count in enumerate((0, *kills)):  # the first one is killed while it starts
        log, before = tmp_path / f"log-{k}", stored(folder)
        with start(log, *words) as process:
            until = monotonic() + 120.0
            wait = rng.uniform(0.0, 0.01)  # so that it is killed at any place of a write
            while len(stored(folder)) < count or (count == 0 and not log.exists()):
                assert process.poll() is None, process.communicate()
                assert monotonic() < until
            sleep(wait)
            process.send_signal(signal.SIGKILL)
            process.communicate()
        assert stored(folder)[: len(before)] == before  # nothing is lost, and nothing was replaced
        repeated = set(seeds_of(log)) & {seed for _, seed, _ in before}
        assert not repeated
    before = stored(folder)
    assert len(before) < runs
    with start(tmp_path / "last", *words) as process:
        _, err = process.communicate()
        assert (process.returncode, err) == (0, "")
    after = stored(folder)
    assert after[: len(before)] == before
    assert sorted(seed for _, seed, _ in after) == list(range(1, runs + 1))
    assert sorted(seeds_of(tmp_path / "last")) == sorted(set(range(1, runs + 1)) - {seed for _, seed, _ in before})
    with Store(folder) as store:
        for row in store.rows():
            file = store.file(row)
            assert file is not None
            assert store.fault_of_file(row) is None
        assert Trajectory.load(file).status == "ok"
    assert {path.suffix for path in folder.iterdir()} == {".npz", ".sqlite"}  # no temporary file is left


@pytest.mark.nightly
def test_worker_killed_by_pid_loses_and_doubles_no_run(scene: str, tmp_path: Path) -> None:
    folder, log = tmp_path / "runs", tmp_path / "log"
    words = ("run", scene, "--seeds", "200", "--workers", "2", "--out", str(folder), "--quiet")
    with start(log, *words) as process:
        killed = 0
        for count in (20, 60, 120):
            while len(stored(folder)) < count:
                assert process.poll() is None
            for pid in worker_processes(process.pid)[:1]:
                os.kill(pid, signal.SIGKILL)
                killed += 1
        _, err = process.communicate()
        assert (process.returncode, err, killed) == (0, "", 3)
    assert sorted(seed for _, seed, _ in stored(folder)) == list(range(1, 201))
    seeds = seeds_of(log)
    assert set(seeds) == set(range(1, 201))
    assert len(seeds) <= 200 + killed  # only the runs that the killed workers were making are made again


@pytest.mark.nightly
def test_two_drivers_on_one_folder_store_each_run_once(scene: str, tmp_path: Path) -> None:
    folder = tmp_path / "runs"
    words = ("run", scene, "--seeds", "120", "--workers", "2", "--out", str(folder), "--quiet")
    drivers = [start(tmp_path / f"log-{k}", *words) for k in range(2)]
    for driver in drivers:
        _, err = driver.communicate()
        assert (driver.returncode, err) == (0, "")
    assert sorted(seed for _, seed, _ in stored(folder)) == list(range(1, 121))
    with Store(folder) as store:
        assert all(store.fault_of_file(row) is None for row in store.rows())


@pytest.mark.nightly
def test_runs_in_this_process_and_in_workers_are_equal_bit_for_bit(scene: str, tmp_path: Path) -> None:
    folders = [tmp_path / name for name in ("one", "two")]
    for folder, more in zip(folders, ([], ["--workers", "2"]), strict=True):
        words = ["run", scene, "--seeds", "20", "--engines", "pymunk,reference", "--out", str(folder), "--quiet"]
        assert call([*words, *more]) == 0
    assert_equal_stores(*folders)


def assert_equal_stores(one: Path, other: Path) -> None:
    """Check that two stores have the same runs, with the same arrays bit for bit."""
    with Store(one) as first, Store(other) as second:
        rows = first.rows()
        assert {row.id for row in rows} == {row.id for row in second.rows()}
        for row in rows:
            same = second.find(row.id)
            files = first.file(row), second.file(same)
            assert files[0] is not None and files[1] is not None
            with np.load(files[0]) as a, np.load(files[1]) as b:
                assert set(a.files) == set(b.files)
                assert all(a[name].tobytes() == b[name].tobytes() for name in a.files if name != "info")
            assert row.state_hash == same.state_hash is not None


@pytest.mark.nightly
def test_ten_thousand_runs_do_not_let_the_driver_grow(scene: str, tmp_path: Path) -> None:
    """Its resident memory after 10,000 runs is that after 1,000, plus what the index of the store takes."""
    script = f"""
import sys, resource
from pathlib import Path
from sandbox.batch import driver
from sandbox.cli.main import call
sizes = []
handle = driver.Driver._store_run
def note(self, *args):
    handle(self, *args)
    sizes.append(int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize())
driver.Driver._store_run = note
words = ["run", {scene!r}, "--set", "world.duration=0.01", "--seeds", "10000", "--workers", "2", "--no-audit"]
status = call([*words, "--keep", "summary", "--out", {str(tmp_path / "runs")!r}, "--quiet"])
print(status, len(sizes), sizes[999], sizes[-1])
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, env=with_root_on_path(), check=True
    )
    status, count, early, late = map(int, done.stdout.split())
    assert (status, count) == (0, 10_000)
    assert late - early < 30e6  # bytes: 10,000 rows of RunRow would take 80 MB; sqlite's cache takes 2 MB
