"""Solids in scene files: faults, mass and moment, round trip."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import dumps, from_document, loads
from tests import strategies
from tests.scene.faults import assert_faults, faults_of

pytestmark = pytest.mark.fail_slow(60)  # property tests

FLOOR = {"point": [0, 0], "normal": [0, 1]}
GON = [[round(math.cos(k), 6), round(math.sin(k), 6)] for k in np.linspace(0, 2 * math.pi, 1002)[:-1]]
BOX, BODY = "[[box]]\nposition=[0,0]\n", "[[body]]\nposition=[0,0]\n"


@given(strategies.solid_scenes())
def test_scene_of_solids_and_joints_round_trips(scene: Scene) -> None:
    again = loads(dumps(scene))
    assert again == scene
    assert to_document(again) == to_document(scene)


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        (BOX, ["1: box[0].size: missing"]),
        (BOX + "size=[1]\n", ["3: box[0].size: has 1"]),
        (BOX + "size=[1,0]\n", ["3: box[0].size[1]: greater than 0, is 0"]),
        (BOX + "size=[1,inf]\n", ["3: box[0].size[1]: finite"]),
        (BOX + "size=3\n", ["3: box[0].size: array"]),
        (BOX + "siez=[1,1]\n", ["1: box[0].size: missing", "3: box[0].siez: 'size'"]),
        ("[[capsule]]\nposition=[0,0]\nradius=-1\n", ["1: capsule[0].length: ", "3: capsule[0].radius: -1"]),
        ('[[capsule]]\nposition=[0,0]\nradius="1"\nlength=1\n', ['3: capsule[0].radius: is "1"']),
        ("[[polygon]]\nposition=[0,0]\n", ["1: polygon[0].points: missing"]),
        ("[[polygon]]\npoints=[[0,0],[1,0]]\n", ["2: polygon[0].points: 3 or more"]),
        ("[[polygon]]\npoints=[[0,0],[1,1],[2,2]]\n", ["2: polygon[0].points[0]: straight"]),
        ("[[polygon]]\npoints=[[0,0],[1,1],[1,0],[0,1]]\n", ["2: polygon[0].points[2]: edge from points[2]"]),
        ("[[polygon]]\npoints=[\n[0,0],\n[1,0],\n[1,0],\n[0,1]]\n", ["5: polygon[0].points[2]: points[1]"]),
        (f"[[polygon]]\npoints={GON}\n", ["2: polygon[0].points: "]),
        (BODY, ["1: body[0]: [[body.ball]]"]),
        (BODY + "[[body.box]]\nsize=[1,-1]\n", ["4: body[0].box[0].size[1]: -1"]),
        (
            BODY + 'name="h"\n[[body.box]]\nsize=[1,1]\n[[body.box]]\nsize=[1,1]\nsise=3\n',
            ["8: body.h.box[1].sise: 'size'"],
        ),
        (BODY + "[[body.ball]]\nradius=1\nmass=1\n", ["5: body[0].ball[0].mass: unknown"]),
        (BODY + '[[body.ball]]\nradius=1\nmaterial="x"\n', ["5: body[0].ball[0].material: 'x'"]),
        (BODY + "[[body.bocks]]\nsize=[1,1]\n[[body.ball]]\nradius=1\n", ["3: body[0].bocks: unknown"]),
        (BODY + "[[body.polygon]]\npoints=[[0,0],[1,0],[1,1],[0.5,-1]]\n", ["4: body[0].polygon[0].points[2]: edge"]),
        (BODY + "[[body.box]]\nsize=[1e-6,1e-6]\nposition=[1e12,0]\n", ["3: body[0].box[0]: 1e-06 m thin"]),
        (BODY + "[[body.box]]\nsize=[1e9,1e-9]\nangle=0.3\n", ["3: body[0].box[0]: 1e-09"]),
        (BOX + "size=[1,1]\nmass=1\ndensity=2\n", ["5: box[0].density: `mass`"]),
        (BOX + "size=[1e9,1e9]\ndensity=1e29\n", ["4: box[0].density: 1e+47"]),
        (
            "[[capsule]]\nposition=[0,0]\nlength=1e-9\nradius=1e-9\ndensity=1e-3\n",
            ["5: capsule[0].density: gives a mass of 5.1"],
        ),
        ('[[ball]]\nname="a"\nposition=[0,0]\nradius=1\n' + BOX + 'name="a"\nsize=[1,1]\n', ["7: box.a.name: 'a'"]),
        (BOX + "size=[1,1]\nfixed=true\nvelocity=[1,0]\n", ["5: box[0].velocity: fixed"]),
        (
            '[[polygon]]\npoints=[[0,0],[1,1],[1,0],[0,1]]\n[[thrust]]\nbody="zz"\nforce=[0,0]\n',
            ["2: polygon[0].points[2]: edge", "4: thrust[0].body: 'zz'"],
        ),
    ],
)
def test_faulty_solid_is_refused_with_line_and_path(text: str, faults: list[str]) -> None:
    assert_faults(text, *faults)


def test_all_faults_of_solids_are_reported_together() -> None:
    found = faults_of(
        '[[body]]\nname="h"\nposition=[0,0]\n[[body.box]]\nsize=[1,-1]\n[[body.polygon]]\npoints=[[0,0],[1,0]]\n'
        '[[joint]]\nkind="pivot"\nat=[0,0]\nbetween=["q"]\n[[box]]\nsize=[1,1]\nposition=[5,5]\nmaterial="x"\n'
        '[[box]]\nname="h"\nsize=[1,1]\nposition=[5,5]\n'
    )
    assert [fault.line for fault in found] == [2, 5, 7, 11, 15]  # the second "h", by scene order, is on line 2


def concave_polygons(count: int, **keys: Any) -> dict[str, Any]:
    shape = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [3, 2], [3, 3], [0, 3]]
    return {"polygon": [{"points": shape, **keys} for _ in range(count)]}


def test_too_many_overlapping_concave_polygons_are_refused() -> None:
    assert isinstance(from_document(concave_polygons(50)), Scene)
    assert "pairs of pieces so close" in faults_of(concave_polygons(900))[0].message
    assert isinstance(from_document(concave_polygons(900, collides="none")), Scene)


def test_fixed_body_with_too_many_identical_parts_is_refused() -> None:
    bodies = [{"position": [0, 0], "fixed": True, "box": [{"size": [1, 1]}] * 1000} for _ in range(6)]
    assert_faults({"body": bodies, "plane": [FLOOR]}, "body[5]: 5,000 identical objects")


def test_density_of_parts_is_scaled_to_a_given_mass() -> None:
    parts = [{"size": [1, 1], "position": [-1, 0]}, {"size": [1, 1], "position": [1, 0], "density": 3}]
    bodies = from_document({"body": [{"position": [0, 0], "mass": 8, "box": parts}]}).bodies
    assert bodies.mass[0] == pytest.approx(8, rel=1e-15)  # one division
    assert bodies.position[0].tolist() == pytest.approx([0.5, 0], abs=1e-15)  # (−1·1 + 1·3)/4
    moment = 2 * (1 / 6 + 1.5**2) + 6 * (1 / 6 + 0.5**2)
    assert bodies.moment[0] == pytest.approx(moment, rel=1e-14)  # a handful of sums
