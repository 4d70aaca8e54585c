"""Questions to a store: tables, filters, groups and their statistics, trajectories, exports."""

import csv
import json
import math
import os
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from dataclasses import astuple, fields
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import polars
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyarrow import parquet

import sandbox
from sandbox.batch.query import QueryError, StoredRuns, open_store
from sandbox.batch.store import Store, StoreError
from sandbox.batch.stored_run import StoredRun
from sandbox.cli.main import call
from sandbox.measure.proportion import wilson_interval
from sandbox.provenance import machine
from sandbox.scene.description.world import Settings
from tests.batch.test_store import sample_run
from tests.environment import with_root_on_path

pytestmark = pytest.mark.fail_slow(60)  # other processes

SCENE = """
title = "drop"
world = { gravity = [0, -9.81], duration = 0.5 }
plane = [{ point = [0, 0], normal = [0, 1] }]
ball = [{ name = "stone", position = [0, 1], radius = 0.1, restitution = 0.5 }]
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store of four runs."""
    folder = tmp_path_factory.mktemp("study")
    (folder / "drop.toml").write_text(SCENE)
    sweeps = ("--sweep", "ball.stone.restitution=0.2,0.8", "--sweep", "solver.dt=0.01,0.005")
    assert call(["run", str(folder / "drop.toml"), *sweeps, "--out", str(folder / "runs"), "--quiet"]) == 0
    return folder / "runs"


@pytest.fixture
def runs(study: Path) -> Iterator[StoredRuns]:
    with open_store(study) as found:
        yield found


def synthetic(folder: Path, count: int, **columns: Any) -> None:
    """Fill a store with copies of one run, with other values in some columns, each a function of its number."""
    Store(folder).close()
    names = [column.name for column in fields(StoredRun)]
    row = dict(zip(names, astuple(StoredRun.of(sample_run(), "0" * 20, details={})), strict=True))
    with closing(sqlite3.connect(folder / "runs.sqlite")) as database:
        for column in columns:
            if column not in row:
                database.execute(f'ALTER TABLE runs ADD COLUMN "{column}"')
        rows = [row | {"id": f"{k:020x}"} | {name: value(k) for name, value in columns.items()} for k in range(count)]
        keys = ", ".join(f'"{name}"' for name in rows[0])
        marks = ", ".join("?" for _ in rows[0])
        database.executemany(f"INSERT INTO runs ({keys}) VALUES ({marks})", [tuple(each.values()) for each in rows])
        database.commit()


def test_table_has_swept_values_and_figures(runs: StoredRuns, study: Path) -> None:
    table = runs.table()
    assert isinstance(table, pandas.DataFrame)
    assert {"ball.stone.restitution", "solver.dt", "energy_end", "state_hash"} <= set(table.columns)
    assert set(zip(table["ball.stone.restitution"], table["solver.dt"], strict=True)) == {
        (e, dt) for e in (0.2, 0.8) for dt in (0.01, 0.005)
    }
    for row in table.to_dict("records"):
        run = sandbox.Trajectory.load(study / f"{row['id']}.npz")
        assert (row["title"], row["engine"], row["seed"], row["status"]) == ("drop", "pymunk", 0, "ok")
        assert row["scene"].endswith("drop.toml")
        assert (row["state_hash"], row["energy_end"]) == (run.info["state_hash"], run.info["energy_end"])
        assert row["steps"] == round(0.5 / row["solver.dt"])
    assert table["steps"].dtype == np.int64
    assert table["score"].isna().all()


def test_kinds_of_tables_have_the_same_values(runs: StoredRuns) -> None:
    first, second, third = (runs.table(kind=kind) for kind in ("pandas", "polars", "numpy"))
    assert isinstance(second, polars.DataFrame)
    assert list(first.columns) == second.columns == list(third)
    for name, values in third.items():
        for k, value in enumerate(values.tolist()):
            cells = (value, first[name].iloc[k], second[name][k])
            assert len({None if cell is None or cell != cell else cell for cell in cells}) == 1


