"""Welds, prismatic joints and wheels: closed forms, motors, breaking, and continuation on another engine."""

import math
from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.action import ActionError, SetParameter, Switch
from sandbox.engines.energy_ledger import Cause
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from tests.scene.faults import faults_of

pytestmark = pytest.mark.fail_slow(60)  # kernels compile

G = 10.0
ENGINES = ("pymunk", "box2d", "reference")
METHODS: list[tuple[str, dict[str, Any]]] = [
    *((engine, {}) for engine in ENGINES),
    *(("reference", {"joints": method}) for method in ("relaxation", "xpbd", "rattle")),
]

every_engine = pytest.mark.parametrize("engine", ENGINES)
every_method = pytest.mark.parametrize(("engine", "more"), METHODS, ids=str)


def scene_of(*joints: dict[str, Any], gravity: float = -G, **bodies: Any) -> Scene:
    solver = {"dt": 0.002, "iterations": 40}
    return from_document({"world": {"gravity": [0, gravity]}, "solver": solver, "joint": [*joints], **bodies})


def box(name: str, x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "size": [1.0, 0.2], "mass": 1.0, **more}


def joint(kind: str, *between: str, **more: Any) -> dict[str, Any]:
    return {"name": "j", "kind": kind, "between": list(between), **more}


def started(scene: Scene, engine: str, **more: Any) -> sandbox.Simulation:
    return sandbox.start(scene, engine, scene.solver.replace(**more))


def advance(simulation: sandbox.Simulation, seconds: float) -> None:
    for _ in range(round(seconds / simulation.settings.dt)):
        simulation.step()


@every_method
def test_welded_boxes_move_as_one_body(engine: str, more: dict[str, Any]) -> None:
    """A welded pair that is thrown and turns is where a compound of the same boxes is."""
    spin = {"angular_velocity": 3.0}
    # Two boxes that turn as one: each centre has the velocity ω × r about the common one.
    boxes = [box("a", -0.5, 0, velocity=[1.0, 3.5], **spin), box("b", 0.5, 0, velocity=[1.0, 6.5], **spin)]
    welded = started(scene_of(joint("weld", "a", "b", at=[0.0, 0.0]), gravity=0.0, box=boxes), engine, **more)
    parts = [{"position": [x, 0.0], "size": [1.0, 0.2]} for x in (-0.5, 0.5)]
    body = {"name": "c", "position": [0, 0], "velocity": [1.0, 5.0], "mass": 2.0, "box": parts, **spin}
    single = started(scene_of(gravity=0.0, body=[body]), engine)
    for simulation in (welded, single):
        advance(simulation, 1.0)
    pair, whole = welded.frame(), single.frame()
    # rad and m: an explicit step turns bodies along tangents, so that impulses lose spin in proportion to the step
    tolerance = 0.02
    assert pair.angle == pytest.approx([whole.angle[0]] * 2, abs=tolerance)
    assert pair.position.mean(axis=0) == pytest.approx(whole.position[0], abs=1e-9 if engine != "box2d" else 1e-4)
    arm = 0.5 * np.array([math.cos(whole.angle[0]), math.sin(whole.angle[0])])
    assert pair.position[1] - pair.position[0] == pytest.approx(2.0 * arm, abs=tolerance)


@every_engine
@pytest.mark.parametrize("strength", ["strength", "torque_strength"])
@pytest.mark.parametrize("breaks", [False, True])
def test_weld_of_a_cantilever_breaks_by_force_or_torque(engine: str, strength: str, breaks: bool) -> None:
    """A beam of 1 kg and 1 m is held at its end: the force is m g = 10 N, the torque m g L/2 = 5 N·m."""
    load = 10.0 if strength == "strength" else 5.0
    above = 2.0 if engine == "box2d" else 1.01  # its soft joints overshoot in the first steps
    limit = {strength: (0.99 if breaks else above) * load}
    simulation = started(scene_of(joint("weld", "a", at=[-0.5, 0.0], **limit), box=[box("a", 0, 0)]), engine)
    advance(simulation, 0.2)
    assert bool(simulation.broken) == breaks
    if breaks:  # as a whole: it falls and does not turn about the end
        assert simulation.setup.joints.count_among(simulation.broken) == 1
        advance(simulation, 0.3)
        assert simulation.frame().angle[0] == pytest.approx(0.0, abs=0.02)  # rad, turned before it broke
        assert simulation.frame().position[0, 1] < -0.5
    else:  # m: engines hold with a small sag
        assert simulation.frame().position[0] == pytest.approx([0.0, 0.0], abs=2e-3)


@every_method
def test_motor_of_a_prismatic_joint_moves_a_body_at_its_rate_up_to_the_end(engine: str, more: dict[str, Any]) -> None:
    """A lift that carries its load off the centre neither tilts nor drifts sideways, and stops at the end."""
    lift = joint("prismatic", "a", axis=[0.0, 2.0], at=[0.3, 0.0], travel=[-0.2, 0.5], rate=0.5)
    simulation = started(scene_of(lift, box=[box("a", 0, 0)]), engine, **more)
    advance(simulation, 0.8)
    frame = simulation.frame()
    # m: one step of the motor, and the sag of a joint under the weight
    assert frame.position[0] == pytest.approx([0.0, 0.4], abs=2e-3)
    assert frame.angle[0] == pytest.approx(0.0, abs=2e-3)
    assert frame.velocity[0] == pytest.approx([0.0, 0.5], abs=2e-3)
    advance(simulation, 1.2)
    assert simulation.frame().position[0, 1] == pytest.approx(0.5, abs=2e-3)


