"""Bodies pulled, moved and changed by hand, in a real window."""

from pathlib import Path

import pytest

from sandbox.action import Launch, Move, Pull, SetParameter, Spawn
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.window.camera import Camera
from sandbox.window.render.palette import GREEN, SKY, VERMILION
from tests.driven.driving import Driven, Play
from tests.driven.looking import count, differ, laid_out, middle, near, on_screen, paused
from tests.driven.rooms import AT_REST, written
from tests.driven.xclient import XClient

pytestmark = pytest.mark.slow  # a real window in real time

BALL = (-1.0, 0.0)
THERE = (1.2, 0.4)
WITHIN = 6.0  # px: the line from ball to hand, and what is told of the picked ball, cover some of its pixels


def opened(drive: Play, folder: Path, *arguments: str) -> tuple[Driven, Camera]:
    path = written(folder, AT_REST)
    camera = laid_out(path).camera
    window = drive("play", str(path), *arguments)
    window.wait_until(lambda shot: near(middle(shot, SKY), on_screen(camera, BALL), 2.0), "the ball in its place")
    return window, camera


def end_of(session: Recording) -> tuple[float, float]:
    """Replay a session, make sure that it leads to the same state, and return where its first body is then, m."""
    run = rerun(session)
    assert run.info["state_hash"] == session.state_hash
    x, y = run.position[-1, 0].tolist()
    return x, y


def test_ball_is_pulled_to_the_mouse_and_let_go(drive: Play, tmp_path: Path) -> None:
    window, camera = opened(drive, tmp_path)
    there = on_screen(camera, THERE)
    window.pull(on_screen(camera, BALL), there)
    window.wait_until(lambda shot: near(middle(shot, SKY), there, WITHIN), "the ball at the mouse")
    window.release()
    session = window.session()
    pulls = [action for action in session.actions if isinstance(action, Pull)]
    assert pulls[0].target == pytest.approx(BALL, abs=1 / camera.scale)  # a pixel
    assert pulls[-1].target is None
    # A critically damped spring has no way left but what a pixel of the picture hides.
    assert end_of(session) == pytest.approx(THERE, abs=WITHIN / camera.scale)


def test_ball_is_moved_by_the_mouse_while_paused(drive: Play, tmp_path: Path) -> None:
    window, camera = opened(drive, tmp_path, "--paused")
    there = on_screen(camera, THERE)
    window.drag(on_screen(camera, BALL), there)
    window.wait_until(lambda shot: near(middle(shot, SKY), there, WITHIN), "the ball at the mouse")
    session = window.session()
    assert isinstance(session.actions[-1], Move)
    assert session.duration == 0.0
    assert end_of(session) == pytest.approx(THERE, abs=2 / camera.scale)  # a pixel where it was taken, and one here


def test_pull_ends_where_the_keyboard_goes_elsewhere(drive: Play, display: str, tmp_path: Path) -> None:
    window, camera = opened(drive, tmp_path)
    there = on_screen(camera, THERE)
    window.pull(on_screen(camera, BALL), there)
    pulled = window.wait_until(lambda shot: near(middle(shot, SKY), there, WITHIN), "the ball at the mouse")
    with XClient(display) as client:
        client.take_focus_away()
    window.wait_until(lambda shot: differ(shot, pulled), "the hand's mark gone")
    window.mouse(on_screen(camera, BALL))
    window.focus()
    last = window.session().actions[-1]
    assert isinstance(last, Pull)
    assert last.target is None


def test_slider_sets_gravity(drive: Play, tmp_path: Path) -> None:
    window, _ = opened(drive, tmp_path)
    track = laid_out(tmp_path / "room.toml").widgets["gravity"]
    window.drag((track.centerx, track.centery), (track.left + 0.25 * track.width, track.centery))
    session = window.session()
    last = session.actions[-1]
    assert isinstance(last, SetParameter)
    assert last.path == "world.gravity"
    # From −30 to 30 m/s² over the track: a quarter is −15, a pixel 0.28.
    assert last.value == pytest.approx([0.0, -15.0], abs=0.5)
    end_of(session)
    window.wait_until(lambda shot: count(shot, SKY) < 3000, "the ball on the floor, below what is looked at")


def test_keys_add_nudge_and_delete_a_ball(drive: Play, tmp_path: Path) -> None:
    window, camera = opened(drive, tmp_path, "--paused")
    window.mouse(on_screen(camera, (0.5, 0.3)))
    window.key("b")
    (spawn,) = window.session().actions
    assert isinstance(spawn, Spawn)
    assert spawn.ball.position == pytest.approx((0.5, 0.3), abs=1 / camera.scale)
    window.click(on_screen(camera, BALL))
    window.key("n", "Delete")
    assert [action.kind for action in window.session().actions] == ["spawn", "impulse", "remove"]
    window.wait_until(lambda shot: count(shot, SKY) == 0, "the first ball gone")


def test_arrows_move_the_circle_into_contact_and_out(drive: Play) -> None:
    window = drive("play", "circle_half_plane")
    window.wait_until(lambda shot: count(shot, GREEN) > 1000 and count(shot, VERMILION) == 0, "green")
    window.key("Down", "Down", "Down")
    window.wait_until(lambda shot: count(shot, VERMILION) > 1000 and count(shot, GREEN) == 0, "vermilion")
    window.key("Up", "Up", "Up")
    window.wait_until(lambda shot: count(shot, GREEN) > 1000 and count(shot, VERMILION) == 0, "green again")


def test_space_launches_fireworks_again_and_does_not_pause(drive: Play) -> None:
    window = drive("play", "fireworks")
    window.key("space", "space")
    session = window.session()
    assert [action.kind for action in session.actions] == ["launch", "launch"]
    assert all(isinstance(action, Launch) and action.generator == "spark" for action in session.actions)
    assert rerun(session).info["state_hash"] == session.state_hash
    assert not paused(window.settled())
    window.key("p")
    window.wait_until(paused, "PAUSED")
