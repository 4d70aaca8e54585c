"""Pulls: a damped spring, soft, stable at any step, and no stronger than a hand may be."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.action import ActionError, Impulse, Pull, Remove, SetParameter, Spawn
from sandbox.engines.mouse_joint import mouse_joint_impulse
from sandbox.engines.registry import ENGINES
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document

OMEGA = 2.0 * math.pi * 7.5
"""rad/s, as the manual of the window has it"""


def started(engine: str = "reference", dt: float = 0.01, gravity: float = 0.0, **more: Any) -> SwitchableSimulation:
    ball = {"name": "a", "position": [0.0, 0.0], "radius": 0.5, **more}
    document = {"world": {"gravity": [0.0, gravity]}, "solver": {"dt": dt}, "ball": [ball]}
    return start(from_document(document), engine)


def stepped(relay: SwitchableSimulation, steps: int) -> SwitchableSimulation:
    for _ in range(steps):
        relay.step()
    return relay


def pull(x: float, y: float, grip: tuple[float, float] = (0.0, 0.0)) -> Pull:
    return Pull(time=0.0, body="a", grip=grip, target=(x, y))


@given(
    h=st.floats(1e-4, 0.5),
    mass=st.floats(1e-6, 1e9),
    offset=st.floats(-1e3, 1e3),
    speed=st.floats(-1e3, 1e3),
    radius=st.floats(1e-3, 1e3),
    arm=st.tuples(st.floats(-1, 1), st.floats(-1, 1)),
)
def test_spring_loses_energy_at_any_step_and_mass(
    h: float, mass: float, offset: float, speed: float, radius: float, arm: tuple[float, float]
) -> None:
    """Iterated by itself with symplectic Euler, with no cap: the hand's offset and the velocity die away."""
    moment, stiffness = 0.5 * mass * radius**2, mass * OMEGA**2
    place, velocity, spin = np.asarray([offset, 0.5 * offset]), np.asarray([speed, -speed]), 0.0
    x, y = arm[0] * radius, arm[1] * radius
    gravity = 1e30  # so that nothing is capped

    def energy() -> float:
        moving = 0.5 * mass * float(velocity @ velocity) + 0.5 * moment * spin**2
        return moving + 0.5 * stiffness * float(place @ place)

    begin = energy()
    for _ in range(60):
        (jx, jy), turn = mouse_joint_impulse(
            (float(place[0]), float(place[1])), (x, y), (float(velocity[0]), float(velocity[1])), spin, mass, moment,
            gravity, h,
        )  # fmt: skip
        before = energy()
        velocity = velocity + np.asarray([jx, jy]) / mass
        spin += turn / moment
        place = place + h * (velocity + spin * np.asarray([-y, x]))  # the arm turns little in one step
        assert energy() <= before * (1.0 + 1e-9) + 1e-300  # rounding of sums of squares
    assert energy() <= begin * (1.0 + 1e-9)  # as above


def test_impulse_is_that_of_the_soft_constraint_worked_out_by_hand() -> None:
    """Solved together: the impulse is −h·(k·x⁺ + c·v⁺), with the offset and velocity at the end of the step."""
    h, mass, x, v = 0.02, 2.0, 0.3, -1.5
    (jx, jy), turn = mouse_joint_impulse((x, 0.0), (0.0, 0.0), (v, 0.0), 0.0, mass, math.inf, 1e30, h)
    after = v + jx / mass
    stiffness, damping = mass * OMEGA**2, 2.0 * mass * OMEGA
    assert jx == pytest.approx(-h * (stiffness * (x + h * after) + damping * after), rel=1e-12)  # rounding
    assert (jy, turn) == (0.0, 0.0)


