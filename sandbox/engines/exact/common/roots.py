"""Times of impact: first roots of the polynomials of motion.

Gaps are in m, times in s from now. Every function returns the first time at or after 0 at which a gap falls through
zero, or infinity. A pair that touches and separates is not found again; a pair that touches and approaches, or is
pressed together by its acceleration, has the time 0.

- Quadratics: ball and line, and two balls of equal acceleration. The forms used avoid the cancellation of the textbook
  formula.
- Quartics: two balls whose accelerations differ touch at a root of |r + v t + a t²/2|² − R². Its second derivative is a
  quadratic; the roots of that bracket those of the first derivative, and these the roots of the quartic. So no crossing
  between two extrema is missed, whatever the coefficients.
- Newton's method from one side: a ball on a parabola and a line or a circle.
"""

import math

from sandbox.engines.common.kernel import bare_kernel as kernel

NOISE = 8.0 * 2.0**-52
"""A component of a vector below this fraction of the vector's length is rounding error."""


@kernel
def line_entry(c: float, b: float, a: float) -> float:
    """Return the time at which c + b τ + a τ²/2 falls through zero.

    Args:
        c: gap now, m. If it is negative, the gap must first open.
        b: rate of the gap, m/s.
        a: acceleration of the gap, m/s².
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
    # The later root: the earlier one, τ ≈ 0 for a ball that has just left, is past.
    return (b + math.sqrt(square)) / -a


@kernel
def pair_entry(dx: float, dy: float, vx: float, vy: float, radius_sum: float, speed: float) -> float:
    """Return the time at which two circles in uniform relative motion touch.

    The discriminant is A·R² − cross², not B² − A·C: near grazing contact the latter is a small difference of large
    numbers.

    Args:
        dx: from the first centre to the second, m.
        dy: likewise.
        vx: relative velocity, m/s.
        vy: likewise.
        radius_sum: m.
        speed: sum of the two speeds, m/s; a speed of approach within its rounding error counts as zero.
    """
    closing = dx * vx + dy * vy
    if closing >= 0.0:
        return math.inf
    speed_squared = vx * vx + vy * vy
    cross = dx * vy - dy * vx
    discriminant = speed_squared * radius_sum * radius_sum - cross * cross
    if discriminant <= 0.0:
        return math.inf
    distance_squared = dx * dx + dy * dy
    if -closing <= NOISE * speed * math.sqrt(distance_squared):
        return math.inf
    square_difference = distance_squared - radius_sum * radius_sum
    if square_difference <= 0.0:
        return 0.0
    return square_difference / (math.sqrt(discriminant) - closing)


MAX_BISECTIONS = 200
"""Upper bound of bisections: the range of doubles above 0 needs no more."""


@kernel
def polynomial(c0: float, c1: float, c2: float, c3: float, c4: float, t: float) -> float:
    """Return c0 + c1 t + c2 t² + c3 t³ + c4 t⁴ by Horner's scheme."""
    return (((c4 * t + c3) * t + c2) * t + c1) * t + c0


