"""Executors: the same rows from each, an index per job, and workers that are killed or cannot start."""

import os
import pickle
import signal
import sys
import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any, NoReturn

import pytest

from sandbox.batch import executors, worker
from sandbox.batch.executors import Executor, ExecutorError, InProcessExecutor, JobError, ProcessExecutor, Result
from sandbox.batch.job import RunOptions, RunRecord, run_or_fetch
from sandbox.batch.plan import Job
from sandbox.batch.run_row import RunRow
from sandbox.batch.store import Store
from sandbox.scene.files.load import loads

DROP = """
[world]
gravity = [0.0, -10.0]
duration = 0.05
[[ball]]
name = "a"
position = [0, {height}]
radius = 1
"""
LARGE = 50_000_000
"""Bytes of a row, far more than the buffer of a pipe: sending it takes about 10 ms."""


def jobs(count: int) -> list[Job]:
    return [Job(f"drop {k}", loads(DROP.format(height=k)), "pymunk") for k in range(count)]


def results_of(executor: Executor, submitted: list[Job]) -> dict[int, Result]:
    """Run jobs, check that each is reported once under its index, and return the results by index."""
    assert [executor.submit(job) for job in submitted] == list(range(len(submitted)))
    found: list[Result] = []
    executor.wait(found.append)
    assert sorted(result.index for result in found) == list(range(len(submitted)))
    return {result.index: result for result in found}


def reproducible(row: RunRow) -> RunRow:
    """Return a row without the figures that depend on the machine, and without the folder of its store."""
    return replace(row, seconds=None, steps_per_second=None, realtime_factor=None, path=None)


@pytest.mark.full
def test_all_executors_yield_the_same_rows(tmp_path: Path) -> None:
    with Store(tmp_path / "one") as store:
        in_process = results_of(InProcessExecutor(RunOptions(tmp_path / "one"), store), jobs(4))
    in_workers = results_of(ProcessExecutor(RunOptions(tmp_path / "two"), 2), jobs(4))
    for index, result in in_process.items():
        assert result.row.scene == f"drop {index}"
        assert result.record is not None and result.record.trajectory.status == "ok"
        assert in_workers[index].record is None
        assert reproducible(in_workers[index].row) == reproducible(result.row)
        assert Path(in_workers[index].row.path or "").is_file()


def test_jobs_options_and_results_can_be_pickled() -> None:
    (job,) = jobs(1)
    result = results_of(InProcessExecutor(RunOptions()), [job])[0]
    for value in (job, RunOptions(), result.row):
        assert pickle.loads(pickle.dumps(value)) == value


def test_progress_has_the_index_of_the_running_job() -> None:
    states: list[tuple[int, float]] = []
    results_of(InProcessExecutor(RunOptions(), progress=lambda *state: states.append(state)), jobs(2))
    assert (states[0], states[-1]) == ((0, 0.0), (1, 1.0))
    assert states == sorted(states)


def test_job_that_cannot_be_stored_ends_the_executor(tmp_path: Path) -> None:
    submitted = jobs(2)
    with Store(tmp_path) as store:
        path = run_or_fetch(submitted[0], store).path
        assert path is not None
        path.unlink()
        path.mkdir()
        for executor in (InProcessExecutor(RunOptions(tmp_path), store), ProcessExecutor(RunOptions(tmp_path), 1)):
            for job in submitted:
                executor.submit(job)
            with pytest.raises(JobError, match="Is a directory"):
                executor.wait(lambda _: None)


def test_process_that_cannot_be_started_raises_executor_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def start(_: SpawnProcess) -> NoReturn:
        raise OSError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(SpawnProcess, "start", start)
    executor = ProcessExecutor(RunOptions(), 2)
    executor.submit(jobs(1)[0])
    with pytest.raises(ExecutorError, match="Resource temporarily unavailable"):
        executor.wait(lambda _: None)


@pytest.mark.full
@pytest.mark.skipif(sys.platform != "linux", reason="needs /proc/self/task/*/syscall")
def test_run_of_a_worker_killed_while_sending_its_row_is_repeated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(executors, "serve", partial(serve_large_rows, tmp_path / "killed"))
    found = results_of(ProcessExecutor(RunOptions(), 2), jobs(3))
    assert (tmp_path / "killed").exists()
    assert [len(found[index].row.reason or "") for index in range(3)] == [LARGE] * 3


def serve_large_rows(mark: Path, pipe: Any, options: RunOptions) -> None:
    """Serve with rows that take long to send; the first worker that sends one kills itself meanwhile."""
    worker.run_or_fetch = partial(large_record, mark)
    worker.serve(pipe, options)


def large_record(mark: Path, job: Job, *more: Any) -> RunRecord:
    record = run_or_fetch(job, *more)
    record.trajectory.info["reason"] = " " * LARGE
    try:
        mark.touch(exist_ok=False)
    except FileExistsError:
        return record
    threading.Thread(target=kill_in_write, args=(os.getpid(),), daemon=True).start()
    return record


def kill_in_write(main: int, is_large: Callable[[int], bool] = lambda size: size > LARGE // 100) -> None:
    """Wait until the main thread is in a large write (system call 1 on x86-64, 64 on ARM), then kill the process."""
    number = {"x86_64": "1", "aarch64": "64"}[os.uname().machine]
    while True:
        call = Path(f"/proc/self/task/{main}/syscall").read_text().split()
        if call[0] == number and is_large(int(call[3], 16)):
            os.kill(main, signal.SIGKILL)