@pytest.mark.parametrize(
    ("where", "count"),
    [
        ("solver.dt < 0.01 and status = 'ok'", 2),
        ("ball.stone.restitution > 0.5 AND solver.dt < 0.01", 1),
        ("solver.iterations >= 1", 4),  # a setting that was never set
        ("solver.integrator = 'explicit_euler'", 4),
        ("world.seed = 0 and seed = 0", 4),
        ("title like 'dr%'", 4),
        ("status = 'solver.dt'", 0),  # a text
        ('"solver.dt" < 0.01', 2),  # already quoted
        ("solver.dt < 0.01 -- and a comment", 2),
        ("seconds + contacts >= 0", 4),
    ],
)
def test_filter_selects_runs(where: str, count: int, runs: StoredRuns) -> None:
    assert sum(runs.statuses(where).values()) == count
    assert len(runs.table(where, kind="numpy")["id"]) == count


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ("solver.dtt < 1", "no column is named 'solver.dtt'; did you mean 'solver.dt'?"),
        ("foo = 1", "no column is named 'foo'"), ("status = ", "syntax error"),
        ("1 = 1; DROP TABLE runs", "syntax error"), ("1 = 1) UNION SELECT 1, 2 --", ""),
        ("(SELECT count(*) FROM sqlite_master)", "can only read the columns of the runs"),
        ("id IN (SELECT name FROM pragma_table_list)", ""), ("load_extension('x')", ""),
        ("(WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n) SELECT count(*) FROM n)", "can only read"),
        ("writefile('x', 'y')", ""), ("'not closed", ""), ("status = ?", ""), ("\0", ""),
    ],
)  # fmt: skip
def test_wrong_or_hostile_filter_is_refused_and_changes_nothing(where, message, runs, study, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = (study / "runs.sqlite").read_bytes()
    with pytest.raises(QueryError) as error:
        runs.table(where)
    assert message in str(error.value)
    assert len(runs) == 4
    assert (study / "runs.sqlite").read_bytes() == before
    assert not list(tmp_path.iterdir())


@given(st.text(), st.sampled_from(["solver.dt", "ball.stone.restitution"]))
def test_texts_in_an_expression_are_left_alone(text: str, name: str) -> None:
    quoted = "'" + text.replace("'", "''") + "'"
    with_names = StoredRuns.__new__(StoredRuns)
    with_names.columns = ("id", "solver.dt", "ball.stone.restitution")
    assert with_names.expression(f"{quoted} = {name}") == f'{quoted} = "{name}"'
    assert with_names.expression(f"{name}<{quoted}") == f'"{name}"<{quoted}'


def test_longest_name_is_taken_and_names_may_have_signs() -> None:
    known = StoredRuns.__new__(StoredRuns)
    known.columns = ("a.b", "a.b.c", "a.b-1.c", 'a."8 ball".c', "a.*.c")
    for name in known.columns:
        escaped = name.replace('"', '""')
        assert known.expression(f"({name}) > 1") == f'("{escaped}") > 1'
    assert known.expression("a.b-1") == '"a.b"-1'


def test_runs_are_sorted_and_the_last_ones_listed(runs: StoredRuns) -> None:
    table = runs.table(kind="numpy")
    assert table["ball.stone.restitution"].tolist() == [0.2, 0.2, 0.8, 0.8]  # by their values, not as they were added
    assert table["solver.dt"].tolist() == [0.005, 0.01, 0.005, 0.01]
    last = runs.table(limit=2, kind="numpy")  # those that were added last
    assert last["ball.stone.restitution"].tolist() == [0.8, 0.8]
    steps = runs.table(sort=["-solver.dt", "ball.stone.restitution"], kind="numpy")
    assert steps["solver.dt"].tolist() == [0.01, 0.01, 0.005, 0.005]
    assert steps["ball.stone.restitution"].tolist() == [0.2, 0.8, 0.2, 0.8]
    assert runs.table(sort=["solver.dt"], limit=1, kind="numpy")["solver.dt"].tolist() == [0.005]
    assert list(runs.table(columns=["status", "world.seed"], kind="numpy")) == ["status", "world.seed"]
    with pytest.raises(QueryError, match="did you mean 'status'"):
        runs.table(columns=["stats"])


def test_statistics_of_groups_are_those_of_their_values(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    values, status = rng.normal(size=300), rng.choice(["ok", "diverged"], 300).tolist()
    group = rng.choice([1, 2.5, "x", None], 300).tolist()
    synthetic(
        tmp_path,
        300,
        energy_end=lambda k: values[k] if k % 7 else None,
        status=lambda k: status[k],
        contacts=lambda k: k,
        **{"ball.a.mass": lambda k: group[k]},
    )
    with open_store(tmp_path) as runs:
        groups = runs.group(["ball.a.mass"], ["energy_end"], success="contacts < 100")
        table = runs.table(kind="pandas")
    assert [each.keys["ball.a.mass"] for each in groups] == [None, 1, 2.5, "x"]
    for each in groups:
        key = each.keys["ball.a.mass"]
        members = table[table["ball.a.mass"].isna() if key is None else table["ball.a.mass"] == key]
        found, expected = each.quantities["energy_end"], members[members["status"] == "ok"]["energy_end"].dropna()
        assert (each.runs, each.ok) == (len(members), (members["status"] == "ok").sum())
        assert found.count == len(expected)
        assert found.mean == pytest.approx(expected.mean(), rel=1e-12)  # rounding of sums
        assert found.deviation == pytest.approx(expected.std(), rel=1e-12)
        for fraction, value in found.quantiles.items():
            assert value == pytest.approx(expected.quantile(float(fraction)), rel=1e-12)
        successes = int((members["contacts"] < 100).sum())
        assert each.success_rate == successes / len(members)
        assert (each.success_low, each.success_high) == wilson_interval(successes, len(members))
    (whole,) = runs_in(tmp_path).group([])
    assert whole.runs == 300


def runs_in(folder: Path) -> StoredRuns:
    return open_store(folder)


def test_group_of_texts_has_no_statistics(runs: StoredRuns) -> None:
    with pytest.raises(QueryError, match="status has no numbers"):
        runs.group(["seed"], ["status"])
    (group,) = runs.group(["seed"], ["score"])  # no run has a score
    assert group.quantities["score"].count == 0
    assert math.isnan(group.quantities["score"].mean)


def test_trajectories_and_final_states_are_read_on_demand(runs: StoredRuns, study: Path, tmp_path: Path) -> None:
    ids = runs.table(kind="numpy")["id"].tolist()
    run = runs.trajectory(ids[0][:10])
    assert run.info["state_hash"] == sandbox.Trajectory.load(study / f"{ids[0]}.npz").info["state_hash"]
    assert runs.final(ids[0])["stone"]["position"] == run.position[-1, 0].tolist()
    assert [each for each, _ in runs.trajectories("solver.dt = 0.005")] == [
        each for each, dt in zip(ids, runs.table(kind="numpy")["solver.dt"].tolist(), strict=True) if dt == 0.005
    ]
    with pytest.raises(QueryError, match="no run has an id that begins with 'xyz'"):
        runs.trajectory("xyz")
    with pytest.raises(QueryError, match="several runs have an id that begins with ''"):
        runs.trajectory("")
    synthetic(tmp_path / "summaries", 1)
    with runs_in(tmp_path / "summaries") as summaries, pytest.raises(QueryError, match="was stored without arrays"):
        summaries.trajectory("0")


def test_table_is_written_as_csv(study: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "table.csv"
    assert call(["export", str(study), "--runs", "--to", str(target)]) == 0
    assert capfd.readouterr().out == f"written: {target} (4 rows)\n"
    with target.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert sorted(float(row["solver.dt"]) for row in rows) == [0.005, 0.005, 0.01, 0.01]
    assert all(row["score"] == "" for row in rows)


def test_table_is_written_as_parquet(study: Path, runs: StoredRuns, tmp_path: Path) -> None:
    target = tmp_path / "table.parquet"
    assert call(["export", str(study), "--runs", "--to", str(target), "--quiet"]) == 0
    found = parquet.read_table(target).to_pydict()
    assert set(found["cpu"]) == {machine()["cpu"]}
    assert json.loads(found["settings"][0])["dt"] == found["solver.dt"][0]
    assert all(json.loads(each)["sandbox"].startswith("0.") for each in found["versions"])
    assert len(found["created"]) == len(runs)
    for name, values in runs.table(kind="numpy").items():
        assert found[name] == [None if value != value else value for value in values.tolist()]


def test_column_of_several_types_is_written_as_text(tmp_path: Path) -> None:
    synthetic(tmp_path, 3, **{"a.b": lambda k: [None, 1, "x"][k], "a.c": lambda k: [1, 2.5, None][k]})
    with open_store(tmp_path) as runs:
        assert runs.to_parquet(tmp_path / "t.parquet") == 3
    found = parquet.read_table(tmp_path / "t.parquet").to_pydict()
    assert (found["a.b"], found["a.c"]) == ([None, "1", "x"], [1.0, 2.5, None])


def test_damaged_cells_have_no_value(tmp_path: Path) -> None:
    synthetic(tmp_path, 3, seconds=lambda k: [1.5, "many", b"\xff"][k], scene_title=lambda k: ["a", b"\xff", "c"][k])
    with open_store(tmp_path) as runs:
        table = runs.table(kind="numpy")
        assert table["seconds"].tolist()[0] == 1.5
        assert np.isnan(table["seconds"][1:]).all()
        assert runs.group([], ["seconds"])[0].quantities["seconds"].count == 1
        runs.to_csv(tmp_path / "t.csv")


def test_folder_without_a_store_is_an_error(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "none"):
        with pytest.raises(StoreError, match="no stored runs"):
            open_store(folder)
    (tmp_path / "runs.sqlite").write_bytes(b"no database" * 100)
    with pytest.raises(StoreError, match=r"runs\.sqlite"):
        open_store(tmp_path)
    assert (tmp_path / "runs.sqlite").read_bytes() == b"no database" * 100


def test_empty_store_has_no_table(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    sandbox.Store(tmp_path / "empty").close()
    with open_store(tmp_path / "empty") as runs:
        assert len(runs.table(kind="numpy")["id"]) == 0
        assert runs.group(["seed"], ["seconds"]) == []
        assert repr(runs) == f"<StoredRuns in {tmp_path / 'empty'}: no runs>"
    assert call(["export", str(tmp_path / "empty"), "--runs", "--to", str(tmp_path / "a.csv")]) == 2
    assert capfd.readouterr().err == f"{tmp_path / 'empty'}: contains no run\n"
    assert not (tmp_path / "a.csv").exists()


@pytest.mark.parametrize(
    ("folder", "options", "message"),
    [
        ("nowhere", ("--to", "a.csv"), "no stored runs"),
        (None, ("--to", "a.png"), "--runs"),
        (None, ("--to", "a.csv", "--from", "0"), "--from: does not apply to a table of runs"),
        (None, ("--to", "a.csv", "--contacts"), "--contacts: does not apply to a table of runs"),
    ],
)
def test_invalid_export_of_runs_is_rejected(folder, options, message, study, capfd):
    assert call(["export", folder or str(study), "--runs", *options]) == 2
    assert message in capfd.readouterr().err


def test_store_is_read_while_another_process_writes(tmp_path: Path) -> None:
    script = """
import sys
from pathlib import Path
from tests.batch.test_store import Store, sample_run
with Store(sys.argv[1]) as store:
    for k in range(100):
        store.add_run(sample_run(), f"{k:020x}")
        if k == 50:
            print("half", flush=True)
            sys.stdin.read(1)
    sys.stdin.read(1)
"""
    pipe = subprocess.PIPE
    command = [sys.executable, "-c", script, str(tmp_path)]
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, env=with_root_on_path()) as writer:
        assert writer.stdout is not None and writer.stdin is not None
        assert writer.stdout.readline() == "half\n"
        with open_store(tmp_path) as runs:
            assert len(runs) == 51
            writer.stdin.write("!")
            writer.stdin.flush()
            while len(runs) < 100:
                assert len(runs.table(kind="numpy")["id"]) >= 51
        # the writer closes last: a reader, or two that close at the same moment, leave the log for the next writer
        writer.stdin.write("!")
        writer.stdin.flush()
        assert writer.wait() == 0
    assert {path.suffix for path in tmp_path.iterdir()} == {".npz", ".sqlite"}


def test_store_of_a_folder_without_write_permission_is_read(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "access", lambda *_: False)
    before = sorted(study.iterdir())
    with open_store(study) as runs:
        assert len(runs) == 4
        with pytest.raises(sqlite3.DatabaseError):
            runs._connection.execute("CREATE TABLE x (y)")
    assert sorted(study.iterdir()) == before


def test_settings_and_details_are_columns_on_request(runs: StoredRuns) -> None:
    table = runs.table(columns=["settings", "details", "solver.substeps"], kind="numpy")
    assert set(json.loads(table["settings"][0])) == set(Settings.model_fields)
    assert "final" in json.loads(table["details"][0])
    assert table["solver.substeps"].tolist() == [1] * 4


def test_hundred_thousand_runs_are_grouped(tmp_path: Path) -> None:
    synthetic(tmp_path, 100_000, energy_end=float, **{"a.b": lambda k: k % 10, "solver.dt": lambda k: 0.01 + k % 3})
    with open_store(tmp_path) as runs:
        groups = runs.group(["a.b"], ["energy_end"])
        assert [group.runs for group in groups] == [10_000] * 10
        assert groups[3].quantities["energy_end"].mean == np.mean(np.arange(3, 100_000, 10))
        assert len(runs.table("a.b = 7", kind="numpy")["id"]) == 10_000