@every_method
def test_motor_of_a_prismatic_joint_is_limited_by_its_largest_force(engine: str, more: dict[str, Any]) -> None:
    """A motor of 6 N does not hold 1 kg: the body falls with g − F/m = 4 m/s²."""
    lift = joint("prismatic", "a", axis=[0.0, 1.0], travel=[-5.0, 5.0], rate=0.0, max_force=6.0)
    simulation = started(scene_of(lift, box=[box("a", 0, 0)]), engine, **more)
    advance(simulation, 0.5)
    # m/s: the force of rattle's first step is that of half a step
    assert simulation.frame().velocity[0, 1] == pytest.approx(-2.0, abs=0.02)


@every_engine
def test_axis_of_a_prismatic_joint_turns_with_its_first_body(engine: str) -> None:
    """A slider on a turning arm moves outward along it: r = r₀ cosh ωt by the centrifugal force."""
    omega, arm = 2.0, {"name": "arm", "position": [0, 0], "size": [4.0, 0.1], "moment": 1e6, "mass": 1.0}
    slider = {"name": "s", "position": [0.5, 0], "size": [0.1, 0.1], "mass": 1.0, "velocity": [0.0, 0.5 * omega]}
    boxes = [{**arm, "angular_velocity": omega}, {**slider, "angular_velocity": omega}]
    joints = [
        {"kind": "pivot", "between": ["arm"], "at": [0, 0]},
        joint("prismatic", "arm", "s", axis=[1.0, 0.0], travel=[-0.5, 9.0]),
    ]
    simulation = started(scene_of(*joints, gravity=0.0, box=boxes), engine, dt=0.0005)
    advance(simulation, 0.8)
    frame = simulation.frame()
    # m: first order in the step
    assert np.hypot(*frame.position[1]) == pytest.approx(0.5 * math.cosh(omega * 0.8), rel=5e-3)
    assert frame.angle[1] == pytest.approx(frame.angle[0], abs=5e-3)


@every_engine
def test_wheel_bounces_on_its_spring_and_is_turned_by_its_motor(engine: str) -> None:
    """The hub oscillates with 2π √(m/k) about the sag m g/k; a motor of 0.1 N·m turns it with τ/I until its rate."""
    stiffness, period, radius = 100.0, 2.0 * math.pi * 0.1, 0.2
    ball = {"name": "w", "position": [0, 0], "radius": radius, "mass": 1.0}
    wheel = joint("wheel", "w", axis=[0, 1], travel=[-0.5, 0.5], stiffness=stiffness, rate=-20.0, max_torque=0.1)
    simulation = started(scene_of(wheel, ball=[ball]), engine, dt=0.0005)
    acceleration = 0.1 / (0.5 * radius**2)  # 5 rad/s²
    advance(simulation, 0.5 * period)
    frame = simulation.frame()
    assert frame.position[0] == pytest.approx([0.0, -2.0 * G / stiffness], abs=1e-3)  # m, first order in the step
    assert frame.angular_velocity[0] == pytest.approx(-acceleration * 0.5 * period, rel=2e-3)
    advance(simulation, 0.5 * period)
    assert simulation.frame().position[0] == pytest.approx([0.0, 0.0], abs=2e-3)
    advance(simulation, 20.0 / acceleration)
    assert simulation.frame().angular_velocity[0] == pytest.approx(-20.0, rel=1e-3)


@every_engine
def test_suspension_rests_where_its_spring_is_told_to(engine: str) -> None:
    """Without gravity, a damped wheel comes to rest at its `rest`, beyond which the travel ends it."""
    ball = {"name": "w", "position": [0, 0], "radius": 0.2, "mass": 1.0}
    for rest, expected in ((0.1, 0.1), (-0.1, -0.1), (0.9, 0.3)):
        wheel = joint("wheel", "w", axis=[0, 3], travel=[-0.3, 0.3], stiffness=100.0, damping=20.0, rest=rest)
        simulation = started(scene_of(wheel, gravity=0.0, ball=[ball]), engine)
        advance(simulation, 2.0)
        assert simulation.frame().position[0, 1] == pytest.approx(expected, abs=2e-3)  # m, sag of the end


