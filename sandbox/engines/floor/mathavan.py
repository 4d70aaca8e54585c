"""Mathavan: a cushion's nose that rubs a ball while it is pressed against it, and the floor that rubs it below.

Source: Mathavan, Jackson & Parkin 2010, "A theoretical analysis of billiard ball dynamics under cushion impacts". The
impulse grows in small steps; slips at the nose and at the floor turn meanwhile, which no formula follows. The cushion
is done when it has given back e² of the work that pressing it took.
"""

import math

from sandbox.engines.kernel import bare_kernel as kernel

STEPS = 2000
"""Steps that the impulse would take if nothing rubbed: velocities are right to some 1e-4 of the ball's."""

STILL = 1e-12
"""m/s: a slip slower than this has no direction."""


@kernel
def mathavan2010(
    restitution: float,
    friction: float,
    sliding: float,
    a: tuple[float, float, float, float, float],
    radius: float,
    height: float,
    nx: float,
    ny: float,
) -> tuple[float, float, float, float, float]:
    """Return velocity and spin of a ball after a nose has hit it.

    Args:
        restitution: e, the root of the share of the work that is given back.
        friction: of ball and cushion.
        sliding: of ball and floor.
        a: velocity, m/s, and spin, rad/s, before.
        radius: m.
        height: of the nose above the floor, m.
        nx: normal, into the cushion.
        ny: likewise.
    """
    vx, vy, wx, wy, wz = a
    # x along the cushion, y into it, z up
    x, y = vx * ny - vy * nx, vx * nx + vy * ny
    p, q, r = radius * (wx * ny - wy * nx), radius * (wx * nx + wy * ny), radius * wz
    sin = height / radius - 1.0
    cos = math.sqrt(1.0 - sin * sin)
    if cos == 0.0:  # the nose is at the very top or bottom, and cannot press
        return a
    step = (1.0 + restitution) * y / (STEPS * cos)
    most = 1.0 / (3.5 * step)
    work, wanted, pressed = 0.0, math.inf, 0.0
    for _ in range(100 * STEPS):
        along, up = x + q * sin - r * cos, p - y * sin
        slip = math.sqrt(along * along + up * up)
        ca, cu = (along / slip, up / slip) if slip > STILL else (0.0, 0.0)
        rub = min(friction, most * slip)  # a step ends a slip at most, and never turns it round
        under_x, under_y = x - q, y + p
        under = math.sqrt(under_x * under_x + under_y * under_y)
        fx, fy = (under_x / under, under_y / under) if under > STILL else (0.0, 0.0)
        weight = sin + rub * cu * cos  # what presses the ball onto the floor, of the impulse
        grip = min(sliding * max(weight, 0.0), most * under)
        dx = -rub * ca - grip * fx
        dy = -cos + rub * sin * cu - grip * fy
        dp = -2.5 * (rub * cu + grip * fy)
        dq = -2.5 * (rub * ca * sin - grip * fx)
        dr = 2.5 * rub * ca * cos
        # The last step of pressing, and of giving back, is cut to where it ends.
        part = step
        ends = False
        if wanted == math.inf:
            if y + dy * step <= 0.0:
                part, ends = y / -dy, True
        else:
            more = -cos * (y + 0.5 * dy * step) * step
            if work + more >= wanted:
                part, ends = step * (wanted - work) / more, True
        before = y
        x, y, p, q, r = x + dx * part, y + dy * part, p + dp * part, q + dq * part, r + dr * part
        work += cos * part * 0.5 * abs(before + y)
        if ends and wanted == math.inf:
            y, pressed = 0.0, work
            work, wanted = 0.0, restitution * restitution * pressed
            if wanted == 0.0:
                break
        elif ends:
            break
    wx, wy = p * ny + q * nx, -p * nx + q * ny
    return x * ny + y * nx, -x * nx + y * ny, wx / radius, wy / radius, r / radius
