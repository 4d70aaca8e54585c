"""Laws of joints for every method: momentum, bounds, reported forces and broken joints."""

import math

import numpy as np
import pytest

from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.engines.reference.joints import METHODS, JointSolver
from sandbox.scene.compile.joint_arrays import JointKind
from tests.engines.reference.joint_rig import BIAS, G, Rig, compile_joints, link

METHOD_AND_INTEGRATOR = [
    *((method, "semi_implicit_euler") for method in METHODS),
    ("impulses", "explicit_euler"),
    ("rattle", "velocity_verlet"),
]


def tumbling(method, integrator, *more):
    """Return three bodies in a row, joined off their centres, that tumble freely."""
    joints = compile_joints(
        link(JointKind.ROD, 0, 1, 0.6, anchor_a=(0.2, 0.0), anchor_b=(-0.2, 0.0)),
        link(JointKind.ROD, 1, 2, 0.6, anchor_a=(0.2, 0.0), anchor_b=(-0.2, 0.0)),
        link(JointKind.ROTARY_LIMIT, 0, 1, -0.3, 0.3),
        *more,
    )
    rates = [[1, 2, 3], [0, -1, 0], [0.5, 1, -2]]
    pose = [[0, 0, 0], [1, 0, 0], [2, 0, 0]]
    moment = [0.1, 0.2, 0.15]
    return Rig(joints, pose, rates, mass=[1, 2, 3], moment=moment, method=method, integrator=integrator, gravity=0)


@pytest.mark.parametrize(("method", "integrator"), METHOD_AND_INTEGRATOR)
def test_free_bodies_conserve_momentum(method, integrator):
    rig = tumbling(method, integrator, link(JointKind.PIVOT, 1, 2, anchor_a=(0.5, 0.2), anchor_b=(-0.5, 0.2)))
    before = rig.momentum
    rig.run(2.0, 1 / 240)
    assert rig.momentum == pytest.approx(before, rel=1e-12)  # rounding of 480 steps


@pytest.mark.parametrize(
    ("method", "integrator"), [each for each in METHOD_AND_INTEGRATOR if each[0] in ("impulses", "rattle")]
)
def test_corrections_along_initial_directions_conserve_angular_momentum(method, integrator):
    rig = tumbling(method, integrator)
    before = rig.angular_momentum
    rig.run(2.0, 1 / 240)
    assert rig.angular_momentum == pytest.approx(before, rel=1e-12)  # rounding of 480 steps


@pytest.mark.parametrize("method", ["relaxation", "xpbd"])
def test_corrections_along_final_directions_lose_angular_momentum_at_first_order(method):
    """These methods are backward Euler: x' × v' equals x × v up to h v' × v."""
    lost = []
    for n in (480, 960):
        rig = tumbling(method, "semi_implicit_euler")
        before = rig.angular_momentum
        lost.append(rig.run(0.5, 1 / n).angular_momentum - before)
    assert abs(lost[0]) < 0.1 * abs(before)  # measured 2 % and less
    assert lost[0] / lost[1] == pytest.approx(2.0, abs=0.4)  # first order, and the time at which the limit is reached


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(("method", "integrator"), METHOD_AND_INTEGRATOR)
def test_rotary_limit_holds(method, integrator):
    """A beam on a pivot falls onto its limit at −½ and stays; the torque there equals that of its weight."""
    joints = compile_joints(
        link(JointKind.PIVOT, -1, 0, anchor_b=(-0.5, 0.0)), link(JointKind.ROTARY_LIMIT, -1, 0, -0.5, 1.0)
    )
    rig = Rig(joints, [0.5, 0, 0], moment=1 / 12, method=method, integrator=integrator, iterations=50)
    for _ in range(960):
        rig.step(1 / 240)
        assert rig.pose[0, 2] > -0.5 - 0.03  # overshoots by at most one step of rotation, 4.2 rad/s · h
    assert rig.pose[0, 2] == pytest.approx(-0.5, abs=2e-3)  # with impulses the bias balances one step of falling
    assert rig.solver.load(rig.x)[1, 0] == pytest.approx(G * 0.5 * math.cos(0.5), rel=0.05)  # torque of the last step


