"""Checks across the elements of a scene: references, unique names, overlaps, limits."""

import math
from typing import Any

import numpy as np
import pytest

from sandbox.scene.compile.scene import start_bodies
from sandbox.scene.description.fixed import Plane
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document, loads
from sandbox.scene.validate.bodies import MAX_OVERLAPS, MAX_OVERLAPS_EACH, count_overlaps, height_above

BALL: dict[str, Any] = {"position": [0.0, 0.0], "radius": 1.0}
GRID: dict[str, Any] = {"origin": [0, 0], "columns": 2, "spacing": [3, 3], "radius": 1}
POST: dict[str, Any] = {"position": [0.0, 9.0], "radius": 1.0}


def faults(document: dict[str, Any]) -> list[tuple[str, str]]:
    with pytest.raises(SceneError) as caught:
        from_document(document)
    return [(fault.path, fault.message) for fault in caught.value.faults]


def assert_only_fault(document: dict[str, Any], path: str, words: str) -> None:
    """Check that a document has exactly one fault, with this path and these words in its message."""
    reported = faults(document)
    assert [found_path for found_path, _ in reported] == [path]
    assert words in reported[0][1]


def test_material_must_be_declared() -> None:
    assert_only_fault({"ball": [{**BALL, "material": "rubber"}]}, "ball[0].material", "no material is named 'rubber'")
    declared = {"material": [{"name": "steel"}]}
    assert_only_fault({**declared, "post": [{**POST, "material": "Steel"}]}, "post[0].material", "materials: steel")
    for kind, thing in (
        ("plane", {"point": [0, 0], "normal": [0, 1]}),
        ("wall", {"points": [[0, 0], [1, 0]]}),
        ("grid", GRID),
        ("scatter", {"count": 1, "lower": [0, 0], "upper": [1, 1], "radius": 1}),
        ("emitter", {"position": [0, 0], "count": 1, "velocity_min": [0, 0], "velocity_max": [0, 0]}),
    ):
        assert_only_fault({kind: [{**thing, "material": "x"}]}, f"{kind}[0].material", "no material is named 'x'")
        from_document({**declared, kind: [{**thing, "material": "steel"}]})


def test_pair_names_declared_materials() -> None:
    materials = [{"name": "a"}, {"name": "b"}]
    from_document({"material": materials, "pair": [{"between": ["a", "b"]}, {"between": ["a", "a"]}]})
    assert_only_fault(
        {"material": materials, "pair": [{"between": ["a", "c"]}]}, "pair[0].between[1]", "materials: a, b"
    )
    assert [path for path, _ in faults({"pair": [{"between": ["c", "d"]}]})] == [
        "pair[0].between[0]",
        "pair[0].between[1]",
    ]


@pytest.mark.parametrize("again", [["a", "b"], ["b", "a"]])
def test_pair_given_twice_is_refused(again: list[str]) -> None:
    pairs = [{"between": ["a", "b"]}, {"between": again, "restitution": 0.5}]
    assert_only_fault({"material": [{"name": "a"}, {"name": "b"}], "pair": pairs}, "pair[1].between", "stated twice")


def test_pair_of_a_material_with_itself_given_twice_is_refused() -> None:
    pairs = [{"between": ["a", "a"]}, {"between": ["a", "a"]}]
    assert_only_fault({"material": [{"name": "a"}], "pair": pairs}, "pair[1].between", "stated twice")


def test_material_declared_twice_is_refused() -> None:
    assert_only_fault({"material": [{"name": "a"}, {"name": "a"}]}, "material.a.name", "another material")


def test_material_and_body_may_have_the_same_name() -> None:
    scene = from_document({"material": [{"name": "a"}], "ball": [{**BALL, "name": "a", "material": "a"}]})
    assert scene.bodies.names == ("a",)
    assert [material.name for material in scene.materials] == ["a"]


def test_names_of_bodies_and_fixed_elements_are_unique() -> None:
    assert_only_fault({"ball": [{**BALL, "name": "a"}, {**BALL, "name": "a"}]}, "ball.a.name", "another body")
    assert_only_fault({"ball": [{**BALL, "name": "a"}], "post": [{**POST, "name": "a"}]}, "post.a.name", "another body")
    plane, wall = {"point": [0, 0], "normal": [0, 1], "name": "a"}, {"points": [[0, 0], [1, 0]], "name": "a"}
    assert_only_fault({"plane": [plane], "wall": [wall]}, "wall.a.name", "another body")


