"""Penalty springs: damping and restitution against an independent integration, runs, and reported impulses."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.engines.reference.penalty import MIN_RESTITUTION, damping_of, restitution_of
from tests.engines.builders import EARTH, FLOOR, ball, scene_of, simulation_of
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # long runs


@given(st.floats(MIN_RESTITUTION, 1.0))
def test_restitution_of_damping_of_e_is_e(e):
    # the slope times 1e-15 of the bisection, with a margin
    assert restitution_of(damping_of(e)) == pytest.approx(e, rel=1e-12)


@given(st.floats(0, 4))
def test_damping_of_restitution_of_z_is_z(z):
    found = damping_of(restitution_of(z))
    assert found == pytest.approx(z, abs=1e-7)  # near critical damping, differences of nearly equal roots lose digits


def test_limits_of_restitution_match_the_closed_forms():
    assert restitution_of(0.0) == 1.0
    assert damping_of(1.0) == 0.0
    assert restitution_of(1.0) == math.exp(-2.0)


@given(st.floats(0.01, 3.9), st.floats(1e-4, 1e-2))
def test_restitution_falls_with_damping_and_is_continuous_at_critical(z, more):
    assert restitution_of(z + more) < restitution_of(z)
    assert restitution_of(1.0 + 1e-6) == pytest.approx(restitution_of(1.0 - 1e-6), rel=1e-5)  # a slope of order 1


@pytest.mark.parametrize("z", [0.0, 0.05, 0.3, 0.7, 0.99, 1.0, 1.01, 1.5, 3.0])
def test_restitution_matches_an_independent_integration(z):
    """δ̈ = −δ − 2ζδ̇ from δ = 0 at speed 1 until the repulsive force reaches zero."""

    def force(_, y):
        return y[0] + 2 * z * y[1]

    force.terminal, force.direction = True, -1
    run = solve_ivp(
        lambda t, y: [y[1], -force(t, y)], (0, 50), [1e-16, 1.0], "DOP853", events=force, rtol=1e-13, atol=1e-15
    )
    assert run.status == 1
    assert -run.y[1, -1] == pytest.approx(restitution_of(z), rel=1e-7)  # where DOP853 locates the event


def rebound_speed(e, name, **settings):
    """Return the rebound speed of a ball that hits a floor at 1 m/s without gravity."""
    scene = scene_of(ball(0, 0.51, velocity=[0, -1], restitution=e), plane=[FLOOR], solver={"dt": 0.01, "substeps": 50})
    simulation = simulation_of(scene, response="penalty", integrator=name, **settings)
    return float(advance(simulation, 15).frame().velocity[0, 1])


@pytest.mark.parametrize("name", ["semi_implicit_euler", "velocity_verlet", "leapfrog", "rk4"])
@pytest.mark.parametrize("e", [0.1, 0.5, 0.8, 1.0])
def test_run_with_short_steps_rebounds_with_the_stated_restitution(name, e):
    # ω·h = 0.028: the force begins and ends within a step, an error of first order in ω·h
    assert rebound_speed(e, name, stiffness=10_000.0) == pytest.approx(e, abs=0.02)


def test_explicit_damping_overrides_restitution():
    rebound = rebound_speed(1.0, "rk4", stiffness=10_000.0, damping=1.0)
    assert rebound == pytest.approx(math.exp(-2.0), abs=0.02)  # as above


def test_resting_ball_penetrates_by_its_weight_over_the_stiffness():
    scene = scene_of(ball(0, 0.5, mass=2.0, restitution=0.1), world=EARTH, plane=[FLOOR], solver={"dt": 0.01})
    simulation = simulation_of(scene, response="penalty", stiffness=2e4, substeps=20)
    frame = advance(simulation, 200).frame()
    assert frame.position[0, 1] == pytest.approx(0.5 - 2.0 * 9.81 / 2e4, rel=1e-12)  # settled to rounding
    simulation.contacts()
    advance(simulation, 100)
    assert simulation.contacts().impulse[0] == pytest.approx([0.0, -19.62], rel=1e-9, abs=1e-12)  # as above


def test_springs_never_pull():
    """A ball that leaves a floor it overlaps gets upward impulses only."""
    scene = scene_of(ball(0, 0.48, velocity=[0, 5], restitution=0.02), plane=[FLOOR], solver={"dt": 1e-4})
    simulation = simulation_of(scene, response="penalty", stiffness=1e4)
    fastest = 5.0
    for _ in range(200):
        simulation.step()
        speed = float(simulation.frame().velocity[0, 1])
        assert speed >= fastest
        fastest = speed


def test_energy_error_of_elastic_springs_falls_with_the_step():
    errors = []
    for substeps in (30, 60, 120):
        scene = scene_of(
            ball(0, 0.503, velocity=[0, -1], restitution=1.0), plane=[FLOOR], solver={"dt": 0.01, "substeps": substeps}
        )
        simulation = simulation_of(scene, response="penalty", integrator="velocity_verlet", stiffness=5000.0)
        errors.append(abs(float(advance(simulation, 8).frame().velocity[0, 1]) - 1.0))
    assert max(errors) < 1e-3
    assert errors[2] < errors[0]


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("response", ["impulse", "penalty"])
def test_reported_contact_impulses_equal_the_momentum_change(integrator, response):
    """Oblique collisions with friction between balls, a wall, a post and a floor, without gravity."""
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
    simulation = simulation_of(scene, **more)
    mass = scene.bodies.mass
    before = mass[:, None] * scene.bodies.velocity
    simulation.contacts()
    advance(simulation, 200)
    contacts = simulation.contacts()
    assert len(contacts) >= 3
    received = np.zeros((3, 2))
    for (first, second), impulse in zip(contacts.pair.tolist(), contacts.impulse, strict=True):
        received[first] -= impulse
        if second >= 0:
            received[second] += impulse
    change = mass[:, None] * simulation.frame().velocity - before
    scale = np.abs(contacts.impulse).sum()
    assert np.abs(change - received).max() <= 1e-12 * scale  # rounding of 800 substeps
