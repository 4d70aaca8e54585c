"""Kepler orbit about a fixed point that attracts with the inverse square of the distance.

Position and velocity are combinations f x₀ + g v₀ of those at the start; f and g follow from the change of the
eccentric anomaly, which Kepler's equation gives. Source: Battin 1999, "An Introduction to the Mathematics and Methods
of Astrodynamics", 4.3.
"""

import math
from dataclasses import dataclass

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.measure.analytic.model import BodyMotion, SceneFacts
from sandbox.trajectory import ContactEvent

PARABOLIC = 1e-6
"""Orbits with |r/a| up to this are refused: the ellipse or hyperbola is so long that its anomalies lose their digits.
"""
RADIAL = 1e-6
"""Orbits with an angular momentum up to this fraction of r·v are refused: the body falls into the centre."""
MAX_ITERATIONS = 100
"""Newton's method with a bisection bracket converges within about ten steps; 100 bisections reach rounding."""


@dataclass(frozen=True, eq=False)
class Kepler:
    """Orbit of one body."""

    focus: FloatArray
    """(2,) m"""
    position: FloatArray
    """(2,) m, from the focus, at time 0"""
    velocity: FloatArray
    """(2,) m/s, at time 0"""
    strength: float
    """G·M, m³/s²"""
    angle: float
    """at time 0, rad"""
    spin: float
    """rad/s, constant"""
    name: str = "an orbit"

    @property
    def half_axis(self) -> float:
        """Semi-major axis a, m; negative for a hyperbola."""
        return 1.0 / (2.0 / math.hypot(*self.position) - float(self.velocity @ self.velocity) / self.strength)

    @property
    def period(self) -> float:
        """Period, s; inf for a hyperbola."""
        a = self.half_axis
        return 2.0 * math.pi * math.sqrt(a**3 / self.strength) if a > 0.0 else math.inf

    def at(self, time: FloatArray) -> BodyMotion:
        """Return its motion at T times."""
        r0, a, mu = math.hypot(*self.position), self.half_axis, self.strength
        bound, size = a > 0.0, abs(a)
        rising = float(self.position @ self.velocity) / math.sqrt(mu * size)
        mean = math.sqrt(mu / size) / size * (np.fmod(time, self.period) if bound else time)
        anomaly = _ellipse(mean, r0 / size, rising) if bound else _hyperbola(mean, r0 / size, rising)

        # 1 − cos E or cosh H − 1, from half the angle: no cancellation where little time has passed.
        if bound:
            sine, rest = np.sin(anomaly), 2.0 * np.sin(0.5 * anomaly) ** 2
            r = r0 + (size - r0) * rest + size * rising * sine
        else:
            sine, rest = np.sinh(anomaly), 2.0 * np.sinh(0.5 * anomaly) ** 2
            r = r0 + (size + r0) * rest + size * rising * sine
        f = 1.0 - size / r0 * rest
        g = math.sqrt(size / mu) * (r0 * sine + size * rising * rest)
        f_rate, g_rate = -math.sqrt(mu * size) / (r * r0) * sine, 1.0 - size / r * rest
        position = self.focus + f[:, None] * self.position + g[:, None] * self.velocity
        velocity = f_rate[:, None] * self.position + g_rate[:, None] * self.velocity
        return BodyMotion(position, velocity, self.angle + self.spin * time, np.full(len(time), self.spin))

    def contacts(self, _until: float, _shortest: float) -> list[ContactEvent]:
        """Return no contacts."""
        return []


def kepler(facts: SceneFacts, number: int) -> Kepler | None:
    """Return the orbit of a body about the only attraction; None if another force acts on it.

    There are no gravity, drag, softening, contacts or joints. The body neither falls straight into the centre nor has
    almost exactly the escape velocity.
    """
    scene, bodies = facts.scene, facts.bodies
    if not facts.moves_freely(number) or facts.matrix.held[number] or len(scene.attractions) != 1:
        return None
    sun = scene.attractions[0]
    if sun.strength <= 0.0 or sun.softening > 0.0 or facts.gravity.any() or not facts.has_no_air:
        return None
    if isinstance(sun.toward, str):
        which = bodies.names.index(sun.toward)
        if which == number or not bodies.fixed[which]:
            return None
        focus = bodies.position[which]
    else:
        focus = np.asarray(sun.toward, dtype=np.float64)
    arm, velocity = bodies.position[number] - focus, bodies.velocity[number]
    r, speed = math.hypot(*arm), math.hypot(*velocity)
    turning = abs(float(arm[0] * velocity[1] - arm[1] * velocity[0]))
    if r == 0.0 or speed == 0.0 or turning <= RADIAL * r * speed or abs(2.0 - r * speed**2 / sun.strength) <= PARABOLIC:
        return None
    spin = float(bodies.angular_velocity[number])
    return Kepler(focus, arm, velocity, sun.strength, float(bodies.angle[number]), spin)


def _ellipse(mean: FloatArray, r: float, rising: float) -> FloatArray:
    """Solve E − (1 − r) sin E + rising (1 − cos E) = mean, for mean from 0 to 2π, (T,)."""
    low, high = np.zeros_like(mean), np.full_like(mean, 2.0 * math.pi)
    found = mean.copy()
    for _ in range(MAX_ITERATIONS):
        sine, cosine = np.sin(found), np.cos(found)
        excess = found - (1.0 - r) * sine + rising * (1.0 - cosine) - mean
        found, low, high, still = _bracketed_newton(found, low, high, excess, 1.0 - (1.0 - r) * cosine + rising * sine)
        if still:
            break
    return found


def _hyperbola(mean: FloatArray, r: float, rising: float) -> FloatArray:
    """Solve (1 + r) sinh H + rising (cosh H − 1) − H = mean, for mean ≥ 0, (T,)."""

    def excess_of(anomaly: FloatArray) -> FloatArray:
        return np.asarray((1.0 + r) * np.sinh(anomaly) + rising * (np.cosh(anomaly) - 1.0) - anomaly - mean)

    low, high = np.zeros_like(mean), np.ones_like(mean)
    while (excess_of(high) < 0.0).any():
        high = np.where(excess_of(high) < 0.0, 2.0 * high, high)
    found = high.copy()
    for _ in range(MAX_ITERATIONS):
        slope = (1.0 + r) * np.cosh(found) + rising * np.sinh(found) - 1.0
        found, low, high, still = _bracketed_newton(found, low, high, excess_of(found), slope)
        if still:
            break
    return found


def _bracketed_newton(
    found: FloatArray, low: FloatArray, high: FloatArray, excess: FloatArray, slope: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, bool]:
    """Make one step of Newton's method, or a bisection if that would leave the bracket.

    Returns the solution, the bracket, and whether the solution has converged.
    """
    high, low = np.where(excess > 0.0, found, high), np.where(excess <= 0.0, found, low)
    with np.errstate(divide="ignore", invalid="ignore"):
        step = found - excess / slope
    better = np.where((step >= low) & (step <= high), step, 0.5 * (low + high))
    still = bool((np.abs(better - found) <= 2e-16 * np.maximum(np.abs(found), 1e-300)).all())
    return better, low, high, still
