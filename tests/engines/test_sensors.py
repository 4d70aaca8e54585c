"""Sensors: overlaps against shapely; entries, stays and exits against closed forms, on every engine."""

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import sandbox
from sandbox.action import Impulse, Launch, Move, Remove, Spawn, Switch
from sandbox.engines.contract import Exhaustion
from sandbox.engines.registry import ENGINES, able
from sandbox.engines.sensors import SceneSensors
from sandbox.engines.switching import SwitchableSimulation
from sandbox.measure.metrics.contacts import collisions, contact_episodes, first_collision
from sandbox.measure.preflight import warnings
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Frame, SensorVisit, Trajectory
from tests.runs_by_hand import scene_of

every_engine = pytest.mark.parametrize("engine", ENGINES)
solid_engines = pytest.mark.parametrize("engine", [name for name in ENGINES if name != "exact"])
"""engines that model boxes on planes"""

ARC = 256
"""Segments of a quarter circle in shapely: the arc is inside by a fraction 5e-6 of the radius"""
NEAR = 2e-5
"""m: two shapes of this test overlap or not for certain if their distance or depth is above it, for `ARC`"""

COORDINATE = st.floats(-2.0, 2.0, allow_subnormal=False)
ANGLE = st.floats(-math.pi, math.pi)
RADIUS = st.floats(0.05, 0.8)
POINT = st.tuples(COORDINATE, COORDINATE)


@st.composite
def star_outlines(draw: st.DrawFn) -> list[list[float]]:
    """Return the corners of a simple polygon about the origin, convex or concave."""
    count = draw(st.integers(3, 9))
    lengths = draw(st.lists(st.floats(0.2, 1.2), min_size=count, max_size=count))
    begin = draw(ANGLE)
    turns = [begin + 2.0 * math.pi * k / count for k in range(count)]
    return [[r * math.cos(a), r * math.sin(a)] for r, a in zip(lengths, turns, strict=True)]


@st.composite
def areas(draw: st.DrawFn) -> dict[str, Any]:
    """Return the keys of the shape of a sensor."""
    match draw(st.sampled_from(["circle", "strip", "polygon"])):
        case "circle":
            return {"position": list(draw(POINT)), "radius": draw(RADIUS)}
        case "strip":
            points = draw(st.lists(POINT, min_size=2, max_size=4, unique=True))
            assume(all(math.dist(a, b) > 1e-3 for a, b in pairwise(points)))
            return {"points": [list(each) for each in points], "thickness": 2.0 * draw(RADIUS)}
        case _:
            return {"points": draw(star_outlines())}


@st.composite
def bodies(draw: st.DrawFn) -> dict[str, Any]:
    """Return a document with one body named `it`."""
    pose = {"name": "it", "position": list(draw(POINT)), "angle": draw(ANGLE)}
    match draw(st.sampled_from(["ball", "box", "capsule", "polygon"])):
        case "ball":
            return {"ball": [{**pose, "radius": draw(RADIUS)}]}
        case "box":
            size = [draw(st.floats(0.3, 2.0)), draw(st.floats(0.3, 2.0))]
            return {"box": [{**pose, "size": size, "radius": draw(st.sampled_from([0.0, 0.1]))}]}
        case "capsule":
            return {"capsule": [{**pose, "length": draw(st.floats(0.1, 2.0)), "radius": draw(RADIUS)}]}
        case _:
            return {"polygon": [{**pose, "points": draw(star_outlines()), "radius": draw(st.sampled_from([0.0, 0.1]))}]}


