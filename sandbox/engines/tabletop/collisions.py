"""Collisions on a surface: ball with ball, ball with cushion (Mathavan et al. 2010), puck with puck.

One function for each model. Velocities along z are ignored: no ball leaves the surface. n points from the first to the
second.

`mathavan2010`: while a ball is pressed against a cushion, friction acts on it at the nose and at the surface below.
Source: Mathavan, Jackson & Parkin 2010, "A theoretical analysis of billiard ball dynamics under cushion impacts". The
impulse grows in small steps, because the directions of slip at the nose and at the surface change meanwhile, for which
there is no closed form. The collision ends when the cushion has returned e² of the work of compression.
"""

import math

from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.scene.description.surface import BallBall, Cushion

STEPS = 2000
"""Number of steps of the impulse without friction: velocities are accurate to about 1e-4 of the ball's speed."""

NO_SLIP = 1e-12
"""m/s: slip below this has no direction"""


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
    """Return velocity and spin of a ball after a collision with a cushion's nose.

    Args:
        restitution: e, the square root of the fraction of the work that is returned.
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
    if cos == 0.0:  # the nose is at the top or bottom of the ball and cannot press
        return a
    step = (1.0 + restitution) * y / (STEPS * cos)
    max_friction = 1.0 / (3.5 * step)
    work, target_work, compression_work = 0.0, math.inf, 0.0
    for _ in range(100 * STEPS):
        along, up = x + q * sin - r * cos, p - y * sin
        slip = math.sqrt(along * along + up * up)
        ca, cu = (along / slip, up / slip) if slip > NO_SLIP else (0.0, 0.0)
        effective_friction = min(friction, max_friction * slip)  # a step can end slip, but not reverse it
        floor_slip_x, floor_slip_y = x - q, y + p
        floor_slip = math.sqrt(floor_slip_x * floor_slip_x + floor_slip_y * floor_slip_y)
        fx, fy = (floor_slip_x / floor_slip, floor_slip_y / floor_slip) if floor_slip > NO_SLIP else (0.0, 0.0)
        pressing = sin + effective_friction * cu * cos  # part of the impulse that presses the ball onto the surface
        grip = min(sliding * max(pressing, 0.0), max_friction * floor_slip)
        dx = -effective_friction * ca - grip * fx
        dy = -cos + effective_friction * sin * cu - grip * fy
        dp = -2.5 * (effective_friction * cu + grip * fy)
        dq = -2.5 * (effective_friction * ca * sin - grip * fx)
        dr = 2.5 * effective_friction * ca * cos
        # The last steps of compression and of restitution are shortened to end exactly.
        actual_step = step
        ends = False
        if target_work == math.inf:
            if y + dy * step <= 0.0:
                actual_step, ends = y / -dy, True
        else:
            step_work = -cos * (y + 0.5 * dy * step) * step
            if work + step_work >= target_work:
                actual_step, ends = step * (target_work - work) / step_work, True
        before = y
        x, y, p, q, r = (
            x + dx * actual_step,
            y + dy * actual_step,
            p + dp * actual_step,
            q + dq * actual_step,
            r + dr * actual_step,
        )
        work += cos * actual_step * 0.5 * abs(before + y)
        if ends and target_work == math.inf:
            y, compression_work = 0.0, work
            work, target_work = 0.0, restitution * restitution * compression_work
            if target_work == 0.0:
                break
        elif ends:
            break
    wx, wy = p * ny + q * nx, -p * nx + q * ny
    return x * ny + y * nx, -x * nx + y * ny, wx / radius, wy / radius, r / radius


ELASTIC, FRICTIONAL = range(2)
SIMPLE, HAN2005, MATHAVAN2010 = range(3)
BALL_BALL: dict[BallBall, int] = {"elastic": ELASTIC, "frictional": FRICTIONAL}
CUSHION: dict[Cushion, int] = {"simple": SIMPLE, "han2005": HAN2005, "mathavan2010": MATHAVAN2010}
"""Models of ball–ball and ball–cushion collisions, by their names in `[contact_models]`."""

Five = tuple[float, float, float, float, float]
"""v_x, v_y, m/s; ω_x, ω_y, ω_z, rad/s"""

STILL: Five = (0.0, 0.0, 0.0, 0.0, 0.0)


@kernel
def ball_friction(slip: float) -> float:
    """Return the friction between phenolic balls that slip at a speed, m/s (Alciatore TP A.14)."""
    return 0.009951 + 0.108 * math.exp(-1.088 * slip)


@kernel
def collide_balls(
    model: int,
    restitution: float,
    a: Five,
    b: Five,
    inverse_mass: tuple[float, float],
    radius: float,
    nx: float,
    ny: float,
) -> tuple[Five, Five]:
    """Return the velocities and spins of two balls after a collision.

    Args:
        model: `ELASTIC` or `FRICTIONAL`.
        restitution: along the normal.
        a: velocity and spin of the first.
        b: of the second.
        inverse_mass: 1/mass of each, 1/kg; 0 for a fixed ball.
        radius: of both, m.
        nx: normal, from the first to the second.
        ny: likewise.
    """
    avx, avy, awx, awy, awz = a
    bvx, bvy, bwx, bwy, bwz = b
    inverse_a, inverse_b = inverse_mass
    closing = (avx - bvx) * nx + (avy - bvy) * ny
    impulse = (1.0 + restitution) * closing / (inverse_a + inverse_b)
    if model == FRICTIONAL:
        # Slip of the first over the second at the point of contact: along t = (−n_y, n_x), and along z.
        along = (avy - bvy) * nx - (avx - bvx) * ny + radius * (awz + bwz)
        up = radius * ((awx + bwx) * ny - (awy + bwy) * nx)
        slip = math.sqrt(along * along + up * up)
        if slip > 0.0:
            # Coulomb's law, up to the impulse that ends the slip: the effective inverse mass is 7/2 of the sum.
            friction_per_slip = min(ball_friction(slip) * impulse, slip / (3.5 * (inverse_a + inverse_b))) / slip
            dt, dz = -friction_per_slip * along, -friction_per_slip * up
            turn = 2.5 / radius
            avx, avy = avx - inverse_a * dt * ny, avy + inverse_a * dt * nx
            bvx, bvy = bvx + inverse_b * dt * ny, bvy - inverse_b * dt * nx
            awx, awy, awz = (
                awx + turn * inverse_a * dz * ny,
                awy - turn * inverse_a * dz * nx,
                awz + turn * inverse_a * dt,
            )
            bwx, bwy, bwz = (
                bwx + turn * inverse_b * dz * ny,
                bwy - turn * inverse_b * dz * nx,
                bwz + turn * inverse_b * dt,
            )
    avx, avy = avx - inverse_a * impulse * nx, avy - inverse_a * impulse * ny
    bvx, bvy = bvx + inverse_b * impulse * nx, bvy + inverse_b * impulse * ny
    return (avx, avy, awx, awy, awz), (bvx, bvy, bwx, bwy, bwz)


@kernel
def collide_cushion(
    model: int,
    restitution: float,
    friction: float,
    sliding: float,
    a: Five,
    radius: float,
    height: float,
    nx: float,
    ny: float,
) -> Five:
    """Return the velocity and spin of a ball after a collision with a cushion; its velocity into the cushion is then 0.

    Args:
        model: `SIMPLE`, `HAN2005` or `MATHAVAN2010`.
        restitution: along the normal of contact.
        friction: of ball and cushion, not used by `SIMPLE`.
        sliding: friction of ball and surface, used only by `MATHAVAN2010`.
        a: velocity and spin.
        radius: m.
        height: of the nose above the floor, m.
        nx: normal, into the cushion.
        ny: likewise.
    """
    if model == HAN2005:
        vx, vy, wx, wy, wz = _han2005(restitution, friction, a, radius, height, nx, ny)
    elif model == MATHAVAN2010:
        vx, vy, wx, wy, wz = mathavan2010(restitution, friction, sliding, a, radius, height, nx, ny)
    else:
        vx, vy, wx, wy, wz = a
        normal_impulse = (1.0 + restitution) * (vx * nx + vy * ny)
        return vx - normal_impulse * nx, vy - normal_impulse * ny, wx, wy, wz
    remaining = max(vx * nx + vy * ny, 0.0)  # a nose far above the centre does not stop it completely
    return vx - remaining * nx, vy - remaining * ny, wx, wy, wz


@kernel
def _han2005(restitution: float, friction: float, a: Five, radius: float, height: float, nx: float, ny: float) -> Five:
    """Return a ball after a collision with friction with a nose above or below its centre (Han 2005, eqs. 14 to 20)."""
    vx, vy, wx, wy, wz = a
    # x into the cushion, y to its left
    x, y = vx * nx + vy * ny, vy * nx - vx * ny
    wa, wb = wx * nx + wy * ny, wy * nx - wx * ny
    sin = height / radius - 1.0
    cos = math.sqrt(1.0 - sin * sin)
    along, across = x * sin + radius * wb, -y - radius * wz * cos + radius * wa * sin
    slip = math.sqrt(along * along + across * across)
    normal_impulse = (1.0 + restitution) * x * cos
    friction_per_slip = min(slip / 3.5, friction * normal_impulse) / slip if slip > 0.0 else 0.0
    p, q = friction_per_slip * along, friction_per_slip * across
    turn = 2.5 / radius
    x, y = x - p * sin - normal_impulse * cos, y + q
    wa, wb, wz = wa - turn * q * sin, wb - turn * p, wz + turn * q * cos
    return x * nx - y * ny, x * ny + y * nx, wa * nx - wb * ny, wa * ny + wb * nx, wz


@kernel
def collide_pucks(
    restitution: float,
    friction: float,
    a: Five,
    b: Five,
    inverse_mass: tuple[float, float],
    radii: tuple[float, float],
    nx: float,
    ny: float,
) -> tuple[Five, Five]:
    """Return the velocities and spins of two pucks after a collision.

    Friction is Coulomb's, up to the impulse that ends the slip: the effective inverse mass at a disc's rim is 1/m +
    r²/I = 3/m.

    Args:
        restitution: along the normal.
        friction: of the two.
        a: velocity and spin of the first.
        b: of the second.
        inverse_mass: 1/mass of each, 1/kg; 0 for a fixed puck or cushion.
        radii: of each, m.
        nx: normal, from the first to the second.
        ny: likewise.
    """
    avx, avy, _, _, aw = a
    bvx, bvy, _, _, bw = b
    (inverse_a, inverse_b), (ra, rb) = inverse_mass, radii
    normal_impulse = (1.0 + restitution) * ((avx - bvx) * nx + (avy - bvy) * ny) / (inverse_a + inverse_b)
    # Slip of the first over the second, along t = (−n_y, n_x), the direction in which spin moves each rim.
    slip = (avy - bvy) * nx - (avx - bvx) * ny + ra * aw + rb * bw
    friction_impulse = math.copysign(min(friction * normal_impulse, abs(slip) / (3.0 * (inverse_a + inverse_b))), slip)
    jx, jy = normal_impulse * nx - friction_impulse * ny, normal_impulse * ny + friction_impulse * nx
    if inverse_a > 0.0:
        avx, avy, aw = avx - inverse_a * jx, avy - inverse_a * jy, aw - 2.0 * inverse_a * friction_impulse / ra
    if inverse_b > 0.0:
        bvx, bvy, bw = bvx + inverse_b * jx, bvy + inverse_b * jy, bw - 2.0 * inverse_b * friction_impulse / rb
    return (avx, avy, 0.0, 0.0, aw), (bvx, bvy, 0.0, 0.0, bw)
