"""`sandbox tradeoff`: output, JSON, files, exit status."""

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
from sandbox.scene.files import solver_in_file as rewrite
from tests.cli.calling import DROP, FAULTY, document_of, json_of, lines_of, output_of, write_scene

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

QUICK = ("--engine", "pymunk", "--points", "6", "--repeats", "1")
"""Options for a quick search that finds a setting."""
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


def test_table_has_the_pareto_front_and_the_recommended_settings(tmp_path, capfd):
    scene = write_scene(tmp_path)
    out = output_of(capfd, "tradeoff", scene, *QUICK, "--tolerance", "0.01", "--budget", "4")
    assert out[0].startswith(f"{scene} (Drop): error metric: max_position ")
    assert "closed form" in out[0]
    assert re.fullmatch("[456] settings tried", out[1])
    assert re.match(r"starts: that of the scene.*; fresh starts have positions ± 5 mm, velocities ± 1 %", out[2])
    assert out[3].split()[:4] == ["engine", "dt", "substeps", "iterations"]
    rows = out[4 : next(k for k, line in enumerate(out) if line.startswith("ms/s: "))]
    assert len([row for row in rows if row.split()[-1] == "scene" or " scene " in row]) == 1
    assert any("cheapest" in row for row in rows)
    recommendations = [line for line in out if line.startswith(("cheapest setting", "most accurate setting"))]
    assert recommendations[0].startswith("cheapest setting with max_position within 10 mm: pymunk with substeps = ")
    assert recommendations[1].startswith("most accurate setting within 4 ms per frame at 60 fps: pymunk")
    assert "    [solver]" in out
    assert any(line.startswith("    space.step(dt") or line.startswith("        space.step(dt") for line in out)


def test_error_of_the_run_that_is_the_truth_is_printed_as_truth(tmp_path: Path, capfd: Any) -> None:
    scene = write_scene(tmp_path, BULLET)
    options = ("--engine", "exact,pymunk", "--set", "solver.dt=0.004", "--effort", "0.2", "--repeats", "1")
    out = output_of(capfd, "tradeoff", scene, *options)
    rows = {line.split()[0]: line.split() for line in out if line.split() and line.split()[-1] in ("scene", "cheapest")}
    assert "truth" in rows["exact"] and "truth" not in rows["pymunk"]
    points = json_of(capfd, "tradeoff", scene, *options)[1]["points"]
    own = [point for point in points if point["is_truth"]]
    assert {point["engine"] for point in own} == {"exact"}
    assert all(point["error"] == 0.0 for point in own), "also with another dt, which chooses the frames of exact only"
    assert len({point["settings"]["dt"] for point in own}) > 1
    as_energy = json_of(capfd, "tradeoff", scene, *options, "--metric", "energy")[1]["points"]
    assert not any(point["is_truth"] for point in as_energy), "a drift of 0 is measured"


def test_setting_that_may_tunnel_is_not_recommended_and_said_so(tmp_path, capfd):
    scene = write_scene(tmp_path, BULLET)
    chosen = "--engine pymunk --effort 0.2 --repeats 5 --metric missed_contacts --budget 100"  # the least of 5: noise
    out = output_of(capfd, "tradeoff", scene, *chosen.split())
    (answer,) = [line for line in out if line.startswith("cheapest setting with missed_contacts")]
    assert re.search(r"ms per frame of the budget of 100 ms; held in 30 of 30 fresh starts \(95 % interval 89", answer)
    (rejected,) = [line for line in out if line.startswith("within the tolerance, but not recommended: ")]
    assert re.search(r"Because: odds up to \d+ % that 'bullet' tunnels through 'wall'$", rejected)
    assert not [line for line in out if line.startswith("note: ") and "tunnel" in line]


def test_rows_whose_step_is_longer_than_a_frame_are_marked(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path, BULLET)
    options = ("tradeoff", scene, "--engine", "pymunk", "--effort", "0.05", "--repeats", "1", "--tolerance", "100")
    _, out, _ = lines_of(capfd, *options)
    rows = [line.split() for line in out if line.startswith("pymunk ")]
    marked = [row for row in rows if float(row[1]) > 1.01 / 60.0]
    assert marked
    assert [row for row in rows if ">frame" in row] == marked
    assert all("cheapest" not in row for row in marked)
    (legend,) = [line for line in out if line.startswith(">frame: ")]
    assert "longer than a frame at 60 fps" in legend
    _, out, _ = lines_of(capfd, *options, "--fps", "10")
    assert not [line for line in out if ">frame" in line]