@st.composite
def static_objects(draw: st.DrawFn) -> dict[str, Any]:
    """Return a document with one static object named `it`."""
    match draw(st.sampled_from(["plane", "post", "wall"])):
        case "plane":
            angle = draw(ANGLE)
            normal = [math.cos(angle), math.sin(angle)]
            return {"plane": [{"name": "it", "point": list(draw(POINT)), "normal": normal}]}
        case "post":
            return {"post": [{"name": "it", "position": list(draw(POINT)), "radius": draw(RADIUS)}]}
        case _:
            a, b = draw(POINT), draw(POINT)
            assume(math.dist(a, b) > 0.01)
            thickness = draw(st.sampled_from([0.0, 0.1]))
            return {"wall": [{"name": "it", "points": [list(a), list(b)], "thickness": thickness}]}


def area_of(keys: dict[str, Any]) -> shapely.Geometry:
    """Return the shape of a sensor as shapely builds it from its keys."""
    if "position" in keys:
        return shapely.Point(keys["position"]).buffer(keys["radius"], quad_segs=ARC)
    if "thickness" in keys:
        return shapely.LineString(keys["points"]).buffer(0.5 * keys["thickness"], quad_segs=ARC)
    return shapely.Polygon(keys["points"])


def shape_of(document: dict[str, Any]) -> shapely.Geometry:
    """Return the shape of the object of a document as shapely builds it from its keys."""
    ((table, (keys,)),) = document.items()
    match table:
        case "plane":
            (x, y), (nx, ny) = keys["point"], keys["normal"]
            far = 50.0
            across = [(x - far * ny, y + far * nx), (x + far * ny, y - far * nx)]
            return shapely.Polygon([*across, *((a - far * nx, b - far * ny) for a, b in reversed(across))])
        case "post":
            return shapely.Point(keys["position"]).buffer(keys["radius"], quad_segs=ARC)
        case "wall":
            line = shapely.LineString(keys["points"])
            return line.buffer(0.5 * keys["thickness"], quad_segs=ARC) if keys["thickness"] else line
        case "ball":
            own: shapely.Geometry = shapely.Point(0.0, 0.0).buffer(keys["radius"], quad_segs=ARC)
        case "box":
            x, y = 0.5 * keys["size"][0], 0.5 * keys["size"][1]
            own = shapely.box(-x, -y, x, y)
        case "capsule":
            half = 0.5 * keys["length"]
            own = shapely.LineString([(-half, 0.0), (half, 0.0)]).buffer(keys["radius"], quad_segs=ARC)
        case _:
            own = shapely.Polygon(keys["points"])
    if table in ("box", "polygon") and keys["radius"]:
        own = own.buffer(keys["radius"], quad_segs=ARC)
    turned = shapely.affinity.rotate(own, keys["angle"], origin=(0.0, 0.0), use_radians=True)
    return shapely.affinity.translate(turned, *keys["position"])


def assert_detected_as_by_shapely(found: tuple[str, ...], area: shapely.Geometry, shape: shapely.Geometry) -> None:
    if area.distance(shape) > NEAR:
        assert found == ()
    elif area.buffer(-NEAR).intersects(shape) or shape.buffer(-NEAR).intersects(area):
        assert found == ("it",)


@settings(max_examples=300)
@given(areas(), bodies())
def test_fixed_sensor_detects_the_bodies_that_overlap_it_in_shapely(area: dict[str, Any], it: dict[str, Any]) -> None:
    simulation = sandbox.start(from_document({"sensor": [{"name": "sensor", **area}], **it}), "reference")
    assert_detected_as_by_shapely(simulation.sensed("sensor"), area_of(area), shape_of(it))


@settings(max_examples=300)
@given(areas(), static_objects(), POINT, ANGLE)
def test_sensor_of_a_body_detects_the_static_objects_that_overlap_it_in_shapely(
    area: dict[str, Any], it: dict[str, Any], position: tuple[float, float], angle: float
) -> None:
    body = {"name": "body", "position": list(position), "angle": angle, "radius": 0.01}
    scene = from_document({"ball": [body], "sensor": [{"name": "sensor", "body": "body", **area}], **it})
    turned = shapely.affinity.rotate(area_of(area), angle, origin=(0.0, 0.0), use_radians=True)
    placed = shapely.affinity.translate(turned, *position)
    assert_detected_as_by_shapely(sandbox.start(scene, "reference").sensed("sensor"), placed, shape_of(it))


