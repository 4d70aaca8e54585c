"""What is painted on the ground, and pucks that lie on it."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.games.curling.view import GRANITE
from sandbox.scene.errors import SceneError
from sandbox.window.camera import Camera
from sandbox.window.render.palette import RgbColour, hex_colour
from tests.window.render.drawn import CAMERA, at, ball, changed, drawn, frame, scene, sight

ICE, LINE = "#dce7ec", "#b5433c"
SHEET = {"colour": ICE, "points": [[-4, -2], [4, -2], [4, 2], [-4, 2]]}


def painted(*markings: dict, **tables: object) -> np.ndarray:
    return drawn(sight(scene(play={"marking": list(markings)}, **tables)))


def near(seen: RgbColour, colour: str) -> bool:
    """Tell whether a pixel has a colour, but for one of 255: shapes are mixed from it in floats."""
    return all(abs(a - b) <= 1 for a, b in zip(seen, hex_colour(colour), strict=True))


def test_a_polygon_is_filled_and_later_markings_lie_on_it() -> None:
    disc = {"colour": LINE, "position": [1.0, 0.5], "radius": 0.5}
    picture = painted(SHEET, disc)
    assert at(picture, -3.0, 1.5) == hex_colour(ICE)
    assert at(picture, 1.0, 0.5) == hex_colour(LINE)
    assert at(picture, 1.0, 1.2) == hex_colour(ICE)
    assert at(painted(disc, SHEET), 1.0, 0.5) == hex_colour(ICE)


def test_a_ring_and_a_line_are_as_wide_as_they_say() -> None:
    ring = {"colour": LINE, "position": [0, 0], "radius": 2.0, "filled": False, "width": 0.4}
    line = {"colour": LINE, "points": [[-5, 2.5], [5, 2.5]], "filled": False, "width": 0.3}
    picture = painted(ring, line)
    for radius, seen in ((1.7, False), (1.85, True), (2.15, True), (2.3, False)):
        assert near(at(picture, radius, 0.02), LINE) is seen
    for y, seen in ((2.25, False), (2.4, True), (2.6, True), (2.75, False)):
        assert near(at(picture, 3.3, y), LINE) is seen


def test_a_line_that_is_thinner_than_a_pixel_is_seen() -> None:
    picture = painted({"colour": LINE, "points": [[0, -3], [0, 3]], "filled": False})
    # along a column of the grid, which has a line there too: it is redder than that
    column = picture[100, ::7].astype(int)
    assert (column[:, 0] > column[:, 2]).mean() > 0.9


@given(x=st.floats(-9e15, 9e15), y=st.floats(-9e15, 9e15), size=st.floats(1e-9, 1e9), power=st.floats(-12, 9))
def test_no_marking_is_too_far_or_too_large(x: float, y: float, size: float, power: float) -> None:
    camera = Camera((0.0, 0.0), 10.0**power, (40, 30))
    corners = [[x, y], [x + size, y], [-x, -y]]
    markings = [
        {"colour": LINE, "position": [x, y], "radius": size},
        {"colour": LINE, "position": [x, y], "radius": size, "filled": False, "width": size},
        {"colour": LINE, "points": corners},
        {"colour": LINE, "points": corners, "filled": False, "width": size},
    ]
    drawn(sight(scene(play={"marking": markings})), camera)
    disc, bare = (drawn(sight(scene(play={"marking": some})), camera) for some in (markings[:1], []))
    distance, half = math.hypot(x, y), 26.0 / camera.scale  # half a diagonal of 25 pixels, and the smooth edge
    if distance > size + half:
        assert not changed(disc, bare).any()
    if distance + half < size:
        assert changed(disc, bare).mean() > 0.5  # all but the lines of the grid, which is above it


def test_a_puck_is_a_stone_with_a_coloured_top_and_a_handle_that_turns() -> None:
    puck = {**ball(0, 0, 2.0), "colour": "#d0463c"}
    which = scene(balls=[puck], surface={"bodies": "pucks", "sliding_friction": 0.1})
    level = drawn(sight(which))
    assert at(level, 0.0, 1.6) == GRANITE
    assert at(level, 0.2, 1.0) == hex_colour("#d0463c")
    assert sum(at(level, 0.8, 0.0)) > sum(at(level, 0.0, 0.8))  # the handle is paler
    upright = drawn(sight(which, frame=frame(which, angle=np.asarray([math.pi / 2]))))
    assert sum(at(upright, 0.0, 0.8)) > sum(at(upright, 0.8, 0.0))


def test_what_meets_nothing_is_a_ring() -> None:
    mark = {**ball(0, 0, 2.0), "collides": "none", "fixed": True, "colour": "#1f9e89"}
    picture = drawn(sight(scene(balls=[mark], surface={"bodies": "pucks", "sliding_friction": 0.1})))
    bare = drawn(sight(scene()))
    touched = changed(picture, bare)
    column, row = CAMERA.to_screen(np.zeros(2)).astype(int)
    assert not touched[column - 20 : column + 20, row - 20 : row + 20].any()  # 1 m about its middle is free
    assert near(at(picture, 1.95, 0.0), "#1f9e89")
    assert at(picture, 2.5, 0.1) == at(bare, 2.5, 0.1)


@pytest.mark.parametrize(
    ("marking", "words"),
    [
        ({}, "must have either"),
        ({"points": [[0, 0], [1, 1]], "radius": 1.0, "position": [0, 0]}, "must have either"),
        ({"radius": 1.0}, "`position` and `radius`"),
        ({"points": [[0, 0], [1, 1]]}, "at least 3 points"),
        ({"points": [[0, 0]], "filled": False}, "at least 2 points"),
    ],
)
def test_a_marking_that_is_no_shape_is_told(marking: dict, words: str) -> None:
    with pytest.raises(SceneError, match=words):
        scene(play={"marking": [{"colour": ICE, **marking}]})
