"""Motion: where a ball is between its events. What moves otherwise than by x₀ + v τ + a τ²/2 begins here."""

from sandbox.engines.exact.arena import (
    ALPHA,
    ANGLE,
    AX,
    AY,
    LATE,
    SPIN,
    VX,
    VY,
    T,
    X,
    Y,
)
from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.trajectory import FloatArray


@kernel
def place(state: FloatArray, i: int, t: float, late: float) -> tuple[float, float, float, float]:
    """Return a ball's position and velocity at a time, t and `late`, what rounding has cut off it."""
    tau = (t - state[i, T]) + (late - state[i, LATE])
    vx, vy = state[i, VX] + state[i, AX] * tau, state[i, VY] + state[i, AY] * tau
    x = state[i, X] + (state[i, VX] + 0.5 * state[i, AX] * tau) * tau
    y = state[i, Y] + (state[i, VY] + 0.5 * state[i, AY] * tau) * tau
    return x, y, vx, vy


@kernel
def turned(state: FloatArray, i: int, t: float, late: float) -> tuple[float, float]:
    """Return a ball's angle and spin at a time, as `place`."""
    tau = (t - state[i, T]) + (late - state[i, LATE])
    spin = state[i, SPIN] + state[i, ALPHA] * tau
    return state[i, ANGLE] + (state[i, SPIN] + 0.5 * state[i, ALPHA] * tau) * tau, spin
