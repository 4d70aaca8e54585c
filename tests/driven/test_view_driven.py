"""Camera, panel, help and overlays, in a real window."""

from pathlib import Path

import pygame
import pytest

from sandbox.window.camera import Camera
from sandbox.window.mouse import ZOOM_PER_NOTCH
from sandbox.window.playback.snapshot import OVERLAYS
from sandbox.window.render.palette import PANEL, SKY
from tests.driven.driving import SIZE, Driven, Play, Shot
from tests.driven.looking import count, differ, laid_out, middle, near, on_screen, paused
from tests.driven.rooms import AT_REST, RESTING, written

pytestmark = pytest.mark.slow  # a real window in real time

BALL = (-1.0, 0.0)
PANEL_BOX = pygame.Rect(640, 0, 260, 600)
BELOW = pygame.Rect(0, 165, 636, 401)
"""The picture below what is told in words."""
WITHIN = 2.0  # px: the mean over the pixels of a disc whose rim is antialiased


def seen_at(window: Driven, camera: Camera, what: str) -> Shot:
    """Wait until the ball is where a camera shows it."""
    return window.wait_until(lambda shot: near(middle(shot, SKY), on_screen(camera, BALL), WITHIN), what)


def test_wheel_drag_and_home_move_the_camera(drive: Play, tmp_path: Path) -> None:
    path = written(tmp_path, AT_REST)
    home = laid_out(path).camera
    window = drive("play", str(path))
    first = seen_at(window, home, "the ball")

    ball = on_screen(home, BALL)
    window.wheel(ball, 1)
    closer = window.wait_until(lambda shot: count(shot, SKY) > 1.2 * count(first, SKY), "a larger ball")
    assert near(middle(closer, SKY), on_screen(home, BALL), WITHIN)  # what is under the cursor stays there
    window.key("Home")
    seen_at(window, home, "the ball as at first")

    window.wheel((400, 300), -2)
    camera = home.zoomed(ZOOM_PER_NOTCH**-2, (400, 300))
    seen_at(window, camera, "a smaller ball")
    window.drag((400, 300), (440, 330), button=3)
    camera = camera.panned((40, 30))
    seen_at(window, camera, "the ball panned")
    window.key("r", "e")
    window.settled()
    seen_at(window, camera, "the camera kept")


def test_tab_hides_the_panel_and_the_scene_takes_its_room(drive: Play, tmp_path: Path) -> None:
    path = written(tmp_path, AT_REST)
    home = laid_out(path).camera
    window = drive("play", str(path))
    seen_at(window, home, "the ball")
    assert count(window.shot(), PANEL, PANEL_BOX) > 50_000
    window.key("Tab")
    window.wait_until(lambda shot: count(shot, PANEL, PANEL_BOX) < 10_000, "no panel")
    window.key("Tab")
    window.wait_until(lambda shot: count(shot, PANEL, PANEL_BOX) > 50_000, "the panel")
    seen_at(window, home, "the ball")


def test_f1_and_h_show_help_over_the_picture(drive: Play, tmp_path: Path) -> None:
    window = drive("play", str(written(tmp_path, AT_REST)), "--paused")
    before = window.wait_until(paused, "PAUSED")
    for key, close in (("F1", "h"), ("h", "F1")):
        window.key(key)
        window.wait_until(lambda shot: count(shot, SKY) < 0.5 * count(before, SKY), "help")
        window.key(close)
        window.wait_until(lambda shot: not differ(shot, before), "the picture")
    window.key("F1")
    window.wait_until(lambda shot: differ(shot, before), "help")
    window.click((300, 300))
    window.wait_until(lambda shot: not differ(shot, before), "the picture")


def test_keys_toggle_every_overlay(drive: Play, tmp_path: Path) -> None:
    path = written(tmp_path, RESTING)
    laid = laid_out(path)
    window = drive("play", str(path), "--paused")
    window.wait_until(paused, "PAUSED")
    window.key(*["o"] * 20)
    window.key("Tab")
    window.wait_until(lambda shot: count(shot, PANEL, PANEL_BOX) < 10_000, "no panel")  # so all steps were made
    window.key("Tab")
    before = window.wait_until(lambda shot: count(shot, PANEL, PANEL_BOX) > 50_000, "the panel")
    for digit, name in zip("1234567890", OVERLAYS, strict=True):
        # There are no joints to be seen yet; the switch of another one lies below the panel's end.
        box = laid.widgets[name] if name == "joints" else BELOW
        window.key(digit)
        window.wait_until(lambda shot, box=box: differ(shot, before, box), f"{name} the other way")
        window.key(digit)
        window.wait_until(lambda shot, box=box: not differ(shot, before, box), f"{name} as before")


def test_switches_and_buttons_are_clicked_within_one_picture(drive: Play, tmp_path: Path) -> None:
    path = written(tmp_path, RESTING)
    widgets = laid_out(path).widgets
    window = drive("play", str(path), "--paused")
    before = window.wait_until(paused, "PAUSED")
    window.click(widgets["velocities"].center)
    window.wait_until(lambda shot: differ(shot, before), "an arrow")
    window.click(widgets["velocities"].center)
    window.wait_until(lambda shot: not differ(shot, before), "none")
    window.click(widgets["step"].center)
    window.wait_until(lambda shot: differ(shot, before), "a step")
    window.click(widgets["step"].center)
    assert window.step_number() == 2
    window.click(widgets["back"].center)
    assert window.step_number() == 1
    window.click(widgets["pause"].center)  # which is `play` now
    window.wait_until(lambda shot: not paused(shot), "it running")


def test_any_size_of_window_is_drawn(drive: Play, tmp_path: Path) -> None:
    path = written(tmp_path, AT_REST)
    window = drive("play", str(path), "--overlay", "energy", "--overlay", "names")
    home = laid_out(path).camera
    first = seen_at(window, home, "the ball")
    for size in ((200, 150), (20, 10), (1, 1), (1024, 700), SIZE):
        window.resize(*size)
        window.session()
    last = seen_at(window, home, "the ball where it was")
    assert abs(count(last, SKY) - count(first, SKY)) < 20  # rims may be rounded otherwise
