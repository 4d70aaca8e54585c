"""Motion: the state vector x of a scene, and the state transition function ẋ = f(t, x, u).

x is one array (2, N, D): x[0] the poses, x[1] their rates. D is 2 (x, y) where nothing turns, else 3 (x, y, angle).
u is what acts on it from outside: gravity, air, steady forces, and penalty contacts where those are chosen.
"""

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np

from sandbox.trajectory import FloatArray

State: TypeAlias = FloatArray
"""(2, N, D) poses, m and rad, and rates, m/s and rad/s"""


_ALL = np.ones((1, 1))


class Inputs(NamedTuple):
    """u: all that acts on N bodies during one substep."""

    steady: FloatArray
    """(N, D) acceleration by gravity, steady forces and torques, m/s² and rad/s²; 0 for what is fixed"""
    linear_drag: float = 0.0
    """1/s"""
    quadratic_drag: float = 0.0
    """1/m"""
    wind: tuple[float, float] = (0.0, 0.0)
    """m/s"""
    mobile: FloatArray = _ALL
    """(N, 1) or (1, 1): 1 for what air can brake, 0 for what is fixed or gone"""
    contacts: Callable[[State], FloatArray] | None = None
    """Penalty contacts: the acceleration (N, D) that they add in a state."""
    forces: tuple[Callable[[float, State], FloatArray], ...] = ()
    """What else acts, by time and state: springs, attraction, thrusts; the acceleration (N, D) that each adds."""
    rubbing: bool = False
    """Some of these forces depend on velocity."""

    @property
    def dragged(self) -> bool:
        """There is drag."""
        return self.linear_drag > 0.0 or self.quadratic_drag > 0.0

    @property
    def damped(self) -> bool:
        """Acceleration depends on velocity, so that a scheme needs to know the velocity where it asks."""
        return self.dragged or self.rubbing or self.contacts is not None


Transition: TypeAlias = Callable[[float, State, Inputs], State]
"""ẋ = f(t, x, u)"""


def transition(t: float, x: State, u: Inputs) -> State:
    """Return ẋ: the rates, and the accelerations a = g + F/m − k w − c |w| w + Σ f(t, x), where w = v − wind.

    Args:
        t: s.
        x: (2, N, D).
        u: what acts.

    Returns:
        (2, N, D).
    """
    derivative = np.empty_like(x)
    derivative[0] = x[1]
    derivative[1] = u.steady
    if u.dragged:
        wind = x[1, :, :2] - u.wind
        rate = u.linear_drag + u.quadratic_drag * np.sqrt(wind[:, :1] ** 2 + wind[:, 1:] ** 2)
        derivative[1, :, :2] -= u.mobile * rate * wind
    for force in u.forces:
        derivative[1] += force(t, x)
    if u.contacts is not None:
        derivative[1] += u.contacts(x)
    return derivative