def test_sensor_is_placed_in_the_frame_of_its_body_not_about_its_centre_of_mass() -> None:
    """The centre of mass of the triangle is at (1, 1) of its frame; the sensor is at the origin of the frame."""
    scene = scene_of(
        """
        [[polygon]]
        name = "triangle"
        position = [10.0, 0.0]
        angle = 1.5707963267948966
        points = [[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]]
        [[ball]]
        name = "at the origin"
        position = [10.0, 0.0]
        radius = 0.01
        collides = "fixed"
        [[ball]]
        name = "ahead"
        position = [10.0, 2.0]
        radius = 0.01
        collides = "fixed"
        [[sensor]]
        name = "origin"
        body = "triangle"
        position = [0.0, 0.0]
        radius = 0.1
        [[sensor]]
        name = "two ahead"
        body = "triangle"
        position = [2.0, 0.0]
        radius = 0.1
        """
    )
    simulation = sandbox.start(scene)
    assert simulation.sensed("origin") == ("at the origin",)
    assert simulation.sensed("two ahead") == ("ahead",)


FALL = """
[world]
gravity = [0.0, -10.0]
duration = 1.2
[solver]
dt = 0.01
[[ball]]
name = "ball"
position = [0.0, 5.0]
radius = 0.5
[[sensor]]
name = "gate"
points = [[-1.0, 2.0], [1.0, 2.0], [1.0, 3.0], [-1.0, 3.0]]
"""
"""A fall of 1.5 m to the first overlap, and of 3.5 m to the last: √0.3 s = 0.5477 s and √0.7 s = 0.8367 s"""


@every_engine
def test_fall_through_a_sensor_is_one_visit_with_the_times_of_the_closed_form(engine: str) -> None:
    run = sandbox.run(scene_of(FALL), engine)
    (visit,) = run.sensor_visits
    assert (visit.sensor, visit.object) == ("gate", "ball")
    # Explicit positions lag or lead by up to g·h·t/2 at speed g·t, h/2 in time: one step from the closed form.
    late = 1e-9 if engine == "exact" else 0.01
    assert abs(visit.begin - 0.55) <= late + 1e-9  # the first step after 0.5477 s
    assert abs(visit.end - 0.84) <= late + 1e-9  # the first step after 0.8367 s
    assert run.contact_impulse.tolist() == [[0.0, 0.0]]
    assert run.contact_normal.tolist() == [[0.0, -1.0]]


@every_engine
def test_visit_is_a_row_of_each_step_while_it_lasts_and_none_after(engine: str) -> None:
    simulation = sandbox.start(scene_of(FALL), engine)
    simulation.contacts()
    for _ in range(100):
        simulation.step()
        contacts = simulation.contacts()
        inside = simulation.sensed("gate")
        y = float(simulation.frame().position[0, 1])
        assert inside == (("ball",) if 1.5 < y < 3.5 else ())
        assert contacts.pair.tolist() == ([[0, -1]] if inside else [])


@every_engine
def test_overlaps_depend_on_the_state_only(engine: str) -> None:
    """What an engine reports at each step is what any evaluation of its frame gives."""
    scene = sandbox.load("sensors") if engine != "exact" else scene_of(FALL)
    simulation = sandbox.start(scene, engine)
    evaluated = SceneSensors(scene, scene.bodies)
    simulation.contacts()
    for _ in range(150):
        simulation.step()
        rows = {tuple(pair) for pair in simulation.contacts().pair.tolist() if pair[1] < -len(scene.fixed)}
        assert rows == {tuple(pair) for pair in evaluated.overlaps(simulation.frame()).tolist()}


