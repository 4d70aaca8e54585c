"""Kinematic bodies: they keep their velocities whatever they collide with, and push dynamic bodies, on every engine."""

import math
from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.action import ActionError, Force, Impulse, Move, Spawn
from sandbox.engines.contract import Refusal
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.registry import start
from sandbox.measure.analytic.solve import closed_form, solution
from sandbox.measure.metrics.contacts import max_penetration
from sandbox.measure.metrics.invariants import conserves_energy, energy_gain, momentum_drift
from sandbox.measure.preflight.checks import warnings
from sandbox.measure.preflight.speed_bound import SpeedBounds
from sandbox.measure.preflight.tunnelling import tunnelling_risks
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.bodies import Box
from sandbox.scene.description.discs import Ball
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document
from tests.accounts import closed_account
from tests.engines.stepping import advance

ENGINES = ["pymunk", "box2d", "reference"]
every_engine = pytest.mark.parametrize("engine", ENGINES)

SINGLE = 1e-5
"""m, m/s or rad: 32-bit rounding of Box2D, at positions of a few metres and summed over some hundred steps"""

TURN = 3.0e-4
"""rad: Box2D turns a body by arctan(ω h), which is (ω h)³/3 less than ω h in each of 200 steps"""

STROKE = {"kind": "stroke", "body": "paddle", "pivot": [0.0, 0.0], "rate": 1.0, "stops": [0.0, 1.0]}
FLOOR = {"point": [0.0, 0.0], "normal": [0.0, 1.0]}


def scene_of(duration: float = 1.0, gravity: float = 0.0, **tables: Any) -> Scene:
    world = {"duration": duration, "gravity": [0.0, gravity], **tables.pop("world", {})}
    return from_document({"world": world, "solver": {"dt": 0.005}} | tables)


def ball(x: float, y: float = 0.0, **more: Any) -> dict[str, Any]:
    return {"name": "ball", "position": [x, y], "radius": 0.1, "mass": 2.0, **more}


def paddle(x: float, y: float = 0.0, size: tuple[float, float] = (0.2, 2.0), **more: Any) -> dict[str, Any]:
    return {"name": "paddle", "position": [x, y], "size": list(size), "kinematic": True, **more}


@every_engine
def test_position_and_angle_follow_the_velocities_whatever_is_in_the_way(engine: str) -> None:
    """Gravity, drag, a wall, a fixed box and a ball do not change the motion."""
    tables: dict[str, Any] = {
        "box": [
            paddle(-1.0, 1.0, velocity=[2.0, -0.5], angular_velocity=3.0),
            {"position": [0.0, 0.5], "size": [0.2, 0.2], "fixed": True},
        ],
        "ball": [ball(0.5, 1.0)],
        "plane": [FLOOR],
    }
    run = sandbox.run(scene_of(gravity=-10.0, world={"linear_drag": 0.5}, **tables), engine)
    index = run.names.tolist().index("paddle")
    time = run.time[:, None]
    assert run.position[:, index] == pytest.approx(np.array([-1.0, 1.0]) + time * [2.0, -0.5], abs=SINGLE)
    assert run.angle[:, index] == pytest.approx(3.0 * run.time, abs=TURN if engine == "box2d" else SINGLE)
    assert run.velocity[-1, index].tolist() == [2.0, -0.5] and run.angular_velocity[-1, index] == 3.0


@every_engine
@pytest.mark.parametrize("restitution", [0.0, 0.6, 1.0])
def test_ball_rebounds_from_a_paddle_relative_to_it(engine: str, restitution: float) -> None:
    """With the speed v against the paddle, which has u, it leaves at e (v + u) + u; its mass does not matter."""
    v, u = 2.0, 1.5
    tables = {
        "ball": [ball(0.5, velocity=[-v, 0.0], restitution=restitution)],
        "box": [paddle(-0.5, velocity=[u, 0.0], restitution=1.0)],
    }
    end = sandbox.run(scene_of(**tables), engine)
    assert end.velocity[-1, 0, 0] == pytest.approx(restitution * (v + u) + u, abs=SINGLE)
    assert end.velocity[-1, 1].tolist() == [u, 0.0]