def test_names_made_by_generators_are_unique() -> None:
    assert_only_fault({"ball": [{**BALL, "name": "grid-1-2"}], "grid": [GRID]}, "grid[0].name", "'grid-1-2'")
    from_document({"ball": [{**BALL, "name": "grid-1-3"}], "grid": [GRID]})
    assert_only_fault({"grid": [{**GRID, "name": "a"}, {**GRID, "name": "a"}]}, "grid.a.name", "'a-1'")
    from_document({"ball": [{**BALL, "name": "a"}], "grid": [{**GRID, "name": "a"}]})  # a is not a-1


def test_name_equal_to_a_default_name_is_refused() -> None:
    assert_only_fault({"ball": [BALL, {**BALL, "name": "ball-1"}]}, "ball.ball-1.name", "'ball-1'")
    assert_only_fault({"ball": [{**BALL, "name": "post-1"}], "post": [POST]}, "post[0].name", "'post-1'")


def test_names_are_compared_exactly() -> None:
    composed, decomposed = "\u00e9", "e\u0301"
    names = ["A", "a", " a", "a ", composed, decomposed]
    scene = from_document({"ball": [{**BALL, "name": name} for name in names]})
    assert scene.bodies.names == tuple(names)


@pytest.mark.parametrize("kind", ["ball", "grid"])
def test_mass_and_density_exclude_each_other(kind: str) -> None:
    thing = BALL if kind == "ball" else GRID
    assert_only_fault({kind: [{**thing, "mass": 1, "density": 1}]}, f"{kind}[0].density", "`mass`")


def test_fixed_ball_with_a_velocity_is_refused() -> None:
    from_document({"ball": [{**BALL, "fixed": True, "velocity": [0, -0.0], "angular_velocity": 0}]})
    assert_only_fault({"ball": [{**BALL, "fixed": True, "velocity": [0, 1e-300]}]}, "ball[0].velocity", "cannot move")
    assert_only_fault(
        {"ball": [{**BALL, "fixed": True, "angular_velocity": 1}]}, "ball[0].angular_velocity", "cannot move"
    )


@pytest.mark.parametrize("normal", [[0, 0], [0.0, -0.0], [1e-200, 1e-200], [1e300, 1e300], [1.7e308, 1.7e308]])
def test_normal_without_direction_is_refused(normal: list[float]) -> None:
    assert_only_fault(
        {"plane": [{"point": [0, 0], "normal": normal}], "ball": [BALL]}, "plane[0].normal", "no direction"
    )


@pytest.mark.parametrize("normal", [[0, 1e-100], [1e100, 0], [-3, 4], [1e-90, -1e-90]])
def test_normal_of_any_other_length_is_accepted(normal: list[float]) -> None:
    scene = from_document({"plane": [{"point": [0, 0], "normal": normal}], "ball": [BALL]})
    assert scene.planes[0].normal == tuple(normal)


def test_wall_with_a_segment_shorter_than_a_nanometre_is_refused() -> None:
    assert_only_fault({"wall": [{"points": [[0, 0], [0, 0]]}]}, "wall[0].points[0]", "the next point")
    assert_only_fault({"wall": [{"points": [[0, 0], [1, 0], [1, 0], [2, 0]]}]}, "wall[0].points[1]", "the next point")
    assert_only_fault(
        {"wall": [{"points": [[0, 0], [1, 0], [1, 1], [0, 0]], "closed": True}]}, "wall[0].points[3]", "the next point"
    )
    from_document({"wall": [{"points": [[0, 0], [1, 0], [1, 1], [0, 0]]}]})
    from_document({"wall": [{"points": [[0, 0], [1e-9, 0]]}]})
    assert_only_fault({"wall": [{"points": [[0, 0], [0.99e-9, 0]]}]}, "wall[0].points[0]", "1e-09")


def test_closed_wall_of_two_points_is_refused() -> None:
    assert_only_fault({"wall": [{"points": [[0, 0], [1, 0]], "closed": True}]}, "wall[0].closed", "at least three")
    from_document({"wall": [{"points": [[0, 0], [1, 0], [0, 1]], "closed": True}]})


