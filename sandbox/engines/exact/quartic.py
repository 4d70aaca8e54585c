"""Quartics: the first time at which a polynomial of degree four or less falls through zero.

Two bodies whose accelerations differ meet at a root of |r + v t + a t²/2|² − R². Its second derivative is a quadratic;
the roots of that bracket those of the first derivative, and those the roots of the quartic: no crossing between two
extremes is missed, whatever the coefficients.
"""

import math

from sandbox.engines.kernel import bare_kernel as kernel

MOST = 200
"""Halvings: doubles between 0 and the largest have no more."""


@kernel
def value(c0: float, c1: float, c2: float, c3: float, c4: float, t: float) -> float:
    """Return the polynomial at t."""
    return (((c4 * t + c3) * t + c2) * t + c1) * t + c0


@kernel
def between(c0: float, c1: float, c2: float, c3: float, c4: float, low: float, high: float) -> float:
    """Return the root within a bracket over whose ends the polynomial changes sign and is monotone.

    Newton's steps while they stay in the bracket and shrink it, halving where they do not.
    """
    rising = value(c0, c1, c2, c3, c4, high) > 0.0
    t = 0.5 * (low + high)
    for _ in range(MOST):
        f = value(c0, c1, c2, c3, c4, t)
        if f == 0.0:
            return t
        if (f > 0.0) == rising:
            high = t
        else:
            low = t
        slope = ((4.0 * c4 * t + 3.0 * c3) * t + 2.0 * c2) * t + c1
        guess = 0.5 * (low + high)
        if slope != 0.0:
            newton = t - f / slope
            if low < newton < high:
                guess = newton
            elif newton == t:
                return t
        if guess == t or guess <= low or guess >= high:
            return t
        t = guess
    return t


@kernel
def quadratic(a: float, b: float, c: float) -> tuple[float, float]:
    """Return the real roots of a t² + b t + c in rising order; those that it does not have are infinite."""
    if a == 0.0:
        if b == 0.0:
            return math.inf, math.inf
        return -c / b, math.inf
    square = b * b - 4.0 * a * c
    if square < 0.0:
        return math.inf, math.inf
    root = math.sqrt(square)
    q = -0.5 * (b + root) if b >= 0.0 else -0.5 * (b - root)
    first = q / a
    second = c / q if q != 0.0 else first
    if first <= second:
        return first, second
    return second, first


@kernel
def critical(c1: float, c2: float, c3: float, c4: float, until: float) -> tuple[float, float, float]:
    """Return where c1 + 2 c2 t + 3 c3 t² + 4 c4 t³ changes sign in (0, until), in order, and `until` for none."""
    d0, d1, d2, d3 = c1, 2.0 * c2, 3.0 * c3, 4.0 * c4
    early, late = quadratic(3.0 * d3, 2.0 * d2, d1)
    first = second = third = until
    found = 0
    low, f_low = 0.0, d0
    for k in range(3):
        high = until
        if k == 0:
            high = min(max(early, 0.0), until)
        elif k == 1:
            high = min(max(late, 0.0), until)
        if high <= low:
            continue
        f_high = value(d0, d1, d2, d3, 0.0, high)
        if (f_low < 0.0 < f_high) or (f_high < 0.0 < f_low):
            t = between(d0, d1, d2, d3, 0.0, low, high)
            if found == 0:
                first = t
            elif found == 1:
                second = t
            else:
                third = t
            found += 1
        elif f_high == 0.0 and high < until:
            if found == 0:
                first = high
            elif found == 1:
                second = high
            else:
                third = high
            found += 1
        low, f_low = high, f_high
    return first, second, third


@kernel
def first_fall(c0: float, c1: float, c2: float, c3: float, c4: float, until: float) -> float:
    """Return the first time in [0, until] at which the polynomial falls through zero, or infinity.

    One that starts at zero or below falls at once where its first coefficient that is not zero is negative; where it
    is positive, the start is taken as zero and divided out, so that the touch that has just been is not found again.
    """
    if c0 <= 0.0:
        c0, c1, c2, c3, c4 = c1, c2, c3, c4, 0.0
        for _ in range(4):
            if c0 != 0.0:
                break
            c0, c1, c2, c3, c4 = c1, c2, c3, c4, 0.0
        if c0 < 0.0:
            return 0.0
        if c0 == 0.0:
            return math.inf
    first, second, third = critical(c1, c2, c3, c4, until)
    low = 0.0
    for k in range(4):
        high = until
        if k == 0:
            high = first
        elif k == 1:
            high = second
        elif k == 2:
            high = third
        if high <= low:
            continue
        if value(c0, c1, c2, c3, c4, high) <= 0.0:
            return between(c0, c1, c2, c3, c4, low, high)
        low = high
    return math.inf


@kernel
def curved_entry(
    dx: float, dy: float, vx: float, vy: float, ax: float, ay: float, reach: float, parting: bool, limit: float
) -> float:
    """Return when two circles in relative motion d + v t + a t²/2 touch, or infinity.

    Args:
        dx: from the first centre to the second, m.
        dy: likewise.
        vx: relative velocity, m/s.
        vy: likewise.
        ax: relative acceleration, m/s², not zero.
        ay: likewise.
        reach: sum of the radii, m.
        parting: they have just met: they touch, and do not close, whatever rounding says.
        limit: s, beyond which the answer does not matter.
    """
    distance = dx * dx + dy * dy
    closing = dx * vx + dy * vy
    speed, pull = vx * vx + vy * vy, ax * ax + ay * ay
    c0 = distance - reach * reach
    c1 = 2.0 * closing
    if parting:
        c0, c1 = 0.0, max(c1, 0.0)
    elif c0 <= 0.0 and abs(closing) <= 2.0**-49 * math.sqrt(distance * speed):
        c1 = 0.0
    v, a = math.sqrt(speed), math.sqrt(pull)
    # From here on a t²/2 alone outweighs all the rest: they cannot touch any more.
    until = min(limit, (v + math.sqrt(v * v + 2.0 * a * (math.sqrt(distance) + reach))) / a)
    t = first_fall(c0, c1, speed + dx * ax + dy * ay, vx * ax + vy * ay, 0.25 * pull, until)
    if c0 <= 0.0 or t == math.inf:
        return t
    for _ in range(2):  # on the gap itself, which keeps digits that the coefficients of a far pair have lost
        x, y = dx + (vx + 0.5 * ax * t) * t, dy + (vy + 0.5 * ay * t) * t
        wx, wy = vx + ax * t, vy + ay * t
        slope = 2.0 * (x * wx + y * wy)
        step = (x * x + y * y - reach * reach) / slope if slope < 0.0 else 0.0
        if abs(step) <= 1e-6 * t:
            t -= step
    return t
