"""Rehearsals: a recorded game runs again, bit for bit, with its inputs, its clock and its random numbers."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sandbox.game_inputs import GameInputs, inputs_from_json, inputs_to_json, jittered, load_inputs
from sandbox.rehearsal.rehearse import Rehearsal, RehearsalError, first_difference, rehearse
from sandbox.rehearsal.step_settings import Nudge, RehearsalSettings
from tests.cli.calling import call, process

pytestmark = pytest.mark.fail_slow(60)  # each test starts the interpreter several times, with pygame and pymunk

SCRIPT = """
frames = 120
fps = 50
seed = 3
[[input]]
frame = 10
mouse = [300, 300]
[[input]]
frame = 15
press = "mouse 1"
[[input]]
frame = 25
mouse = [320, 280]
[[input]]
frame = 35
release = "mouse 1"
[[input]]
frame = 40
press = "up"
[[input]]
frame = 60
release = "up"
[[input]]
frame = 62
press = "right"
[[input]]
frame = 90
release = "right"
"""

Recorder = Callable[..., GameInputs]


@pytest.fixture
def record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Recorder:
    """Return a function that records a game with a script of inputs, in a process of its own."""
    monkeypatch.chdir(tmp_path)

    def recorded(game: Path, *arguments: str, script: str = SCRIPT) -> GameInputs:
        Path("play.toml").write_text(script)
        found = process("record", "--script", "play.toml", "--to", "inputs.json", "--force", str(game), *arguments)
        assert found.returncode in (0, 1), found.stderr
        return load_inputs("inputs.json")

    return recorded


def game_file(text: str) -> Path:
    """Write a game to the working folder."""
    path = Path("game.py")
    path.write_text(text)
    return path


PYGAME_EXAMPLES = (
    "arrows",
    "balls_and_lines",
    "bouncing_balls",
    "box2d_pyramid",
    "breakout",
    "camera",
    "collisions",
    "colors",
    "constraints",
    "contact_and_no_flipy",
    "contact_with_friction",
    "copy_and_pickle",
    "damped_rotary_spring_pointer",
    "deformable",
    "flipper",
    "index_video",
    "newtons_cradle",
    "planet",
    "platformer",
    "playground",
    "point_query",
    "slide_and_pinjoint",
    "tank",
    "using_sprites",
)
ARGUMENTS = {"newtons_cradle": ["/i"]}


@pytest.mark.parametrize("name", PYGAME_EXAMPLES)
def test_examples_of_pymunk_run_again_bit_for_bit(name: str, record: Recorder) -> None:
    import pymunk

    game = Path(pymunk.__file__).parent / "examples" / f"{name}.py"
    inputs = record(game, *ARGUMENTS.get(name, ()))
    assert inputs.steps > 0
    run = rehearse(game, inputs)
    assert run.failure is None
    assert first_difference(run.hashes, inputs.frame_hashes) is None
    again = rehearse(game, inputs, draws=False)
    assert again.hashes == run.hashes
    assert again.calls == run.calls


CLOCKED = """
import random, sys, time
import numpy, pygame, pymunk
pygame.init()
pygame.display.set_mode((200, 200))
space = pymunk.Space()
body = pymunk.Body(1, 10)
space.add(body, pymunk.Circle(body, 5))
clock = pygame.time.Clock()
own = random.Random()
generator = numpy.random.default_rng()
start = time.time()
while not any(event.type == pygame.QUIT for event in pygame.event.get()):
    dt = clock.tick(60) / 1000
    keys = pygame.key.get_pressed()
    body.velocity = (
        100 * keys[pygame.K_RIGHT] + random.random() + own.random() + pygame.mouse.get_pressed()[0],
        generator.random() + numpy.random.random() + pygame.mouse.get_pos()[0] + pygame.mouse.get_rel()[1]
        + (time.time() - start) + pygame.time.get_ticks() % 7 + time.perf_counter() % 1,
    )
    space.step(max(dt, 0.001))
    pygame.display.flip()
print("ended at", tuple(body.position), sys.argv[1:])
"""


def test_clock_keys_mouse_and_random_numbers_are_those_of_the_recording(record: Recorder) -> None:
    inputs = record(game_file(CLOCKED))
    run = rehearse("game.py", inputs)
    assert run.failure is None
    assert run.hashes == inputs.frame_hashes
    assert run.ended == "program"
    assert "ended at" in run.output


def test_live_clock_and_random_numbers_are_those_of_the_recording(
    record: Recorder,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    text = CLOCKED.replace("while not any", "frames = 0\nwhile frames < 30 and not any")
    game = game_file(text.replace("    dt = ", "    frames += 1\n    dt = "))
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    found = process("record", "--to", "live.json", str(game))
    assert found.returncode == 0, found.stderr
    inputs = load_inputs("live.json")
    assert inputs.frames == 30
    run = rehearse(game, inputs)
    assert run.hashes == inputs.frame_hashes
    assert inputs.seed != 0


WITHOUT_WINDOW = """
import time
import pymunk
space = pymunk.Space()
body = pymunk.Body(1, 10)
space.add(body, pymunk.Circle(body, 5))
last = time.perf_counter()
for k in range(50):
    time.sleep(0.001)
    now = time.perf_counter()
    body.velocity = (1000 * (now - last), k)
    last = now
    space.step(1 / 60)
