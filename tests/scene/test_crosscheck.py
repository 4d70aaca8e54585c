"""What the parts of a scene say about each other."""

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


def only(document: dict[str, Any], path: str, words: str) -> None:
    """Check that a document has exactly one fault, with that path and those words."""
    found = faults(document)
    assert [place for place, _ in found] == [path]
    assert words in found[0][1]


def test_material_must_be_declared() -> None:
    only({"ball": [{**BALL, "material": "rubber"}]}, "ball[0].material", "no material is named 'rubber'")
    declared = {"material": [{"name": "steel"}]}
    only({**declared, "post": [{**POST, "material": "Steel"}]}, "post[0].material", "materials: steel")
    for kind, thing in (
        ("plane", {"point": [0, 0], "normal": [0, 1]}),
        ("wall", {"points": [[0, 0], [1, 0]]}),
        ("grid", GRID),
        ("scatter", {"count": 1, "lower": [0, 0], "upper": [1, 1], "radius": 1}),
        ("emitter", {"position": [0, 0], "count": 1, "velocity_min": [0, 0], "velocity_max": [0, 0]}),
    ):
        only({kind: [{**thing, "material": "x"}]}, f"{kind}[0].material", "no material is named 'x'")
        from_document({**declared, kind: [{**thing, "material": "steel"}]})


def test_pair_names_declared_materials() -> None:
    materials = [{"name": "a"}, {"name": "b"}]
    from_document({"material": materials, "pair": [{"between": ["a", "b"]}, {"between": ["a", "a"]}]})
    only({"material": materials, "pair": [{"between": ["a", "c"]}]}, "pair[0].between[1]", "materials: a, b")
    assert [path for path, _ in faults({"pair": [{"between": ["c", "d"]}]})] == [
        "pair[0].between[0]",
        "pair[0].between[1]",
    ]


@pytest.mark.parametrize("again", [["a", "b"], ["b", "a"]])
def test_pair_is_stated_once(again: list[str]) -> None:
    pairs = [{"between": ["a", "b"]}, {"between": again, "restitution": 0.5}]
    only({"material": [{"name": "a"}, {"name": "b"}], "pair": pairs}, "pair[1].between", "stated twice")


def test_pair_of_a_material_with_itself_is_stated_once() -> None:
    pairs = [{"between": ["a", "a"]}, {"between": ["a", "a"]}]
    only({"material": [{"name": "a"}], "pair": pairs}, "pair[1].between", "stated twice")


def test_material_is_declared_once() -> None:
    only({"material": [{"name": "a"}, {"name": "a"}]}, "material.a.name", "another material")


def test_material_and_body_may_share_a_name() -> None:
    scene = from_document({"material": [{"name": "a"}], "ball": [{**BALL, "name": "a", "material": "a"}]})
    assert scene.bodies.names == ("a",)
    assert [material.name for material in scene.materials] == ["a"]


def test_names_are_unique_over_bodies_and_fixed_things() -> None:
    only({"ball": [{**BALL, "name": "a"}, {**BALL, "name": "a"}]}, "ball.a.name", "another body")
    only({"ball": [{**BALL, "name": "a"}], "post": [{**POST, "name": "a"}]}, "post.a.name", "another body")
    plane, wall = {"point": [0, 0], "normal": [0, 1], "name": "a"}, {"points": [[0, 0], [1, 0]], "name": "a"}
    only({"plane": [plane], "wall": [wall]}, "wall.a.name", "another body")


def test_names_are_unique_over_names_that_generators_make() -> None:
    only({"ball": [{**BALL, "name": "grid-1-2"}], "grid": [GRID]}, "grid[0].name", "'grid-1-2'")
    from_document({"ball": [{**BALL, "name": "grid-1-3"}], "grid": [GRID]})
    only({"grid": [{**GRID, "name": "a"}, {**GRID, "name": "a"}]}, "grid.a.name", "'a-1'")
    from_document({"ball": [{**BALL, "name": "a"}], "grid": [{**GRID, "name": "a"}]})  # a is not a-1


