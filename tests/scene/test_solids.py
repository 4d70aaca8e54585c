"""Solids in scene files: faults, mass and moment, round trip."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import dumps, from_document, loads
from tests import strategies

FLOOR = {"point": [0, 0], "normal": [0, 1]}
GON = [[round(math.cos(k), 6), round(math.sin(k), 6)] for k in np.linspace(0, 2 * math.pi, 1002)[:-1]]


def faults(text: str) -> list[str]:
    with pytest.raises(SceneError) as caught:
        loads(text, "s.toml")
    return [str(fault) for fault in caught.value.faults]


@settings(max_examples=40)
@given(strategies.solid_scenes())
def test_scene_of_solids_and_joints_round_trips(scene: Scene) -> None:
    again = loads(dumps(scene))
    assert again == scene
    assert to_document(again) == to_document(scene)


@pytest.mark.parametrize(
    ("text", "messages"),
    [
        ("[[box]]\nposition=[0,0]\n", ["s.toml:1: box[0].size: is missing"]),
        ("[[box]]\nposition=[0,0]\nsize=[1]\n", ["s.toml:3: box[0].size: must be an array of 2, has 1"]),
        ("[[box]]\nposition=[0,0]\nsize=[1,0]\n", ["s.toml:3: box[0].size[1]: must be greater than 0, is 0"]),
        ("[[box]]\nposition=[0,0]\nsize=[1,inf]\n", ["s.toml:3: box[0].size[1]: must be a finite number"]),
        ("[[box]]\nposition=[0,0]\nsize=3\n", ["s.toml:3: box[0].size: must be an array"]),
        ("[[box]]\nposition=[0,0]\nsiez=[1,1]\n", ["size: is missing", "siez: unknown key; did you mean 'size'?"]),
        (
            "[[capsule]]\nposition=[0,0]\nradius=-1\n",
            ["s.toml:1: capsule[0].length: is", "s.toml:3: capsule[0].radius"],
        ),
        (
            '[[capsule]]\nposition=[0,0]\nradius="1"\nlength=1\n',
            ['s.toml:3: capsule[0].radius: must be a number, is "1"'],
        ),
        ("[[polygon]]\nposition=[0,0]\n", ["s.toml:1: polygon[0].points: is missing"]),
        ("[[polygon]]\npoints=[[0,0],[1,0]]\n", ["s.toml:2: polygon[0].points: must be an array of 3 or more"]),
        ("[[polygon]]\npoints=[[0,0],[1,1],[2,2]]\n", ["s.toml:2: polygon[0].points[0]: the outline turns straight"]),
        (
            "[[polygon]]\npoints=[[0,0],[1,1],[1,0],[0,1]]\n",
            ["s.toml:2: polygon[0].points[2]: the edge from points[2]"],
        ),
        (
            "[[polygon]]\npoints=[\n[0,0],\n[1,0],\n[1,0],\n[0,1]]\n",
            ["s.toml:5: polygon[0].points[2]: points[1] and points[2] are 0 m apart"],
        ),
        (f"[[polygon]]\npoints={GON}\n", ["s.toml:2: polygon[0].points: "]),
        ("[[body]]\nposition=[0,0]\n", ["s.toml:1: body[0]: has no parts; add a [[body.ball]]"]),
        (
            "[[body]]\nposition=[0,0]\n[[body.box]]\nsize=[1,-1]\n",
            ["s.toml:4: body[0].box[0].size[1]: must be greater than 0, is -1"],
        ),
        (
            '[[body]]\nname="h"\nposition=[0,0]\n[[body.box]]\nsize=[1,1]\n[[body.box]]\nsize=[1,1]\nsise=3\n',
            ["s.toml:8: body.h.box[1].sise: unknown key; did you mean 'size'?"],
        ),
        (
            "[[body]]\nposition=[0,0]\n[[body.ball]]\nradius=1\nmass=1\n",
            ["s.toml:5: body[0].ball[0].mass: unknown key"],
        ),
        (
            '[[body]]\nposition=[0,0]\n[[body.ball]]\nradius=1\nmaterial="x"\n',
            ["s.toml:5: body[0].ball[0].material: no material is named 'x'"],
        ),
        ("[[body]]\nposition=[0,0]\n[[body.bocks]]\nsize=[1,1]\n", ["body[0].bocks: unknown key"]),
        (
            "[[body]]\nposition=[0,0]\n[[body.polygon]]\npoints=[[0,0],[1,0],[1,1],[0.5,-1]]\n",
            ["s.toml:4: body[0].polygon[0].points"],
        ),
        (
            "[[body]]\nposition=[0,0]\n[[body.box]]\nsize=[1e-6,1e-6]\nposition=[1e12,0]\n",
            ["s.toml:3: body[0].box[0]: is 1e-06 m thin in a body that reaches 1e+12 m"],
        ),
        (
            "[[body]]\nposition=[0,0]\n[[body.box]]\nsize=[1e9,1e-9]\nangle=0.3\n",
            ["s.toml:3: body[0].box[0]: is 1e-09"],
        ),
        (
            "[[box]]\nposition=[0,0]\nsize=[1,1]\nmass=1\ndensity=2\n",
            ["s.toml:5: box[0].density: cannot be combined with `mass`"],
        ),
        (
            "[[box]]\nposition=[0,0]\nsize=[1e9,1e9]\ndensity=1e29\n",
            ["s.toml:4: box[0].density: gives a mass of 1e+47"],
        ),
        (
            "[[box]]\nposition=[0,0]\nsize=[1e9,1e9]\nmass=1e31\n",
            ["s.toml:4: box[0].mass: must be at most 1e+30, is 1e+31"],
        ),
        (
            "[[capsule]]\nposition=[0,0]\nlength=1e-9\nradius=1e-9\ndensity=1e-3\n",
            ["s.toml:5: capsule[0].density: gives a mass of 5.1"],
        ),
        (
            '[[ball]]\nname="a"\nposition=[0,0]\nradius=1\n[[box]]\nname="a"\nposition=[5,0]\nsize=[1,1]\n',
            ["s.toml:6: box.a.name: another body or fixed object is also named 'a'"],
        ),
        (
            "[[box]]\nposition=[0,0]\nsize=[1,1]\nfixed=true\nvelocity=[1,0]\n",
            ["s.toml:5: box[0].velocity: a fixed body cannot move"],
        ),
    ],
)
def test_faulty_solid_is_refused_with_line_and_path(text: str, messages: list[str]) -> None:
    found = faults(text)
    assert len(found) == len(messages), found
    for message, start in zip(found, messages, strict=True):
        assert start in message


def test_all_faults_of_solids_are_reported_together() -> None:
    found = faults(
        '[[body]]\nname="h"\nposition=[0,0]\n[[body.box]]\nsize=[1,-1]\n[[body.polygon]]\npoints=[[0,0],[1,0]]\n'
        '[[joint]]\nkind="pivot"\nat=[0,0]\nbetween=["q"]\n[[box]]\nsize=[1,1]\nposition=[5,5]\nmaterial="x"\n'
        '[[box]]\nname="h"\nsize=[1,1]\nposition=[5,5]\n'
    )
    lines = [int(each.split(":")[1]) for each in found]
    assert lines == [2, 5, 7, 11, 15], found  # the second "h", by scene order, is on line 2


def test_fault_of_an_outline_hides_no_unknown_names() -> None:
    found = faults('[[polygon]]\npoints=[[0,0],[1,1],[1,0],[0,1]]\n[[thrust]]\nbody="zz"\nforce=[0,0]\n')
    assert len(found) == 2
    assert "thrust[0].body: no body is named 'zz'" in found[1]


def concave_polygons(count: int, **keys: Any) -> dict[str, Any]:
    shape = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [3, 2], [3, 3], [0, 3]]
    return {"polygon": [{"points": shape, **keys} for _ in range(count)]}


def test_too_many_overlapping_concave_polygons_are_refused() -> None:
    assert isinstance(from_document(concave_polygons(50)), Scene)
    with pytest.raises(SceneError, match="pairs of pieces so close"):
        from_document(concave_polygons(900))
    assert isinstance(from_document(concave_polygons(900, collides="none")), Scene)


def test_fixed_body_with_too_many_identical_parts_is_refused() -> None:
    part = {"size": [1, 1]}
    bodies = [{"position": [0, 0], "fixed": True, "box": [part] * 1000} for _ in range(6)]
    with pytest.raises(SceneError, match="more than 5,000 identical objects") as caught:
        from_document({"body": bodies, "plane": [FLOOR]})
    assert caught.value.faults[0].path == "body[5]"


def test_values_of_solids_and_joints_are_set_by_name() -> None:
    text = (
        '[[box]]\nname="a"\nposition=[0,0]\nsize=[2,2]\n'
        '[[joint]]\nname="x"\nkind="rod"\nbetween=["a"]\nanchors=[[0,0],[3,0]]\n'
    )
    scene = loads(text, overrides=["joint.x.length=2", "box.a.size=[1,2]"])
    assert scene.boxes[0].size == (1, 2)
    assert scene.links.figures[0].tolist() == [2, 0, 0]
    with pytest.raises(SceneError) as caught:
        loads(text, overrides=["joint.x.length=-2", "box.a.size=[1]"])
    paths = {(fault.line, fault.path) for fault in caught.value.faults}
    assert paths == {(None, "joint.x.length (set)"), (None, "box.a.size (set)")}


def test_density_of_parts_is_scaled_to_a_given_mass() -> None:
    parts = [{"size": [1, 1], "position": [-1, 0]}, {"size": [1, 1], "position": [1, 0], "density": 3}]
    bodies = from_document({"body": [{"position": [0, 0], "mass": 8, "box": parts}]}).bodies
    assert bodies.mass[0] == pytest.approx(8, rel=1e-15)  # one division
    assert bodies.position[0].tolist() == pytest.approx([0.5, 0], abs=1e-15)  # (−1·1 + 1·3)/4
    moment = 2 * (1 / 6 + 1.5**2) + 6 * (1 / 6 + 0.5**2)
    assert bodies.moment[0] == pytest.approx(moment, rel=1e-14)  # a handful of sums
