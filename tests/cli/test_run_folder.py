"""`sandbox run`: the stored runs of a folder, samples, summaries, dry runs, time limits, and large sweeps."""

import json
import re
import shlex
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from sandbox.batch.store import Store
from sandbox.cli import progress
from sandbox.cli import run as run_module
from sandbox.cli import run_batch as module
from sandbox.trajectory import Trajectory
from tests.cli.calling import DROP, SPARKS, document_from, document_of, json_of, lines_of, output_of, write_scene
from tests.interruptible import interrupted

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long


def stored(folder: Path) -> list[dict[str, Any]]:
    with closing(sqlite3.connect(folder / "runs.sqlite")) as database:
        database.row_factory = sqlite3.Row
        return [dict(row) for row in database.execute("SELECT * FROM runs ORDER BY rowid")]


def files(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def run_id(capfd: pytest.CaptureFixture[str], folder: Path, *arguments: str) -> str:
    _, document, _ = json_of(capfd, "run", *arguments, "--out", str(folder))
    return str(document["runs"][0]["id"])


def test_run_is_stored_as_a_row_and_arrays(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "deep" / "runs"
    _, document, _ = json_of(capfd, "run", write_scene(tmp_path), "--seeds", "2", "--out", str(folder))
    rows, runs = stored(folder), document["runs"]
    assert [row["id"] for row in rows] == [run["id"] for run in runs]
    assert files(folder) == {"runs.sqlite", *(f"{run['id']}.npz" for run in runs)}
    for row, run in zip(rows, runs, strict=True):
        assert run["path"] == str(folder / row["path"])
        assert json.loads(row["settings"]) == run["settings"]
        common = ("engine", "seed", "status", "reason", "steps", "seconds", "energy_start", "energy_end", "contacts")
        assert {key: row[key] for key in common} == {key: run[key] for key in common}
        assert (row["missed_contacts"], row["scene_title"]) == (run["missed_contacts"], "Drop")
        assert "pymunk" in json.loads(row["versions"])


def test_repeated_command_does_not_run_again(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    arguments = ("run", write_scene(tmp_path), "--out", str(tmp_path / "runs"))
    _, first, _ = json_of(capfd, *arguments)
    before = {path: path.read_bytes() for path in (tmp_path / "runs").glob("*.npz")}
    second = document_from(capfd, *arguments)
    assert [run["repeated"] for run in (*first["runs"], *second["runs"])] == [False, True]
    # Equal seconds show that the run was not repeated.
    assert {**second["runs"][0], "repeated": False} == first["runs"][0]
    assert {path: path.read_bytes() for path in (tmp_path / "runs").glob("*.npz")} == before
    assert len(stored(tmp_path / "runs")) == 1
    status, out, _ = lines_of(capfd, *arguments)
    assert (status, out[-1]) == (0, f"stored: {tmp_path / 'runs'}")
    assert any(" ok stored " in line for line in out)


def test_same_settings_by_file_flag_sweep_or_seeds_are_the_same_run(tmp_path, capfd):
    folder, plain = tmp_path / "runs", write_scene(tmp_path)
    solver = write_scene(tmp_path, DROP + "\n[solver]\ndt = 0.02\nsubsteps = 2\n", "solver.toml")
    seeded = write_scene(tmp_path, DROP.replace("[world]", "[world]\nseed = 1"), "seeded.toml")
    by_file = run_id(capfd, folder, solver)
    assert run_id(capfd, folder, plain, "--set", "solver.dt=0.02", "--set", "solver.substeps=2") == by_file
    assert run_id(capfd, folder, plain, "--sweep", "solver.dt=0.02", "--sweep", "solver.substeps=2:2:1") == by_file
    by_seed = run_id(capfd, folder, plain, "--seeds", "1")
    assert run_id(capfd, folder, seeded) == by_seed
    assert [row["id"] for row in stored(folder)] == [by_file, by_seed]


def test_setting_equal_to_the_default_is_the_same_run(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    folder, scene = tmp_path / "runs", write_scene(tmp_path)
    assert run_id(capfd, folder, scene) == run_id(capfd, folder, scene, "--set", "solver.integrator=explicit_euler")


def test_refused_run_is_stored(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "runs"
    refused = ("--engine", "pymunk", "--set", "solver.integrator=rk4", "--out", str(folder))
    status, document, _ = json_of(capfd, "run", write_scene(tmp_path), *refused)
    (row,) = stored(folder)
    assert (status, row["status"], row["reason"]) == (1, "refused", document["runs"][0]["reason"])
    assert (row["energy_start"], row["energy_end"], row["missed_contacts"]) == (None, None, None)


def test_damaged_run_is_reported_in_one_line_and_repeated(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    arguments = ("run", write_scene(tmp_path), "--out", str(tmp_path / "runs"))
    _, document, _ = json_of(capfd, *arguments)
    path = Path(document["runs"][0]["path"])
    path.write_bytes(b"damaged")
    status, again, err = json_of(capfd, *arguments)
    (row,) = again["runs"]
    assert (status, len(err)) == (0, 1)
    assert err[0].startswith(f"{path} is not a stored run: ")
    assert err[0].endswith("; the run was repeated")
    assert err[0].startswith(row["damaged"])
    assert (row["id"], row["repeated"]) == (document["runs"][0]["id"], False)
    status, last, err = json_of(capfd, *arguments)
    assert (status, err, last["runs"][0]["repeated"]) == (0, [], True)
    assert last["runs"][0]["state_hash"] == document["runs"][0]["state_hash"]


@pytest.mark.parametrize(
    "flags", ["--json", *(pytest.param(flag, marks=pytest.mark.nightly) for flag in ("--quiet", ""))]
)
def test_interrupted_command_keeps_finished_runs(flags: str, tmp_path: Path) -> None:
    scene, folder = write_scene(tmp_path, DROP.replace("duration = 0.5", "duration = 20.0") + SPARKS), tmp_path / "runs"
    words = ["run", scene, "--seeds", "500", "--out", str(folder), *shlex.split(flags)]
    status, out, err = interrupted(words, lambda: len(list(folder.glob("*.npz"))) >= 3)
    assert status == 130, err

    with Store(folder) as store:
        rows = store.rows()
        assert all(Trajectory.load(store.file(row)).status == "ok" for row in rows)
    assert files(folder) == {"runs.sqlite", *(row.path for row in rows)}
    finished = int(err.partition("interrupted: ")[2].split()[0])
    assert err.endswith(f"interrupted: {finished} of 500 runs are complete and kept\n")
    assert 3 <= finished == len(rows) < 500
    if flags == "--json":
        document = document_of(out)
        assert [run["id"] for run in document["runs"]] == [row.id for row in rows]
        assert document["interrupted"] is True
    elif flags == "--quiet":
        assert out == ""
    else:
        assert len([line for line in out.splitlines() if " ok " in line]) == finished


@pytest.fixture
def scene(tmp_path: Path) -> str:
    return write_scene(tmp_path, DROP + SPARKS)


def test_samples_are_drawn_from_ranges_and_multiply_with_sweeps(scene: str, capfd: pytest.CaptureFixture[str]) -> None:
    words = ("--sweep", "ball.a.restitution=0:1", "--sweep", "solver.dt=0.005:0.02:log", "--sample", "4:sobol:3")
    status, document, _ = json_of(capfd, "run", scene, *words, "--sweep", "ball.a.mass=1,2")
    assert status == 0
    points = [run["set"] for run in document["runs"]]
    assert [list(point) for point in points] == [["ball.a.mass", "ball.a.restitution", "solver.dt"]] * 8
    assert [point["ball.a.mass"] for point in points] == [1] * 4 + [2] * 4
    drawn = [(point["ball.a.restitution"], point["solver.dt"]) for point in points]
    assert drawn[:4] == drawn[4:]
    assert len(set(drawn)) == 4
    assert all(0.0 <= e < 1.0 and 0.005 <= dt < 0.02 for e, dt in drawn)
    assert json_of(capfd, "run", scene, *words, "--sweep", "ball.a.mass=1,2")[1]["runs"][0]["set"] == points[0]


def test_uneven_number_of_sobol_points_is_reported(scene: str, capfd: pytest.CaptureFixture[str]) -> None:
    words = ("run", scene, "--sweep", "ball.a.restitution=0:1", "--sample")
    status, _, err = lines_of(capfd, *words, "5:sobol")
    assert (status, len(err)) == (0, 1)
    assert err[0].endswith("for powers of two, such as 4 or 8")
    assert lines_of(capfd, *words, "5")[2] == lines_of(capfd, *words, "8:sobol")[2] == []


def test_dry_run_estimates_and_runs_nothing(scene: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    words = ("run", scene, "--sweep", "solver.dt=0.005:0.02:100000", "--seeds", "100", "--out", str(tmp_path / "runs"))
    out = output_of(capfd, *words, "--dry-run")
    assert out[0] == "10,000,000 runs: 1 scene; 100,000 × solver.dt; 100 seeds"
    assert out[1] == f"first: {scene} pymunk solver.dt=0.005 world.seed=1"
    assert re.fullmatch(r"about \d+ (h|days) on 1 worker, .* a run; measured on 2 runs, not stored", out[2])
    assert not (tmp_path / "runs").exists()
    status, document, _ = json_of(capfd, *words[:2], "--seeds", "3", "--dry-run")
    assert (status, document["runs"], document["seeds"], document["measured"]) == (0, 3, 3, 1)
    assert document["seconds"] == pytest.approx(3 * document["seconds_per_run"])


def test_dry_run_counts_stored_runs(scene: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    words = ("run", scene, "--out", str(tmp_path / "runs"))
    json_of(capfd, *words, "--seeds", "2")
    assert json_of(capfd, *words, "--seeds", "5", "--dry-run")[1]["stored"] == 2
    assert json_of(capfd, *words, "--seeds", "5", "--dry-run", "--force")[1]["stored"] == 0
    assert [run["repeated"] for run in json_of(capfd, *words, "--seeds", "2", "--force")[1]["runs"]] == [False] * 2


def test_summaries_have_rows_and_no_files(scene: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    words = ("run", scene, "--seeds", "2", "--out", str(tmp_path / "runs"))
    _, first, _ = json_of(capfd, *words, "--keep", "summary")
    assert [run["path"] for run in first["runs"]] == [None, None]
    assert [path.name for path in (tmp_path / "runs").iterdir()] == ["runs.sqlite"]
    _, again, _ = json_of(capfd, *words, "--keep", "summary")
    assert again["runs"] == [run | {"repeated": True} for run in first["runs"]]
    _, whole, _ = json_of(capfd, *words)
    assert [run["repeated"] for run in whole["runs"]] == [False, False]
    assert all(Path(run["path"]).is_file() for run in whole["runs"])
    assert [run["state_hash"] for run in whole["runs"]] == [run["state_hash"] for run in first["runs"]]


@pytest.mark.parametrize("workers", ["1", "2"])
def test_run_that_takes_too_long_is_stopped_and_the_others_complete(workers, tmp_path, capfd):
    scene = write_scene(tmp_path, DROP + "[solver]\nrecord_every = 1000000\n")
    words = ("run", scene, "--sweep", "world.duration=0.1,100000,0.2", "--time-limit", "1", "--workers", workers)
    status, document, err = json_of(capfd, *words, "--out", str(tmp_path / "runs"))
    assert (status, [run["status"] for run in document["runs"]]) == (1, ["ok", "failed", "ok"])
    assert err == [f"{scene}: failed: stopped at the time limit of 1 s"]


@pytest.mark.parametrize("workers", ["1", "2"])
def test_sweep_too_large_for_a_table_prints_a_summary(workers, scene, capfd, monkeypatch):
    _, small, _ = json_of(capfd, "run", scene, "--seeds", "6")
    monkeypatch.setattr(module, "MAX_TABLE", 4)
    out = output_of(capfd, "run", scene, "--seeds", "6", "--workers", workers)
    assert out == ["6 runs: 6 ok; `sandbox runs DIR` lists and summarises the stored ones"]
    status, text, _ = lines_of(capfd, "run", scene, "--seeds", "6", "--workers", workers, "--json")
    large = document_of("\n".join(text))
    assert (status, large["interrupted"]) == (0, False)
    assert [run["id"] for run in large["runs"]] == [run["id"] for run in small["runs"]]  # in the order of the plan
    assert [run["final"] for run in large["runs"]] == [run["final"] for run in small["runs"]]


def test_problems_of_many_runs_are_counted(tmp_path, capfd, monkeypatch):
    monkeypatch.setattr(module, "MAX_PROBLEMS", 2)
    words = ("run", write_scene(tmp_path), "--engine", "pymunk", "--set", "solver.integrator=rk4")
    status, _, err = lines_of(capfd, *words, "--sweep", "solver.dt=0.01:0.02:5", "--quiet")
    assert (status, len(err)) == (1, 3)
    assert err[2] == "… and 3 more runs that are not ok"


def test_long_sweep_reports_its_progress_in_lines(scene, capfd, monkeypatch):
    monkeypatch.setattr(progress, "PLAIN_INTERVAL", 0.0)
    _, _, err = lines_of(capfd, "run", scene, "--seeds", "3")
    assert [line.partition(";")[0] for line in err] == [f"{k} of 3 runs done" for k in (1, 2, 3)]
    assert re.search(r"runs/s; .* left; slowest .* s: .* world\.seed=\d", err[-1])
    assert lines_of(capfd, "run", scene, "--seeds", "3", "--quiet")[2] == []
    assert lines_of(capfd, "run", scene, "--seeds", "3", "--json")[2] == []


def test_fault_of_a_scene_beyond_the_checked_ones_is_reported(scene, capfd, monkeypatch):
    monkeypatch.setattr("sandbox.batch.plan.MAX_CHECKED", 3)
    monkeypatch.setattr("sandbox.batch.plan.MAX_AXIS_CHECKED", 2)
    words = ("run", scene, "--sweep", "ball.a.mass=1,2,-3,4", "--json")
    status, text, err = lines_of(capfd, *words)
    assert status == 1
    assert [run["set"]["ball.a.mass"] for run in json.loads(text[0])["runs"]] == [1, 2, 4]
    assert len(err) == 1
    assert "is -3" in err[0]


def test_ends_of_many_runs_are_computed_in_one_call(tmp_path, scene, capfd):
    scene = write_scene(tmp_path, DROP, "balls.toml")
    sweep = ("run", scene, "--engine", "exact", "--sweep", "ball.a.velocity=[0,0],[1,0],[0,2]")
    status, document, err = json_of(capfd, *sweep, "--keep", "end")
    assert status == 0
    assert err == []  # nothing beside the document
    status, _, err = lines_of(capfd, *sweep, "--keep", "end", "--out", str(tmp_path / "runs"))
    assert (status, err) == (0, [f"{scene}: exact computes many runs in one compiled call (--keep end)"])
    for row, ordinary in zip(document["runs"], json_of(capfd, *sweep)[1]["runs"], strict=True):
        assert (row["contacts"], row["missed_contacts"], row["first_contact"], row["work"]) == (None, None, None, {})
        same = ("id", "seed", "set", "status", "steps", "energy_start", "energy_end", "final", "state_hash")
        assert {key: row[key] for key in same} == {key: ordinary[key] for key in same}
    status, out, _ = lines_of(capfd, *sweep, "--keep", "end", "--dry-run")
    assert (status, out[0]) == (0, "3 runs: 1 scene; 3 × ball.a.velocity")
    assert out[2].endswith("measured on 2 runs, not stored")


def test_size_of_a_large_study_is_said_after_its_first_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(run_module, "LARGE_STORE", 100.0)  # bytes, in place of a gigabyte
    words = ("run", write_scene(tmp_path, DROP + SPARKS), "--seeds", "3", "--out", str(tmp_path / "runs"))
    assert lines_of(capfd, *words, "--dry-run")[2] == []
    notes = [line for line in lines_of(capfd, *words)[2] if "--keep summary" in line]
    with Store(tmp_path / "runs") as store:
        size = 3 * (store.rows()[0].size or 0)
    assert notes[0].startswith(f"3 runs of this size take {size / 1e3:.3g} kB in ")
    assert len(notes) == 1
    assert not any("--keep summary" in line for line in lines_of(capfd, *words, "--keep", "summary", "--force")[2])
