"""Names of elements in messages, tables and results can be used as paths of `--set`."""

import re

import pytest

from sandbox.measure.preflight import notes, warnings
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import path_of
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import from_document
from sandbox.scene.files.overrides import AddressError, assign, parse_assignment

UNNAMED = {
    "world": {"gravity": [0, -9.81]},
    "solver": {"dt": 0.05, "iterations": 1},
    "plane": [{"point": [0, 0], "normal": [0, 1]}, {"point": [0, -1], "normal": [0, 1]}],
    "wall": [{"points": [[20, 0], [20, 9]], "kick": {"speed": 1.0, "threshold": 0.1}}],
    "post": [{"position": [30, 0], "radius": 1}],
    "zone": [{"position": [-30, 4], "radius": 0.01}],
    "sensor": [{"position": [-40, 4], "radius": 0.01}],
    "ball": [
        {"position": [0, 20], "radius": 0.01}, {"position": [1, 20], "radius": 0.01, "mass": 1000},
        {"position": [2, 20], "radius": 0.01},
    ],
    "box": [{"position": [5, 20], "size": [0.1, 0.1]}, {"position": [9, 20], "size": [0.1, 1]}],
    "capsule": [{"position": [-5, 20], "length": 0.2, "radius": 0.1}],
    "polygon": [{"position": [-8, 20], "points": [[0, 0], [2, 0], [2, 2], [1, 0.5], [0, 2]]}],
    "joint": [
        {"kind": "rod", "between": ["ball-1", "ball-2"], "length": 3},
        {"kind": "rod", "between": ["ball-2", "ball-3"]},
        {"kind": "spring", "between": ["box-1"], "anchors": [[0, 30], [0, 0]], "stiffness": 1000000.0},
    ],
    "thrust": [{"body": "ball-1", "force": [0, 1]}],
    "drive": [{"kind": "stroke", "body": "box-2", "pivot": [9, 20], "stops": [0, 1], "rate": 3}],
    "rope": [{"start": [-20, 20], "end": [-10, 20], "links": 4, "mass": 0.001}],
    "grid": [{"origin": [40, 20], "columns": 3, "spacing": [0.5, 0.5], "radius": 0.01}],
}  # fmt: skip

GENERATORS = ("rope", "grid")


@pytest.fixture(scope="module")
def scene() -> Scene:
    return from_document(UNNAMED)


def tables_of(scene: Scene, name: str) -> list[str]:
    """Return the tables in which a name resolves to an element, or to the generator of the element."""
    found = []
    for kind, elements in to_document(scene).items():
        if isinstance(elements, list):
            try:
                _, location = assign(to_document(scene), f"{kind}.{name}.anything", 1)
            except AddressError as error:
                if "is made by the generator" in str(error):
                    found.append(kind)
            else:
                assert location[0] == kind
                found.append(kind)
    return found


def test_names_of_bodies_static_elements_joints_drives_and_thrusts_are_paths(scene: Scene) -> None:
    shown = [*scene.bodies.names, *scene.fixed_names, *scene.joint_arrays.names, "drive-1", "thrust-1"]
    assert len(shown) == len(set(shown))
    for name in shown:
        assert tables_of(scene, name) == [name.partition("-")[0]]


def test_default_name_resolves_to_its_element(scene: Scene) -> None:
    for kind, elements in to_document(scene).items():
        for k in range(len(elements) if isinstance(elements, list) else 0):
            assert assign(to_document(scene), f"{kind}.{kind}-{k + 1}.x", 1)[1] == (kind, k, "x")


def test_names_in_warnings_and_notes_are_paths(scene: Scene) -> None:
    messages = [each.message for each in (*warnings(scene), *notes(scene))]
    names = {name for message in messages for name in re.findall(r"'([^']+)'", message)}
    assert {"joint-1", "joint-3", "ball-1"} <= names  # the scene is designed to cause these
    for name in names:
        assert tables_of(scene, name), name


def test_stated_name_has_priority_over_a_default_name() -> None:
    document = {"ball": [{}, {"name": "ball-1"}]}
    assert assign(document, "ball.ball-1.mass", 1)[1] == ("ball", 1, "mass")


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("joint-1.length=2", "that is an element: joint.joint-1.length"),
        ("rope-1-joint-2.strength=2", "that is part of an element: rope.rope-1.strength"),
        ("rope.rope-1-joint-2.strength=2", "is made by the generator rope.rope-1"),
        ("grid-1-2.radius=2", "that is part of an element: grid.grid-1.radius"),
    ],
)
def test_name_without_its_table_is_refused_with_the_full_path(scene: Scene, path: str, words: str) -> None:
    key, _, value = path.partition("=")
    with pytest.raises(AddressError, match=re.escape(words)):
        assign(to_document(scene), key, value)


@pytest.mark.parametrize("name", ["a", "two words", "a.b", "a[0]", 'say "a"', "it's", "a=b", "8"])
def test_path_of_a_fault_can_be_used_in_an_override(name: str) -> None:
    document = {"ball": [{"name": "other"}, {"name": name, "radius": -1.0, "position": [0.0, 0.0]}]}
    shown = path_of(("ball", 1, "radius"), document)
    key, value = parse_assignment(f"{shown}=2")
    assert assign(document, key, value)[1] == ("ball", 1, "radius")