@every_engine
def test_platform_carries_a_box_that_rests_on_it_with_friction(engine: str) -> None:
    """Friction gives it the speed u of the platform in u / (μ g) = 0.2 s; it lags by u² / (2 μ g) = 0.1 m."""
    tables = {
        "box": [
            {"name": "box", "position": [0.0, 0.15], "size": [0.2, 0.1], "friction": 0.5},
            paddle(0.0, 0.0, (4.0, 0.2), velocity=[1.0, 0.0], friction=1.0),
        ]
    }
    run = sandbox.run(scene_of(gravity=-10.0, **tables), engine)
    assert run.velocity[-1, 0, 0] == pytest.approx(1.0, abs=1e-3)  # residual slip of iterated friction
    assert run.position[-1, 0, 0] == pytest.approx(1.0 - 0.1, abs=0.01)  # u·h of the step in which it starts, and slops


@every_engine
def test_kinematic_bodies_pass_through_each_other_and_through_fixed_ones(engine: str) -> None:
    tables: dict[str, Any] = {
        "box": [
            paddle(-1.0, velocity=[2.0, 0.0]),
            paddle(1.0, velocity=[-2.0, 0.0], name="other"),
            {"position": [0.0, 0.0], "size": [0.2, 0.2], "fixed": True},
        ],
        "wall": [{"points": [[0.0, -1.0], [0.0, 1.0]]}],
    }
    scene = scene_of(**tables)
    assert not contact_matrix(scene).touches.any()
    run = sandbox.run(scene, engine)
    assert run.position[-1, :2, 0] == pytest.approx([1.0, -1.0], abs=SINGLE)
    assert not len(run.contact_time)


@pytest.mark.parametrize("engine", ["pymunk", "box2d"])
def test_carrier_turns_a_ball_on_a_pivot(engine: str) -> None:
    """A carrier that turns at ω holds a ball at 1 m from its centre: the ball circles at ω."""
    joint = {"kind": "pivot", "between": ["paddle", "ball"], "at": [1.0, 0.0]}
    tables = {
        "ball": [ball(1.0, velocity=[0.0, 2.0], collides="none")],
        "box": [paddle(0.0, angular_velocity=2.0, collides="none")],
        "joint": [joint],
    }
    run = sandbox.run(scene_of(**tables), engine, dt=0.001)
    radius = np.hypot(*run.position[:, 0].T)
    assert radius == pytest.approx(1.0, abs=2e-3)  # joints of a scheme of order 1 at steps of 1 ms: h ω² r t / 2
    assert run.position[-1, 0] == pytest.approx([math.cos(2.0), math.sin(2.0)], abs=4e-3)  # likewise
    assert run.position[-1, 1].tolist() == [0.0, 0.0]


@every_engine
def test_actions_set_position_and_velocities(engine: str) -> None:
    simulation = start(scene_of(box=[paddle(0.0)], ball=[ball(5.0)]), engine)
    simulation.apply(Move(time=0, body="paddle", position=(1.0, 2.0), velocity=(3.0, 0.0), angular_velocity=-2.0))
    frame = advance(simulation, 100).frame()
    index = simulation.bodies.names.index("paddle")
    assert frame.position[index] == pytest.approx([1.0 + 3.0 * 0.5, 2.0], abs=SINGLE)
    assert frame.angle[index] == pytest.approx(-1.0, abs=TURN if engine == "box2d" else SINGLE)
    simulation.apply(Move(time=0, body="paddle", position=(0.0, 0.0), velocity=(0.0, 0.0), angular_velocity=0.0))
    simulation.step()
    assert simulation.frame().position[index].tolist() == [0.0, 0.0]
    simulation.close()


@every_engine
def test_forces_and_impulses_are_refused(engine: str) -> None:
    simulation = start(scene_of(box=[paddle(0.0)]), engine)
    for action in (Impulse(time=0, body="paddle", impulse=(1.0, 0.0)), Force(time=0, body="paddle", force=(1.0, 0.0))):
        with pytest.raises(ActionError, match="is kinematic: no impulse or force changes its motion"):
            simulation.apply(action)
    simulation.close()


