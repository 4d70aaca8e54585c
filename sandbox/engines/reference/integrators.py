"""Integrators: one function each, from the state at t to the state at t + h. INTEGRATORS is the table of them.

Each takes the state transition function as an argument: step(f, t, x, u, h) -> x'. Errors for a projectile after a
time T, and for an oscillator of angular frequency ω:

| name | projectile, position | oscillator |
|---|---|---|
| explicit_euler | +g·h·T/2 | gains energy, (1 + ω²h²) a step |
| semi_implicit_euler | −g·h·T/2 | in a band, ωh < 2 |
| velocity_verlet, leapfrog | exact | in a band, frequency (2/h)·asin(ωh/2), ωh < 2 |
| rk4 | exact | loses (ωh)⁶/72 of its energy a step, ωh < 2√2 |
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sandbox.engines.reference.motion import Inputs, State, Transition
from sandbox.engines.reference.tableau import CLASSIC_4, EULER, runge_kutta

Step = Callable[[Transition, float, State, Inputs, float], State]


class Integrator(NamedTuple):
    """A scheme, and what a contact solver must know of it."""

    step: Step
    order: int
    """Global error falls as h to this power, with drag too."""
    share: float
    """The part of a kick that the same step's positions already have: x' moves by share·h·Δv when a kick within the
    step is changed by Δv. 0 where positions move before the kick, 1 where after it, ½ where in the middle."""


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


INTEGRATORS: dict[str, Integrator] = {
    # The tutorial's: drift by the old velocity, then kick. pymunk's too, in free flight bit for bit.
    "explicit_euler": Integrator(runge_kutta(EULER), order=1, share=0.0),
    "semi_implicit_euler": Integrator(semi_implicit_euler, order=1, share=1.0),
    "velocity_verlet": Integrator(velocity_verlet, order=2, share=0.5),
    "leapfrog": Integrator(leapfrog, order=2, share=0.5),
    "rk4": Integrator(runge_kutta(CLASSIC_4), order=4, share=0.5),
}


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