@kernel
def root_in_bracket(c0: float, c1: float, c2: float, c3: float, c4: float, low: float, high: float) -> float:
    """Return the root in a bracket in which the polynomial is monotone and changes sign.

    Newton's method, safeguarded: a step that leaves the bracket is replaced by bisection.
    """
    rising = polynomial(c0, c1, c2, c3, c4, high) > 0.0
    t = 0.5 * (low + high)
    for _ in range(MAX_BISECTIONS):
        f = polynomial(c0, c1, c2, c3, c4, t)
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
def quadratic_roots(a: float, b: float, c: float) -> tuple[float, float]:
    """Return the real roots of a t² + b t + c in ascending order, infinity for those that do not exist."""
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
def extrema(c1: float, c2: float, c3: float, c4: float, until: float) -> tuple[float, float, float]:
    """Return the zeros of c1 + 2 c2 t + 3 c3 t² + 4 c4 t³ with a sign change in (0, until), ascending; else `until`."""
    d0, d1, d2, d3 = c1, 2.0 * c2, 3.0 * c3, 4.0 * c4
    early, late = quadratic_roots(3.0 * d3, 2.0 * d2, d1)
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
        f_high = polynomial(d0, d1, d2, d3, 0.0, high)
        if (f_low < 0.0 < f_high) or (f_high < 0.0 < f_low):
            t = root_in_bracket(d0, d1, d2, d3, 0.0, low, high)
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
def first_downward_root(c0: float, c1: float, c2: float, c3: float, c4: float, until: float) -> float:
    """Return the first time in [0, until] at which the polynomial falls through zero, or infinity.

    If it is zero or negative at 0, the sign of its first non-zero coefficient decides: negative returns 0; positive
    means that the start is a root, which is divided out, so that the contact that has just ended is not found again.
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
    first, second, third = extrema(c1, c2, c3, c4, until)
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
        if polynomial(c0, c1, c2, c3, c4, high) <= 0.0:
            return root_in_bracket(c0, c1, c2, c3, c4, low, high)
        low = high
    return math.inf


@kernel
def curved_entry(
    dx: float, dy: float, vx: float, vy: float, ax: float, ay: float, radius_sum: float, separating: bool, limit: float
) -> float:
    """Return the time at which two circles in relative motion d + v t + a t²/2 touch, or infinity.

    Args:
        dx: from the first centre to the second, m.
        dy: likewise.
        vx: relative velocity, m/s.
        vy: likewise.
        ax: relative acceleration, m/s², not zero.
        ay: likewise.
        radius_sum: m.
        separating: whether they have just collided; they touch then, and a speed of approach is rounding error.
        limit: s; later times need not be found.
    """
    distance_squared = dx * dx + dy * dy
    closing = dx * vx + dy * vy
    speed_squared, acceleration_squared = vx * vx + vy * vy, ax * ax + ay * ay
    c0 = distance_squared - radius_sum * radius_sum
    c1 = 2.0 * closing
    if separating:
        c0, c1 = 0.0, max(c1, 0.0)
    elif c0 <= 0.0 and abs(closing) <= 2.0**-49 * math.sqrt(distance_squared * speed_squared):
        c1 = 0.0
    speed, acceleration = math.sqrt(speed_squared), math.sqrt(acceleration_squared)
    if acceleration == 0.0:  # its square is below the smallest number
        return math.inf if separating else pair_entry(dx, dy, vx, vy, radius_sum, speed)
    # After this time a t²/2 exceeds all other terms: they cannot touch any more.
    until = min(
        limit,
        (speed + math.sqrt(speed * speed + 2.0 * acceleration * (math.sqrt(distance_squared) + radius_sum)))
        / acceleration,
    )
    t = first_downward_root(
        c0, c1, speed_squared + dx * ax + dy * ay, vx * ax + vy * ay, 0.25 * acceleration_squared, until
    )
    if c0 <= 0.0 or t == math.inf:
        return t
    for _ in range(2):  # Newton on the gap itself: the coefficients of a distant pair have lost digits
        x, y = dx + (vx + 0.5 * ax * t) * t, dy + (vy + 0.5 * ay * t) * t
        wx, wy = vx + ax * t, vy + ay * t
        slope = 2.0 * (x * wx + y * wy)
        step = (x * x + y * y - radius_sum * radius_sum) / slope if slope < 0.0 else 0.0
        if abs(step) <= 1e-6 * t:
            t -= step
    return t


TOUCH_GAP = 1e-12
"""m: smaller gaps count as contact."""

MAX_OVERLAP = 1e-9
"""m: a ball that overlaps a line by no more touches it; with a larger overlap it lies beside the end of the line."""

CREEP_SPEED, CREEP_ACCELERATION = 1e-11, 1e-12
"""m/s and m/s²: a pair in contact that approaches more slowly and is pressed together less does not collide: both are
rounding error."""

LONGEST_SPAN = 1e50
"""s, span of time from which on quick tests are omitted, whose products could overflow"""

FAR = 1.0 + 1e-9
"""Factor of a squared distance above which a quick test may exclude a touch: rounding errors are smaller"""

MAX_STEPS = 60
"""Upper bound of Newton steps, of which usually three or four are needed; beyond it brackets decide."""


@kernel
def return_time(rate: float, half: float) -> float:
    """Return the time at which a pair in contact touches again: 0 if it approaches or is pressed together."""
    if rate < -CREEP_SPEED or (rate <= 0.0 and half < -CREEP_ACCELERATION):
        return 0.0
    return rate / -half if rate > 0.0 and half < 0.0 else math.inf


@kernel
def gap_zero_time(gap: float, rate: float, half: float) -> float:
    """Return the time t > 0 at which gap + rate·t + half·t² falls through zero, or infinity."""
    if gap > TOUCH_GAP or gap < -MAX_OVERLAP:
        square = rate * rate - 4.0 * half * gap
        if square < 0.0:
            return math.inf
        if gap > 0.0 and rate < 0.0:
            return 2.0 * gap / (math.sqrt(square) - rate)
        if half < 0.0 and (gap > 0.0 or rate > 0.0):
            return (rate + math.sqrt(square)) / (-2.0 * half)
        return math.inf
    return return_time(rate, half)


@kernel
def first_touch(dx: float, dy: float, vx: float, vy: float, ax: float, ay: float, radius: float, limit: float) -> float:
    """Return the time at which a point at d + v t + a t²/2 first is at a given distance from the origin, or infinity.

    Projected on its present direction, the point is never farther from the origin than it is. So the time at which that
    projection, a quadratic, equals the radius is never too late. Advancing to it and projecting again converges like
    Newton's method, from one side (conservative advancement).

    Args:
        dx: position, m.
        dy: likewise.
        vx: velocity, m/s.
        vy: likewise.
        ax: acceleration, m/s².
        ay: likewise.
        radius: distance from the origin, m.
        limit: s; later times need not be found.
    """
    hx, hy = 0.5 * ax, 0.5 * ay
    if limit < LONGEST_SPAN:
        # Most points are too far away: the first step below would end after the limit. No root or division is needed.
        distance_squared = dx * dx + dy * dy
        closest = distance_squared + min(dx * vx + dy * vy, 0.0) * limit + min(dx * hx + dy * hy, 0.0) * limit * limit
        if closest > 0.0 and closest * closest > FAR * radius * radius * distance_squared:
            return math.inf
        # Most others pass the origin: the component across the velocity stays larger than the radius.
        across = abs(dx * vy - dy * vx) - abs(hx * vy - hy * vx) * limit * limit
        if across > 0.0 and across * across > FAR * radius * radius * (vx * vx + vy * vy):
            return math.inf
    t = 0.0
    for _ in range(MAX_STEPS):
        x, y = dx + (vx + hx * t) * t, dy + (vy + hy * t) * t
        rate, half = x * (vx + ax * t) + y * (vy + ay * t), x * hx + y * hy
        if rate >= 0.0 and half >= 0.0:
            return math.inf
        distance = math.sqrt(x * x + y * y)
        gap, rate, half = distance - radius, rate / distance, half / distance
        if gap <= TOUCH_GAP:
            step = return_time(rate, half)
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
    return curved_entry(dx, dy, vx, vy, ax, ay, radius, False, limit)
