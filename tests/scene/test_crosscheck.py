"""Checks across the elements of a scene: references, unique names, overlaps, limits."""

import math
from typing import Any

import numpy as np
import pytest

from sandbox.scene.description.fixed import Plane
from sandbox.scene.files.load import from_document
from sandbox.scene.validate.bodies import MAX_OVERLAPS, MAX_OVERLAPS_EACH, count_overlaps, height_above
from tests.scene.faults import assert_faults, fault_paths, faults_of

BALL: dict[str, Any] = {"position": [0.0, 0.0], "radius": 1.0}
NAMED: dict[str, Any] = {**BALL, "name": "a"}
FIXED: dict[str, Any] = {**BALL, "fixed": True}
GRID: dict[str, Any] = {"origin": [0, 0], "columns": 2, "spacing": [3, 3], "radius": 1}
POST: dict[str, Any] = {"position": [0.0, 9.0], "radius": 1.0}
PLANE: dict[str, Any] = {"point": [0, 0], "normal": [0, 1]}
WALL: dict[str, Any] = {"points": [[0, 0], [1, 0]]}
SCATTER: dict[str, Any] = {"count": 1, "lower": [0, 0], "upper": [1, 1], "radius": 1}
STILL: dict[str, Any] = {"position": [0, 0], "count": 3, "velocity_min": [0, 0], "velocity_max": [0, 0]}
HALF: dict[str, Any] = {**STILL, "count": 500_000}
A, B = {"name": "a"}, {"name": "b"}
BOUNDED: dict[str, Any] = {"world": {"bounds": [[-1, -1], [1, 1]]}}
TRIANGLE = [[0, 0], [1, 0], [1, 1]]
CROWDED: dict[str, Any] = {**SCATTER, "count": 100, "upper": [10, 10]}