JUMP = """
[world]
gravity = [0.0, -10.0]
duration = 3.0
[solver]
dt = 0.01
[[plane]]
name = "ground"
point = [0.0, 0.0]
normal = [0.0, 1.0]
[[box]]
name = "player"
position = [0.0, 0.5]
size = [0.6, 1.0]
fixed_rotation = true
[[sensor]]
name = "feet"
body = "player"
points = [[-0.25, -0.5], [0.25, -0.5]]
thickness = 0.1
"""


@solid_engines
def test_feet_know_when_a_jumping_box_is_on_the_ground(engine: str) -> None:
    """It jumps at 4 m/s: its feet are above 0.05 m from 0.0127 s to 0.7873 s after the jump."""
    simulation = sandbox.start(scene_of(JUMP), engine)
    for _ in range(20):
        simulation.step()
        assert simulation.sensed("feet") == ("ground",)
    begin = simulation.time
    simulation.apply(Impulse(time=0.0, body="player", impulse=(0.0, 4.0)))
    on_ground = []
    for _ in range(100):
        simulation.step()
        on_ground.append(simulation.sensed("feet") == ("ground",))
    flight = [begin + 0.01 * (k + 1) for k, each in enumerate(on_ground) if not each]
    # a step each for the discrete ends, and for the error of the integrator
    assert flight[0] == pytest.approx(begin + 0.02, abs=0.0101)
    assert flight[-1] == pytest.approx(begin + 0.78, abs=0.0201)
    assert len(flight) == round((flight[-1] - flight[0]) / 0.01) + 1  # without an interruption


@every_engine
def test_sensors_do_not_change_the_run(engine: str) -> None:
    document = {
        "world": {"duration": 1.0, "gravity": [0.0, -5.0]},
        "wall": [{"points": [[-1, -1], [1, -1], [1, 1], [-1, 1]], "closed": True, "restitution": 0.9}],
        "scatter": [{"name": "crowd", "count": 9, "lower": [-0.9, -0.9], "upper": [0.9, 0.9], "radius": 0.08}],
    }
    sensors = [{"position": [0.0, 0.0], "radius": 0.5}, {"body": "crowd-1", "position": [0.0, 0.0], "radius": 0.3}]
    plain, sensing = (
        sandbox.run(from_document(each), engine, dt=0.005) for each in (document, {**document, "sensor": sensors})
    )
    for key in ("position", "velocity", "angle", "angular_velocity"):
        assert np.array_equal(getattr(plain, key), getattr(sensing, key)), key
    assert sensing.sensor_visits
    assert plain.sensor_visits == ()
    collisions = [row for row in sensing.contact_pair.tolist() if row[1] >= -1]
    assert collisions == plain.contact_pair.tolist()


CROWD = """
[world]
gravity = [0.0, -3.0]
duration = 2.0
[[plane]]
name = "ground"
point = [0.0, 0.0]
normal = [0.0, 1.0]
[[ball]]
name = "hero"
position = [0.0, 0.5]
radius = 0.4
categories = ["hero"]
[[ball]]
name = "ghost"
position = [0.0, 1.5]
radius = 0.3
collides = "none"
[[ball]]
name = "friend"
position = [1.0, 0.5]
radius = 0.4
categories = ["friend"]
[[ball]]
name = "post"
position = [-1.2, 0.5]
radius = 0.4
fixed = true
categories = ["hero"]
"""
ALL = '[[sensor]]\nname = "area"\nposition = [0.0, 1.0]\nradius = 3.0\n'


def sensed(keys: str, scene: str = CROWD) -> tuple[str, ...]:
    return sandbox.start(scene_of(scene + '[[sensor]]\nname = "area"\n' + keys), "reference").sensed("area")


def test_fixed_sensor_detects_bodies_that_move_and_collide() -> None:
    assert sensed("position = [0.0, 1.0]\nradius = 3.0") == ("hero", "friend")


def test_sensor_of_a_moving_body_detects_static_objects_and_not_its_own_body() -> None:
    keys = 'body = "hero"\nposition = [0.0, 0.0]\nradius = 2.0'
    assert sensed(keys) == ("friend", "post", "ground")


