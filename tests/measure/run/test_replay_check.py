"""Checks of recorded games: how far a replay departs from its game, when, and which body."""

import math
from collections.abc import Callable
from pathlib import Path

import pymunk
import pytest

from sandbox.measure.run.replay_check import checked_recording
from sandbox.measure.run.sessions import read_session, rerun
from sandbox.pymunk_capture.game_capture import GameCapture, capture
from sandbox.recording import RecordedGame, Recording, ReplayCheck
from sandbox.recording_remarks import is_in_pixels, remarks_on
from tests.pymunk_capture.test_space_capture import DT, space_with_walls

pytestmark = pytest.mark.fail_slow(60)  # runs of many steps

Act = Callable[[pymunk.Space, pymunk.Body], object]


def ball(space: pymunk.Space, x: float, y: float = 300.0, radius: float = 10.0) -> pymunk.Body:
    body = pymunk.Body(2, 100)
    body.position = x, y
    disc = pymunk.Circle(body, radius)
    disc.friction = 0.5
    space.add(body, disc)
    return body


def played(act: Act | None = None, step: int = 20, steps: int = 40) -> tuple[GameCapture, list[pymunk.Body]]:
    """Return the recording of a game with two falling balls; the game acts on the second one before a step."""
    space = space_with_walls()
    bodies = [ball(space, -50), ball(space, 50)]
    with capture() as captured:
        for k in range(1, steps + 1):
            if k == step and act is not None:
                act(space, bodies[1])
            space.step(DT)
    return captured, bodies


def check_of(recording: Recording) -> ReplayCheck:
    assert recording.game is not None and recording.game.replay is not None
    return recording.game.replay


def speed_up(space: pymunk.Space, _: pymunk.Body) -> None:
    space.damping = 2.0


def grow_heavy(space: pymunk.Space, body: pymunk.Body) -> None:
    body.mass = 50.0
    body.force = 5000, 0


@pytest.mark.parametrize("step", [2, 20, 40])
@pytest.mark.parametrize(("act", "departed"), [(speed_up, "body-1"), (grow_heavy, "body-2")])
def test_departure_has_the_step_the_body_and_the_distance(act: Act, departed: str, step: int) -> None:
    captured, bodies = played(act, step)
    recording = checked_recording(captured)
    check = check_of(recording)
    assert (check.is_equal, check.step, check.departed, check.reason) == (False, step, departed, None)
    again = rerun(recording)
    ends = zip(again.position[-1].tolist(), bodies, strict=True)
    distance = max(math.dist(end, body.position) for end, body in ends)
    assert check.distance == pytest.approx(distance, rel=1e-12)
    assert check.body in ("body-1", departed)  # the damping moves both equally far
    assert f"departs from the game at step {step} ({departed})" in remarks_on(recording)[-1]


@pytest.mark.parametrize("steps", [1, 2, 50])
def test_replay_that_is_the_game_has_no_remarks_and_the_hash_of_the_game(steps: int, tmp_path: Path) -> None:
    captured, bodies = played(lambda _, body: setattr(body, "velocity", (9, 9)), steps // 2, steps)
    recording = checked_recording(captured)
    assert check_of(recording) == ReplayCheck(True, None, None, 0.0, check_of(recording).body, 0.0)
    assert remarks_on(recording) == ()
    assert recording.game is not None
    assert recording.state_hash == recording.game.state_hash == rerun(recording).info["state_hash"]
    for body, name in captured.spaces[0].names.items():
        if body in bodies:
            state = (*body.position, *body.velocity, body.angle, body.angular_velocity)
            assert recording.game.end[name] == state
    stored = read_session(recording.save(tmp_path / "game.json"))
    assert stored.game == recording.game
    assert rerun(stored).info["state_hash"] == stored.state_hash


def test_hash_of_a_game_that_the_replay_departs_from_is_another(tmp_path: Path) -> None:
    captured, _ = played(speed_up)
    recording = checked_recording(captured)
    assert recording.game is not None
    assert recording.state_hash == rerun(recording).info["state_hash"]
    assert recording.game.state_hash not in (None, recording.state_hash)
    stored = Recording.load(recording.save(tmp_path / "game.json"))
    assert remarks_on(stored) == remarks_on(recording)
    assert stored.on("reference").game == RecordedGame(
        recording.game.omitted, recording.game.inexact, recording.game.end, recording.game.state_hash
    )


def test_game_whose_states_are_not_finite_is_checked(tmp_path: Path) -> None:
    captured, _ = played(lambda _, body: setattr(body, "velocity", (float("nan"), 0)))
    recording = checked_recording(captured)
    check = check_of(recording)
    assert (check.is_equal, check.step, check.departed) == (False, 20, "body-2")
    stored = Recording.load(recording.save(tmp_path / "game.json"))
    assert stored.game == recording.game
    assert stored.game is not None and stored.game.end["body-2"][2] is None


def test_game_with_a_varying_step_is_compared_at_its_end() -> None:
    space = space_with_walls()
    body = ball(space, 0)
    with capture() as captured:
        for k in range(40):
            space.step(DT * (1 + k % 3))
    recording = checked_recording(captured)
    check = check_of(recording)
    assert (check.is_equal, check.step, check.largest, check.body) == (False, None, None, "body-1")
    assert check.distance == pytest.approx(abs(rerun(recording).position[-1, 0, 1] - body.position.y), rel=1e-12)


@pytest.mark.parametrize("radius", [0.1, 0.5, 2.0, 5.0, 10.0, 60.0])
def test_pixels_are_guessed_from_the_sizes_of_bodies(radius: float) -> None:
    space = space_with_walls()
    for k in range(3):
        ball(space, 200 * k, radius=radius)
    with capture() as captured:
        space.step(DT)
    assert is_in_pixels(captured.recording.scene) == (radius >= 5.0)
