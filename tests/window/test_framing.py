"""View bounds of the camera, picking of bodies by the mouse, and trails."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from sandbox.engines.registry import start, usual
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find, shipped
from sandbox.trajectory import Frame
from sandbox.window.camera import Camera
from sandbox.window.hit_test import overlapping_bodies, pick_body
from sandbox.window.playback.history import MAX_TRAIL_BODIES, TRAIL_LENGTH, Trails
from sandbox.window.view_bounds import predict_bounds, view_bounds
from tests.samples import each_shipped_scene
from tests.strategies import scenes

pytestmark = pytest.mark.fail_slow(60)  # every shipped scene

VIEWED = {each.name for each in shipped() if (play := load(each.path).play).view is not None or play.area is not None}
"""Scenes of games and tables, whose files state the view."""


def frame_of(scene: Scene, time: float = 0.0) -> Frame:
    bodies = scene.bodies
    present = np.ones(len(bodies), np.bool_)
    state = (bodies.position, bodies.velocity, bodies.angle, bodies.angular_velocity)
    return Frame(time, *(array.copy() for array in state), present)


def ball(name: str, x: float, y: float, radius: float = 1.0, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "radius": radius, **more}


def scene_of(*balls: dict[str, Any], **document: Any) -> Scene:
    return from_document({"ball": list(balls), **document})


@pytest.mark.parametrize("name", each_shipped_scene())
def test_bodies_of_shipped_scenes_are_in_view_at_the_start(name: str) -> None:
    scene = load(find(name))
    low, high = map(np.asarray, view_bounds(scene))
    assert (low < high).all()
    inside = ((scene.bodies.position >= low) & (scene.bodies.position <= high)).all(axis=1)
    # Above 1000 bodies, 0.5 % may be outside at each of four sides.
    assert inside.mean() >= (1.0 if len(inside) <= 1000 else 0.97)


@pytest.mark.parametrize("name", [each for each in each_shipped_scene() if each.values[0] not in VIEWED])
def test_bodies_of_shipped_scenes_stay_in_the_first_view(name: str) -> None:
    """Checked for the duration of the scene, at most 4,000 steps and 60,000 body-steps; diverging bodies may leave."""
    scene = load(find(name))
    engine = usual(scene)
    camera = Camera.fitting(view_bounds(scene, predict_bounds(scene, engine)), (1000, 600))
    (left, bottom), (right, top) = camera.box
    moving = np.flatnonzero(~scene.bodies.fixed)
    steps = min(round(scene.world.duration / scene.solver.dt), 4_000, 60_000 // len(moving))
    simulation = start(scene, engine)
    for _ in range(steps):
        simulation.step()
        frame = simulation.frame()
        present = moving[frame.present[moving]]
        x, y = frame.position[present].T
        inside = (x >= left) & (x <= right) & (y >= bottom) & (y <= top)
        if name.endswith("stiff_spring_beyond"):
            distance = np.abs(frame.position - scene.bodies.position).max()
            assert inside.all() or distance > 1.0  # m: it begins 0.1 m off, and diverges
        else:
            # Above 1000 bodies, the view leaves out half a per cent at each of its four sides.
            assert inside.mean() >= (1.0 if len(present) <= 1000 else 0.98), (frame.time, x.min(), x.max())
    simulation.close()


def test_predicted_bounds_are_deterministic_and_limited_in_steps() -> None:
    scene = load(find("double_pendulum"))
    assert predict_bounds(scene, "pymunk") == predict_bounds(scene, "pymunk")
    longer = scene.model_copy(update={"world": scene.world.model_copy(update={"duration": 1e6})})
    box = predict_bounds(longer, "pymunk")
    assert box is not None
    assert box[0][0] == pytest.approx(-2.0, abs=0.1)  # both arms stretched out


def test_fast_body_extends_the_view_by_a_limited_factor() -> None:
    scene = scene_of(ball("a", 0, 0, velocity=[1000, 0]), ball("b", 1, 5), world={"duration": 100.0})
    box = predict_bounds(scene, "pymunk")
    assert box is not None
    low, high = view_bounds(scene)
    assert box[1][0] - box[0][0] <= 20.0 * max(high[0] - low[0], high[1] - low[1])  # FAR


def test_view_contains_free_flight_to_its_end() -> None:
    scene = scene_of(ball("a", 0, 0, velocity=[3, 10]), world={"gravity": [0, -9.81], "duration": 2.0})
    low, high = view_bounds(scene)
    position = run(scene, "exact").position[:, 0]
    assert low[0] <= position[:, 0].min()
    assert high[0] >= position[:, 0].max()
    assert high[1] >= position[:, 1].max()
    assert low[1] <= position[:, 1].min()


def test_view_excludes_flight_behind_a_plane_or_out_of_bounds() -> None:
    for more in (
        {"plane": [{"point": [0, 0], "normal": [0, 1]}], "world": {"gravity": [0, -9.81], "duration": 100.0}},
        {"world": {"gravity": [0, -9.81], "duration": 100.0, "bounds": [[-5, -5], [5, 5]]}},
    ):
        low, high = view_bounds(scene_of(ball("a", 0, 4), **more))
        assert -6.0 <= low[1] < high[1] <= 6.0


def test_view_ends_below_the_ground() -> None:
    ground = [{"points": [[-20, -1], [20, -1], [20, 0], [-20, 0]], "fixed": True}]
    world = {"gravity": [0, -9.81], "duration": 100.0}
    low, high = view_bounds(scene_of(ball("a", 0, 4), polygon=ground, world=world))
    assert (low, high) == ((-20.0, -1.0), (20.0, 5.0))
    low, high = view_bounds(
        scene_of(ball("a", 0, 4), ball("b", 0, -4), polygon=ground, world={**world, "duration": 1.0})
    )
    assert low[1] == pytest.approx(-4 - 9.81 / 2 - 1, rel=1e-12)  # rounding; b starts below the ground


def test_view_contains_the_orbit_and_not_its_tangent() -> None:
    """The planet starts at the perihelion, 0.5 m from the sun; the aphelion of its ellipse is at 1.5 m."""
    sun = [{"toward": [1, 0], "strength": 1}]
    planet = ball("a", 1.5, 0, 0.01, velocity=[0, 3**0.5])
    low, high = view_bounds(scene_of(planet, attraction=sun, world={"duration": 100.0}))
    assert (*low, *high) == pytest.approx((-0.5, -1.5, 2.5, 1.5), rel=1e-9)  # rounding


def test_view_is_finite_for_attraction_inside_a_body_and_repulsion() -> None:
    for strength, toward in ((-1.0, [0, 0]), (1.0, "a"), (1e30, [0, 0])):
        scene = scene_of(ball("a", 0, 0), ball("b", 3, 0), attraction=[{"toward": toward, "strength": strength}])
        low, high = view_bounds(scene)
        assert np.isfinite((*low, *high)).all()
        assert low[0] <= -1.0 < 4.0 <= high[0]


def test_view_contains_static_bodies_near_the_bodies_and_no_others() -> None:
    walls = [{"points": [[5.1, 0], [9, 2]]}, {"points": [[-6.5, 0], [-9, 2]]}]
    low, high = view_bounds(scene_of(ball("a", -4, 0), ball("b", 4, 0), wall=walls))
    assert (*low, *high) == (-5.0, -1.0, 9.0, 2.0)


EDGE_CASES: dict[str, dict[str, Any]] = {
    "empty": {"title": "t"},
    "planes": {"plane": [{"point": [1e16, -1e16], "normal": [1e-9, 1]}, {"point": [0, 0], "normal": [0, 1]}]},
    "far": {"ball": [ball("a", 1e16, -1e16, 1e-9)]},
    "very large": {"ball": [ball("a", 0, 0, 1e9), ball("b", 1e15, 1e15, 1e-9)]},
    "far and fast": {"ball": [ball("a", 9e14, 0, velocity=[7e11, 7e11])], "world": {"duration": 1e9},
                     "solver": {"dt": 10.0}},
    "one point": {"ball": [ball("a", 1e14, 1e14, 1e-9, fixed=True)]},
    "steep": {"ball": [ball("a", 0, 0)], "world": {"gravity": [1e9, -1e9], "duration": 1e9},
              "solver": {"dt": 10.0}},
    "walls alone": {"wall": [{"points": [[0, 0], [0, 3]]}]},
    "posts far": {"post": [{"position": [1e16, 0], "radius": 1}]},
}  # fmt: skip


@pytest.mark.parametrize("name", EDGE_CASES)
def test_view_of_edge_case_scenes_is_finite(name: str) -> None:
    (x0, y0), (x1, y1) = view_bounds(from_document(EDGE_CASES[name]))
    assert all(map(math.isfinite, (x0, y0, x1, y1)))
    assert x0 <= x1
    assert y0 <= y1
    assert max(x1 - x0, y1 - y0) > 0.0


@given(scenes())
def test_view_of_any_scene_is_finite(scene: Scene) -> None:
    (x0, y0), (x1, y1) = view_bounds(scene)
    assert all(map(math.isfinite, (x0, y0, x1, y1)))
    assert x0 <= x1
    assert y0 <= y1
    assert max(x1 - x0, y1 - y0) > 0.0


def test_pick_body_returns_the_body_under_the_cursor() -> None:
    scene = scene_of(ball("a", 0, 0), ball("b", 3, 0, 0.5), ball("c", 0.5, 0, 0.2))
    frame = frame_of(scene)
    for point, index in (((-0.5, 0.0), 0), ((0.0, 0.0), 0), ((0.5, 0.1), 2), ((3.4, 0.0), 1), ((3.6, 0.0), None)):
        assert pick_body(scene.bodies, frame, point) == index
    assert pick_body(scene.bodies, frame, (3.6, 0.0), reach=0.2) == 1
    assert pick_body(scene.bodies, frame, (math.nan, 0.0)) is None
    empty = from_document({"title": "t"})
    assert pick_body(empty.bodies, frame_of(empty), (0.0, 0.0), reach=9.0) is None


def test_absent_bodies_are_not_picked() -> None:
    scene = scene_of(ball("a", 0, 0), ball("b", 5, 0))
    frame = frame_of(scene)
    present = np.asarray([False, True])
    absent = Frame(0.0, frame.position, frame.velocity, frame.angle, frame.angular_velocity, present)
    assert pick_body(scene.bodies, absent, (0.0, 0.0)) is None
    early = Frame(0.0, *(a[:1] for a in (frame.position, frame.velocity, frame.angle, frame.angular_velocity)),
                  np.ones(1, np.bool_))  # fmt: skip
    assert pick_body(scene.bodies, early, (5.0, 0.0)) is None


@pytest.mark.parametrize(
    ("height", "over"),
    [(2.0, False), (1.001, False), (1.0, False), (0.999, True), (0.009, True), (0.0, True), (-1.0, True)],
)
def test_circle_overlaps_the_half_plane_below_its_radius(height: float, over: bool) -> None:
    scene = load(find("circle_half_plane"), [("ball.circle.position", [0.0, height])])
    assert overlapping_bodies(scene, scene.bodies, frame_of(scene)).tolist() == [over]


def test_overlaps_with_walls_posts_and_other_bodies() -> None:
    scene = scene_of(
        ball("a", 0, 0), ball("b", 1.9, 0), ball("c", 10, 0), ball("d", 20, 0), ball("e", 30, 0), ball("f", 32, 0),
        wall=[{"points": [[9, 1.05], [11, 1.05]], "thickness": 0.2}], post=[{"position": [20, 1.5], "radius": 0.6}],
    )  # fmt: skip
    assert overlapping_bodies(scene, scene.bodies, frame_of(scene)).tolist() == [True, True, True, True, False, False]
    frame = frame_of(scene)
    present = np.asarray([False, True, True, True, True, True])
    absent = Frame(0.0, frame.position, frame.velocity, frame.angle, frame.angular_velocity, present)
    assert overlapping_bodies(scene, scene.bodies, absent).tolist() == [False, False, True, True, False, False]


def test_overlaps_of_many_bodies_equal_brute_force() -> None:
    """The grid has some overlaps, and is large enough for the cell-based search of pairs."""
    document = {
        "grid": [{"origin": [0, 0], "columns": 60, "rows": 50, "spacing": [2.5, 2.5], "radius": 1, "jitter": 0.6}],
        "ball": [ball("nan", -50, 0)],
    }
    scene = from_document(document)
    frame = frame_of(scene)
    position = frame.position.copy()
    position[0] = np.nan
    frame = Frame(0.0, position, frame.velocity, frame.angle, frame.angular_velocity, frame.present)
    found = overlapping_bodies(scene, scene.bodies, frame)
    gap = np.hypot(*(position[:, None] - position[None]).transpose(2, 0, 1)) + 9.0 * np.eye(len(position))
    assert found.tolist() == (gap < 2.0).any(axis=1).tolist()
    assert 0 < found.sum() < len(found)


def test_trails_hold_the_last_positions_of_present_bodies() -> None:
    trails = Trails()
    assert trails.pieces() == ()
    scene = scene_of(ball("a", 0, 0), ball("b", 5, 0))
    for k in range(TRAIL_LENGTH + 50):
        trails.add(frame_of(scene, float(k)))
    (piece,) = trails.pieces()
    assert piece.shape == (TRAIL_LENGTH, 2, 2)
    trails.add(frame_of(scene_of(ball("a", 0, 0), ball("b", 5, 0), ball("c", 9, 0)), 1e3))
    assert [piece.shape for piece in trails.pieces()] == [(TRAIL_LENGTH - 1, 2, 2), (1, 3, 2)]
    trails.add(frame_of(scene, 10.0))  # back in time
    assert [piece.shape for piece in trails.pieces()] == [(1, 2, 2)]
    trails.add(frame_of(scene_of(ball("a", 1, 0), ball("b", 5, 0)), 10.0))  # the same time again
    assert [piece.tolist() for piece in trails.pieces()] == [[[[1.0, 0.0], [5.0, 0.0]]]]
    frame = frame_of(scene, 11.0)
    trails.add(Frame(11.0, frame.position, frame.velocity, frame.angle, frame.angular_velocity, np.zeros(2, np.bool_)))
    assert np.isnan(trails.pieces()[0][-1]).all()


def test_no_trails_above_the_maximum_number_of_bodies() -> None:
    trails, many = Trails(), np.zeros((MAX_TRAIL_BODIES + 1, 2))
    one = np.zeros(MAX_TRAIL_BODIES + 1)
    trails.add(Frame(0.0, many, many, one, one, np.ones(MAX_TRAIL_BODIES + 1, np.bool_)))
    assert trails.pieces() == ()


def test_scene_may_state_its_initial_view() -> None:
    assert view_bounds(scene_of(ball("a", 0, 4), play={"view": [[-3.0, -1.0], [5.0, 2.0]]})) == (
        (-3.0, -1.0),
        (5.0, 2.0),
    )