@pytest.mark.parametrize(("method", "integrator"), METHOD_AND_INTEGRATOR)
def test_slack_slide_does_nothing(method, integrator):
    joints = compile_joints(link(JointKind.SLIDE, -1, 0, 0.1, 2.0))
    jointed = Rig(joints, [1, 0], [[0.3, 1, 0]], method=method, integrator=integrator).run(0.5, 1 / 240)
    free = Rig(compile_joints(), [1, 0], [[0.3, 1, 0]], method=method, integrator=integrator).run(0.5, 1 / 240)
    assert np.array_equal(jointed.x, free.x)


@pytest.mark.parametrize(("method", "integrator"), METHOD_AND_INTEGRATOR)
def test_slide_limits_the_distance_on_both_sides(method, integrator):
    joints = compile_joints(link(JointKind.SLIDE, -1, 0, 0.4, 1.0))
    rig = Rig(joints, [0.8, 0.0], [[0.0, 2.0, 0]], method=method, integrator=integrator)
    for _ in range(960):
        rig.step(1 / 240)
        length = math.hypot(*rig.pose[0, :2])
        # Impulses act once the bound is exceeded, by at most a step of travel; the others correct it within the step.
        slack = 6.0 / 240 if method == "impulses" else 1e-12
        assert 0.4 - slack < length < 1.0 + slack
    inside = Rig(joints, [0.0, 0.5], method=method, integrator=integrator).run(2.0, 1 / 240)
    assert math.hypot(*inside.pose[0, :2]) == pytest.approx(0.4, abs=1e-2)  # balances upright on the lower bound


@pytest.mark.parametrize(("method", "integrator"), METHOD_AND_INTEGRATOR)
@pytest.mark.parametrize("kind", [JointKind.ROD, JointKind.PIVOT])
def test_joint_force_does_not_exceed_its_maximum(method, integrator, kind):
    """The body falls straight down with g − F/m."""
    figures = (1.0,) if kind == JointKind.ROD else ()
    anchor = (0.0, 0.0) if kind == JointKind.ROD else (0.0, 1.0)
    joints = compile_joints(link(kind, -1, 0, *figures, anchor_b=anchor, max_force=4.0))
    rig = Rig(joints, [0, -1], mass=2.0, method=method, integrator=integrator).run(1.0, 1 / 100)
    assert rig.rates[0, 1] == pytest.approx(-(G - 2.0), rel=1e-12)  # rounding of 100 steps
    assert rig.solver.load(rig.x)[0] == pytest.approx([0.0, 4.0], abs=1e-12)  # as above


@pytest.mark.parametrize(("method", "integrator"), METHOD_AND_INTEGRATOR)
def test_load_of_a_joint_is_the_hanging_weight(method, integrator):
    joints = compile_joints(
        link(JointKind.ROD, -1, 0, 1.0), link(JointKind.PIVOT, 0, 1, anchor_a=(0, -0.5), anchor_b=(0, 0.5))
    )
    rig = Rig(joints, [[0, -1], [0, -2]], mass=[1, 2], moment=1.0, method=method, integrator=integrator, iterations=60)
    rig.run(2.0, 1 / 240)
    # settled, as far as 60 iterations converge
    assert rig.solver.load(rig.x)[:, 1] == pytest.approx([3 * G, 2 * G], rel=1e-3)
    assert rig.solver.load(rig.x)[:, 0] == pytest.approx(0.0, abs=1e-12)  # rounding


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("method", METHODS)
def test_hanging_body_at_rest_has_the_velocity_not_yet_applied_to_positions(method, integrator):
    rig = Rig(compile_joints(link(JointKind.ROD, -1, 0, 1.0)), [0, -1], method=method, integrator=integrator).run(
        2, 1 / 240
    )
    remaining = 1.0 - INTEGRATORS[integrator].fraction if method in ("relaxation", "xpbd") else 0.0
    assert rig.rates[0, 1] == pytest.approx(-remaining * G / 240, abs=1e-12)  # rounding over h
    # impulses correct the fall of the first step to 0.9 of it per 1/60 s
    assert rig.pose[0, 1] == pytest.approx(-1.0, abs=1e-12)