def test_names_are_unique_over_default_names() -> None:
    only({"ball": [BALL, {**BALL, "name": "ball-1"}]}, "ball.ball-1.name", "'ball-1'")
    only({"ball": [{**BALL, "name": "post-1"}], "post": [POST]}, "post[0].name", "'post-1'")


def test_names_are_told_apart_to_the_letter() -> None:
    composed, decomposed = "\u00e9", "e\u0301"
    called = ["A", "a", " a", "a ", composed, decomposed]
    scene = from_document({"ball": [{**BALL, "name": name} for name in called]})
    assert scene.bodies.names == tuple(called)


@pytest.mark.parametrize("kind", ["ball", "grid"])
def test_mass_and_density_exclude_each_other(kind: str) -> None:
    thing = BALL if kind == "ball" else GRID
    only({kind: [{**thing, "mass": 1, "density": 1}]}, f"{kind}[0].density", "`mass`")


def test_fixed_ball_has_no_motion_of_its_own() -> None:
    from_document({"ball": [{**BALL, "fixed": True, "velocity": [0, -0.0], "angular_velocity": 0}]})
    only({"ball": [{**BALL, "fixed": True, "velocity": [0, 1e-300]}]}, "ball[0].velocity", "cannot move")
    only({"ball": [{**BALL, "fixed": True, "angular_velocity": 1}]}, "ball[0].angular_velocity", "cannot move")


@pytest.mark.parametrize("normal", [[0, 0], [0.0, -0.0], [1e-200, 1e-200], [1e300, 1e300], [1.7e308, 1.7e308]])
def test_normal_without_direction_is_refused(normal: list[float]) -> None:
    only({"plane": [{"point": [0, 0], "normal": normal}], "ball": [BALL]}, "plane[0].normal", "no direction")


@pytest.mark.parametrize("normal", [[0, 1e-100], [1e100, 0], [-3, 4], [1e-90, -1e-90]])
def test_normal_of_any_other_length_is_taken(normal: list[float]) -> None:
    scene = from_document({"plane": [{"point": [0, 0], "normal": normal}], "ball": [BALL]})
    assert scene.planes[0].normal == tuple(normal)


def test_wall_of_zero_length_segments_is_refused_where_it_doubles_back() -> None:
    only({"wall": [{"points": [[0, 0], [0, 0]]}]}, "wall[0].points[0]", "the next point")
    only({"wall": [{"points": [[0, 0], [1, 0], [1, 0], [2, 0]]}]}, "wall[0].points[1]", "the next point")
    only(
        {"wall": [{"points": [[0, 0], [1, 0], [1, 1], [0, 0]], "closed": True}]}, "wall[0].points[3]", "the next point"
    )
    from_document({"wall": [{"points": [[0, 0], [1, 0], [1, 1], [0, 0]]}]})
    from_document({"wall": [{"points": [[0, 0], [1e-9, 0]]}]})
    only({"wall": [{"points": [[0, 0], [0.99e-9, 0]]}]}, "wall[0].points[0]", "1e-09")


def test_closed_wall_of_two_points_is_refused() -> None:
    only({"wall": [{"points": [[0, 0], [1, 0]], "closed": True}]}, "wall[0].closed", "at least three")
    from_document({"wall": [{"points": [[0, 0], [1, 0], [0, 1]], "closed": True}]})


@pytest.mark.parametrize("normal", [[0, 1], [0, 1e-50], [0, 3e50]])
@pytest.mark.parametrize("depth", [999.9, 1000.0])
def test_centre_less_than_a_kilometre_behind_a_plane_is_taken(depth: float, normal: list[float]) -> None:
    ball = {**BALL, "position": [0, 2 - depth]}
    scene = from_document({"plane": [{"point": [5, 2], "normal": normal}], "ball": [ball]})
    assert scene.bodies.position.tolist() == [[0.0, 2 - depth]]


