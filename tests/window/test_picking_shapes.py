"""Picking, overlaps, facts and edits of bodies that are not discs."""

import math
from typing import Any

import numpy as np
import pygame
import pytest

from sandbox.action import Spawn
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Contacts, Frame
from sandbox.window.camera import Camera
from sandbox.window.hit_test import (
    Hull,
    distance_from_hull,
    hull_area,
    hull_gap,
    overlapping_bodies,
    pick_body,
    rounded_hull,
)
from sandbox.window.input.body_tools import BodyTools
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.session import Session
from sandbox.window.playback.snapshot import Snapshot
from sandbox.window.render.draw_context import DrawContext
from sandbox.window.render.vectors import contact_points
from sandbox.window.ui.status import body_facts
from sandbox.window.view_bounds import view_bounds


def scene(**tables: Any) -> Scene:
    return from_document(tables)


def start(shape_scene: Scene) -> Frame:
    bodies = shape_scene.bodies
    present = np.ones(len(bodies), np.bool_)
    return Frame(0.0, bodies.position, bodies.velocity, bodies.angle, bodies.angular_velocity, present)


def box(x: float, y: float, width: float, height: float, **more: Any) -> dict[str, Any]:
    return {"position": [x, y], "size": [width, height], **more}


BEAM = scene(box=[box(0, 0, 8, 0.5, angle=math.pi / 4)])
HAMMER = scene(body=[{"position": [0, 0], "box": [{"size": [4, 0.5]}, {"size": [1, 3], "position": [2, 0]}]}])


@pytest.mark.parametrize(
    ("point", "found"), [((2.5, 2.5), 0), ((2.0, -2.0), None), ((0.0, 0.3), 0), ((0.0, 0.4), None)]
)
def test_body_is_picked_only_within_its_outline(point: tuple[float, float], found: int | None) -> None:
    assert pick_body(BEAM.bodies, start(BEAM), point) == found


def test_pick_reach_is_measured_from_the_outline() -> None:
    frame = start(BEAM)
    beside = 0.25 * math.sqrt(2.0) + 0.1 * math.sqrt(2.0)  # 0.1 m off the upper side
    assert pick_body(BEAM.bodies, frame, (0.0, beside), 0.09) is None
    assert pick_body(BEAM.bodies, frame, (0.0, beside), 0.11) == 0


def test_every_piece_of_a_body_can_be_picked() -> None:
    frame = start(HAMMER)
    for point in ((-1.9, 0.0), (2.4, 1.4), (1.6, -1.4)):
        assert pick_body(HAMMER.bodies, frame, point) == 0
    assert pick_body(HAMMER.bodies, frame, (0.0, 1.0)) is None


def test_ball_on_a_box_is_picked_before_the_box() -> None:
    shape_scene = scene(ball=[{"position": [0, 1.25], "radius": 0.25}], box=[box(0, 0, 9, 2)])
    assert pick_body(shape_scene.bodies, start(shape_scene), (0.0, 1.2)) == 0
    assert pick_body(shape_scene.bodies, start(shape_scene), (4.0, 0.9)) == 1


