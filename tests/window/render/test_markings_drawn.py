"""Drawing of markings on the ground, pucks, zones below bodies, and other layers above the ground."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.games.curling.view import GRANITE
from sandbox.scene.errors import SceneError
from sandbox.trajectory import Contacts
from sandbox.window.camera import Camera
from sandbox.window.hit_test import overlapping_bodies
from sandbox.window.render.palette import BACKGROUND, SOLID, RgbColour, hex_colour
from tests.window.render.drawn import CAMERA, ball, changed_pixels, colour_at, contact, frame, render, scene, snapshot

ICE, LINE = "#dce7ec", "#b5433c"
SHEET = {"colour": ICE, "points": [[-4, -2], [4, -2], [4, 2], [-4, 2]]}


def render_markings(*markings: dict, **tables: object) -> np.ndarray:
    return render(snapshot(scene(play={"marking": list(markings)}, **tables)))


def is_close(pixel: RgbColour, colour: str) -> bool:
    """Return whether a pixel has a colour within 1 of 255, as shapes are mixed in floats."""
    return all(abs(a - b) <= 1 for a, b in zip(pixel, hex_colour(colour), strict=True))


def test_polygon_is_filled_and_later_markings_are_drawn_over_it() -> None:
    disc = {"colour": LINE, "position": [1.0, 0.5], "radius": 0.5}
    picture = render_markings(SHEET, disc)
    assert colour_at(picture, -3.0, 1.5) == hex_colour(ICE)
    assert colour_at(picture, 1.0, 0.5) == hex_colour(LINE)
    assert colour_at(picture, 1.0, 1.2) == hex_colour(ICE)
    assert colour_at(render_markings(disc, SHEET), 1.0, 0.5) == hex_colour(ICE)


def test_ring_and_line_have_the_stated_width() -> None:
    ring = {"colour": LINE, "position": [0, 0], "radius": 2.0, "filled": False, "width": 0.4}
    line = {"colour": LINE, "points": [[-5, 2.5], [5, 2.5]], "filled": False, "width": 0.3}
    picture = render_markings(ring, line)
    for radius, is_painted in ((1.7, False), (1.85, True), (2.15, True), (2.3, False)):
        assert is_close(colour_at(picture, radius, 0.02), LINE) is is_painted
    for y, is_painted in ((2.25, False), (2.4, True), (2.6, True), (2.75, False)):
        assert is_close(colour_at(picture, 3.3, y), LINE) is is_painted


def test_line_thinner_than_a_pixel_is_visible() -> None:
    picture = render_markings({"colour": LINE, "points": [[0, -3], [0, 3]], "filled": False})
    # The column also has a grid line; the marking is redder than the grid.
    column = picture[100, ::7].astype(int)
    assert (column[:, 0] > column[:, 2]).mean() > 0.9


@pytest.mark.fail_slow(60)  # takes over half a second
@given(x=st.floats(-9e15, 9e15), y=st.floats(-9e15, 9e15), size=st.floats(1e-9, 1e9), power=st.floats(-12, 9))
def test_markings_of_any_position_and_size_are_drawn(x: float, y: float, size: float, power: float) -> None:
    camera = Camera((0.0, 0.0), 10.0**power, (40, 30))
    corners = [[x, y], [x + size, y], [-x, -y]]
    markings = [
        {"colour": LINE, "position": [x, y], "radius": size},
        {"colour": LINE, "position": [x, y], "radius": size, "filled": False, "width": size},
        {"colour": LINE, "points": corners},
        {"colour": LINE, "points": corners, "filled": False, "width": size},
    ]
    render(snapshot(scene(play={"marking": markings})), camera)
    disc, bare = (render(snapshot(scene(play={"marking": some})), camera) for some in (markings[:1], []))
    distance, half = math.hypot(x, y), 26.0 / camera.scale  # half a diagonal of 25 pixels, and the smooth edge
    if distance > size + half:
        assert not changed_pixels(disc, bare).any()
    if distance + half < size:
        assert changed_pixels(disc, bare).mean() > 0.5  # all pixels except the grid lines above it


def test_puck_has_a_coloured_top_and_a_rotating_handle() -> None:
    puck = {**ball(0, 0, 2.0), "colour": "#d0463c"}
    model = scene(balls=[puck], surface={"bodies": "pucks", "sliding_friction": 0.1})
    level = render(snapshot(model))
    assert colour_at(level, 0.0, 1.6) == GRANITE
    assert colour_at(level, 0.2, 1.0) == hex_colour("#d0463c")
    assert sum(colour_at(level, 0.8, 0.0)) > sum(colour_at(level, 0.0, 0.8))  # the handle is paler
    upright = render(snapshot(model, frame=frame(model, angle=np.asarray([math.pi / 2]))))
    assert sum(colour_at(upright, 0.0, 0.8)) > sum(colour_at(upright, 0.8, 0.0))


def test_body_without_collisions_is_drawn_as_a_ring() -> None:
    mark = {**ball(0, 0, 2.0), "collides": "none", "fixed": True, "colour": "#1f9e89"}
    picture = render(snapshot(scene(balls=[mark], surface={"bodies": "pucks", "sliding_friction": 0.1})))
    bare = render(snapshot(scene()))
    ring_pixels = changed_pixels(picture, bare)
    column, row = CAMERA.to_screen(np.zeros(2)).astype(int)
    assert not ring_pixels[column - 20 : column + 20, row - 20 : row + 20].any()  # within 1 m of its centre
    assert is_close(colour_at(picture, 1.95, 0.0), "#1f9e89")
    assert colour_at(picture, 2.5, 0.1) == colour_at(bare, 2.5, 0.1)


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
def test_invalid_marking_is_an_error(marking: dict, words: str) -> None:
    with pytest.raises(SceneError, match=words):
        scene(play={"marking": [{"colour": ICE, **marking}]})


ZONES: dict[str, tuple[dict[str, Any], tuple[float, float], tuple[float, float]]] = {
    "circle": ({"position": [0, 0], "radius": 1.5}, (0.5, 0.5), (1.3, 1.3)),
    "strip": ({"points": [[-3, 0], [3, 0], [3, 2]], "thickness": 0.8}, (3.2, 0.2), (2.0, 1.0)),
    "polygon": ({"points": [[-2, -2], [2, -2], [2, 2], [0.1, -1], [-2, 2]]}, (-1.5, -0.5), (0.1, 1.0)),
}
"""A zone, a point inside it, and a point outside."""


@pytest.mark.parametrize("antialias", [True, False])
@pytest.mark.parametrize("shape", ZONES)
def test_zone_is_tinted_inside_and_not_outside(shape: str, antialias: bool) -> None:
    zone, inside, outside = ZONES[shape]
    plain = render(snapshot(scene(balls=[ball(9, 9)])), antialias=antialias)
    picture = render(snapshot(scene(balls=[ball(9, 9)], zone=[{**zone, "colour": "#ff0000"}])), antialias=antialias)
    red, green, blue = (
        np.asarray(colour_at(picture, *inside), int) - np.asarray(colour_at(plain, *inside), int)
    ).tolist()
    assert red > 15  # of 255: visible,
    assert red < 60  # but faint
    assert green <= 0
    assert blue <= 0
    assert colour_at(picture, *outside) == colour_at(plain, *outside)


def test_distant_and_large_zones_are_drawn_below_bodies() -> None:
    zones = [{"position": [1e15, 0], "radius": 1e9}, {"points": [[-1e15, 0], [1e15, 1]], "thickness": 1e8}]
    picture = render(snapshot(scene(balls=[ball(0.0, 0.0, 1.0, colour="#123456")], zone=zones)))
    assert colour_at(picture, 3.0, 2.0) != BACKGROUND
    assert colour_at(picture, 0.0, 0.0) == (18, 52, 86)


def test_walls_of_other_layers_are_translucent_above_the_ground() -> None:
    red = ball(0.0, 0.0, 1.0, colour="#ff0000")
    wall = {"points": [[-3, 0], [3, 0]], "thickness": 1.0}
    colours = {}
    for name, layers, layer in (
        ("below", ["ground"], "ground"),
        ("over it", ["up"], "ground"),
        ("beside it", ["up"], "up"),
    ):
        layered = scene(balls=[{**red, "layer": layer}], wall=[{**wall, "layers": layers}])
        picture = render(snapshot(layered, frame=frame(layered, layer=layered.bodies.layer)))
        colours[name] = colour_at(picture, 0.0, 0.0)
    assert colours["below"] == colours["beside it"] == (255, 0, 0)
    assert SOLID[0] < colours["over it"][0] < 255
    assert colours["over it"][1] > 0


def test_zone_entries_are_not_drawn_as_contacts() -> None:
    wall = {"points": [[-3, -1], [3, -1]]}
    with_zone = scene(balls=[ball(0, 0)], wall=[wall], zone=[{"position": [0, 0], "radius": 2}])
    assert with_zone.fixed_names == ("wall-1", "zone-1")
    pictures = [
        render(snapshot(with_zone, "contacts", contacts=contacts))
        for contacts in (Contacts.none(), contact((0, -2), (0.0, 0.0), (0.0, -1.0)), contact((0, -1), (0, -1), (0, -1)))
    ]
    assert not changed_pixels(pictures[0], pictures[1]).any()
    assert changed_pixels(pictures[0], pictures[2]).any()


def test_bodies_on_different_layers_do_not_overlap() -> None:
    balls = [ball(0, 0), {**ball(0.5, 0), "layer": "up"}, ball(3, 0), ball(3.5, 0)]
    layered = scene(balls=balls, wall=[{"points": [[-1, 0], [1, 0]], "layers": ["up"]}])
    state = frame(layered, layer=layered.bodies.layer)
    assert overlapping_bodies(layered, layered.bodies, state).tolist() == [False, True, True, True]
