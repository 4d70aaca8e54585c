"""Pendulum: a body that swings about a fixed point, as wide as it likes, or turns over the top.

With θ from straight down, θ̈ = −Ω² sin θ, and k² = sin²(θ₀/2) + (θ̇₀/2Ω)² is its energy as a share of what takes it to
the top. Below 1 it swings: sin(θ/2) = k sn(Ωt + u₀, k). Above, it turns over: θ/2 = am(kΩt + u₀, 1/k).
Source: Abramowitz & Stegun 1964, 16 and 17; the period 4 K(k)/Ω.
"""

import math
from dataclasses import dataclass

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.measure.closed_form.elliptic import first_kind, jacobi, quarter_period
from sandbox.measure.closed_form.form import Motion
from sandbox.measure.closed_form.given import SQUARE, Given, Tie, cross, direction
from sandbox.scene.compile.joint_arrays import LinkKind
from sandbox.trajectory import ContactEvent


@dataclass(frozen=True, eq=False)
class Swing:
    """The angle of a pendulum from straight down, counter-clockwise."""

    start: float
    """rad, from −π to π"""
    half: tuple[float, float]
    """sine and cosine of half of it, each to rounding"""
    rate: float
    """at time 0, rad/s"""
    frequency: float
    """Ω, of small swings, rad/s; 0 without gravity"""

    @property
    def modulus(self) -> tuple[float, float]:
        """k² and 1 − k², negative where it turns over."""
        kick = (self.rate / (2.0 * self.frequency)) ** 2
        sine, cosine = self.half
        return sine * sine + kick, cosine * cosine - kick

    @property
    def period(self) -> float:
        """s, of a swing to and fro, or once over the top; inf where it never comes back, or never leaves."""
        if self.frequency == 0.0:
            return 2.0 * math.pi / abs(self.rate) if self.rate else math.inf
        m, m1 = self.modulus
        if m1 < 0.0:
            return 2.0 * quarter_period(-m1 / m) / (math.sqrt(m) * self.frequency)
        return 4.0 * quarter_period(m1) / self.frequency if m > 0.0 else math.inf

    def at(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the angle, which counts turns, and its rate at T times."""
        if self.frequency == 0.0:
            return self.start + self.rate * time, np.full(len(time), self.rate)
        (sine, cosine), (m, m1) = self.half, self.modulus
        k, u = math.sqrt(m), self.frequency * time
        if m == 0.0:
            return np.zeros(len(time)), np.zeros(len(time))
        if m1 < 0.0:
            way = math.copysign(1.0, self.rate)
            inner = 1.0 / m, -m1 / m
            found = jacobi(way * k * u + first_kind(sine, cosine, *inner), *inner)
            return 2.0 * found.amplitude, (2.0 * self.frequency * k * way) * found.dn
        begin = first_kind(sine / k, self.rate / (2.0 * self.frequency * k), m, m1)
        found = jacobi(u + begin, m, m1)
        return 2.0 * np.arctan2(k * found.sn, found.dn), (2.0 * self.frequency * k) * found.cn


@dataclass(frozen=True, eq=False)
class Pendulum:
    """One body that swings."""

    swing: Swing
    place: FloatArray
    """(2,) m, about which"""
    length: float
    """from there to the centre of mass, m"""
    down: FloatArray
    """(2,) of length 1, where gravity points; without gravity, anywhere"""
    angle: float
    """of the body at time 0, rad"""
    spin: float | None
    """rad/s, which nothing changes; None where the body turns as it swings"""
    name: str = "a pendulum"

    def at(self, time: FloatArray) -> Motion:
        """Return its motion at T times."""
        theta, rate = self.swing.at(time)
        aside = np.asarray([-self.down[1], self.down[0]])
        sine, cosine = np.sin(theta)[:, None], np.cos(theta)[:, None]
        position = self.place + self.length * (cosine * self.down + sine * aside)
        velocity = (self.length * rate)[:, None] * (cosine * aside - sine * self.down)
        if self.spin is None:
            return Motion(position, velocity, self.angle + (theta - self.swing.start), rate)
        return Motion(position, velocity, self.angle + self.spin * time, np.full(len(time), self.spin))

    def contacts(self, _until: float, _shortest: float) -> list[ContactEvent]:
        """Return none: it meets nothing."""
        return []


def pendulum(given: Given, number: int) -> Pendulum | None:
    """Return the swing of a body by a rod at its centre, or by a pivot off it, about a place that never moves.

    It meets nothing, there is no drag, nothing else draws, drives or holds it, and it starts as it is held: a rod at
    its length, and nothing moving that the joint forbids.
    """
    if not given.untouched(number) or not given.meet.held[number] or given.scene.attractions or not given.airless:
        return None
    tie = given.tie(number)
    if tie is None:
        return None
    bodies = given.bodies
    arm, velocity = bodies.position[number] - tie.place, bodies.velocity[number]
    length, spin = math.hypot(*arm), float(bodies.angular_velocity[number])
    if length == 0.0:
        return None
    rate = cross(arm, velocity) / length**2
    # What is left when the swing is taken off must be nothing.
    stray = velocity - rate * np.asarray([-arm[1], arm[0]])
    if math.hypot(*stray) > SQUARE * math.hypot(*velocity):
        return None
    moment = _moment(given, number, tie, arm, rate)
    if moment is None:
        return None

    pull = math.hypot(*given.gravity)
    down = direction(given.gravity) if pull > 0.0 else direction(arm)
    frequency = math.sqrt(float(bodies.mass[number]) * pull * length / moment)
    own_spin = spin if tie.kind == LinkKind.ROD else None
    theta, half = _halved(down, arm / length)
    return Pendulum(Swing(theta, half, rate, frequency), tie.place, length, down, float(bodies.angle[number]), own_spin)


def _moment(given: Given, number: int, tie: Tie, arm: FloatArray, rate: float) -> float | None:
    """Return the moment of inertia about the fixed point, kg·m²; None where the joint makes no pendulum."""
    bodies, length = given.bodies, math.hypot(*arm)
    size = length + float(np.abs(tie.place).max())  # what coordinates round by
    if tie.kind == LinkKind.ROD:
        if tie.arm.any() or abs(float(tie.figures[0]) - length) > SQUARE * size:
            return None
        return float(bodies.mass[number]) * length**2
    if tie.kind != LinkKind.PIVOT:
        return None
    cos, sin = math.cos(bodies.angle[number]), math.sin(bodies.angle[number])
    held = np.asarray([cos * tie.arm[0] - sin * tie.arm[1], sin * tie.arm[0] + cos * tie.arm[1]])
    if math.hypot(*(arm + held)) > SQUARE * size:
        return None
    spin = float(bodies.angular_velocity[number])
    if abs(spin - rate) > SQUARE * abs(spin):
        return None
    return float(bodies.moment[number] + bodies.mass[number] * length**2)


def _halved(down: FloatArray, towards: FloatArray) -> tuple[float, tuple[float, float]]:
    """Return the angle from down, and sine and cosine of its half, without loss near the top or the bottom."""
    sine, cosine = cross(down, towards), float(down @ towards)
    if cosine > 0.0:
        half_cosine = math.sqrt(0.5 * (1.0 + cosine))
        half = 0.5 * sine / half_cosine, half_cosine
    else:
        half_sine = math.copysign(math.sqrt(0.5 * (1.0 - cosine)), sine)
        half = half_sine, 0.5 * sine / half_sine
    return math.atan2(sine, cosine), half
