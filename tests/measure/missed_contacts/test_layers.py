"""Audit with layers: shapes of another layer are not missed, and those of the same layer are."""

from typing import Any

import pytest

import sandbox
from sandbox.scene.files.load import from_document

both = pytest.mark.parametrize("engine", ["pymunk", "reference"])

WALL = {"points": [[0.5, -1], [0.5, 1]], "layers": ["up"]}
POST = {"position": [0.5, 0.0], "radius": 0.01, "layers": ["up"]}
PLANE = {"point": [0.5, 0.0], "normal": [-1.0, 0.0], "layers": ["up"]}
TARGET = {"position": [0.5, 0.0], "radius": 0.01, "layer": "up"}
BULLET: dict[str, Any] = {"position": [0.0, 0.0], "velocity": [70.0, 0.0], "radius": 0.01}


@both
@pytest.mark.parametrize("thing", ["wall", "post", "ball"])
@pytest.mark.parametrize(("layer", "missed"), [("ground", 0), ("up", 1)])
def test_bullet_misses_only_shapes_of_its_own_layer(engine: str, thing: str, layer: str, missed: int) -> None:
    more: dict[str, Any] = {"wall": {"wall": [WALL]}, "post": {"post": [POST]}, "ball": {}}[thing]
    balls = [{**BULLET, "layer": layer}, *([TARGET] if thing == "ball" else [])]
    run = sandbox.run(from_document({"world": {"duration": 0.05}, "ball": balls, **more}), engine)
    assert run.missed_contacts == missed


@both
def test_body_is_audited_on_its_new_layer_after_a_change(engine: str) -> None:
    zone = {"position": [0.0, 0.0], "radius": 0.05, "to_layer": "up"}
    run = sandbox.run(
        from_document({"world": {"duration": 0.05}, "ball": [BULLET], "wall": [WALL], "zone": [zone]}), engine
    )
    assert run.missed_contacts == 1


@both
def test_plane_of_another_layer_is_not_missed(engine: str) -> None:
    for layer in ("ground", "up"):
        ball = {**BULLET, "layer": layer}
        run = sandbox.run(from_document({"world": {"duration": 0.05}, "ball": [ball], "plane": [PLANE]}), engine)
        assert run.missed_contacts == 0
        assert len(run.contact_time) == (layer == "up")
