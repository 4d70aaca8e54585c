"""The scene editor by mouse and keys in a real window: draw, run, return, save, and recover after a crash."""

import signal
from pathlib import Path

import numpy as np
import pytest

from sandbox.scene.files.load import load
from sandbox.window.app import EMPTY_VIEW
from sandbox.window.camera import Camera
from sandbox.window.render.palette import ORANGE, SKY
from sandbox.window.ui.panel import PANEL_WIDTH
from sandbox.window.ui.timeline import TIMELINE_HEIGHT
from tests.driven.driving import SIZE, DrivenWindow, OpenWindow, Shot
from tests.driven.looking import colour_at, count_pixels

pytestmark = pytest.mark.slow  # a real window in real time

CAMERA = Camera.fitting(EMPTY_VIEW, SIZE, inset=PANEL_WIDTH, foot=TIMELINE_HEIGHT)
"""View of a new scene."""


def on_screen(x: float, y: float) -> tuple[float, float]:
    column, row = CAMERA.to_screen(np.asarray((x, y))).tolist()
    return column, row


def is_drawn(shot: Shot, colour: tuple[int, int, int], area: float) -> bool:
    """Tell whether a colour covers about an area, m², of the picture left of the panel."""
    found = count_pixels(shot[:, 60 : SIZE[0] - PANEL_WIDTH], colour)
    return 0.5 * area * CAMERA.scale**2 < found < 1.6 * area * CAMERA.scale**2  # edges and marks cover some of it


def draw_box(window: DrivenWindow) -> None:
    window.key("x")
    window.drag(on_screen(-1.0, 1.0), on_screen(1.0, 2.0))
    window.wait_until(lambda shot: is_drawn(shot, SKY, 2.0), "a box")


def test_scene_is_drawn_run_edited_and_saved(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", "--edit")
    draw_box(window)
    window.key("b")
    window.drag(on_screen(0.0, 3.6), on_screen(0.6, 3.6))
    window.wait_until(lambda shot: is_drawn(shot, SKY, 1.1), "a ball, which has the first colour now")
    window.wait_until(lambda shot: is_drawn(shot, ORANGE, 2.0), "the box in the second colour")
    window.key("space")
    on_ground = on_screen(0.8, 0.2)  # a place that the box reaches when it falls
    window.wait_until(lambda shot: colour_at(shot, on_ground) == ORANGE, "a box that has fallen")
    window.key("ctrl+e")
    window.wait_until(lambda shot: is_drawn(shot, SKY, 1.1) and is_drawn(shot, ORANGE, 2.0), "the scene as edited")
    window.key("ctrl+s")
    window.key("ctrl+a")
    window.type("drawn")
    window.key("Return")
    path = tmp_path / "drawn.toml"
    window.wait_for(path.exists, "the saved file")
    scene = load(path)
    pixel = 1.0 / CAMERA.scale
    assert scene.boxes[0].size == pytest.approx((2.0, 1.0), abs=2 * pixel)
    assert scene.balls[0].position == pytest.approx((0.0, 3.6), abs=2 * pixel)  # the grid is 0.2 m
    window.wait_for(lambda: any("saved" in line for line in window.stdout_lines()), "a line on the terminal")
    window.key("Escape")  # the ball is selected
    window.key("Escape")  # the tool
    window.key("Escape")
    assert window.exit_status() == 0
    assert [each.name for each in tmp_path.iterdir() if "autosave" in each.name] == []


def test_unsaved_changes_are_offered_after_a_crash(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", "--edit")
    draw_box(window)
    window.wait_for(lambda: list(tmp_path.glob(".*.autosave")), "an autosave")
    window.process.send_signal(signal.SIGKILL)
    window.process.wait()
    again = drive("play", "--edit")
    again.key("Return")
    again.wait_until(lambda shot: is_drawn(shot, SKY, 2.0), "the box again")
