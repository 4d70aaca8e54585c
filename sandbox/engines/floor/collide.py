"""Collide: what a hit does to spheres on a floor; one function a model.

Velocities along z are left out: the floor takes them, and nothing jumps. n points from the first to the second.
"""

import math

from sandbox.engines.floor.mathavan import mathavan2010
from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.scene.floor import BallBall, Cushion

ELASTIC, FRICTIONAL = range(2)
SIMPLE, HAN2005, MATHAVAN2010 = range(3)
BALL_BALL: dict[BallBall, int] = {"elastic": ELASTIC, "frictional": FRICTIONAL}
CUSHION: dict[Cushion, int] = {"simple": SIMPLE, "han2005": HAN2005, "mathavan2010": MATHAVAN2010}
"""Models of ball and ball, and of ball and cushion, as `[contact_models]` names them."""

Five = tuple[float, float, float, float, float]
"""v_x, v_y, m/s; ω_x, ω_y, ω_z, rad/s"""

STILL: Five = (0.0, 0.0, 0.0, 0.0, 0.0)


@kernel
def rubbing(slip: float) -> float:
    """Return the friction between phenolic balls that slip at a speed, m/s (Alciatore TP A.14)."""
    return 0.009951 + 0.108 * math.exp(-1.088 * slip)


@kernel
def meet(
    model: int,
    restitution: float,
    a: Five,
    b: Five,
    lightness: tuple[float, float],
    radius: float,
    nx: float,
    ny: float,
) -> tuple[Five, Five]:
    """Return both balls after they have hit each other.

    Args:
        model: `ELASTIC` or `FRICTIONAL`.
        restitution: along the normal.
        a: velocity and spin of the first.
        b: of the second.
        lightness: 1/mass of each, 1/kg; 0 for what never moves.
        radius: of both, m.
        nx: normal, from the first to the second.
        ny: likewise.
    """
    avx, avy, awx, awy, awz = a
    bvx, bvy, bwx, bwy, bwz = b
    la, lb = lightness
    closing = (avx - bvx) * nx + (avy - bvy) * ny
    impulse = (1.0 + restitution) * closing / (la + lb)
    if model == FRICTIONAL:
        # Slip of the first over the second at the point of contact: along t = (−n_y, n_x), and along z.
        along = (avy - bvy) * nx - (avx - bvx) * ny + radius * (awz + bwz)
        up = radius * ((awx + bwx) * ny - (awy + bwy) * nx)
        slip = math.sqrt(along * along + up * up)
        if slip > 0.0:
            # Coulomb's law, and no more than what ends the slip: 7/2 of the inverse masses is how it yields.
            rub = min(rubbing(slip) * impulse, slip / (3.5 * (la + lb))) / slip
            dt, dz = -rub * along, -rub * up
            turn = 2.5 / radius
            avx, avy = avx - la * dt * ny, avy + la * dt * nx
            bvx, bvy = bvx + lb * dt * ny, bvy - lb * dt * nx
            awx, awy, awz = awx + turn * la * dz * ny, awy - turn * la * dz * nx, awz + turn * la * dt
            bwx, bwy, bwz = bwx + turn * lb * dz * ny, bwy - turn * lb * dz * nx, bwz + turn * lb * dt
    avx, avy = avx - la * impulse * nx, avy - la * impulse * ny
    bvx, bvy = bvx + lb * impulse * nx, bvy + lb * impulse * ny
    return (avx, avy, awx, awy, awz), (bvx, bvy, bwx, bwy, bwz)


@kernel
def rebound(
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
    """Return a ball after it has hit a cushion, into which it goes no further.

    Args:
        model: `SIMPLE`, `HAN2005` or `MATHAVAN2010`.
        restitution: along the normal of contact.
        friction: of ball and cushion, which `SIMPLE` has not.
        sliding: of ball and floor, which only `MATHAVAN2010` asks for.
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
        push = (1.0 + restitution) * (vx * nx + vy * ny)
        return vx - push * nx, vy - push * ny, wx, wy, wz
    still = max(vx * nx + vy * ny, 0.0)  # a nose far above the centre leaves it some of its way
    return vx - still * nx, vy - still * ny, wx, wy, wz


@kernel
def _han2005(restitution: float, friction: float, a: Five, radius: float, height: float, nx: float, ny: float) -> Five:
    """Return a ball after a nose above or below its centre has hit and rubbed it (Han 2005, eqs. 14 to 20)."""
    vx, vy, wx, wy, wz = a
    # x into the cushion, y to its left
    x, y = vx * nx + vy * ny, vy * nx - vx * ny
    wa, wb = wx * nx + wy * ny, wy * nx - wx * ny
    sin = height / radius - 1.0
    cos = math.sqrt(1.0 - sin * sin)
    along, across = x * sin + radius * wb, -y - radius * wz * cos + radius * wa * sin
    slip = math.sqrt(along * along + across * across)
    push = (1.0 + restitution) * x * cos
    rub = min(slip / 3.5, friction * push) / slip if slip > 0.0 else 0.0
    p, q = rub * along, rub * across
    turn = 2.5 / radius
    x, y = x - p * sin - push * cos, y + q
    wa, wb, wz = wa - turn * q * sin, wb - turn * p, wz + turn * q * cos
    return x * nx - y * ny, x * ny + y * nx, wa * nx - wb * ny, wa * ny + wb * nx, wz
