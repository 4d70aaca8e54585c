"""Hits: what happens to balls on a floor that pymunk finds in contact at the end of a substep.

Each hit is taken back to when the two touched, done there by the laws of `floor.collide`, and both go on from it for
the rest of the substep: so directions and ways are right whatever the substep is, though balls overlap by up to v·h
when they are found. Hits are done one after the other, the earliest first; whom a hit drives into a
third, or into a cushion, is found here, against all others.
"""

from typing import NamedTuple

from sandbox.engines.floor.collide import ELASTIC, STILL, Five, meet, rebound
from sandbox.engines.floor.knock import knock
from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.engines.native.cushions import Cushions
from sandbox.engines.native.overlaps import (
    DUE,
    IMPULSE_X,
    IMPULSE_Y,
    NORMAL_X,
    NORMAL_Y,
    POINT_X,
    POINT_Y,
    approach,
    describe,
    due,
    look_around,
    mend,
)
from sandbox.engines.native.rolling import Balls, give, motion_of, roll_on, then
from sandbox.trajectory import FloatArray, IntArray

CUT = 1e-3
"""m/s: slower hits do not bounce, so that what presses on comes to lie."""

OFTEN = 20
"""Hits for each contact in one substep; what would hit on does so in the next one."""


class Laws(NamedTuple):
    """What hits do."""

    ball_ball: int
    cushion: int
    restitution: FloatArray
    """(S, S) of surfaces"""
    friction: FloatArray
    """(S, S)"""
    grip: float
    """friction of ball and floor"""
    slop: float
    """m of overlap that is left"""
    mend: float
    """the share of what is beyond it that is undone in a substep"""


@kernel
def energy(motion: Five, lightness: float, radius: float, inertia: float) -> float:
    """Return the energy of a ball with a moment of inertia, of m·r², J; of what never moves 0."""
    vx, vy, wx, wy, wz = motion
    squared = vx * vx + vy * vy + inertia * radius * radius * (wx * wx + wy * wy + wz * wz)
    return 0.5 * squared / lightness if lightness > 0.0 else 0.0


@kernel
def put_back(balls: Balls, i: int, ago: float) -> Five:
    """Put a ball back to where it was a time ago, s, and how it moved; return that motion."""
    balls.position[i, 0], balls.position[i, 1], balls.angle[i], motion = then(balls, i, ago)
    give(balls, i, motion)
    balls.moved[i] = True
    return motion


