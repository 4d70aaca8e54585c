"""Drawing of zones as tinted areas below bodies, and of other layers as translucent shapes above the ground."""

from typing import Any

import numpy as np
import pytest

from sandbox.trajectory import Contacts
from sandbox.window.hit_test import overlapping_bodies
from sandbox.window.render.palette import BACKGROUND, SOLID
from tests.window.render.drawn import ball, changed_pixels, colour_at, contact, frame, render, scene, snapshot

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


def test_zones_are_drawn_below_bodies() -> None:
    balls = [ball(0.0, 0.0, 1.0, colour="#123456")]
    picture = render(snapshot(scene(balls=balls, zone=[{"position": [0, 0], "radius": 2}])))
    assert colour_at(picture, 0.0, 0.0) == (18, 52, 86)


def test_distant_and_large_zones_are_drawn() -> None:
    zones = [{"position": [1e15, 0], "radius": 1e9}, {"points": [[-1e15, 0], [1e15, 1]], "thickness": 1e8}]
    picture = render(snapshot(scene(balls=[ball(0, 0)], zone=zones)))
    assert colour_at(picture, 3.0, 2.0) != BACKGROUND


def test_walls_of_other_layers_are_translucent_above_the_ground() -> None:
    red = ball(0.0, 0.0, 1.0, colour="#ff0000")
    wall = {"points": [[-3, 0], [3, 0]], "thickness": 1.0}
    colours = {}
    for name, layers, layer in (
        ("below", ["ground"], "ground"),
        ("over it", ["up"], "ground"),
        ("beside it", ["up"], "up"),
    ):
        picture = render(snapshot(layered := scene(balls=[{**red, "layer": layer}], wall=[{**wall, "layers": layers}])))
        state = frame(layered, layer=layered.bodies.layer)
        picture = render(snapshot(layered, frame=state))
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
