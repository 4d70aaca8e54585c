"""Advice for games with a planted defect: it finds the defect, and the lines that it prints remove it."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandbox.game_inputs import GameInputs, load_inputs
from sandbox.measure.game_advice.difference import GameTruth, apart_spans, difference_from
from sandbox.measure.game_advice.result import GameAdvice
from sandbox.measure.game_advice.step_code import StepCode
from sandbox.measure.game_advice.study import GameFailedError, GameStudy, NotRepeatableError
from sandbox.rehearsal.rehearse import Rehearsal, rehearse
from sandbox.rehearsal.step_settings import RehearsalSettings
from tests.cli.calling import process

pytestmark = pytest.mark.fail_slow(300)  # each advice runs a game some 60 times, in processes of its own

GAMES = Path(__file__).parent / "games"
TOLERANCE = 1.0  # px

Recorder = Callable[[str], GameInputs]


@pytest.fixture
def record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Recorder:
    """Return a function that copies a game to the working folder, and records it with its script of inputs."""
    monkeypatch.chdir(tmp_path)

    def recorded(name: str) -> GameInputs:
        for suffix in (".py", ".toml"):
            shutil.copy(GAMES / f"{name}{suffix}", f"{name}{suffix}")
        found = process("record", "--script", f"{name}.toml", f"{name}.py")
        assert found.returncode == 0, found.stderr
        return load_inputs(f"{name}.json")

    return recorded


def mended(code: StepCode) -> Path:
    """Write a game with the lines that an advice prints in place of that of the step."""
    source = Path(code.file)
    lines = source.read_text().splitlines()
    assert lines[code.line - 1] == code.old
    lines[code.line - 1 : code.line] = code.new
    path = Path(f"mended_{source.name}")
    path.write_text("\n".join(lines) + "\n")
    return path


def advice_for(name: str, inputs: GameInputs) -> tuple[GameAdvice, GameTruth]:
    """Return the advice for a game, and its truth."""
    study = GameStudy(f"{name}.py", inputs, tolerance_px=TOLERANCE, plays=3)
    advice = study.advise()
    assert study.truth is not None
    return advice, study.truth


def lost_contacts(advice: GameAdvice, phase: str) -> dict[str, tuple[int, int]]:
    """Return missed and expected contacts of the present setting, by the function of the callback."""
    return {
        each.callback.split()[-1]: (each.missed, each.expected)
        for each in advice.present.callbacks
        if f" {phase} " in each.callback
    }


@pytest.mark.parametrize(
    ("name", "least_error"),
    [
        ("platformer", 3.0),  # bullets fly through targets; the player's jumps are off by some px
        ("slingshot", 8.0),  # the castle sinks and leans before the shot
        ("top_down_car", 10.0),  # the chain of the trailer comes apart
    ],
)
def test_printed_lines_remove_the_defect(name: str, least_error: float, record: Recorder) -> None:
    inputs = record(name)
    advice, truth = advice_for(name, inputs)
    assert advice.present.error_px is not None
    assert advice.present.error_px > least_error
    assert not advice.present.is_within
    chosen = advice.chosen
    assert chosen is not None and chosen.error_px is not None
    assert chosen.is_within
    assert advice.plays.present.hits == 0

    assert advice.code is not None
    game = mended(advice.code)
    before, after = (rehearse(each, inputs) for each in (f"{name}.py", game))
    assert after.failure is None
    # The edited game is the game with the setting that was measured, bit for bit.
    measured = rehearse(f"{name}.py", inputs, RehearsalSettings(**settings_of(advice)))
    assert after.hashes == measured.hashes
    assert after.hashes != before.hashes
    difference = difference_from(truth, after, TOLERANCE)
    assert difference.error <= TOLERANCE
    assert not difference.differing


def settings_of(advice: GameAdvice) -> dict[str, Any]:
    """Return the chosen setting as arguments of `RehearsalSettings`."""
    assert advice.chosen is not None
    whole = ("substeps", "iterations", "persistence")
    return {name: int(value) if name in whole else value for name, value in advice.chosen.changed.items()}


def test_bullets_that_tunnel_are_missed_callbacks(record: Recorder) -> None:
    advice, _ = advice_for("platformer", record("platformer"))
    # 8 of 15 shots pass a target at 60 steps a second, as a count of the hits in the game itself says
    assert lost_contacts(advice, "begin")["Game.hit_target"] == (8, 15)
    assert lost_contacts(advice, "begin")["Game.collect_coin"] == (0, 6)
    assert advice.chosen is not None
    assert advice.chosen.differing == 0


def test_game_that_cannot_be_repeated_gets_no_advice_but_its_cause(record: Recorder) -> None:
    inputs = record("platformer")
    step = "        space.step(1 / 60)"
    text = Path("platformer.py").read_text().replace("import pygame", "import os\n\nimport pygame", 1)
    random_gravity = "        space.gravity = (0, 900 + os.urandom(1)[0])\n"
    Path("platformer.py").write_text(text.replace(step, random_gravity + step))
    with pytest.raises(NotRepeatableError, match=r"platformer.py:\d+: os.urandom\(\) reads random bytes"):
        GameStudy("platformer.py", inputs).advise()
    found = process("advise", "platformer.py")
    assert found.returncode == 1
    assert "likely cause" in found.stderr
    found = process("rehearse", "platformer.py")
    assert found.returncode == 1
    assert "os.urandom" in found.stdout


def test_game_that_fails_says_so(record: Recorder) -> None:
    inputs = record("platformer")
    text = Path("platformer.py").read_text()
    Path("platformer.py").write_text(text.replace("        space.step(1 / 60)", "        raise RuntimeError('broken')"))
    with pytest.raises(GameFailedError, match="RuntimeError: broken"):
        GameStudy("platformer.py", inputs).advise()


def test_commands_print_the_advice_and_the_difference_from_the_own_setting(record: Recorder) -> None:
    record("platformer")
    found = process("advise", "platformer.py", "--starts", "1", "--time-limit", "20", "--json")
    document = json.loads(found.stdout)
    assert found.returncode == 0
    assert document["recommended"]["substeps"] >= 4
    assert document["code"]["new"][-1].strip().startswith("space.step((1 / 60) /")
    found = process("advise", "platformer.json", "--starts", "1", "--time-limit", "20")  # the program beside it
    assert found.returncode == 0
    assert "of 15 contacts 8 missed" in found.stdout
    found = process("rehearse", "platformer.py", "--substeps", "4", "--json")
    document = json.loads(found.stdout)
    assert document["is_repeatable"]
    hits = next(each for each in document["from_own"]["callbacks"] if "hit_target" in each["callback"])
    assert (hits["expected"], hits["extra"]) == (7, 8)
    found = process("rehearse", "platformer.py")
    assert "equal the recorded game after each frame" in found.stdout


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("rehearse", "nothing.py"), "does not exist"),
        (("rehearse", "game.py"), "sandbox record game.py"),
        (("rehearse", "game.py", "--inputs", "drop.json"), "no inputs"),
        (("rehearse", "game.py", "--inputs", "own.json", "--set", "slip=1"), "no setting"),
        (("rehearse", "game.py", "--inputs", "own.json", "--substeps", "9999"), "4096"),
        (("rehearse", "game.py", "--inputs", "own.json", "--states", "out.csv"), ".npz"),
        (("advise", "game.py"), "sandbox record game.py"),
        (("advise", "game.py", "--inputs", "own.json", "--engine", "box2d"), "no effect"),
    ],
)
def test_wrong_input_is_named(
    arguments: tuple[str, ...], word: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("game.py").write_text("import pymunk\nspace = pymunk.Space()\nspace.step(1)\n")
    Path("drop.json").write_text("{}")
    assert process("record", "--to", "own.json", "game.py").returncode == 0
    found = process(*arguments)
    assert found.returncode == 2
    assert word in found.stderr
    assert "Traceback" not in found.stderr


TWO_PLACES = """
import pymunk
spaces = [pymunk.Space() for _ in range(2)]
for space in spaces:
    space.gravity = (0, 900)
    body = pymunk.Body(1, 10)
    space.add(body, pymunk.Circle(body, 5))
