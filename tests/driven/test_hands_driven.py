"""Bodies dragged, moved and edited by mouse and keys in a real window."""

from pathlib import Path

import pytest

from sandbox.action import Launch, Move, Pull, SetParameter, Spawn
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.window.camera import Camera
from sandbox.window.render.palette import GREEN, SKY, VERMILION
from tests.driven.driving import DrivenWindow, OpenWindow
from tests.driven.looking import are_different, centroid, count_pixels, is_near, on_screen, shows_paused, window_layout
from tests.driven.rooms import AT_REST, write_scene
from tests.driven.xclient import XClient

pytestmark = pytest.mark.slow  # a real window in real time

BALL_START = (-1.0, 0.0)
TARGET = (1.2, 0.4)
WITHIN = 6.0  # px: the line to the mouse and the text of the picked ball cover some of its pixels


def open_scene(drive: OpenWindow, folder: Path, *arguments: str) -> tuple[DrivenWindow, Camera]:
    path = write_scene(folder, AT_REST)
    camera = window_layout(path).camera
    window = drive("play", str(path), *arguments)
    window.wait_until(
        lambda shot: is_near(centroid(shot, SKY), on_screen(camera, BALL_START), 2.0), "the ball at its start"
    )
    return window, camera


def replayed_end(session: Recording) -> tuple[float, float]:
    """Replay a session, assert that it reaches the same state, and return the end position of its first body, m."""
    run = rerun(session)
    assert run.info["state_hash"] == session.state_hash
    x, y = run.position[-1, 0].tolist()
    return x, y


def test_dragged_ball_follows_the_mouse_until_it_is_released(drive: OpenWindow, tmp_path: Path) -> None:
    window, camera = open_scene(drive, tmp_path)
    target = on_screen(camera, TARGET)
    window.press_and_move(on_screen(camera, BALL_START), target)
    window.wait_until(lambda shot: is_near(centroid(shot, SKY), target, WITHIN), "the ball at the mouse")
    window.release()
    session = window.session()
    pulls = [action for action in session.actions if isinstance(action, Pull)]
    assert pulls[0].target == pytest.approx(BALL_START, abs=1 / camera.scale)  # a pixel
    assert pulls[-1].target is None
    # The drag is a critically damped spring: it has converged to within the accuracy of the picture.
    assert replayed_end(session) == pytest.approx(TARGET, abs=WITHIN / camera.scale)


def test_dragging_a_ball_while_paused_moves_it(drive: OpenWindow, tmp_path: Path) -> None:
    window, camera = open_scene(drive, tmp_path, "--paused")
    target = on_screen(camera, TARGET)
    window.drag(on_screen(camera, BALL_START), target)
    window.wait_until(lambda shot: is_near(centroid(shot, SKY), target, WITHIN), "the ball at the mouse")
    session = window.session()
    assert isinstance(session.actions[-1], Move)
    assert session.duration == 0.0
    # A pixel where it was grabbed, and one at the target
    assert replayed_end(session) == pytest.approx(TARGET, abs=2 / camera.scale)


def test_drag_ends_when_the_window_loses_focus(drive: OpenWindow, display: str, tmp_path: Path) -> None:
    window, camera = open_scene(drive, tmp_path)
    target = on_screen(camera, TARGET)
    window.press_and_move(on_screen(camera, BALL_START), target)
    pulled = window.wait_until(lambda shot: is_near(centroid(shot, SKY), target, WITHIN), "the ball at the mouse")
    with XClient(display) as client:
        client.take_focus_away()
    window.wait_until(lambda shot: are_different(shot, pulled), "the mark of the drag gone")
    window.mouse(on_screen(camera, BALL_START))
    window.focus()
    last = window.session().actions[-1]
    assert isinstance(last, Pull)
    assert last.target is None


def test_slider_sets_gravity(drive: OpenWindow, tmp_path: Path) -> None:
    window, _ = open_scene(drive, tmp_path)
    track = window_layout(tmp_path / "room.toml").widgets["gravity"]
    window.drag((track.centerx, track.centery), (track.left + 0.25 * track.width, track.centery))
    session = window.session()
    last = session.actions[-1]
    assert isinstance(last, SetParameter)
    assert last.path == "world.gravity"
    # From −30 to 30 m/s² over the track: a quarter is −15, a pixel 0.28.
    assert last.value == pytest.approx([0.0, -15.0], abs=0.5)
    replayed_end(session)
    window.wait_until(lambda shot: count_pixels(shot, SKY) < 3000, "the ball on the floor, below the region")


def test_keys_add_nudge_and_delete_a_ball(drive: OpenWindow, tmp_path: Path) -> None:
    window, camera = open_scene(drive, tmp_path, "--paused")
    window.mouse(on_screen(camera, (0.5, 0.3)))
    window.key("b")
    (spawn,) = window.session().actions
    assert isinstance(spawn, Spawn)
    assert spawn.ball.position == pytest.approx((0.5, 0.3), abs=1 / camera.scale)
    window.click(on_screen(camera, BALL_START))
    window.key("n", "Delete")
    assert [action.kind for action in window.session().actions] == ["spawn", "impulse", "remove"]
    window.wait_until(lambda shot: count_pixels(shot, SKY) == 0, "the first ball gone")


def test_arrows_move_the_circle_into_contact_and_out(drive: OpenWindow) -> None:
    window = drive("play", "circle_half_plane")
    window.wait_until(lambda shot: count_pixels(shot, GREEN) > 1000 and count_pixels(shot, VERMILION) == 0, "green")
    window.key("Down", "Down", "Down")
    window.wait_until(lambda shot: count_pixels(shot, VERMILION) > 1000 and count_pixels(shot, GREEN) == 0, "vermilion")
    window.key("Up", "Up", "Up")
    window.wait_until(
        lambda shot: count_pixels(shot, GREEN) > 1000 and count_pixels(shot, VERMILION) == 0, "green again"
    )


def test_space_launches_fireworks_again_and_does_not_pause(drive: OpenWindow) -> None:
    window = drive("play", "fireworks")
    window.key("space", "space")
    session = window.session()
    assert [action.kind for action in session.actions] == ["launch", "launch"]
    assert all(isinstance(action, Launch) and action.generator == "spark" for action in session.actions)
    assert rerun(session).info["state_hash"] == session.state_hash
    assert not shows_paused(window.settled_shot())
    window.key("p")
    window.wait_until(shows_paused, "PAUSED")
