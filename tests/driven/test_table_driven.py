"""A billiards table in a real window: aim, stroke, undo and ball in hand by keys and mouse."""

import math
from pathlib import Path

import pytest

from sandbox.action import Move, Strike
from sandbox.measure.run.sessions import rerun
from sandbox.window.camera import Camera
from tests.driven.driving import DrivenWindow, OpenWindow
from tests.driven.looking import are_different, on_screen, window_layout
from tests.driven.rooms import write_scene

pytestmark = pytest.mark.slow  # a real window in real time

TABLE = """
title = "Table"
[billiards]
table = "pool-7ft"
[billiards.place]
cue = [0.5, 0.5]
1 = [0.5, 1.0]
"""
CUE = (0.5, 0.5)


def open_table(drive: OpenWindow, folder: Path) -> tuple[DrivenWindow, Camera]:
    path = write_scene(folder, TABLE)
    return drive("play", str(path)), window_layout(path).camera


def strokes(window: DrivenWindow) -> list[Strike]:
    return [action for action in window.session().actions if isinstance(action, Strike)]


def test_mouse_aims_space_shoots_and_z_undoes_the_stroke(drive: OpenWindow, tmp_path: Path) -> None:
    window, camera = open_table(drive, tmp_path)
    window.mouse(on_screen(camera, (0.8, 0.9)))
    before = window.settled_shot()
    window.key("space")
    window.wait_until(lambda shot: are_different(shot, before), "the ball rolling")
    (strike,) = strokes(window)
    # A pixel and a half at 0.5 m from the ball
    assert strike.aim == pytest.approx(math.atan2(0.4, 0.3), abs=1.5 / (0.5 * camera.scale))
    session = window.session()
    assert rerun(session).info["state_hash"] == session.state_hash
    window.key("z")
    window.wait_for(lambda: not strokes(window), "the stroke undone")
    assert window.step_number() == 0


def test_english_and_power_are_set_with_held_keys(drive: OpenWindow, tmp_path: Path) -> None:
    window, camera = open_table(drive, tmp_path)
    x, y = on_screen(camera, (0.8, 0.9))
    window.mouse((x, y))
    window.settled_shot()
    for key, offset in (("e", (20, -10)), ("x", (0, 40))):
        window.hold(key)
        window.settled_shot()
        x, y = x + offset[0], y + offset[1]
        window.mouse((x, y))
        window.settled_shot()
        window.release_key(key)
        window.settled_shot()
    window.key("space")
    (strike,) = window.wait_for(lambda: strokes(window), "a stroke")
    assert strike.side > 0.1
    assert strike.height > 0.05
    assert 0.05 <= strike.speed < 2.0
    assert window.session().engine == "exact"  # E set the english instead of switching the engine


def test_cue_is_drawn_back_and_released_with_the_mouse(drive: OpenWindow, tmp_path: Path) -> None:
    window, camera = open_table(drive, tmp_path)
    window.drag(on_screen(camera, (0.5, 0.8)), on_screen(camera, (0.5, 0.65)))
    (strike,) = window.wait_for(lambda: strokes(window), "a stroke")
    # Drawn back by 0.15 m, where 0.5 m give 10 m/s; a pixel is 3 mm.
    assert strike.speed == pytest.approx(3.0, abs=0.2)


def test_ball_in_hand_is_placed_at_the_click(drive: OpenWindow, tmp_path: Path) -> None:
    window, camera = open_table(drive, tmp_path)
    target = on_screen(camera, (0.3, 0.7))
    window.key("g")
    window.settled_shot()
    window.mouse(target)
    window.settled_shot()
    window.click(target)
    moved = window.wait_for(
        lambda: [action for action in window.session().actions if isinstance(action, Move)], "the ball moved"
    )
    assert moved[-1].position == pytest.approx((0.3, 0.7), abs=1.5 / camera.scale)  # a pixel
