"""Integrators: orders fitted against DOP853, and known errors on an oscillator and a projectile."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from sandbox.engines.forces.air import Air
from sandbox.engines.reference.integrators import INTEGRATORS, Inputs, Tableau, amplification, runge_kutta, transition

SYMPLECTIC = ["semi_implicit_euler", "velocity_verlet", "leapfrog"]

# The scheme reads from its inputs whether accelerations depend on velocity; with contacts they do.
DAMPED = Inputs(np.zeros((1, 1)), contacts=lambda x: np.zeros_like(x[0]))
CONSERVATIVE = Inputs(np.zeros((1, 1)))


def driven(t, x, u):
    """ẍ = −4x − 0.6ẋ + cos 3t."""
    return np.stack((x[1], -4.0 * x[0] - 0.6 * x[1] + math.cos(3.0 * t)))


def kepler(t, x, u):
    return np.stack((x[1], -x[0] / np.hypot(*x[0, 0]) ** 3))


FALL = Inputs(np.array([[0.0, -9.81]]), Air(quadratic_drag=0.15, linear_drag=0.05, wind_x=2.0, wind_y=0.5))

PROBLEMS = {
    "driven oscillator": (driven, DAMPED, np.array([[[1.0]], [[0.5]]]), 4.0, {1: 200, 2: 50, 4: 25}),
    "projectile with drag": (transition, FALL, np.array([[[0.0, 1.0]], [[12.0, 9.0]]]), 2.0, {1: 200, 2: 50, 4: 20}),
    "kepler": (kepler, CONSERVATIVE, np.array([[[0.5, 0.0]], [[0.0, math.sqrt(3.0)]]]), 3.0, {1: 4000, 2: 200, 4: 80}),
}


def run(step, f, x, u, time, steps):
    h = time / steps
    for k in range(steps):
        x = step(f, k * h, x, u, h)
    return x


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("problem", PROBLEMS)
@pytest.mark.parametrize("name", INTEGRATORS)
def test_error_converges_with_the_declared_order(name, problem):
    f, u, x, time, coarsest = PROBLEMS[problem]
    scheme = INTEGRATORS[name]
    solution = solve_ivp(
        lambda t, y: f(t, y.reshape(x.shape), u).ravel(), (0, time), x.ravel(), "DOP853", rtol=1e-13, atol=1e-13
    )
    truth = solution.y[:, -1].reshape(x.shape)
    steps = [coarsest[scheme.order] * 2**k for k in range(4)]
    errors = [float(np.abs(run(scheme.step, f, x, u, time, n) - truth).max()) for n in steps]
    slope = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    # three halvings, starting slightly outside the asymptotic range
    assert slope == pytest.approx(scheme.order, abs=0.2)


def oscillator(frequency, damping=0.0):
    return lambda t, x, u: np.stack((x[1], -(frequency**2) * x[0] - 2.0 * damping * frequency * x[1]))


def energies(name, frequency, h, steps):
    """Return the energies of an oscillator released at rest from 1 m, relative to the initial energy."""
    x, f, out = np.array([[[1.0]], [[0.0]]]), oscillator(frequency), []
    for k in range(steps):
        x = INTEGRATORS[name].step(f, k * h, x, CONSERVATIVE, h)
        out.append((x[1, 0, 0] / frequency) ** 2 + x[0, 0, 0] ** 2)
    return np.array(out)


@given(st.floats(0.1, 10), st.floats(1e-3, 0.5), st.integers(1, 50))
def test_explicit_euler_gains_energy_as_its_formula_predicts(frequency, z, steps):
    relative = energies("explicit_euler", frequency, z / frequency, steps)
    expected = (1.0 + z * z) ** np.arange(1, steps + 1)
    assert relative == pytest.approx(expected, rel=1e-15 * 10 * steps)  # ten roundings a step


@given(st.floats(0.1, 10), st.floats(1e-3, 1.9), st.integers(1, 300))
def test_energy_of_semi_implicit_euler_stays_in_its_band(frequency, z, steps):
    relative = energies("semi_implicit_euler", frequency, z / frequency, steps)
    slack = 1e-13 / (1.0 - z / 2.0)  # roundings of 300 steps, larger where the band widens without bound
    assert relative.min() >= (1.0 - slack) / (1.0 + z / 2.0)
    assert relative.max() <= (1.0 + slack) / (1.0 - z / 2.0)


def test_energy_of_semi_implicit_euler_reaches_the_bounds_of_its_band():
    relative = energies("semi_implicit_euler", 1.0, 0.5, 2000)
    assert relative.min() == pytest.approx(1 / 1.25, rel=1e-3)  # 2,000 phases come within 1e-3 of the extremum
    assert relative.max() == pytest.approx(1 / 0.75, rel=1e-3)  # likewise


@pytest.mark.parametrize("name", ["velocity_verlet", "leapfrog"])
@given(z=st.floats(0.01, 1.95), steps=st.integers(1, 300))
def test_verlet_oscillates_at_its_numerical_frequency(name, z, steps):
    angle = 2.0 * math.asin(z / 2.0)  # ω_num·h
    x = np.array([[[1.0]], [[0.0]]])
    for k in range(steps):
        x = INTEGRATORS[name].step(oscillator(1.0), k * z, x, CONSERVATIVE, z)
    # rounding grows with the steps, and more where the two eigenvalues nearly coincide
    assert x[0, 0, 0] == pytest.approx(math.cos(steps * angle), abs=1e-13 * steps / math.sqrt(1.0 - z * z / 4.0))


@pytest.mark.parametrize(("name", "limit"), [(name, 2.0) for name in SYMPLECTIC] + [("rk4", 2.0 * math.sqrt(2.0))])
def test_runs_are_bounded_just_below_the_stability_limit_only(name, limit):
    assert energies(name, 1.0, limit * 0.995, 3000).max() < 500.0  # the widest band: 1/(1 − 0.995), squared and more
    with np.errstate(over="ignore", invalid="ignore"):
        assert not energies(name, 1.0, limit * 1.005, 3000).max() < 1e20


@given(st.floats(1e-3, 100), st.floats(1e-3, 2.8))
def test_amplification_matches_the_closed_forms(frequency, z):
    def of(name):
        return amplification(INTEGRATORS[name].step, frequency, 0.0, z / frequency)

    assert of("explicit_euler") == pytest.approx(math.sqrt(1 + z * z), rel=1e-14)  # eigenvalues of a 2 × 2 matrix
    assert of("rk4") ** 2 == pytest.approx(1 - z**6 / 72 + z**8 / 576, rel=1e-13)  # as above, z⁸ is up to 4,000
    for name in SYMPLECTIC:
        if z < 1.99:
            # near 2 the errors of the eigenvalues grow as a square root
            assert of(name) == pytest.approx(1.0, abs=1e-12)
        elif z > 2.01:
            larger = z * z / 2 - 1 + math.sqrt((z * z / 2 - 1) ** 2 - 1)
            assert of(name) == pytest.approx(larger, rel=1e-12)  # as above


@given(st.floats(0.01, 3), st.floats(0, 4))
def test_amplification_with_damping_matches_the_stability_function(z, damping):
    root = complex(damping * damping - 1.0) ** 0.5
    exact = [(-damping + sign * root) * z for sign in (1, -1)]
    for name, terms in (("explicit_euler", 1), ("rk4", 4)):
        expected = max(abs(sum(eigenvalue**k / math.factorial(k) for k in range(terms + 1))) for eigenvalue in exact)
        found = amplification(INTEGRATORS[name].step, 1.0, damping, z)
        # at critical damping the eigenvalues coincide and are accurate to the square root of rounding only
        assert found == pytest.approx(expected, rel=1e-7, abs=1e-7)


# Position error of a projectile in units of g·h·t.
POSITION_ERROR = {
    "explicit_euler": 0.5,
    "semi_implicit_euler": -0.5,
    "velocity_verlet": 0.0,
    "leapfrog": 0.0,
    "rk4": 0.0,
}


@pytest.mark.parametrize("name", INTEGRATORS)
@given(h=st.floats(1e-3, 0.1), steps=st.integers(1, 100), speed=st.floats(-20, 20))
def test_position_error_of_projectiles_matches_the_closed_form(name, h, steps, speed):
    u = Inputs(np.array([[0.0, -9.81]]))
    x = np.array([[[0.0, 10.0]], [[1.0, speed]]])
    time = h * steps
    x = run(INTEGRATORS[name].step, transition, x, u, time, steps)
    error = x[0, 0, 1] - (10.0 + speed * time - 0.5 * 9.81 * time**2)
    scale = 10.0 + abs(speed) * time + 9.81 * time**2
    # a few roundings a step
    assert error == pytest.approx(POSITION_ERROR[name] * 9.81 * h * time, abs=1e-15 * steps * scale)
    assert x[1, 0, 1] == pytest.approx(speed - 9.81 * time, abs=1e-15 * steps * (20 + 9.81 * time))  # likewise


@pytest.mark.parametrize("name", INTEGRATORS)
def test_step_is_pure(name):
    x = np.array([[[1.0, 2.0]], [[3.0, 4.0]]])
    u = Inputs(np.array([[0.0, -9.81]]), Air(linear_drag=0.5))
    one, two = (INTEGRATORS[name].step(transition, 0.0, x, u, 0.1) for _ in range(2))
    assert np.array_equal(one, two)
    assert x.tolist() == [[[1.0, 2.0]], [[3.0, 4.0]]]


@pytest.mark.parametrize("name", SYMPLECTIC[1:])
def test_symmetric_schemes_are_reversible(name):
    x = start = np.array([[[0.5, 0.0]], [[0.0, math.sqrt(3.0)]]])
    for k in range(200):
        x = INTEGRATORS[name].step(kepler, k * 0.01, x, CONSERVATIVE, 0.01)
    for k in range(200):
        x = INTEGRATORS[name].step(kepler, -k * 0.01, x, CONSERVATIVE, -0.01)
    assert np.abs(x - start).max() < 1e-12  # rounding of 400 steps, amplified by the passage near the centre


@pytest.mark.parametrize("name", INTEGRATORS)
def test_fraction_is_the_part_of_a_kick_that_moves_positions_within_the_step(name):
    def f(kick):
        return lambda t, x, u: np.stack((x[1], np.full_like(x[1], kick)))

    x, h = np.zeros((2, 1, 1)), 0.125
    scheme = INTEGRATORS[name]
    with_kick, without = (scheme.step(f(kick), 0.0, x, CONSERVATIVE, h) for kick in (1.0, 0.0))
    moved, gained = (with_kick - without)[:, 0, 0]
    assert moved == pytest.approx(scheme.fraction * h * gained, rel=1e-15)  # the sixths of rk4 are rounded


@given(st.floats(0.01, 2), st.floats(0.01, 2), st.floats(-20, 20))
def test_drag_matches_its_formula(linear, quadratic, speed):
    u = Inputs(np.array([[0.0, -9.81]]), Air(linear, quadratic, 0.0, 1.0, -2.0))
    rates = transition(0.0, np.array([[[0.0, 0.0]], [[speed, 3.0]]]), u)
    w = np.array([speed - 1.0, 5.0])
    expected = np.array([0.0, -9.81]) - linear * w - quadratic * math.hypot(*w) * w
    assert rates[0, 0].tolist() == [speed, 3.0]
    assert rates[1, 0] == pytest.approx(expected, rel=1e-14, abs=1e-13)  # three terms that may cancel


def test_immobile_bodies_feel_no_drag():
    u = Inputs(np.zeros((2, 2)), Air(linear_drag=1.0), mobile=np.array([[1.0], [0.0]]))
    rates = transition(0.0, np.array([np.zeros((2, 2)), np.ones((2, 2))]), u)
    assert rates[1].tolist() == [[-1.0, -1.0], [0.0, 0.0]]


def test_integrators_are_listed_by_ascending_order():
    orders = [scheme.order for scheme in INTEGRATORS.values()]
    assert all(a <= b for a, b in pairwise(orders))
    assert orders == [1, 1, 2, 2, 4]


def test_runge_kutta_runs_any_tableau():
    heun = Tableau(a=((), (1.0,)), b=(0.5, 0.5), c=(0.0, 1.0))
    x = np.array([[[2.0]], [[0.0]]])
    moved = runge_kutta(heun)(lambda t, x, u: t + x, 1.0, x, Inputs(np.zeros((1, 1))), 0.5)
    # k₁ = 1 + 2, k₂ = 1.5 + (2 + 0.5·3); x + h/2 (k₁ + k₂): exact in binary
    assert moved[0, 0, 0] == 2.0 + 0.25 * (3.0 + 5.0)