@pytest.mark.parametrize("normal", [[0, 1], [0, 1e-50], [0, 3e50]])
def test_centre_deeper_behind_a_plane_is_refused(normal: list[float]) -> None:
    plane = {"name": "ground", "point": [5, 2], "normal": normal}
    only(
        {"plane": [plane], "ball": [{**BALL, "position": [0, 2 - 1000.1]}]},
        "ball[0].position",
        "1000.1 m behind the plane 'ground'",
    )
    from_document({"plane": [plane], "ball": [{**BALL, "position": [0, -2000], "collides": "none"}]})


def test_deep_start_of_generators_is_found_at_the_key_that_says_where() -> None:
    plane = {"point": [0, 0], "normal": [0, 1]}
    only({"plane": [plane], "grid": [{**GRID, "rows": 2, "spacing": [3, -1001]}]}, "grid[0].origin", "1001 m behind")
    scatter = {"count": 1, "lower": [0, -3000], "upper": [1, -2900], "radius": 1}
    only({"plane": [plane], "scatter": [scatter]}, "scatter[0].lower", "m behind")
    emitter = {"position": [0, -1001], "count": 3, "velocity_min": [0, 0], "velocity_max": [0, 0], "collides": "fixed"}
    only({"plane": [plane], "emitter": [emitter]}, "emitter[0].position", "1001 m behind")


def test_height_above_a_plane_does_not_depend_on_the_length_of_its_normal() -> None:
    places = np.array([[3.0, 7.0], [-1e6, 2.0]])
    for length in (1e-100, 1.0, 1e99):
        plane = Plane(point=(1.0, 1.0), normal=(3 * length, 4 * length))
        expected = [(2 * 3 + 6 * 4) / 5, (-1000001 * 3 + 4) / 5]
        assert height_above(plane, places) == pytest.approx(expected, rel=1e-12)  # rounding of the normal


def test_start_outside_the_bounds_is_refused_and_on_them_taken() -> None:
    world = {"bounds": [[-1, -1], [1, 1]]}
    for position in ([1, 1], [-1, 1], [0, 0]):
        from_document({"world": world, "ball": [{**BALL, "position": position}]})
    for position in ([math.nextafter(1, 2), 0], [0, -1.5]):
        only({"world": world, "ball": [{**BALL, "position": position}]}, "ball[0]", "outside world.bounds")
    only({"world": world, "grid": [GRID]}, "grid[0]", "outside world.bounds")


@pytest.mark.parametrize("bounds", [[[1, 1], [-1, -1]], [[0, 0], [0, 1]], [[0, 0], [1, 0]], [[0, 0], [0, 0]]])
def test_bounds_that_enclose_nothing_are_refused(bounds: list[list[float]]) -> None:
    only({"world": {"bounds": bounds}}, "world.bounds", "upper right corner")


def test_bodies_are_at_most_a_million_over_all_generators() -> None:
    half = {"count": 500_000, "position": [0, 0], "velocity_min": [0, 0], "velocity_max": [0, 0]}
    from_document({"emitter": [half, half]})
    only({"emitter": [half, half], "ball": [BALL]}, "emitter[1]", "1,000,001 bodies; the limit is 1,000,000")
    only({"grid": [{**GRID, "columns": 10**6, "rows": 10**6}]}, "grid[0]", "1,000,000,000,000 bodies")


def test_million_balls_in_one_spot_are_refused() -> None:
    spot = {**GRID, "columns": 1000, "rows": 1000, "spacing": [0, 0]}
    only({"grid": [spot]}, "grid[0]", "overlapping pairs")


@pytest.mark.parametrize("collides", ["none", "fixed"])
def test_any_number_of_balls_in_one_spot_may_pass_through_each_other(collides: str) -> None:
    scene = from_document({"grid": [{**GRID, "columns": 1000, "spacing": [0, 0], "collides": collides}]})
    assert len(scene.bodies) == 1000


