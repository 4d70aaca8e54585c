"""`sandbox run --workers N`: the same runs, stored alike; what Ctrl-C and a worker's death leave."""

import os
import re
import signal
from pathlib import Path

import pytest
from calling import DROP, SPARKS, document_of, json_of, lines_of, written
from interruptible import interrupted

from sandbox.batch.crew import CrewError, Making, Worker
from sandbox.batch.plan import plan
from sandbox.batch.store import Store, StoreError
from sandbox.scene.faults import Fault, SceneError
from sandbox.trajectory import Trajectory

TIMES = ("seconds", "steps_per_second", "realtime_factor")
"""of a row, which are of the machine"""


def test_workers_make_the_same_runs(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    words = ("run", written(tmp_path, DROP + SPARKS), "--sweep", "ball.a.position=[0,1],[0,2],[0,3]", "--seeds", "2")
    alone = json_of(capfd, *words)[1]["runs"]
    status, document, _ = json_of(capfd, *words, "--workers", "3", "--out", str(tmp_path / "runs"))
    assert status == 0
    for one, other in zip(alone, document["runs"], strict=True):
        assert {key: value for key, value in one.items() if key not in (*TIMES, "path")} == {
            key: value for key, value in other.items() if key not in (*TIMES, "path")
        }
    with Store(tmp_path / "runs") as store:
        rows = {row.id: row for row in store.rows()}
        assert set(rows) == {run["id"] for run in alone}
        for run in document["runs"]:
            assert Path(run["path"]) == store.file(rows[run["id"]])
            assert Trajectory.load(run["path"]).info["state_hash"] == run["state_hash"]


def test_workers_take_from_the_store_what_it_has(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    words = ("run", written(tmp_path, DROP + SPARKS), "--out", str(tmp_path / "runs"), "--workers", "2")
    json_of(capfd, *words, "--seeds", "2")
    _, document, _ = json_of(capfd, *words, "--seeds", "4")
    assert [run["repeated"] for run in document["runs"]] == [True, True, False, False]


def test_interrupt_ends_workers_and_keeps_what_is_finished(tmp_path: Path) -> None:
    scene, folder = written(tmp_path, DROP.replace("duration = 0.5", "duration = 20.0") + SPARKS), tmp_path / "runs"
    words = ["run", scene, "--seeds", "500", "--workers", "2", "--json", "--out", str(folder)]
    status, out, err = interrupted(words, lambda: len(list(folder.glob("*.npz"))) >= 3)
    assert status == 130, err
    told = re.fullmatch(r"interrupted: (\d+) of 500 runs are finished and kept\n", err)
    assert told is not None, err  # as of a traceback
    runs = document_of(out)["runs"]
    assert len(runs) == int(told[1]) < 500
    with Store(folder) as store:
        rows = store.rows()
        assert {run["id"] for run in runs} <= {row.id for row in rows}  # one may be stored and not told of any more
        assert all(Trajectory.load(store.file(row)).status == "ok" for row in rows)
    assert {path.name for path in folder.iterdir()} == {"runs.sqlite", *(row.path for row in rows)}


def test_worker_that_dies_is_told(tmp_path: Path) -> None:
    job, *_ = plan([("drop", written(tmp_path, DROP.replace("duration = 0.5", "duration = 2000.0")))], ["pymunk"])
    worker = Worker(Making())
    try:
        worker.hand(0, job)
        assert worker.process.pid is not None
        os.kill(worker.process.pid, signal.SIGKILL)
        with pytest.raises(CrewError, match="ended with status -9"):
            worker.answer()
    finally:
        worker.dismiss()


def test_what_cannot_be_made_ends_the_command(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene, folder = written(tmp_path), tmp_path / "runs"
    _, document, _ = json_of(capfd, "run", scene, "--out", str(folder))
    Path(document["runs"][0]["path"]).write_bytes(b"no arrays")
    status, _, err = lines_of(capfd, "run", scene, "--out", str(folder), "--seeds", "2", "--workers", "2", "--quiet")
    assert status == 0, err  # seeds 1 and 2 are other runs than that of seed 0
    words = ("--sweep", "world.seed=0,7", "--workers", "2", "--quiet")
    status, _, err = lines_of(capfd, "run", scene, "--out", str(folder), *words)
    assert status == 2
    assert "remove the file, and the run is made again" in err[-1]


@pytest.mark.parametrize("error", [StoreError("a: b"), SceneError([Fault("a.toml", 3, "ball.a", "is none")])])
def test_errors_pass_from_process_to_process(error: Exception) -> None:
    import pickle

    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), vars(again)) == (type(error), str(error), vars(error))
