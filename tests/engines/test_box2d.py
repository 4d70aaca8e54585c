"""Box2D: what the adapter adds to it, what it refuses, and the limits of 32-bit numbers."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.action import ActionError, Drive, Move, Remove, SetParameter, Spawn, Toggle
from sandbox.engines import registry
from sandbox.engines.box2d_adapter.limits import MAX_WORLDS
from sandbox.engines.contract import Divergence, Refusal, SnapshotError
from sandbox.engines.registry import ENGINES, UnknownEngineError, engine_named, start
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Trajectory
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # many worlds

FLOOR = {"point": [0.0, 0.0], "normal": [0.0, 1.0]}
GRAVITY = {"gravity": [0.0, -9.81], "duration": 1.0}


def scene_of(**document: Any) -> Scene:
    return from_document({"world": GRAVITY, "solver": {"dt": 0.01, "substeps": 4}, **document})


def ball(x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"position": [x, y], "radius": 0.5, **more}


def computed(scene: Scene, **settings: Any) -> Trajectory:
    result = run(scene, "box2d", audit=False, **settings)
    assert result.status == "ok", result.reason
    return result


def reason(scene: Scene, **settings: Any) -> str:
    """Return why Box2D refuses a scene."""
    return "; ".join(ENGINES["box2d"].missing(scene, scene.solver.replace(**settings)))


def test_body_is_not_slowed_down_to_the_default_of_400_lengths_a_second() -> None:
    fast = computed(scene_of(world={"duration": 0.5}, ball=[ball(0, 0, velocity=[5000.0, 0.0])]))
    assert fast.velocity[-1, 0, 0] == pytest.approx(5000.0, rel=1e-6)


@pytest.mark.parametrize("speed", [0.3, 3.0])
def test_restitution_holds_below_the_default_threshold_of_1_m_per_s(speed: float) -> None:
    floor = FLOOR | {"restitution": 0.5}
    result = computed(scene_of(world={"duration": 1.0}, plane=[floor], ball=[ball(0, 0.6, velocity=[0, -speed])]))
    assert result.velocity[-1, 0, 1] == pytest.approx(0.5 * speed, rel=1e-5)


def test_sleeping_bodies_stop() -> None:
    scene = scene_of(world=GRAVITY | {"duration": 3.0}, plane=[FLOOR], ball=[ball(0, 0.5)])
    asleep = computed(scene, sleeping=True)
    assert (asleep.position[-50:] == asleep.position[-1]).all()


def test_runs_are_equal_twice_and_with_any_number_of_workers() -> None:
    grid = {"radius": 0.2, "origin": [-1, 1], "columns": 5, "rows": 5, "spacing": [0.41, 0.41], "jitter": 0.01}
    scene = scene_of(plane=[FLOOR], grid=[grid])
    hashes = {computed(scene, workers=workers).info["state_hash"] for workers in (1, 1, 2, 4)}
    assert len(hashes) == 1


def test_angle_counts_whole_turns() -> None:
    scene = scene_of(world={"duration": 1.0}, ball=[ball(0, 0, angular_velocity=-50.0, angle=40.0)])
    # Box2D turns a body by atan(ω·h) in each of 400 substeps; 32-bit angles are rounded.
    assert computed(scene).angle[-1, 0] == pytest.approx(40.0 - 400 * math.atan(50.0 * 0.0025), abs=1e-3)


@pytest.mark.parametrize(
    ("body", "motion", "message"),
    [
        ({"position": [39_000.0, 0.0], "velocity": [1e6, 0.0]}, 0.0, "does not|do not resolve the slop"),
        ({"position": [0.0, 0.0], "angular_velocity": 310.0}, 1.0, "45° in a substep"),
    ],
)
def test_state_beyond_a_limit_of_box2d_ends_the_run(body: dict[str, Any], motion: float, message: str) -> None:
    thrust = {"body": "ball", "force": [0.0, 50.0 * motion], "point": [0.4, 0.0]}
    document = {"ball": [{"name": "ball", "radius": 0.5, **body}], "world": {"duration": 1.0}}
    result = run(scene_of(**document, **({"thrust": [thrust]} if motion else {})), "box2d", audit=False)
    assert result.status == "diverged"
    assert any(part in str(result.reason) for part in message.split("|"))


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({"ball": [ball(1e6, 0)]}, "spacing of 32-bit"),
        ({"ball": [ball(0, 0, velocity=[1e12, 0.0])]}, "the limit is"),
        ({"ball": [ball(0, 0, angular_velocity=1e4)]}, "less than 45°"),
        ({"ball": [ball(0, 0, mass=1e29)]}, "too extreme"),
    ],
)
def test_start_beyond_a_limit_is_refused(document: dict[str, Any], message: str) -> None:
    assert message in reason(scene_of(**document))


def polygon(points: list[list[float]]) -> dict[str, Any]:
    return {"position": [0.0, 5.0], "points": points, "mass": 1.0}


def test_polygons_that_box2d_would_change_are_refused() -> None:
    round_shape = [[math.cos(0.6 * k), math.sin(0.6 * k)] for k in range(10)]
    assert "10 corners" in reason(scene_of(polygon=[polygon(round_shape)]))
    nearly_in_line = [[-1, 0], [0, -1e-3], [1, 0], [0, 1]]
    assert "in line" in reason(scene_of(polygon=[polygon(nearly_in_line)]))
    assert not reason(scene_of(polygon=[polygon(nearly_in_line)]), slop=1e-5)
    tiny = [[-0.005, -0.005], [0.005, -0.005], [0.0, 0.005]]  # Box2D replaces it by a box of 1 m, without scaling
    result = computed(scene_of(plane=[FLOOR], polygon=[polygon(tiny) | {"position": [0.0, 0.02]}]))
    assert 0.0 < result.position[-1, 0, 1] < 0.01


def test_worlds_are_limited_and_freed_by_close() -> None:
    scene, open_ones = scene_of(ball=[ball(0, 0)]), []
    with pytest.raises(Refusal, match="128 Box2D worlds"):
        open_ones.extend(start(scene, "box2d") for _ in range(MAX_WORLDS + 1))  # keeps those before the refusal
    open_ones[0].step()
    frame = open_ones[0].frame()
    for each in open_ones:
        each.close()
    assert open_ones[0].frame().state_hash() == frame.state_hash()  # the state of an ended simulation can be read
    with pytest.raises(RuntimeError, match="ended"):
        open_ones[0].step()
    start(scene, "box2d").close()


def test_impulses_are_unknown_and_energy_is_not_accounted_for() -> None:
    scene = scene_of(plane=[FLOOR], ball=[ball(0, 0.6)])
    result = computed(scene)
    assert len(result.contact_time) == 1
    assert np.isnan(result.contact_impulse).all()
    assert result.contact_normal[0] == pytest.approx([0.0, -1.0], abs=1e-6)
    refused = run(scene, "box2d", account=True)
    assert (refused.status, len(refused.time)) == ("refused", 0)
    assert "impulses" in str(refused.reason)
    simulation = start(scene, "box2d")
    with pytest.raises(SnapshotError, match="Box2D"):
        simulation.snapshot()
    simulation.close()


def test_bodies_slide_on_a_rough_floor_and_are_smooth_against_each_other() -> None:
    """This needs two shapes of each body."""
    boxes = [{"position": [0, 0.5], "size": [1, 1], "velocity": [3, 0]}]
    floor = FLOOR | {"friction": 0.4, "restitution": 0.7}
    scene = scene_of(world=GRAVITY | {"duration": 0.5}, plane=[floor], box=boxes, ball=[ball(9, 2.5)])
    result = computed(scene, dt=0.002)
    # v − μ·g·t; the box starts as if it had just touched
    assert result.velocity[-1, 1, 0] == pytest.approx(3.0 - 0.4 * 9.81 * 0.5, abs=0.05)


def collisions(count: int, values: list[tuple[float, float]], only: int | None = None) -> Scene:
    """Return a scene in which each two of some materials collide, two bodies and a body with a wall, or one of these.

    Args:
        count: number of materials.
        values: friction and restitution of each pair.
        only: the pair that is in the scene, with all collisions of which it is one.
    """
    pairs = [(a, b) for a in range(count) for b in range(a, count)]
    stated, balls, walls = [], [], []
    for k, ((a, b), (friction, restitution)) in enumerate(zip(pairs, values, strict=True)):
        stated.append({"between": [f"m{a}", f"m{b}"], "friction": friction, "restitution": restitution})
        if only in (None, k):
            y = 4.0 * k
            balls.append(ball(0, y, name=f"left-{k}", material=f"m{a}", velocity=[2, 0.7]))
            balls.append(ball(1.5, y, name=f"right-{k}", material=f"m{b}", velocity=[0, 0.3], mass=3.0))
            balls.append(ball(9, y, name=f"down-{k}", material=f"m{a}", velocity=[1, -2]))
            walls.append({"points": [[7, y - 1], [14, y - 1]], "thickness": 0.2, "material": f"m{b}"})
    materials = [{"name": f"m{k}"} for k in range(count)]
    return scene_of(world={"duration": 0.6}, material=materials, pair=stated, ball=balls, wall=walls)


COEFFICIENTS = st.tuples(st.sampled_from([0.0, 0.1, 0.35, 1.0]), st.sampled_from([0.0, 0.2, 0.5, 0.9]))


@given(st.data(), st.integers(1, 4))
def test_each_pair_of_materials_collides_as_it_does_alone(data: st.DataObject, count: int) -> None:
    """A pair alone needs no more than one shape of each body, with the coefficients that the scene states."""
    size = count * (count + 1) // 2
    values = data.draw(st.lists(COEFFICIENTS, min_size=size, max_size=size))
    together = computed(collisions(count, values))
    for k in range(size):
        alone = computed(collisions(count, values, only=k))
        rows = slice(3 * k, 3 * k + 3)
        # Rounding of 32-bit numbers at other places of the plane, in up to 60 steps
        assert together.velocity[-1, rows] == pytest.approx(alone.velocity[-1], abs=1e-4)
        assert together.angular_velocity[-1, rows] == pytest.approx(alone.angular_velocity[-1], abs=1e-4)
        speed = 2.0 * values[k][1]
        assert together.velocity[-1, 3 * k + 2, 1] == pytest.approx(speed, abs=1e-3)


MANY = [(0.1 * (k % 7), 0.04 * (k % 23)) for k in range(253)]


def test_more_pairs_than_the_filters_have_bits_for_are_refused() -> None:
    assert not reason(collisions(6, MANY[:21]))
    assert "bits for 21" in reason(collisions(22, MANY[:253]))


def test_change_of_a_coefficient_gives_bodies_other_shapes_in_the_same_state() -> None:
    """Of balls of 0.9 and 0.5, one rebounds with 0.81, 0.45 or 0.25, for which no single shape of each is enough."""
    names, values = "abcd", (0.9, 0.9, 0.5, 0.5)
    balls = [ball(3 * k, 2, name=name, restitution=0.5) for k, name in enumerate(names)]
    approach = [each | {"velocity": [1.0 - 2.0 * (k % 2), 0.0]} for k, each in enumerate(balls)]
    scene = scene_of(world={"duration": 2.0}, ball=approach)
    simulation = start(scene, "box2d")
    simulation.step()
    before = simulation.state_hash()
    for name, value in zip(names, values, strict=True):
        simulation.apply(SetParameter(time=0.0, path=f"ball.{name}.restitution", value=value))
    assert simulation.state_hash() == before
    simulation.apply(SetParameter(time=0.0, path="ball.b.restitution", value=0.9))
    advance(simulation, 199)
    velocity = simulation.frame().velocity[:, 0]
    assert velocity == pytest.approx([-0.81, 0.81, -0.25, 0.25], abs=1e-4)
    simulation.close()


def test_action_that_needs_too_many_shapes_is_refused_and_changes_nothing() -> None:
    scene = collisions(22, [(0.5, 0.5)] * 253)
    simulation = start(scene, "box2d")
    simulation.step()
    before, scene = simulation.state_hash(), simulation.scene
    pair = SetParameter(time=0.0, path="pair.1.restitution", value=0.9)
    with pytest.raises(ActionError, match="bits for 21"):
        simulation.apply(pair)
    assert simulation.scene == scene
    assert simulation.state_hash() == before
    simulation.step()
    simulation.close()


def jointed(joints: list[dict[str, Any]], gravity: float = 0.0, **more: Any) -> Scene:
    arm = {"name": "arm", "position": [0.5, 0.0], "size": [1.0, 0.2], "mass": 1.0, "collides": "none", **more}
    world = {"gravity": [0.0, gravity], "duration": 2.0}
    return scene_of(world=world, box=[arm], joint=joints)


PIVOT = {"name": "hinge", "kind": "pivot", "between": ["arm"], "at": [0.0, 0.0]}


def test_motor_turns_its_pivot_up_to_the_limit() -> None:
    motor = {"kind": "motor", "between": ["arm"], "rate": 1.5}
    turned = computed(jointed([PIVOT, motor]))
    assert turned.angular_velocity[-1, 0] == pytest.approx(1.5, rel=1e-3)
    limit = {"kind": "rotary_limit", "between": ["arm"], "least": -0.5, "most": 0.5}
    stopped = computed(jointed([PIVOT, motor | {"max_torque": 5.0}, limit]))
    assert stopped.angle[-1, 0] == pytest.approx(0.5, abs=0.02)  # Box2D's joints are soft
    assert "part of a pivot" in reason(jointed([motor]))
    assert "whole turn" in reason(jointed([PIVOT, limit | {"least": -4.0, "most": 4.0}]))


def test_joint_breaks_at_its_strength() -> None:
    weight = 9.81  # N
    assert computed(jointed([PIVOT | {"strength": 5.0 * weight}], -9.81)).info["broken"] == 0
    broken = computed(jointed([PIVOT | {"strength": 0.2 * weight}], -9.81))
    assert broken.info["broken"] == 1
    assert broken.position[-1, 0, 1] < -5.0  # it falls


def test_actions_change_the_world() -> None:
    scene = scene_of(
        plane=[FLOOR], wall=[{"name": "shelf", "points": [[-1, 2], [1, 2]], "thickness": 0.2}],
        ball=[ball(0, 2.6, name="a"), ball(5, 0.5, name="b")],
    )  # fmt: skip
    simulation = start(scene, "box2d")
    simulation.contacts()
    advance(simulation, 50)
    assert simulation.frame().position[0, 1] == pytest.approx(2.6, abs=0.01)
    simulation.apply(Toggle(time=0.0, thing="shelf", solid=False))
    simulation.apply(Spawn(time=0.0, ball=Ball(position=(-5.0, 3.0), radius=0.5)))
    simulation.apply(Remove(time=0.0, body="b"))
    frame = advance(simulation, 150).frame()
    assert frame.position[[0, 2], 1] == pytest.approx([0.5, 0.5], abs=0.01)
    assert frame.present.tolist() == [True, False, True]
    with pytest.raises(ActionError, match="32-bit"):
        simulation.apply(Move(time=0.0, body="a", position=(1e6, 3.0)))
    with pytest.raises(ActionError, match="drive"):
        simulation.apply(Drive(time=0.0, drive="none", level=1.0))
    simulation.close()


def test_drives_by_torque_are_refused() -> None:
    drive = {"name": "flip", "kind": "torque", "body": "bat", "pivot": [0, 0], "stops": [0.0, 1.0], "torque": 1.0}
    scene = scene_of(box=[{"name": "bat", "position": [0.4, 0.0], "size": [1.0, 0.1]}], drive=[drive])
    assert "flip: a drive by torque" in reason(scene)


def test_joints_last_when_a_zone_changes_the_layer_of_a_body() -> None:
    """A pendulum that swings through a zone: its body gets other shapes, and keeps its rod."""
    joint = {"kind": "rod", "between": ["bob"], "anchors": [[0.0, 0.0], [0.0, 2.0]]}
    zone = {"position": [0.0, 0.0], "radius": 0.3, "to_layer": "up"}
    bob = {"name": "bob", "position": [2.0, 2.0], "radius": 0.2}
    scene = scene_of(ball=[bob], joint=[joint], zone=[zone])
    result = computed(scene, dt=0.001)
    assert set(result.layer[:, 0].tolist()) == {0, 1}
    length = np.hypot(*(result.position[:, 0] - np.asarray([0.0, 2.0])).T)
    assert length == pytest.approx(np.full(len(length), 2.0), abs=0.01)  # Box2D's joints are soft


def test_half_plane_reaches_as_far_as_bodies_go() -> None:
    scene = scene_of(
        world=GRAVITY | {"duration": 20.0}, plane=[FLOOR], solver={"dt": 0.02, "substeps": 4},
        ball=[ball(0, 0.5, velocity=[700.0, 0.0])],
    )  # fmt: skip
    result = computed(scene)
    assert result.position[-1, 0] == pytest.approx([14_000.0, 0.5], rel=0.02)
    assert len(result.contact_time) == 1  # one contact, which no extension interrupts


@pytest.mark.parametrize("engine", [name for name in ENGINES if name != "box2d"])
@pytest.mark.parametrize("setting", [{"continuous": True}, {"workers": 2}])
def test_other_engines_refuse_its_settings(engine: str, setting: dict[str, Any]) -> None:
    scene = from_document({"ball": [ball(0, 0)]})
    missing = ENGINES[engine].missing(scene, scene.solver.replace(**setting))
    assert missing == (f"{next(iter(setting))} applies to box2d only; remove it",)


def test_engine_that_is_not_installed_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(registry.ENGINES, "box2d")
    with pytest.raises(UnknownEngineError, match=r"pip install -e '\.\[box2d\]'"):
        engine_named("box2d")


def test_divergence_is_a_divergence_for_a_single_step() -> None:
    simulation = start(scene_of(ball=[ball(0, 0, angular_velocity=313.0)], solver={"dt": 0.01, "substeps": 4}), "box2d")
    simulation.apply(Move(time=0.0, body=simulation.bodies.names[0], position=(39_999.0, 0.0), velocity=(1e5, 0.0)))
    with pytest.raises(Divergence, match="32-bit"):
        simulation.step()


def test_joints_last_when_a_coefficient_needs_other_shapes() -> None:
    """With a rough floor, smooth boxes need separate shapes against it and each other, and Box2D's bodies are new."""
    boxes = [{"name": name, "position": [x, 5.0], "size": [1.0, 0.2]} for name, x in (("a", 0.5), ("b", 1.5))]
    joints = [PIVOT | {"between": ["a"], "at": [0.0, 5.0], "strength": 1e6}, {"kind": "rod", "between": ["a", "b"]}]
    simulation = start(scene_of(plane=[FLOOR], box=boxes, joint=joints), "box2d")
    simulation.step()
    simulation.apply(SetParameter(time=0.0, path="plane.*.friction", value=0.3))
    frame = advance(simulation, 50).frame()
    hinge = frame.position[0] - 0.5 * np.asarray([math.cos(frame.angle[0]), math.sin(frame.angle[0])])
    assert hinge == pytest.approx([0.0, 5.0], abs=0.02)  # Box2D's joints are soft
    assert math.dist(frame.position[0], frame.position[1]) == pytest.approx(1.0, abs=0.02)
    assert not simulation.broken
    simulation.close()


def test_pivot_that_breaks_with_its_motor_is_refused() -> None:
    motor = {"kind": "motor", "between": ["arm"], "rate": 1.5}
    assert "breaks" in reason(jointed([PIVOT | {"strength": 5.0}, motor]))
