"""Knock: what a hit does to pucks on a floor, flat discs with upright sides: a hit in the plane, of discs that rub."""

import math

from sandbox.engines.floor.collide import Five
from sandbox.engines.kernel import bare_kernel as kernel


@kernel
def knock(
    restitution: float,
    friction: float,
    a: Five,
    b: Five,
    lightness: tuple[float, float],
    radii: tuple[float, float],
    nx: float,
    ny: float,
) -> tuple[Five, Five]:
    """Return both pucks after they have hit each other.

    The friction is Coulomb's, and ends the slip at most: a disc's rim yields to it as 1/m + r²/I = 3/m.

    Args:
        restitution: along the normal.
        friction: of the two.
        a: velocity and spin of the first.
        b: of the second.
        lightness: 1/mass of each, 1/kg; 0 for what never moves.
        radii: of each, m.
        nx: normal, from the first to the second.
        ny: likewise.
    """
    avx, avy, _, _, aw = a
    bvx, bvy, _, _, bw = b
    (la, lb), (ra, rb) = lightness, radii
    push = (1.0 + restitution) * ((avx - bvx) * nx + (avy - bvy) * ny) / (la + lb)
    # Slip of the first over the second, along t = (−n_y, n_x), which is where a spin of either moves its own rim.
    slip = (avy - bvy) * nx - (avx - bvx) * ny + ra * aw + rb * bw
    rub = math.copysign(min(friction * push, abs(slip) / (3.0 * (la + lb))), slip)
    jx, jy = push * nx - rub * ny, push * ny + rub * nx
    if la > 0.0:
        avx, avy, aw = avx - la * jx, avy - la * jy, aw - 2.0 * la * rub / ra
    if lb > 0.0:
        bvx, bvy, bw = bvx + lb * jx, bvy + lb * jy, bw - 2.0 * lb * rub / rb
    return (avx, avy, 0.0, 0.0, aw), (bvx, bvy, 0.0, 0.0, bw)
