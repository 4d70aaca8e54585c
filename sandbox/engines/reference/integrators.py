"""Fixed-step integrators, the state vector x, and its derivative ẋ = f(t, x, u).

INTEGRATORS is the table of integrators. Each is a function step(f, t, x, u, h) -> x' from the state at t to that at
t + h; f is the state transition function. Errors for a projectile after a time T, and for an oscillator of angular
frequency ω:

| name | projectile, position | oscillator |
|---|---|---|
| explicit_euler | +g·h·T/2 | gains energy, (1 + ω²h²) a step |
| semi_implicit_euler | −g·h·T/2 | in a band, ωh < 2 |
| velocity_verlet, leapfrog | exact | in a band, frequency (2/h)·asin(ωh/2), ωh < 2 |
| rk4 | exact | loses (ωh)⁶/72 of its energy a step, ωh < 2√2 |

x is an array (2, N, D): x[0] the poses, x[1] their rates. D is 2 (x, y) if nothing turns, else 3 (x, y, angle). u
contains the external forces: gravity, air, constant forces, and penalty contacts with `response = "penalty"`.
"""

from collections.abc import Callable
from math import log2
from typing import NamedTuple, TypeAlias, cast, get_args

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.echo import short_repr
from sandbox.engines.forces.air import Air, air_accelerations
from sandbox.scene.description.world import ADDED_INTEGRATORS, IntegratorName

State: TypeAlias = FloatArray
"""(2, N, D) poses, m and rad, and rates, m/s and rad/s"""


_ALL = np.ones((1, 1))


class Inputs(NamedTuple):
    """u: the forces on N bodies during one substep."""

    constant: FloatArray
    """(N, D) acceleration by gravity, constant forces and torques, m/s² and rad/s²; 0 for fixed bodies"""
    air: Air = Air()
    """forces that depend on velocity"""
    mobile: FloatArray = _ALL
    """(N, 1) or (1, 1): 1 for bodies that the air affects, 0 for fixed or removed ones"""
    contacts: Callable[[State], FloatArray] | None = None
    """penalty contacts: acceleration (N, D) in a state"""
    forces: tuple[Callable[[float, State], FloatArray], ...] = ()
    """springs, attraction, thrusts and liquids: acceleration (N, D) of each as a function of time and state"""
    damped_forces: bool = False
    """whether one of these forces depends on velocity"""

    @property
    def damped(self) -> bool:
        """Whether acceleration depends on velocity, so that a scheme has to evaluate it at the right velocity."""
        return self.air.acts or self.damped_forces or self.contacts is not None


Transition: TypeAlias = Callable[[float, State, Inputs], State]
"""ẋ = f(t, x, u)"""


def transition(t: float, x: State, u: Inputs) -> State:
    """Return ẋ: the rates, and the accelerations by constant forces, air, other forces and penalty contacts.

    Args:
        t: s.
        x: (2, N, D).
        u: external forces.

    Returns:
        (2, N, D).
    """
    derivative = np.empty_like(x)
    derivative[0] = x[1]
    derivative[1] = u.constant
    if u.air.acts:
        derivative[1] += u.mobile * air_accelerations(u.air, x[1])
    for force in u.forces:
        derivative[1] += force(t, x)
    if u.contacts is not None:
        derivative[1] += u.contacts(x)
    return derivative


class Tableau(NamedTuple):
    """An explicit Runge–Kutta method of s stages."""

    a: tuple[tuple[float, ...], ...]
    """row i contains the weights of the slopes before stage i"""
    b: tuple[float, ...]
    """(s,) weights of the slopes in the step; they sum to 1"""
    c: tuple[float, ...]
    """(s,) time of each stage as a fraction of the step; the sum of its row of `a`"""


EULER = Tableau(a=((),), b=(1.0,), c=(0.0,))

CLASSIC_4 = Tableau(
    a=((), (0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)),
    b=(1 / 6, 1 / 3, 1 / 3, 1 / 6),
    c=(0.0, 0.5, 0.5, 1.0),
)
"""The classic method of fourth order, Kutta 1901."""


def runge_kutta(table: Tableau) -> Callable[[Transition, float, State, Inputs, float], State]:
    """Return the step function of a table: kᵢ = f(t + cᵢ h, x + h Σ aᵢⱼ kⱼ, u), x ← x + h Σ bᵢ kᵢ."""

    def step(f: Transition, t: float, x: State, u: Inputs, h: float) -> State:
        slopes: list[State] = []
        for weights, c in zip(table.a, table.c, strict=True):
            slopes.append(f(t + c * h, _moved(x, h, weights, slopes), u))
        return _moved(x, h, table.b, slopes)

    return step