def test_sensor_of_a_fixed_body_is_as_one_in_the_world() -> None:
    assert sensed('body = "post"\nposition = [0.0, 0.0]\nradius = 3.0') == ("hero", "friend")


def test_sensor_detects_the_categories_that_it_names_and_objects_of_all() -> None:
    keys = 'body = "friend"\nposition = [0.0, 0.0]\nradius = 3.0\ndetects = ["hero"]'
    assert sensed(keys) == ("hero", "post", "ground")  # the ground names no categories, so that it belongs to all


def test_shapes_that_only_touch_do_not_overlap() -> None:
    touching = 'position = [0.0, 1.9]\nradius = 1.0\ndetects = ["hero"]'  # 0.5 + 0.4 + 1.0, exact in binary sums here
    assert sensed(touching.replace("1.9", "1.90625")) == ()
    assert sensed(touching.replace("1.9", "1.875")) == ("hero",)


@pytest.mark.parametrize(
    ("keys", "path", "word"),
    [
        ("radius = 1.0", "sensor[0]", "no shape"),
        ("position = [0.0, 0.0]\nradius = 1.0\npoints = [[0,0],[1,0],[0,1]]", "sensor[0].position", "circle"),
        ("points = [[0.0, 0.0], [1.0, 0.0]]", "sensor[0].points", "three points"),
        ("points = [[0,0],[1,1],[1,0],[0,1]]", "sensor[0].points", "cross"),
        ('body = "absent"\nposition = [0.0, 0.0]\nradius = 1.0', "sensor[0].body", "'absent'"),
        ('position = [0.0, 0.0]\nradius = 1.0\ndetects = ["heros"]', "sensor[0].detects[0]", "'heros'"),
        ('position = [0.0, 0.0]\nradius = 1.0\nname = "hero"', "sensor.hero.name", "unique"),
    ],
)
def test_invalid_sensor_is_a_fault_at_its_key(keys: str, path: str, word: str) -> None:
    with pytest.raises(SceneError) as caught:
        scene_of(CROWD + "[[sensor]]\n" + keys)
    found = [(fault.path, fault.message) for fault in caught.value.faults]
    assert any(where.startswith(path) and word in message for where, message in found), found


@pytest.mark.parametrize("key", ["sensor", "is_sensor", "isSensor", "trigger"])
def test_key_of_another_engine_names_the_table_of_sensors(key: str) -> None:
    with pytest.raises(SceneError, match=r"\[\[sensor\]\]"):
        scene_of(f"[[ball]]\nposition = [0.0, 0.0]\nradius = 1.0\n{key} = true")


def inside_the_gate(engine: str) -> SwitchableSimulation:
    """Return a simulation whose ball overlaps the sensor, with recorded visits."""
    simulation = sandbox.start(scene_of(FALL), engine)
    simulation.sensor_visits()
    for _ in range(70):
        simulation.step()
    assert simulation.sensed("gate") == ("ball",)
    return simulation


def visits_to_the_end(simulation: SwitchableSimulation) -> tuple[SensorVisit, ...]:
    simulation.sensor_visits()
    while simulation.sensed("gate"):
        simulation.step()
    return simulation.sensor_visits()


@every_engine
def test_simulation_resumed_from_a_checkpoint_keeps_the_begin_of_a_visit(engine: str) -> None:
    simulation = inside_the_gate(engine)
    resumed = SwitchableSimulation.resumed(simulation.checkpoint())
    rows = [each.contacts() for each in (simulation, resumed)]
    assert rows[0].time.tolist() == rows[1].time.tolist()
    assert visits_to_the_end(resumed) == visits_to_the_end(simulation)


