"""Friction of elements that are drawn."""

import tomllib
from typing import Any

import numpy as np
import pygame
import pytest

from sandbox.engines.registry import able
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.editing.draft import NEW_SCENE
from sandbox.scene.files.load import from_document
from sandbox.window.editor.draw_gestures import BODY_TABLES, FRICTION, STATIC_TABLES, has_friction
from tests.window.editor.hand import BALL, OpenOn

SHAPES: dict[str, dict[str, Any]] = {
    "ball": {"position": [0.0, 9.0], "radius": 0.5},
    "box": {"position": [2.0, 9.0], "size": [1.0, 1.0]},
    "capsule": {"position": [4.0, 9.0], "length": 1.0, "radius": 0.2},
    "polygon": {"position": [6.0, 9.0], "points": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]},
    "plane": {"point": [0.0, -5.0], "normal": [0.0, 1.0]},
    "wall": {"points": [[-5.0, 0.0], [-5.0, 5.0]]},
    "post": {"position": [-8.0, 2.0], "radius": 0.5},
    "zone": {"position": [0.0, 20.0], "radius": 1.0, "gravity": [0.0, 1.0]},
}


def add_new(document: dict[str, Any], table: str, number: int) -> dict[str, Any]:
    """Add a new element to a scene, as the editor does, and return its keys."""
    keys = {"friction": FRICTION} if has_friction(from_document(document), table) else {}
    document[table] = [*document.get(table, []), {"name": f"new {number}", **SHAPES[table], **keys}]
    return keys


def frictions(scene: Scene) -> list[list[float]]:
    """Return the friction of each pair of bodies, and of each body with each static element."""
    table = contact_matrix(scene).surfaces
    return table.friction[table.of_body][:, [*table.of_body, *table.of_fixed]].tolist()


@pytest.mark.parametrize("one", BODY_TABLES)
@pytest.mark.parametrize("other", [*BODY_TABLES, *STATIC_TABLES])
def test_new_elements_of_a_new_scene_have_a_friction_of_a_half(one: str, other: str) -> None:
    document = tomllib.loads(NEW_SCENE)
    for number, table in enumerate((one, other)):
        add_new(document, table, number)
    scene = from_document(document)
    assert all(value == pytest.approx(0.5, abs=1e-4) for row in frictions(scene) for value in row)  # 0.7071²
    assert {"pymunk", "box2d", "reference"} <= set(able(scene))


@pytest.mark.parametrize("table", [*BODY_TABLES, *STATIC_TABLES])
@pytest.mark.parametrize(
    ("bodies", "stated"),
    [
        ({"ball": [SHAPES["ball"]], "plane": [SHAPES["plane"] | {"friction": 0.5}]}, False),
        ({"ball": [SHAPES["ball"]], "box": [SHAPES["box"] | {"friction": 0.3}]}, True),
        ({"ball": [SHAPES["ball"] | {"material": "felt"}], "material": [{"name": "felt", "friction": 0.4}]}, True),
        ({"ball": [SHAPES["ball"] | {"material": "felt"}], "material": [{"name": "felt"}]}, False),
        ({"plane": [SHAPES["plane"] | {"friction": 0.0}]}, True),
    ],
)
def test_new_element_states_a_friction_if_a_body_does_or_there_is_none(
    bodies: dict[str, Any], stated: bool, table: str
) -> None:
    assert add_new(dict(bodies), table, 0) == ({"friction": FRICTION} if stated else {})


def test_element_of_a_table_for_cues_states_no_friction() -> None:
    document = {"surface": {"sliding_friction": 0.2, "rolling_friction": 0.01}, "world": {"gravity": [0.0, 0.0]}}
    assert all(add_new(document, table, k) == {} for k, table in enumerate(("ball", "wall", "post")))


def test_drawn_boxes_rub_on_the_ground_and_on_each_other_and_frictionless_scenes_stay_so(open_on: OpenOn) -> None:
    hand = open_on(None)
    for height in (0.0, 1.0):
        hand.key(pygame.K_x)
        hand.drag((0.0, height), (2.0, height + 1.0))
    assert [box.friction for box in hand.scene.boxes] == [FRICTION, FRICTION]
    assert frictions(hand.scene) == pytest.approx(np.full((2, 3), 0.5), abs=1e-4)  # 0.7071²
    hand = open_on(BALL)
    hand.key(pygame.K_x)
    hand.drag((0.5, 1.5), (1.5, 2.5))
    assert (hand.scene.boxes[0].friction, hand.scene.boxes[0].material) == (None, None)