@pytest.mark.parametrize("normal", [[0, 1], [0, 1e-50], [0, 3e50]])
@pytest.mark.parametrize("depth", [999.9, 1000.0])
def test_centre_less_than_a_kilometre_behind_a_plane_is_accepted(depth: float, normal: list[float]) -> None:
    ball = {**BALL, "position": [0, 2 - depth]}
    scene = from_document({"plane": [{"point": [5, 2], "normal": normal}], "ball": [ball]})
    assert scene.bodies.position.tolist() == [[0.0, 2 - depth]]


@pytest.mark.parametrize("normal", [[0, 1], [0, 1e-50], [0, 3e50]])
def test_centre_more_than_a_kilometre_behind_a_plane_is_refused(normal: list[float]) -> None:
    plane = {"name": "ground", "point": [5, 2], "normal": normal}
    assert_only_fault(
        {"plane": [plane], "ball": [{**BALL, "position": [0, 2 - 1000.1]}]},
        "ball[0].position",
        "1000.1 m behind the plane 'ground'",
    )
    from_document({"plane": [plane], "ball": [{**BALL, "position": [0, -2000], "collides": "none"}]})


def test_generator_far_behind_a_plane_is_a_fault_at_its_position_key() -> None:
    plane = {"point": [0, 0], "normal": [0, 1]}
    assert_only_fault(
        {"plane": [plane], "grid": [{**GRID, "rows": 2, "spacing": [3, -1001]}]}, "grid[0].origin", "1001 m behind"
    )
    scatter = {"count": 1, "lower": [0, -3000], "upper": [1, -2900], "radius": 1}
    assert_only_fault({"plane": [plane], "scatter": [scatter]}, "scatter[0].lower", "m behind")
    emitter = {"position": [0, -1001], "count": 3, "velocity_min": [0, 0], "velocity_max": [0, 0], "collides": "fixed"}
    assert_only_fault({"plane": [plane], "emitter": [emitter]}, "emitter[0].position", "1001 m behind")


def test_height_above_a_plane_does_not_depend_on_the_length_of_its_normal() -> None:
    positions = np.array([[3.0, 7.0], [-1e6, 2.0]])
    for length in (1e-100, 1.0, 1e99):
        plane = Plane(point=(1.0, 1.0), normal=(3 * length, 4 * length))
        expected = [(2 * 3 + 6 * 4) / 5, (-1000001 * 3 + 4) / 5]
        assert height_above(plane, positions) == pytest.approx(expected, rel=1e-12)  # rounding of the normal


def test_start_outside_the_bounds_is_refused_and_on_them_accepted() -> None:
    world = {"bounds": [[-1, -1], [1, 1]]}
    for position in ([1, 1], [-1, 1], [0, 0]):
        from_document({"world": world, "ball": [{**BALL, "position": position}]})
    for position in ([math.nextafter(1, 2), 0], [0, -1.5]):
        assert_only_fault({"world": world, "ball": [{**BALL, "position": position}]}, "ball[0]", "outside world.bounds")
    assert_only_fault({"world": world, "grid": [GRID]}, "grid[0]", "outside world.bounds")


@pytest.mark.parametrize("bounds", [[[1, 1], [-1, -1]], [[0, 0], [0, 1]], [[0, 0], [1, 0]], [[0, 0], [0, 0]]])
def test_bounds_without_area_are_refused(bounds: list[list[float]]) -> None:
    assert_only_fault({"world": {"bounds": bounds}}, "world.bounds", "upper right corner")


def test_more_than_a_million_bodies_in_total_are_refused() -> None:
    half = {"count": 500_000, "position": [0, 0], "velocity_min": [0, 0], "velocity_max": [0, 0]}
    from_document({"emitter": [half, half]})
    assert_only_fault(
        {"emitter": [half, half], "ball": [BALL]}, "emitter[1]", "1,000,001 bodies; the limit is 1,000,000"
    )
    assert_only_fault({"grid": [{**GRID, "columns": 10**6, "rows": 10**6}]}, "grid[0]", "1,000,000,000,000 bodies")


@pytest.mark.full
def test_million_balls_at_one_point_are_refused() -> None:
    grid = {**GRID, "columns": 1000, "rows": 1000, "spacing": [0, 0]}
    assert_only_fault({"grid": [grid]}, "grid[0]", "overlapping pairs")


@pytest.mark.parametrize("collides", ["none", "fixed"])
def test_balls_at_one_point_that_cannot_collide_are_accepted(collides: str) -> None:
    scene = from_document({"grid": [{**GRID, "columns": 1000, "spacing": [0, 0], "collides": collides}]})
    assert len(scene.bodies) == 1000


