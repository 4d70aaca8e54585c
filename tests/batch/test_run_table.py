"""Tables of stored runs: one row per run, with the values that differ between runs."""

import csv
from pathlib import Path

import pytest

import sandbox
from sandbox.batch.run_table import FIRST, LAST
from sandbox.cli.main import call

SCENE = """
title = "drop"
[world]
gravity = [0, -9.81]
duration = 0.5
[[plane]]
point = [0, 0]
normal = [0, 1]
[[ball]]
name = "stone"
position = [0, 1]
radius = 0.1
restitution = 0.5
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    (folder / "drop.toml").write_text(SCENE)
    sweeps = ("--sweep", "ball.stone.restitution=0.2,0.8", "--sweep", "solver.dt=0.01,0.005")
    assert call(["run", str(folder / "drop.toml"), *sweeps, "--out", str(folder / "runs"), "--quiet"]) == 0
    return folder / "runs"


def test_row_has_swept_values_and_results(study: Path) -> None:
    with sandbox.Store(study) as store:
        rows = sandbox.run_table(store)
    assert [list(row) for row in rows] == [[*FIRST, "ball.stone.restitution", "solver.dt", *LAST]] * 4
    swept = {(row["ball.stone.restitution"], row["solver.dt"]) for row in rows}
    assert swept == {(e, dt) for e in (0.2, 0.8) for dt in (0.01, 0.005)}
    for row in rows:
        run = sandbox.Trajectory.load(study / f"{row['id']}.npz")
        assert (row["title"], row["engine"], row["seed"], row["status"]) == ("drop", "pymunk", 0, "ok")
        assert row["state_hash"] == run.info["state_hash"]
        assert row["energy_end"] == run.info["energy_end"]
        assert row["steps"] == round(0.5 / row["solver.dt"])


def test_table_is_written_as_csv(study: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "table.csv"
    assert call(["export", str(study), "--runs", "--to", str(target)]) == 0
    assert capfd.readouterr().out == f"written: {target} (4 rows)\n"
    with target.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert sorted(float(row["solver.dt"]) for row in rows) == [0.005, 0.005, 0.01, 0.01]
    assert all(row["score"] == "" for row in rows)


def test_table_is_written_as_parquet(study: Path, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    target = tmp_path / "table.parquet"
    assert call(["export", str(study), "--runs", "--to", str(target), "--quiet"]) == 0
    found = parquet.read_table(target).to_pylist()
    with sandbox.Store(study) as store:
        assert found == sandbox.run_table(store)


def test_run_with_a_damaged_file_keeps_its_row(study: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    copy.mkdir()
    for file in study.iterdir():
        (copy / file.name).write_bytes(file.read_bytes())
    damaged = next(copy.glob("*.npz"))
    damaged.write_bytes(b"PK nothing")
    notices: list[str] = []
    with sandbox.Store(copy, notice=notices.append) as store:
        rows = sandbox.run_table(store)
    (row,) = [row for row in rows if row["id"] == damaged.stem]
    assert row["ball.stone.restitution"] is None
    assert row["solver.dt"] in (0.005, 0.01)  # the database has it
    assert damaged.name in notices[0]


def test_empty_store_yields_no_table(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    sandbox.Store(tmp_path / "empty").close()
    assert call(["export", str(tmp_path / "empty"), "--runs", "--to", str(tmp_path / "a.csv")]) == 2
    assert capfd.readouterr().err == f"{tmp_path / 'empty'}: contains no run\n"
    assert not (tmp_path / "a.csv").exists()


@pytest.mark.parametrize(
    ("folder", "options", "message"),
    [
        ("nowhere", ("--to", "a.csv"), "is no folder of stored runs"),
        (None, ("--to", "a.png"), "--runs"),
        (None, ("--to", "a.csv", "--from", "0"), "--from: does not apply to a table of runs"),
        (None, ("--to", "a.csv", "--contacts"), "--contacts: does not apply to a table of runs"),
    ],
)
def test_invalid_export_of_runs_is_rejected(
    folder: str | None, options: tuple[str, ...], message: str, study: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert call(["export", folder or str(study), "--runs", *options]) == 2
    assert message in capfd.readouterr().err