"""


def test_program_without_a_window_has_a_frame_for_each_step(record: Recorder) -> None:
    game = game_file(WITHOUT_WINDOW)
    found = process("record", "--to", "live.json", str(game))
    assert found.returncode == 0, found.stderr
    inputs = load_inputs("live.json")
    assert (inputs.frames, inputs.steps) == (50, 50)
    assert rehearse(game, inputs).hashes == inputs.frame_hashes


FORCED = """
import pymunk
space = pymunk.Space()
body = pymunk.Body(2, 10)
space.add(body, pymunk.Circle(body, 5))
for k in range(60):
    body.apply_force_at_world_point((6, 0), body.position)
    body.torque = 5
    space.step(1 / 60)
"""


def test_force_of_a_frame_acts_in_all_substeps(record: Recorder) -> None:
    record_of = record(game_file(FORCED))
    for substeps in (1, 2, 8):
        run = rehearse("game.py", record_of, RehearsalSettings(substeps=substeps))
        _, states = run.frame(run.frames - 1)
        # v = F t / m = 6 N · 1 s / 2 kg, ω = τ t / I = 5 N m · 1 s / 10 kg m², to the rounding of 60 sums
        assert states[0, 3] == pytest.approx(3.0, abs=1e-12)
        assert states[0, 5] == pytest.approx(0.5, abs=1e-12)
        # pymunk moves a body before it accelerates it: x = v t / 2 · (1 − 1/n) for n steps of equal length
        assert states[0, 0] == pytest.approx(1.5 * (1 - 1 / (60 * substeps)), abs=1e-12)


FALLING = """
import pymunk
space = pymunk.Space()
space.gravity = (0, -900)
body = pymunk.Body(1, 10)
space.add(body, pymunk.Circle(body, 5))
print(space.iterations)
for k in range(30):
    space.step(1 / 30)
print(space.iterations, space.collision_slop, space.collision_bias, space.collision_persistence)
"""


def test_settings_are_those_of_pymunk(record: Recorder) -> None:
    """Free fall in n steps, in each of which pymunk moves a body before it accelerates it: y = −g t² (1 − 1/n) / 2."""
    inputs = record(game_file(FALLING))

    def height(settings: RehearsalSettings) -> float:
        run = rehearse("game.py", inputs, settings)
        return float(run.frame(run.frames - 1)[1][0, 1])

    finer = RehearsalSettings(substeps=3), RehearsalSettings(dt=0.01)
    for settings, steps in zip((RehearsalSettings(), *finer), (30, 90, 120), strict=True):
        assert height(settings) == pytest.approx(-450.0 * (1 - 1 / steps), abs=1e-9)  # rounding of 120 sums
    settings = RehearsalSettings(iterations=25, slop=0.25, bias=0.5, persistence=7)
    assert rehearse("game.py", inputs, settings).output.split() == ["10", "25", "0.25", "0.5", "7"]


def test_nudge_displaces_moving_bodies_by_at_most_its_distance(record: Recorder) -> None:
    inputs = record(game_file(FALLING))
    own, other = (rehearse("game.py", inputs, nudge=nudge) for nudge in (None, Nudge(0.5, seed=4)))
    apart = np.abs(own.frame(0)[1] - other.frame(0)[1])[0, :2]
    assert (apart > 0).all()
    assert (apart <= 0.5).all()


SAVING = """
import json, os, pathlib
import pymunk
here = pathlib.Path(__file__).parent
best = json.loads((here / "best.json").read_text())
assert not (here / "log").exists()
space = pymunk.Space()
body = pymunk.Body(1, 10)
space.add(body, pymunk.Circle(body, 5))
body.velocity = (best, 0)
for k in range(10):
    space.step(1 / 60)
(here / "best.json").write_text(json.dumps(best + 1))
(here / "log").mkdir()
with open("log/play.txt", "w") as file:
    file.write("played")
