"""Drag: air resistance as the acceleration of one explicit step."""

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
        push: (N, 2) m/s² of steady forces, or None.
        h: substep, s.
    """
    relative = velocity - np.asarray(world.wind)
    rate = world.linear_drag + world.quadratic_drag * np.hypot(relative[:, 0], relative[:, 1])
    share = mean_share(rate, h)
    total = np.asarray(world.gravity) - rate[:, None] * relative
    if push is not None:
        total += push
    return np.asarray(total * share[:, None])


def mean_share(rate: FloatArray, h: float) -> FloatArray:
    """Return (1 − e^(−κh))/(κh) for rates κ (N,), 1/s: what share of its first acceleration a substep's mean is."""
    z = rate * h
    # By expm1 nothing is lost near 0; where z is 0 the share is 1.
    return np.asarray(np.divide(-np.expm1(-z), z, out=np.ones_like(z), where=z > 0))