def _moved(x: State, h: float, weights: tuple[float, ...], slopes: list[State]) -> State:
    """Return x + h Σ wⱼ kⱼ."""
    total: State | None = None
    for weight, slope in zip(weights, slopes, strict=True):
        if weight:
            term = slope if weight == 1.0 else weight * slope
            total = term if total is None else total + term
    return x if total is None else np.asarray(x + h * total)


Step = Callable[[Transition, float, State, Inputs, float], State]


class Integrator(NamedTuple):
    """Integration scheme, with the properties that a contact solver needs."""

    step: Step
    order: int
    """order: the global error decreases as h to this power, with drag too"""
    fraction: float
    """Fraction of a velocity change that the positions of the same step include: x' moves by fraction·h·Δv if the
    velocity change within the step changes by Δv. 0 if positions move before it, 1 if after it, ½ if in the middle."""


def semi_implicit_euler(f: Transition, t: float, x: State, u: Inputs, h: float) -> State:
    """Kick, then drift with the new velocity: symplectic, first order. Box2D's scheme."""
    moved = np.empty_like(x)
    moved[1] = x[1] + h * f(t, x, u)[1]
    moved[0] = x[0] + h * moved[1]
    return moved


def velocity_verlet(f: Transition, t: float, x: State, u: Inputs, h: float) -> State:
    """Kick half, drift, kick half: symplectic, second order (Swope et al. 1982).

    Where acceleration depends on velocity, the second kick sees the velocity that the first predicts, as in Heun's
    method: that keeps the order.
    """
    kick = f(t, x, u)[1]
    moved = np.empty_like(x)
    moved[0] = x[0] + h * (x[1] + (0.5 * h) * kick)
    moved[1] = x[1] + h * kick
    moved[1] = x[1] + (0.5 * h) * (kick + f(t + h, moved, u)[1])
    return moved


def leapfrog(f: Transition, t: float, x: State, u: Inputs, h: float) -> State:
    """Drift half, kick, drift half (position Verlet): symplectic, second order.

    Where acceleration depends on velocity, the kick is that of the velocity in mid-step (midpoint rule).
    """
    middle = np.empty_like(x)
    middle[0] = x[0] + (0.5 * h) * x[1]
    middle[1] = x[1]
    kick = f(t + 0.5 * h, middle, u)[1]
    if u.damped:
        middle[1] = x[1] + (0.5 * h) * kick
        kick = f(t + 0.5 * h, middle, u)[1]
    moved = np.empty_like(x)
    moved[1] = x[1] + h * kick
    moved[0] = middle[0] + (0.5 * h) * moved[1]
    return moved


INTEGRATORS: dict[IntegratorName, Integrator] = {
    # The tutorial's: drift by the old velocity, then kick. pymunk's too, in free flight bit for bit.
    "explicit_euler": Integrator(runge_kutta(EULER), order=1, fraction=0.0),
    "semi_implicit_euler": Integrator(semi_implicit_euler, order=1, fraction=1.0),
    "velocity_verlet": Integrator(velocity_verlet, order=2, fraction=0.5),
    "leapfrog": Integrator(leapfrog, order=2, fraction=0.5),
    "rk4": Integrator(runge_kutta(CLASSIC_4), order=4, fraction=0.5),
}


STEP_COUNTS = ((8, 16), (4, 8), (2, 4), (1, 2))
"""Numbers of steps of two runs that are compared: the first pair whose errors are not those of rounding"""
ROUNDING = 1e-13
"""Error of a state of about 1 that rounding may cause"""


def add_integrator(step: Step, name: str | None = None) -> IntegratorName:
    """Add an integrator of one's own to the engine `reference`, for this process; the same name replaces it.

    Settings, `run`, `compare` and `integrate` accept its name from then on. The order and `fraction` are measured on an
    oscillator and a fall. Steps with it are not compiled.

    Args:
        step: function step(f, t, x, u, h) that returns the state after a step h, s; f(t, x, u) is the derivative of the
            state x, whose x[0] are positions and x[1] velocities, of any shape. It must not change x.
        name: name in settings; default: that of the function. Files of runs can be read where it has been added.

    Returns:
        The name.

    Raises:
        ValueError: the name is that of a built-in integrator or not an identifier, or the function does not return a
            finite state of the shape and type of x, changes x, does not converge, or has no error to measure.

    Example:
        >>> def midpoint(f, t, x, u, h):
        ...     return x + h * f(t + h / 2, x + h / 2 * f(t, x, u), u)
        >>> sandbox.add_integrator(midpoint)
        'midpoint'
        >>> sandbox.run("spring", engine="reference", integrator="midpoint").status
        'ok'
    """
    name = getattr(step, "__name__", "") if name is None else name
    is_identifier = isinstance(name, str) and name.isidentifier()
    if name in get_args(IntegratorName) or not is_identifier:
        problem = "is a built-in integrator" if is_identifier else "is not an identifier"
        raise ValueError(f"name: {short_repr(name)} {problem}; choose another name, such as 'my_step'")
    integrator = Integrator(step, _measured_order(step, name), _measured_fraction(step, name))
    added = cast("IntegratorName", name)  # settings accept it from now on
    INTEGRATORS[added] = integrator
    ADDED_INTEGRATORS.add(name)
    return added