@pytest.mark.parametrize("engine", ENGINES)
def test_pulled_body_follows_the_critically_damped_oscillator_at_first_order(engine: str) -> None:
    """From rest at −d: x(t) = −d·(1 + ωt)·e^{−ωt}. The largest error halves with the step."""
    d, duration, errors = 0.01, 0.08, []
    for steps in (200, 400, 800, 1600):
        relay = started(engine, dt=duration / steps)
        relay.apply(pull(d, 0.0))
        worst = 0.0
        for k in range(1, steps + 1):
            relay.step()
            t = k * duration / steps
            exact = d - d * (1.0 + OMEGA * t) * math.exp(-OMEGA * t)
            worst = max(worst, abs(float(relay.frame().position[0, 0]) - exact))
        errors.append(worst)
    orders = [math.log2(a / b) for a, b in pairwise(errors)]
    assert orders == pytest.approx([1.0] * 3, abs=0.1)  # the next order's share, at ω·dt of 0.02 and less
    assert errors[-1] < 0.01 * d  # ω·dt is 0.0024, and the error of first order about that share of d


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("dt", [1e-4, 1e-3, 0.01, 1 / 60, 0.1, 0.5])
@pytest.mark.parametrize("mass", [1e-9, 1.0, 1e12])
def test_pulled_body_comes_to_rest_under_the_hand_at_any_step_and_mass(engine: str, dt: float, mass: float) -> None:
    relay = started(engine, dt=dt, mass=mass)
    relay.apply(pull(0.5, -0.25))
    steps = max(40, round(0.6 / dt))
    stepped(relay, steps)
    frame = relay.frame()
    decay = (1.0 + OMEGA * 0.6) * math.exp(-OMEGA * 0.6)  # 1.5e-11, at small steps
    slow = (1.0 + OMEGA * dt) ** -steps * steps  # of the implicit rule, whose factor a step is 1/(1 + ω·dt), twice
    assert float(np.hypot(*(frame.position[0] - (0.5, -0.25)))) <= 10.0 * (decay + slow) + 1e-12  # a double root's rest
    assert float(np.hypot(*frame.velocity[0])) <= 10.0 * OMEGA * (decay + slow) + 1e-11  # as above


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("gravity", "weight"), [(0.0, 9.81), (-1.62, 1.62), (-9.81, 9.81)])
def test_force_is_at_most_a_hundred_weights(engine: str, gravity: float, weight: float) -> None:
    relay = started(engine, gravity=gravity, mass=3.0)
    relay.apply(pull(1e6, 0.0))
    relay.step()
    assert relay.frame().velocity[0, 0] == pytest.approx(100.0 * weight * 0.01, rel=1e-12)  # rounding
    stepped(relay, 9)
    assert relay.frame().velocity[0, 0] == pytest.approx(100.0 * weight * 0.1, rel=1e-12)  # as above


def test_weight_is_that_of_the_gravity_there_is_now() -> None:
    relay = started()
    relay.apply(SetParameter(time=0.0, path="world.gravity", value=[3.0, 4.0]))
    relay.apply(pull(-1e6, 0.0))
    relay.step()
    assert relay.frame().velocity[0, 0] == pytest.approx((3.0 - 500.0) * 0.01, rel=1e-12)  # rounding


@pytest.mark.parametrize("engine", ENGINES)
def test_pull_at_the_centre_turns_nothing_and_beside_it_turns_the_body(engine: str) -> None:
    """Pulled upwards at its right side it turns to the left, by j·x/I; then the grip comes under the hand."""
    relay = started(engine, mass=2.0)
    relay.apply(pull(0.0, 0.1))
    assert stepped(relay, 3).frame().angular_velocity[0] == 0.0
    relay = started(engine, mass=2.0)
    relay.apply(pull(0.4, 0.1, grip=(0.4, 0.0)))
    relay.step()
    frame, moment = relay.frame(), 0.5 * 2.0 * 0.5**2
    assert frame.angular_velocity[0] > 0.0
    assert frame.angular_velocity[0] == pytest.approx(0.4 * 2.0 * frame.velocity[0, 1] / moment, rel=1e-12)  # rounding
    stepped(relay, 400)
    frame = relay.frame()
    cos, sin = math.cos(frame.angle[0]), math.sin(frame.angle[0])
    assert frame.position[0] + 0.4 * np.asarray([cos, sin]) == pytest.approx([0.4, 0.1], abs=1e-3)  # it still swings


def test_hand_moves_and_lets_go() -> None:
    relay = started(mass=2.0)
    relay.apply(pull(1.0, 0.0))
    stepped(relay, 10)
    relay.apply(pull(0.0, 1.0))
    stepped(relay, 100)
    assert relay.frame().position[0] == pytest.approx([0.0, 1.0], abs=1e-9)  # (1 + ωt)·e^{−ωt} after 1 s
    relay.apply(Impulse(time=0.0, body="a", impulse=(2.0, 0.0)))
    relay.apply(Pull(time=0.0, body="a"))
    before = relay.frame().velocity
    assert np.array_equal(stepped(relay, 5).frame().velocity, before)
    relay.apply(Pull(time=0.0, body="a"))  # who is not held can be let go
    relay.apply(Pull(time=0.0, body="zzz"))


