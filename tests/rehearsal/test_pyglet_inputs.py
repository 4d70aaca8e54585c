"""Rehearsals of programs that use pyglet, or Arcade on top of it: equal to the recorded play, bit for bit."""

import importlib.util
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from time import monotonic, sleep

import numpy as np
import pymunk
import pytest

from sandbox.game_inputs import PYGLET_EVENT, GameInputs, InputEvent, load_inputs
from sandbox.rehearsal.rehearse import Rehearsal, first_difference, rehearse
from sandbox.rehearsal.step_settings import RehearsalSettings
from tests.driven.driving import start_server

pytestmark = pytest.mark.fail_slow(60)  # each test records and rehearses in processes of its own

GAMES = Path(__file__).parent / "pyglet_games"
EXAMPLES = Path(pymunk.__file__).parent / "examples"
LIMIT = 100.0
"""s, time limit of a process and of a wait"""
PLAYER = 0
"""Number of the body that keys move"""
GAMES_OF_BALLS = [
    "balls.py",
    pytest.param(
        "arcade_balls.py",
        marks=pytest.mark.skipif(
            importlib.util.find_spec("arcade") is None,
            reason="Arcade pins pymunk 6: pip install --no-deps arcade pytiled-parser attrs",
        ),
    ),
]


def play(program: Path, script: str, folder: Path, *arguments: str) -> tuple[GameInputs, str]:
    """Record a scripted play of a program, and return its inputs and what it printed."""
    (folder / "play.toml").write_text(script, encoding="utf-8")
    command = [sys.executable, "-m", "sandbox", "record", "--script", "play.toml", "--to", "play.json", "--force"]
    done = subprocess.run(
        [*command, *arguments, str(program)], cwd=folder, capture_output=True, text=True, timeout=LIMIT, check=False
    )
    assert done.returncode == 0, done.stderr
    return load_inputs(folder / "play.json"), done.stdout


def scripted(*inputs: str, frames: int) -> str:
    return "\n".join([f"frames = {frames}", *(f"[[input]]\n{each}" for each in inputs)])


def path_of(rehearsal: Rehearsal, body: int) -> np.ndarray:
    """Return the positions of a body at the end of each frame."""
    frames = [rehearsal.frame(number) for number in range(rehearsal.frames)]
    return np.array([states[bodies == body][0, :2] for bodies, states in frames if body in bodies])


@pytest.mark.parametrize("program", GAMES_OF_BALLS)
def test_a_game_is_rehearsed_bit_for_bit_and_its_inputs_act(program: str, tmp_path: Path) -> None:
    inputs, _ = play(GAMES / program, (GAMES / "balls.toml").read_text("utf-8"), tmp_path)
    found = rehearse(GAMES / program, inputs)
    assert (found.failure, found.frames, found.steps) == (None, inputs.frames, inputs.steps)
    assert first_difference(inputs.frame_hashes, found.hashes) is None
    assert first_difference(found.hashes, rehearse(GAMES / program, inputs, draws=False).hashes) is None

    shot = path_of(found, 1)  # the first ball: others fall from 0.5 s on
    assert np.linalg.norm(shot[0] - (40, 100)) < 20  # px: within two frames at 300 px/s, from where the mouse is
    assert shot[-1, 0] > 150
    player = path_of(found, PLAYER)
    assert player[59, 0] == pytest.approx(100, abs=1)  # px, before its key is pressed
    assert player[-1, 0] > 120
    assert player[:60, 1].max() < 35 < 60 < player[60:, 1].max()  # it jumps

    finer = rehearse(GAMES / program, inputs, RehearsalSettings(substeps=4), draws=False)
    assert finer.frames == found.frames
    assert first_difference(finer.hashes, found.hashes) is not None
    assert path_of(finer, PLAYER)[-1, 0] > 120


