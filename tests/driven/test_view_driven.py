"""Camera, panel, help and overlays, in a real window."""

from pathlib import Path

import pygame
import pytest

from sandbox.window.camera import Camera
from sandbox.window.mouse import ZOOM_PER_NOTCH
from sandbox.window.playback.snapshot import OVERLAYS
from sandbox.window.render.palette import PANEL, SKY
from tests.driven.driving import SIZE, DrivenWindow, OpenWindow, Shot
from tests.driven.looking import are_different, centroid, count_pixels, is_near, on_screen, shows_paused, window_layout
from tests.driven.rooms import AT_REST, RESTING, write_scene

pytestmark = pytest.mark.slow  # a real window in real time

BALL = (-1.0, 0.0)
PANEL_BOX = pygame.Rect(640, 0, 260, 600)
BELOW = pygame.Rect(0, 165, 636, 401)
"""Region below the state display, px."""
WITHIN = 2.0  # px: the mean over the pixels of a disc whose rim is antialiased


def wait_for_ball(window: DrivenWindow, camera: Camera, what: str) -> Shot:
    """Wait until the ball is where a camera projects it."""
    return window.wait_until(lambda shot: is_near(centroid(shot, SKY), on_screen(camera, BALL), WITHIN), what)


def test_wheel_drag_and_home_move_the_camera(drive: OpenWindow, tmp_path: Path) -> None:
    path = write_scene(tmp_path, AT_REST)
    home = window_layout(path).camera
    window = drive("play", str(path))
    first = wait_for_ball(window, home, "the ball")

    ball = on_screen(home, BALL)
    window.wheel(ball, 1)
    zoomed = window.wait_until(lambda shot: count_pixels(shot, SKY) > 1.2 * count_pixels(first, SKY), "a larger ball")
    assert is_near(centroid(zoomed, SKY), on_screen(home, BALL), WITHIN)  # the point under the cursor is fixed
    window.key("Home")
    wait_for_ball(window, home, "the ball at its first position")

    window.wheel((400, 300), -2)
    camera = home.zoomed(ZOOM_PER_NOTCH**-2, (400, 300))
    wait_for_ball(window, camera, "a smaller ball")
    window.drag((400, 300), (440, 330), button=3)
    camera = camera.panned((40, 30))
    wait_for_ball(window, camera, "the ball panned")
    window.key("r", "e")
    window.settled_shot()
    wait_for_ball(window, camera, "the camera kept")


def test_tab_hides_and_shows_the_panel(drive: OpenWindow, tmp_path: Path) -> None:
    path = write_scene(tmp_path, AT_REST)
    home = window_layout(path).camera
    window = drive("play", str(path))
    wait_for_ball(window, home, "the ball")
    assert count_pixels(window.shot(), PANEL, PANEL_BOX) > 50_000
    window.key("Tab")
    window.wait_until(lambda shot: count_pixels(shot, PANEL, PANEL_BOX) < 10_000, "no panel")
    window.key("Tab")
    window.wait_until(lambda shot: count_pixels(shot, PANEL, PANEL_BOX) > 50_000, "the panel")
    wait_for_ball(window, home, "the ball")


def test_f1_and_h_show_help_over_the_picture(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", str(write_scene(tmp_path, AT_REST)), "--paused")
    before = window.wait_until(shows_paused, "PAUSED")
    for key, close in (("F1", "h"), ("h", "F1")):
        window.key(key)
        window.wait_until(lambda shot: count_pixels(shot, SKY) < 0.5 * count_pixels(before, SKY), "help")
        window.key(close)
        window.wait_until(lambda shot: not are_different(shot, before), "the picture")
    window.key("F1")
    window.wait_until(lambda shot: are_different(shot, before), "help")
    window.click((300, 300))
    window.wait_until(lambda shot: not are_different(shot, before), "the picture")


def test_keys_toggle_every_overlay(drive: OpenWindow, tmp_path: Path) -> None:
    path = write_scene(tmp_path, RESTING)
    layout = window_layout(path)
    window = drive("play", str(path), "--paused")
    window.wait_until(shows_paused, "PAUSED")
    window.key(*["o"] * 20)
    window.key("Tab")
    # When the panel has gone, all steps have been made.
    window.wait_until(lambda shot: count_pixels(shot, PANEL, PANEL_BOX) < 10_000, "no panel")
    window.key("Tab")
    before = window.wait_until(lambda shot: count_pixels(shot, PANEL, PANEL_BOX) > 50_000, "the panel")
    for digit, name in zip("1234567890", OVERLAYS, strict=True):
        # The scene has no joints, so their switch is compared; the switches of other overlays may be below the panel.
        box = layout.widgets[name] if name == "joints" else BELOW
        window.key(digit)
        window.wait_until(lambda shot, box=box: are_different(shot, before, box), f"{name} toggled")
        window.key(digit)
        window.wait_until(lambda shot, box=box: not are_different(shot, before, box), f"{name} restored")


def test_clicks_within_one_frame_work_on_switches_and_buttons(drive: OpenWindow, tmp_path: Path) -> None:
    path = write_scene(tmp_path, RESTING)
    widgets = window_layout(path).widgets
    window = drive("play", str(path), "--paused")
    before = window.wait_until(shows_paused, "PAUSED")
    window.click(widgets["velocities"].center)
    window.wait_until(lambda shot: are_different(shot, before), "an arrow")
    window.click(widgets["velocities"].center)
    window.wait_until(lambda shot: not are_different(shot, before), "none")
    window.click(widgets["step"].center)
    window.wait_until(lambda shot: are_different(shot, before), "a step")
    window.click(widgets["step"].center)
    assert window.step_number() == 2
    window.click(widgets["back"].center)
    assert window.step_number() == 1
    window.click(widgets["pause"].center)  # labelled `play` now
    window.wait_until(lambda shot: not shows_paused(shot), "the scene running")


def test_any_size_of_window_is_drawn(drive: OpenWindow, tmp_path: Path) -> None:
    path = write_scene(tmp_path, AT_REST)
    window = drive("play", str(path), "--overlay", "energy", "--overlay", "names")
    home = window_layout(path).camera
    first = wait_for_ball(window, home, "the ball")
    for size in ((200, 150), (20, 10), (1, 1), (1024, 700), SIZE):
        window.resize(*size)
        window.session()
    last = wait_for_ball(window, home, "the ball at the same position")
    assert abs(count_pixels(last, SKY) - count_pixels(first, SKY)) < 20  # rims may be rounded differently
