"""Keys of time, pressed in a real window."""

from pathlib import Path

import pytest

from sandbox.window.render.palette import SKY
from tests.driven.driving import Play
from tests.driven.looking import ARENA, HUD, STEP_ROW, differ, laid_out, middle, near, on_screen, paused
from tests.driven.rooms import AT_REST, MOVING, written

pytestmark = pytest.mark.slow  # a real window in real time


def test_window_starts_running(drive: Play, tmp_path: Path) -> None:
    window = drive("play", str(written(tmp_path, MOVING)))
    first = window.shot()
    window.wait_until(lambda shot: differ(shot, first) and differ(shot, first, STEP_ROW), "another step")
    assert not paused(first)
    assert window.step_number() > 0
    assert window.title() == "Moving - sandbox"


def test_p_and_space_pause_and_go_on(drive: Play, tmp_path: Path) -> None:
    window = drive("play", str(written(tmp_path, MOVING)))
    for key in ("p", "space"):
        window.key(key)
        window.wait_until(paused, "PAUSED")
        step, still = window.step_number(), window.shot()
        assert window.step_number() == step
        assert not differ(window.shot(), still)
        window.key(key)
        window.wait_until(lambda shot: not paused(shot), "the end of the pause")
        window.wait_until(lambda shot, still=still: differ(shot, still), "another picture")


def test_keys_step_on_and_back_to_the_same_picture(drive: Play, tmp_path: Path) -> None:
    window = drive("play", str(written(tmp_path, MOVING)), "--paused")
    start = window.wait_until(paused, "PAUSED")
    window.key("o")
    one = window.wait_until(lambda shot: differ(shot, start) and differ(shot, start, STEP_ROW), "step 1")
    window.key("period")
    window.wait_until(lambda shot: differ(shot, one) and differ(shot, one, STEP_ROW), "step 2")
    assert window.step_number() == 2
    window.key("comma")
    window.wait_until(lambda shot: not differ(shot, one) and not differ(shot, one, HUD), "step 1 again")
    assert window.step_number() == 1


def test_a_step_pauses_what_runs(drive: Play, tmp_path: Path) -> None:
    window = drive("play", str(written(tmp_path, MOVING)))
    window.key("o")
    window.wait_until(paused, "PAUSED")


def test_r_and_backspace_restart_and_keep_the_pause(drive: Play, tmp_path: Path) -> None:
    window = drive("play", str(written(tmp_path, MOVING)), "--paused")
    start = window.wait_until(paused, "PAUSED")
    for key in ("r", "BackSpace"):
        window.key(*["o"] * 20)
        window.wait_until(lambda shot: differ(shot, start), "another place")
        assert window.step_number() == 20
        window.key(key)
        window.wait_until(lambda shot: not differ(shot, start) and not differ(shot, start, HUD), "the start")
        assert window.step_number() == 0


def test_slower_is_told_and_faster_takes_it_back(drive: Play, tmp_path: Path) -> None:
    window = drive("play", str(written(tmp_path, MOVING)), "--paused")
    start = window.wait_until(paused, "PAUSED")
    window.key("minus")
    slower = window.wait_until(lambda shot: differ(shot, start, HUD), "a slower speed")
    window.key("equal")
    window.wait_until(lambda shot: not differ(shot, start, HUD), "the speed of before")
    window.key("equal")
    window.wait_until(lambda shot: differ(shot, start, HUD) and differ(shot, slower, HUD), "a faster speed")


def test_scene_is_seen_where_the_camera_says(drive: Play, tmp_path: Path) -> None:
    path = written(tmp_path, AT_REST)
    camera = laid_out(path).camera
    window = drive("play", str(path))
    place = on_screen(camera, (-1.0, 0.0))
    # 2 px: the mean over the pixels of a disc whose rim is antialiased
    window.wait_until(lambda shot: near(middle(shot, SKY, ARENA), place, 2.0), "the ball in its place")
