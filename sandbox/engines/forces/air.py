"""Forces of the air on a body, drag and lift, and the damping of its velocities, by the world and of its own.

With w = v − wind, the velocity through the air, a body gets the accelerations

    a = −(k + c |w|) w + s ω ẑ × w − (λ + λᵥ) v,    α = −(λ + λᵣ) ω,

λ being the rate of the world's damping, λᵥ and λᵣ those of the body.

`air_law` is that sum, for one body and for arrays of bodies alike. Their power is m a·v + I α ω. Lift turns w at the
rate s ω and does no work in still air; it raises a ball with backspin (Magnus effect).

A step that holds the complex rate κ = k + c |w| + λᵥ − i s ω constant solves ẇ = b − κ w exactly, with vectors as
complex numbers and b less by λᵥ wind: `mean_acceleration`, the exponential Euler step (Hochbruck & Ostermann 2010, eq.
2.1). It is exact in velocity for linear drag and lift, and of first order for quadratic drag; the terminal velocity is
exact, lift alone keeps the speed, and it is stable at any h. Forces that balance each other, springs and thrusts among
them, balance exactly at any h.
"""

from typing import Any, NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, ComplexArray, FloatArray, IntArray, Number
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.world import World

BodyRows = int | slice | IntArray
"""One body, or some of them"""

ALL = slice(None)

NO_LIFT: FloatArray = np.zeros(1)
NO_DAMPING: FloatArray = np.zeros(1)


class Air(NamedTuple):
    """Coefficients of the forces that depend on velocity."""

    linear_drag: float = 0.0
    """k, 1/s"""
    quadratic_drag: float = 0.0
    """c, 1/m"""
    damping_rate: float = 0.0
    """λ, 1/s"""
    wind_x: float = 0.0
    """m/s"""
    wind_y: float = 0.0
    """m/s"""
    lift: FloatArray = NO_LIFT
    """(N,) s of each body; (1,) for bodies without lift"""
    depends_on_spin: bool = False
    """whether a body has lift"""
    linear_damping: FloatArray = NO_DAMPING
    """(N,) λᵥ of each body, 1/s; (1,) for bodies without"""
    angular_damping: FloatArray = NO_DAMPING
    """(N,) λᵣ of each body, 1/s; likewise"""
    damps_bodies: bool = False
    """whether a body has damping of its own"""

    @classmethod
    def of(cls, world: World, bodies: Bodies | None = None, among: BoolArray | IntArray | slice = ALL) -> "Air":
        """Return the air of a world for some of its bodies; without bodies, for one without lift and damping."""
        numbers = world.linear_drag, world.quadratic_drag, world.damping_rate, *world.wind
        if bodies is None:
            return cls(*numbers)
        linear, angular = bodies.linear_damping, bodies.angular_damping
        damps = bool(linear[among].any() or angular[among].any())
        return cls(*numbers, bodies.lift, bool(bodies.lift[among].any()), linear, angular, damps)

    def for_rows(self, count: int) -> "Air":
        """Return the air for more rows than there are bodies; those have neither lift nor damping."""
        padded = np.zeros((3, count))
        for row, values in zip(padded, (self.lift, self.linear_damping, self.angular_damping), strict=True):
            row[: len(values)] = values
        return self._replace(lift=padded[0], linear_damping=padded[1], angular_damping=padded[2])

    @property
    def flows(self) -> bool:
        """Whether a force depends on the velocity through the air."""
        return self.linear_drag > 0.0 or self.quadratic_drag > 0.0 or self.depends_on_spin

    @property
    def acts(self) -> bool:
        """Whether there is any of these forces."""
        return self.acts_by_force or self.damping_rate > 0.0

    @property
    def acts_by_force(self) -> bool:
        """Whether there is any of them besides the world's damping, which some engines have built in."""
        return self.flows or self.damps_bodies

    @property
    def is_linear(self) -> bool:
        """Whether x and y are independent of each other."""
        return self.quadratic_drag == 0.0 and not self.depends_on_spin


