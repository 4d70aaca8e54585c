"""Pull action: a soft damped spring, stable at any step and limited in force."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.action import ActionError, Impulse, Pull, Remove, SetParameter
from sandbox.engines.mouse_joint import mouse_joint_impulse
from sandbox.engines.registry import ENGINES
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.scene.files.load import from_document
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # long runs

OMEGA = 2.0 * math.pi * 7.5
"""Natural frequency as documented in the manual of the window, rad/s."""


def simulation_of(
    engine: str = "reference", dt: float = 0.01, gravity: float = 0.0, **more: Any
) -> SwitchableSimulation:
    ball = {"name": "a", "position": [0.0, 0.0], "radius": 0.5, **more}
    document = {"world": {"gravity": [0.0, gravity]}, "solver": {"dt": dt}, "ball": [ball]}
    return start(from_document(document), engine)


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
    """With symplectic Euler and no force limit, the offset to the pointer and the velocity decay."""
    moment, stiffness = 0.5 * mass * radius**2, mass * OMEGA**2
    displacement, velocity, spin = np.asarray([offset, 0.5 * offset]), np.asarray([speed, -speed]), 0.0
    x, y = arm[0] * radius, arm[1] * radius
    gravity = 1e30  # high enough that the force limit is not reached

    def energy() -> float:
        kinetic = 0.5 * mass * float(velocity @ velocity) + 0.5 * moment * spin**2
        return kinetic + 0.5 * stiffness * float(displacement @ displacement)

    initial = energy()
    for _ in range(60):
        (jx, jy), turn = mouse_joint_impulse(
            (float(displacement[0]), float(displacement[1])), (x, y), (float(velocity[0]), float(velocity[1])), spin,
            mass, moment, gravity, h,
        )  # fmt: skip
        before = energy()
        velocity = velocity + np.asarray([jx, jy]) / mass
        spin += turn / moment
        displacement = displacement + h * (velocity + spin * np.asarray([-y, x]))  # the arm rotates little in one step
        assert energy() <= before * (1.0 + 1e-9) + 1e-300  # rounding of sums of squares
    assert energy() <= initial * (1.0 + 1e-9)  # as above


def test_impulse_solves_the_soft_constraint() -> None:
    """The impulse is −h·(k·x⁺ + c·v⁺) with the offset and velocity at the end of the step."""
    h, mass, x, v = 0.02, 2.0, 0.3, -1.5
    (jx, jy), turn = mouse_joint_impulse((x, 0.0), (0.0, 0.0), (v, 0.0), 0.0, mass, math.inf, 1e30, h)
    after = v + jx / mass
    stiffness, damping = mass * OMEGA**2, 2.0 * mass * OMEGA
    assert jx == pytest.approx(-h * (stiffness * (x + h * after) + damping * after), rel=1e-12)  # rounding
    assert (jy, turn) == (0.0, 0.0)


@pytest.mark.parametrize("engine", ENGINES)
def test_pulled_body_converges_to_the_critically_damped_oscillator_at_first_order(engine: str) -> None:
    """From rest at −d: x(t) = −d·(1 + ωt)·e^{−ωt}. The largest error halves with the step."""
    d, duration, errors = 0.01, 0.08, []
    for steps in (200, 400, 800, 1600):
        simulation = simulation_of(engine, dt=duration / steps)
        simulation.apply(pull(d, 0.0))
        worst = 0.0
        for k in range(1, steps + 1):
            simulation.step()
            t = k * duration / steps
            exact = d - d * (1.0 + OMEGA * t) * math.exp(-OMEGA * t)
            worst = max(worst, abs(float(simulation.frame().position[0, 0]) - exact))
        errors.append(worst)
    orders = [math.log2(a / b) for a, b in pairwise(errors)]
    assert orders == pytest.approx([1.0] * 3, abs=0.1)  # contribution of the next order at ω·dt ≤ 0.02
    assert errors[-1] < 0.01 * d  # ω·dt is 0.0024, and the first-order error is about that fraction of d


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("dt", "mass"), [(1e-3, 1e-9), (1 / 60, 1.0), (0.1, 1e12), (0.5, 1.0)])
def test_pulled_body_comes_to_rest_at_the_pointer_at_any_step_and_mass(engine: str, dt: float, mass: float) -> None:
    simulation = simulation_of(engine, dt=dt, mass=mass)
    simulation.apply(pull(0.5, -0.25))
    steps = max(40, round(0.6 / dt))
    advance(simulation, steps)
    frame = simulation.frame()
    decay = (1.0 + OMEGA * 0.6) * math.exp(-OMEGA * 0.6)  # 1.5e-11, at small steps
    implicit_decay = (1.0 + OMEGA * dt) ** -steps * steps  # implicit scheme: a double factor of 1/(1 + ω·dt) a step
    # Residue of a double root; in 32-bit numbers the last steps are too short to move the body.
    residue = 1e-5 if engine == "box2d" else 1e-12
    assert float(np.hypot(*(frame.position[0] - (0.5, -0.25)))) <= 10.0 * (decay + implicit_decay) + residue
    assert float(np.hypot(*frame.velocity[0])) <= 10.0 * OMEGA * (decay + implicit_decay) + 10.0 * residue


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("gravity", "weight"), [(0.0, 9.81), (-1.62, 1.62), (-9.81, 9.81)])
def test_force_is_limited_to_a_hundred_times_the_weight(engine: str, gravity: float, weight: float) -> None:
    simulation = simulation_of(engine, gravity=gravity, mass=3.0)
    simulation.apply(pull(1e6, 0.0))
    simulation.step()
    rounding = 1e-6 if engine == "box2d" else 1e-12  # 32-bit numbers
    assert simulation.frame().velocity[0, 0] == pytest.approx(100.0 * weight * 0.01, rel=rounding)
    advance(simulation, 9)
    assert simulation.frame().velocity[0, 0] == pytest.approx(100.0 * weight * 0.1, rel=rounding)


@pytest.mark.parametrize("engine", ENGINES)
def test_pull_off_the_centre_turns_the_body_and_at_the_centre_does_not(engine: str) -> None:
    """An upward pull at the right side turns the body counter-clockwise by j·x/I; then the grip reaches the pointer."""
    simulation = simulation_of(engine, mass=2.0)
    simulation.apply(pull(0.0, 0.1))
    assert advance(simulation, 3).frame().angular_velocity[0] == 0.0
    simulation = simulation_of(engine, mass=2.0)
    simulation.apply(pull(0.4, 0.1, grip=(0.4, 0.0)))
    simulation.step()
    frame, moment = simulation.frame(), 0.5 * 2.0 * 0.5**2
    assert frame.angular_velocity[0] > 0.0
    rounding = 1e-6 if engine == "box2d" else 1e-12  # 32-bit numbers
    assert frame.angular_velocity[0] == pytest.approx(0.4 * 2.0 * frame.velocity[0, 1] / moment, rel=rounding)
    advance(simulation, 400)
    frame = simulation.frame()
    cos, sin = math.cos(frame.angle[0]), math.sin(frame.angle[0])
    # it still oscillates
    assert frame.position[0] + 0.4 * np.asarray([cos, sin]) == pytest.approx([0.4, 0.1], abs=1e-3)


def test_pull_can_move_and_end() -> None:
    simulation = simulation_of(mass=2.0)
    simulation.apply(pull(1.0, 0.0))
    advance(simulation, 10)
    simulation.apply(pull(0.0, 1.0))
    advance(simulation, 100)
    assert simulation.frame().position[0] == pytest.approx([0.0, 1.0], abs=1e-9)  # (1 + ωt)·e^{−ωt} after 1 s
    simulation.apply(Impulse(time=0.0, body="a", impulse=(2.0, 0.0)))
    simulation.apply(Pull(time=0.0, body="a"))
    before = simulation.frame().velocity
    assert np.array_equal(advance(simulation, 5).frame().velocity, before)
    simulation.apply(Pull(time=0.0, body="a"))  # releasing a body that is not pulled is allowed
    simulation.apply(Pull(time=0.0, body="zzz"))


def test_fixed_unknown_or_removed_body_cannot_be_pulled() -> None:
    document = {
        "plane": [{"name": "floor", "point": [0, -9], "normal": [0, 1]}],
        "ball": [
            {"name": "post", "position": [0, 0], "radius": 1, "fixed": True},
            {"name": "gone", "position": [5, 0], "radius": 1},
        ],
    }
    simulation = start(from_document(document))
    simulation.apply(Remove(time=0.0, body="gone"))
    before = simulation.state_hash()
    for body, reason in (("post", "fixed"), ("gone", "has been removed"), ("zzz", "zzz"), ("floor", "floor")):
        with pytest.raises(ActionError, match=reason):
            simulation.apply(Pull(time=0.0, body=body, target=(1.0, 1.0)))
    assert simulation.state_hash() == before
    assert not simulation.checkpoint().pulls


def test_pull_continues_when_another_pulled_body_is_removed() -> None:
    balls = [{"name": name, "position": [3.0 * k, 0.0], "radius": 0.5} for k, name in enumerate("ab")]
    simulation = start(from_document({"ball": balls}))
    simulation.apply(Pull(time=0.0, body="a", target=(0.0, 2.0)))
    simulation.apply(Pull(time=0.0, body="b", target=(3.0, -2.0)))
    advance(simulation, 2)
    simulation.apply(Remove(time=0.0, body="a"))
    advance(simulation, 100)
    assert simulation.frame().position[1] == pytest.approx([3.0, -2.0], abs=1e-9)  # (1 + ωt)·e^{−ωt} after 1 s
    assert set(simulation.checkpoint().pulls) == {"b"}


@pytest.mark.parametrize(
    ("ball", "grip"),
    [({"velocity": [5e11, 0.0]}, (0.0, 0.0)), ({"mass": 1e30, "radius": 1e9}, (0.0, 1e9))],
    ids=["speed", "torque"],
)
def test_pull_beyond_the_numeric_range_ends(ball: dict[str, Any], grip: tuple[float, float]) -> None:
    """The force limit, 100 times the weight, may exceed the range of valid impulses."""
    simulation = simulation_of(dt=10.0, **ball)
    simulation.apply(SetParameter(time=0.0, path="world.gravity", value=[-1e9, 0.0]))
    simulation.apply(pull(1e16, 0.0, grip))
    simulation.step()
    assert not simulation.checkpoint().pulls
    assert np.isfinite(simulation.frame().velocity).all()


@pytest.mark.parametrize(("mass", "moment"), [(1e-15, 1e-200), (1.0, 1e-20), (1.0, 1e60), (1e30, 1.0)])
@pytest.mark.parametrize("grip", [(0.0, 0.0), (1.0, 1.0), (1e9, 1e9), (-1e16, 1e16), (0.0, 1e-9)])
def test_impulse_at_a_distant_grip_points_towards_the_pointer(
    mass: float, moment: float, grip: tuple[float, float]
) -> None:
    """With a distant grip and a small moment, rounding makes the system singular."""
    for offset in ((0.0, 0.0), (1.0, -2.0)):
        (x, y), _ = mouse_joint_impulse(offset, grip, (0.0, 0.0), 0.0, mass, moment, 0.0, 0.01)
        assert x * offset[0] + y * offset[1] <= 0.0
        assert math.hypot(x, y) <= 1.0001 * 100.0 * mass * 9.81 * 0.01
