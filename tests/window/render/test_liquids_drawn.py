"""Drawing of liquids."""

import numpy as np
import pytest

from sandbox.scene.files.load import from_document
from sandbox.window.camera import Camera
from tests.window.render.drawn import CAMERA, changed_pixels, render, snapshot

BARE = {"ball": [{"position": [4.0, -2.5], "radius": 0.2}], "world": {"gravity": [0.0, -9.81]}}
POOL = {"points": [[-2.0, -2.0], [2.0, -2.0], [2.0, 0.0], [-2.0, 0.0]], "liquid": {"density": 1000.0}}


def _strength(document: dict[str, object], x: float, y: float, camera: Camera = CAMERA) -> int:
    """Return the largest change of a colour by the zone within 2 px of a point, m."""
    bare, drawn = (render(snapshot(from_document(each)), camera).astype(int) for each in (BARE, document))
    column, row = np.floor(camera.to_screen(np.asarray((x, y)))).astype(int)
    near = slice(column - 2, column + 3), slice(row - 2, row + 3)
    return int(np.abs(drawn[near] - bare[near]).max())


def test_liquid_is_a_translucent_area_with_a_line_along_its_surface() -> None:
    document = {**BARE, "zone": [POOL]}
    changed = changed_pixels(render(snapshot(from_document(BARE))), render(snapshot(from_document(document))))
    column, row = np.floor(CAMERA.to_screen(np.asarray((0.5, -1.0)))).astype(int)
    assert changed[column, row]
    inside, surface, bottom = (_strength(document, 0.5, y) for y in (-1.0, 0.0, -2.0))
    assert 0 < inside < bottom < surface


@pytest.mark.parametrize(("gravity", "side"), [([0.0, 9.81], (0.5, -2.0)), ([9.81, 0.0], (-2.0, -0.5))])
def test_surface_is_where_gravity_of_the_zone_has_it(gravity: list[float], side: tuple[float, float]) -> None:
    document = {**BARE, "zone": [{**POOL, "gravity": gravity}]}
    assert _strength(document, *side) > _strength(document, 0.5, 0.0)
