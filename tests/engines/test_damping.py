"""Damping on every engine: closed forms, the bits of pymunk's own steps, energy, and refusals by name."""

import math
from typing import Any

import numpy as np
import pymunk
import pytest
from scipy.integrate import solve_ivp

from sandbox.action import ActionError, Force, SetParameter
from sandbox.engines.contract import Refusal
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.registry import start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from tests import accounts
from tests.engines.stepping import advance

DT = 0.01
G = 9.81
FLOOR = {"point": [0.0, 0.0], "normal": [0.0, 1.0], "friction": 0.5, "restitution": 0.6}


def scene_of(damping: float = 0.3, gravity: float = -G, **more: Any) -> Scene:
    world = {"gravity": [0.0, gravity], "damping": damping, **more.pop("world", {})}
    return from_document({"world": world, "solver": {"dt": DT, **more.pop("solver", {})}, **more})


def ball(x: float = 0.0, y: float = 0.0, **more: Any) -> dict[str, Any]:
    return {"position": [x, y], "radius": 0.25, "mass": 2.0, **more}


@pytest.mark.parametrize("substeps", [1, 3])
@pytest.mark.parametrize("count", [1, 300])
@pytest.mark.parametrize("collides", ["none", "all"])
def test_flight_has_the_bits_of_a_pymunk_space(substeps: int, count: int, collides: str) -> None:
    """Bodies in flight are computed outside of the space where nothing can touch them."""
    speeds = [(0.1 * k, 3.0 - 0.7 * k) for k in range(count)]
    balls = [
        ball(2.0 * k, 0.0, velocity=[*speeds[k]], angular_velocity=1.0 + k, collides=collides, name=f"b{k}")
        for k in range(count)
    ]
    scene = scene_of(0.9, ball=balls, solver={"substeps": substeps})
    simulation = start(scene, "pymunk")
    force, torque = (0.3, -0.7), 0.11
    simulation.apply(Force(time=0.0, body="b0", force=force, torque=torque))
    space = pymunk.Space()
    space.gravity, space.damping = (0.0, -G), 0.9
    bodies = []
    for k in range(count):
        body = pymunk.Body(2.0, float(scene.bodies.moment[k]))
        body.position, body.velocity, body.angular_velocity = (2.0 * k, 0.0), speeds[k], 1.0 + k
        space.add(body)
        bodies.append(body)
    for _ in range(300):
        simulation.step()
        for _ in range(substeps):
            bodies[0].force, bodies[0].torque = force, torque
            space.step(DT / substeps)
    frame = simulation.frame()
    found = np.column_stack((frame.position, frame.velocity, frame.angle, frame.angular_velocity))
    expected = np.asarray([[*b.position, *b.velocity, b.angle, b.angular_velocity] for b in bodies])
    assert found.tobytes() == expected.tobytes()


def test_damping_that_an_action_sets_has_the_bits_of_a_pymunk_space() -> None:
    simulation = start(scene_of(1.0, ball=[ball(velocity=[3.0, 4.0], collides="none")]), "pymunk")
    space, body = pymunk.Space(), pymunk.Body(2.0, 1.0)
    space.gravity, body.velocity = (0.0, -G), (3.0, 4.0)
    space.add(body)
    for k in range(90):
        if k in (30, 60):
            space.damping = 0.4 if k == 30 else 1.0
            simulation.apply(SetParameter(time=simulation.time, path="world.damping", value=space.damping))
        simulation.step()
        space.step(DT)
        frame = simulation.frame()
        assert [*frame.position[0], *frame.velocity[0]] == [*body.position, *body.velocity]


def test_box2d_divides_velocities_by_its_implicit_step() -> None:
    """Each substep divides by 1 + λh (Box2D, `b2IntegrateVelocities`)."""
    scene = scene_of(
        0.3, 0.0, ball=[ball(velocity=[3.0, -4.0], angular_velocity=5.0)], world={"linear_drag": 0.5, "wind": [0, 0]}
    )
    simulation = start(scene, "box2d")
    advance(simulation, 100)
    rate, frame = -math.log(0.3), simulation.frame()
    # 100 roundings of 32-bit numbers, 6e-8 each
    assert frame.velocity[0] == pytest.approx(np.array([3.0, -4.0]) / (1.0 + (rate + 0.5) * DT) ** 100, rel=1e-5)
    assert frame.angular_velocity[0] == pytest.approx(5.0 / (1.0 + rate * DT) ** 100, rel=1e-5)


BOXES = {
    "plane": [FLOOR],
    "box": [
        {
            "position": [0.4 * k, 0.6 + 0.7 * k],
            "size": [0.8, 0.5],
            "angle": 0.2 * k,
            "angular_velocity": 2.0,
            "mass": 1.5,
        }
        for k in range(4)
    ],
}
SPRINGS = {
    "ball": [
        ball(0.0, 3.0, name="a", velocity=[1.0, 2.0], collides="none"),
        ball(1.2, 3.0, name="b", collides="none"),
        ball(-3.0, 3.0, name="free", velocity=[0.0, 3.0], angular_velocity=4.0, collides="none"),
    ],
    "joint": [
        {"kind": "spring", "between": ["a"], "anchors": [[0.0, 0.0], [0.0, 5.0]], "stiffness": 40.0, "damping": 0.5},
        {"kind": "rod", "between": ["a", "b"]},
    ],
    "attraction": [{"toward": [0.0, 5.0], "strength": 2.0, "softening": 0.5}],
    "thrust": [{"body": "b", "force": [1.0, 2.0], "point": [0.01, 0.02]}],
}
FLIGHT = {"ball": [ball(velocity=[2.0, 3.0], angular_velocity=4.0, collides="none")]}


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("tables", [BOXES, SPRINGS, FLIGHT], ids=["boxes", "springs", "flight"])
@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_ledger_closes_with_damping(tables: dict[str, Any], engine: str) -> None:
    scene = scene_of(0.3, solver={"substeps": 2}, **tables)
    account = accounts.closed_account(scene, 60, part=0.3, engine=engine, closes=1e-11)  # rounding of sums
    assert account[Cause.DRAG] < 0.0