@kernel
def hit(
    balls: Balls,
    cushions: Cushions,
    laws: Laws,
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
        i: a ball.
        other: another, or the fixed thing −1 − k.
        ago: s.
        row: (WIDTH,) of the contact; written to.
        taken: (3,) J, energy that hits brought along normals, that they brought by rubbing, and that the floor did on
            the way that is gone otherwise now; added to.
    """
    _, nx, ny, closing = approach(balls, cushions, i, other, ago)
    radius, light, floor = balls.radius[i], balls.lightness[i], balls.floor
    share = floor.inertia
    undone = energy(motion_of(balls, i), light, radius, share)
    mine = put_back(balls, i, ago)
    began = energy(mine, light, radius, share)
    if other < 0:
        k = -1 - other
        height = cushions.height[k] if cushions.height[k] > 0.0 else radius
        restitution = laws.restitution[balls.surface[i], cushions.surface[k]] if closing > CUT else 0.0
        friction = laws.friction[balls.surface[i], cushions.surface[k]]
        if floor.pucks:
            alone = (light, 0.0), (radius, 0.0)
            after, _ = knock(restitution, 0.0, mine, STILL, *alone, nx, ny)
            smooth = energy(after, light, radius, share)
            after, _ = knock(restitution, friction, mine, STILL, *alone, nx, ny)
        else:
            after = rebound(laws.cushion, restitution, 0.0, 0.0, mine, radius, height, nx, ny)
            smooth = energy(after, light, radius, share)
            after = rebound(laws.cushion, restitution, friction, laws.grip, mine, radius, height, nx, ny)
        ended = energy(after, light, radius, share)
        redone = 0.0
    else:
        gone = motion_of(balls, other)
        theirs = put_back(balls, other, ago) if balls.plays[other] else gone
        heft, wide = balls.lightness[other], balls.radius[other]
        undone += energy(gone, heft, wide, share)
        began += energy(theirs, heft, wide, share)
        restitution = laws.restitution[balls.surface[i], balls.surface[other]] if closing > CUT else 0.0
        both, radii = (light, heft), (radius, wide)
        friction = laws.friction[balls.surface[i], balls.surface[other]]
        if floor.pucks:
            after, more = knock(restitution, 0.0, mine, theirs, both, radii, nx, ny)
        else:
            after, more = meet(ELASTIC, restitution, mine, theirs, both, radius, nx, ny)
        smooth = energy(after, light, radius, share) + energy(more, heft, wide, share)
        if floor.pucks:
            after, more = knock(restitution, friction, mine, theirs, both, radii, nx, ny)
        else:
            after, more = meet(laws.ball_ball, restitution, mine, theirs, both, radius, nx, ny)
        ended = energy(after, light, radius, share) + energy(more, heft, wide, share)
        if balls.plays[other]:
            give(balls, other, more)
            roll_on(balls, other, ago)
            more = motion_of(balls, other)
        redone = energy(more, heft, wide, share)
    if row[IMPULSE_X] == 0.0 and row[IMPULSE_Y] == 0.0:
        row[NORMAL_X], row[NORMAL_Y] = nx, ny
        row[POINT_X], row[POINT_Y] = balls.position[i, 0] + radius * nx, balls.position[i, 1] + radius * ny
    row[IMPULSE_X] += (mine[0] - after[0]) / light
    row[IMPULSE_Y] += (mine[1] - after[1]) / light
    taken[0] += smooth - began
    taken[1] += ended - smooth
    give(balls, i, after)
    roll_on(balls, i, ago)
    taken[2] += began - undone + redone + energy(motion_of(balls, i), light, radius, share) - ended


@kernel
def resolve(
    balls: Balls,
    cushions: Cushions,
    laws: Laws,
    pairs: IntArray,
    told: FloatArray,
    taken: FloatArray,
    count: int,
) -> int:
    """Let all hits of a substep happen, which has just ended; return how many pairs touched.

    Args:
        balls: all.
        cushions: all.
        laws: of hits.
        pairs: (M, 2) with those in contact first, a ball that plays and another, or a fixed thing −1 − k, none twice;
            the rest is room for those that hits bring into contact.
        told: (M, WIDTH) of each pair; written to.
        taken: (3,) as of `hit`.
        count: of pairs in contact.
    """
    done = 0
    for k in range(count):
        i, other = pairs[k, 0], pairs[k, 1]
        describe(balls, cushions, i, other, told[k])
        told[k, DUE] = due(balls, cushions, i, other)
    while done < OFTEN * count:
        first, ago = -1, -1.0
        for k in range(count):
            if told[k, DUE] > ago:
                first, ago = k, told[k, DUE]
        if first < 0 or ago < 0.0:
            break
        i, other = pairs[first, 0], pairs[first, 1]
        hit(balls, cushions, laws, i, other, ago, told[first], taken)
        done += 1
        count = look_around(balls, cushions, i, pairs, told, count)
        if other >= 0 and balls.plays[other]:
            count = look_around(balls, cushions, other, pairs, told, count)
        for k in range(count):
            a, b = pairs[k, 0], pairs[k, 1]
            if a == i or b == i or (other >= 0 and (a == other or b == other)):
                told[k, DUE] = due(balls, cushions, a, b)
    for k in range(count):
        i, other = pairs[k, 0], pairs[k, 1]
        depth = -approach(balls, cushions, i, other, 0.0)[0]
        lies = told[k, IMPULSE_X] != 0.0 or told[k, IMPULSE_Y] != 0.0
        if lies and 0.0 < depth <= laws.slop:
            mend(balls, cushions, i, other, depth)
        elif depth > laws.slop:
            mend(balls, cushions, i, other, laws.mend * (depth - laws.slop))
    return count
