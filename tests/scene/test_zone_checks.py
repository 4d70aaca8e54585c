"""Zones, layers and `[play]` of a scene: faults with their paths, and what they refer to."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.scene.description.fixed import Zone
from sandbox.scene.files.load import dumps, from_document, loads
from sandbox.scene.geometry.shapes import contains, middle_of, width_of
from sandbox.scene.validate.references import generator_names
from tests.scene.faults import assert_faults, faults_of

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
        ({"zone": [{"points": [[0, 0], [0, 0]], "thickness": 1}]}, "zone[0].points[0]", "at the same place"),
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
    assert any(fault.path.startswith(path) and words in fault.message for fault in faults_of(document))


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
    balls = [{**BALL, "layer": f"{k}", "position": [k, 0]} for k in range(9)]
    assert len(from_document({"ball": balls}).layers) == 10  # the largest number


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


PARTS: dict[str, Any] = {
    "ball": [{"name": "a.b", "position": [0, 0], "radius": 1}, {"position": [5, 0], "radius": 1}],
    "grid": [{"origin": [0, 9], "columns": 2, "spacing": [3, 3], "radius": 1}],
    "scatter": [{"name": 'say "hi"', "count": 2, "lower": [20, 20], "upper": [30, 30], "radius": 1}],
    "emitter": [
        {"position": [0, 0], "count": 2, "velocity_min": [0, 0], "velocity_max": [1, 1]},
        {"name": "s", "position": [0, 0], "count": 2, "velocity_min": [0, 0], "velocity_max": [1, 1]},
    ],
}


@pytest.mark.parametrize(
    "play",
    [
        {}, {"arrows": "a.b"}, {"arrows": "ball-2"}, {"arrows": "grid-1-2"}, {"arrows": 'say "hi"-1'},
        {"relaunch": "grid-1"}, {"relaunch": 'say "hi"'}, {"relaunch": "emitter-1"}, {"relaunch": "s"},
        {"show": "overlap"}, {"arrows": "a.b", "arrow_step": 0.1, "relaunch": "s", "show": "overlap"},
    ],
)  # fmt: skip
def test_play_may_refer_to_existing_bodies_and_generators(play: dict[str, Any]) -> None:
    scene = from_document({**PARTS, "play": play})
    assert scene.play.model_dump(exclude_unset=True) == play
    assert scene.bodies.position.tolist() == from_document(PARTS).bodies.position.tolist()


@pytest.mark.parametrize(
    ("play", "path", "words"),
    [
        ({"arrows": "zzz"}, "play.arrows", "no body is named 'zzz'"),
        ({"arrows": "s"}, "play.arrows", "no body"),
        ({"relaunch": "a.b"}, "play.relaunch", "no generator is named 'a.b'"),
        ({"relaunch": "emitter-2"}, "play.relaunch", "no generator"),
        ({"arrow_step": 0}, "play.arrow_step", "greater than 0"),
        ({"show": "all"}, "play.show", "overlap"),
        ({"view": [[0, 1], [1, 1]]}, "play.view", "upper right corner"),
        ({"inset": [[0, 0], [0, 1]]}, "play.inset", "upper right corner"),
        ({"game": "chess"}, "play.game", "'landing'"),
        ({"zzz": 1}, "play.zzz", "unknown key"),
        ({"part": [{"name": "a.b", "role": "lamp"}]}, 'play.part."a.b".role', "one of 'ball', 'bumper'"),
        ({"part": [{"name": "zzz", "role": "ball"}]}, "play.part.zzz.name", "sensor is named 'zzz'"),
        ({"part": 2 * [{"name": "a.b", "role": "ball"}]}, 'play.part."a.b".name', "already has a part"),
        ({"marking": [{"colour": "#000000"}]}, "play.marking[0]", "`points`"),
        ({"ground": "sand"}, "play.ground", "'playfield'"),
    ],
)
def test_unknown_reference_or_invalid_value_in_play_is_a_fault(play: dict[str, Any], path: str, words: str) -> None:
    assert_faults({**PARTS, "play": play}, f"{path}: {words}")


def test_all_faults_in_play_are_reported_with_their_lines() -> None:
    text = 'title = "t"\n\n[play]\narrows = "a"\nrelaunch = "b"\n'
    assert_faults(text, "4: play.arrows: none", "5: play.relaunch: none")


def test_generators_are_named_in_scene_order() -> None:
    assert generator_names(from_document(PARTS)) == ("grid-1", 'say "hi"', "emitter-1", "s")
    assert generator_names(from_document({"title": "t"})) == ()
