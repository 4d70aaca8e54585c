"""`sandbox advise`: output, JSON, page, exit status, wrong input."""

import re
from pathlib import Path
from typing import Any

import pytest

import sandbox
from sandbox.action import Impulse
from sandbox.cli.advise import LENGTH_UNITS, TIME_UNITS, Quantity
from sandbox.cli.main import call
from sandbox.measure.advice import scoring, study
from sandbox.recording import Recording
from tests.cli.calling import DROP, FAULTY, json_of, lines_of, write_scene
from tests.cli.test_json_schemas import assert_valid_document

pytestmark = pytest.mark.full  # command lines that run long

QUICK = ("--effort", "0.2", "--repeats", "1")
BULLET = """
title = "Bullet"
world = { duration = 0.2 }
solver = { dt = 0.016666666666666666 }
wall = [{ name = "pane", points = [[1.0, -1.0], [1.0, 1.0]], thickness = 0.01 }]
ball = [{ name = "bullet", position = [0.0, 0.0], velocity = [20.0, 0.0], radius = 0.05, restitution = 1.0 }]
"""


def test_output_has_the_five_parts_in_order(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, out, err = lines_of(capfd, "advise", write_scene(tmp_path, BULLET), *QUICK, "--budget", "4ms")
    assert (status, err) == (0, [])
    assert [line[0] for line in out if re.match(r"\d\. ", line)] == ["1", "2", "3", "4", "5"]
    assert "pymunk at 60 fps, tolerance 1 px (20 mm at 50 px per metre), budget 4 ms per frame" in out[0]
    present = out[out.index(next(line for line in out if line.startswith("1."))) :]
    assert "1 missed contact" in present[1]
    assert present[2].startswith("   observed: 'bullet' ")
    assert "substeps >= 7" in present[2]
    assert any(line.startswith("   substeps 1 → 2 ") for line in out)
    assert any(re.match(r"    (    )?space\.step\(dt", line) for line in out)


def test_json_has_the_measured_figures(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path, BULLET)
    status, document, err = json_of(capfd, "advise", scene, *QUICK, "--tolerance", "2cm", "--budget", "4000us")
    assert (status, err) == (0, [])
    assert_valid_document("advise", document)
    assert (document["scene"], document["title"], document["engine"]) == (scene, "Bullet", "pymunk")
    assert (document["tolerance"], document["tolerance_px"], document["budget"]) == (0.02, 1.0, 4.0)
    assert document["present"]["missed_contacts"] == 1
    assert document["present"]["ratio"] == 1.0
    assert document["recommended"]["error"] <= 0.02
    assert document["recommended"]["frame_ms"] > 0.0
    assert document["fits_budget"] is True
    assert document["risks"][0]["element"] == "bullet"


@pytest.mark.parametrize(
    ("text", "metres"), [("2px", 0.02), ("5mm", 0.005), ("2 cm", 0.02), ("0.5m", 0.5), (".25px", 0.0025)]
)
def test_tolerance_takes_units(
    text: str, metres: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    given: dict[str, Any] = {}
    monkeypatch.setattr("sandbox.cli.advise.advise", lambda *_, **options: given.update(options) or _stop())
    call(["advise", write_scene(tmp_path), "--tolerance", text, "--zoom", "100"])
    assert given["tolerance"] == pytest.approx(metres, rel=1e-12)
    capfd.readouterr()


def _stop() -> None:
    raise ValueError("enough")


@pytest.mark.parametrize(
    ("text", "ms"), [("4ms", 4.0), ("500us", 0.5), ("500µs", 0.5), ("0.004s", 4.0), ("1e-3 s", 1.0)]
)
def test_budget_takes_units(text: str, ms: float) -> None:
    number, unit = Quantity("time", tuple(TIME_UNITS), "4ms").convert(text, None, None)
    assert number * TIME_UNITS[unit] == pytest.approx(ms, rel=1e-12)
    assert LENGTH_UNITS["m"] == 1.0


@pytest.mark.parametrize(
    ("option", "text", "message"),
    [
        ("--tolerance", "1", "has no unit"),
        ("--tolerance", "1pt", "units px, m, cm, mm"),
        ("--tolerance", "px", "not a number with a unit"),
        ("--tolerance", "-1px", "positive"),
        ("--tolerance", "1e999px", "positive and finite"),
        ("--budget", "4", "has no unit"),
        ("--budget", "4 minutes", "not one of the units"),
        ("--budget", "0ms", "positive"),
        ("--fps", "0", "fps"),
        ("--fps", "nan", "fps"),
        ("--zoom", "-50", "zoom"),
        ("--effort", "0", "effort"),
    ],
)
def test_wrong_number_or_unit_is_one_line_and_status_2(
    option: str, text: str, message: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    status, out, err = lines_of(capfd, "advise", write_scene(tmp_path), option, text)
    assert (status, out, len(err)) == (2, [], 1)
    assert message in err[0]


def test_unknown_engine_and_faults_of_the_scene_are_reported_together(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    scene = write_scene(tmp_path, FAULTY)
    status, document, err = json_of(capfd, "advise", scene, "--engine", "pymonk")
    assert (status, len(document["faults"])) == (2, 3)
    assert err[0].startswith("--engine: unknown engine 'pymonk'")
    assert "pymunk" in err[0]


@pytest.mark.parametrize("name", ["none.toml", "none.json", "run.npz"])
def test_file_that_is_no_scene_and_no_recording_is_refused(
    name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    if name == "run.npz":
        (tmp_path / name).write_bytes(b"")
    status, out, err = lines_of(capfd, "advise", str(tmp_path / name))
    assert (status, out, len(err)) == (2, [], 1)


def test_refused_scene_has_status_1_and_the_reason(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path, DROP.replace("duration = 0.5", "duration = 0.5\nlinear_drag = 0.1"))
    status, out, _ = lines_of(capfd, "advise", scene, *QUICK, "--engine", "exact")
    assert status == 1
    assert any(line.startswith("   refused: ") for line in out)
    assert any(line.startswith("   pymunk ") for line in out)


def test_page_is_written_and_needs_no_network(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "page.html"
    scene = write_scene(tmp_path, BULLET.replace('"bullet"', '"<b>bullet"'))
    status, out, _ = lines_of(capfd, "advise", scene, *QUICK, "--out", str(page))
    assert (status, out[-1]) == (0, f"written: {page}")
    text = page.read_text(encoding="utf-8")
    assert "space.step(dt" in text
    assert "default-src 'none'" in text
    assert "<b>bullet" not in text
    assert "&lt;b&gt;bullet" in text


def test_page_that_cannot_be_written_is_reported_before_anything_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sandbox.cli.advise.advise", lambda *_, **__: pytest.fail("it ran"))
    status, _, err = lines_of(capfd, "advise", write_scene(tmp_path), "--out", str(tmp_path / "none" / "page.html"))
    assert status == 2
    assert err[0].startswith("--out: ")


def test_recording_states_that_its_actions_are_left_out(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = sandbox.loads(BULLET.replace("[20.0, 0.0]", "[0.1, 0.0]"))
    push = Impulse(time=0.05, body="bullet", impulse=(19.9, 0.0))
    path = Recording(scene, "pymunk", scene.solver, (push,), duration=0.2).save(tmp_path / "session.json")
    status, out, err = lines_of(capfd, "advise", str(path), *QUICK)
    assert (status, err) == (0, [])
    assert any("without" in line and "1 action" in line for line in out)
    assert "With the actions, the present setting has: 1 missed contact." in out
    status, _, err = lines_of(capfd, "advise", str(path), "--set", "solver.dt=0.01")
    assert (status, len(err)) == (2, 1)
    assert err[0].startswith("--set: ")


def test_interrupt_keeps_what_is_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(study, "time_in_turns", interrupt)
    page = tmp_path / "page.html"
    status, document, err = json_of(capfd, "advise", write_scene(tmp_path, BULLET), *QUICK, "--out", str(page))
    assert (status, document["interrupted"]) == (130, True)
    assert document["present"]["error"] is not None
    assert (document["present"]["frame_ms"], document["recommended"]["ratio"]) == (None, None)
    assert err == ["interrupted: what was measured so far is kept"]
    assert page.exists()
    monkeypatch.setattr(scoring, "find_truth", interrupt)
    status, out, err = lines_of(capfd, "advise", write_scene(tmp_path, BULLET), *QUICK)
    assert (status, out, err[-1]) == (130, [], "interrupted")


def test_quiet_prints_nothing(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert lines_of(capfd, "advise", write_scene(tmp_path, BULLET), *QUICK, "--quiet") == (0, [], [])


def test_time_limit_ends_the_search(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, document, _ = json_of(capfd, "advise", write_scene(tmp_path, BULLET), *QUICK, "--time-limit", "1e-9")
    assert status == 1
    assert document["out_of_time"]
    assert document["present"]["error"] is not None
    assert document["recommended"] is None