os.replace("log/play.txt", "log/last.txt")
"""


def test_game_that_saves_has_its_files_of_before_and_changes_none(record: Recorder) -> None:
    game = game_file(SAVING)
    Path("best.json").write_text("41")
    inputs = record(game)
    assert Path("best.json").read_text() == "42"
    kept = {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()}
    for _ in range(2):
        run = rehearse(game, inputs)
        assert run.failure is None, run.output
        assert run.hashes == inputs.frame_hashes
        assert run.step_calls[0][0] == str(game.resolve())
    assert {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()} == kept


@pytest.mark.parametrize(
    ("line", "word"),
    [
        ("open('other.txt', 'w')", "changes of"),
        ("import os; os.remove('play.toml')", "changes of"),
        ("import socket; socket.create_connection(('127.0.0.1', 9), 0.1)", "network"),
        ("import os; os.system('true')", "other programs"),
    ],
)
def test_rehearsal_denies_what_the_recording_does_not_have(line: str, word: str, record: Recorder) -> None:
    inputs = record(game_file(FALLING))
    game = game_file(f"{FALLING}\n{line}\n")
    run = rehearse(game, inputs)
    assert run.failure is not None
    assert "PermissionError" in run.output or "Denied" in run.output
    assert any(word in note for note in run.notes)
    assert Path("play.toml").exists()
    assert not Path("other.txt").exists()


def test_endless_game_is_ended_by_the_time_limit(record: Recorder) -> None:
    inputs = record(game_file(FALLING))
    game = game_file(f"{FALLING}\nwhile True: pass\n")
    with pytest.raises(RehearsalError, match=r"2 s|SIG"):
        rehearse(game, inputs, time_limit=2.0)


def test_inputs_survive_their_document(record: Recorder) -> None:
    inputs = record(game_file(CLOCKED))
    again = inputs_from_json(inputs_to_json(inputs))
    assert replace(again, readings={}) == replace(inputs, readings={})
    assert {kind: list(each) for kind, each in again.readings.items()} == {
        kind: list(each) for kind, each in inputs.readings.items()
    }


def test_jitter_delays_inputs_by_at_most_a_frame_and_keeps_their_order(record: Recorder) -> None:
    inputs = record(game_file(CLOCKED))
    moved = jittered(inputs, seed=5)
    delays = [b.frame - a.frame for a, b in zip(inputs.events, moved.events, strict=True)]
    assert set(delays) == {0, 1}
    assert [each.frame for each in moved.events] == sorted(each.frame for each in moved.events)
    assert moved.readings["tick"] == inputs.readings["tick"]
    run = rehearse("game.py", inputs, jitter_seed=5)
    assert run.hashes != inputs.frame_hashes
    assert run.failure is None


LOGGED = """
import pymunk
BALL, COIN = 1, 2
space = pymunk.Space()
space.gravity = (0, -100)
ball = pymunk.Body(1, 10)
disc = pymunk.Circle(ball, 5)
disc.collision_type = BALL
space.add(ball, disc)
coins = []
for k in range(3):
    coin = pymunk.Circle(space.static_body, 4, (0, -20 - 20 * k))
    coin.sensor = True
    coin.collision_type = COIN
    space.add(coin)
def collect(arbiter, space, data):
    space.remove(arbiter.shapes[1])
    anchor = pymunk.PinJoint(ball, space.static_body, (0, 0), (0, 100))
    anchor.max_force = 0
    space.add(anchor)
space.on_collision(BALL, COIN, begin=collect)
for k in range(100):
    space.step(1 / 60)
space.remove(ball, disc)
space.step(1 / 60)
"""


def test_callbacks_and_changes_are_logged_with_the_names_of_the_game(record: Recorder) -> None:
    inputs = record(game_file(LOGGED))
    run = rehearse("game.py", inputs)
    assert [str(each) for each in run.callbacks] == ["on_collision(ball, coin) begin collect"]
    # free fall of the ball's centre by 11, 31 and 51 until it touches a coin: k (k + 1) / 2 · g dt², the frame before
    frames = [next(k for k in range(200) if k * (k + 1) / 2 * 100 / 3600 > d) for d in (11, 31, 51)]
    assert [each.frame for each in run.calls] == frames
    assert [run.body_name(run.shape_bodies[shape]) for shape in run.calls[0].shapes] == ["ball", "body -1"]
    assert [(each.is_added, each.is_joint) for each in run.changes] == [(True, True)] * 3 + [(False, False)]


def test_runs_are_told_apart_bit_by_bit(record: Recorder) -> None:
    inputs = record(game_file(FALLING))
    run: Rehearsal = rehearse("game.py", inputs)
    assert first_difference(run.hashes, rehearse("game.py", inputs, nudge=Nudge(1e-12, 1)).hashes) == 0
    assert first_difference(run.hashes, run.hashes[:-1]) == run.frames - 1


SOUND = """
import array
import pygame, pymunk
pygame.mixer.init(44100, -16, 1)
pygame.display.init()
pygame.display.set_mode((100, 100))
pygame.mixer.Sound(buffer=array.array("h", [0] * 2205)).play()
space = pymunk.Space()
body = pymunk.Body(1, 1)
space.add(body, pymunk.Circle(body, 1))
for k in range(40):
    pygame.event.get()
    pygame.time.wait(5)
    if pygame.mixer.get_busy():
        body.velocity = (k + 1, 0)
    space.step(1 / 60)
    pygame.display.flip()