def test_position_error_is_labelled_with_its_trusted_time(capfd: pytest.CaptureFixture[str]) -> None:
    scene = sandbox.loads(BULLET)
    truth = truth_of(scene, scene.solver, 1e-4)
    assert truth is not None
    options: dict[str, Any] = {"metric": "missed_contacts", "most": 2, "repeats": 1}
    for until, label in ((0.2, ""), (0.15, ", while the truth is trusted (0.15 s)")):
        found = sandbox.tradeoff(scene, ("pymunk",), truth=replace(truth, trusted_until=until), **options)
        print_tradeoff("bullet", found)
        assert f"position error of pymunk with the settings of the scene{label}: " in capfd.readouterr().out


def test_nothing_within_the_tolerance_is_status_1(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path)
    before = Path(scene).read_bytes()
    status, out, err = lines_of(capfd, "tradeoff", scene, *QUICK, "--tolerance", "1e-9", "--write")
    assert (status, err) == (1, [])
    assert any(re.search("none of the . settings tried; the nearest is pymunk with ", line) for line in out)
    assert out[-1].startswith("not written")
    assert Path(scene).read_bytes() == before


def test_patience_is_an_alias_of_time_limit(tmp_path, capfd, monkeypatch):
    limits = []
    original = module.tradeoff

    def record_limit(*args: Any, **kwargs: Any) -> Tradeoff:
        limits.append(kwargs["time_limit"])
        return original(*args, **kwargs)

    monkeypatch.setattr(module, "tradeoff", record_limit)
    for flag in ((), ("--patience", "50"), ("--time-limit", "50")):
        lines_of(capfd, "tradeoff", write_scene(tmp_path), *QUICK, *flag, "--tolerance", "1")
    assert limits == [None, 50.0, 50.0]


def test_written_file_keeps_comments_and_is_within_the_tolerance(tmp_path, capfd):
    scene = write_scene(tmp_path, COMMENTED)
    out = output_of(capfd, "tradeoff", scene, *QUICK, "--tolerance", "0.01", "--starts", "1", "--write")
    assert out[2] == "starts: that of the scene"
    assert out[-1] == f"written: {scene}"
    text = Path(scene).read_text(encoding="utf-8")
    assert "[solver]  # mine" in text
    assert "# below it all" in text
    assert text != COMMENTED
    found = sandbox.compare(sandbox.load(scene), ["pymunk"])
    error = found.rows[0].score.max_position
    assert error <= 0.01


def test_write_prints_the_engine_to_run_with(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path)
    _, out, _ = lines_of(capfd, "tradeoff", scene, "--engine", "exact", "--points", "1", "--repeats", "1", "--write")
    assert out[-2:] == [f"{scene}: already has the recommended [solver]", "run it with --engine exact"]


def test_all_faults_are_reported_together_one_per_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path, FAULTY)
    wrong = ("--engine", "pymunk,unity", "--metric", "beauty", "--tolerance", "0")
    status, document, err = json_of(capfd, "tradeoff", scene, *wrong)
    assert (status, document["points"], document["within_tolerance"], len(err)) == (2, [], None, 5)
    assert [row["file"] for row in document["faults"]] == ["--engine", "--metric", "--tolerance", scene, scene]
    assert err[0].startswith("--engine: unknown engine 'unity'")
    assert err[1].startswith("--metric: unknown metric 'beauty'; metrics: max_position, ")
    assert err[3].startswith(f"{scene}:3: ball.a.position")


def test_write_into_the_installed_package_is_refused_before_the_search(tmp_path, capfd, monkeypatch):
    (tmp_path / "shipped").mkdir()
    monkeypatch.setattr(rewrite, "PACKAGE", tmp_path)
    monkeypatch.setattr(module, "tradeoff", lambda *_, **__: pytest.fail("it was run"))
    scene = write_scene(tmp_path / "shipped")
    status, _, (line,) = lines_of(capfd, "tradeoff", scene, "--write")
    assert status == 2
    assert "part of the installed package" in line
    assert Path(scene).read_text(encoding="utf-8") == DROP


