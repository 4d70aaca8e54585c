"""Hits: what happens to balls on a floor that pymunk finds in contact at the end of a substep.

Each hit is taken back to when the two touched, done there by the laws of `floor.collide`, and both go on from it for
the rest of the substep: so directions and ways are right to second order in the substep, not to the way v·h that
balls overlap by when they are found. Hits are done one after the other, the earliest first; whom a hit drives into a
third, or into a cushion, is found here, against all others.
"""

import math
from typing import NamedTuple

from sandbox.engines.floor.collide import ELASTIC, Five, meet, rebound
from sandbox.engines.floor.phase import Figures
from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.engines.native.cushions import Cushions, gap_to
from sandbox.engines.native.rolling import Balls, give, motion_of, note_gain, roll_on
from sandbox.engines.roster import ALL
from sandbox.trajectory import FloatArray, IntArray

DUE, IMPULSE_X, IMPULSE_Y, NORMAL_X, NORMAL_Y, POINT_X, POINT_Y, WIDTH = range(8)
"""Columns of what is told of each contact: how long ago its next hit was due, s, below 0 for none; the impulse that
the first gave to the second, N·s; the normal from the first to the second, and where they touched, m."""

CUT = 1e-3
"""m/s: slower hits do not bounce, so that what presses on comes to lie."""

RISE = 1e-9
"""m/s: what closes more slowly lies."""

LATE = 8.0
"""Substeps for which a hit may wait, where there were too many in one."""

OFTEN = 20
"""Hits for each contact in one substep; what would hit on does so in the next one."""

ENOUGH = 60
"""Looks at the time of a contact. It is found to rounding in some eight."""

ROUNDING = 1e-15
"""The share of a radius, and of a substep, that does not matter."""


class Laws(NamedTuple):
    """What hits do."""

    ball_ball: int
    cushion: int
    restitution: FloatArray
    """(S, S) of surfaces"""
    friction: FloatArray
    """(S, S)"""
    slop: float
    """m of overlap that is left"""
    mend: float
    """the share of what is beyond it that is undone in a substep"""


@kernel
def back(balls: Balls, i: int, ago: float) -> tuple[float, float, Five]:
    """Return where a ball was a time ago, s, and how it moved, by its present motion and its late gain."""
    vx, vy, wx, wy, wz = motion_of(balls, i)
    gain = balls.gain[i]
    x = balls.position[i, 0] - (vx - 0.5 * gain[0] * ago) * ago
    y = balls.position[i, 1] - (vy - 0.5 * gain[1] * ago) * ago
    then = vx - gain[0] * ago, vy - gain[1] * ago, wx - gain[2] * ago, wy - gain[3] * ago, wz - gain[4] * ago
    return x, y, then


@kernel
def approach(balls: Balls, cushions: Cushions, i: int, other: int, ago: float) -> tuple[float, float, float, float]:
    """Return the gap of two a time ago, m, the normal from the first to the second, and how fast it closed, m/s."""
    x, y, mine = back(balls, i, ago)
    if other < 0:
        gap, nx, ny = gap_to(cushions, -1 - other, x, y, mine[0], mine[1])
        return gap - balls.radius[i], nx, ny, mine[0] * nx + mine[1] * ny
    px, py, theirs = back(balls, other, ago)
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
def due(balls: Balls, cushions: Cushions, i: int, other: int, h: float) -> float:
    """Return how long ago two that overlap hit each other, s; below 0 where they do not, or part."""
    near, _, _, closing = approach(balls, cushions, i, other, 0.0)
    if not near < 0.0:
        return -1.0
    since = balls.since[i] if other < 0 else min(balls.since[i], balls.since[other])
    most = since if since < LATE * h else h
    far, _, _, began = approach(balls, cushions, i, other, most)
    if far <= 0.0:  # they touched all the while
        return most if began > RISE and far > near else 0.0 if closing > RISE else -1.0
    # Between a time of overlap and one before it: false position, by the Illinois rule.
    low, high, below, above, side = 0.0, most, near, far, 0
    for _ in range(ENOUGH):
        middle = (low * above - high * below) / (above - below)
        gap, _, _, began = approach(balls, cushions, i, other, middle)
        if abs(gap) <= ROUNDING * balls.radius[i] or high - low <= ROUNDING * h:
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
def energy(motion: Five, lightness: float, radius: float) -> float:
    """Return the energy of a sphere, J; of what never moves 0."""
    vx, vy, wx, wy, wz = motion
    squared = vx * vx + vy * vy + 0.4 * radius * radius * (wx * wx + wy * wy + wz * wz)
    return 0.5 * squared / lightness if lightness > 0.0 else 0.0


