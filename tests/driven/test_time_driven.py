"""Keys that pause, step, restart and change the speed, in a real window."""

from pathlib import Path

import pytest

from sandbox.window.render.palette import SKY
from tests.driven.driving import OpenWindow
from tests.driven.looking import (
    ARENA,
    HUD,
    STEP_ROW,
    are_different,
    centroid,
    is_near,
    on_screen,
    shows_paused,
    window_layout,
)
from tests.driven.rooms import AT_REST, MOVING, write_scene

pytestmark = pytest.mark.slow  # a real window in real time


def test_window_starts_running(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", str(write_scene(tmp_path, MOVING)))
    first = window.shot()
    window.wait_until(lambda shot: are_different(shot, first) and are_different(shot, first, STEP_ROW), "another step")
    assert not shows_paused(first)
    assert window.step_number() > 0
    assert window.title() == "Moving - sandbox"


def test_p_and_space_pause_and_resume(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", str(write_scene(tmp_path, MOVING)))
    for key in ("p", "space"):
        window.key(key)
        window.wait_until(shows_paused, "PAUSED")
        step, still = window.step_number(), window.shot()
        assert window.step_number() == step
        assert not are_different(window.shot(), still)
        window.key(key)
        window.wait_until(lambda shot: not shows_paused(shot), "the end of the pause")
        window.wait_until(lambda shot, still=still: are_different(shot, still), "another picture")


def test_steps_forwards_and_back_show_the_same_picture(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", str(write_scene(tmp_path, MOVING)), "--paused")
    start = window.wait_until(shows_paused, "PAUSED")
    window.key("o")
    one = window.wait_until(lambda shot: are_different(shot, start) and are_different(shot, start, STEP_ROW), "step 1")
    window.key("period")
    window.wait_until(lambda shot: are_different(shot, one) and are_different(shot, one, STEP_ROW), "step 2")
    assert window.step_number() == 2
    window.key("comma")
    window.wait_until(lambda shot: not are_different(shot, one) and not are_different(shot, one, HUD), "step 1 again")
    assert window.step_number() == 1


def test_single_step_pauses_a_running_scene(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", str(write_scene(tmp_path, MOVING)))
    window.key("o")
    window.wait_until(shows_paused, "PAUSED")


def test_r_and_backspace_restart_and_keep_the_pause(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", str(write_scene(tmp_path, MOVING)), "--paused")
    start = window.wait_until(shows_paused, "PAUSED")
    for key in ("r", "BackSpace"):
        window.key(*["o"] * 20)
        window.wait_until(lambda shot: are_different(shot, start), "another position")
        assert window.step_number() == 20
        window.key(key)
        window.wait_until(
            lambda shot: not are_different(shot, start) and not are_different(shot, start, HUD), "the start"
        )
        assert window.step_number() == 0


def test_slower_and_faster_change_the_displayed_speed(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", str(write_scene(tmp_path, MOVING)), "--paused")
    start = window.wait_until(shows_paused, "PAUSED")
    window.key("minus")
    slower = window.wait_until(lambda shot: are_different(shot, start, HUD), "a slower speed")
    window.key("equal")
    window.wait_until(lambda shot: not are_different(shot, start, HUD), "the original speed")
    window.key("equal")
    window.wait_until(
        lambda shot: are_different(shot, start, HUD) and are_different(shot, slower, HUD), "a faster speed"
    )


def test_ball_is_drawn_at_the_position_given_by_the_camera(drive: OpenWindow, tmp_path: Path) -> None:
    path = write_scene(tmp_path, AT_REST)
    camera = window_layout(path).camera
    window = drive("play", str(path))
    point = on_screen(camera, (-1.0, 0.0))
    # 2 px: the mean over the pixels of a disc whose rim is antialiased
    window.wait_until(lambda shot: is_near(centroid(shot, SKY, ARENA), point, 2.0), "the ball")
