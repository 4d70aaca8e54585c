"""`[pinball]` of a scene file: its expansion, elements that override it, and faults."""

import math
from typing import Any

import pytest

from sandbox.games.pinball.elements import Pinball
from sandbox.games.pinball.scene import BUILD, elements_of, expanded
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import dumps, from_document, loads

EVERY: dict[str, Any] = {
    "axis": 0.25,
    "outline": [[0, 0], [0.5, 0], [0.5, 1, 0.25], [0, 1, 0.25]],
    "colour": "#14304a",
    "art": [{"position": [0.25, 0.5], "radius": 0.1, "colour": "#e9b44c"}],
    "wall": [{"name": "side", "points": [[0, 0], [0, 1, 0.25], [0.5, 1, 0.25], [0.5, 0]], "material": "wall"}],
    "rubber": [{"name": "band", "points": [[0.1, 0.8], [0.12, 0.82], [0.1, 0.84]], "closed": True}],
    "post": [{"name": "peg", "position": [0.2, 0.9]}],
    "gate": [{"name": "gate", "points": [[0.44, 0.8], [0.5, 0.82]], "mirrored": True}],
    "bumper": [{"name": "pop", "position": [0.25, 0.7], "colour": "#e4572e"}],
    "slingshot": [{"name": "sling", "points": [[0.08, 0.37], [0.13, 0.24], [0.08, 0.27]], "mirrored": True}],
    "standup": [{"name": "target", "position": [0.01, 0.6], "facing": [1, 0], "score": 750, "mirrored": True}],
    "drops": [{"name": "bank", "position": [0.25, 0.85], "facing": [0, -1], "count": 3}],
    "rollover": [{"name": "wire", "position": [0.02, 0.3], "group": "outlanes", "mirrored": True}],
    "spinner": [{"name": "plate", "points": [[0.0, 0.5], [0.05, 0.5]]}],
    "kicker": [{"name": "hole", "position": [0.35, 0.6], "out": [0.1, -1.0]}],
    "ramp": [{"name": "ramp", "points": [[0.1, 0.4], [0.1, 0.7, 0.05], [0.2, 0.7]], "colour": "#5ad1e6"}],
    "drain": [{"name": "drain", "points": [[0.0, 0.05], [0.5, 0.05]]}],
    "flipper": [{"name": "flipper", "pivot": [0.16, 0.17], "mirrored": True}],
    "plunger": [{"name": "plunger", "position": [0.48, 0.1]}],
    "ball": [{"name": "ball", "position": [0.48, 0.114]}],
}

TEXT = """
title = "Two bumpers"

[pinball]
axis = 0.25

[[pinball.bumper]]
name = "pop"
position = [0.2, 0.7]
mirrored = true

[[pinball.wall]]
name = "side"
points = [[0.0, 0.0], [0.0, 1.0, 0.2], [0.5, 1.0]]

[[pinball.ball]]
name = "ball"
position = [0.25, 0.5]
"""


def table(**changes: Any) -> Scene:
    return from_document({"pinball": {**EVERY, **changes}})


def test_every_kind_of_element_is_built() -> None:
    kinds = [kind for kind, _ in elements_of(Pinball())]
    assert set(kinds) == set(BUILD) == set(EVERY) - {"axis", "outline", "colour"}


def test_table_expands_to_a_scene_of_primitives() -> None:
    scene = table()
    assert scene.pinball is None
    assert scene.play.game == "pinball"
    assert (scene.solver.substeps, scene.world.gravity[0]) == (10, 0.0)
    assert loads(dumps(scene)) == scene
    assert expanded(scene) is scene


def test_parts_give_every_element_its_role() -> None:
    scene = table()
    parts = {part.name: part for part in scene.play.parts}
    roles = {
        "gate": 2, "bumper": 1, "slingshot": 2, "standup": 2, "drop": 3, "rollover": 2, "spinner": 1, "kicker": 1,
        "ramp": 2, "drain": 1, "flipper": 2, "plunger": 1, "ball": 1,
    }  # fmt: skip
    assert {role: sum(part.role == role for part in parts.values()) for role in roles} == roles
    assert set(parts) <= {*scene.bodies.names, *scene.fixed_names}
    assert [(parts[f"bank {k}"].group, parts[f"bank {k}"].step) for k in (1, 2, 3)] == [("bank", k) for k in range(3)]
    assert (parts["left target"].score, parts["pop"].score) == (750, 100)
    assert {parts[f"{side} wire"].group for side in ("left", "right")} == {"outlanes"}
    assert (parts["left flipper"].group, parts["right flipper"].group) == ("left", "right")
    assert [(parts[name].group, parts[name].step) for name in ("ramp", "ramp exit")] == [("ramp", 0), ("ramp", 1)]
    assert (parts["hole"].out, parts["hole"].at) == ((0.1, -1.0), (0.35, 0.6))
    lane = parts["plunger"].at
    assert lane is not None
    # a ball's radius above the tip, plus a small gap
    assert math.dist(lane, (0.48, 0.1)) == pytest.approx(0.01349, rel=2e-3)


