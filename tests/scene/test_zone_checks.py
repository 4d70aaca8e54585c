"""Zones and layers of a scene file: faults, geometry and round trip."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.scene.description.fixed import Zone
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import dumps, from_document, loads
from sandbox.scene.geometry.shapes import contains, middle_of, width_of

BALL: dict[str, Any] = {"position": [0, 0], "radius": 0.1}
CIRCLE: dict[str, Any] = {"position": [1, 1], "radius": 0.5}
HOOK = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 3], [0, 3]]
"""An L whose centroid, (1.1, 1.1) m, is outside: areas of 3 and 2 m² with centroids (1.5, 0.5) and (0.5, 2) m."""


@pytest.mark.parametrize(
    ("document", "path", "words"),
    [
        ({"zone": [{}]}, "zone[0]", "`position` and `radius`, or `points`"),
        ({"zone": [{"position": [0, 0]}]}, "zone[0]", "has no shape"),
        ({"zone": [{**CIRCLE, "thickness": 1}]}, "zone[0].thickness", "not to a circle"),
        ({"zone": [{**CIRCLE, "points": [[0, 0], [1, 0], [1, 1]]}]}, "zone[0].position", "remove one of the two"),
        ({"zone": [{"points": [[0, 0], [1, 0]]}]}, "zone[0].points", "at least three points"),
        (
            {"zone": [{"points": [[0, 0], [0, 0]], "thickness": 1}]},
            "zone[0].points[0]",
            "at the same place as the next point",
        ),
        ({"zone": [{"points": [[0, 0], [1, 1], [1, 0], [0, 1]]}]}, "zone[0].points", "cross"),
        ({"zone": [{"name": "hook", "points": HOOK, "holds": True}]}, "zone.hook.holds", "(1.1, 1.1) m, is outside"),
        ({"surface": {}, "zone": [CIRCLE]}, "zone[0]", "[surface]"),
        ({"surface": {}, "ball": [{**BALL, "layer": "up"}]}, "", "the layer 'up'"),
        ({"ball": [{**BALL, "layer": f"{k}", "position": [k, 0]} for k in range(10)]}, "", "11 layers"),
        ({"zone": [{**CIRCLE, "name": "a"}], "ball": [{**BALL, "name": "a"}]}, "zone.a", "names must be unique"),
        ({"wall": [{"points": [[0, 0], [1, 0]], "layers": []}]}, "wall[0].layers", "an array of 1"),
    ],
)
def test_fault_of_a_zone_or_layer_has_its_path_and_a_hint(document: dict[str, Any], path: str, words: str) -> None:
    with pytest.raises(SceneError) as caught:
        from_document(document)
    assert any(fault.path.startswith(path) and words in fault.message for fault in caught.value.faults), caught.value


def test_zones_and_layers_round_trip() -> None:
    zones = [
        {**CIRCLE, "name": "hole", "holds": True, "colour": "#ff0000"},
        {"points": [[0, 0], [1, 0]], "thickness": 0.2, "gravity": [0, 1], "layers": ["up", "ground"]},
        {"points": HOOK, "to_layer": "up"},
    ]
    wall = {"points": [[0, 0], [1, 0]], "layers": ["up"]}
    pocket = {"position": [5, 5], "radius": 0.1}
    scene = from_document({"zone": zones, "wall": [wall], "ball": [{**BALL, "layer": "up"}], "pocket": [pocket]})
    assert loads(dumps(scene)) == scene
    assert scene.fixed_names == ("wall-1", "pocket-1", "hole", "zone-2", "zone-3")
    assert scene.layers == ("ground", "up")


def test_ten_layers_are_accepted() -> None:
    balls = [{**BALL, "layer": f"{k}", "position": [k, 0]} for k in range(9)]
    assert len(from_document({"ball": balls}).layers) == 10


def test_middle_of_a_zone_is_its_centroid() -> None:
    assert middle_of(Zone(position=(1.0, 2.0), radius=1.0)) == (1.0, 2.0)
    strip = Zone(points=((0.0, 0.0), (1.0, 0.0), (1.0, 3.0)), thickness=0.1)
    assert middle_of(strip) == pytest.approx((1.0, 1.0))  # after 2 of 4 m
    assert middle_of(Zone(points=tuple((float(x), float(y)) for x, y in HOOK))) == pytest.approx((1.1, 1.1))
    clockwise = tuple((float(x), float(y)) for x, y in reversed(HOOK))
    assert middle_of(Zone(points=clockwise)) == pytest.approx((1.1, 1.1))


@given(x=st.floats(-1.0, 4.0), y=st.floats(-1.0, 4.0))
def test_concave_outline_contains_the_points_of_its_two_boxes(x: float, y: float) -> None:
    hook = Zone(points=tuple((float(a), float(b)) for a, b in HOOK))
    inside = (0.0 < x < 3.0 and 0.0 < y < 1.0) or (0.0 < x < 1.0 and 0.0 < y < 3.0)
    edge = min(abs(x), abs(x - 1.0), abs(x - 3.0), abs(y), abs(y - 1.0), abs(y - 3.0)) < 1e-12
    assert edge or contains(hook, (x, y)) == inside


def test_width_of_a_zone_is_its_smallest_extent() -> None:
    assert width_of(Zone(position=(0.0, 0.0), radius=0.5)) == 1.0
    assert width_of(Zone(points=((0.0, 0.0), (9.0, 0.0)), thickness=0.2)) == 0.2
    slanted = Zone(points=((0.0, 0.0), (1.0, 1.0), (0.0, 2.0), (-1.0, 1.0)))
    assert width_of(slanted) == pytest.approx(math.sqrt(2.0))
