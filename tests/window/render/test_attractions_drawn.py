"""Drawing of the centres of attractions."""

import numpy as np
import pytest

from sandbox.scene.files.load import from_document
from sandbox.window.camera import Camera
from tests.window.render.drawn import CAMERA, SIZE, changed_pixels, render, snapshot

BARE = {"ball": [{"name": "planet", "position": [4.0, -2.5], "radius": 0.2}]}


@pytest.mark.parametrize("strength", [1.0, -1.0, 1e9])
@pytest.mark.parametrize("toward", [(0.0, 0.0), (-3.0, 1.5), (2.0, -2.0)])
@pytest.mark.parametrize("camera", [CAMERA, Camera((0.0, 0.0), 20.0, SIZE[::-1], turned=True)])
def test_centre_of_an_attraction_is_marked(strength: float, toward: tuple[float, float], camera: Camera) -> None:
    model = from_document({**BARE, "attraction": [{"toward": list(toward), "strength": strength}]})
    marked = changed_pixels(render(snapshot(from_document(BARE)), camera), render(snapshot(model), camera))
    assert np.abs(np.argwhere(marked).mean(axis=0) - camera.to_screen(np.asarray(toward))).max() < 2.0
    assert 60 < marked.sum() < 500
    column, row = np.floor(camera.to_screen(np.asarray(toward))).astype(int)
    assert marked[column, row] == (strength > 0.0)  # the mark of a repulsion is hollow


@pytest.mark.parametrize("change", [{"toward": "planet"}, {"strength": 0.0}, {"toward": [1e12, 0.0]}])
def test_attractions_to_a_body_without_effect_or_out_of_view_have_no_mark(change: dict[str, object]) -> None:
    model = from_document({**BARE, "attraction": [{"toward": [0.0, 0.0], "strength": 1.0, **change}]})
    assert not changed_pixels(render(snapshot(from_document(BARE))), render(snapshot(model))).any()