def _measured_order(step: Step, name: str) -> int:
    """Return the order of convergence on an oscillator of 1 rad/s after 1 s, without and with damping.

    Raises:
        ValueError: the error does not decrease with the step.
    """
    orders = []
    for damping in (0.0, 0.3):
        for counts in STEP_COUNTS:
            errors = [_oscillator_error(step, name, damping, count) for count in counts]
            if errors[1] > ROUNDING:
                break
        else:
            if errors[0] < ROUNDING:
                raise ValueError(f"{name} is exact on an oscillator, so that its order cannot be measured")
        orders.append(log2(errors[0] / errors[1]) if min(errors) > 0.0 else 0.0)
    order = round(min(orders))
    if order < 1:
        raise ValueError(
            f"{name} does not converge: half the step changes the error by a factor of {2 ** -min(orders):.2g}"
        )
    return order


def _oscillator_error(step: Step, name: str, damping: float, count: int) -> float:
    """Return the distance of an oscillator of 1 rad/s from its exact state after 1 s, in phase space."""

    def oscillator(_: float, x: State, __: Inputs) -> State:
        return np.stack((x[1], -x[0] - 2.0 * damping * x[1]))

    frequency = (1.0 - damping**2) ** 0.5
    decay, sine = np.exp(-damping), np.sin(frequency) / frequency
    exact = decay * (np.cos(frequency) + damping * sine), -decay * sine
    x = np.array([[[1.0]], [[0.0]]])
    for k in range(count):
        x = _checked(step, name, oscillator, k / count, x, 1.0 / count)
    return float(np.hypot(x[0, 0, 0] - exact[0], x[1, 0, 0] - exact[1]))


def _measured_fraction(step: Step, name: str) -> float:
    """Return `Integrator.fraction`: the position after a step from rest under the acceleration 1, for a step of 1."""
    moved = _checked(step, name, lambda _, x, __: np.stack((x[1], np.ones_like(x[1]))), 0.0, np.zeros((2, 1, 1)), 1.0)
    return float(moved[0, 0, 0])


def _checked(step: Step, name: str, f: Transition, t: float, x: State, h: float) -> State:
    """Return the state after a step.

    Raises:
        ValueError: it is not a finite state, or the function changed the state before.
    """
    before = x.copy()
    moved = step(f, t, x, Inputs(np.zeros((1, 1))), h)
    is_state = isinstance(moved, np.ndarray) and (moved.shape, moved.dtype) == (x.shape, x.dtype)
    if not is_state or not np.isfinite(moved).all():
        raise ValueError(
            f"{name} returns {short_repr(moved)}; an array of shape {x.shape} and type {x.dtype} with finite numbers "
            "is expected"
        )
    if not np.array_equal(x, before):
        raise ValueError(f"{name} changes x; it must return a new array")
    return moved


def amplification(step: Step, frequency: float, damping: float, h: float) -> float:
    """Return by how much a step of a scheme can stretch a damped oscillator: the spectral radius of its matrix.

    ẍ = −ω² x − 2ζω ẋ. The scheme is linear in it, so that its steps from (1, 0) and (0, 1) are the matrix's columns.
    Above 1, amplitudes grow without bound.

    Args:
        step: the scheme.
        frequency: ω, rad/s.
        damping: ζ, as a part of the critical.
        h: step, s.
    """

    def spring(_: float, x: State, __: Inputs) -> State:
        return np.stack((x[1], -(frequency**2) * x[0] - 2.0 * damping * frequency * x[1]))

    # Any penalty contact makes `damped` true, so that the scheme treats the velocity as it would in a contact.
    u = Inputs(np.zeros((2, 1)), contacts=lambda x: np.zeros_like(x[0]))
    unit = np.array([[[1.0], [0.0]], [[0.0], [1.0]]])  # two oscillators: at 1 at rest, at 0 with speed 1
    scaled = unit * np.array([1.0, frequency])[:, None, None]  # in units in which the matrix is well conditioned
    moved = step(spring, 0.0, scaled, u, h) / np.array([1.0, frequency])[:, None, None]
    return float(np.abs(np.linalg.eigvals(moved[:, :, 0])).max())
