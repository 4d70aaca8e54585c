"""Observables: figures of a user's function, as columns of the store, of tables and of documents."""

import pickle
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyarrow import parquet

import sandbox
from sandbox.batch.observables import Observable, ObservableError
from sandbox.batch.query import open_store
from sandbox.batch.store import Store
from sandbox.cli.main import call
from tests.cli.calling import DROP, json_of, lines_of, write_scene

pytestmark = pytest.mark.fail_slow(60)  # worker processes

SWEEP = ("--sweep", "ball.a.restitution=0.2,0.5,0.8")
HEIGHTS = """
import numpy as np
from beside import FIRST

def heights(run):
    y = run.position[:, FIRST, 1]
    return {"lowest": y.min(), "end": y[-1], "frames": len(y), "name": str(run.names[0]), "none": float("nan")}

def lowest(run):
    return run.position[:, 0, 1].min()
"""


@pytest.fixture
def observe(tmp_path: Path) -> str:
    """Option of a file with two functions; it imports a module beside it."""
    (tmp_path / "beside.py").write_text("FIRST = 0\n")
    (tmp_path / "heights.py").write_text(HEIGHTS)
    write_scene(tmp_path, DROP)
    return f"{tmp_path / 'heights.py'}:heights"


def run(capfd: pytest.CaptureFixture[str], folder: Path, *words: str) -> list[dict[str, Any]]:
    """Run the sweep, and return its rows."""
    status, document, _ = json_of(capfd, "run", str(folder / "drop.toml"), *SWEEP, *words)
    assert status == 0
    rows: list[dict[str, Any]] = document["runs"]
    return rows


