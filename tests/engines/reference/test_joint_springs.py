"""Springs: known behaviour of each integrator, two bodies, chains and strings; and springs in XPBD."""

import math

import numpy as np
import pytest

from sandbox.scene.compile.joint_arrays import JointKind
from tests.engines.reference.joint_rig import G, Rig, compile_joints, link

OMEGA = 2 * math.pi


def oscillator(h: float, steps: int, **settings) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements and energies of a ball on a 1 m spring, both relative to their initial values.

    It starts at rest, 0.1 m from equilibrium.
    """
    joints = compile_joints(link(JointKind.SPRING, -1, 0, 1.0, OMEGA**2))
    rig = Rig(joints, [1.1, 0.0], gravity=0.0, **settings)
    x, energy = [0.1], []
    for _ in range(steps):
        rig.step(h)
        x.append(rig.pose[0, 0] - 1.0)
        energy.append((rig.rates[0, 0] ** 2 + (OMEGA * x[-1]) ** 2) / (OMEGA * 0.1) ** 2)
    return np.array(x) / 0.1, np.array(energy)


def test_xpbd_is_backward_euler():
    """Backward Euler on one spring multiplies the energy by |R|² = 1/(1 + ω²h²) a step."""
    _, energy = oscillator(0.01, 200, method="xpbd", iterations=1)
    assert energy[-1] == pytest.approx((1 + (OMEGA * 0.01) ** 2) ** -200, rel=1e-10)  # rounding of 200 steps


def test_xpbd_dampers_match_a_backward_euler_step():
    """The system is linear, so one iteration suffices: x' = x + h v', v' = v − h (ω² x' + c v')."""
    c, h = 3.0, 0.01
    rig = Rig(compile_joints(link(JointKind.SPRING, -1, 0, 1.0, OMEGA**2, c)), [1.1, 0.0], gravity=0.0, method="xpbd")
    x, v = 0.1, 0.0
    for _ in range(100):
        rig.step(h)
        v = (v - h * OMEGA**2 * x) / (1 + h * c + (h * OMEGA) ** 2)
        x += h * v
        assert rig.pose[0, 0] - 1.0 == pytest.approx(x, abs=1e-12)  # rounding of 100 steps


def test_xpbd_holds_any_stiffness():
    rig = Rig(compile_joints(link(JointKind.SPRING, -1, 0, 1.0, 1e12)), [0.0, -1.0], method="xpbd").run(1.0, 0.01)
    assert rig.pose[0, 1] == pytest.approx(-1.0, abs=1e-10)  # m g/k is 1e-11 m


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("integrator", ["velocity_verlet", "leapfrog", "rk4"])
def test_two_bodies_oscillate_with_their_reduced_mass(integrator):
    joints = compile_joints(link(JointKind.SPRING, 0, 1, 1.0, OMEGA**2 * 0.75))
    rig = Rig(joints, [[0, 0], [1.1, 0]], mass=[1, 3], gravity=0.0, integrator=integrator).run(10.0, 1e-3)
    # Back at the start after ten periods: the relative frequency error is (ωh)²/24, plus rounding.
    assert rig.pose[:, 0] == pytest.approx([0.0, 1.1], abs=1e-7)
    assert rig.pose[:, 1:] == pytest.approx(0.0, abs=0.0)


def test_spring_off_the_centres_exerts_force_and_torque():
    """Force and torque match central differences of the energy ½ k (l − l₀)²."""
    joints = compile_joints(link(JointKind.SPRING, 0, 1, 0.7, 40.0, anchor_a=(0.2, 0.1), anchor_b=(-0.1, 0.3)))
    pose = np.array([[0.1, -0.2, 0.4], [0.9, 0.5, -1.1]])
    mass, moment = np.array([1.0, 3.0]), np.array([0.2, 0.5])
    rig = Rig(joints, pose, mass=mass, moment=moment)

    def energy(flat):
        p = flat.reshape(2, 3)
        turned = [np.array([[math.cos(t), -math.sin(t)], [math.sin(t), math.cos(t)]]) for t in p[:, 2]]
        ends = p[0, :2] + turned[0] @ (0.2, 0.1), p[1, :2] + turned[1] @ (-0.1, 0.3)
        return 0.5 * 40.0 * (math.dist(*ends) - 0.7) ** 2

    steps = 1e-6 * np.eye(6)
    slope = np.array([(energy(pose.ravel() + d) - energy(pose.ravel() - d)) / 2e-6 for d in steps]).reshape(2, 3)
    expected = -slope / np.column_stack((mass, mass, moment))
    assert rig.solver.forces(rig.x) == pytest.approx(expected, rel=1e-7, abs=1e-7)  # error of the differences at 1e-6
    assert rig.solver.load(rig.x)[0] == pytest.approx(-slope[1, :2], rel=1e-7)  # as above


