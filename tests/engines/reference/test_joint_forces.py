"""Attraction and thrust: Kepler orbits, reaction forces, and forces that rotate with their body."""

import math

import numpy as np
import pytest

from sandbox.engines.forces.field import add_attraction, add_thrusts
from sandbox.engines.forces.thrust import ThrustColumns
from tests.engines.reference.joint_rig import Rig, compile_joints

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps


def attraction(inverse_mass, *, target=-1, point=(0.0, 0.0), strength=1.0, softening=0.0):
    """Return the force function of one attraction."""
    arrays = np.array([target]), np.array([point], dtype=float), np.array([strength]), np.array([softening])

    def forces(x):
        out = np.zeros_like(x[1])
        add_attraction(x[0], *arrays, np.asarray(inverse_mass, dtype=float), out)
        return out

    return forces


def orbit(integrator):
    """Return a body at the pericentre of an orbit of eccentricity ½ and semi-major axis 1 around a sun of GM = 1."""
    return Rig(
        compile_joints(), [0.5, 0], [[0, math.sqrt(3), 0]], gravity=0, integrator=integrator, forces=attraction([1.0])
    )


def energy_of(rig):
    return 0.5 * (rig.rates[0, :2] ** 2).sum() - 1 / math.hypot(*rig.pose[0, :2])


def test_kepler_orbit_with_rk4_closes_after_a_period():
    rig = orbit("rk4")
    assert energy_of(rig) == pytest.approx(-0.5, rel=1e-15)  # E = −GM/2a
    h = 2 * math.pi / 4000
    rig.run(2 * math.pi, h)
    assert rig.pose[0, :2] == pytest.approx([0.5, 0.0], abs=1e-9)  # fourth order at h ω = 9e-3 near the sun
    assert energy_of(rig) == pytest.approx(-0.5, rel=1e-10)  # as above
    assert rig.angular_momentum == pytest.approx(math.sqrt(0.75), rel=1e-10)  # as above


def test_two_bodies_orbit_each_other_and_conserve_momentum():
    """Strength G·m₂ on the first body and the reaction on the second: relative motion as around G (m₁ + m₂)."""
    mass = np.array([1.0, 3.0])
    rig = Rig(
        compile_joints(),
        [[0.75, 0], [-0.25, 0]],
        [[0, 0.75, 0], [0, -0.25, 0]],
        mass=mass,
        gravity=0,
        integrator="rk4",
        forces=attraction(1 / mass, target=1, strength=0.75),
    )
    rig.run(2 * math.pi, 2 * math.pi / 1000)
    assert rig.pose[:, :2] == pytest.approx(np.array([[0.75, 0], [-0.25, 0]]), abs=1e-8)  # fourth order, a circle
    assert rig.momentum == pytest.approx([0.0, 0.0], abs=1e-14)  # rounding
    assert rig.angular_momentum == pytest.approx(0.75, rel=1e-9)  # fourth order


def test_attraction_is_softened_and_skips_fixed_bodies_and_bodies_at_its_centre():
    pose = np.array([[3.0, 4.0, 0.0], [3.0, 4.0, 0.0], [0.0, 0.0, 0.0]])
    out = attraction([2.0, 0.0, 1.0], strength=50.0, softening=5.0)(np.stack((pose, pose)))
    assert out == pytest.approx(np.array([[-0.6, -0.8, 0], [0, 0, 0], [0, 0, 0]]), rel=1e-15)  # 50/(25 + 25)


def thrust(throttle, *, force, point=(0.0, 0.0), inverse_mass=0.5, inverse_moment=4.0):
    always = np.array([-np.inf]), np.array([np.inf])
    thrusts = ThrustColumns(np.array([0]), np.array([point]), np.array([force]), *always)
    inverse = np.array([inverse_mass]), np.array([inverse_moment])

    def forces(x):
        out = np.zeros_like(x[1])
        add_thrusts(thrusts, np.array([throttle]), 0.0, x[0], *inverse, out)
        return out

    return forces


def test_thrust_rotates_with_its_body():
    """At a steady spin ω, v = F/(m ω) (sin ωt, 1 − cos ωt)."""
    spin, speed = 3.0, 2.0 * 0.5 / 3.0
    rig = Rig(
        compile_joints(), [0, 0], [[0, 0, spin]], gravity=0, integrator="rk4", forces=thrust(1.0, force=(2.0, 0.0))
    )
    rig.run(1.0, 0.01)
    expected = [speed * math.sin(spin), speed * (1 - math.cos(spin)), spin]
    assert rig.rates[0] == pytest.approx(expected, abs=1e-8)  # fourth order at ω h = .03


def test_thrust_off_the_centre_exerts_a_torque_scaled_by_the_throttle():
    forces = thrust(0.5, force=(2.0, 0.0), point=(0.0, -0.1))
    rig = Rig(compile_joints(), [0, 0], gravity=0, integrator="rk4", forces=forces).run(1.0, 0.01)
    assert rig.rates[0, 2] == pytest.approx(0.4, rel=1e-13)  # τ/I = .5 · .1 · 2 · 4, at any angle
    assert rig.pose[0, 2] == pytest.approx(0.2, rel=1e-13)  # half of that, at t = 1
