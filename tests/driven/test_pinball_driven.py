"""Pinball in a real window: keys flip and plunge, and the recorded session replays the same game."""

from pathlib import Path

import pygame
import pytest

from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.scene.description.forces import AnyDrive
from sandbox.scene.files.load import load
from sandbox.window.render.palette import hex_colour
from tests.driven.driving import DrivenWindow, OpenWindow
from tests.driven.looking import centroid, count_pixels, on_screen, window_layout

pytestmark = pytest.mark.slow  # a real window in real time

CLASSIC = Path(__file__).parents[2] / "scenes" / "pinball" / "classic.toml"
COLOUR = hex_colour("#f2c230")
"""Colour of the flippers."""
UNCOVERED = 120
"""Least number of pixels of a flipper that nothing covers; it has 141 within its edge."""
MIN_RISE = 6.0
"""Least rise of the centroid of a flipper, px; its full travel is about twice that."""


def find_flipper(side: str) -> tuple[AnyDrive, int, pygame.Rect]:
    """Return the drive of a flipper, the index of its body, and the part of the picture in which it moves."""
    scene, camera = load(CLASSIC), window_layout(CLASSIC).camera
    drive = next(each for each in scene.drives if each.name == f"{side} flipper")
    index = scene.bodies.names.index(drive.body)
    assert drive.pivot is not None
    reach = 2.2 * float(scene.bodies.radius[index]) * camera.scale
    box = pygame.Rect(0, 0, round(2 * reach), round(2 * reach))
    box.center = round(on_screen(camera, drive.pivot)[0]), round(on_screen(camera, drive.pivot)[1])
    axis = round(on_screen(camera, (0.236, 0.0))[0])  # the axis of the table separates the two
    half = pygame.Rect(0, 0, axis, 600) if side == "left" else pygame.Rect(axis, 0, 636 - axis, 600)
    return drive, index, box.clip(half)


def height(window: DrivenWindow, box: pygame.Rect) -> float:
    """Return the height of a flipper in the picture, px below the top."""
    return centroid(window.shot(), COLOUR, box)[1]


def session_later(window: DrivenWindow) -> Recording:
    """Return the session after another half second of the game."""
    now = window.session().duration
    return window.wait_for(lambda: each if (each := window.session()).duration > now + 0.5 else None, "half a second")


def test_keys_flip_and_plunge_and_the_session_replays_the_same_game(drive: OpenWindow) -> None:
    left, index, box = find_flipper("left")
    _, other, other_box = find_flipper("right")
    window = drive("play", str(CLASSIC))
    window.key("space")
    # Messages cover them at first.
    window.wait_until(
        lambda shot: all(count_pixels(shot, COLOUR, each) > UNCOVERED for each in (box, other_box)),
        "both flippers, uncovered",
    )
    rest, still = height(window, box), height(window, other_box)
    window.hold("Shift_L")
    window.wait_for(lambda: height(window, box) < rest - MIN_RISE, "the left flipper, up")
    assert height(window, other_box) == pytest.approx(still, abs=1.0)  # the right one has not moved
    window.release_key("Shift_L")
    window.wait_for(lambda: height(window, box) > rest - 1.0, "the left flipper, down")

    window.hold("Return")
    session_later(window)  # the plunger is drawn back by much of its travel
    window.release_key("Return")
    session = session_later(window)
    presses = [(press.control, press.value > 0.0) for press in session.presses]
    assert presses == [("left flipper", True), ("left flipper", False), ("plunger", True), ("plunger", False)]

    run = rerun(session)
    assert (run.info["state_hash"], run.info["game"]["score"]) == (session.state_hash, session.score)
    assert run.info["game"]["otherwise"] is None
    begin, end = left.stops or (0.0, 0.0)
    swing = run.angle[:, index] - run.angle[0, index]
    # Up to its stop; the tolerance allows a rebound between two samples.
    assert abs(swing).max() == pytest.approx(abs(end - begin), abs=0.1)
    assert abs(run.angle[:, other] - run.angle[0, other]).max() < 0.05
    y = run.position[:, load(CLASSIC).bodies.names.index("ball"), 1]
    assert y.min() < y[0] - 0.005  # the ball followed the plunger down
    assert y.max() > y[0] + 0.02  # and was driven up the lane