@pytest.mark.parametrize("engine", ["exact", "reference"])
def test_restored_snapshot_continues_its_visits(engine: str) -> None:
    simulation = inside_the_gate(engine)
    snapshot = simulation.snapshot()
    visits = visits_to_the_end(simulation)
    simulation.restore(snapshot)
    assert simulation.sensed("gate") == ("ball",)
    assert visits_to_the_end(simulation) == visits


def test_visit_lasts_through_a_switch_of_the_engine() -> None:
    action = Switch(time=0.7, engine="reference")
    (visit,) = sandbox.run(scene_of(FALL), "pymunk", actions=[action]).sensor_visits
    assert visit.begin == pytest.approx(0.55, abs=0.0101)  # a step
    assert visit.end == pytest.approx(0.84, abs=0.0101)


@every_engine
def test_spawned_and_removed_bodies_enter_and_leave(engine: str) -> None:
    scene = scene_of(ALL.replace("3.0", "0.5") + "[world]\nduration = 1.0\ngravity = [0.0, 0.0]\n[solver]\ndt = 0.01\n")
    ball = Ball(name="new", position=(0.0, 1.0), radius=0.1)
    actions = [Spawn(time=0.2, ball=ball), Remove(time=0.5, body="new")]
    (visit,) = sandbox.run(scene, engine, actions=actions).sensor_visits
    assert visit.object == "new"
    assert (visit.begin, visit.end) == pytest.approx((0.21, 0.51), abs=1e-9)  # ends of the first steps after


@every_engine
def test_sensor_ends_its_visits_with_its_body_and_begins_them_with_its_launch(engine: str) -> None:
    scene = scene_of(
        """
        [world]
        duration = 1.0
        gravity = [0.0, 0.0]
        [solver]
        dt = 0.01
        [[scatter]]
        name = "scout"
        count = 1
        lower = [-0.2, -0.2]
        upper = [0.2, 0.2]
        radius = 0.1
        collides = "fixed"
        [[ball]]
        name = "target"
        position = [1.0, 0.0]
        radius = 0.5
        collides = "fixed"
        [[sensor]]
        name = "sight"
        body = "scout-1"
        position = [0.0, 0.0]
        radius = 2.0
        """
    )
    actions = [Remove(time=0.3, body="scout-1"), Launch(time=0.6, generator="scout", seed=3)]
    visits = sandbox.run(scene, engine, actions=actions).sensor_visits
    assert [(each.begin, each.end) for each in visits] == [
        pytest.approx((0.0, 0.31), abs=1e-9),  # sums of dt
        pytest.approx((0.61, math.nan), abs=1e-9, nan_ok=True),
    ]


def test_visits_of_a_moved_body_end_with_the_next_step() -> None:
    scene = scene_of(ALL + "[world]\nduration = 0.5\ngravity = [0.0, 0.0]\n[[ball]]\nposition = [0, 1]\nradius = 0.1")
    simulation = sandbox.start(scene)
    assert [each.end for each in simulation.sensor_visits()] == [pytest.approx(math.nan, nan_ok=True)]
    simulation.apply(Move(time=0.0, body="ball-1", position=(9.0, 9.0)))
    assert simulation.sensed("area") == ()
    simulation.step()
    assert [each.end for each in simulation.sensor_visits()] == [simulation.time]
    assert simulation.sensor_visits() == ()


def test_recording_and_stored_run_have_the_visits(tmp_path: Any) -> None:
    run = sandbox.run(sandbox.load("sensors"), "pymunk")
    assert len(run.sensor_visits) > 2
    loaded = Trajectory.load(run.save(tmp_path / "run.npz"))
    assert repr(loaded.sensor_visits) == repr(run.sensor_visits)  # nan is not equal to itself
    assert {each.sensor for each in run.sensor_visits} <= {"feet", "sight", "goal"}


def test_unknown_sensor_is_named_with_those_of_the_scene() -> None:
    with pytest.raises(ValueError, match=r"'gates'.*'gate'"):
        sandbox.start(scene_of(FALL)).sensed("gates")


