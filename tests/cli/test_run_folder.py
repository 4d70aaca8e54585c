"""`sandbox run --out DIR`: contents of the folder, runs that are not repeated, interruption."""

import json
import shlex
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandbox.batch.store import Store
from sandbox.trajectory import Trajectory
from tests.cli.calling import DROP, SPARKS, document_of, json_of, lines_of, write_scene
from tests.interruptible import interrupted

pytestmark = pytest.mark.full  # child processes and command lines that run long

COLUMNS = (
    "id scene_hash scene_title engine settings seed versions status reason created steps seconds energy_start "
    "energy_end contacts missed_contacts path score scene set_values first_contact joint_error broken_joints "
    "state_hash work plan_key size digest details"
)


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
    assert " ".join(rows[0]) == COLUMNS
    assert [row["id"] for row in rows] == [run["id"] for run in runs]
    assert files(folder) == {"runs.sqlite", *(f"{run['id']}.npz" for run in runs)}
    for row, run in zip(rows, runs, strict=True):
        assert run["path"] == str(folder / row["path"])
        assert json.loads(row["settings"]) == run["settings"]
        common = ("engine", "seed", "status", "reason", "steps", "seconds", "energy_start", "energy_end", "contacts")
        assert {key: row[key] for key in common} == {key: run[key] for key in common}
        assert (row["missed_contacts"], row["scene_title"]) == (run["missed_contacts"], "Drop")
        assert "pymunk" in json.loads(row["versions"])


def test_arrays_have_the_documented_names_and_shapes(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    _, document, _ = json_of(capfd, "run", write_scene(tmp_path), "--out", str(tmp_path / "runs"))
    with np.load(document["runs"][0]["path"], allow_pickle=False) as arrays:
        shapes = {name: arrays[name].shape for name in arrays.files}
        assert arrays["names"].tolist() == ["a"]
        assert arrays["contact_pair"].tolist() == [[0, -1]]
    frames = {
        "time": (51,),
        "position": (51, 1, 2),
        "velocity": (51, 1, 2),
        "angle": (51, 1),
        "angular_velocity": (51, 1),
    }
    contacts = {"contact_time": (1,)} | {f"contact_{name}": (1, 2) for name in ("pair", "point", "normal", "impulse")}
    assert frames | {"names": (1,)} | contacts == {
        k: v for k, v in shapes.items() if k in {*frames, "names", *contacts}
    }


def test_repeated_command_does_not_run_again(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    arguments = ("run", write_scene(tmp_path), "--out", str(tmp_path / "runs"))
    _, first, _ = json_of(capfd, *arguments)
    before = {path: path.read_bytes() for path in (tmp_path / "runs").glob("*.npz")}
    status, second, err = json_of(capfd, *arguments)
    assert (status, err) == (0, [])
    assert [run["repeated"] for run in (*first["runs"], *second["runs"])] == [False, True]
    # Equal seconds show that the run was not repeated.
    assert {**second["runs"][0], "repeated": False} == first["runs"][0]
    assert {path: path.read_bytes() for path in (tmp_path / "runs").glob("*.npz")} == before
    assert len(stored(tmp_path / "runs")) == 1
    status, out, _ = lines_of(capfd, *arguments)
    assert (status, out[-1]) == (0, f"stored: {tmp_path / 'runs'}")
    assert any(" ok stored " in line for line in out)


def test_same_settings_by_file_flag_sweep_or_seeds_are_the_same_run(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    folder, plain = tmp_path / "runs", write_scene(tmp_path)
    solver = write_scene(tmp_path, DROP + "\n[solver]\ndt = 0.02\nsubsteps = 2\n", "solver.toml")
    seeded = write_scene(tmp_path, DROP.replace("[world]", "[world]\nseed = 1"), "seeded.toml")
    by_file = run_id(capfd, folder, solver)
    assert run_id(capfd, folder, plain, "--set", "solver.dt=0.02", "--set", "solver.substeps=2") == by_file
    assert run_id(capfd, folder, plain, "--sweep", "solver.dt=0.02", "--sweep", "solver.substeps=2:2:1") == by_file
    by_seed = run_id(capfd, folder, plain, "--seeds", "1")
    assert run_id(capfd, folder, seeded) == by_seed
    assert [row["id"] for row in stored(folder)] == [by_file, by_seed]


@pytest.mark.parametrize(
    "change",
    [
        "solver.dt=0.02",
        "solver.record_every=2",
        "solver.slop=0.1",
        "world.duration=0.4",
        "ball.a.mass=2",
        "world.seed=5",
    ],
)
def test_different_setting_is_another_run(change: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    folder, scene = tmp_path / "runs", write_scene(tmp_path)
    assert run_id(capfd, folder, scene) != run_id(capfd, folder, scene, "--set", change)
    assert len(stored(folder)) == 2


def test_setting_equal_to_the_default_is_the_same_run(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    folder, scene = tmp_path / "runs", write_scene(tmp_path)
    assert run_id(capfd, folder, scene) == run_id(capfd, folder, scene, "--set", "solver.integrator=explicit_euler")


def test_refused_run_is_stored(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "runs"
    status, document, _ = json_of(
        capfd,
        "run",
        write_scene(tmp_path),
        "--engine",
        "pymunk",
        "--set",
        "solver.integrator=rk4",
        "--out",
        str(folder),
    )
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


@pytest.mark.parametrize("flags", ["--json", "--quiet", ""])
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


def test_repeated_command_runs_only_the_missing_seeds(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    arguments = ("run", write_scene(tmp_path, DROP + SPARKS), "--out", str(tmp_path / "runs"))
    json_of(capfd, *arguments, "--seeds", "2")
    _, document, _ = json_of(capfd, *arguments, "--seeds", "4")
    assert [run["repeated"] for run in document["runs"]] == [True, True, False, False]
