"""Rolling: spheres or pucks on a floor, advanced through a time in closed form, across the ends of their phases.

Exact for a ball that meets nothing, whatever the time: within a phase its path is a parabola, and where a phase ends
within the time the next one begins there; where a puck curls, the path is no parabola, but has a closed form too. What
has come to rest is at rest to the bit.
"""

import math
from typing import NamedTuple

from sandbox.engines.floor.collide import Five
from sandbox.engines.floor.curl import curled
from sandbox.engines.floor.phase import GLIDING, RESTING, ROLLING, SLIDING, SPINNING, Figures, fallen, phase_of, rates
from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.trajectory import BoolArray, FloatArray, IntArray

PHASES = 3
"""That a ball can pass through until it rests: sliding, rolling, and one for a slide whose end rounding has put off."""


class Balls(NamedTuple):
    """N spheres or pucks, for kernels. The first five are the population's own arrays."""

    position: FloatArray
    """(N, 2) m"""
    velocity: FloatArray
    """(N, 2) m/s"""
    roll: FloatArray
    """(N, 2) rad/s, about x and y"""
    spin: FloatArray
    """(N,) rad/s, about z"""
    angle: FloatArray
    """(N,) rad, about z"""
    anchor: FloatArray
    """(N, 8) place, angle, velocity and spins from which each came undisturbed: of its last hit within the substep,
    or of the substep's beginning"""
    age: FloatArray
    """(N,) s, how long ago that was"""
    moved: BoolArray
    """(N,) was put elsewhere than its motion led to: by a hit within the substep, or out of an overlap"""
    plays: BoolArray
    """(N,) moves, is there, and in no pocket"""
    meets: IntArray
    """(N,) what each can meet, as in the roster"""
    radius: FloatArray
    """(N,) m"""
    lightness: FloatArray
    """(N,) 1/mass, 1/kg; 0 for what never moves"""
    surface: IntArray
    """(N,)"""
    floor: Figures
    """what they roll on"""


@kernel
def motion_of(balls: Balls, i: int) -> Five:
    """Return a ball's velocity and spin."""
    velocity, roll = balls.velocity, balls.roll
    return velocity[i, 0], velocity[i, 1], roll[i, 0], roll[i, 1], balls.spin[i]


@kernel
def give(balls: Balls, i: int, motion: Five) -> None:
    """Give a ball a velocity and a spin."""
    velocity, roll = balls.velocity, balls.roll
    velocity[i, 0], velocity[i, 1], roll[i, 0], roll[i, 1], balls.spin[i] = motion


@kernel
def rolled(motion: Five, radius: float, floor: Figures, time: float) -> tuple[float, float, float, Five]:
    """Return how far a ball goes in a time, m, how far it turns about z, rad, and how it then moves.

    Args:
        motion: velocity and spin at first.
        radius: m.
        floor: on which it meets nothing.
        time: s.
    """
    vx, vy, wx, wy, wz = motion
    x = y = 0.0
    left = time
    fall = floor.spinning / radius
    turning = min(time, abs(wz) / fall) if fall > 0.0 else time
    if floor.curl != 0.0 and wz != 0.0 and floor.sliding > 0.0 and (vx != 0.0 or vy != 0.0):
        x, y, vx, vy = curled(vx, vy, floor.sliding, math.copysign(floor.curl, floor.curl * wz), turning)
        left -= turning
    for _ in range(PHASES):
        phase = phase_of(vx, vy, wx, wy, wz, radius, floor.pucks)
        if phase in (RESTING, SPINNING) or left <= 0.0:
            break
        ax, ay, bx, by, lasts = rates(phase, vx, vy, wx, wy, wz, radius, floor)
        t = min(left, lasts)
        x, y = x + (vx + 0.5 * ax * t) * t, y + (vy + 0.5 * ay * t) * t
        vx, vy, wx, wy = vx + ax * t, vy + ay * t, wx + bx * t, wy + by * t
        if phase in (ROLLING, GLIDING) and lasts <= left:
            vx = vy = 0.0
        if phase == ROLLING or (phase == SLIDING and lasts <= left):
            wx, wy = 0.0 - vy / radius, vx / radius  # no −0.0 at rest
        left -= t
    angle = (wz - math.copysign(0.5 * fall * turning, wz)) * turning
    return x, y, angle, (vx, vy, wx, wy, fallen(wz, fall * time))


@kernel
def then(balls: Balls, i: int, ago: float) -> tuple[float, float, float, Five]:
    """Return where a ball was a time ago, m, its angle, and how it moved; at most as long ago as its anchor."""
    if ago == 0.0 or not balls.plays[i]:
        return balls.position[i, 0], balls.position[i, 1], balls.angle[i], motion_of(balls, i)
    old = balls.anchor[i]
    began = old[3], old[4], old[5], old[6], old[7]
    x, y, angle, motion = rolled(began, balls.radius[i], balls.floor, balls.age[i] - ago)
    return old[0] + x, old[1] + y, old[2] + angle, motion


@kernel
def roll_on(balls: Balls, i: int, time: float) -> None:
    """Anchor a ball, and advance it by a time, s, as if it met nothing."""
    old, motion = balls.anchor[i], motion_of(balls, i)
    old[0], old[1], old[2] = balls.position[i, 0], balls.position[i, 1], balls.angle[i]
    for k in range(5):
        old[3 + k] = motion[k]
    balls.age[i] = time
    x, y, angle, motion = rolled(motion, balls.radius[i], balls.floor, time)
    balls.position[i, 0] += x
    balls.position[i, 1] += y
    balls.angle[i] += angle
    give(balls, i, motion)


@kernel
def roll_all(balls: Balls, time: float, way: FloatArray) -> None:
    """Advance all that play by a time, s.

    Args:
        balls: whom.
        time: s.
        way: (N, 2) m; written to: how far each went.
    """
    for i in range(len(balls.plays)):
        balls.moved[i] = False
        way[i, 0] = way[i, 1] = 0.0
        if balls.plays[i]:
            x, y = balls.position[i, 0], balls.position[i, 1]
            roll_on(balls, i, time)
            way[i, 0], way[i, 1] = balls.position[i, 0] - x, balls.position[i, 1] - y


@kernel
def find_in_pockets(balls: Balls, pockets: FloatArray, which: IntArray) -> int:
    """Find the balls in play whose centres are within a pocket; return how many there are.

    Args:
        balls: among whom.
        pockets: (P, 3) centre and radius, m.
        which: (N,) written to: the pocket of each, −1 for none.
    """
    found = 0
    for i in range(len(which)):
        which[i] = -1
        for k in range(len(pockets)):
            dx, dy = balls.position[i, 0] - pockets[k, 0], balls.position[i, 1] - pockets[k, 1]
            if balls.plays[i] and which[i] < 0 and dx * dx + dy * dy < pockets[k, 2] * pockets[k, 2]:
                which[i] = k
                found += 1
    return found


@kernel
def first_beyond(balls: Balls, farthest: float, fastest: float) -> int:
    """Return the first ball that is not finite, or farther out or faster than may be, m and m/s; −1 for none."""
    for i in range(len(balls.plays)):
        x, y = balls.position[i, 0], balls.position[i, 1]
        vx, vy, wx, wy, wz = motion_of(balls, i)
        # Comparisons with nan are false, so that what is not good is caught, whatever it is.
        good = x * x + y * y <= farthest * farthest and vx * vx + vy * vy <= fastest * fastest
        if not (good and abs(wx) + abs(wy) + abs(wz) + abs(balls.angle[i]) < math.inf):
            return i
    return -1
