"""Overlaps: when two that are found in contact on a floor touched, how, and whom else one that was hit now touches."""

import math

from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.engines.native.cushions import Cushions, gap_to
from sandbox.engines.native.rolling import Balls, then
from sandbox.engines.roster import ALL
from sandbox.trajectory import FloatArray, IntArray

DUE, IMPULSE_X, IMPULSE_Y, NORMAL_X, NORMAL_Y, POINT_X, POINT_Y, GAP, WIDTH = range(9)
"""Columns of what is told of each contact: how long ago its next hit was due, s, below 0 for none; the impulse that
the first gave to the second, N·s; the normal from the first to the second; where they touched, and the gap, m."""

RISE = 1e-9
"""m/s: what closes more slowly lies."""

SKIN = 0.05
"""The share of a radius by which discs are larger for pymunk: whoever grazes another in between two looks is then found
near it, if as seen from there it goes no farther than 1.28 radii in a substep."""

ENOUGH = 60
"""Looks at the time of a contact. It is found to rounding in some eight."""

NEAREST = 1e-6
"""The share of a time to which it is known when two were nearest: there the gap hardly changes."""

ROUNDING = 1e-15
"""The share of a radius, and of a time, that does not matter."""


@kernel
def approach(balls: Balls, cushions: Cushions, i: int, other: int, ago: float) -> tuple[float, float, float, float]:
    """Return the gap of two a time ago, m, the normal from the first to the second, and how fast it closed, m/s."""
    x, y, _, mine = then(balls, i, ago)
    if other < 0:
        gap, nx, ny = gap_to(cushions, -1 - other, x, y, mine[0], mine[1])
        return gap - balls.radius[i], nx, ny, mine[0] * nx + mine[1] * ny
    px, py, _, theirs = then(balls, other, ago)
    dx, dy = px - x, py - y
    ux, uy = mine[0] - theirs[0], mine[1] - theirs[1]
    distance = math.sqrt(dx * dx + dy * dy)
    if distance > 0.0:
        nx, ny = dx / distance, dy / distance
    else:  # on one spot: along the way that they close, or along x
        speed = math.sqrt(ux * ux + uy * uy)
        nx, ny = (ux / speed, uy / speed) if speed > 0.0 else (1.0, 0.0)
    return distance - balls.radius[i] - balls.radius[other], nx, ny, ux * nx + uy * ny


@kernel
def nearest(balls: Balls, cushions: Cushions, i: int, other: int, most: float) -> float:
    """Return how long ago two that part were nearest to each other, s; 0 where they have parted all the while."""
    if approach(balls, cushions, i, other, most)[3] <= 0.0:
        return 0.0
    low, high = 0.0, most
    for _ in range(ENOUGH):
        middle = 0.5 * (low + high)
        if approach(balls, cushions, i, other, middle)[3] > 0.0:
            high = middle
        else:
            low = middle
        if high - low <= NEAREST * most:
            break
    return low


@kernel
def due(balls: Balls, cushions: Cushions, i: int, other: int) -> float:
    """Return how long ago two that overlap, or have on the way, hit each other, s; below 0 where they did not."""
    latest, (near, _, _, closing) = 0.0, approach(balls, cushions, i, other, 0.0)
    most = balls.age[i] if other < 0 or not balls.plays[other] else min(balls.age[i], balls.age[other])
    if not near < 0.0:
        latest = nearest(balls, cushions, i, other, most) if closing < 0.0 else 0.0
        near = approach(balls, cushions, i, other, latest)[0]
        if not near < 0.0:
            return -1.0
    far, _, _, began = approach(balls, cushions, i, other, most)
    if far <= 0.0:  # they touched all the while
        return most if began > RISE and far > near else 0.0 if closing > RISE else -1.0
    # Between a time of overlap and one before it: false position, by the Illinois rule.
    low, high, below, above, side = latest, most, near, far, 0
    for _ in range(ENOUGH):
        middle = (low * above - high * below) / (above - below)
        gap, _, _, began = approach(balls, cushions, i, other, middle)
        if abs(gap) <= ROUNDING * balls.radius[i] or high - low <= ROUNDING * most:
            break
        if gap < 0.0:
            low, below = middle, gap
            above = 0.5 * above if side < 0 else above
            side = -1
        else:
            high, above = middle, gap
            below = 0.5 * below if side > 0 else below
            side = 1
    return middle if began > RISE else -1.0


@kernel
def mend(balls: Balls, cushions: Cushions, i: int, other: int, depth: float) -> None:
    """Move two apart by so much, m, each as light as it is."""
    _, nx, ny, _ = approach(balls, cushions, i, other, 0.0)
    light, heft = balls.lightness[i], 0.0 if other < 0 else balls.lightness[other]
    share = depth * light / (light + heft)
    balls.position[i, 0] -= share * nx
    balls.position[i, 1] -= share * ny
    balls.moved[i] = True
    if heft > 0.0:
        balls.position[other, 0] += (depth - share) * nx
        balls.position[other, 1] += (depth - share) * ny
        balls.moved[other] = True


@kernel
def listed(pairs: IntArray, count: int, i: int, other: int) -> bool:
    """Tell whether two are among the first pairs, either way round."""
    for k in range(count):
        a, b = pairs[k, 0], pairs[k, 1]
        if (a == i and b == other) or (a == other and b == i):
            return True
    return False


@kernel
def look_around(balls: Balls, cushions: Cushions, i: int, pairs: IntArray, told: FloatArray, count: int) -> int:
    """List whom a ball that was hit now overlaps, and was not listed with; return how many pairs there then are."""
    x, y = balls.position[i, 0], balls.position[i, 1]
    for k in range(-len(cushions.height), len(balls.plays)):
        if count == len(pairs):
            return count
        if k < 0:
            near = approach(balls, cushions, i, k, 0.0)[0] < SKIN * balls.radius[i]
        else:
            meets = k != i and balls.meets[k] == ALL and (balls.meets[i] == ALL or balls.lightness[k] == 0.0)
            dx, dy, reach = (
                balls.position[k, 0] - x,
                balls.position[k, 1] - y,
                (1.0 + SKIN) * (balls.radius[i] + balls.radius[k]),
            )
            near = meets and dx * dx + dy * dy < reach * reach
        if near and not listed(pairs, count, i, k):
            pairs[count, 0], pairs[count, 1] = i, k
            told[count, DUE] = -1.0
            describe(balls, cushions, i, k, told[count])
            count += 1
    return count


@kernel
def describe(balls: Balls, cushions: Cushions, i: int, other: int, row: FloatArray) -> None:
    """Tell of a contact how it is, with no impulse yet."""
    gap, nx, ny, _ = approach(balls, cushions, i, other, 0.0)
    reach = balls.radius[i] + 0.5 * gap
    row[IMPULSE_X] = row[IMPULSE_Y] = 0.0
    row[NORMAL_X], row[NORMAL_Y], row[GAP] = nx, ny, gap
    row[POINT_X], row[POINT_Y] = balls.position[i, 0] + reach * nx, balls.position[i, 1] + reach * ny