@pytest.mark.parametrize(
    ("name", "inputs"),
    [
        ("box2d_vertical_stack", ['frame = 20\npress = "space"']),
        ("colors_pyglet_batch", []),
        (
            "spiderweb",
            [
                "frame = 0\nmouse = [480, 270]",  # the centre of the web
                'frame = 1\npress = "mouse 1"',
                "frame = 5\nmouse = [600, 300]",
            ],
        ),
        ("using_sprites_pyglet", []),
    ],
)
def test_examples_of_pymunk_are_rehearsed_bit_for_bit(name: str, inputs: list[str], tmp_path: Path) -> None:
    program = EXAMPLES / f"{name}.py"
    played, _ = play(program, scripted(*inputs, frames=40), tmp_path)
    assert played.steps >= 10
    found = rehearse(program, played)
    assert (found.failure, found.steps) == (None, played.steps)
    assert first_difference(played.frame_hashes, found.hashes) is None
    if inputs:
        without, _ = play(program, scripted(frames=40), tmp_path)
        assert first_difference(without.frame_hashes, found.hashes) is not None


def test_an_event_loop_of_the_program_gets_the_events_of_a_script(tmp_path: Path) -> None:
    script = scripted(
        'frame = 1\npress = "a"',
        'frame = 2\nrelease = "a"',
        'frame = 3\npress = "lshift"',
        'frame = 4\npress = "b"',
        'frame = 5\npress = "left"',
        'frame = 6\npress = "kp1"',
        'frame = 7\npress = "return"',
        'frame = 8\npress = "f1"',
        "frame = 9\nmouse = [10, 20]",
        'frame = 10\npress = "mouse 3"',
        "frame = 11\nmouse = [15, 30]",
        'frame = 12\nrelease = "mouse 3"',
        frames=20,
    )
    inputs, printed = play(GAMES / "all_events.py", script, tmp_path)
    *events, end = [line.rstrip() for line in printed.splitlines() if not line.startswith(("written", "the replay"))]
    assert events == [
        "on_resize 200 100",
        "press A",
        "on_text a",
        "release A",
        "press LSHIFT",
        "press B MOD_SHIFT",
        "on_text B",
        "press LEFT MOD_SHIFT",
        "on_text_motion 65361",
        "press NUM_1 MOD_SHIFT",
        "press ENTER MOD_SHIFT",
        "on_text",
        "press F1 MOD_SHIFT",
        "on_resize 300 150",
        "on_mouse_motion 10 20 10 20",
        "on_mouse_press 10 20 4 1",
        "on_mouse_drag 15 30 5 10 4 1",
        "on_mouse_release 15 30 4 1",
    ]
    assert end.endswith("300 px")
    found = rehearse(GAMES / "all_events.py", inputs)
    assert first_difference(inputs.frame_hashes, found.hashes) is None
    assert [line.rstrip() for line in found.output.splitlines()] == [*events, end]


def test_a_full_screen_has_the_recorded_size(tmp_path: Path) -> None:
    inputs, printed = play(GAMES / "all_events.py", scripted('frame = 3\npress = "f2"', frames=6), tmp_path)
    screens = inputs.readings["pyglet.screen"]
    assert screens[0].value == [1920, 1080]
    assert "on_resize 1920 1080" in printed
    other = {**inputs.readings, "pyglet.screen": tuple(each._replace(value=[1280, 720]) for each in screens)}
    found = rehearse(GAMES / "all_events.py", replace(inputs, readings=other))
    assert "on_resize 1280 720" in found.output
    assert found.output.strip().endswith("1280 px")


def test_a_window_has_the_size_that_the_user_gave_it(tmp_path: Path) -> None:
    inputs, printed = play(GAMES / "all_events.py", scripted(frames=6), tmp_path)
    assert "200 px" in printed
    values = {"window": 0, "name": "_on_internal_resize", "arguments": [250, 150]}
    first, *others = inputs.events
    resized = replace(inputs, events=(first, InputEvent(2, 0, PYGLET_EVENT, values), *others))
    found = rehearse(GAMES / "all_events.py", resized)
    assert "on_resize 250 150" in found.output
    assert found.output.strip().endswith("250 px")