@every_engine
def test_kinematic_body_can_be_added_to_a_running_scene(engine: str) -> None:
    simulation = start(scene_of(ball=[ball(0.0, velocity=[1.0, 0.0], restitution=1.0)]), engine)
    box = Box(
        name="paddle", position=(1.0, 0.0), size=(0.2, 1.0), kinematic=True, velocity=(-1.0, 0.0), restitution=1.0
    )
    simulation.apply(Spawn(time=0, box=box))
    frame = advance(simulation, 200).frame()
    assert frame.position[1] == pytest.approx([0.0, 0.0], abs=SINGLE)
    assert frame.velocity[0, 0] == pytest.approx(-3.0, abs=SINGLE)
    simulation.close()


@pytest.mark.parametrize("engine", ["pymunk", "reference", "exact"])
def test_kinematic_balls_on_a_floor_are_refused(engine: str) -> None:
    surface = {"sliding_friction": 0.2, "rolling_friction": 0.01}
    with pytest.raises(Refusal, match="kinematic bodies"):
        start(scene_of(ball=[ball(0.0, kinematic=True), ball(1.0, name="b")], surface=surface), engine)


def test_reference_refuses_joints_to_kinematic_bodies_and_impacts_one_by_one() -> None:
    tables: dict[str, Any] = {"ball": [ball(1.0)], "box": [paddle(0.0)]}
    joint = {"kind": "pivot", "between": ["paddle", "ball"], "at": [1.0, 0.0]}
    with pytest.raises(Refusal, match="a joint to 'paddle', which is kinematic"):
        start(scene_of(joint=[joint], **tables), "reference")
    for key, value in {"detection": "bisect", "impact": "dissipative"}.items():
        scene = scene_of(**tables)
        with pytest.raises(Refusal, match="kinematic bodies"):
            start(scene, "reference", scene.solver.replace(**{key: value}))
        simulation = start(scene_of(ball=[ball(0.0)]), "reference", scene.solver.replace(**{key: value}))
        with pytest.raises(ActionError, match="kinematic bodies"):
            simulation.apply(Spawn(time=0, ball=Ball(position=(3.0, 0.0), radius=0.1, kinematic=True)))
        simulation.close()


@pytest.mark.parametrize("method", ["impulse", "penalty"])
def test_work_of_a_paddle_on_reference_is_booked_as_drives(method: str) -> None:
    """A ball of 2 kg at rest leaves a paddle of speed u at 2 u; the paddle's force on it does the work 4 u²."""
    box = paddle(-1.0, velocity=[3.0, 0.0], restitution=1.0)
    scene = scene_of(ball=[ball(0.0, restitution=1.0)], box=[box], solver={"dt": 0.005, "response": method})
    account = closed_account(scene, 100, engine="reference", closes=1e-12)  # rounding
    error = 0.02 if method == "penalty" else 1e-12  # a contact of ten steps; rounding
    assert account[Cause.DRIVES] == pytest.approx(4.0 * 3.0**2, rel=error)


@pytest.mark.parametrize("integrator", ["explicit_euler", "semi_implicit_euler", "velocity_verlet", "rk4"])
@pytest.mark.parametrize("part", [None, 0.3])
def test_account_of_reference_closes_with_kinematic_bodies(integrator: str, part: float | None) -> None:
    scene = scene_of(
        gravity=-10.0,
        solver={"dt": 0.01, "integrator": integrator},
        plane=[FLOOR],
        box=[
            paddle(0.0, 0.3, (2.0, 0.2), velocity=[0.5, 1.0], friction=0.6),
            paddle(0.3, 2.0, (1.0, 0.1), name="mill", angular_velocity=3.0, friction=0.6, restitution=0.8),
        ],
        ball=[ball(0.2, 1.5, restitution=0.5, friction=0.5), ball(-0.3, 0.8, name="b"), ball(0.4, 3.0, name="c")],
    )
    move = Move(time=0, body="paddle", position=(0.1, 0.9), velocity=(0.0, -1.0))
    account = closed_account(scene, 60, [(40, move)], part, engine="reference", closes=1e-11)  # hundreds of sums
    # the paddle of 1 kg becomes slower and is raised from 0.7 m; rounding
    assert account[Cause.ACTIONS] == pytest.approx(0.5 * (1.0 - 1.25) + 10.0 * (0.9 - 0.7), abs=1e-11)


