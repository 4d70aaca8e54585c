"""Roots of gaps that are quadratics in time: a ball and a flat, and two balls whose accelerations are the same.

Each function returns the first time at or after 0 at which a gap falls through zero, or infinity. Forms: those that
lose no digits where the textbook formula subtracts nearly equal numbers.
"""

import math

from sandbox.engines.kernel import bare_kernel as kernel

NOISE = 8.0 * 2.0**-52
"""A component of a vector that is smaller than this share of the vector is rounding."""


@kernel
def flat_entry(c: float, b: float, a: float) -> float:
    """Return when c + b τ + a τ²/2 falls through zero.

    Args:
        c: gap now, m. Below zero the gap must open first.
        b: its rate, m/s.
        a: its acceleration, m/s².
    """
    if b < 0.0:
        if c < 0.0:
            return math.inf
        square = b * b - 2.0 * a * c
        if square < 0.0:
            return math.inf
        return 2.0 * c / (math.sqrt(square) - b)
    if a >= 0.0:
        return math.inf
    square = b * b - 2.0 * a * c
    if square < 0.0 or (c < 0.0 and b == 0.0):
        return math.inf
    # Of the two roots the later one: the first of a ball that has just left, τ ≈ 0, is behind it.
    return (b + math.sqrt(square)) / -a


@kernel
def pair_entry(dx: float, dy: float, vx: float, vy: float, reach: float, speed: float) -> float:
    """Return when two circles whose relative motion is straight touch.

    The discriminant is A·R² − cross², not B² − A·C: near grazing the latter subtracts two numbers that are both far
    larger than their difference.

    Args:
        dx: from the first centre to the second, m.
        dy: likewise.
        vx: relative velocity, m/s.
        vy: likewise.
        reach: sum of the radii, m.
        speed: sum of the two speeds, m/s, of whose rounding a closing speed is no more than noise.
    """
    closing = dx * vx + dy * vy
    if closing >= 0.0:
        return math.inf
    square = vx * vx + vy * vy
    cross = dx * vy - dy * vx
    discriminant = square * reach * reach - cross * cross
    if discriminant <= 0.0:
        return math.inf
    distance = dx * dx + dy * dy
    if -closing <= NOISE * speed * math.sqrt(distance):
        return math.inf
    gap = distance - reach * reach
    if gap <= 0.0:
        return 0.0
    return gap / (math.sqrt(discriminant) - closing)
