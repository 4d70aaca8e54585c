"""`sandbox tradeoff`: what it prints, its JSON, what it writes, its exit status."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import sandbox
from sandbox.cli import tradeoff as module
from sandbox.cli.main import call
from sandbox.cli.tradeoff import print_tradeoff
from sandbox.measure.compare.ground_truth import truth_of
from sandbox.measure.tradeoff.configuration import Evaluation, evaluate
from sandbox.measure.tradeoff.result import Tradeoff
from sandbox.scene.files import toml_edit as rewrite
from tests.cli.calling import DROP, FAULTY, document_of, json_of, lines_of, written

pytestmark = pytest.mark.full  # child processes and command lines that run long

FEW = ("--engine", "pymunk", "--points", "6", "--repeats", "1")
"""Enough for an answer, and quick."""
COMMENTED = DROP.replace(
    "[[plane]]", "[solver]  # mine\ndt = 0.02  # coarse\nsubsteps = 1\n\n# below it all\n[[plane]]", 1
)
BULLET = """
world = { duration = 0.2 }
solver = { dt = 0.01 }
wall = [{ name = "wall", points = [[1.0, -1.0], [1.0, 1.0]], thickness = 0.01 }]

[[ball]]
name = "bullet"
position = [0.0, 0.0]
velocity = [20.0, 0.0]
radius = 0.02
restitution = 1.0
"""


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
    assert out[0].startswith(f"{scene} (Drop): error metric: max_position ")
    assert "closed form" in out[0]
    assert re.fullmatch("[456] settings tried", out[1])
    assert out[2].split()[:4] == ["engine", "dt", "substeps", "iterations"]
    rows = out[3 : next(k for k, line in enumerate(out) if line.startswith("ms/s: "))]
    assert len([row for row in rows if row.split()[-1] == "scene" or " scene " in row]) == 1
    assert any("cheapest" in row for row in rows)
    answers = [line for line in out if line.startswith(("cheapest setting", "most accurate setting"))]
    assert answers[0].startswith("cheapest setting with max_position within 10 mm: pymunk with substeps = ")
    assert answers[1].startswith("most accurate setting within 4 ms per frame at 60 fps: pymunk")
    assert "    [solver]" in out
    assert any(line.startswith("    space.iterations = ") for line in out)


def test_notes_name_what_can_go_wrong_with_a_recommended_setting(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    scene = written(tmp_path, BULLET)
    own = ("--engine", "pymunk", "--effort", "0.05", "--repeats", "1", "--metric", "missed_contacts", "--budget", "100")
    status, out, err = lines_of(capfd, "tradeoff", scene, *own)
    assert (status, err) == (0, [])
    (k,) = [k for k, line in enumerate(out) if line.startswith("cheapest setting with missed_contacts")]
    assert re.search(r"ms per frame of the budget of 100 ms$", out[k])
    notes = [line for line in out[k:] if line.startswith("note: pymunk with ")]
    (note, *_) = [line for line in notes if "'bullet' can approach 'wall'" in line]
    assert "substeps >= 8 prevents tunnelling" in note
    assert len(notes) == len(set(notes))


def test_rows_whose_step_is_longer_than_a_frame_are_marked(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = written(tmp_path, BULLET)
    own = ("tradeoff", scene, "--engine", "pymunk", "--effort", "0.05", "--repeats", "1", "--tolerance", "100")
    _, out, _ = lines_of(capfd, *own)
    rows = [line.split() for line in out if line.startswith("pymunk ")]
    long = [row for row in rows if float(row[1]) > 1.01 / 60.0]
    assert long
    assert [row for row in rows if ">frame" in row] == long
    assert all("cheapest" not in row for row in long)
    (legend,) = [line for line in out if line.startswith(">frame: ")]
    assert "longer than a frame at 60 fps" in legend
    _, out, _ = lines_of(capfd, *own, "--fps", "10")
    assert not [line for line in out if ">frame" in line]


def test_error_that_is_split_into_parts_is_named(capfd: pytest.CaptureFixture[str]) -> None:
    scene = sandbox.loads(BULLET)
    truth = truth_of(scene, scene.solver, 1e-4)
    assert truth is not None
    more: dict[str, Any] = {"metric": "missed_contacts", "most": 2, "repeats": 1}
    for until, label in ((0.2, ""), (0.15, ", while the truth is trusted (0.15 s)")):
        found = sandbox.tradeoff(scene, ("pymunk",), truth=replace(truth, trusted_until=until), **more)
        print_tradeoff("bullet", found)
        assert f"position error of pymunk with the settings of the scene{label}: " in capfd.readouterr().out


def test_quiet_prints_nothing(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = written(tmp_path)
    assert lines_of(capfd, "tradeoff", scene, *FEW, "--tolerance", "0.1", "--quiet") == (0, [], [])


def test_nothing_within_the_tolerance_is_status_1(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = written(tmp_path)
    before = Path(scene).read_bytes()
    status, out, err = lines_of(capfd, "tradeoff", scene, *FEW, "--tolerance", "1e-9", "--write")
    assert (status, err) == (1, [])
    assert any(re.search("none of the . settings tried; the nearest is pymunk with ", line) for line in out)
    assert out[-1].startswith("not written")
    assert Path(scene).read_bytes() == before


def test_nothing_within_the_budget_is_status_1(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, document, _ = json_of(capfd, "tradeoff", written(tmp_path), *FEW, "--tolerance", "1", "--budget", "1e-9")
    assert status == 1
    assert document["within_budget"] is None
    assert document["nearest_to_budget"]["cost_ms_per_second"] > 0.0
    assert document["within_tolerance"] is not None
    assert document["nearest_to_tolerance"] is None


def test_patience_is_another_name_of_the_time_limit(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    limits = []
    real = module.tradeoff

    def noted(*arguments: Any, **more: Any) -> Tradeoff:
        limits.append(more["time_limit"])
        return real(*arguments, **more)

    monkeypatch.setattr(module, "tradeoff", noted)
    for flag in ((), ("--patience", "50"), ("--time-limit", "50")):
        lines_of(capfd, "tradeoff", written(tmp_path), *FEW, *flag, "--tolerance", "1")
    assert limits == [None, 50.0, 50.0]


def test_same_command_tries_the_same_settings_and_gives_the_same_errors(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    scene, found = written(tmp_path), []
    for _ in range(2):
        _, document, _ = json_of(capfd, "tradeoff", scene, "--effort", "0.05", "--tolerance", "0.01", "--repeats", "1")
        kept = ("engine", "settings", "error", "status", "work", "counted_cost_ms_per_second")
        found.append(([{key: row[key] for key in kept} for row in document["points"]], document["spent"]))
    assert found[0] == found[1]


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
    assert out[-2:] == [f"{scene}: already has the recommended [solver]", "run it with --engine exact"]


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
    assert err[0].startswith("--engine: unknown engine 'unity'")
    assert err[1].startswith("--metric: unknown metric 'beauty'; metrics: max_position, ")
    assert err[2].startswith("--tolerance: ") and " 0;" in err[2]
    assert err[3].startswith(f"{scene}:3: ball.a.position")
    assert err[4].startswith(f"{scene}:4: ball.a.radius")


@pytest.mark.parametrize(
    "figure",
    [
        ("--tolerance", "nan"),
        ("--budget", "inf"),
        ("--fps", "inf"),
        ("--zoom", "nan"),
        ("--time-limit", "inf"),
        ("--effort", "inf"),
    ],
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
    assert line.startswith("--write: cannot be combined with --set")


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

    def until_then(*arguments: Any) -> Evaluation:
        nonlocal done
        if done == count:
            raise KeyboardInterrupt
        done += 1
        return evaluate(*arguments)

    monkeypatch.setattr("sandbox.measure.tradeoff.search.evaluate", until_then)


def test_interrupt_keeps_what_was_tried(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupted_after(3, monkeypatch)
    scene = written(tmp_path)
    status, document, err = json_of(capfd, "tradeoff", scene, "--engine", "pymunk", "--tolerance", "1e-3", "--write")
    assert (status, err) == (130, ["interrupted: the 3 settings tried so far are kept"])
    assert document["interrupted"]
    assert [row["status"] for row in document["points"]] == ["ok"] * 3
    assert all(row["cost_ms_per_second"] > 0.0 and row["repeats"] == 0 for row in document["points"])
    assert Path(scene).read_text(encoding="utf-8") == DROP


def test_interrupt_while_it_is_timed_keeps_what_was_tried(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("sandbox.measure.tradeoff.study.time_in_turns", interrupted)
    status, document, err = json_of(capfd, "tradeoff", written(tmp_path), *FEW, "--tolerance", "0.01")
    assert (status, err) == (130, [f"interrupted: the {len(document['points'])} settings tried so far are kept"])
    assert document["interrupted"]
    assert document["within_tolerance"]["error"] <= 0.01


def test_interrupt_before_anything_is_tried_is_told(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupted_after(0, monkeypatch)
    assert call(["tradeoff", written(tmp_path), "--engine", "pymunk"]) == 130
    out, err = capfd.readouterr()
    assert "none of the 0 settings tried" in out
    assert err.splitlines() == ["interrupted: the 0 settings tried so far are kept"]


def test_interrupt_while_the_truth_is_sought_is_one_line(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("sandbox.measure.tradeoff.study.find_truth", interrupted)
    assert call(["tradeoff", written(tmp_path)]) == 130
    out, err = capfd.readouterr()
    assert (out, err.splitlines()[-1]) == ("", "interrupted")