def test_pymunk_refuses_what_it_cannot_combine_with_kinematic_bodies() -> None:
    tables: dict[str, Any] = {"ball": [ball(0.0, kinematic=True), ball(1.0, name="b")]}
    with pytest.raises(Refusal, match="attraction and kinematic bodies"):
        start(scene_of(attraction=[{"toward": [0.0, 0.0], "strength": 1.0}], **tables), "pymunk")
    scene = scene_of(**tables, gravity=-1.0)
    with pytest.raises(Refusal, match="half_kick does not support kinematic"):
        start(scene, "pymunk", scene.solver.replace(half_kick=True))


@pytest.mark.parametrize(
    ("tables", "path"),
    [
        ({"box": [paddle(0.0, fixed=True)]}, "box.paddle.kinematic: cannot be combined with `fixed`"),
        ({"box": [paddle(0.0, fixed_rotation=True)]}, "box.paddle.fixed_rotation: has no effect on a kinematic body"),
        (
            {"box": [paddle(0.0)], "thrust": [{"body": "paddle", "force": [1, 0]}]},
            "thrust[0].body: 'paddle' is kinematic",
        ),
        ({"box": [paddle(0.0)], "drive": [STROKE]}, "'paddle' is kinematic; remove `kinematic`"),
        (
            {"box": [paddle(0.0)], "joint": [{"kind": "pivot", "between": ["paddle"], "at": [0, 0]}]},
            "no joint can move these bodies: 'paddle' is kinematic",
        ),
    ],
)
def test_faults_are_named(tables: dict[str, Any], path: str) -> None:
    with pytest.raises(SceneError) as caught:
        scene_of(**tables)
    assert path in str(caught.value)


def lift_scene(**lift: Any) -> Scene:
    """Return a lift that passes through a wall, and a ball that bounces on it."""
    return scene_of(
        gravity=-10.0,
        plane=[FLOOR],
        wall=[{"points": [[-1.0, 0.6], [1.0, 0.6]]}],
        ball=[ball(0.0, 1.5, restitution=1.0)],
        box=[paddle(0.0, 1.0, (1.0, 0.02), **lift)],
    )


def test_nothing_is_claimed_to_be_conserved_or_solved_with_kinematic_bodies() -> None:
    scene = lift_scene(velocity=[0.0, 0.5])
    run = sandbox.run(scene, "pymunk")
    assert momentum_drift(run, scene) is None and not conserves_energy(scene)
    assert solution(scene) is None and closed_form(run, scene, 1) is None
    assert energy_gain(run, scene) == 0.0
    fallen = closed_form(run, scene, 0)  # free flight holds until the first contact
    assert fallen is not None and not fallen.valid.all()


def test_kinematic_bodies_are_no_missed_contacts_and_no_overlaps_with_static_objects() -> None:
    scene = lift_scene(velocity=[0.0, -40.0])  # it passes wall and plane in two steps
    run = sandbox.run(scene, "pymunk", audit=True)
    assert not (run.missed_pair == 1).any()
    assert max_penetration(run, scene).max() < 0.05  # that of the ball
    start = from_document({"box": [paddle(0.0, 0.0)], "plane": [FLOOR], "ball": [ball(5.0, 5.0)]})
    assert not [each for each in warnings(start, start.solver) if each.kind == "overlap"]


def test_fast_kinematic_body_is_a_risk_for_balls_and_not_for_walls() -> None:
    scene = lift_scene(velocity=[0.0, -40.0], angular_velocity=2.0)
    risks = tunnelling_risks(scene)
    assert not [risk for risk in risks if "wall" in risk.thing and risk.ball == "paddle"]
    speeds = SpeedBounds(scene, contact_matrix(scene))
    assert speeds.own[1] == pytest.approx(40.0 + 2.0 * 0.5, rel=1e-3)  # the corner is a little farther than 0.5 m
    assert speeds.unknown == ("kinematic bodies",)
    at_rest = lift_scene()
    assert SpeedBounds(at_rest, contact_matrix(at_rest)).bounded
