"""Transformations: the bodies of transformed elements are where the similarity maps those of before."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.scene.compile.scene import Scene
from sandbox.scene.editing.elements import ElementKey, all_elements, bodies_of, unique_name
from sandbox.scene.editing.transforms import CANNOT_ROTATE, Similarity, plain_value, transform_elements
from sandbox.scene.files.load import loads
from sandbox.scene.files.toml_changes import SetValue, with_changes
from sandbox.scene.geometry.shapes import placed_sensor

TEXT = """
[[ball]]
name = "a"
position = [1.0, 2.0]
radius = 0.5
[[box]]
position = [-1.0, 0.5]
size = [1.0, 2.0]
angle = 0.3
[[capsule]]
position = [4.0, 0.5]
length = 1.0
radius = 0.2
angle = -1.0
[[polygon]]
position = [0.0, 5.0]
points = [[0.0, 0.0], [2.0, 0.0], [0.5, 1.5]]
angle = 0.7
[[body]]
name = "hammer"
position = [-5.0, 1.0]
box = [{ size = [0.2, 2.0], position = [0.0, -1.0] }, { size = [1.0, 0.4], angle = 0.2 }]
ball = [{ radius = 0.3, position = [0.5, 0.1] }]
[[stack]]
base = [8.0, 0.0]
columns = 2
rows = 2
size = [0.5, 0.4]
[[grid]]
name = "atom"
origin = [0.0, 12.0]
columns = 3
spacing = [1.0, 1.0]
radius = 0.2
[[scatter]]
lower = [5.0, 10.0]
upper = [8.0, 13.0]
count = 4
radius = 0.1
[[rope]]
start = [0.0, 20.0]
end = [4.0, 20.0]
links = 4
[[plane]]
point = [0.0, -3.0]
normal = [0.5, 2.0]
[[wall]]
points = [[-8.0, 0.0], [-8.0, 3.0], [-6.0, 4.0]]
thickness = 0.1
[[post]]
position = [3.0, -1.0]
radius = 0.3
[[zone]]
points = [[9.0, 9.0], [10.0, 9.0], [10.0, 11.0]]
[[sensor]]
points = [[9.0, -9.0], [10.0, -9.0]]
thickness = 0.2
"""
SCENE = loads(TEXT)
KEYS = [key for key, _ in all_elements(SCENE)]
ROUNDING = 1e-7
"""m; coordinates are written with 9 significant digits in no case here, but squares of rotations round"""


def after(by: Similarity, keys: list[ElementKey], text: str = TEXT) -> Scene:
    values = transform_elements(loads(text), keys, by)
    changes = [
        SetValue((*key.location, name), plain_value(value))
        for key, each in values.items()
        for name, value in each.items()
    ]
    return loads(with_changes(text, changes))


def image(by: Similarity, points: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
    """Return the images of points, (K, 2) m, by matrices."""
    offset = (points - np.asarray(by.centre)) * by.scale * np.asarray((-1.0 if by.mirrored else 1.0, 1.0))
    cos, sin = math.cos(by.angle), math.sin(by.angle)
    return np.asarray(offset @ np.asarray(((cos, sin), (-sin, cos))) + np.asarray(by.centre) + np.asarray(by.shift))


SIMILARITIES = st.builds(
    Similarity,
    centre=st.tuples(st.floats(-5, 5), st.floats(-5, 5)),
    angle=st.sampled_from([0.0, 0.3, -2.0, math.pi]),
    scale=st.sampled_from([1.0, 0.5, 2.0]),
    shift=st.tuples(st.floats(-5, 5), st.floats(-5, 5)),
    mirrored=st.booleans(),
)


@pytest.mark.fail_slow(60)  # takes over half a second
@given(SIMILARITIES)
def test_bodies_and_static_elements_are_mapped(by: Similarity) -> None:
    rigid = [key for key in KEYS if key.table not in (*CANNOT_ROTATE, "rope", "stack")]
    moved = after(by, rigid)
    for key in rigid:
        for body in bodies_of(SCENE, key):
            expected = image(by, SCENE.bodies.position[body][None])[0]
            assert np.abs(moved.bodies.position[body] - expected).max() < ROUNDING
            assert moved.bodies.core[body] == pytest.approx(by.scale * SCENE.bodies.core[body], rel=1e-9)
    wall, zone = np.asarray(SCENE.walls[0].points), np.asarray(SCENE.zones[0].points)
    assert np.abs(np.asarray(moved.walls[0].points) - image(by, wall)).max() < ROUNDING
    assert np.abs(np.asarray(moved.zones[0].points) - image(by, zone)).max() < ROUNDING
    sensor = np.asarray(SCENE.sensors[0].points)
    assert np.abs(np.asarray(moved.sensors[0].points) - image(by, sensor)).max() < ROUNDING
    assert moved.sensors[0].thickness == pytest.approx(0.2 * by.scale)
    assert moved.walls[0].thickness == pytest.approx(0.1 * by.scale)
    assert moved.posts[0].radius == pytest.approx(0.3 * by.scale)
    # The surface of the plane is mapped: a point of it, and the direction along it.
    plane, normal = moved.planes[0], np.asarray(moved.planes[0].normal)
    ends = image(by, np.asarray(((0.0, -3.0), (4.0, -4.0))))  # (4, −1) is along the surface
    assert abs((ends[1] - ends[0]) @ normal) < ROUNDING * np.hypot(*normal) * by.scale * 10
    assert np.abs(np.asarray(plane.point) - ends[0]).max() < ROUNDING


@pytest.mark.fail_slow(60)  # takes over half a second
@given(st.tuples(st.floats(-9, 9), st.floats(-9, 9)))
def test_translation_moves_every_body_of_every_element(shift: tuple[float, float]) -> None:
    moved = after(Similarity(shift=shift), KEYS)
    assert np.abs(moved.bodies.position - SCENE.bodies.position - np.asarray(shift)).max() < ROUNDING
    assert np.array_equal(moved.bodies.angle, SCENE.bodies.angle)
    assert len(moved.joint_arrays) == len(SCENE.joint_arrays)


def test_masses_follow_the_size_where_a_density_is_stated() -> None:
    text = "[[ball]]\nposition = [0, 0]\nradius = 1\ndensity = 2\n[[box]]\nposition = [5, 0]\nsize = [1, 1]\nmass = 3\n"
    keys = [ElementKey("ball", 0), ElementKey("box", 0)]
    moved = after(Similarity(scale=2.0), keys, text)
    assert moved.bodies.mass.tolist() == pytest.approx([8.0 * math.pi, 3.0])


@given(SIMILARITIES)
def test_sensor_of_a_body_keeps_its_place_on_the_body(by: Similarity) -> None:
    text = """
    [[box]]
    name = "a"
    position = [1.0, 2.0]
    size = [1.0, 1.0]
    angle = 0.4
    [[sensor]]
    body = "a"
    points = [[-0.5, -0.5], [0.5, -0.7]]
    thickness = 0.2
    """
    moved = after(by, [ElementKey("box", 0)], text)
    before = loads(text)
    places = [
        np.asarray(placed_sensor(each.sensors[0], each.boxes[0].position, each.boxes[0].angle).points)
        for each in (before, moved)
    ]
    assert np.abs(places[1] - image(by, places[0])).max() < ROUNDING
    assert moved.sensors[0].thickness == pytest.approx(0.2 * by.scale)


def test_stack_turns_about_its_base() -> None:
    by = Similarity((8.0, 0.0), angle=0.5)
    moved = after(by, [ElementKey("stack", 0)])
    bodies = list(bodies_of(SCENE, ElementKey("stack", 0)))
    assert np.abs(moved.bodies.position[bodies] - image(by, SCENE.bodies.position[bodies])).max() < ROUNDING


@pytest.mark.fail_slow(60)  # a hundred examples
@pytest.mark.parametrize("file_form", ["inline", "table"])
@given(by=SIMILARITIES)
def test_path_of_a_body_is_mapped(file_form: str, by: Similarity) -> None:
    """The centre of a door that also moves is where the similarity maps the one before, at every time."""
    keys = "points = [[0, 0], [3, 0], [3, 1]]", "angles = [0.0, 1.0, -0.5]", "pivot = [0.5, -1.0]", "period = 4.0"
    path = f"path = {{ {', '.join(keys)} }}\n" if file_form == "inline" else "\n".join(("[box.path]", *keys)) + "\n"
    text = f"[[box]]\nposition = [1.0, 2.0]\nsize = [1.0, 2.0]\nangle = 0.3\nkinematic = true\n{path}"
    before, moved = (scene.bodies.paths[0] for scene in (loads(text), after(by, [ElementKey("box", 0)], text)))
    for time in (0.0, 0.7, 1.6, 2.5):
        expected = image(by, np.asarray([before.pose(time)[:2]]))[0]
        assert moved.pose(time)[:2] == pytest.approx(expected, abs=ROUNDING)


def test_identity_changes_nothing() -> None:
    assert transform_elements(SCENE, KEYS, Similarity(centre=(3.0, 4.0))) == {}


def test_names_of_copies_count_up() -> None:
    assert unique_name("a", set()) == "a"
    assert unique_name("a", {"a", "a 2"}) == "a 3"
    assert unique_name("a 2", {"a 2"}) == "a 3"
    assert unique_name("", {"x"}) not in ("", "x")