def test_targets_of_a_bank_are_numbered_from_the_left_facing_the_bank() -> None:
    for facing, order in (([0, -1], 1), ([0, 1], -1)):  # seen from below, left is towards smaller x
        bank = {"name": "bank", "position": [0.25, 0.85], "facing": facing}
        walls = [wall for wall in table(drops=[bank]).walls if str(wall.name).startswith("bank")]
        xs = [wall.points[0][0] for wall in walls][::order]
        assert xs == sorted(xs)
        faces = {round(wall.points[0][1] + math.copysign(0.5 * wall.thickness, facing[1]), 12) for wall in walls}
        assert faces == {0.85}


def test_materials_have_the_documented_properties() -> None:
    known = {m.name: (m.restitution, m.restitution_falloff, m.friction) for m in table().materials}
    assert known["rubber"] == (0.8, 0.3, 0.6)
    assert known["target"] == (0.35, 0.5, 0.2)
    assert known["post"] == (0.9, 0.1, 0.3)
    assert known["flipper"] == (0.8, 0.43, 0.6)
    assert known["wall"] == (0.3, None, 0.3)
    assert known["steel"] == (None, None, None)  # a contact uses the values of the other material


def test_kicks_have_the_values_of_their_elements() -> None:
    scene = table()
    (pop,) = [post for post in scene.posts if post.name == "pop"]
    sling = {str(wall.name): wall for wall in scene.walls if str(wall.name).startswith("left sling")}
    assert pop.kick is not None
    assert (pop.kick.speed, pop.kick.threshold, pop.kick.profile, pop.radius) == (0.81, 0.054, "even", 0.0243)
    face, back = sling["left sling"], sling["left sling back"]
    assert face.kick is not None
    assert (face.kick.speed, face.kick.profile, face.points) == (2.16, "middle", ((0.08, 0.37), (0.13, 0.24)))
    assert back.kick is None


def test_mirrored_elements_are_on_both_sides_of_the_axis() -> None:
    scene = table()
    walls = {wall.name: wall for wall in scene.walls}
    for name in ("sling", "sling back", "target"):
        left, right = walls[f"left {name}"].points, walls[f"right {name}"].points
        mirrored = sorted((0.5 - x, y) for x, y in left)
        assert [tuple(point) for point in sorted(right)] == [pytest.approx(point, abs=1e-15) for point in mirrored]
    # A mirrored gate keeps its solid side: above, on the left of its direction.
    for gate in (walls["left gate"], walls["right gate"]):
        (ax, _), (bx, _) = gate.points
        assert gate.one_way
        assert ax < bx
    left, right = scene.polygons[0], scene.polygons[1]
    assert left.angle + right.angle == pytest.approx(math.pi, abs=1e-15)


def test_ramp_has_rails_on_its_layer_and_zones_that_change_the_layer() -> None:
    scene = table()
    zones = {zone.name: zone for zone in scene.zones}
    assert (zones["ramp"].layers, zones["ramp"].to_layer) == (("ground",), "ramp")
    for name in ("ramp foot", "ramp exit"):
        assert (zones[name].layers, zones[name].to_layer) == (("ramp",), "ground")
    rails = [wall for wall in scene.walls if wall.layers == ("ramp",)]
    assert [wall.name for wall in rails] == ["ramp left rail", "ramp right rail"]
    climb = zones["ramp climb 1"].gravity
    assert climb is not None
    # down the climb: (5/7) g rise/climb, added to the gravity of the playfield
    assert climb[1] == pytest.approx(scene.world.gravity[1] - 5.0 / 7.0 * 9.81 * 0.04 / 0.12, rel=1e-12)
    assert climb[0] == pytest.approx(0.0, abs=1e-12)


