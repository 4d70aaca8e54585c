"""Refined truths against an independent solver, and the notes of `compare` about them."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sandbox import compare, load
from sandbox.arrays import FloatArray
from sandbox.cli.compare import _accuracy_lines, _joint_order
from sandbox.measure.compare.ground_truth import truth_of
from sandbox.scene.files.shipped_scenes import find

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps


def test_free_flight_with_quadratic_drag_is_refined_by_rk4() -> None:
    """The truth of smooth motion must be of order 4 to be better than the integrators that it judges."""
    scene = load(find("projectile"), ["world.quadratic_drag=0.1"])
    truth = truth_of(scene, scene.solver, 1e-3)
    # Independent: the same motion by scipy at a relative tolerance of 1e-12.
    y0, v0 = scene.bodies.position[0], scene.bodies.velocity[0]
    factor = scene.world.quadratic_drag  # 1/m

    def rates(_: float, x: FloatArray) -> FloatArray:
        w = x[2:]
        return np.concatenate((w, np.asarray(scene.world.gravity) - factor * np.hypot(*w) * w))

    found = solve_ivp(rates, (0.0, 3.0), [*y0, *v0], rtol=1e-12, atol=1e-13)
    error = float(np.abs(truth.trajectory.position[-1, 0] - found.y[:2, -1]).max())
    assert error < 2 * truth.difference < 1e-7  # RK4 at h = 5 ms: the error is 1/15 of the last difference


def test_rk4_error_is_below_the_accuracy_of_a_refined_truth_under_drag() -> None:
    """An order of convergence shows only if the truth is better than the best of the compared methods."""
    scene = load(find("projectile"), ["world.quadratic_drag=0.1"])
    comparison = compare(scene, sweep={"solver.integrator": ["velocity_verlet", "rk4"]})
    verlet, rk4 = (row.score.max_position or 0.0 for row in comparison.rows)
    assert verlet > 1e3 * rk4  # 2.9e-4 m of order 2, 2e-8 m of order 4
    (note,) = _accuracy_lines(comparison)
    assert "rk4" in note


def test_joints_limit_the_order_of_integrators() -> None:
    scene = load(find("pendulum_90"), ["world.duration=0.1"])
    comparison = compare(scene, sweep={"solver.integrator": ["velocity_verlet", "rk4"]})
    (note,) = _joint_order(comparison)
    assert "order 1" in note and "rattle" in note
    free = compare(load(find("ball")), sweep={"solver.integrator": ["velocity_verlet", "rk4"]})
    assert list(_joint_order(free)) == []