for k in range(30):
    spaces[0].step(1 / 60)
    spaces[1].step(1 / 120)
"""


def test_all_places_of_steps_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("game.py").write_text(TWO_PLACES)
    assert process("record", "game.py").returncode == 0
    advice = GameStudy("game.py", load_inputs("game.json"), tolerance_px=TOLERANCE, plays=0, time_limit=20.0).advise()
    assert advice.code is not None
    assert advice.code.line == 9
    assert any("game.py:10" in each for each in advice.remarks)
    assert not any("measured time" in each for each in advice.remarks)  # both steps are constant


IMPACT = """
import pymunk
space = pymunk.Space()
space.gravity = (0, -900)
floor = pymunk.Segment(space.static_body, (-400, 0), (400, 0), 0.5)
body = pymunk.Body(1, 10)
ball = pymunk.Circle(body, 4)
body.position, body.velocity = (0, 141), (0, -2000)
space.add(body, ball, floor)
for k in range(40):
    space.step(1 / 60)
"""


def test_body_that_falls_through_a_floor_is_off_though_the_moment_of_impact_is_unknown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Finer steps stop the ball elsewhere within a step, and then it lies on the floor."""
    monkeypatch.chdir(tmp_path)
    Path("impact.py").write_text(IMPACT)
    assert process("record", "impact.py").returncode == 0
    inputs = load_inputs("impact.json")
    advice = GameStudy("impact.py", inputs, tolerance_px=TOLERANCE, zoom=1.0, plays=0).advise()
    assert 0.5 < advice.known_fraction <= 1.0
    assert advice.unknown_from == {}
    assert advice.present.error_px is not None
    assert advice.present.error_px > 500.0  # it falls on for half a second, at 2,000 px/s and more
    assert not advice.present.is_within
    assert advice.chosen is not None and advice.chosen.substeps > 1