def test_overlaps_up_to_the_limit_are_accepted_and_more_refused() -> None:
    n = next(n for n in range(2, 1000) if n * (n - 1) // 2 > MAX_OVERLAPS + MAX_OVERLAPS_EACH * n)
    from_document({"grid": [{**GRID, "columns": n - 1, "spacing": [0, 0]}]})
    assert_only_fault({"grid": [{**GRID, "columns": n, "spacing": [0, 0]}]}, "grid[0]", "overlapping pairs")


def test_overlaps_are_counted_by_radii() -> None:
    position = np.array([[0.0, 0.0], [1.5, 0.0], [4.0, 0.0], [4.0, 3.0]])
    assert count_overlaps(position, np.array([1.0, 1.0, 1.0, 1.0])) == 1
    assert count_overlaps(position, np.array([1.0, 1.0, 2.0, 1.0])) == 2  # touching at 3 m is not an overlap
    assert count_overlaps(position, np.array([9.0, 9.0, 9.0, 9.0])) == 6
    assert count_overlaps(position[:1], np.ones(1)) == 0


def test_scatter_that_does_not_fit_is_refused() -> None:
    scatter = {"count": 100, "lower": [0, 0], "upper": [10, 10], "radius": 1}
    assert_only_fault({"scatter": [scatter]}, "scatter[0].count", "do not fit")
    from_document({"scatter": [{**scatter, "collides": "none"}]})
    from_document({"scatter": [{**scatter, "collides": "fixed"}]})
    from_document({"scatter": [{**scatter, "radius": 0.1}]})


def test_scatter_of_one_fits_any_box() -> None:
    for upper in ([5, 5], [6, 5]):
        scene = from_document({"scatter": [{"count": 1, "lower": [5, 5], "upper": upper, "radius": 3}]})
        assert scene.bodies.position[0, 1] == 5.0


def test_corners_and_velocities_in_the_wrong_order_are_refused() -> None:
    scatter = {"count": 1, "lower": [0, 0], "upper": [1, -1], "radius": 1}
    assert_only_fault({"scatter": [scatter]}, "scatter[0].upper", "`lower`")
    emitter = {"position": [0, 0], "count": 1, "velocity_min": [0, 1], "velocity_max": [1, 0]}
    assert_only_fault({"emitter": [emitter]}, "emitter[0].velocity_max", "`velocity_min`")


def test_generator_that_makes_balls_out_of_range_is_refused() -> None:
    assert_only_fault({"grid": [{**GRID, "columns": 3, "spacing": [1e16, 0]}]}, "grid[0]", "from the origin")
    from_document({"grid": [{**GRID, "columns": 2, "spacing": [1e16, 0]}]})
    fast = {"position": [0, 0], "count": 50, "velocity_min": [0, 0], "velocity_max": [1e12, 0]}
    from_document({"emitter": [fast]})
    assert_only_fault(
        {"grid": [{**GRID, "columns": 50, "velocity": [1e12, 0], "velocity_jitter": 1e11}]}, "grid[0]", "faster than"
    )


def test_more_than_256_different_surfaces_are_refused() -> None:
    def balls(n: int) -> list[dict[str, Any]]:
        return [{**BALL, "position": [3 * k, 0], "friction": k / 1000} for k in range(n)]

    from_document({"ball": balls(256)})
    assert_only_fault({"ball": balls(257)}, "", "256 different surfaces")
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
    with pytest.raises(SceneError) as caught:
        loads(text)
    assert {(fault.line, fault.path) for fault in caught.value.faults} >= {
        (3, "world.bounds"), (8, "material.m.name"), (10, "pair[0].between[1]"), (13, "plane[0].normal"),
        (15, "wall[0].points[0]"), (16, "wall[0].closed"), (21, "ball[0].density"), (23, "ball[0].velocity"),
        (None, "solver.dt"),
    }  # fmt: skip


def test_start_bodies_of_a_valid_scene_are_reproducible() -> None:
    scene = from_document({"ball": [BALL], "grid": [{**GRID, "origin": [9, 9]}]})
    assert np.array_equal(start_bodies(scene).position, scene.bodies.position)


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
    with pytest.raises(SceneError) as error:
        loads(text)
    assert [fault.path for fault in error.value.faults] == ["polygon.thin.points[0]"]
