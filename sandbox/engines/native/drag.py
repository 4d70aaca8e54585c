"""Drag: air resistance as the acceleration of one explicit step.

In a drag of κ a force F adds φ·(F/m)·h to the velocity of a mass m, φ = (1 − e^(−κh))/(κh), and not (F/m)·h: whatever
forces balance, springs, thrusts and attraction among them, they balance exactly at any h, and so does drag with them.
Spin is not dragged, and torques act as they are. Where a joint turns a force into a torque, as on a lever that hangs in
a rotary spring, the two are φ apart.
"""

import numpy as np

from sandbox.scene.model import World
from sandbox.scene.near import FloatArray


def acceleration(world: World, velocity: FloatArray, push: FloatArray | None, h: float) -> FloatArray:
    """Return the mean acceleration (N, 2), m/s², of the next substep under gravity, drag and a steady push.

    With κ = k + c|u|, u = v − wind, held over the step, v̇ = g + push − κu is solved exactly:
    a = (g + push − κu)·(1 − e^(−κh))/(κh), the exponential Euler step (Hochbruck & Ostermann 2010, eq. 2.1).
    Exact in velocity for linear drag, first order for quadratic; the terminal velocity is exact, and no step is
    too long to be stable.

    Args:
        world: gravity, wind and drag.
        velocity: (N, 2) m/s.
        push: (N, 2) m/s² of other forces, or None.
        h: substep, s.
    """
    relative = velocity - np.asarray(world.wind)
    rate = rates(world, velocity)
    share = mean_share(rate, h)
    total = np.asarray(world.gravity) - rate[:, None] * relative
    if push is not None:
        total += push
    return np.asarray(total * share[:, None])


def is_dragged(world: World) -> bool:
    """Tell whether there is any drag."""
    return world.linear_drag > 0 or world.quadratic_drag > 0


def rates(world: World, velocity: FloatArray) -> FloatArray:
    """Return κ, the rates of drag at velocities (N, 2) m/s, (N,) 1/s."""
    relative = velocity - np.asarray(world.wind)
    return np.asarray(world.linear_drag + world.quadratic_drag * np.hypot(relative[:, 0], relative[:, 1]))


def mean_share(rate: FloatArray, h: float) -> FloatArray:
    """Return (1 − e^(−κh))/(κh) for rates κ (N,), 1/s: what share of its first acceleration a substep's mean is."""
    z = rate * h
    # By expm1 nothing is lost near 0; where z is 0 the share is 1.
    return np.asarray(np.divide(-np.expm1(-z), z, out=np.ones_like(z), where=z > 0))
