"""Approach: the first time at which a ball on a parabola comes up to a line or to a circle.

Gaps are m, times s from now. Who touches and parts is not found again at once; who touches and closes, or is pressed
together by its acceleration, meets at 0.
"""

import math

from sandbox.engines.exact.quartic import curved_entry
from sandbox.engines.kernel import bare_kernel as kernel

TOUCH = 1e-12
"""m: what is nearer touches."""

DEPTH = 1e-9
"""m: what overlaps a line by no more touches it; what overlaps more stands beside its end."""

CRAWL, PRESS = 1e-11, 1e-12
"""m/s and m/s²: who touches, and closes more slowly and is pressed less, stays where he is: rounding has done that."""

STEPS = 60
"""Steps that a search may take, which mostly takes three or four; beyond, brackets decide."""


@kernel
def leave(rate: float, half: float) -> float:
    """Return when who touches is back: at once where it closes or is pressed, infinity where it never is."""
    if rate < -CRAWL or (rate <= 0.0 and half < -PRESS):
        return 0.0
    return rate / -half if rate > 0.0 and half < 0.0 else math.inf


@kernel
def fall(gap: float, rate: float, half: float) -> float:
    """Return when gap + rate·t + half·t² falls through zero, t > 0, or infinity."""
    if gap > TOUCH or gap < -DEPTH:
        square = rate * rate - 4.0 * half * gap
        if square < 0.0:
            return math.inf
        if gap > 0.0 and rate < 0.0:
            return 2.0 * gap / (math.sqrt(square) - rate)
        if half < 0.0 and (gap > 0.0 or rate > 0.0):
            return (rate + math.sqrt(square)) / (-2.0 * half)
        return math.inf
    return leave(rate, half)


@kernel
def first_touch(dx: float, dy: float, vx: float, vy: float, ax: float, ay: float, reach: float, limit: float) -> float:
    """Return when a point at d + v t + a t²/2 first comes as near to the origin as `reach`, or infinity.

    Seen along the direction in which it stands now, the point is never nearer than it is: so the first time at which
    that distance, a quadratic, is down to `reach` is never too late. Stepping there and looking again converges as
    Newton's method does, from one side.

    Args:
        dx: place, m.
        dy: likewise.
        vx: velocity, m/s.
        vy: likewise.
        ax: acceleration, m/s².
        ay: likewise.
        reach: m.
        limit: s, beyond which the answer does not matter.
    """
    hx, hy = 0.5 * ax, 0.5 * ay
    t = 0.0
    for _ in range(STEPS):
        x, y = dx + (vx + hx * t) * t, dy + (vy + hy * t) * t
        rate, half = x * (vx + ax * t) + y * (vy + ay * t), x * hx + y * hy
        if rate >= 0.0 and half >= 0.0:
            return math.inf
        distance = math.sqrt(x * x + y * y)
        gap, rate, half = distance - reach, rate / distance, half / distance
        if gap <= TOUCH:
            step = leave(rate, half)
            if step == 0.0:
                return t
        else:
            square = rate * rate - 4.0 * half * gap
            if square < 0.0:
                return math.inf
            root = math.sqrt(square)
            step = 2.0 * gap / (root - rate) if rate < 0.0 else (rate + root) / (-2.0 * half)
        if not t + step <= limit:
            return math.inf
        if t + step == t:
            return t
        t += step
    return curved_entry(dx, dy, vx, vy, ax, ay, reach, False, limit)
