"""Curl: the way of a puck that turns while it slides, as curling stones do.

    a = −μ·g·v̂ + κ·μ·g·sgn(ω)·ẑ×v̂

An empirical law, not derived from what ice does: real stones come to rest about 1 m beside their line over some 28 m,
nearly whatever their spin (Penner 2019, "A scratch-guide model for the motion of a curling rock"; Maeno 2014, "Dynamics
and curl ratio of a curling stone", Sports Engineering 17), and why they do is still argued about (Nyberg, Hogmark &
Jacobson 2013, "Calculated trajectories of curling stones sliding under asymmetrical friction"). With it the speed falls
as if nothing bent the way, and the direction turns by κ·ln(1/s), s the share of the speed that is left: most in the
last metres, as on ice. So, as complex numbers, along the way at first and to its left, v = v₀·s^(1−iκ), and the puck
is at (v₀² / μg)·(1 − s^(2−iκ)) / (2 − iκ).
"""

import math

from sandbox.engines.kernel import bare_kernel as kernel

SHORT = 1e-9
"""Share of the speed lost below which the way is a parabola to rounding."""


@kernel
def curled(vx: float, vy: float, slowing: float, curl: float, time: float) -> tuple[float, float, float, float]:
    """Return how far a puck goes in a time, m, and its velocity then, m/s.

    Args:
        vx: velocity, m/s, which is not nothing.
        vy: likewise.
        slowing: μ·g, m/s², above 0.
        curl: κ, to the left.
        time: s, within which it does not stop turning; where it stops sliding, it lies.
    """
    speed = math.sqrt(vx * vx + vy * vy)
    lost = slowing * time / speed
    if lost >= 1.0:
        along, left = _way(-1.0, 0.0, curl)
        far = speed / slowing
        return far * (along * vx - left * vy), far * (along * vy + left * vx), 0.0, 0.0
    if lost < SHORT:
        along, left = 1.0 - 0.5 * lost, 0.5 * lost * curl
        x, y = time * (along * vx - left * vy), time * (along * vy + left * vx)
    else:
        rate = math.log1p(-lost)
        sine, half = math.sin(-curl * rate), math.sin(-0.5 * curl * rate)
        # s^(2−iκ) − 1, for which nothing may cancel where s is near 1
        real = math.expm1(2.0 * rate) * (1.0 - 2.0 * half * half) - 2.0 * half * half
        along, left = _way(real, math.exp(2.0 * rate) * sine, curl)
        far = time / lost
        x, y = far * (along * vx - left * vy), far * (along * vy + left * vx)
    turn = -curl * math.log1p(-lost)
    cos, sin, share = math.cos(turn), math.sin(turn), 1.0 - lost
    return x, y, share * (cos * vx - sin * vy), share * (cos * vy + sin * vx)


@kernel
def _way(real: float, imaginary: float, curl: float) -> tuple[float, float]:
    """Return −(real + i·imaginary) / (2 − iκ)."""
    norm = 4.0 + curl * curl
    return -(2.0 * real - curl * imaginary) / norm, -(2.0 * imaginary + curl * real) / norm