def test_filled_walls_are_markings_above_the_playfield() -> None:
    wall = {"points": [[0, 0], [0.1, 0], [0.1, 0.1, 0.02]], "closed": True, "fill": "#123456"}
    markings = table(wall=[wall]).play.markings
    assert [marking.colour for marking in markings[:3]] == ["#14304a", "#e9b44c", "#123456"]
    assert markings[2].points is not None
    assert len(markings[2].points) > 3  # one corner is round
    assert max(y for _, y in markings[0].points or ()) == pytest.approx(1.0, abs=2e-5)  # the tolerance


def test_elements_of_the_scene_override_the_table() -> None:
    document = {
        "pinball": EVERY,
        "world": {"gravity": [0.0, -1.0], "duration": 3.0},
        "solver": {"substeps": 4},
        "material": [{"name": "rubber", "restitution": 0.5}],
        "pair": [{"between": ["steel", "steel"], "restitution": 0.7}],
        "ball": [{"name": "ball", "position": [0.3, 0.3], "radius": 0.02}],
        "post": [{"name": "pop", "position": [0.3, 0.7], "radius": 0.03}],
    }
    document["material"] += [{"name": "steel"}]
    scene = from_document(document)
    assert scene.world.gravity == (0.0, -1.0)
    assert (scene.world.duration, scene.solver.substeps) == (3.0, 4)
    assert {m.name: m.restitution for m in scene.materials}["rubber"] == 0.5
    assert [(pair.restitution, pair.friction) for pair in scene.pairs] == [(0.7, None)]
    assert [ball.radius for ball in scene.balls] == [0.02]
    assert [(post.name, post.kick) for post in scene.posts if post.radius == 0.03] == [("pop", None)]


def test_overrides_apply_to_elements_and_their_expansion() -> None:
    sets = ["pinball.bumper.pop.speed=1.5", "pinball.slope=0.2", "ball.ball.velocity=[0.0, 1.0]", "post.0.radius=0.02"]
    scene = loads(TEXT, overrides=sets)
    assert [post.kick.speed for post in scene.posts if post.kick is not None] == [1.5, 1.5]
    assert [post.radius for post in scene.posts] == [0.02, 0.0243]
    assert scene.balls[0].velocity == (0.0, 1.0)
    assert scene.world.gravity[1] == pytest.approx(-5.0 / 7.0 * 9.81 * math.sin(0.2), rel=1e-12)
    assert loads(TEXT, overrides=["pinball.tolerance=0.001"]).walls[0].points != loads(TEXT).walls[0].points


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("pinball.bumper[9].speed=1", "no element '9'; names: pop; numbers: 0"),
        ("pinball.bumper.pup.speed=1", "no element 'pup'; did you mean 'pop'?"),
        ("pinball.bumpr.pop.speed=1", "the scene has no pinball.bumpr"),
    ],
)
def test_override_of_an_unknown_element_lists_the_known_ones(override: str, words: str) -> None:
    with pytest.raises(SceneError) as caught:
        loads(TEXT, overrides=[override])
    assert words in str(caught.value)
    assert len(caught.value.faults) == 1