FAULTY: list[tuple[dict[str, Any], str]] = [
    # materials and pairs
    ({"ball": [{**BALL, "material": "rubber"}]}, "ball[0].material: 'rubber'"),
    ({"material": [{"name": "steel"}], "post": [{**POST, "material": "Steel"}]}, "post[0].material: materials: steel"),
    ({"material": [A, B], "pair": [{"between": ["a", "c"]}]}, "pair[0].between[1]: materials: a, b"),
    ({"material": [A, B], "pair": [{"between": ["a", "b"]}, {"between": ["a", "b"]}]}, "pair[1].between: twice"),
    ({"material": [A, B], "pair": [{"between": ["a", "b"]}, {"between": ["b", "a"]}]}, "pair[1].between: twice"),
    ({"material": [A], "pair": [{"between": ["a", "a"]}, {"between": ["a", "a"]}]}, "pair[1].between: twice"),
    ({"material": [A, A]}, "material.a.name: another material"),
    *(
        ({kind: [{**element, "material": "x"}]}, f"{kind}[0].material: 'x'")
        for kind, element in (
            ("plane", PLANE),
            ("wall", WALL),
            ("grid", GRID),
            ("scatter", SCATTER),
            ("emitter", STILL),
        )
    ),
    # names
    ({"ball": [NAMED, NAMED]}, "ball.a.name: another body"),
    ({"ball": [NAMED], "post": [{**POST, **A}]}, "post.a.name: another body"),
    ({"plane": [{**PLANE, **A}], "wall": [{**WALL, **A}]}, "wall.a.name: another body"),
    ({"ball": [{**BALL, "name": "grid-1-2"}], "grid": [GRID]}, "grid[0].name: 'grid-1-2'"),
    ({"grid": [{**GRID, **A}, {**GRID, **A}]}, "grid.a.name: 'a-1'"),
    ({"ball": [BALL, {**BALL, "name": "ball-1"}]}, "ball.ball-1.name: 'ball-1'"),
    ({"ball": [{**BALL, "name": "post-1"}], "post": [POST]}, "post[0].name: 'post-1'"),
    # values that exclude each other
    ({"ball": [{**BALL, "mass": 1, "density": 1}]}, "ball[0].density: `mass`"),
    ({"grid": [{**GRID, "mass": 1, "density": 1}]}, "grid[0].density: `mass`"),
    ({"ball": [{**FIXED, "velocity": [0, 1e-300]}]}, "ball[0].velocity: cannot move"),
    ({"ball": [{**FIXED, "angular_velocity": 1}]}, "ball[0].angular_velocity: cannot move"),
    ({"scatter": [{**SCATTER, "upper": [1, -1]}]}, "scatter[0].upper: `lower`"),
    (
        {"emitter": [{**STILL, "velocity_min": [0, 1], "velocity_max": [1, 0]}]},
        "emitter[0].velocity_max: `velocity_min`",
    ),
    # geometry
    *(
        ({"plane": [{**PLANE, "normal": normal}]}, "plane[0].normal: no direction")
        for normal in ([0.0, -0.0], [1e-200, 1e-200], [1.7e308, 1.7e308])
    ),
    ({"wall": [{"points": [[0, 0], [0, 0]]}]}, "wall[0].points[0]: the next point"),
    ({"wall": [{"points": [[0, 0], [1, 0], [1, 0], [2, 0]]}]}, "wall[0].points[1]: the next point"),
    ({"wall": [{"points": [*TRIANGLE, [0, 0]], "closed": True}]}, "wall[0].points[3]: the next point"),
    ({"wall": [{"points": [[0, 0], [0.99e-9, 0]]}]}, "wall[0].points[0]: 1e-09"),
    ({"wall": [{**WALL, "closed": True}]}, "wall[0].closed: three"),
    ({**BOUNDED, "ball": [{**BALL, "position": [math.nextafter(1, 2), 0]}]}, "ball[0]: outside world.bounds"),
    ({**BOUNDED, "ball": [{**BALL, "position": [0, -1.5]}]}, "ball[0]: outside world.bounds"),
    ({**BOUNDED, "grid": [GRID]}, "grid[0]: outside world.bounds"),
    ({"world": {"bounds": [[0, 0], [0, 1]]}}, "world.bounds: upper right corner"),
    ({"world": {"bounds": [[0, 0], [1, 0]]}}, "world.bounds: upper right corner"),
    ({"plane": [PLANE], "grid": [{**GRID, "rows": 2, "spacing": [3, -1001]}]}, "grid[0].origin: 1001 m behind"),
    (
        {"plane": [PLANE], "scatter": [{**SCATTER, "lower": [0, -3000], "upper": [1, -2900]}]},
        "scatter[0].lower: m behind",
    ),
    (
        {"plane": [PLANE], "emitter": [{**STILL, "position": [0, -1001], "collides": "fixed"}]},
        "emitter[0].position: 1001 m behind",
    ),
    # numbers and distances of generated bodies
    ({"emitter": [HALF, HALF], "ball": [BALL]}, "emitter[1]: 1,000,001 bodies; the limit is 1,000,000"),
    ({"grid": [{**GRID, "columns": 10**6, "rows": 10**6}]}, "grid[0]: 1,000,000,000,000 bodies"),
    ({"grid": [{**GRID, "columns": 3, "spacing": [1e16, 0]}]}, "grid[0]: from the origin"),
    ({"grid": [{**GRID, "columns": 50, "velocity": [1e12, 0], "velocity_jitter": 1e11}]}, "grid[0]: faster than"),
    ({"scatter": [CROWDED]}, "scatter[0].count: do not fit"),
]


