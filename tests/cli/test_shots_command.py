"""`sandbox shots`: output, JSON, files, exit status."""

import json
import re
from pathlib import Path
from typing import Any

import pytest

from sandbox.cli.main import call
from sandbox.engines.contract import Exhaustion
from sandbox.measure.run.runner import run
from sandbox.measure.shots.shot import ShotSetup, Spread, shot_setup
from sandbox.measure.shots.study import study_shot
from sandbox.scene.files.load import load, loads
from sandbox.trajectory import Trajectory
from tests.cli.calling import document_from, document_of, json_of, lines_of, output_of, write_scene

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

POT = """
title = "Pot"
world = { seed = 5 }
surface = { sliding_friction = 0.2, rolling_friction = 0.01, spinning_friction = 0.0127 }
ball = [
  { name = "cue", position = [0.0, 0.0], radius = 0.028575, restitution = 1.0 },
  { name = "8:ball", position = [0.5, 0.0], radius = 0.028575, restitution = 1.0 },
  { name = "bystander", position = [0.5, 2.0], radius = 0.028575, restitution = 1.0 },
]
pocket = [{ name = "far [left]", position = [1.5, 0.0], radius = 0.06 }]
shot = [
  { name = "stun", aim = 0.0, speed = 3.0 },
  { name = "soft", aim = 3.14159, speed = 1.0, ball = "bystander" },
]
"""

FEW_SHOTS = ("--count", "400", "--threads", "2")


@pytest.fixture(scope="module", autouse=True)
def compiled() -> None:
    """Compile the kernels before the tests: the first compilation is announced on standard error."""
    scene = loads(POT)
    study_shot(shot_setup(scene), Spread(), count=1, foretold=True)
    run(scene, "exact")


@pytest.fixture
def scene(tmp_path: Path) -> str:
    return write_scene(tmp_path, POT, "pot.toml")


def test_json_has_shot_outcome_and_odds(scene: str, capfd: pytest.CaptureFixture[str]) -> None:
    status, document, err = json_of(capfd, "shots", scene, *FEW_SHOTS, "--aim-error", "0.003", "--speed-error", "0")
    assert (status, err) == (0, [])
    assert (document["scene"], document["title"], document["status"], document["reason"]) == (scene, "Pot", "ok", None)
    assert document["shot"]["name"] == "stun"
    assert {key: document["shot"][key] for key in ("ball", "aim", "speed")} == {"ball": "cue", "aim": 0.0, "speed": 3.0}
    assert document["nominal"]["final"]["8:ball"] == {"position": [1.5, 0.0], "pocket": "far [left]"}
    odds = document["odds"]
    assert (odds["count"], odds["seed"], odds["miscues"], odds["unfinished"]) == (400, 5, 0, 0)
    assert odds["spread"] == {"aim": 0.003, "speed": 0.0, "side": 0.0, "height": 0.0}
    chance = odds["balls"]["8:ball"]["pockets"]["far [left]"]
    assert chance["low"] < chance["probability"] < chance["high"]
    assert odds["any_pot"]["hits"] == chance["hits"]
    assert odds["balls"]["cue"]["rest"]["count"] == 400 - odds["scratch"]["hits"]
    assert (document["sensitivity"], document["windows"], document["horizon"]) == (None, [], None)


def test_json_has_sensitivity_windows_and_horizon_on_request(scene: str, capfd: pytest.CaptureFixture[str]) -> None:
    options = ("--sensitivity", "--horizon", "--window", "8:ball:far [left]")
    document = document_from(capfd, "shots", scene, *FEW_SHOTS, *options)
    assert {row["ball"] for row in document["sensitivity"]} == {"cue", "8:ball", "bystander"}
    assert {row["unit"] for row in document["sensitivity"]} == {"m/rad", "m/m/s", "m/R"}
    (window,) = document["windows"]
    assert window["within"] is True
    assert window["windows"][0]["low"] < 0.0 < window["windows"][0]["high"]
    assert document["horizon"]["nudge"] == 1e-9
    assert [each["nudge"] for each in document["horizon"]["ladder"]] == [10.0**-k for k in range(2, 13)]


def test_table_has_one_line_per_ball_followed_by_sentences(scene: str, capfd: pytest.CaptureFixture[str]) -> None:
    options = ("--sensitivity", "--horizon", "--nudge", "1e-4", "--window", "8:ball:far [left]")
    out = output_of(capfd, "shots", scene, *FEW_SHOTS, *options, "--side-error", "0.01")
    assert out[0] == f"{scene}: Pot"
    assert out[1] == "stun: 'cue' struck at 3 m/s at an aim of 0 rad"
    spread = "aim ± 2 mrad, speed ± 3 %, tip ± (0.01, 0) R (standard deviations), seed 5"
    assert out[2] == f"400 shots, {spread}"
    assert out[3].split()[:4] == ["ball", "pocketed", "95", "%"]
    assert re.match(r"8:ball +\d+\.\d % +\d+\.\d–\d+\.\d % +far \[left\] \d+\.\d %", out[5])
    assert re.match(r"another ball is pocketed and 'cue' is not: \d+\.\d %", out[7])
    assert out[9].split()[:2] == ["ball", "d/d(aim),"]
    assert "pocketed" in out[11]
    text = "\n".join(out[13:])
    assert re.search(
        r"^'8:ball' into 'far \[left\]': for an aim in \[-0\.00\d+, 0\.00\d+\] rad, ± \d", text, re.MULTILINE
    )
    assert "the aim of the shot is within" in text
    assert "perturbed by 0.0001 rad in aim: " in text
    assert "predictable to 1 mm, by the accuracy of the aim in rad: 1e-02: " in text