@pytest.mark.parametrize(("method", "integrator"), METHOD_AND_INTEGRATOR)
def test_broken_joint_releases_its_body_and_the_rest_keep_their_impulses(method, integrator):
    joints = compile_joints(link(JointKind.ROD, -1, 0, 1.0), link(JointKind.ROD, -1, 1, 1.0))
    rig = Rig(joints, [[0, -1], [0, -1]], method=method, integrator=integrator).run(1.0, 1 / 100)
    kept = rig.solver.impulse()[1].copy()
    assert kept[1] != 0.0
    rig.solver.rebuild(rig.solver.inverse_mass, rig.solver.inverse_moment, np.array([1]))
    # The direction of a rod is recomputed when it is next prepared; until then its row holds the sum along it.
    assert abs(rig.solver.rows.impulse[0, 0]) == pytest.approx(np.hypot(*kept), rel=1e-15)
    rig.rates[:] = 0.0
    rig.run(0.5, 1 / 100)
    assert rig.rates[0, 1] == pytest.approx(-G * 0.5, rel=1e-12)  # free fall, rounding of 50 steps
    assert rig.pose[1, :2] == pytest.approx([0.0, -1.0], abs=1e-3)
    assert not rig.solver.impulse()[0].any()


@pytest.mark.parametrize(("method", "integrator"), METHOD_AND_INTEGRATOR)
def test_joints_between_fixed_bodies_do_nothing(method, integrator):
    kinds = [(JointKind.ROD, 0.3), (JointKind.PIVOT, 0), (JointKind.SLIDE, 0, 0.1), (JointKind.ROTARY_LIMIT, 1, 2)]
    joints = compile_joints(*(link(kind, 0, 1, *figures) for kind, *figures in kinds))
    rig = Rig(joints, [[0, 0], [1, 0]], mass=math.inf, method=method, integrator=integrator)
    before = rig.x.copy()
    rig.run(0.1, 0.01)
    assert np.array_equal(rig.x, before)


@pytest.mark.parametrize(("method", "integrator"), METHOD_AND_INTEGRATOR)
def test_rod_between_coincident_ends_does_nothing(method, integrator):
    rig = Rig(
        compile_joints(link(JointKind.ROD, -1, 0, 1.0)), [0, 0], gravity=0, method=method, integrator=integrator
    ).run(0.1, 0.01)
    assert np.array_equal(rig.x, np.zeros((2, 1, 3)))  # no direction to push along, as in Munk2D


def test_single_short_step_between_long_ones_causes_no_jolt():
    """Warm-start impulses scale down with a shorter step and do not scale above that in the next long one."""
    joints = compile_joints(*(link(JointKind.ROD, k - 1, k, 0.1) for k in range(20)))
    rig = Rig(joints, [[0.0, -0.1 * (k + 1)] for k in range(20)], mass=np.linspace(1, 5, 20)).run(3.0, 1 / 120)
    before = np.abs(rig.rates).max()
    rig.step(1e-6)
    rig.step(1 / 120)
    assert np.abs(rig.rates).max() < before + 2 * G / 120  # at most one step of falling where iterations are too few


def test_unknown_method_is_refused():
    with pytest.raises(ValueError, match="glue"):
        JointSolver(compile_joints(), np.ones(1), np.ones(1), BIAS, 10, "glue")