@pytest.mark.parametrize(
    ("tables", "expected"),
    [
        ({"box": [box(0, 0, 2, 2), box(2.01, 0, 2, 2)]}, [False, False]),
        ({"box": [box(0, 0, 2, 2), box(1.99, 0, 2, 2)]}, [True, True]),
        ({"box": [box(0, 0, 4, 0.5), box(0, 0, 0.5, 4)]}, [True, True]),
        ({"box": [box(0, 0, 2, 2), box(2.2, 2.2, 2, 2, angle=math.pi / 4)]}, [False, False]),
        ({"box": [box(0, 1, 2, 2)], "plane": [{"point": [0, -0.01], "normal": [0, 1]}]}, [False]),
        ({"box": [box(0, 1, 2, 2)], "plane": [{"point": [0, 0.01], "normal": [0, 1]}]}, [True]),
        ({"box": [box(0, 0, 8, 1)], "post": [{"position": [3, 1], "radius": 0.6}]}, [True]),
        ({"box": [box(0, 0, 8, 1)], "post": [{"position": [0, 2], "radius": 0.6}]}, [False]),
        ({"box": [box(0, 0, 8, 1)], "wall": [{"points": [[3, -3], [3, 3]], "thickness": 0.1}]}, [True]),
        ({"ball": [{"position": [0, 1.4], "radius": 1.0}], "box": [box(0, 0, 1, 1)]}, [True, True]),
        ({"ball": [{"position": [1.2, 1.2], "radius": 0.98}], "box": [box(0, 0, 1, 1)]}, [False, False]),
    ],
)
def test_overlap_is_computed_from_outlines(tables: dict[str, Any], expected: list[bool]) -> None:
    shape_scene = scene(**tables)
    assert overlapping_bodies(shape_scene, shape_scene.bodies, start(shape_scene)).tolist() == expected


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("count", [1, 2, 3, 5])
@pytest.mark.parametrize("radius", [0.0, 0.4])
def test_distance_from_hull_equals_the_distance_to_a_sampled_outline(count: int, radius: float) -> None:
    if count == 1 and radius == 0.0:
        radius = 1e-9
    angles = np.arange(count) * 2.0 * math.pi / max(count, 3) + 0.2
    hull = Hull(np.column_stack((np.cos(angles), np.sin(angles))), radius)
    outline = rounded_hull(hull, 200)
    if count == 2 and radius == 0.0:
        outline = hull.corners
    fraction = np.linspace(0.0, 1.0, 200)[:, None, None]
    fine = (outline * (1.0 - fraction) + np.roll(outline, -1, axis=0) * fraction).reshape(-1, 2)
    points = np.random.default_rng(count).uniform(-3.0, 3.0, (200, 2))
    found = distance_from_hull(hull)(points[:, 0], points[:, 1])
    nearest = np.sqrt(((points[:, None] - fine) ** 2).sum(-1)).min(axis=1)
    assert np.abs(found) == pytest.approx(nearest, abs=0.02)  # points on the outline are up to 0.01 apart


def test_area_of_hulls() -> None:
    corners = np.asarray([(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)])
    assert hull_area(Hull(corners, 0.5)) == pytest.approx(2.0 + 6.0 * 0.5 + math.pi * 0.25, rel=1e-12)  # rounding
    assert hull_area(Hull(corners[:2], 0.5)) == pytest.approx(2.0 + math.pi * 0.25, rel=1e-12)  # rounding
    assert hull_area(Hull(corners[:1], 2.0)) == pytest.approx(4.0 * math.pi, rel=1e-12)  # rounding