def test_spring_of_zero_rest_length_oscillates_through_its_anchor():
    """F = −k r is linear in both directions, so Verlet's numerical frequency is exact, also at r = 0."""
    joints = compile_joints(link(JointKind.SPRING, -1, 0, 0.0, OMEGA**2))
    rig = Rig(joints, [0.3, 0.0], [[0.0, 0.5, 0.0]], gravity=0.0, integrator="velocity_verlet")
    omega = 2 / 0.01 * math.asin(OMEGA * 0.01 / 2)
    for k in range(1, 201):
        rig.step(0.01)
        assert rig.pose[0, 0] == pytest.approx(0.3 * math.cos(omega * 0.01 * k), abs=1e-12)  # rounding of 200 steps


def test_damped_spring_of_zero_rest_length_brakes_at_its_anchor():
    joints = compile_joints(link(JointKind.SPRING, -1, 0, 0.0, 10.0, 3.0))
    rig = Rig(joints, [0.0, 0.0], [[0.3, -0.4, 0.0]], mass=2.0)
    assert rig.solver.forces(rig.x)[0, :2] == pytest.approx([-0.45, 0.6], rel=1e-15)  # −c v/m
    rig.x[1] = 0.0
    assert not rig.solver.forces(rig.x).any()


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("method", ["impulses", "xpbd"])
def test_rotary_springs_oscillate_with_the_reduced_moment(method):
    joints = compile_joints(link(JointKind.ROTARY_SPRING, 0, 1, 0.5, OMEGA**2 * 0.75))
    pose = [[0, 0, 0], [1, 0, 0.6]]
    rig = Rig(joints, pose, moment=[1, 3], gravity=0.0, integrator="velocity_verlet", method=method).run(1.0, 1e-4)
    # After one period: with forces, Verlet's (ωh)²/24 squared; in XPBD the amplitude falls by ω² h t/2 at first order.
    loss = 1.0 if method == "impulses" else math.exp(-(OMEGA**2) * 1e-4 / 2)
    assert rig.pose[1, 2] - rig.pose[0, 2] - 0.5 == pytest.approx(0.1 * loss, abs=1e-5)
    assert (rig.moment * rig.pose[:, 2]).sum() == pytest.approx(1.8, rel=1e-12)  # rounding of 10,000 steps


def test_rotary_dampers_brake():
    joints = compile_joints(link(JointKind.ROTARY_SPRING, -1, 0, 0.0, 1e-30, 0.5))
    rig = Rig(joints, [0, 0, 0], [[0, 0, 2.0]], moment=0.25, gravity=0.0, integrator="rk4").run(1.0, 0.01)
    assert rig.rates[0, 2] == pytest.approx(2 * math.exp(-2.0), rel=1e-7)  # RK4 at c h/I = 0.02: error 2e-9 per second


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(("method", "accuracy"), [("impulses", 1e-9), ("xpbd", 1e-6)])
def test_hanging_chain_of_springs_stretches_by_the_sum_of_weights(method, accuracy):
    """By n (n + 1)/2 · m g/k, once drag has brought it to rest."""
    n, k, m = 8, 500.0, 0.2
    joints = compile_joints(*(link(JointKind.SPRING, j - 1, j, 0.1, k, 2.0) for j in range(n)))
    pose = [[0.0, -0.1 * (j + 1)] for j in range(n)]
    rig = Rig(joints, pose, mass=m, drag=2.0, method=method, iterations=100).run(20.0, 1 / 200)
    stretch = -rig.pose[-1, 1] - 0.1 * n
    assert stretch == pytest.approx(n * (n + 1) / 2 * m * G / k, rel=accuracy)  # residual motion after 20 s of drag
    load = rig.solver.load(rig.x)
    assert load[:, 1] == pytest.approx(m * G * np.arange(n, 0, -1), rel=1e-5)  # each carries the weight below it


@pytest.mark.parametrize("mode", range(1, 8))
def test_stretched_string_oscillates_in_its_modes(mode):
    """ω = 2 √(T/(m l)) sin(j π/(2 (N + 1))) at Verlet's numerical frequency; a small amplitude keeps T constant."""
    count, length, k, m, h = 7, 0.1, 400.0, 0.05, 2e-3
    ends = [[0.0, 0.0], [length * (count + 1), 0.0]]
    shape = 1e-7 * np.sin(mode * math.pi * np.arange(1, count + 1) / (count + 1))
    pose = [*([length * (j + 1), y] for j, y in enumerate(shape)), ends[1]]
    joints = compile_joints(*(link(JointKind.SPRING, j - 1, j, 0.5 * length, k) for j in range(count + 1)))
    mass = [m] * count + [math.inf]
    rig = Rig(joints, pose, mass=mass, gravity=0.0, integrator="velocity_verlet")
    tension = k * 0.5 * length
    omega = 2 * math.sqrt(tension / (m * length)) * math.sin(mode * math.pi / (2 * (count + 1)))
    numerical = 2 / h * math.asin(omega * h / 2)
    for step in range(1, 501):
        rig.step(h)
        expected = shape * math.cos(numerical * h * step)
        # 1e-5 of the amplitude: its square, and rounding
        assert rig.pose[:count, 1] == pytest.approx(expected, abs=1e-12)