@pytest.mark.parametrize(("document", "fault"), FAULTY)
def test_scene_has_one_fault_with_its_path(document: dict[str, Any], fault: str) -> None:
    assert_faults(document, fault)


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(
    "document",
    [
        {"material": [A, B], "pair": [{"between": ["a", "b"]}, {"between": ["a", "a"]}]},
        {"ball": [{**BALL, "name": "grid-1-3"}], "grid": [GRID]},
        {"ball": [NAMED], "grid": [{**GRID, **A}]},  # a is not a-1
        {"ball": [{**FIXED, "velocity": [0, -0.0], "angular_velocity": 0}]},
        {"wall": [{"points": [*TRIANGLE, [0, 0]]}]},
        {"wall": [{"points": [[0, 0], [1e-9, 0]]}]},
        {"wall": [{"points": TRIANGLE, "closed": True}]},
        {**BOUNDED, "ball": [{**BALL, "position": [1, 1]}, {**BALL, "position": [-1, 1]}]},
        {"emitter": [HALF, HALF]},
        {"grid": [{**GRID, "columns": 2, "spacing": [1e16, 0]}]},
        {"emitter": [{**STILL, "count": 50, "velocity_max": [1e12, 0]}]},
        {"scatter": [{**CROWDED, "collides": "none"}, {**CROWDED, "collides": "fixed"}, {**CROWDED, "radius": 0.1}]},
        {"plane": [PLANE], "ball": [{**BALL, "position": [0, -2000], "collides": "none"}]},
    ],
)
def test_scene_at_the_edge_of_a_rule_is_accepted(document: dict[str, Any]) -> None:
    assert from_document(document) is not None


def test_unknown_materials_of_a_pair_are_both_reported() -> None:
    assert fault_paths({"pair": [{"between": ["c", "d"]}]}) == ["pair[0].between[0]", "pair[0].between[1]"]


def test_material_and_body_may_have_the_same_name() -> None:
    scene = from_document({"material": [A], "ball": [{**NAMED, "material": "a"}]})
    assert (scene.bodies.names, [material.name for material in scene.materials]) == (("a",), ["a"])


def test_names_are_compared_exactly() -> None:
    composed, decomposed = "\u00e9", "e\u0301"
    names = ["A", "a", " a", "a ", composed, decomposed]
    scene = from_document({"ball": [{**BALL, "name": name} for name in names]})
    assert scene.bodies.names == tuple(names)


@pytest.mark.parametrize("normal", [[0, 1e-100], [1e100, 0], [-3, 4]])
def test_normal_of_any_other_length_is_accepted(normal: list[float]) -> None:
    scene = from_document({"plane": [{"point": [0, 0], "normal": normal}], "ball": [BALL]})
    assert scene.planes[0].normal == tuple(normal)


@pytest.mark.parametrize("normal", [[0, 1], [0, 1e-50], [0, 3e50]])
def test_centre_more_than_a_kilometre_behind_a_plane_is_refused(normal: list[float]) -> None:
    plane = {"name": "ground", "point": [5, 2], "normal": normal}
    scene = from_document({"plane": [plane], "ball": [{**BALL, "position": [0, 2 - 1000.0]}]})
    assert scene.bodies.position.tolist() == [[0.0, 2 - 1000.0]]
    far = {**BALL, "position": [0, 2 - 1000.1]}
    assert_faults({"plane": [plane], "ball": [far]}, "ball[0].position: 1000.1 m behind the plane 'ground'")


def test_height_above_a_plane_does_not_depend_on_the_length_of_its_normal() -> None:
    positions = np.array([[3.0, 7.0], [-1e6, 2.0]])
    for length in (1e-100, 1.0, 1e99):
        plane = Plane(point=(1.0, 1.0), normal=(3 * length, 4 * length))
        expected = [(2 * 3 + 6 * 4) / 5, (-1000001 * 3 + 4) / 5]
        assert height_above(plane, positions) == pytest.approx(expected, rel=1e-12)  # rounding of the normal


@pytest.mark.fail_slow(60)  # takes over half a second
def test_million_balls_at_one_point_are_refused() -> None:
    grid = {**GRID, "columns": 1000, "rows": 1000, "spacing": [0, 0]}
    assert_faults({"grid": [grid]}, "grid[0]: overlapping pairs")


