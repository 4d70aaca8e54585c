"""Ropes and cloth: the catenary, the stretch cap, and what iterations do to stiffness."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from sandbox.engines.reference.joints import MAX_STRETCH
from sandbox.scene.compile.joint_arrays import LinkKind
from tests.engines.reference.joint_rig import G, Rig, compile_joints, link

pytestmark = pytest.mark.full  # long runs and sweeps


def discrete_sag(links=20, span=1.0, length=1.4):
    """Return how deep a chain of equal links hangs: equal weights at its joints, tension's level part t everywhere."""
    piece = length / links
    weights = np.arange(links) - (links - 1) / 2  # the share of weight that each link bears upwards

    def excess(t):
        return piece * (t / np.hypot(t, weights)).sum() - span

    t = brentq(excess, 1e-6, 1e3, xtol=1e-14)
    return piece * (np.abs(weights) / np.hypot(t, weights)).sum() / 2


def test_the_catenary_is_the_limit_of_many_links():
    c = brentq(lambda c: 2 * c * math.sinh(0.5 / c) - 1.4, 0.1, 10)
    assert c * (math.cosh(0.5 / c) - 1) == pytest.approx(0.43788, abs=5e-6)  # as many digits as are given
    assert discrete_sag() == pytest.approx(0.43854, abs=5e-6)  # as above
    assert discrete_sag(2000) == pytest.approx(0.43788, abs=1e-5)  # closer with the square of the links


@pytest.mark.parametrize(
    ("how", "integrator", "iterations", "accuracy"),
    [
        ("impulses", "semi_implicit_euler", 20, 1e-9),  # warm started, they converge from step to step: 1e-11
        ("relaxation", "semi_implicit_euler", 100, 5e-4),  # each step starts anew: measured 3.4e-4, as h²
        ("xpbd", "semi_implicit_euler", 100, 5e-4),  # for rods it is relaxation
        ("rattle", "velocity_verlet", 100, 5e-4),  # half the push of a step, less stretch
    ],
)
def test_a_chain_comes_to_rest_in_its_catenary(how, integrator, iterations, accuracy):
    piece, depth = 0.07, math.sqrt(0.7**2 - 0.5**2)
    place = np.arange(1, 21) / 20
    start = np.column_stack((place, -depth * np.minimum(2 * place, 2 - 2 * place)))  # two straight halves
    held = compile_joints(*(link(LinkKind.ROD, k - 1, k, piece) for k in range(20)))
    mass = [0.05] * 19 + [math.inf]
    rig = Rig(held, start, mass=mass, drag=3.0, how=how, integrator=integrator, iterations=iterations)
    rig.run(12.0, 1 / 120)
    assert -rig.pose[:, 1].min() == pytest.approx(discrete_sag(), abs=accuracy)


def hanging(how, iterations, kind=LinkKind.SPRING, count=10, cap=math.inf, stiffness=400.0):
    """Return how far a chain hangs down, beyond its length, once drag has brought it to rest."""
    figures = (0.1, stiffness, 1.0) if kind == LinkKind.SPRING else (0.1,)
    held = compile_joints(*(link(kind, k - 1, k, *figures) for k in range(count)))
    pose = [[0.0, -0.1 * (k + 1)] for k in range(count)]
    rig = Rig(held, pose, mass=0.1, drag=3.0, how=how, iterations=iterations, cap=cap).run(8.0, 1 / 120)
    length = np.hypot(*np.diff(rig.pose[:, :2], axis=0, prepend=0.0).T)
    return -rig.pose[-1, 1] - 0.1 * count, length


def test_xpbd_is_as_stiff_as_stated_whatever_the_iterations_once_they_converge():
    expected = 10 * 11 / 2 * 0.1 * G / 400.0
    for iterations in (10, 50, 200):
        assert hanging("xpbd", iterations)[0] == pytest.approx(expected, rel=1e-6)  # measured 1.6e-7, then 3e-8 by drag


def test_relaxation_is_as_stiff_as_it_has_iterations():
    five, ten, twenty = (hanging("relaxation", n, LinkKind.ROD)[0] for n in (5, 10, 20))
    assert five > 2.0 * ten > 4.0 * twenty > 0.0  # measured 5.9, 2.8, 1.2 mm of 1 m


def test_capped_springs_stretch_to_their_cap_and_no_farther():
    _, free = hanging("relaxation", 50, stiffness=60.0)
    _, capped = hanging("relaxation", 50, stiffness=60.0, cap=MAX_STRETCH)
    assert free.max() > 1.5 * 0.1  # it takes a cap
    assert capped.max() < 0.11 * (1 + 1e-3)  # as far as 50 passes converge: measured 4e-4


def test_springs_of_no_rest_length_have_no_cap():
    held = compile_joints(link(LinkKind.SPRING, -1, 0, 0.0, 10.0))
    one = Rig(held, [1, 0], how="relaxation", cap=MAX_STRETCH).run(0.3, 0.01)
    other = Rig(held, [1, 0], how="relaxation").run(0.3, 0.01)
    assert np.array_equal(one.x, other.x)