@kernel
def put_back(balls: Balls, i: int, ago: float) -> Five:
    """Put a ball back to where it was a time ago, s, and how it moved; return that motion."""
    x, y, then = back(balls, i, ago)
    balls.angle[i] -= 0.5 * (balls.spin[i] + then[4]) * ago
    balls.position[i, 0], balls.position[i, 1] = x, y
    give(balls, i, then)
    return then


@kernel
def go_on(balls: Balls, i: int, floor: Figures, time: float) -> None:
    """Let a ball go on from a hit for a time, s."""
    after = motion_of(balls, i)
    roll_on(balls, i, floor, time)
    if time > 0.0:
        note_gain(balls, i, after, time)
    balls.since[i], balls.moved[i] = time, True


@kernel
def off(
    model: int, restitution: float, friction: float, a: Five, radius: float, height: float, nx: float, ny: float
) -> Five:
    """Return a ball after a cushion, into which it goes no further: a nose far above its centre would let it."""
    vx, vy, wx, wy, wz = rebound(model, restitution, friction, a, radius, height, nx, ny)
    still = max(vx * nx + vy * ny, 0.0)
    return vx - still * nx, vy - still * ny, wx, wy, wz


@kernel
def hit(
    balls: Balls,
    cushions: Cushions,
    laws: Laws,
    floor: Figures,
    i: int,
    other: int,
    ago: float,
    row: FloatArray,
    taken: FloatArray,
) -> None:
    """Let two hit each other that touched a time ago, and tell of it.

    Args:
        balls: all.
        cushions: all.
        laws: of hits.
        floor: on which they go on.
        i: a ball.
        other: another, or the fixed thing −1 − k.
        ago: s.
        row: (WIDTH,) of the contact; written to.
        taken: (3,) J, energy that hits brought along normals, that they brought by rubbing, and that the floor did on
            the way that is gone otherwise now; added to.
    """
    _, nx, ny, closing = approach(balls, cushions, i, other, ago)
    radius, light = balls.radius[i], balls.lightness[i]
    undone = energy(motion_of(balls, i), light, radius)
    mine = put_back(balls, i, ago)
    began = energy(mine, light, radius)
    if other < 0:
        k = -1 - other
        height = cushions.height[k] if cushions.height[k] > 0.0 else radius
        restitution = laws.restitution[balls.surface[i], cushions.surface[k]] if closing > CUT else 0.0
        friction = laws.friction[balls.surface[i], cushions.surface[k]]
        smooth = energy(off(laws.cushion, restitution, 0.0, mine, radius, height, nx, ny), light, radius)
        after = off(laws.cushion, restitution, friction, mine, radius, height, nx, ny)
        ended = energy(after, light, radius)
        redone = 0.0
    else:
        gone = motion_of(balls, other)
        theirs = put_back(balls, other, ago) if balls.plays[other] else gone
        heft = balls.lightness[other]
        undone += energy(gone, heft, radius)
        began += energy(theirs, heft, radius)
        restitution = laws.restitution[balls.surface[i], balls.surface[other]] if closing > CUT else 0.0
        both = light, heft
        after, more = meet(ELASTIC, restitution, mine, theirs, both, radius, nx, ny)
        smooth = energy(after, light, radius) + energy(more, heft, radius)
        after, more = meet(laws.ball_ball, restitution, mine, theirs, both, radius, nx, ny)
        ended = energy(after, light, radius) + energy(more, heft, radius)
        if balls.plays[other]:
            give(balls, other, more)
            go_on(balls, other, floor, ago)
            more = motion_of(balls, other)
        redone = energy(more, heft, radius)
    if row[IMPULSE_X] == 0.0 and row[IMPULSE_Y] == 0.0:
        row[NORMAL_X], row[NORMAL_Y] = nx, ny
        row[POINT_X], row[POINT_Y] = balls.position[i, 0] + radius * nx, balls.position[i, 1] + radius * ny
    row[IMPULSE_X] += (mine[0] - after[0]) / light
    row[IMPULSE_Y] += (mine[1] - after[1]) / light
    taken[0] += smooth - began
    taken[1] += ended - smooth
    give(balls, i, after)
    go_on(balls, i, floor, ago)
    taken[2] += began - undone + redone + energy(motion_of(balls, i), light, radius) - ended


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
            near = approach(balls, cushions, i, k, 0.0)[0] < 0.0
        else:
            meets = k != i and balls.meets[k] == ALL and (balls.meets[i] == ALL or balls.lightness[k] == 0.0)
            dx, dy, reach = balls.position[k, 0] - x, balls.position[k, 1] - y, balls.radius[i] + balls.radius[k]
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
    row[NORMAL_X], row[NORMAL_Y] = nx, ny
    row[POINT_X], row[POINT_Y] = balls.position[i, 0] + reach * nx, balls.position[i, 1] + reach * ny