@every_engine
@pytest.mark.parametrize(
    ("kind", "more", "path", "value"),
    [
        ("prismatic", {"axis": [1, 0], "travel": [-9.0, 9.0], "rate": 0.0}, "joint.j.rate", 2.0),
        ("wheel", {"axis": [0, 1], "travel": [-1.0, 1.0], "stiffness": 1.0, "rate": 0.0}, "joint.j.rate", 2.0),
    ],
)
def test_rate_of_a_motor_can_be_set_in_a_run(
    engine: str, kind: str, more: dict[str, Any], path: str, value: float
) -> None:
    simulation = started(scene_of(joint(kind, "a", **more), gravity=0.0, box=[box("a", 0, 0)]), engine)
    advance(simulation, 0.1)
    simulation.apply(SetParameter(time=0.0, path=path, value=value))
    advance(simulation, 0.1)
    frame = simulation.frame()
    moved = frame.velocity[0, 0] if kind == "prismatic" else frame.angular_velocity[0]
    assert moved == pytest.approx(value, rel=1e-3)


def test_joint_without_a_motor_gets_none_in_a_run() -> None:
    lift = joint("prismatic", "a", axis=[1, 0], travel=[-1, 1])
    simulation = started(scene_of(lift, box=[box("a", 0, 0)]), "pymunk")
    with pytest.raises(ActionError, match="no motor"):
        simulation.apply(SetParameter(time=0.0, path="joint.j.rate", value=1.0))


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_work_of_a_motor_along_an_axis_is_that_of_a_drive(engine: str) -> None:
    """Lifting 1 kg by 0.4 m, from rest, takes m g h + ½ m v²."""
    lift = joint("prismatic", "a", axis=[0.0, 1.0], travel=[-0.2, 0.5], rate=0.5)
    simulation = started(scene_of(lift, box=[box("a", 0, 0)]), engine)
    simulation.account()
    advance(simulation, 0.8)
    height = float(simulation.frame().position[0, 1])
    entries = simulation.account()
    # J: the jerk at the start is inelastic, and takes as much again as the kinetic energy
    assert entries[Cause.DRIVES] == pytest.approx(G * height + 0.5 * 0.5**2, abs=0.5 * 0.5**2 + 0.01)


@pytest.mark.parametrize(("engine", "other"), [("pymunk", "reference"), ("reference", "box2d"), ("box2d", "pymunk")])
def test_compound_joints_hold_after_a_switch_and_in_a_copy(engine: str, other: str) -> None:
    boxes = [box("a", -0.5, 0), box("b", 0.5, 0, angle=0.3), box("c", 3, 0)]
    joints = [
        {"kind": "pivot", "between": ["a"], "at": [-1, 0]},
        {"kind": "weld", "between": ["a", "b"]},
        {"kind": "prismatic", "between": ["c"], "axis": [0, 1], "travel": [-3, 3], "rate": -0.5},
    ]
    simulation = started(scene_of(*joints, box=boxes), engine)
    advance(simulation, 0.3)
    snapshot = simulation.snapshot() if engine == "reference" else None  # the others cannot be copied
    simulation.apply(Switch(time=0.0, engine=other))
    advance(simulation, 0.3)
    frame = simulation.frame()
    assert frame.angle[1] - frame.angle[0] == pytest.approx(0.3, abs=5e-3)  # rad, error of a weld under its load
    assert frame.position[2, 1] == pytest.approx(-0.3, abs=3e-3)  # m, one step of each motor
    if snapshot is not None:
        simulation.restore(snapshot)
        advance(simulation, 0.3)
        assert simulation.frame().position[2, 1] == pytest.approx(-0.3, abs=3e-3)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ('kind="prismatic"\naxis=[0,0]\ntravel=[-1,1]', "axis: no direction"),
        ('kind="prismatic"\naxis=[0,1]\ntravel=[1,2]', "travel: contain 0"),
        ('kind="wheel"\naxis=[0,1]\ntravel=[0,0]\nstiffness=1', "travel: contain 0"),
        ('kind="wheel"\naxis=[0,1]\ntravel=[-1,1]', "stiffness: missing"),
        ('kind="weld"\nmax_force=1', "max_force: unknown"),
    ],
)
def test_invalid_compound_joints_are_refused(text: str, fault: str) -> None:
    document = '[[ball]]\nname="a"\nposition=[0,0]\nradius=1\n[[joint]]\nbetween=["a"]\n' + text
    path, _, words = fault.partition(": ")
    faults = faults_of(document)
    assert any(path in each.path and words.split()[0] in each.message for each in faults), faults


@every_engine
def test_axis_beside_the_centre_of_its_first_body_is_kept(engine: str) -> None:
    """A spring pushes a hub along an axis one metre beside the centre of a light body, which it turns.

    The hub is never farther from the axis than the error of a first-order step at the jolt of the end of the travel,
    and all engines end in the same state.
    """
    bodies = [box("a", 0, 0, size=[1.0, 0.4], mass=5.0), box("b", 1, 0, size=[0.2, 0.2])]
    wheel = joint("wheel", "a", "b", axis=[0, 1], travel=[-0.3, 0.3], stiffness=300.0, rest=0.6)
    scene = scene_of(wheel, gravity=0.0, box=bodies)
    run = sandbox.run(scene.with_duration(1.0), engine)
    assert run.info["joint_error"] < 0.1  # of the diameter of `b`, 0.28 m
    expected = sandbox.run(scene.with_duration(1.0), "reference", dt=0.0001, record_every=100)
    assert run.position[-1] == pytest.approx(expected.position[-1], abs=0.02)
