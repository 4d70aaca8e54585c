"""Thrust: constant, timed, controlled by throttle actions, and kept through engine switches."""

import math

import numpy as np
import pytest

import sandbox
from sandbox.action import ActionError, Switch, Throttle
from sandbox.scene.files.load import from_document
from tests.engines.builders import make_scene
from tests.engines.stepping import advance

ENGINES = ("pymunk", "reference")
every_engine = pytest.mark.parametrize("engine", ENGINES)


def ship(*thrusts, collides="none", duration=1.0, **keys):
    body = {"name": "ship", "position": [0.0, 0.0], "size": [2.0, 1.0], "mass": 2.0, "collides": collides, **keys}
    thrusts = [{"body": "ship", "force": [4.0, 0.0], **each} for each in thrusts]
    return from_document({"world": {"duration": duration}, "box": [body], "thrust": thrusts})


@every_engine
def test_thrust_rotates_with_its_body(engine):
    """Off the centre by 0.5 m: τ = 2 N·m on I = m(w² + h²)/12 = 5/6 kg·m²; the force rotates with the body."""
    h = 0.0005
    trajectory = sandbox.run(ship({"point": [0.0, -0.5]}), engine, dt=h)
    alpha = 2.0 / (2.0 * 5.0 / 12.0)
    t = trajectory.time
    np.testing.assert_allclose(trajectory.angular_velocity[:, 0], alpha * t, atol=1e-11)  # rounding of 2,000 sums
    phi = 0.5 * alpha * t**2
    # ∫ a·(cos φ, sin φ) dt by the trapezium rule, with an error of h²
    a = 2.0 * np.column_stack((np.cos(phi), np.sin(phi)))
    velocity = np.concatenate((np.zeros((1, 2)), np.cumsum(0.5 * h * (a[1:] + a[:-1]), axis=0)))
    # force a step early or late: a·h, and the same for φ
    assert np.abs(trajectory.velocity[:, 0] - velocity).max() <= 2.0 * h * 2.0


@every_engine
def test_timed_thrust_acts_from_begin_to_end(engine):
    trajectory = sandbox.run(ship({"begin": 0.25, "end": 0.75}), engine, dt=0.01)
    assert trajectory.velocity[trajectory.time <= 0.25 + 1e-9, 0].max() == 0.0
    assert trajectory.velocity[-1, 0, 0] == pytest.approx(1.0, abs=1e-12)  # 50 of 100 steps
    after_end = trajectory.velocity[trajectory.time >= 0.76, 0, 0]
    assert np.ptp(after_end) == 0.0


@every_engine
def test_thrust_with_a_key_is_off_until_a_throttle_action(engine):
    simulation = sandbox.start(ship({"key": "up", "name": "main"}), engine)
    assert not advance(simulation, 10).frame().velocity.any()
    simulation.apply(Throttle(time=0.1, thrust="main", level=0.5))
    assert advance(simulation, 50).frame().velocity[0, 0] == pytest.approx(0.5, abs=1e-14)
    simulation.apply(Throttle(time=0.6, thrust="main", level=0.0))
    assert advance(simulation, 50).frame().velocity[0, 0] == pytest.approx(0.5, abs=1e-14)


@every_engine
def test_thrust_that_a_constant_force_balances_exactly_moves_nothing(engine):
    simulation = sandbox.start(ship({}), engine)
    simulation.apply(sandbox.Force(time=0.0, body="ship", force=(-4.0, 0.0)))
    assert not advance(simulation, 10).frame().velocity.any()


@every_engine
def test_unknown_thrust_is_refused_with_the_known_names(engine):
    simulation = sandbox.start(ship({"name": "main"}, {}), engine)
    with pytest.raises(ActionError, match="no thrust is named 'mian'; known names: main, thrust-2"):
        simulation.apply(Throttle(time=0.0, thrust="mian", level=1.0))


def test_timed_thrust_follows_scene_time_after_an_engine_switch():
    simulation = sandbox.start(ship({"begin": 0.3, "end": 0.5}), "pymunk")
    advance(simulation, 10)
    simulation.apply(Switch(time=0.1, engine="reference"))
    assert not advance(simulation, 20).frame().velocity.any()
    simulation.apply(Switch(time=0.3, engine="pymunk"))
    assert advance(simulation, 50).frame().velocity[0, 0] == pytest.approx(0.4, abs=1e-14)  # 0.2 s at 2 m/s²


@every_engine
def test_thrust_adds_to_the_load_of_a_resting_box(engine):
    """A box pushed down by 10 N loads the ground with its weight plus 10 N."""
    scene = make_scene(
        world={"gravity": [0.0, -9.81], "duration": 2.0},
        plane=[{"point": [0.0, 0.0], "normal": [0.0, 1.0]}],
        box=[{"name": "box", "position": [0.0, 0.5], "size": [1.0, 1.0]}],
        thrust=[{"body": "box", "force": [0.0, -10.0]}],
    )
    trajectory = sandbox.run(scene, engine, dt=0.01)
    received = -trajectory.contact_impulse[:, 1].sum()
    momentum = float(trajectory.velocity[-1, 0, 1])  # residual momentum
    assert received - (9.81 + 10.0) * 2.0 == pytest.approx(momentum, abs=1e-9)  # momentum balance, to rounding
    assert math.isclose(trajectory.position[-1, 0, 1], 0.5, abs_tol=0.01)  # the slop
