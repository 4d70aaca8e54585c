"""A table in a real window: aimed at, struck, and taken back by real keys and a real mouse."""

import math
from pathlib import Path

import pytest

from sandbox.action import Move, Strike
from sandbox.measure.run.sessions import rerun
from sandbox.window.camera import Camera
from tests.driven.driving import Driven, Play
from tests.driven.looking import differ, laid_out, on_screen
from tests.driven.rooms import written

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


def opened(drive: Play, folder: Path) -> tuple[Driven, Camera]:
    path = written(folder, TABLE)
    return drive("play", str(path)), laid_out(path).camera


def strokes(window: Driven) -> list[Strike]:
    return [action for action in window.session().actions if isinstance(action, Strike)]


def test_mouse_aims_space_shoots_and_z_takes_it_back(drive: Play, tmp_path: Path) -> None:
    window, camera = opened(drive, tmp_path)
    window.mouse(on_screen(camera, (0.8, 0.9)))
    lying = window.settled()
    window.key("space")
    window.wait_until(lambda shot: differ(shot, lying), "the ball rolling")
    (strike,) = strokes(window)
    # A pixel at half a metre
    assert strike.aim == pytest.approx(math.atan2(0.4, 0.3), abs=1.5 / (0.5 * camera.scale))
    session = window.session()
    assert rerun(session).info["state_hash"] == session.state_hash
    window.key("z")
    window.wait_for(lambda: not strokes(window), "the stroke taken back")
    assert window.step_number() == 0


def test_english_and_power_are_set_by_keys_that_are_held(drive: Play, tmp_path: Path) -> None:
    window, camera = opened(drive, tmp_path)
    x, y = on_screen(camera, (0.8, 0.9))
    window.mouse((x, y))
    window.settled()
    for key, way in (("e", (20, -10)), ("x", (0, 40))):
        window.hold(key)
        window.settled()
        x, y = x + way[0], y + way[1]
        window.mouse((x, y))
        window.settled()
        window.let_go(key)
        window.settled()
    window.key("space")
    (strike,) = window.wait_for(lambda: strokes(window), "a stroke")
    assert strike.side > 0.1
    assert strike.height > 0.05
    assert 0.05 <= strike.speed < 2.0
    assert window.session().engine == "exact"  # E was the table's


def test_cue_is_drawn_back_by_the_mouse_and_let_go(drive: Play, tmp_path: Path) -> None:
    window, camera = opened(drive, tmp_path)
    window.drag(on_screen(camera, (0.5, 0.8)), on_screen(camera, (0.5, 0.65)))
    (strike,) = window.wait_for(lambda: strokes(window), "a stroke")
    # Drawn back by 0.15 of the 0.5 m that make 10 m/s; a pixel is 3 mm.
    assert strike.speed == pytest.approx(3.0, abs=0.2)


def test_ball_in_hand_is_put_where_the_mouse_is_clicked(drive: Play, tmp_path: Path) -> None:
    window, camera = opened(drive, tmp_path)
    there = on_screen(camera, (0.3, 0.7))
    window.key("g")
    window.settled()
    window.mouse(there)
    window.settled()
    window.click(there)
    moved = window.wait_for(
        lambda: [action for action in window.session().actions if isinstance(action, Move)], "the ball moved"
    )
    assert moved[-1].position == pytest.approx((0.3, 0.7), abs=1.5 / camera.scale)  # a pixel
