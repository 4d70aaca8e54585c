"""`sandbox runs`: lists, filters, groups, tables and plots of stored runs."""

import csv
import json
import re
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from PIL import Image

import sandbox
from sandbox.cli.main import call
from tests.cli.calling import DROP, SPARKS, json_of, lines_of, output_of, write_scene
from tests.cli.json_validation import assert_valid_document


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A store of 24 runs: two engines, two heights, two steps, three seeds."""
    folder = tmp_path_factory.mktemp("study")
    scene = write_scene(folder, DROP + SPARKS)
    words = ["--sweep", "ball.a.restitution=0.2,0.8", "--sweep", "solver.dt=0.01,0.005", "--seeds", "3"]
    more = ["--engines", "pymunk,reference", "--keep", "summary", "--quiet", "--out", str(folder / "runs")]
    assert call(["run", scene, *words, *more]) == 0
    return str(folder / "runs")


def test_list_has_the_columns_in_which_runs_differ(study: str, capfd: pytest.CaptureFixture[str]) -> None:
    out = output_of(capfd, "runs", study)
    assert out[0].split()[:5] == ["id", "engine", "ball.a.restitution", "solver.dt", "seed"]
    assert "title" not in out[0]
    assert len(out) == 26
    assert out[-1] == "24 runs: 24 ok"
    _, out, _ = lines_of(capfd, "runs", study, "--limit", "3")
    assert (len(out), out[-1]) == (5, "24 runs: 24 ok; the last 3 are listed (--limit 0 lists all)")
    _, out, _ = lines_of(capfd, "runs", study, "--limit", "3", "--sort", "seed", "--columns", "seed")
    assert [line.strip() for line in out[1:4]] == ["1", "1", "1"]
    assert out[-1] == "24 runs: 24 ok; the first 3 are listed (--limit 0 lists all)"


def test_filters_are_joined_by_and(study: str, capfd: pytest.CaptureFixture[str]) -> None:
    words = ("--where", "solver.dt < 0.01", "--where", "engine = 'pymunk' or seed = 1 -- either")
    _, document, _ = json_of(capfd, "runs", study, *words)
    assert document["count"] == len(document["runs"]) == 8
    assert all(run["solver.dt"] == 0.005 for run in document["runs"])
    assert lines_of(capfd, "runs", study, "--where", "seed > 99")[1] == ["no runs"]


def test_rows_are_sorted_and_columns_chosen(study: str, capfd: pytest.CaptureFixture[str]) -> None:
    _, out, _ = lines_of(capfd, "runs", study, "--columns", "solver.dt,seed", "--sort", "-seed,solver.dt", "--csv")
    rows = list(csv.reader(out))
    assert rows[0] == ["solver.dt", "seed"]
    assert rows[1:] == sorted(rows[1:], key=lambda row: (-int(row[1]), float(row[0])))
    assert len(rows) == 25


@pytest.mark.parametrize("words", [(), ("--by", "engine,solver.dt", "--success", "contacts > 0")])
def test_json_document_fits_its_schema(words: tuple[str, ...], study: str, capfd: pytest.CaptureFixture[str]) -> None:
    status, document, _ = json_of(capfd, "runs", study, *words)
    assert status == 0
    assert_valid_document("runs", document)
    assert (document["count"], document["statuses"]) == (24, {"ok": 24})
    assert ("groups" in document, "runs" in document) == (bool(words), not words)


def test_groups_have_statistics_and_success_rates(study: str, capfd: pytest.CaptureFixture[str]) -> None:
    words = ("runs", study, "--by", "engine,solver.dt", "--of", "contacts", "--success", "ball.a.restitution = 0.8")
    _, document, _ = json_of(capfd, *words)
    assert [group["keys"] for group in document["groups"]] == [
        {"engine": engine, "solver.dt": dt} for engine in ("pymunk", "reference") for dt in (0.005, 0.01)
    ]
    for group in document["groups"]:
        assert (group["runs"], group["success_rate"]) == (6, 0.5)
        assert group["success_low"] < 0.5 < group["success_high"]
        assert set(group["quantities"]["contacts"]) == {"count", "mean", "deviation", "quantiles"}
    _, out, _ = lines_of(capfd, *words)
    assert out[0].split() == ["engine", "solver.dt", "runs", "success", "contacts"]
    assert out[1].split()[:5] == ["pymunk", "0.005", "6", "50", "%"]
    _, out, _ = lines_of(capfd, *words, "--csv")
    rows = list(csv.DictReader(out))
    assert float(rows[0]["contacts mean"]) == document["groups"][0]["quantities"]["contacts"]["mean"]
    assert list(rows[0])[-3:] == ["contacts q0.1", "contacts q0.5", "contacts q0.9"]


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(
    "words",
    [
        ("energy_end", "solver.dt"),
        ("contacts", "engine"),
        ("contacts", "solver.dt,ball.a.restitution"),
        ("seconds", "engine,seed"),
    ],
)
def test_plot_is_drawn(words, study, tmp_path, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)
    quantity, by = words
    name = f"{quantity}-by-{by.replace(',', '-')}.png"
    assert lines_of(capfd, "runs", study, "--plot", quantity, "--by", by) == (0, [f"drawn: {name}"], [])
    with Image.open(tmp_path / name) as picture:
        assert min(picture.size) > 400
        assert len(picture.convert("RGB").getcolors(10**6) or []) > 20
    target = tmp_path / "x.svg"
    assert lines_of(capfd, "runs", study, "--plot", quantity, "--by", by, "--to", str(target), "--quiet") == (0, [], [])
    assert target.read_text().startswith("<?xml")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--where", "foo = 1"), "--where: no column is named 'foo'"),
        (("--where", "solver.d = 1"), "did you mean 'solver.dt'?"),
        (("--success", "status ="), "--success: "),
        (("--by", "engin"), "--by: no column is named 'engin'; did you mean 'engine'?"),
        (("--by", "engine", "--of", "status"), "status has no numbers"),
        (("--of", "contacts"), "--of: works only together with --by KEY"),
        (("--by", "engine", "--columns", "id"), "--columns: is for lists"),
        (("--sort", "-x"), "--sort: no column is named 'x'"),
        (("--plot", "contacts"), "--plot: draws over one or two keys"),
        (("--plot", "score", "--by", "engine"), "--plot: no run that is ok has a value of score"),
        (("--plot", "contacts", "--by", "engine", "--to", "a.gif"), "--to: a.gif: the name must end in .png"),
        (("--to", "a.png"), "--to: names the file of --plot"),
        (("--csv", "--json"), "--csv: is given with --json too"),
    ],
)
def test_wrong_command_line_is_reported(words, message, study, capfd):
    status, _, err = lines_of(capfd, "runs", study, *words)
    assert status == 2
    assert any(message in line for line in err), err
    assert not any("Traceback" in line for line in err)


def test_folder_without_runs_is_reported(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, _, err = lines_of(capfd, "runs", str(tmp_path))
    assert (status, err) == (2, [f"{tmp_path}: no stored runs; `sandbox run SCENE --out {tmp_path}` stores runs"])
    status, out, _ = lines_of(capfd, "runs", str(tmp_path), "--json")
    assert (status, json.loads(out[0])["faults"][0]["file"]) == (2, str(tmp_path))


def test_runs_of_several_versions_are_told_apart(study: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """As after an update between two commands that add to one store."""
    folder = str(shutil.copytree(study, tmp_path / "mixed"))
    with closing(sqlite3.connect(f"{folder}/runs.sqlite")) as database:
        older = "UPDATE runs SET versions = replace(versions, '+src.', '+src.0') WHERE engine = 'pymunk' AND seed = 1"
        database.execute(older)
        database.commit()
    _, document, err = json_of(capfd, "runs", folder, "--by", "engine")
    assert [(group["keys"]["engine"], group["versions"]) for group in document["groups"]] == [
        ("pymunk", 2),
        ("reference", 1),
    ]
    (note,) = err
    assert re.fullmatch(
        r"note: runs of pymunk by several versions are taken together: \d of sandbox [^,]*\+src\.\w{8,9}, "
        r"\d of sandbox [^,]*\+src\.\w{8,9}; --by versions separates them",
        note,
    )
    for words in (("--by", "engine,versions"), ("--by", "engine", "--where", "seed <> 1")):
        _, document, err = json_of(capfd, "runs", folder, *words)
        assert ({group["versions"] for group in document["groups"]}, err) == ({1}, [])
    _, out, _ = lines_of(capfd, "runs", folder, "--where", "engine = 'pymunk'")
    assert out[0].split()[-1] == "versions"
    assert "versions" not in lines_of(capfd, "runs", study)[1][0]


def test_runs_that_are_ok_with_warnings_are_counted_and_filtered(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    store = ("--out", str(tmp_path / "runs"))
    sweep = ("--sweep", "solver.integrator=explicit_euler,velocity_verlet", "--set", "world.duration=20")
    assert lines_of(capfd, "run", "spring", "--engine", "reference", *sweep, *store)[0] == 0
    _, lines, _ = lines_of(capfd, "runs", str(tmp_path / "runs"))
    assert lines[-2:] == ["2 runs: 2 ok", "runs with warnings: 1; --columns id,warnings lists them"]
    with sandbox.open_store(tmp_path / "runs") as runs:
        found = runs.table(where="warnings IS NOT NULL", columns=["solver.integrator", "warnings"], kind="numpy")
        assert found["solver.integrator"].tolist() == ["explicit_euler"]
        assert "without a source" in json.loads(found["warnings"][0])[0]
        assert runs.statuses("warnings IS NULL") == {"ok": 1}