"""


def test_game_that_waits_for_a_sound_hears_it_end_in_the_same_frame(
    record: Recorder,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The sound lasts 0.05 s, in a recording in real time."""
    for name in ("SDL_VIDEODRIVER", "SDL_AUDIODRIVER"):
        monkeypatch.setenv(name, "dummy")
    game = game_file(SOUND)
    assert process("record", "--to", "live.json", str(game)).returncode == 0
    inputs = load_inputs("live.json")
    assert [each.value for each in inputs.readings["mixer.get_busy"]] == [True, False]
    assert rehearse(game, inputs).hashes == inputs.frame_hashes


IGNORING = """
import pygame, pymunk
screen = pygame.display.set_mode((50, 50))
space = pymunk.Space()
space.gravity = (0, 900)
body = pymunk.Body(1, 10)
space.add(body, pymunk.Circle(body, 5))
while True:
    pygame.event.get()
    space.step(1 / 60)
    pygame.display.flip()
"""


@pytest.mark.fail_slow(60)  # a recording and a rehearsal, each in a process of its own
def test_script_ends_a_game_that_ignores_the_closing_of_its_window(record: Recorder) -> None:
    inputs = record(game_file(IGNORING), script="frames = 20\n")
    assert 20 < inputs.frames < 200
    assert any("runs on" in note for note in inputs.notes)
    assert rehearse("game.py", inputs).hashes == inputs.frame_hashes


@pytest.mark.fail_slow(60)  # a recording and a rehearsal, each in a process of its own
def test_changed_program_is_the_cause_of_a_difference(record: Recorder) -> None:
    record(game_file(FALLING))
    game_file(FALLING.replace("step(1 / 30)", "step(1 / 31)"))
    found = process("rehearse", "--inputs", "inputs.json", "game.py")
    assert "differs from the recorded game: frame 0" in found.stdout
    cause = next(line for line in found.stdout.splitlines() if "cause" in line)
    assert "game.py has changed since the recording" in cause


SPAWNING = """
import pymunk
space = pymunk.Space()
space.gravity = (0, -900)
floor = pymunk.Segment(space.static_body, (-500, 0), (500, 0), 1)
floor.collision_type = 1
space.add(floor)
def land(arbiter, space, data):
    ball, _ = arbiter.shapes
    spark = pymunk.Body(1, 10)
    spark.position = ball.body.position.x, 300
    shape = pymunk.Circle(spark, 3)
    space.remove(ball, ball.body)
    space.add(spark, shape)
space.on_collision(2, 1, begin=land)
for x, y, speed in ((0, 101.0, 20), (300, 100.0, 30)):
    body = pymunk.Body(1, 10)
    body.position, body.velocity = (x, y), (0, speed)
    shape = pymunk.Circle(body, 5)
    shape.collision_type = 2
    space.add(body, shape)
for k in range(50):
    space.step(1 / 60)
"""


def test_bodies_that_callbacks_add_are_found_again_by_their_contacts(record: Recorder) -> None:
    """Both balls land within a frame of each other, in another order with substeps."""
    inputs = record(game_file(SPAWNING))
    own, fine = (rehearse("game.py", inputs, RehearsalSettings(substeps=each)) for each in (1, 8))
    places = [dict(zip(run.frame(49)[0].tolist(), run.frame(49)[1][:, 0].tolist(), strict=True)) for run in (own, fine)]
    assert places[0] == places[1]  # the sparks fall straight down at x = 0 and 300
    assert sorted(places[0].values()) == [0.0, 300.0]
    assert {own.body_name(each) for each in places[0]} == {"body 1 of land", "body 2 of land"}


def test_window_of_the_recording_process_is_none_of_the_program(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A program without a window has a frame for each step, also where another one has left a window open."""
    import pygame

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    pygame.display.init()
    pygame.display.set_mode((20, 20))
    game_file(FALLING)
    assert call(["record", "--quiet", "--to", "inputs.json", "game.py"]) == 0
    inputs = load_inputs("inputs.json")
    assert (inputs.frames, inputs.steps) == (30, 30)
    assert rehearse("game.py", inputs).hashes == inputs.frame_hashes
