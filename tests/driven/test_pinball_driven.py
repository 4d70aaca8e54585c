"""Pinball in a real window: real keys flip and plunge, and the session that is kept is the same game again."""

from pathlib import Path

import pygame
import pytest

from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.scene.description.forces import AnyDrive
from sandbox.scene.files.load import load
from sandbox.window.render.palette import hex_colour
from tests.driven.driving import Driven, Play
from tests.driven.looking import count, laid_out, middle, on_screen

pytestmark = pytest.mark.slow  # a real window in real time

CLASSIC = Path(__file__).parents[2] / "scenes" / "pinball" / "classic.toml"
COLOUR = hex_colour("#f2c230")
"""of the bats"""
WHOLE = 120
"""pixels of a bat that nothing covers, at least; it has 141 within its edge"""
SEEN = 6.0
"""px, by which the middle of a bat goes up at least: its way is about twice that"""


def bat(side: str) -> tuple[AnyDrive, int, pygame.Rect]:
    """Return the drive of a bat, its number, and the part of the picture in which it moves."""
    scene, camera = load(CLASSIC), laid_out(CLASSIC).camera
    drive = next(each for each in scene.drives if each.name == f"{side} flipper")
    number = scene.bodies.names.index(drive.body)
    assert drive.pivot is not None
    reach = 2.2 * float(scene.bodies.radius[number]) * camera.scale
    box = pygame.Rect(0, 0, round(2 * reach), round(2 * reach))
    box.center = round(on_screen(camera, drive.pivot)[0]), round(on_screen(camera, drive.pivot)[1])
    axis = round(on_screen(camera, (0.236, 0.0))[0])  # each on its side of the table
    half = pygame.Rect(0, 0, axis, 600) if side == "left" else pygame.Rect(axis, 0, 636 - axis, 600)
    return drive, number, box.clip(half)


def height(window: Driven, box: pygame.Rect) -> float:
    """Return how high up the bat is seen, px below the top."""
    return middle(window.shot(), COLOUR, box)[1]


def later(window: Driven) -> Recording:
    """Return the session half a second of the game from now."""
    now = window.session().duration
    return window.wait_for(lambda: each if (each := window.session()).duration > now + 0.5 else None, "half a second")


def test_keys_flip_and_plunge_and_the_session_is_the_same_game_again(drive: Play) -> None:
    left, number, box = bat("left")
    _, other, other_box = bat("right")
    window = drive("play", str(CLASSIC))
    window.key("space")
    # At first messages lie over them.
    window.wait_until(
        lambda shot: all(count(shot, COLOUR, each) > WHOLE for each in (box, other_box)), "both bats, uncovered"
    )
    rest, still = height(window, box), height(window, other_box)
    window.hold("Shift_L")
    window.wait_for(lambda: height(window, box) < rest - SEEN, "the left bat, up")
    assert height(window, other_box) == pytest.approx(still, abs=1.0)  # the right one has not moved
    window.let_go("Shift_L")
    window.wait_for(lambda: height(window, box) > rest - 1.0, "the left bat, down")

    window.hold("Return")
    later(window)  # it is drawn by much of its way
    window.let_go("Return")
    session = later(window)
    presses = [(press.control, press.value > 0.0) for press in session.presses]
    assert presses == [("left flipper", True), ("left flipper", False), ("plunger", True), ("plunger", False)]

    run = rerun(session)
    assert (run.info["state_hash"], run.info["game"]["score"]) == (session.state_hash, session.score)
    assert run.info["game"]["otherwise"] is None
    begin, end = left.stops or (0.0, 0.0)
    swing = run.angle[:, number] - run.angle[0, number]
    assert abs(swing).max() == pytest.approx(abs(end - begin), abs=0.1)  # up to its stop, but for a bounce
    assert abs(run.angle[:, other] - run.angle[0, other]).max() < 0.05
    y = run.position[:, load(CLASSIC).bodies.names.index("ball"), 1]
    assert y.min() < y[0] - 0.005  # followed the plunger down
    assert y.max() > y[0] + 0.02  # and was driven up the lane