def test_verbose_explains_every_column(scene: str, capfd: pytest.CaptureFixture[str]) -> None:
    status, out, _ = lines_of(capfd, "shots", scene, "--count", "20", "--sensitivity", "--verbose")
    assert status == 0
    explained = {line[2:].partition("  ")[0] for line in out if line.startswith("  ")}
    (head,) = (line for line in out if "95 % interval" in line and not line.startswith("  "))
    assert {each for each in re.split(r" {2,}", head.strip()) if each != "ball"} <= explained
    assert "same contacts within" in explained


def test_shot_is_selected_by_name_and_changed(scene: str, capfd: pytest.CaptureFixture[str]) -> None:
    status, document, _ = json_of(capfd, "shots", scene, *FEW_SHOTS, "--shot", "soft", "--set", "shot.soft.aim=1.0")
    assert (status, document["shot"]["ball"], document["shot"]["aim"]) == (0, "bystander", 1.0)


def test_document_and_pictures_are_written(scene: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "new" / "folder"
    document = document_from(capfd, "shots", scene, *FEW_SHOTS, "--out", str(out))
    assert json.loads((out / "shots.json").read_text(encoding="utf-8")) == document
    assert sorted(path.name for path in out.iterdir()) == ["aims.png", "rests.png", "shots.json"]
    assert all(path.read_bytes()[:4] == b"\x89PNG" for path in out.glob("*.png"))


def test_missing_window_is_status_1(scene: str, capfd: pytest.CaptureFixture[str]) -> None:
    status, out, err = lines_of(capfd, "shots", scene, *FEW_SHOTS, "--window", "bystander:far [left]")
    assert (status, err) == (1, [])
    assert out[-1] == "'bystander' into 'far [left]': for no aim within 0.1 rad of 0"


def test_scene_refused_by_the_exact_engine_is_status_1(scene: str, capfd: pytest.CaptureFixture[str]) -> None:
    status, document, err = json_of(capfd, "shots", scene, "--set", "world.linear_drag=0.1")
    assert (status, document["status"], document["odds"]) == (1, "refused", None)
    assert err == [f"{scene}: refused: {document['reason']}"]


def test_too_many_events_are_status_1(scene, capfd, monkeypatch):
    def exhaust(*_: Any, **__: Any) -> None:
        raise Exhaustion("at 1 s: too many")

    monkeypatch.setattr(ShotSetup, "simulate", exhaust)
    status, document, err = json_of(capfd, "shots", scene, *FEW_SHOTS)
    assert (status, document["status"], document["reason"]) == (1, "failed", "at 1 s: too many")
    assert err == [f"{scene}: failed: at 1 s: too many"]


def test_interrupt_keeps_the_shots_played_so_far(scene, capfd, monkeypatch):
    simulate_batch, calls = ShotSetup.simulate_batch, []

    def interrupted(*arguments: Any) -> Any:
        if calls:
            raise KeyboardInterrupt
        calls.append(arguments)
        return simulate_batch(*arguments)

    monkeypatch.setattr(ShotSetup, "simulate_batch", interrupted)
    status = call(["shots", scene, "--count", "3000", "--threads", "2", "--horizon", "--json"])
    out, err = capfd.readouterr()
    document = document_of(out)
    assert status == 130
    assert err == "interrupted: 1,024 of 3,000 shots were played and are counted\n"
    assert (document["odds"]["count"], document["odds"]["interrupted"], document["horizon"]) == (1024, True, None)


def test_runs_swept_over_the_aim_agree_with_simulated_shots(scene, capfd, tmp_path):
    sweep = ("--engine", "exact", "--sweep", "shot.stun.aim=-0.02:0.02:5", "--set", "world.duration=30")
    document = document_from(capfd, "run", scene, *sweep, "--out", str(tmp_path / "fan"))
    setup = shot_setup(load(scene))
    for row in document["runs"]:
        outcome = setup.simulate(setup.changed("aim", row["set"]["shot.stun.aim"]))
        assert row["pocketed"] == outcome.pocketed
        positions = [body["position"] for body in row["final"].values()]
        assert positions == pytest.approx(outcome.position, abs=1e-12)  # m; recording frames does not change the result
        stored = Trajectory.load(row["path"])
        assert stored.spin.shape == (*stored.position.shape[:2], 3)
        assert stored.spin[-1].tolist() == [body["spin"] for body in row["final"].values()]
    assert [bool(row["pocketed"]) for row in document["runs"]] == [False, False, True, False, False]