@pytest.mark.parametrize("collides", ["none", "fixed"])
def test_balls_at_one_point_that_cannot_collide_are_accepted(collides: str) -> None:
    scene = from_document({"grid": [{**GRID, "columns": 1000, "spacing": [0, 0], "collides": collides}]})
    assert len(scene.bodies) == 1000


def test_overlaps_up_to_the_limit_are_accepted_and_more_refused() -> None:
    n = next(n for n in range(2, 1000) if n * (n - 1) // 2 > MAX_OVERLAPS + MAX_OVERLAPS_EACH * n)
    from_document({"grid": [{**GRID, "columns": n - 1, "spacing": [0, 0]}]})
    assert_faults({"grid": [{**GRID, "columns": n, "spacing": [0, 0]}]}, "grid[0]: overlapping pairs")


def test_overlaps_are_counted_by_radii() -> None:
    position = np.array([[0.0, 0.0], [1.5, 0.0], [4.0, 0.0], [4.0, 3.0]])
    assert count_overlaps(position, np.array([1.0, 1.0, 1.0, 1.0])) == 1
    assert count_overlaps(position, np.array([1.0, 1.0, 2.0, 1.0])) == 2  # touching at 3 m is not an overlap
    assert count_overlaps(position, np.array([9.0, 9.0, 9.0, 9.0])) == 6
    assert count_overlaps(position[:1], np.ones(1)) == 0


def test_scatter_of_one_fits_any_box() -> None:
    for upper in ([5, 5], [6, 5]):
        scene = from_document({"scatter": [{"count": 1, "lower": [5, 5], "upper": upper, "radius": 3}]})
        assert scene.bodies.position[0, 1] == 5.0


def test_more_than_256_different_surfaces_are_refused() -> None:
    def balls(n: int) -> list[dict[str, Any]]:
        return [{**BALL, "position": [3 * k, 0], "friction": k / 1000} for k in range(n)]

    from_document({"ball": balls(256)})
    assert_faults({"ball": balls(257)}, ": 256 different surfaces")
    same = [{**BALL, "position": [3 * k, 0], "material": f"m{k}"} for k in range(300)]
    from_document({"ball": same, "material": [{"name": f"m{k}"} for k in range(300)]})  # all have equal coefficients


def test_faults_of_all_kinds_are_reported_together() -> None:
    text = """
[world]
bounds = [[0, 0], [0, 0]]
duration = 1e9
[[material]]
name = "m"
[[material]]
name = "m"
[[pair]]
between = ["m", "n"]
[[plane]]
point = [0, 0]
normal = [0, 0]
[[wall]]
points = [[0, 0], [0, 0]]
closed = true
[[ball]]
position = [0, 0]
radius = 1
mass = 1
density = 1
fixed = true
velocity = [1, 0]
"""
    assert {(fault.line, fault.path) for fault in faults_of(text)} >= {
        (3, "world.bounds"), (8, "material.m.name"), (10, "pair[0].between[1]"), (13, "plane[0].normal"),
        (15, "wall[0].points[0]"), (16, "wall[0].closed"), (21, "ball[0].density"), (23, "ball[0].velocity"),
        (None, "solver.dt"),
    }  # fmt: skip


def test_faulty_outline_adds_no_fault_to_the_moment_of_another_body():
    text = """
[[body]]
name = "bat"
position = [0, 0]
mass = 0.08
[[body.ball]]
radius = 0.1
[[drive]]
kind = "torque"
body = "bat"
pivot = [0.1, 0]
stops = [-0.5, 0.5]
moment = 0.01
torque = 1
[[polygon]]
name = "thin"
points = [[0.0, 0.0], [0.04, 1e16], [-4.2, -0.02]]
"""
    assert fault_paths(text) == ["polygon.thin.points[0]"]
