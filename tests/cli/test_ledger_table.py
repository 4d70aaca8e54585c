"""`sandbox run --ledger`: energy ledger in the output and in JSON."""

from pathlib import Path

import pytest

from sandbox.engines.energy_ledger import Cause
from sandbox.trajectory import Trajectory
from tests.cli.calling import json_of, lines_of, write_scene

RUN = ("--engine", "reference", "--ledger")


def test_ledger_is_printed_by_cause(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, lines, err = lines_of(capfd, "run", write_scene(tmp_path), *RUN)
    assert (status, err) == (0, [])
    head = next(k for k, line in enumerate(lines) if line.startswith("energy of"))
    words = [line.split()[0] for line in lines[head + 1 :]]
    assert words == ["start", "restitution", "position", "integrator", "phantom", "sum", "end", "residual", "%:"]
    rows = {line.split()[0]: line.split()[1:] for line in lines[head + 1 :]}
    assert rows["start"] == ["10"]  # m·g·y, y = 1 m
    assert float(rows["restitution"][0]) == pytest.approx(-3.75, rel=0.1)  # (1 − e²) · 5 J, to the resolution of a step
    assert rows["phantom"] == ["0"]
    assert float(rows["start"][0]) + float(rows["sum"][0]) == pytest.approx(float(rows["end"][0]), abs=1e-3)  # 5 digits


def test_ledgers_of_runs_of_one_scene_are_columns_of_one_table(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    sweep = ("--sweep", "solver.integrator='explicit_euler','velocity_verlet'")
    _, lines, _ = lines_of(capfd, "run", write_scene(tmp_path), *RUN, *sweep)
    heads = [line for line in lines if line.startswith("energy of")]
    assert len(heads) == 1
    assert "integrator=explicit_euler" in heads[0]
    assert "integrator=velocity_verlet" in heads[0]
    integrator = next(line.split() for line in lines if line.split()[:1] == ["integrator"])
    assert integrator[-1] == "0"  # velocity Verlet is exact under gravity


def test_json_has_the_ledger_only_on_request(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    _, document, _ = json_of(capfd, "run", write_scene(tmp_path), *RUN)
    ledger = document["runs"][0]["ledger"]
    assert list(ledger) == ["start", "causes", "end", "residual", "scale", "closes_to"]
    assert list(ledger["causes"]) == list(Cause)
    assert ledger["closes_to"] < 1e-9  # documented for the engines of this package
    assert ledger["end"] == document["runs"][0]["energy_end"]
    _, document, _ = json_of(capfd, "run", write_scene(tmp_path), "--engine", "reference")
    assert "ledger" not in document["runs"][0]


def test_refused_run_has_no_ledger(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, document, _ = json_of(capfd, "run", write_scene(tmp_path), *RUN, "--set", "solver.half_kick=true")
    assert (status, document["runs"][0]["status"], document["runs"][0]["ledger"]) == (1, "refused", None)
    status, lines, _ = lines_of(capfd, "run", write_scene(tmp_path), *RUN, "--set", "solver.half_kick=true")
    assert not any(line.startswith(("energy of", "%:")) for line in lines)


def test_run_stored_without_a_ledger_is_repeated(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    store = ("--out", str(tmp_path / "runs"))
    scene = write_scene(tmp_path)
    _, document, _ = json_of(capfd, "run", scene, "--engine", "reference", *store)
    first = document["runs"][0]
    assert not len(Trajectory.load(first["path"]).account)
    _, document, _ = json_of(capfd, "run", scene, *RUN, *store)
    second = document["runs"][0]
    assert (second["id"], second["path"], second["repeated"]) == (first["id"], first["path"], False)
    assert second["state_hash"] == first["state_hash"]
    _, document, _ = json_of(capfd, "run", scene, *RUN, *store)
    third = document["runs"][0]
    assert (third["repeated"], third["ledger"]) == (True, second["ledger"])