def test_a_program_that_waits_for_events_ends_with_them(tmp_path: Path) -> None:
    program = tmp_path / "waits.py"
    program.write_text(
        "import pyglet, pymunk\n"
        "window = pyglet.window.Window(200, 100)\n"
        "space = pymunk.Space()\n"
        "ball = pymunk.Body(1, 1)\n"
        "space.add(ball, pymunk.Circle(ball, 3))\n"
        "@window.event\n"
        "def on_key_press(symbol, modifiers):\n"
        "    ball.velocity += (symbol % 7 + 1, 0)\n"
        "    space.step(0.1)\n"
        "    window.flip()\n"
        "pyglet.app.run(None)\n",
        encoding="utf-8",
    )
    inputs, _ = play(program, scripted('frame = 0\npress = "a"', 'frame = 1\npress = "b"', frames=9), tmp_path)
    found = rehearse(program, inputs)
    assert (found.failure, found.steps) == (None, 2)
    assert first_difference(inputs.frame_hashes, found.hashes) is None


def test_a_program_without_pyglet_does_not_import_it(tmp_path: Path) -> None:
    program = tmp_path / "plain.py"
    program.write_text(
        "import sys, pymunk\npymunk.Space().step(0.1)\nprint('pyglet' in sys.modules)\n", encoding="utf-8"
    )
    inputs, printed = play(program, scripted(frames=9), tmp_path)
    assert printed.startswith("False")
    assert rehearse(program, inputs).output.strip() == "False"


@pytest.fixture
def display() -> Iterator[str]:
    missing = [name for name in ("Xvfb", "xdotool") if shutil.which(name) is None]
    if missing:
        pytest.skip(f"a real window needs {' and '.join(missing)}")
    server, name = start_server()
    try:
        yield name
    finally:
        server.terminate()
        server.wait()


def test_a_play_in_a_window_is_rehearsed_bit_for_bit(display: str, tmp_path: Path) -> None:
    environment = {**os.environ, "DISPLAY": display}
    output = tmp_path / "output.txt"

    def wait_for(line: str) -> None:
        limit = monotonic() + LIMIT
        while line not in (text := output.read_text(encoding="utf-8")):
            assert monotonic() < limit, text
            sleep(0.02)

    def xdotool(*words: object) -> str:
        done = subprocess.run(
            ["xdotool", *map(str, words)], env=environment, capture_output=True, text=True, timeout=LIMIT, check=True
        )
        return done.stdout

    with output.open("wb") as file:
        command = [sys.executable, "-m", "sandbox", "record", "--to", "play.json", str(GAMES / "balls.py")]
        process = subprocess.Popen(command, cwd=tmp_path, env=environment, stdout=file, stderr=subprocess.STDOUT)
    try:
        wait_for("ready")
        window = xdotool("search", "--sync", "--onlyvisible", "--name", "^game$").split()[-1]
        xdotool("windowfocus", "--sync", window)
        xdotool("mousemove", "--window", window, 40, 139, "click", 1)
        wait_for("mouse 40")
        xdotool("keydown", "Right")
        wait_for("key RIGHT")
        xdotool("key", "Up")
        wait_for("key UP")
        xdotool("keyup", "Right", "key", "Escape")
        assert process.wait(LIMIT) == 0, output.read_text(encoding="utf-8")
    finally:
        process.kill()
        process.wait()
    inputs = load_inputs(tmp_path / "play.json")
    found = rehearse(GAMES / "balls.py", inputs)
    assert (found.failure, found.steps) == (None, inputs.steps)
    assert inputs.frames > 10
    assert first_difference(inputs.frame_hashes, found.hashes) is None
    assert [line for line in found.output.splitlines() if line.startswith(("key", "mouse"))] == [
        line for line in output.read_text(encoding="utf-8").splitlines() if line.startswith(("key", "mouse"))
    ]
