"""`sandbox tradeoff`: what it prints, its JSON, what it writes, its exit status."""

from pathlib import Path
from typing import Any

import pytest
from calling import DROP, FAULTY, document_of, json_of, lines_of, written

import sandbox
from sandbox.cli import tradeoff as module
from sandbox.cli.main import call
from sandbox.measure.tradeoff.trial import Trial, tried
from sandbox.scene import rewrite

FEW = ("--engine", "pymunk", "--patience", "60", "--points", "6", "--repeats", "1")
"""Enough for an answer, and quick."""
COMMENTED = DROP.replace(
    "[[plane]]", "[solver]  # mine\ndt = 0.02  # coarse\nsubsteps = 1\n\n# below it all\n[[plane]]", 1
)


def test_json_is_as_promised_to_the_letter(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = written(tmp_path)
    status, document, err = json_of(capfd, "tradeoff", scene, *FEW, "--tolerance", "0.01", "--budget", "4")
    assert (status, err) == (0, [])
    wanted = {"scene", "truth", "metric", "points", "pareto", "within_tolerance", "within_budget"}
    assert set(document) >= wanted
    assert (document["scene"], document["truth"], document["metric"]) == (scene, "closed_form", "max_position")
    assert 1 < len(document["points"]) <= 6
    for row in [*document["points"], *document["pareto"], document["within_tolerance"], document["within_budget"]]:
        assert set(row) >= {"engine", "settings", "error", "cost_ms_per_second", "status"}
        assert row["engine"] == "pymunk"
    assert document["within_tolerance"]["error"] <= 0.01
    assert document["within_tolerance"]["cost_ms_per_second"] > 0.0


def test_table_has_the_front_and_the_answers(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = written(tmp_path)
    status, out, err = lines_of(capfd, "tradeoff", scene, *FEW, "--tolerance", "0.01", "--budget", "4")
    assert (status, err) == (0, [])
    assert out[0] == f"{scene}: Drop"
    assert out[1].startswith("max_position: largest distance from the truth; truth: closed form, trusted until 0.5 s")
    assert out[2].split()[:4] == ["engine", "dt", "substeps", "iterations"]
    answers = [line for line in out if line.startswith(("cheapest setting", "best setting"))]
    assert answers[0].startswith("cheapest setting with max_position within 10 mm: pymunk with substeps = ")
    assert answers[1].startswith("best setting within 4 ms a frame, at 60 frames a second: pymunk")


def test_quiet_prints_nothing(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = written(tmp_path)
    assert lines_of(capfd, "tradeoff", scene, *FEW, "--tolerance", "0.1", "--quiet") == (0, [], [])


def test_nothing_within_the_tolerance_is_status_1(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = written(tmp_path)
    before = Path(scene).read_bytes()
    status, out, err = lines_of(capfd, "tradeoff", scene, *FEW, "--tolerance", "1e-9", "--write")
    assert (status, err) == (1, [])
    assert any("none of the" in line for line in out)
    assert out[-1].startswith("not written")
    assert Path(scene).read_bytes() == before


def test_nothing_within_the_budget_is_status_1(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, document, _ = json_of(capfd, "tradeoff", written(tmp_path), *FEW, "--tolerance", "1", "--budget", "1e-9")
    assert status == 1
    assert document["within_budget"] is None
    assert document["within_tolerance"] is not None


def test_write_keeps_comments_and_the_file_meets_the_tolerance(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    scene = written(tmp_path, COMMENTED)
    status, out, err = lines_of(capfd, "tradeoff", scene, *FEW, "--tolerance", "0.01", "--write")
    assert (status, err) == (0, [])
    assert out[-1] == f"written: {scene}"
    text = Path(scene).read_text(encoding="utf-8")
    assert "[solver]  # mine" in text
    assert "# below it all" in text
    assert text != COMMENTED
    found = sandbox.compare(sandbox.load(scene), ["pymunk"])
    error = found.rows[0].score.max_position
    assert error is not None
    assert error <= 0.01


def test_write_says_which_engine_it_is_for(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = written(tmp_path)
    _, out, _ = lines_of(capfd, "tradeoff", scene, "--engine", "exact", "--points", "1", "--repeats", "1", "--write")
    assert out[-2:] == [f"{scene}: has the recommended [solver] already", "run it with --engine exact"]


def faults_of(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, *arguments: str) -> list[str]:
    """Call with what is wrong; nothing may be run."""

    def nothing(*_: Any, **__: Any) -> None:
        raise AssertionError("it was run")

    monkeypatch.setattr(module, "tradeoff", nothing)
    status, out, err = lines_of(capfd, "tradeoff", *arguments)
    assert (status, out) == (2, [])
    return err


def test_faults_are_a_line_each_and_all_at_once(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = written(tmp_path, FAULTY)
    err = faults_of(capfd, monkeypatch, scene, "--engine", "pymunk,unity", "--metric", "beauty", "--tolerance", "0")
    assert len(err) == 5
    assert err[0].startswith("--engine: no engine 'unity'")
    assert err[1].startswith("--metric: no metric 'beauty'; metrics: max_position, ")
    assert err[2] == "--tolerance: a tolerance of 0; it is positive and finite"
    assert err[3].startswith(f"{scene}:3: ball.a.position")
    assert err[4].startswith(f"{scene}:4: ball.a.radius")


@pytest.mark.parametrize(
    "figure", [("--tolerance", "nan"), ("--budget", "inf"), ("--fps", "inf"), ("--zoom", "nan"), ("--patience", "inf")]
)
def test_figure_without_end_is_a_fault(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, figure: tuple[str, str]
) -> None:
    (line,) = faults_of(capfd, monkeypatch, written(tmp_path), *figure)
    assert line.startswith(f"{figure[0]}: ")
    assert "positive and finite" in line


@pytest.mark.parametrize(
    "figure", [("--budget", "0"), ("--seeds", "0"), ("--points", "0"), ("--zoom", "-1"), ("--tolerance", "-1")]
)
def test_figure_out_of_range_is_a_fault(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, figure: tuple[str, str]
) -> None:
    (line,) = faults_of(capfd, monkeypatch, written(tmp_path), *figure)
    assert figure[0] in line


def test_write_with_set_is_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (line,) = faults_of(capfd, monkeypatch, written(tmp_path), "--set", "world.duration=0.1", "--write")
    assert line.startswith("--write: the file lacks what --set changes")


def test_write_into_the_installed_package_is_refused_at_once(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "shipped").mkdir()
    monkeypatch.setattr(rewrite, "PACKAGE", tmp_path)
    scene = written(tmp_path / "shipped")
    (line,) = faults_of(capfd, monkeypatch, scene, "--write")
    assert "part of the installed package" in line
    assert Path(scene).read_text(encoding="utf-8") == DROP


def test_faults_are_json_too(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, document, err = json_of(capfd, "tradeoff", str(tmp_path / "none.toml"), "--metric", "beauty")
    assert status == 2
    assert [row["file"] for row in document["faults"]] == ["--metric", str(tmp_path / "none.toml")]
    assert (document["points"], document["within_tolerance"]) == ([], None)
    assert len(err) == 2


def test_folder_gets_the_document(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "new" / "folder"
    _, document, err = json_of(capfd, "tradeoff", written(tmp_path), *FEW, "--tolerance", "1", "--out", str(out))
    assert err == []
    assert document_of((out / "tradeoff.json").read_text(encoding="utf-8")) == document
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Error against cost" in page
    assert "<canvas" in page


def interrupted_after(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Interrupt the search when so many settings have been tried."""
    done = 0

    def until_then(*arguments: Any) -> Trial:
        nonlocal done
        if done == count:
            raise KeyboardInterrupt
        done += 1
        return tried(*arguments)

    monkeypatch.setattr("sandbox.measure.tradeoff.search.tried", until_then)


def test_interrupt_keeps_what_was_tried(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupted_after(3, monkeypatch)
    scene = written(tmp_path)
    status, document, err = json_of(capfd, "tradeoff", scene, "--engine", "pymunk", "--tolerance", "1e-3", "--write")
    assert (status, err) == (130, ["interrupted: 3 settings are tried and kept"])
    assert document["interrupted"]
    assert [row["status"] for row in document["points"]] == ["ok"] * 3
    assert all(row["cost_ms_per_second"] > 0.0 and row["repeats"] == 0 for row in document["points"])
    assert Path(scene).read_text(encoding="utf-8") == DROP


def test_interrupt_while_it_is_timed_keeps_what_was_tried(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("sandbox.measure.tradeoff.weighing.costs", interrupted)
    status, document, err = json_of(capfd, "tradeoff", written(tmp_path), *FEW, "--tolerance", "0.01")
    assert (status, err) == (130, [f"interrupted: {len(document['points'])} settings are tried and kept"])
    assert document["interrupted"]
    assert document["within_tolerance"]["error"] <= 0.01


def test_interrupt_before_anything_is_tried_is_told(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupted_after(0, monkeypatch)
    assert call(["tradeoff", written(tmp_path), "--engine", "pymunk"]) == 130
    out, err = capfd.readouterr()
    assert "none of the 0 that were tried" in out
    assert err.splitlines() == ["interrupted: 0 settings are tried and kept"]


def test_interrupt_while_the_truth_is_sought_is_one_line(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("sandbox.measure.tradeoff.weighing.truth_of", interrupted)
    assert call(["tradeoff", written(tmp_path)]) == 130
    out, err = capfd.readouterr()
    assert (out, err.splitlines()[-1]) == ("", "interrupted")
