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
from tests.cli.calling import DROP, FAULTY, json_of, lines_of, output_of, write_scene

pytestmark = pytest.mark.fail_slow(60)  # command lines that run long

QUICK = ("--effort", "0.2", "--repeats", "1")
BULLET = """
title = "Bullet"
world = { duration = 0.2 }
solver = { dt = 0.016666666666666666 }
wall = [{ name = "pane", points = [[1.0, -1.0], [1.0, 1.0]], thickness = 0.01 }]
ball = [{ name = "bullet", position = [0.0, 0.0], velocity = [20.0, 0.0], radius = 0.05, restitution = 1.0 }]
"""


def test_output_has_the_five_parts_in_order(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = output_of(capfd, "advise", write_scene(tmp_path, BULLET), *QUICK, "--budget", "4ms")
    assert [line[0] for line in out if re.match(r"\d\. ", line)] == ["1", "2", "3", "4", "5"]
    assert "pymunk at 60 fps, tolerance 1 px (20 mm at 50 px per metre), budget 4 ms per frame" in out[0]
    present = out[out.index(next(line for line in out if line.startswith("1."))) :]
    assert "1 missed contact" in present[1]
    assert re.match(r"   observed in 8\d %: 'bullet' ", present[2])  # 1 − 0.055/(20/60)
    assert "substeps >= 7" in present[2]
    assert any(line.startswith("   substeps 1 → 2 ") for line in out)
    assert any(re.match(r"    (    )?space\.step\(dt", line) for line in out)


@pytest.mark.parametrize(
    ("text", "metres"), [("2px", 0.02), ("5mm", 0.005), ("2 cm", 0.02), ("0.5m", 0.5), (".25px", 0.0025)]
)
def test_tolerance_takes_units(text, metres, tmp_path, monkeypatch, capfd):
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


def test_unknown_engine_and_faults_of_the_scene_are_reported_together(tmp_path, capfd):
    scene = write_scene(tmp_path, FAULTY)
    status, document, err = json_of(capfd, "advise", scene, "--engine", "pymonk")
    assert (status, len(document["faults"])) == (2, 3)
    assert err[0].startswith("--engine: unknown engine 'pymonk'")
    assert "pymunk" in err[0]


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


def test_recording_states_that_its_actions_are_left_out(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene = sandbox.loads(BULLET.replace("[20.0, 0.0]", "[0.5, 0.0]"))
    push = Impulse(time=0.05, body="bullet", impulse=(19.5, 0.0))
    path = Recording(scene, "pymunk", scene.solver, (push,), duration=0.2).save(tmp_path / "session.json")
    out = output_of(capfd, "advise", str(path), *QUICK)
    assert any("without" in line and "1 action" in line for line in out)
    (present,) = (
        line for line in out if line.startswith("With the actions, the present setting has: 1 missed contact;")
    )
    assert re.search(
        r" px; missed contacts in all of 30 perturbed starts with the actions up to a frame later\.", present
    )
    status, _, err = lines_of(capfd, "advise", str(path), "--set", "solver.dt=0.01")
    assert (status, len(err)) == (2, 1)
    assert err[0].startswith("--set: ")


def test_interrupt_keeps_what_is_finished(tmp_path, monkeypatch, capfd):
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


def test_time_limit_ends_the_search(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, document, _ = json_of(capfd, "advise", write_scene(tmp_path, BULLET), *QUICK, "--time-limit", "1e-9")
    assert status == 1
    assert document["out_of_time"]
    assert document["present"]["error"] is not None
    assert document["recommended"] is None


@pytest.mark.parametrize(
    ("arguments", "option"),
    [
        (["--scene", "game.py"], "--scene"),
        (["--engine", "exact", "game.py"], "--engine"),
        (["--pixels", "--zoom", "2", "game.py"], "--pixels"),
        (["--out", "missing/page.html", "game.py"], "--out"),
        (["--inputs", "game.json", "bounce"], "--inputs"),
    ],
)
def test_options_that_do_not_fit_a_game_or_a_scene_are_faults(
    arguments: list[str],
    option: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("game.py").write_text("")
    assert call(["advise", *arguments]) == 2
    assert capsys.readouterr().err.startswith(f"{option}: ")