@pytest.mark.parametrize("workers", ["1", "2"])
def test_values_are_columns_of_the_store_of_tables_and_of_files(
    observe: str, tmp_path: Path, workers: str, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "runs"
    rows = run(capfd, tmp_path, "--observe", observe, "--workers", workers, "--out", str(out))
    with open_store(out) as runs:
        table = runs.table(kind="numpy")
        columns = [table[f"observed.{key}"].tolist() for key in rows[0]["observed"]]
        for row, *values in zip(rows, *columns, strict=True):
            arrays = runs.trajectory(row["id"]).position[:, 0, 1]
            assert row["observed"] == {
                "lowest": arrays.min(), "end": arrays[-1], "frames": len(arrays), "name": "a", "none": None,
            }  # fmt: skip
            assert values[:4] == list(row["observed"].values())[:4]
            assert row["final"]["a"]["position"][1] == arrays[-1]
        group = runs.group([], ["observed.lowest"], where="observed.name = 'a'")[0]
        mean = group.quantities["observed.lowest"].mean
        assert mean == pytest.approx(np.mean(table["observed.lowest"]), rel=1e-15)  # rounding of a sum
        assert runs.value_columns == ("ball.a.restitution",)
        runs.to_parquet(tmp_path / "t.parquet")
        assert parquet.read_table(tmp_path / "t.parquet").to_pydict()["observed.end"] == table["observed.end"].tolist()
    _, lines, _ = lines_of(capfd, "runs", str(out), "--sort", "-observed.end", "--columns", "observed.end")
    ends = sorted((row["observed"]["end"] for row in rows), reverse=True)
    assert [line.split() for line in lines[1:4]] == [[f"{end:.5g}"] for end in ends]


def test_stored_runs_are_observed_without_running_them_again(
    observe: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = ("--out", str(tmp_path / "runs"))
    before = run(capfd, tmp_path, *out)
    assert "observed" not in before[0]
    after = run(capfd, tmp_path, "--observe", observe, *out)
    assert all(row["repeated"] for row in after)
    assert [row["seconds"] for row in after] == [row["seconds"] for row in before]
    both = run(capfd, tmp_path, "--observe", observe.replace(":heights", ":lowest"), *out)
    assert all(row["observed"]["lowest"] <= row["observed"]["end"] for row in both)  # those of both functions
    assert run(capfd, tmp_path, *out) == both
    with Store(tmp_path / "runs") as store:
        assert all(store.fault_of_file(row) is None and row.path is not None for row in store.rows())


def test_runs_without_arrays_are_run_again_and_an_edited_function_is_computed_again(
    observe: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    words = ("--keep", "summary", "--out", str(tmp_path / "runs"))
    assert not any(row["repeated"] for row in run(capfd, tmp_path, *words))
    assert not any(row["repeated"] for row in run(capfd, tmp_path, *words, "--observe", observe))
    assert all(row["repeated"] for row in run(capfd, tmp_path, *words, "--observe", observe))
    edited = HEIGHTS.replace('"frames": len(y)', '"count": len(y)')
    (tmp_path / "heights.py").write_text(edited)
    rows = run(capfd, tmp_path, *words, "--observe", observe)
    assert not any(row["repeated"] for row in rows)
    assert list(rows[0]["observed"]) == ["lowest", "end", "count", "name", "none"]


def test_runs_of_which_only_the_ends_are_kept_are_observed_whole(
    observe: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    rows = run(capfd, tmp_path, "--keep", "end", "--engine", "exact", "--observe", observe)
    assert all(0.5 <= row["observed"]["lowest"] < 0.52 for row in rows)  # within a frame of the impact
    assert rows[0]["contacts"] is None


def test_run_that_is_not_ok_has_no_values(observe: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    words = ("run", str(tmp_path / "drop.toml"), "--engine", "pymunk,exact", "--set", "solver.substeps=3")
    status, document, _ = json_of(capfd, *words, "--set", "world.damping=0.5", "--observe", observe)
    assert status == 1
    assert [(row["status"], len(row["observed"])) for row in document["runs"]] == [("ok", 5), ("refused", 0)]


def test_study_file_names_its_function_beside_it(
    observe: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    study = write_scene(tmp_path, '[study]\nscenes = ["drop.toml"]\nobserve = "heights.py:lowest"\n', "study.toml")
    status, document, _ = json_of(capfd, "run", study)
    assert status == 0
    assert list(document["runs"][0]["observed"]) == ["lowest"]
    document = json_of(capfd, "run", study, "--observe", observe)[1]
    assert len(document["runs"][0]["observed"]) == 5


@pytest.mark.parametrize("workers", ["1", "2"])
def test_exception_of_the_function_ends_the_command_with_its_line(
    tmp_path: Path, workers: str, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "wrong.py").write_text("def divide(x):\n    return 1 // x\n\ndef zero(run):\n    return divide(0)\n")
    words = ("run", write_scene(tmp_path, DROP), *SWEEP, "--workers", workers, "--out", str(tmp_path / "runs"))
    status, _, errors = lines_of(capfd, *words, "--observe", f"{tmp_path / 'wrong.py'}:zero")
    assert status == 2
    assert any("wrong.py:2: ZeroDivisionError" in line for line in errors)
    with Store(tmp_path / "runs") as store:
        assert not store.rows()


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("def f(run):\n    return run.position", "a value is a number"),
        ("def f(run):\n    return {1: 2}", "is no name"),
        ("def f(run):\n    return {str(k): k for k in range(999)}", "999 values"),
        ("def f(run):\n    return {'a': [1]}", "a value is a number"),
        ("def f(run):\n    return 2**64", "a value is a number"),
        ("def g(run):\n    return 1", "has no function 'f'"),
        ("f = 3", "has no function 'f'"),
        ("def f(run:\n", "x.py:1: SyntaxError"),
        ("\n\nimport no_such_module", "x.py:3: ModuleNotFoundError"),
        (
            "def f(run):\n    run.position[:] = 0.0\n    return 1",
            "x.py:2: ValueError: assignment destination is read-only",
        ),
        ("def f(run):\n    raise SystemExit(0)", "x.py:2: SystemExit: 0"),
        ("import sys\nsys.exit()", "x.py:2: SystemExit"),
        ("def f(run):\n    return 'a\\udc80'", "a value is a number"),
    ],
)
def test_unusable_functions_are_refused(
    tmp_path: Path, source: str, message: str, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "x.py").write_text(source)
    status, _, errors = lines_of(capfd, "run", write_scene(tmp_path, DROP), "--observe", f"{tmp_path / 'x.py'}:f")
    assert status == 2
    assert len(errors) == 1
    assert message in errors[0]


def test_file_may_define_dataclasses_with_postponed_annotations(tmp_path: Path) -> None:
    source = """from __future__ import annotations
from dataclasses import dataclass

@dataclass
class Peak:
    height: float

def peak(run):
    return Peak(run.position[:, 0, 1].max()).height
"""
    (tmp_path / "peaks.py").write_text(source)
    found = sandbox.run("bounce", dt=0.01)
    values = Observable.read(f"{tmp_path / 'peaks.py'}:peak").observe(found)["values"]
    assert values == {"peak": found.position[:, 0, 1].max()}
    found.position[0, 0, 1] = 0.0  # writeable again after the call


@pytest.mark.parametrize("text", ["heights", "heights.py", "heights.py:", "heights.py:a b", "none.py:f", "heights:f"])
def test_words_that_name_no_function_are_refused(text: str) -> None:
    with pytest.raises(ObservableError, match=r"FILE\.py:FUNCTION|cannot be read"):
        Observable.read(text)


def test_observable_travels_without_its_file(observe: str, tmp_path: Path) -> None:
    text = pickle.dumps(Observable.read(observe.replace(":heights", ":lowest")))
    (tmp_path / "heights.py").unlink()
    copy = pickle.loads(text)
    found = sandbox.run("bounce", dt=0.01)
    assert copy.observe(found)["values"] == {"lowest": found.position[:, 0, 1].min()}


def test_names_and_texts_with_brackets_are_printed_as_they_are(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "units.py").write_text("def f(run):\n    return {'peak [m]': 1, '[/x]': 2, ':smile:': '[/b]'}")
    out = str(tmp_path / "runs")
    words = ("--observe", f"{tmp_path / 'units.py'}:f", "--out", out)
    status, lines, _ = lines_of(capfd, "run", write_scene(tmp_path, DROP), *words)
    assert status == 0
    assert lines[1].split()[-4:] == ["peak", "[m]", "[/x]", ":smile:"]
    status, lines, _ = lines_of(capfd, "runs", out, "--by", "observed.:smile:")
    assert status == 0
    assert lines[1].split()[:2] == ["[/b]", "1"]


def test_states_at_the_end_are_columns_if_they_are_named(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = DROP.replace('name = "a"', 'name = "it\'s 8.5"')
    out = tmp_path / "runs"
    assert call(["run", write_scene(tmp_path, scene), "--seeds", "1", "--out", str(out), "--quiet"]) == 0
    with open_store(out) as runs:
        (run_id,) = runs.table(kind="numpy")["id"]
        ((name, end),) = runs.final(run_id).items()
        columns = [f'final."{name}".{key}' for key in ("x", "y", "vx", "vy", "angle", "angular_velocity")]
        values = [float(values[0]) for values in runs.table(columns=columns, kind="numpy").values()]
        assert values == [*end["position"], *end["velocity"], end["angle"], end["angular_velocity"]]
        assert len(runs.table(where=f"{columns[1]} > 0", kind="numpy")["id"]) == 1
        assert not any(column.startswith("final.") for column in runs.table(kind="numpy"))


def test_states_have_columns_though_the_last_run_was_refused(tmp_path: Path) -> None:
    scene = write_scene(tmp_path, DROP)
    words = ("--set", "world.damping=0.5", "--out", str(tmp_path / "runs"), "--quiet")
    assert call(["run", scene, "--engine", "pymunk,exact", *words]) == 1  # exact does not model damping
    with open_store(tmp_path / "runs") as runs:
        assert runs.arrays(columns=["status"])["status"].tolist() == ["refused", "ok"]
        heights = runs.arrays(columns=["final.a.y"])["final.a.y"]
        assert np.isfinite(heights).tolist() == [False, True]


def test_damaged_details_have_no_states(tmp_path: Path) -> None:
    assert call(["run", write_scene(tmp_path, DROP), "--out", str(tmp_path / "runs"), "--quiet"]) == 0
    for text in ("{", "[1]", '{"final": 3}', '{"final": {"a\\"b": 1}}'):
        with closing(sqlite3.connect(tmp_path / "runs" / "runs.sqlite")) as database:
            database.execute("UPDATE runs SET details = ?", (text,))
            database.commit()
        with open_store(tmp_path / "runs") as runs:
            assert not any(column.startswith("final.") for column in runs.columns)