def test_hull_gap_is_measured_at_the_middle_of_the_facing_edges() -> None:
    unit = np.asarray([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    gap, point = hull_gap(Hull(unit, 0.0), Hull(unit + np.asarray((1.0, 2.5)), 0.0), 1e-6)
    assert gap == pytest.approx(0.5, abs=1e-12)  # rounding
    assert point.tolist() == pytest.approx([0.5, 1.25], abs=1e-12)  # rounding
    gap, _ = hull_gap(Hull(unit, 0.0), Hull(np.asarray([(0.0, 3.0)]), 1.5))
    assert gap == pytest.approx(0.5, abs=1e-12)  # rounding


def test_facts_of_a_box_list_size_mass_and_moment_of_inertia() -> None:
    shape_scene = scene(box=[box(0, 0, 4, 2, mass=6.0)])
    lines = body_facts(shape_scene.bodies, start(shape_scene), Contacts.none(), 0)
    assert any("6" in line and "4" in line and "×" in line and "2" in line for line in lines)
    assert any(line.startswith("I 10") for line in lines)  # m (w² + h²) / 12


def live(**tables: Any) -> LiveView:
    return LiveView(Session(scene(**tables), "pymunk"))


def add_body(view: LiveView, tools: BodyTools, *, box: bool) -> Any:
    tools.add(view, (20.0, 20.0), 10.0, box=box)
    action = view.session.actions[-1]
    assert isinstance(action, Spawn)
    return action


def test_added_box_copies_size_and_material_of_the_picked_box() -> None:
    view, tools = live(box=[box(0, 0, 4, 2, density=3.0, friction=0.25)]), BodyTools()
    added_box = add_body(view, tools, box=True).box
    assert (added_box.size, added_box.density, added_box.friction) == ((4.0, 2.0), 3.0, 0.25)
    assert len(view.bodies) == 2


@pytest.mark.parametrize("as_box", [True, False])
def test_added_body_of_another_shape_keeps_area_and_mass(as_box: bool) -> None:
    other: dict[str, Any] = {"ball": [{"position": [0, 0], "radius": 1.0, "mass": 7.0}]}
    if not as_box:
        other = {"box": [box(0, 0, math.pi, 1.0, mass=7.0)]}
    view, tools = live(**other), BodyTools()
    action = add_body(view, tools, box=as_box)
    if as_box:
        assert action.box.size == pytest.approx((math.sqrt(math.pi),) * 2, rel=1e-12)  # rounding
    else:
        assert action.ball.radius == pytest.approx(1.0, rel=1e-12)  # rounding
    assert view.bodies.mass[1] == pytest.approx(7.0, rel=1e-12)  # rounding


GRAVITY = {"gravity": [0.0, -9.81]}


def test_view_of_a_pendulum_contains_its_anchor_and_its_swing() -> None:
    joint = {"kind": "rod", "between": ["bob"], "anchors": [[0, 0], [0, 0]]}
    shape_scene = scene(ball=[{"name": "bob", "position": [3, -4], "radius": 0.5}], joint=[joint], world=GRAVITY)
    (left, bottom), (right, top) = view_bounds(shape_scene)
    assert (left, bottom, right, top) == pytest.approx((-3.5, -5.5, 3.5, 0.0), abs=1e-9)  # rounding


def test_view_contains_the_flight_of_joined_bodies_without_a_world_anchor() -> None:
    joint = {"kind": "rod", "between": ["a", "b"]}
    balls = [{"name": name, "position": [x, 0], "radius": 0.5, "velocity": [4, 0]} for name, x in (("a", 0), ("b", 2))]
    loose, held = (
        view_bounds(scene(ball=balls, joint=joints, world={"gravity": [0.0, 0.0], "duration": 2.0}))
        for joints in ([joint], [joint, {"kind": "pivot", "between": ["a"], "at": [0, 0]}])
    )
    assert loose[1][0] == pytest.approx(2.0 + 8.0 + 0.5, abs=1e-9)  # rounding
    assert held[1][0] == pytest.approx(2.5, abs=1e-9)  # rounding


def test_view_excludes_distant_anchors() -> None:
    joint = {"kind": "spring", "between": ["bob"], "anchors": [[0, 0], [0, 1e6]], "stiffness": 1.0}
    shape_scene = scene(ball=[{"name": "bob", "position": [0, 0], "radius": 0.5}], joint=[joint], world=GRAVITY)
    assert view_bounds(shape_scene)[1][1] == pytest.approx(0.5, abs=1e-9)  # rounding


@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_contact_point_of_a_box_is_drawn_at_its_current_position(angle: float) -> None:
    shape_scene = scene(box=[box(5, 1, 4, 2, angle=angle)], plane=[{"point": [0, 0], "normal": [0, 1]}])
    stale = Contacts(
        np.zeros(1), np.asarray([(0, -1)]), np.asarray([(-3.0, 0.0)]), np.asarray([(0.0, -1.0)]), np.zeros((1, 2))
    )
    camera = Camera((0.0, 0.0), 10.0, (100, 100))
    sight = Snapshot(shape_scene, shape_scene.bodies, start(shape_scene), contacts=stale)
    view = DrawContext(
        pygame.Surface((100, 100)),
        camera,
        snapshot=sight,
        shown=np.empty(0, np.int64),
        centre=np.empty((0, 2)),
        radius=np.empty(0),
        colours=np.empty((0, 3), np.uint8),
        body_colours=np.empty((0, 3), np.uint8),
    )
    (point,), _ = contact_points(view)
    corners = [(5 + x * math.cos(angle) - y * math.sin(angle), x * math.sin(angle)) for x, y in ((-2, -1), (2, -1))]
    lowest = min(corners, key=lambda corner: corner[1])[0] if angle else 5.0
    assert point[0] == pytest.approx(lowest, abs=1e-9)  # rounding
    assert abs(point[1]) < 0.6  # half of the penetration depth