def run_of(places: list[float]) -> Rehearsal:
    """Return a run of one body, by its x in each frame."""
    states = np.zeros((len(places), 6))
    states[:, 0] = places
    frames = len(places)
    return Rehearsal(
        settings=RehearsalSettings(),
        offsets=np.arange(frames + 1),
        bodies=np.zeros(frames, np.int64),
        states=states,
        callbacks=(),
        calls=(),
        shape_bodies={},
        shapes={},
        changes=(),
        shape_changes=(),
        body_names={},
        own_settings={},
        gravity=(0.0, 0.0),
        window=None,
        dts=(0.1, 0.1, 0.1),
        step_calls=(),
        has_forces=False,
        impulse_readers=(),
        hashes=(),
        steps=frames,
        ended="program",
        failure=None,
        seconds=0.0,
        step_seconds=0.0,
        output="",
    )


def test_truth_is_unknown_while_finer_runs_are_apart() -> None:
    fine = run_of([0.0] * 40)
    assert apart_spans(fine, run_of([0.0] * 10 + [1.0] * 3 + [0.0] * 27), 0.5) == {0: [(10, 13)]}
    assert apart_spans(fine, run_of([0.0] * 10 + [1.0] * 30), 0.5) == {0: [(10, 40)]}
    # a chaotic body that passes its other place for less than 10 frames is not back
    assert apart_spans(fine, run_of([0.0] * 10 + [1.0] * 3 + [0.0] * 9 + [1.0] * 18), 0.5) == {0: [(10, 40)]}
    truth = GameTruth(fine, {0: [(10, 13), (30, 40)]}, frozenset())
    assert truth.known_fraction == 27 / 40
    assert truth.lost_from(0) == 30
    assert [truth.knows_contacts(0, frame) for frame in (9, 10, 12, 34, 35)] == [True, True, True, True, False]
