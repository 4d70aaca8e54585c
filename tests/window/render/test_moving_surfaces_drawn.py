"""Drawing of moving surfaces: chevrons on planes, walls, posts and bodies, which travel with the surface."""

from typing import Any

import numpy as np
import pytest

from sandbox.scene.files.load import from_document
from sandbox.window.render import moving_surfaces
from tests.window.render.drawn import changed_pixels, frame, render, snapshot

OBJECTS: dict[str, dict[str, Any]] = {
    "plane": {"plane": [{"point": [0.0, -1.0], "normal": [0.0, 1.0]}]},
    "wall": {"wall": [{"points": [[-2.0, 0.0], [0.0, 0.5], [2.0, 0.0]], "thickness": 0.4}]},
    "closed wall": {"wall": [{"points": [[-2.0, -1.0], [2.0, -1.0], [0.0, 1.0]], "closed": True}]},
    "post": {"post": [{"position": [0.0, 0.0], "radius": 1.0}]},
    "box": {"box": [{"position": [0.0, 0.0], "size": [3.0, 1.0], "angle": 0.3}]},
    "capsule": {"capsule": [{"position": [0.0, 0.0], "length": 2.0, "radius": 0.5}]},
    "ball": {"ball": [{"position": [0.0, 0.0], "radius": 1.0}]},
}


@pytest.mark.parametrize(
    "motion", [{"surface_speed": 1.0}, {"surface_velocity": [1.0, 0.3]}], ids=["speed", "velocity"]
)
@pytest.mark.parametrize("name", OBJECTS)
def test_moving_surfaces_have_chevrons_that_travel_at_their_edges(name: str, motion: dict[str, Any]) -> None:
    (kind, (table,)) = next(iter(OBJECTS[name].items()))
    model = from_document({kind: [{**table, **motion}]})
    for antialias in (True, False):
        still = render(snapshot(from_document(OBJECTS[name])), antialias=antialias)
        early, late = (render(snapshot(model, frame=frame(model, time=t)), antialias=antialias) for t in (0.0, 0.1))
        chevrons = changed_pixels(still, early)
        assert chevrons.sum() > 20
        assert changed_pixels(early, late).any()
        # Within 12 px of what the object covers: a chevron is beside its edge.
        bare = changed_pixels(still, render(snapshot(from_document({"title": "bare"})), antialias=antialias))
        column, row = np.nonzero(bare)
        assert all(np.hypot(column - x, row - y).min() < 12 for x, y in np.argwhere(chevrons))


def test_chevrons_of_a_velocity_are_mirror_images_on_both_sides_and_those_of_a_speed_are_not() -> None:
    """Chevrons point along the motion, which a negative speed reverses."""
    still, velocity, speed, reversed_speed = (
        render(snapshot(from_document({"wall": [{"points": [[-2.0, 0.0], [2.0, 0.0]], "thickness": 0.8} | more]})))
        for more in ({}, {"surface_velocity": [1.0, 0.0]}, {"surface_speed": 1.0}, {"surface_speed": -1.0})
    )
    changed = changed_pixels(still, velocity)
    assert changed.any()
    assert (changed == changed[:, ::-1]).mean() > 0.99
    assert changed_pixels(speed, speed[:, ::-1]).any()
    assert changed_pixels(speed, reversed_speed).any()


def test_surfaces_far_away_are_not_drawn() -> None:
    far, bare = {"wall": [{"points": [[1e9, 0.0], [1e9, 1.0]], "surface_speed": 1.0}]}, {"title": "bare"}
    pictures = [render(snapshot(from_document(document))) for document in (far, bare)]
    assert not changed_pixels(*pictures).any()


def test_elements_are_asked_once_and_not_in_each_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[object] = []
    has_moving_surface = moving_surfaces._has_moving_surface
    monkeypatch.setattr(
        moving_surfaces, "_has_moving_surface", lambda element: asked.append(element) or has_moving_surface(element)
    )
    balls = [{"position": [0.1 * k, 0.0], "radius": 0.05} for k in range(20)]
    model, other = (
        from_document({"ball": [*balls, {"position": [0.0, 0.0], "radius": 2.0, **more}]})
        for more in ({}, {"surface_speed": 1.0})
    )
    for _ in range(3):
        plain, moving = render(snapshot(model)), render(snapshot(other))
    assert len(asked) == 42
    assert changed_pixels(plain, moving).any()