def test_out_writes_json_and_report(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "new" / "folder"
    _, document, err = json_of(capfd, "tradeoff", write_scene(tmp_path), *QUICK, "--tolerance", "1", "--out", str(out))
    assert err == []
    assert document_of((out / "tradeoff.json").read_text(encoding="utf-8")) == document
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Error against cost" in page
    assert "<canvas" in page


def interrupt_after(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Interrupt the search after this number of evaluated settings."""
    done = 0

    def evaluate_or_interrupt(*arguments: Any) -> Evaluation:
        nonlocal done
        if done == count:
            raise KeyboardInterrupt
        done += 1
        return evaluate(*arguments)

    monkeypatch.setattr("sandbox.measure.tradeoff.search.evaluate", evaluate_or_interrupt)


def test_interrupted_search_keeps_the_evaluated_settings(tmp_path, capfd, monkeypatch):
    interrupt_after(3, monkeypatch)
    scene = write_scene(tmp_path)
    status, document, err = json_of(capfd, "tradeoff", scene, "--engine", "pymunk", "--tolerance", "1e-3", "--write")
    assert (status, err) == (130, ["interrupted: the 3 settings tried so far are kept"])
    assert document["interrupted"]
    assert [row["status"] for row in document["points"]] == ["ok"] * 3
    assert all(row["cost_ms_per_second"] > 0.0 and row["repeats"] == 0 for row in document["points"])
    assert Path(scene).read_text(encoding="utf-8") == DROP


def test_interrupted_timing_keeps_the_evaluated_settings(tmp_path, capfd, monkeypatch):
    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("sandbox.measure.tradeoff.study.time_in_turns", interrupted)
    status, document, err = json_of(capfd, "tradeoff", write_scene(tmp_path), *QUICK, "--tolerance", "0.01")
    assert (status, err) == (130, [f"interrupted: the {len(document['points'])} settings tried so far are kept"])
    assert document["interrupted"]
    assert document["within_tolerance"]["error"] <= 0.01


def test_interrupt_during_the_ground_truth_is_one_line(tmp_path, capfd, monkeypatch):
    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("sandbox.measure.tradeoff.start_trials.find_truth", interrupted)
    assert call(["tradeoff", write_scene(tmp_path)]) == 130
    out, err = capfd.readouterr()
    assert (out, err.splitlines()[-1]) == ("", "interrupted")


@pytest.mark.parametrize(("text", "spread"), [("2%", 0.02), ("0.02", 0.02), (" 0.5 % ", 0.005), ("0", 0.0)])
def test_spread_is_a_fraction_or_in_per_cent(text: str, spread: float, tmp_path: Path, capfd: Any) -> None:
    command = ("tradeoff", write_scene(tmp_path), "--engine", "pymunk", "--points", "1", "--repeats", "1")
    _, document, _ = json_of(capfd, *command, "--effort", "0.01", "--spread", text)
    assert document["spread"] == pytest.approx(spread)
    assert (document["starts"] == 1) == (spread == 0.0)


@pytest.mark.parametrize("text", ["20%", "0.2"])
def test_margin_is_stated_and_left_unused(text: str, tmp_path: Path, capfd: Any) -> None:
    command = ("tradeoff", write_scene(tmp_path), *QUICK, "--tolerance", "0.01", "--margin", text)
    out = output_of(capfd, *command)
    assert out[1] == "tolerance: recommended settings keep to 8 mm (10 mm less a margin of 20 %)"
    _, document, _ = json_of(capfd, *command)
    assert (document["tolerance"], document["margin"], document["max_error"]) == (0.01, 0.2, 0.008)
    assert document["within_tolerance"]["error"] <= 0.008


def test_margin_of_the_whole_tolerance_is_refused(tmp_path: Path, capfd: Any) -> None:
    assert call(["tradeoff", write_scene(tmp_path), "--margin", "100%"]) == 2
    assert "--margin" in capfd.readouterr().err


@pytest.mark.parametrize("text", ["60%", "-1%", "much", "%", "nan"])
def test_invalid_spread_is_refused(text: str, tmp_path: Path, capfd: Any) -> None:
    status, out, err = lines_of(capfd, "tradeoff", write_scene(tmp_path), "--spread", text)
    assert (status, out) == (2, [])
    assert "--spread" in err[-1]