def air_law(
    air: Air, rows: BodyRows, wx: Number, wy: Number, speed: Number, vx: Number, vy: Number, spin: Number
) -> tuple[Number, Number, Number]:
    """Return the acceleration (x, y), m/s², and the angular acceleration, rad/s².

    For one body, and for some at once: then all numbers are arrays.

    Args:
        air: coefficients.
        rows: the bodies.
        wx: velocity through the air, m/s.
        wy: likewise.
        speed: its length, m/s.
        vx: velocity, m/s.
        vy: likewise.
        spin: rad/s.
    """
    lift: Any = air.lift[rows]
    damping: Any = air.damping_rate + air.linear_damping[rows]
    angular_damping: Any = air.damping_rate + air.angular_damping[rows]
    rate, turning = air.linear_drag + air.quadratic_drag * speed, lift * spin
    ax = -rate * wx - turning * wy - damping * vx
    ay = -rate * wy + turning * wx - damping * vy
    return ax, ay, -angular_damping * spin


def air_accelerations(air: Air, rate: FloatArray) -> FloatArray:
    """Return the accelerations (N, D), m/s² and rad/s², at rates (N, D), m/s and rad/s; D is 2, or 3 with spins."""
    vx, vy = rate[:, 0], rate[:, 1]
    spin = rate[:, 2] if rate.shape[1] == 3 else np.zeros(len(rate))
    wx, wy = vx - air.wind_x, vy - air.wind_y
    accelerations: FloatArray = np.column_stack(air_law(air, ALL, wx, wy, np.sqrt(wx * wx + wy * wy), vx, vy, spin))
    return accelerations[:, : rate.shape[1]]


def mean_acceleration(
    air: Air,
    rows: slice | IntArray,
    gravity: tuple[float, float] | FloatArray,
    velocity: FloatArray,
    spin: FloatArray,
    applied: FloatArray | None,
    h: float,
) -> FloatArray:
    """Return the mean acceleration (M, 2), m/s², of the next step of h under drag, lift, damping and constant forces.

    Args:
        air: coefficients; the world's damping is left to the engine.
        rows: the M bodies.
        gravity: (2,) for all, or (M, 2) for each, m/s².
        velocity: (M, 2) m/s.
        spin: (M,) rad/s.
        applied: (M, 2) m/s², acceleration by other forces, or None.
        h: step, s.
    """
    rate = rates(air, rows, velocity, spin)
    total = np.asarray(gravity) - scaled(velocity - (air.wind_x, air.wind_y), rate)
    if air.damps_bodies:  # it acts on the velocity, and not on that through the air
        total -= air.linear_damping[rows][:, None] * np.asarray((air.wind_x, air.wind_y))
    if applied is not None:
        total += applied
    return scaled(total, mean_fraction(rate, h))


def mean_angular_acceleration(
    air: Air, rows: slice | IntArray, spin: FloatArray, applied: FloatArray, h: float
) -> FloatArray:
    """Return the mean angular acceleration (M,), rad/s², of the next step of h under damping and constant torques.

    Args:
        air: coefficients; the world's damping is left to the engine.
        rows: the M bodies.
        spin: (M,) rad/s.
        applied: (M,) rad/s², angular acceleration by torques.
        h: step, s.
    """
    rate = air.angular_damping[rows]
    return np.asarray((applied - rate * spin) * mean_fraction(rate, h))


def rates(air: Air, rows: slice | IntArray, velocity: FloatArray, spin: FloatArray) -> FloatArray | ComplexArray:
    """Return κ of M bodies, 1/s, at velocities (M, 2), m/s, and spins (M,), rad/s: (M,), complex with lift."""
    relative = velocity - (air.wind_x, air.wind_y)
    drag: FloatArray = air.linear_drag + air.quadratic_drag * np.hypot(relative[:, 0], relative[:, 1])
    if air.damps_bodies:
        drag += air.linear_damping[rows]
    return drag - 1j * (air.lift[rows] * spin) if air.depends_on_spin else drag


def mean_fraction(rate: FloatArray | ComplexArray, h: float) -> FloatArray | ComplexArray:
    """Return (1 − e^(−κh))/(κh) for rates κ (M,), 1/s: a step's mean acceleration as a fraction of its first."""
    z = rate * h
    # expm1 avoids cancellation near 0; where z is 0 the fraction is 1.
    fraction: FloatArray | ComplexArray = np.divide(-np.expm1(-z), z, out=np.ones_like(z), where=np.abs(z) > 0)
    return fraction


def scaled(vectors: FloatArray, factors: FloatArray | ComplexArray) -> FloatArray:
    """Return vectors (M, 2) times factors (M,); complex ones turn them too."""
    if not np.iscomplexobj(factors):
        return np.asarray(vectors * factors[:, None])
    products = (vectors[:, 0] + 1j * vectors[:, 1]) * factors
    return np.column_stack((products.real, products.imag))
