"""Zones are tinted areas below bodies; what is on other layers lies above the ground's bodies and shines through."""

from typing import Any

import numpy as np
import pytest

from sandbox.trajectory import Contacts
from sandbox.window.hit_test import overlapping_bodies
from sandbox.window.render.palette import BACKGROUND, SOLID
from tests.window.render.drawn import at, ball, drawn, frame, scene, sight

ZONES: dict[str, tuple[dict[str, Any], tuple[float, float], tuple[float, float]]] = {
    "circle": ({"position": [0, 0], "radius": 1.5}, (0.5, 0.5), (1.3, 1.3)),
    "strip": ({"points": [[-3, 0], [3, 0], [3, 2]], "thickness": 0.8}, (3.2, 0.2), (2.0, 1.0)),
    "polygon": ({"points": [[-2, -2], [2, -2], [2, 2], [0.1, -1], [-2, 2]]}, (-1.5, -0.5), (0.1, 1.0)),
}
"""a zone, a place in it, and one beside it"""


@pytest.mark.parametrize("antialias", [True, False])
@pytest.mark.parametrize("shape", ZONES)
def test_zone_is_tinted_inside_and_not_outside(shape: str, antialias: bool) -> None:
    zone, inside, outside = ZONES[shape]
    plain = drawn(sight(scene(balls=[ball(9, 9)])), antialias=antialias)
    picture = drawn(sight(scene(balls=[ball(9, 9)], zone=[{**zone, "colour": "#ff0000"}])), antialias=antialias)
    red, green, blue = (np.asarray(at(picture, *inside), int) - np.asarray(at(plain, *inside), int)).tolist()
    assert red > 15  # of 255: to be seen,
    assert red < 60  # but faintly
    assert green <= 0
    assert blue <= 0
    assert at(picture, *outside) == at(plain, *outside)


def test_zones_lie_below_bodies() -> None:
    balls = [ball(0.0, 0.0, 1.0, colour="#123456")]
    assert at(drawn(sight(scene(balls=balls, zone=[{"position": [0, 0], "radius": 2}]))), 0.0, 0.0) == (18, 52, 86)


def test_far_zones_and_far_cameras_are_drawn_too() -> None:
    zones = [{"position": [1e15, 0], "radius": 1e9}, {"points": [[-1e15, 0], [1e15, 1]], "thickness": 1e8}]
    picture = drawn(sight(scene(balls=[ball(0, 0)], zone=zones)))
    assert at(picture, 3.0, 2.0) != BACKGROUND


def test_walls_of_other_layers_lie_above_the_ground_and_shine_through() -> None:
    red = ball(0.0, 0.0, 1.0, colour="#ff0000")
    wall = {"points": [[-3, 0], [3, 0]], "thickness": 1.0}
    seen = {}
    for name, layers, layer in (
        ("below", ["ground"], "ground"),
        ("over it", ["up"], "ground"),
        ("beside it", ["up"], "up"),
    ):
        picture = drawn(sight(layered := scene(balls=[{**red, "layer": layer}], wall=[{**wall, "layers": layers}])))
        known = frame(layered, layer=layered.bodies.layer)
        picture = drawn(sight(layered, frame=known))
        seen[name] = at(picture, 0.0, 0.0)
    assert seen["below"] == seen["beside it"] == (255, 0, 0)
    assert SOLID[0] < seen["over it"][0] < 255
    assert seen["over it"][1] > 0


def test_notes_of_zones_are_no_contacts_to_be_drawn() -> None:
    noted = scene(balls=[ball(0, 0)], zone=[{"position": [0, 0], "radius": 2}])
    assert (drawn(sight(noted, "contacts", contacts=Contacts.none())) == drawn(sight(noted, "contacts"))).all()


def test_who_lies_over_another_on_another_layer_overlaps_nothing() -> None:
    balls = [ball(0, 0), {**ball(0.5, 0), "layer": "up"}, ball(3, 0), ball(3.5, 0)]
    layered = scene(balls=balls, wall=[{"points": [[-1, 0], [1, 0]], "layers": ["up"]}])
    known = frame(layered, layer=layered.bodies.layer)
    assert overlapping_bodies(layered, layered.bodies, known).tolist() == [False, True, True, True]