@kernel
def resolve(
    balls: Balls,
    cushions: Cushions,
    laws: Laws,
    floor: Figures,
    pairs: IntArray,
    told: FloatArray,
    taken: FloatArray,
    count: int,
    h: float,
) -> int:
    """Let all hits of a substep happen, which has just ended; return how many pairs touched.

    Args:
        balls: all.
        cushions: all.
        laws: of hits.
        floor: on which balls go on.
        pairs: (M, 2) with those in contact first, a ball that plays and another, or a fixed thing −1 − k, none twice;
            the rest is room for those that hits bring into contact.
        told: (M, WIDTH) of each pair; written to.
        taken: (3,) as of `hit`.
        count: of pairs in contact.
        h: the substep, s.
    """
    done = 0
    for k in range(count):
        i, other = pairs[k, 0], pairs[k, 1]
        describe(balls, cushions, i, other, told[k])
        told[k, DUE] = due(balls, cushions, i, other, h)
    while done < OFTEN * count:
        first, ago = -1, -1.0
        for k in range(count):
            if told[k, DUE] > ago:
                first, ago = k, told[k, DUE]
        if first < 0 or ago < 0.0:
            break
        i, other = pairs[first, 0], pairs[first, 1]
        hit(balls, cushions, laws, floor, i, other, ago, told[first], taken)
        done += 1
        count = look_around(balls, cushions, i, pairs, told, count)
        if other >= 0 and balls.plays[other]:
            count = look_around(balls, cushions, other, pairs, told, count)
        for k in range(count):
            a, b = pairs[k, 0], pairs[k, 1]
            if a == i or b == i or (other >= 0 and (a == other or b == other)):
                told[k, DUE] = due(balls, cushions, a, b, h)
    for k in range(count):
        i, other = pairs[k, 0], pairs[k, 1]
        depth = -approach(balls, cushions, i, other, 0.0)[0]
        lies = told[k, IMPULSE_X] != 0.0 or told[k, IMPULSE_Y] != 0.0
        if lies and 0.0 < depth <= laws.slop:
            mend(balls, cushions, i, other, depth)
        elif depth > laws.slop:
            mend(balls, cushions, i, other, laws.mend * (depth - laws.slop))
    return count
