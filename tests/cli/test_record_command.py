"""Command `record`: a game is run, and its session kept."""

from pathlib import Path

import pytest

from sandbox.game_inputs import load_inputs
from sandbox.recording import Recording
from sandbox.scene.errors import SceneError
from tests.cli.calling import call, json_of, process

GAME = """
import sys
import helper  # beside the game
import pymunk

space = pymunk.Space()
space.gravity = (0, -900)
body = pymunk.Body(1, 10)
body.position = (0, 100)
space.add(body, pymunk.Circle(body, 5))
print("playing", *sys.argv[1:])
for k in range(20):
    if k == 5:
        body.velocity = (helper.SPEED, 0)
    space.step(1 / 60)
"""


@pytest.fixture
def game(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "game"
    folder.mkdir()
    (folder / "helper.py").write_text("SPEED = 50\n")
    path = folder / "jump.py"
    path.write_text(GAME)
    return path


def test_session_is_recorded_and_replayed(game: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert call(["record", str(game), "level", "--hard"]) == 0
    output = capfd.readouterr().out
    assert "playing level --hard" in output
    assert "written: jump.json (1 body, 20 steps of 16.67 ms, 1 action)" in output
    recording = Recording.load(tmp_path / "jump.json")
    assert recording.actions[0].time == pytest.approx(5 / 60)
    assert recording.scene.title == "jump"
    assert call(["run", "jump.json"]) == 0


def test_json_document_is_alone_on_standard_output(game: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, document, _ = json_of(capfd, "record", "--steps", "7", "--to", "a.json", str(game))
    assert (status, document["steps"], document["actions"]) == (0, 7, 1)
    assert document["recording"] == "a.json"


def test_error_of_the_game_keeps_what_was_played(game: Path, capfd: pytest.CaptureFixture[str]) -> None:
    game.write_text(GAME + "raise RuntimeError('of the game')\n")
    assert call(["record", str(game)]) == 1
    assert "of the game" in capfd.readouterr().err
    assert Recording.load(Path("jump.json")).duration == pytest.approx(20 / 60)


def test_game_without_a_step_writes_nothing(game: Path, capfd: pytest.CaptureFixture[str]) -> None:
    game.write_text("print(1)\n")
    assert call(["record", str(game)]) == 2
    assert "no pymunk space made a step" in capfd.readouterr().err
    assert not Path("jump.json").exists()


def test_game_without_a_scene_keeps_its_inputs(game: Path, capfd: pytest.CaptureFixture[str]) -> None:
    game.write_text(GAME.replace("pymunk.Body(1, 10)", "pymunk.Body(1e40, 10)"))
    assert call(["record", str(game)]) == 2
    assert "mass" in capfd.readouterr().err
    assert load_inputs("jump.json").steps == 20
    with pytest.raises(SceneError, match="inputs of a game only"):
        Recording.load("jump.json")


PLAY = GAME.replace("if k == 5:", "if k == 12:\n        CHANGE\n    if k == 5:")
CHANGES = {
    "static": "body.body_type = pymunk.Body.STATIC",
    "static with a pivot": "body.body_type = pymunk.Body.STATIC",
    "kinematic": "body.body_type = pymunk.Body.KINEMATIC",
    "not a number": "body.velocity = (float('nan'), 0)",
    "infinite": "body.position = (float('inf'), 0)",
    "too fast": "body.velocity = (1e30, 0)",
    "rotation": "body.angular_velocity = 1e30",
    "huge gravity": "space.gravity = (1e300, 0)",
    "joint": "space.add(pymunk.PivotJoint(space.static_body, body, (0, 90)))",
    "damping": "space.damping = 2",
    "body of no shape": "space.add(pymunk.Body(1, 1))",
    "tiny disc": "new = pymunk.Body(1, 1); space.add(new, pymunk.Circle(new, 1e-30))",
    "heavy body": "new = pymunk.Body(1e60, 1); space.add(new, pymunk.Circle(new, 1))",
    "fast body": "new = pymunk.Body(1, 1); new.velocity = 1e30, 0; space.add(new, pymunk.Circle(new, 1))",
    "body far away": "new = pymunk.Body(1, 1); new.position = 1e30, 0; space.add(new, pymunk.Circle(new, 1))",
}


@pytest.mark.fail_slow(60)  # each is run and replayed
@pytest.mark.parametrize("name", CHANGES)
def test_no_change_ends_the_game_and_each_is_remarked(name: str, game: Path, capfd: pytest.CaptureFixture[str]) -> None:
    text = PLAY.replace("CHANGE", CHANGES[name])
    if name == "static with a pivot":  # pymunk then computes velocities that are not finite
        other = "other = pymunk.Body(1, 10)\nother.position = (30, 100)\n"
        joint = "space.add(other, pymunk.PivotJoint(body, other, (0, 100)))\n"
        text = text.replace('print("playing"', other + joint + 'print("playing"')
    game.write_text(text + 'print("the end")\n')
    status, document, lines = json_of(capfd, "record", str(game))
    assert (status, document["steps"], document["ended"]) == (0, 20, None)
    assert "the end" in lines
    assert not any("Traceback" in line for line in lines)
    recording = Recording.load(Path("jump.json"))
    assert recording.game is not None and recording.game.replay is not None
    is_equal = name in ("body of no shape", "static", "kinematic", "joint")
    assert document["replay"]["is_equal"] == recording.game.replay.is_equal == is_equal
    assert bool(document["remarks"]) == (name != "body of no shape")
    for each in document["remarks"]:
        assert f"{game}: {each}" in lines


def test_replay_that_departs_is_said_with_step_distance_and_body(game, capfd):
    game.write_text(PLAY.replace("CHANGE", CHANGES["damping"]))
    assert call(["record", str(game)]) == 0
    out, err = capfd.readouterr()
    assert "written: jump.json" in out
    assert "bit for bit" not in out
    assert "the replay departs from the game at step 13 (body-1), " in err
    assert " px at the end: body-1" in err
    game.write_text(GAME)
    assert call(["record", "--force", str(game)]) == 0
    assert "the replay equals the game after each step, bit for bit" in capfd.readouterr().out


def test_wrong_arguments(game: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert call(["record", "none.py"]) == 2
    assert "does not exist" in capfd.readouterr().err
    assert call(["record", str(game.parent)]) == 2
    assert "is no Python program" in capfd.readouterr().err
    Path("jump.json").write_text("kept")
    assert call(["record", str(game)]) == 2
    assert "--force" in capfd.readouterr().err
    assert Path("jump.json").read_text() == "kept"
    assert call(["record", "--force", str(game)]) == 0


@pytest.mark.fail_slow(60)  # a child process
def test_interrupt_keeps_what_was_played(game: Path) -> None:
    handler = "import os, signal\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"  # a shell may ignore it
    game.write_text(GAME + handler + "os.kill(os.getpid(), signal.SIGINT)\nspace.step(1)\n")
    done = process("record", str(game))
    assert done.returncode == 130
    assert Recording.load(Path("jump.json")).duration == pytest.approx(20 / 60)
