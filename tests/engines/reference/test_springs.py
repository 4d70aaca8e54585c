"""Springs: damping against restitution, an independent integration, runs, and the impulses that they report."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.engines.reference.penalty import MIN_RESTITUTION, damping_of, restitution_of
from tests.engines.reference.pieces import EARTH, FLOOR, ball, running, scene_of, stepped


@given(st.floats(MIN_RESTITUTION, 1.0))
def test_damping_and_restitution_are_each_others_inverse(e):
    assert restitution_of(damping_of(e)) == pytest.approx(e, rel=1e-12)  # the slope times the bisection's 1e-15, ample


@given(st.floats(0, 4))
def test_restitution_and_damping_are_each_others_inverse(z):
    found = damping_of(restitution_of(z))
    assert found == pytest.approx(z, abs=1e-7)  # about critical, differences of nearly equal roots cost digits


def test_limits_of_restitution():
    assert restitution_of(0.0) == 1.0
    assert damping_of(1.0) == 0.0
    assert restitution_of(1.0) == math.exp(-2.0)


@given(st.floats(0.01, 3.9), st.floats(1e-4, 1e-2))
def test_more_damping_rebounds_less_on_both_sides_of_critical(z, more):
    assert restitution_of(z + more) < restitution_of(z)
    assert restitution_of(1.0 + 1e-6) == pytest.approx(restitution_of(1.0 - 1e-6), rel=1e-5)  # a slope of order 1


@pytest.mark.parametrize("z", [0.0, 0.05, 0.3, 0.7, 0.99, 1.0, 1.01, 1.5, 3.0])
def test_restitution_is_that_of_an_independent_integration(z):
    """δ̈ = −δ − 2ζδ̇ from δ = 0 at speed 1, until the force, which never pulls, ends."""

    def force(_, y):
        return y[0] + 2 * z * y[1]

    force.terminal, force.direction = True, -1
    run = solve_ivp(
        lambda t, y: [y[1], -force(t, y)], (0, 50), [1e-16, 1.0], "DOP853", events=force, rtol=1e-13, atol=1e-15
    )
    assert run.status == 1
    assert -run.y[1, -1] == pytest.approx(restitution_of(z), rel=1e-7)  # where DOP853 locates the event


def measured(e, name, **settings):
    """Return the rebound of a ball that meets a floor at 1 m/s, without gravity."""
    scene = scene_of(ball(0, 0.51, velocity=[0, -1], restitution=e), plane=[FLOOR], solver={"dt": 0.01, "substeps": 50})
    simulation = running(scene, response="penalty", integrator=name, **settings)
    return float(stepped(simulation, 15).frame().velocity[0, 1])


@pytest.mark.parametrize("name", ["semi_implicit_euler", "velocity_verlet", "leapfrog", "rk4"])
@pytest.mark.parametrize("e", [0.1, 0.5, 0.8, 1.0])
def test_a_run_of_short_steps_rebounds_as_stated(name, e):
    # ω·h = 0.028: the force sets in and ends within a step, which costs a part of first order of that
    assert measured(e, name, stiffness=10_000.0) == pytest.approx(e, abs=0.02)


def test_stated_damping_outranks_restitution():
    rebound = measured(1.0, "rk4", stiffness=10_000.0, damping=1.0)
    assert rebound == pytest.approx(math.exp(-2.0), abs=0.02)  # as above


def test_a_resting_ball_sinks_in_by_its_weight_over_the_stiffness():
    scene = scene_of(ball(0, 0.5, mass=2.0, restitution=0.1), world=EARTH, plane=[FLOOR], solver={"dt": 0.01})
    simulation = running(scene, response="penalty", stiffness=2e4, substeps=20)
    frame = stepped(simulation, 200).frame()
    assert frame.position[0, 1] == pytest.approx(0.5 - 2.0 * 9.81 / 2e4, rel=1e-12)  # settled to rounding
    simulation.contacts()
    stepped(simulation, 100)
    assert simulation.contacts().impulse[0] == pytest.approx([0.0, -19.62], rel=1e-9, abs=1e-12)  # as above


def test_springs_never_pull():
    """A ball thrown off the floor it is pressed into is given upward impulses only."""
    scene = scene_of(ball(0, 0.48, velocity=[0, 5], restitution=0.02), plane=[FLOOR], solver={"dt": 1e-4})
    simulation = running(scene, response="penalty", stiffness=1e4)
    highest = 5.0
    for _ in range(200):
        simulation.step()
        speed = float(simulation.frame().velocity[0, 1])
        assert speed >= highest
        highest = speed


def test_elastic_springs_keep_energy_to_the_order_of_the_scheme():
    errors = []
    for substeps in (30, 60, 120):
        scene = scene_of(
            ball(0, 0.503, velocity=[0, -1], restitution=1.0), plane=[FLOOR], solver={"dt": 0.01, "substeps": substeps}
        )
        simulation = running(scene, response="penalty", integrator="velocity_verlet", stiffness=5000.0)
        errors.append(abs(float(stepped(simulation, 8).frame().velocity[0, 1]) - 1.0))
    assert max(errors) < 1e-3
    assert errors[2] < errors[0]


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("response", ["impulse", "penalty"])
def test_what_contacts_report_is_what_momentum_changed_by(integrator, response):
    """Balls off centre, rubbing, against each other, a wall, a post and a floor, without gravity."""
    stuff = [{"name": "m", "restitution": 0.6, "friction": 0.4}]
    balls = [
        ball(-1.2, 0.6, velocity=[3.0, -0.7], mass=2.0, angular_velocity=4.0, name="a"),
        ball(0.1, 0.9, velocity=[-1.0, -0.9], mass=0.5, name="b"),
        ball(1.4, 1.1, velocity=[0.5, 1.5], mass=1.0, name="c"),
    ]
    scene = scene_of(
        *({**each, "material": "m"} for each in balls),
        material=stuff,
        pair=[{"between": ["m", "m"], "restitution": 0.6, "friction": 0.4}],
        plane=[{**FLOOR, "material": "m"}],
        wall=[{"points": [[2.2, 0.0], [2.2, 3.0]], "thickness": 0.1, "material": "m"}],
        post=[{"position": [1.0, 2.9], "radius": 0.3, "material": "m"}],
        solver={"dt": 0.005, "substeps": 4},
    )
    more = {"response": response, "integrator": integrator}
    if response == "penalty":
        more["stiffness"] = 500.0 if integrator == "explicit_euler" else 2000.0
    simulation = running(scene, **more)
    mass = scene.bodies.mass
    before = mass[:, None] * scene.bodies.velocity
    simulation.contacts()
    stepped(simulation, 200)
    contacts = simulation.contacts()
    assert len(contacts) >= 3
    given_ = np.zeros((3, 2))
    for (first, second), impulse in zip(contacts.pair.tolist(), contacts.impulse, strict=True):
        given_[first] -= impulse
        if second >= 0:
            given_[second] += impulse
    change = mass[:, None] * simulation.frame().velocity - before
    scale = np.abs(contacts.impulse).sum()
    assert np.abs(change - given_).max() <= 1e-12 * scale  # 800 substeps' roundings
