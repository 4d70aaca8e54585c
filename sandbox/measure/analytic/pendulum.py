"""Pendulum: a body that swings about a fixed point with any amplitude, or rotates over the top.

With θ from straight down, θ̈ = −Ω² sin θ, and k² = sin²(θ₀/2) + (θ̇₀/2Ω)² is its energy relative to that at the top.
Below 1 it swings: sin(θ/2) = k sn(Ωt + u₀, k). Above 1 it rotates: θ/2 = am(kΩt + u₀, 1/k). Source: Abramowitz & Stegun
1964, 16 and 17; the period 4 K(k)/Ω.
"""

import math
from dataclasses import dataclass

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.measure.analytic.elliptic import first_kind, jacobi, quarter_period
from sandbox.measure.analytic.model import PARALLEL_SINE, Anchor, BodyMotion, SceneFacts, cross, direction
from sandbox.scene.compile.joint_arrays import JointKind
from sandbox.trajectory import ContactEvent


@dataclass(frozen=True, eq=False)
class Swing:
    """Angle of a pendulum from straight down, counter-clockwise."""

    start: float
    """rad, from −π to π"""
    half: tuple[float, float]
    """sine and cosine of half the initial angle, each accurate to rounding"""
    rate: float
    """at time 0, rad/s"""
    frequency: float
    """Ω, of small swings, rad/s; 0 without gravity"""

    @property
    def modulus(self) -> tuple[float, float]:
        """k² and 1 − k², which is negative if it rotates."""
        kick = (self.rate / (2.0 * self.frequency)) ** 2
        sine, cosine = self.half
        return sine * sine + kick, cosine * cosine - kick

    @property
    def period(self) -> float:
        """Period of a swing or of a rotation, s; inf if it does not return, or does not move."""
        if self.frequency == 0.0:
            return 2.0 * math.pi / abs(self.rate) if self.rate else math.inf
        m, m1 = self.modulus
        if m1 < 0.0:
            return 2.0 * quarter_period(-m1 / m) / (math.sqrt(m) * self.frequency)
        return 4.0 * quarter_period(m1) / self.frequency if m > 0.0 else math.inf

    def at(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the angle, with full turns, and its rate at T times."""
        if self.frequency == 0.0:
            return self.start + self.rate * time, np.full(len(time), self.rate)
        (sine, cosine), (m, m1) = self.half, self.modulus
        k, u = math.sqrt(m), self.frequency * time
        if m == 0.0:
            return np.zeros(len(time)), np.zeros(len(time))
        if m1 < 0.0:
            sign = math.copysign(1.0, self.rate)
            inner = 1.0 / m, -m1 / m
            found = jacobi(sign * k * u + first_kind(sine, cosine, *inner), *inner)
            return 2.0 * found.amplitude, (2.0 * self.frequency * k * sign) * found.dn
        begin = first_kind(sine / k, self.rate / (2.0 * self.frequency * k), m, m1)
        found = jacobi(u + begin, m, m1)
        return 2.0 * np.arctan2(k * found.sn, found.dn), (2.0 * self.frequency * k) * found.cn


@dataclass(frozen=True, eq=False)
class Pendulum:
    """Motion of one body that swings."""

    swing: Swing
    pivot: FloatArray
    """(2,) m, pivot point"""
    length: float
    """m, from the pivot point to the centre of mass"""
    down: FloatArray
    """(2,) unit vector of gravity; without gravity, any direction"""
    angle: float
    """of the body at time 0, rad"""
    spin: float | None
    """rad/s, constant; None if the body rotates with the swing"""
    name: str = "a pendulum"

    def at(self, time: FloatArray) -> BodyMotion:
        """Return its motion at T times."""
        theta, rate = self.swing.at(time)
        aside = np.asarray([-self.down[1], self.down[0]])
        sine, cosine = np.sin(theta)[:, None], np.cos(theta)[:, None]
        position = self.pivot + self.length * (cosine * self.down + sine * aside)
        velocity = (self.length * rate)[:, None] * (cosine * aside - sine * self.down)
        if self.spin is None:
            return BodyMotion(position, velocity, self.angle + (theta - self.swing.start), rate)
        return BodyMotion(position, velocity, self.angle + self.spin * time, np.full(len(time), self.spin))

    def contacts(self, _until: float, _shortest: float) -> list[ContactEvent]:
        """Return no contacts."""
        return []


def pendulum(facts: SceneFacts, number: int) -> Pendulum | None:
    """Return the motion of a body on a rod at its centre, or on a pivot off its centre; None if it does not apply.

    The other end of the joint is a fixed point. The body has no contacts, there is no drag, and no other joint,
    attraction or thrust acts on it. It starts with the joint satisfied, in position and velocity.
    """
    if (
        not facts.moves_freely(number)
        or not facts.matrix.held[number]
        or facts.scene.attractions
        or not facts.has_no_air
    ):
        return None
    anchor = facts.anchor(number)
    if anchor is None:
        return None
    bodies = facts.bodies
    arm, velocity = bodies.position[number] - anchor.place, bodies.velocity[number]
    length, spin = math.hypot(*arm), float(bodies.angular_velocity[number])
    if length == 0.0:
        return None
    rate = cross(arm, velocity) / length**2
    # The velocity without that of the swing must be 0.
    stray = velocity - rate * np.asarray([-arm[1], arm[0]])
    if math.hypot(*stray) > PARALLEL_SINE * math.hypot(*velocity):
        return None
    moment = _moment(facts, number, anchor, arm, rate)
    if moment is None:
        return None

    pull = math.hypot(*facts.gravity)
    down = direction(facts.gravity) if pull > 0.0 else direction(arm)
    frequency = math.sqrt(float(bodies.mass[number]) * pull * length / moment)
    free_spin = spin if anchor.kind == JointKind.ROD else None
    theta, half = _halved(down, arm / length)
    return Pendulum(
        Swing(theta, half, rate, frequency), anchor.place, length, down, float(bodies.angle[number]), free_spin
    )


def _moment(facts: SceneFacts, number: int, anchor: Anchor, arm: FloatArray, rate: float) -> float | None:
    """Return the moment of inertia about the pivot point, kg·m²; None if the joint makes no pendulum."""
    bodies, length = facts.bodies, math.hypot(*arm)
    size = length + float(np.abs(anchor.place).max())  # the scale of the rounding of coordinates
    if anchor.kind == JointKind.ROD:
        if anchor.arm.any() or abs(float(anchor.figures[0]) - length) > PARALLEL_SINE * size:
            return None
        return float(bodies.mass[number]) * length**2
    if anchor.kind != JointKind.PIVOT:
        return None
    cos, sin = math.cos(bodies.angle[number]), math.sin(bodies.angle[number])
    held = np.asarray([cos * anchor.arm[0] - sin * anchor.arm[1], sin * anchor.arm[0] + cos * anchor.arm[1]])
    if math.hypot(*(arm + held)) > PARALLEL_SINE * size:
        return None
    spin = float(bodies.angular_velocity[number])
    if abs(spin - rate) > PARALLEL_SINE * abs(spin):
        return None
    return float(bodies.moment[number] + bodies.mass[number] * length**2)


def _halved(down: FloatArray, towards: FloatArray) -> tuple[float, tuple[float, float]]:
    """Return the angle from down, and sine and cosine of its half, accurate near the top and the bottom."""
    sine, cosine = cross(down, towards), float(down @ towards)
    if cosine > 0.0:
        half_cosine = math.sqrt(0.5 * (1.0 + cosine))
        half = 0.5 * sine / half_cosine, half_cosine
    else:
        half_sine = math.copysign(math.sqrt(0.5 * (1.0 - cosine)), sine)
        half = half_sine, 0.5 * sine / half_sine
    return math.atan2(sine, cosine), half
