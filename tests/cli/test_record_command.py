"""Command `record`: a game is run, and its session kept."""

from pathlib import Path

import pytest

from sandbox.recording import Recording
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


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("print(1)\n", "no pymunk space made a step"),
        (GAME.replace("pymunk.Body(1, 10)", "pymunk.Body(1e40, 10)"), "mass"),
    ],
)
def test_game_without_a_scene_writes_nothing(game, text, message, capfd):
    game.write_text(text)
    assert call(["record", str(game)]) == 2
    assert message in capfd.readouterr().err
    assert not Path("jump.json").exists()


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
