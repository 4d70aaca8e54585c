"""Simplification of freehand outlines."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.scene.editing.elements import ElementKey
from sandbox.scene.editing.take_apart import TakeApartError, take_apart_changes
from sandbox.scene.files.load import loads
from sandbox.scene.files.toml_changes import with_changes
from sandbox.scene.geometry.simplification import simplify_loop, simplify_polyline

POINTS = st.lists(st.tuples(st.floats(-10, 10), st.floats(-10, 10)), min_size=2, max_size=40)


def distance(point: tuple[float, float], a: tuple[float, float], b: tuple[float, float]) -> float:
    p, u = np.subtract(point, a), np.subtract(b, a)
    squared = float(u @ u)
    fraction = min(max(float(p @ u) / squared, 0.0), 1.0) if squared else 0.0
    return float(np.hypot(*(p - fraction * u)))


@given(POINTS, st.floats(1e-3, 3.0))
def test_no_point_is_farther_than_the_tolerance(points: list[tuple[float, float]], tolerance: float) -> None:
    found = simplify_polyline(points, tolerance)
    assert (found[0], found[-1]) == (points[0], points[-1])
    assert set(found) <= set(points)
    sides = list(pairwise(found))
    for point in points:
        assert min(distance(point, a, b) for a, b in sides) <= tolerance * (1 + 1e-9) + 1e-12  # rounding


def test_circle_becomes_a_polygon_with_few_corners() -> None:
    line = [(0.1 * k, 0.2 * k) for k in range(50)]
    assert simplify_polyline(line, 1e-9) == [line[0], line[-1]]
    circle = [(math.cos(0.01 * k), math.sin(0.01 * k)) for k in range(628)]
    corners = simplify_loop(circle, 0.02)
    assert 8 <= len(corners) <= 32  # a sagitta of 0.02 subtends 0.4 rad, 16 sides
    area = 0.5 * abs(sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(corners, (*corners[1:], corners[0]), strict=True)))
    assert area == pytest.approx(math.pi, rel=0.05)


TEXT = """
[world]
seed = 4
# the bricks
[[stack]]
name = "brick"
base = [0, 0]
columns = 2
rows = 2
size = [0.4, 0.2]
friction = 0.8
[[grid]]
name = "atom"
origin = [5, 5]
columns = 2
rows = 2
spacing = [1, 1]
jitter = 0.1
velocity_jitter = 1
radius = 0.2
mass = 2
colour = "#ff0000"
"""


def test_generators_taken_apart_start_as_before() -> None:
    before = loads(TEXT)
    text = with_changes(TEXT, take_apart_changes(before, [ElementKey("stack", 0), ElementKey("grid", 0)]))
    after = loads(text)
    assert (after.grids, after.stacks, len(after.balls), len(after.boxes)) == ((), (), 4, 4)
    assert sorted(after.bodies.names) == sorted(before.bodies.names)
    for name in before.bodies.names:
        k, n = before.bodies.number_of[name], after.bodies.number_of[name]
        for column in ("position", "velocity", "angle", "angular_velocity", "mass", "moment", "radius"):
            assert getattr(before.bodies, column)[k].tobytes() == getattr(after.bodies, column)[n].tobytes()
    assert {ball.colour for ball in after.balls} == {"#ff0000"}
    assert {box.friction for box in after.boxes} == {0.8}


def test_bricks_of_a_fixed_stack_stay_fixed() -> None:
    text = "[[stack]]\nbase = [0, 0]\nsize = [1, 1]\ncolumns = 2\nrows = 2\nfixed = true\n"
    after = loads(with_changes(text, take_apart_changes(loads(text), [ElementKey("stack", 0)])))
    assert [box.fixed for box in after.boxes] == [True] * 4


WALLS = """
[[wall]]
name = "fence"  # kept
points = [[0, 0], [1, 0], [1, 1]]
closed = true
one_way = true
[[wall]]
points = [[0, 5], [1, 5], [2, 6], [3, 6]]
friction = 0.5
thickness = 0.1
[[wall]]
name = "fence 2"
points = [[7, 7], [8, 8]]
"""


def test_walls_are_divided_at_their_corners_and_keep_all_else() -> None:
    before = loads(WALLS)
    text = with_changes(WALLS, take_apart_changes(before, [ElementKey("wall", 0), ElementKey("wall", 1)]))
    after = loads(text)
    assert 'name = "fence"  # kept' in text
    assert [(wall.name, wall.points) for wall in after.walls] == [
        ("fence", ((0, 0), (1, 0))),
        (None, ((0, 5), (1, 5))),
        ("fence 2", ((7, 7), (8, 8))),
        ("fence 3", ((1, 0), (1, 1))),
        ("fence 4", ((1, 1), (0, 0))),
        ("wall", ((1, 5), (2, 6))),
        ("wall 2", ((2, 6), (3, 6))),
    ]
    assert not any(wall.closed for wall in after.walls)
    for k in (0, 3, 4):
        assert after.walls[k].one_way and after.walls[k].friction is None
    for k in (1, 5, 6):
        assert (after.walls[k].friction, after.walls[k].thickness) == (0.5, 0.1)
    with pytest.raises(TakeApartError, match="two points"):
        take_apart_changes(before, [ElementKey("wall", 2)])


def test_other_elements_cannot_be_taken_apart() -> None:
    scene = loads(TEXT + '[[ball]]\nname = "a"\nposition = [9, 9]\nradius = 1\n')
    with pytest.raises(TakeApartError, match="cannot be taken apart"):
        take_apart_changes(scene, [ElementKey("ball", 0)])