def test_damping_work_matches_its_integral() -> None:
    """∫ λ (m v² + I ω²) dt against scipy's DOP853."""
    scene, rate = scene_of(0.3, **FLIGHT), -math.log(0.3)
    mass, moment = 2.0, float(scene.bodies.moment[0])

    def fly(_: float, y: Any) -> list[float]:
        power = rate * (mass * (y[0] ** 2 + y[1] ** 2) + moment * y[2] ** 2)
        return [-rate * y[0], -G - rate * y[1], -rate * y[2], -power]

    truth = solve_ivp(fly, (0, 1), [2.0, 3.0, 4.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-12).y[3, -1]
    for engine, settings, error in (
        ("reference", {"integrator": "rk4"}, 2e-5),  # the path of a step is a parabola: (λh)²/12 = 1e-5
        ("pymunk", {}, 0.02),  # first order: λh = 0.012
    ):
        simulation = start(scene, engine, scene.solver.replace(**settings))
        simulation.account()
        advance(simulation, 100)
        assert simulation.account()[Cause.DRAG] == pytest.approx(truth, rel=error)


def test_ledger_closes_when_an_action_sets_the_damping() -> None:
    action = SetParameter(time=0.0, path="world.damping", value=0.2)
    for engine in ("pymunk", "reference"):
        scene = scene_of(1.0, **BOXES)
        account = accounts.closed_account(scene, 60, [(30, action)], engine=engine, closes=1e-11)  # rounding of sums
        assert account[Cause.DRAG] < 0.0


STROKE = {"name": "d", "kind": "stroke", "body": "a", "pivot": [0.2, 0.0], "stops": [0.0, 1.0], "rate": 1.0}
NAMED = {"ball": [ball(name="a")]}
SURFACE = {"sliding_friction": 0.2}


@pytest.mark.parametrize(
    ("engine", "document", "reason"),
    [
        ("pymunk", {"world": {"linear_drag": 0.1}}, "drag and damping"),
        ("pymunk", {"world": {"quadratic_drag": 0.1}}, "drag and damping"),
        ("pymunk", {"drive": [STROKE]}, "drives and damping"),
        ("pymunk", {"solver": {"half_kick": True}}, "half_kick does not support damping"),
        ("pymunk", {"surface": SURFACE, "gravity": 0.0}, "damping on a floor"),
        ("reference", {"surface": SURFACE, "gravity": 0.0}, "damping on a floor"),
        ("exact", {}, "damping"),
    ],
)
def test_damping_that_an_engine_does_not_model_is_refused_by_name(
    engine: str, document: dict[str, Any], reason: str
) -> None:
    scene = scene_of(0.3, **NAMED, **document)
    with pytest.raises(Refusal, match=reason):
        start(scene, engine)


@pytest.mark.parametrize(
    ("engine", "document", "path", "value", "reason"),
    [
        ("pymunk", {"damping": 1.0, "world": {"linear_drag": 0.1}}, "world.damping", 0.5, "drag and damping"),
        ("pymunk", {"damping": 0.5}, "world.quadratic_drag", 0.5, "drag and damping"),
        ("pymunk", {"damping": 1.0, "drive": [STROKE]}, "world.damping", 0.5, "drives and damping"),
        ("pymunk", {"damping": 1.0, "solver": {"half_kick": True}}, "world.damping", 0.5, "half_kick"),
        ("exact", {"damping": 1.0}, "world.damping", 0.5, "damping"),
    ],
)
def test_action_that_an_engine_does_not_model_leaves_the_simulation_unchanged(
    engine: str, document: dict[str, Any], path: str, value: float, reason: str
) -> None:
    simulation = start(scene_of(**NAMED, **document), engine)
    before = simulation.state_hash()
    with pytest.raises(ActionError, match=reason):
        simulation.apply(SetParameter(time=0.0, path=path, value=value))
    assert simulation.state_hash() == before


def test_driven_bodies_are_not_damped_on_the_reference() -> None:
    pivot = {"pivot": [0.2, 0.0], "stops": [0.0, 1.0], "body": "a", "name": "d"}
    for drive in (pivot | {"kind": "torque", "torque": 1.0}, pivot | {"kind": "stroke", "rate": 1.0}):
        ends = []
        for damping in (0.1, 1.0):
            simulation = start(scene_of(damping, 0.0, ball=[ball(name="a")], drive=[drive]), "reference")
            advance(simulation, 30)
            ends.append(simulation.state_hash())
        assert ends[0] == ends[1]