def test_overlaps_are_taken_up_to_their_number_and_refused_beyond() -> None:
    n = next(n for n in range(2, 1000) if n * (n - 1) // 2 > MAX_OVERLAPS + MAX_OVERLAPS_EACH * n)
    from_document({"grid": [{**GRID, "columns": n - 1, "spacing": [0, 0]}]})
    only({"grid": [{**GRID, "columns": n, "spacing": [0, 0]}]}, "grid[0]", "overlapping pairs")


def test_overlaps_are_those_whose_radii_reach() -> None:
    position = np.array([[0.0, 0.0], [1.5, 0.0], [4.0, 0.0], [4.0, 3.0]])
    assert count_overlaps(position, np.array([1.0, 1.0, 1.0, 1.0])) == 1
    assert count_overlaps(position, np.array([1.0, 1.0, 2.0, 1.0])) == 2  # touching at 3 is no overlap
    assert count_overlaps(position, np.array([9.0, 9.0, 9.0, 9.0])) == 6
    assert count_overlaps(position[:1], np.ones(1)) == 0


def test_scatter_that_does_not_fit_is_refused() -> None:
    scatter = {"count": 100, "lower": [0, 0], "upper": [10, 10], "radius": 1}
    only({"scatter": [scatter]}, "scatter[0].count", "do not fit")
    from_document({"scatter": [{**scatter, "collides": "none"}]})
    from_document({"scatter": [{**scatter, "collides": "fixed"}]})
    from_document({"scatter": [{**scatter, "radius": 0.1}]})


def test_scatter_of_one_fits_any_box() -> None:
    for upper in ([5, 5], [6, 5]):
        scene = from_document({"scatter": [{"count": 1, "lower": [5, 5], "upper": upper, "radius": 3}]})
        assert scene.bodies.position[0, 1] == 5.0


def test_corners_and_velocities_in_the_wrong_order_are_refused() -> None:
    scatter = {"count": 1, "lower": [0, 0], "upper": [1, -1], "radius": 1}
    only({"scatter": [scatter]}, "scatter[0].upper", "`lower`")
    emitter = {"position": [0, 0], "count": 1, "velocity_min": [0, 1], "velocity_max": [1, 0]}
    only({"emitter": [emitter]}, "emitter[0].velocity_max", "`velocity_min`")


def test_generator_that_carries_balls_out_of_range_is_refused() -> None:
    only({"grid": [{**GRID, "columns": 3, "spacing": [1e16, 0]}]}, "grid[0]", "from the origin")
    from_document({"grid": [{**GRID, "columns": 2, "spacing": [1e16, 0]}]})
    fast = {"position": [0, 0], "count": 50, "velocity_min": [0, 0], "velocity_max": [1e12, 0]}
    from_document({"emitter": [fast]})
    only({"grid": [{**GRID, "columns": 50, "velocity": [1e12, 0], "velocity_jitter": 1e11}]}, "grid[0]", "faster than")


def test_surfaces_are_at_most_256_different_ones() -> None:
    def balls(n: int) -> list[dict[str, Any]]:
        return [{**BALL, "position": [3 * k, 0], "friction": k / 1000} for k in range(n)]

    from_document({"ball": balls(256)})
    only({"ball": balls(257)}, "", "256 different surfaces")
    same = [{**BALL, "position": [3 * k, 0], "material": f"m{k}"} for k in range(300)]
    from_document({"ball": same, "material": [{"name": f"m{k}"} for k in range(300)]})  # all alike


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


def test_bodies_can_be_laid_out_again_from_a_scene_that_passed() -> None:
    scene = from_document({"ball": [BALL], "grid": [{**GRID, "origin": [9, 9]}]})
    assert np.array_equal(start_bodies(scene).position, scene.bodies.position)


def test_outline_with_a_fault_makes_no_other_body_heavy():
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
