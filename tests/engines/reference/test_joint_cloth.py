"""Ropes and cloth: the catenary, the stretch cap and the effect of iterations on stiffness."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from sandbox.engines.reference.joints import MAX_STRETCH
from sandbox.scene.compile.joint_arrays import JointKind
from tests.engines.reference.joint_rig import G, Rig, compile_joints, link

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps


def discrete_sag(links=20, span=1.0, length=1.4):
    """Return the sag of a chain of equal links with equal weights at its joints; t is the horizontal tension."""
    piece = length / links
    weights = np.arange(links) - (links - 1) / 2  # the vertical load of each link

    def excess_span(t):
        return piece * (t / np.hypot(t, weights)).sum() - span

    t = brentq(excess_span, 1e-6, 1e3, xtol=1e-14)
    return piece * (np.abs(weights) / np.hypot(t, weights)).sum() / 2


def test_the_catenary_is_the_limit_of_many_links():
    c = brentq(lambda c: 2 * c * math.sinh(0.5 / c) - 1.4, 0.1, 10)
    assert c * (math.cosh(0.5 / c) - 1) == pytest.approx(0.43788, abs=5e-6)  # as many digits as the reference has
    assert discrete_sag() == pytest.approx(0.43854, abs=5e-6)  # as above
    assert discrete_sag(2000) == pytest.approx(0.43788, abs=1e-5)  # converges with the square of the number of links


@pytest.mark.parametrize(
    ("method", "integrator", "iterations", "accuracy"),
    [
        ("impulses", "semi_implicit_euler", 20, 1e-9),  # warm starts let impulses converge over the steps: 1e-11
        ("relaxation", "semi_implicit_euler", 100, 5e-4),  # no warm start: measured 3.4e-4, scales as h²
        ("xpbd", "semi_implicit_euler", 100, 5e-4),  # equals relaxation for rods
        ("rattle", "velocity_verlet", 100, 5e-4),  # half the correction of a step, less stretch
    ],
)
def test_chain_comes_to_rest_in_its_catenary(method, integrator, iterations, accuracy):
    piece, depth = 0.07, math.sqrt(0.7**2 - 0.5**2)
    x = np.arange(1, 21) / 20
    start = np.column_stack((x, -depth * np.minimum(2 * x, 2 - 2 * x)))  # two straight halves
    joints = compile_joints(*(link(JointKind.ROD, k - 1, k, piece) for k in range(20)))
    mass = [0.05] * 19 + [math.inf]
    rig = Rig(joints, start, mass=mass, drag=3.0, method=method, integrator=integrator, iterations=iterations)
    rig.run(12.0, 1 / 120)
    assert -rig.pose[:, 1].min() == pytest.approx(discrete_sag(), abs=accuracy)


def hanging_chain(method, iterations, kind=JointKind.SPRING, count=10, cap=math.inf, stiffness=400.0):
    """Return the extension of a hanging chain at rest and the lengths of its links, m."""
    figures = (0.1, stiffness, 1.0) if kind == JointKind.SPRING else (0.1,)
    joints = compile_joints(*(link(kind, k - 1, k, *figures) for k in range(count)))
    pose = [[0.0, -0.1 * (k + 1)] for k in range(count)]
    rig = Rig(joints, pose, mass=0.1, drag=3.0, method=method, iterations=iterations, cap=cap).run(8.0, 1 / 120)
    length = np.hypot(*np.diff(rig.pose[:, :2], axis=0, prepend=0.0).T)
    return -rig.pose[-1, 1] - 0.1 * count, length


def test_stiffness_of_xpbd_is_independent_of_the_iterations_once_converged():
    expected = 10 * 11 / 2 * 0.1 * G / 400.0
    for iterations in (10, 50, 200):
        # measured 1.6e-7 at 10 iterations, then 3e-8 from residual motion
        assert hanging_chain("xpbd", iterations)[0] == pytest.approx(expected, rel=1e-6)


def test_stiffness_of_relaxation_grows_with_the_iterations():
    five, ten, twenty = (hanging_chain("relaxation", n, JointKind.ROD)[0] for n in (5, 10, 20))
    assert five > 2.0 * ten > 4.0 * twenty > 0.0  # measured 5.9, 2.8, 1.2 mm of 1 m


def test_capped_springs_stretch_no_farther_than_their_cap():
    _, free = hanging_chain("relaxation", 50, stiffness=60.0)
    _, capped = hanging_chain("relaxation", 50, stiffness=60.0, cap=MAX_STRETCH)
    assert free.max() > 1.5 * 0.1  # without a cap it stretches farther
    assert capped.max() < 0.11 * (1 + 1e-3)  # as far as 50 passes converge: measured 4e-4


def test_springs_of_zero_rest_length_have_no_cap():
    joints = compile_joints(link(JointKind.SPRING, -1, 0, 0.0, 10.0))
    one = Rig(joints, [1, 0], method="relaxation", cap=MAX_STRETCH).run(0.3, 0.01)
    other = Rig(joints, [1, 0], method="relaxation").run(0.3, 0.01)
    assert np.array_equal(one.x, other.x)