def test_fixed_missing_or_gone_body_cannot_be_pulled() -> None:
    document = {
        "plane": [{"name": "floor", "point": [0, -9], "normal": [0, 1]}],
        "ball": [
            {"name": "post", "position": [0, 0], "radius": 1, "fixed": True},
            {"name": "gone", "position": [5, 0], "radius": 1},
        ],
    }
    relay = start(from_document(document))
    relay.apply(Remove(time=0.0, body="gone"))
    before = relay.state_hash()
    for body, words in (("post", "fixed"), ("gone", "has been removed"), ("zzz", "zzz"), ("floor", "floor")):
        with pytest.raises(ActionError, match=words):
            relay.apply(Pull(time=0.0, body=body, target=(1.0, 1.0)))
    assert relay.state_hash() == before
    assert not relay.checkpoint().pulls


def test_two_hands_pull_two_bodies_and_one_that_is_gone_lets_go_of_nobody_else() -> None:
    balls = [{"name": name, "position": [3.0 * k, 0.0], "radius": 0.5} for k, name in enumerate("ab")]
    relay = start(from_document({"ball": balls}))
    relay.apply(Pull(time=0.0, body="a", target=(0.0, 2.0)))
    relay.apply(Pull(time=0.0, body="b", target=(3.0, -2.0)))
    stepped(relay, 2)
    relay.apply(Remove(time=0.0, body="a"))
    stepped(relay, 100)
    assert relay.frame().position[1] == pytest.approx([3.0, -2.0], abs=1e-9)  # (1 + ωt)·e^{−ωt} after 1 s
    assert set(relay.checkpoint().pulls) == {"b"}


@pytest.mark.parametrize(
    ("ball", "grip"),
    [({"velocity": [5e11, 0.0]}, (0.0, 0.0)), ({"mass": 1e30, "radius": 1e9}, (0.0, 1e9))],
    ids=["speed", "torque"],
)
def test_hand_slips_where_it_would_take_more_than_there_may_be(ball: dict[str, Any], grip: tuple[float, float]) -> None:
    """The cap is 100 times a weight that may be immense."""
    relay = started(dt=10.0, **ball)
    relay.apply(SetParameter(time=0.0, path="world.gravity", value=[-1e9, 0.0]))
    relay.apply(pull(1e16, 0.0, grip))
    relay.step()
    assert not relay.checkpoint().pulls
    assert np.isfinite(relay.frame().velocity).all()


@pytest.mark.parametrize("mass", [1e-15, 1.0, 1e30])
@pytest.mark.parametrize("moment", [1e-200, 1e-20, 1.0, 1e60])
@pytest.mark.parametrize("grip", [(0.0, 0.0), (1.0, 1.0), (1e9, 1e9), (-1e16, 1e16), (0.0, 1e-9)])
def test_grip_however_far_out_is_drawn_towards_the_hand(mass: float, moment: float, grip: tuple[float, float]) -> None:
    """Of a body that its grip turns with no resistance, rounding leaves no determinant to divide by."""
    for offset in ((0.0, 0.0), (1.0, -2.0)):
        (x, y), _ = mouse_joint_impulse(offset, grip, (0.0, 0.0), 0.0, mass, moment, 0.0, 0.01)
        assert x * offset[0] + y * offset[1] <= 0.0
        assert math.hypot(x, y) <= 1.0001 * 100.0 * mass * 9.81 * 0.01


def test_spawned_body_too_small_for_its_grip_is_pulled() -> None:
    relay = started()
    relay.apply(Spawn(time=0.0, ball=Ball(name="b", position=(5.0, 5.0), radius=1e-9)))
    relay.apply(Pull(time=0.0, body="b", grip=(1.0, 1.0), target=(5.0, 5.0)))
    stepped(relay, 3)
    frame, b = relay.frame(), relay.bodies.names.index("b")
    assert np.isfinite(frame.position[b]).all()
    assert np.isfinite([frame.angle[b], frame.angular_velocity[b]]).all()