def test_advance_makes_the_same_steps_and_visits_as_single_steps() -> None:
    scene = scene_of(FALL)
    run = sandbox.run(scene, "reference")
    simulation = sandbox.start(scene, "reference")
    simulation.sensor_visits()
    while simulation.time < 1.2 - 1e-9:
        simulation.step()
    assert simulation.sensor_visits() == run.sensor_visits
    assert simulation.state_hash() == run.info["state_hash"]


def test_check_warns_of_a_sensor_that_a_body_can_pass_between_two_steps() -> None:
    scene = scene_of(
        """
        [world]
        gravity = [0.0, 0.0]
        [solver]
        dt = 0.05
        [[ball]]
        name = "bullet"
        position = [0.0, 0.0]
        velocity = [10.0, 0.0]
        radius = 0.05
        [[sensor]]
        name = "beam"
        points = [[2.0, -1.0], [2.0, 1.0]]
        thickness = 0.1
        """
    )
    found = [each for each in warnings(scene) if each.kind == "entry"]
    assert [each.details["thing"] for each in found] == ["beam"]
    # It moves 0.5 m in a step, and overlaps the beam over 0.2 m of its way.
    assert found[0].details["odds"] == pytest.approx(1.0 - 0.2 / 0.5)
    assert found[0].details["safe_dt"] == pytest.approx(0.02)
    safe = scene.model_copy(update={"solver": scene.solver.replace(dt=0.02)})
    assert not [each for each in warnings(safe) if each.kind == "entry"]


def test_engines_that_can_run_a_scene_can_run_it_with_sensors() -> None:
    without = FALL.split("[[sensor]]", maxsplit=1)[0]
    assert able(scene_of(FALL)) == able(scene_of(without)) == tuple(ENGINES)


def test_many_bodies_are_detected_as_one_by_one() -> None:
    """The states of 400 balls in one frame, each against the closed form of two discs."""
    document = {
        "scatter": [{"name": "b", "count": 400, "lower": [-9, -9], "upper": [9, 9], "radius": 0.2}],
        "sensor": [{"name": "eye", "position": [1.0, 2.0], "radius": 4.0}],
    }
    scene: Scene = from_document(document)
    frame: Frame = sandbox.start(scene).frame()
    expected = np.flatnonzero(np.hypot(*(frame.position - (1.0, 2.0)).T) < 4.2).tolist()
    assert SceneSensors(scene, scene.bodies).detected(0, frame).tolist() == expected
    assert 10 < len(expected) < 390
    gone = replace(frame, present=np.arange(400) % 2 == 0)
    assert SceneSensors(scene, scene.bodies).detected(0, gone).tolist() == [k for k in expected if k % 2 == 0]


def test_run_with_more_visits_than_can_be_recorded_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SANDBOX_MAX_CONTACTS", "3")
    balls = [{"position": [0.1 * k, 0.0], "radius": 0.1, "collides": "fixed"} for k in range(4)]
    sensor = {"position": [0.0, 0.0], "radius": 5.0}
    scene = from_document({"world": {"duration": 0.1}, "ball": balls, "sensor": [sensor]})
    with pytest.raises(Exhaustion, match="4 contacts"):
        sandbox.start(scene).contacts()


def test_visits_are_no_collisions() -> None:
    """The ball falls through the gate, which is a visit, and onto the ground once."""
    scene = scene_of(FALL + '[[plane]]\nname = "ground"\npoint = [0.0, 0.0]\nnormal = [0.0, 1.0]\n')
    run = sandbox.run(scene, "reference")
    assert len(run.sensor_visits) == 1
    assert len(run.contact_time) == 2
    assert collisions(run) == 1
    assert first_collision(run) == pytest.approx(
        math.sqrt(0.9), abs=0.015
    )  # 4.5 m of fall; a step, and half of one of the integrator
    assert list(contact_episodes(run, scene, 0.01, 1e-3, 1.2)) == [(0, -1)]