@pytest.mark.parametrize(
    ("kind", "value", "path", "words"),
    [
        ("bumper", [{"position": [0, 0], "radios": 1.0}], "[0].radios", "did you mean 'radius'?"),
        ("wall", [{"points": [[0, 0]]}], "[0].points", "2 or more"),
        ("wall", [{"points": [[0, 0], [1]]}], "[0].points[1]", "array of 2"),
        ("wall", [{"name": "w", "points": [[0, 0], [0.1, 0, 9], [1, 1]]}], ".w.points[1]", "too large a radius"),
        ("wall", [{"points": [[0, 0], [1, 0, -1], [1, 1]]}], "[0].points[1][2]", "must not be negative"),
        ("wall", [{"points": [[0, 0], [1, 0]], "closed": True}], "[0].points", "at least three"),
        ("wall", [{"points": [[0, 0], [1, 0]], "fill": "#000000"}], "[0].fill", "closed lines"),
        ("standup", [{"position": [0, 0], "facing": [0, 0]}], "[0].facing", "has no direction"),
        ("drops", [{"position": [0, 0], "facing": [1, 0], "count": 0}], "[0].count", "must be between 1 and 20"),
        ("slingshot", [{"points": [[0, 0], [1, 0], [2, 0]]}], "[0].points", "three posts"),
        ("gate", [{"points": [[0, 0], [0, 0]]}], "[0].points[1]", "ends of a line"),
        ("ramp", [{"points": [[0, 0], [0, 0.5]], "width": 0.026}], "[0].width", "more than 0.02698 m"),
        ("ramp", [{"points": [[0, 0], [0, 0.1]]}], "[0].climb", "less than the length of the ramp, 0.1 m"),
        ("flipper", [{"pivot": [0, 0], "length": 0.001}], "[0].length", "difference of `base` and `tip`"),
        ("flipper", [{"pivot": [0, 0], "stops": [1, 1]}], "[0].stops", "two different angles"),
        ("kicker", [{"position": [0, 0]}], "[0].out", "is required"),
        ("art", [{"colour": "#000000", "radius": 1.0}], "[0]", "has no shape"),
        ("art", [{"position": [0, 0], "radius": 1.0}], "[0].colour", "is required"),
        ("art", [{"points": [[0, 0], [1, 0, 5], [1, 1]], "colour": "#000000"}], "[0].points[1]", "too large a radius"),
        ("wall", [{"points": [[0, 0], [0, 0]]}], "[0].points[1]", "no line is left"),
        ("bumpers", [], "", "did you mean 'bumper'?"),
        ("slope", 2.0, "", "must be between 0 and 1.5"),
        ("outline", [[0, 0], [1, 0, 5], [1, 1]], "[1]", "too large a radius"),
    ],
)
def test_faults_have_their_path(kind: str, value: Any, path: str, words: str) -> None:
    with pytest.raises(SceneError) as caught:
        from_document({"pinball": {kind: value}})
    (fault,) = caught.value.faults
    assert fault.path == f"pinball.{kind}{path}"
    assert words in fault.message


def test_fault_has_file_line_and_path() -> None:
    with pytest.raises(SceneError) as caught:
        loads(TEXT.replace("[0.0, 1.0, 0.2]", "[0.0, 1.0, 2.0]").replace("[0.2, 0.7]", '"high"'), "two.toml")
    assert [str(fault).split(": ")[:2] for fault in caught.value.faults] == [
        ["two.toml:9", "pinball.bumper.pop.position"]
    ]
    with pytest.raises(SceneError) as caught:
        loads(TEXT.replace("[0.0, 1.0, 0.2]", "[0.0, 1.0, 2.0]"), "two.toml")
    (fault,) = caught.value.faults
    assert str(fault).startswith("two.toml:14: pinball.wall.side.points[1]: has too large a radius: its arcs take 2 m")


def test_faults_of_expanded_elements_point_at_the_element() -> None:
    bank = '[[pinball.drops]]\nname = "bank"\nposition = [0.2, 0.5]\nfacing = [0, -1]\n'
    with pytest.raises(SceneError) as caught:
        loads(TEXT.replace('name = "side"', 'name = "bank 2"') + bank, "two.toml")
    (fault,) = caught.value.faults
    assert (fault.file, fault.line, fault.path) == ("two.toml", 19, "wall.bank 2.name")
    assert "unique" in fault.message


def test_elements_with_equal_names_are_reported() -> None:
    with pytest.raises(SceneError) as caught:
        loads(TEXT.replace('name = "side"', 'name = "right pop"'), "two.toml")
    (fault,) = caught.value.faults
    assert str(fault).startswith("two.toml:8: pinball.bumper.pop.name: pinball.wall[0] is also named 'right pop'")
    with pytest.raises(SceneError) as caught:
        loads(TEXT.replace("[0.2, 0.7]", "[0.25, 0.7]"), "two.toml")
    (fault,) = caught.value.faults
    assert str(fault).startswith("two.toml:10: pinball.bumper.pop.mirrored: has no effect")


def test_pinball_cannot_be_combined_with_billiards_or_a_surface() -> None:
    with pytest.raises(SceneError, match=r"combined with \[billiards\]"):
        from_document({"pinball": {}, "billiards": {"table": "pool-9ft"}})
    with pytest.raises(SceneError, match="applies to billiards"):
        from_document({"pinball": {}, "surface": {}})


def test_scene_built_in_python_has_no_bodies_before_its_table_is_expanded() -> None:
    scene = Scene(pinball=Pinball())
    with pytest.raises(ValueError, match="is not expanded"):
        _ = scene.bodies
    assert len(expanded(scene).bodies) == 0
