"""Springs: contacts as stiff springs with dampers.

    F = k·overlap + c·closing speed, never pulling;   friction: min(μ F, γ·slip), against the slip

A pair's damping follows from its restitution, for a contact that ends when its force does (Schwager & Pöschel 2007,
Granular Matter 9, 465): the damping ratio ζ alone, whatever the masses and the speed. Overlap is the price: speed over
√(k/m) at impact, m g/k at rest. Friction creeps, as it needs a slip to act.
"""

import math

from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.engines.reference.manifolds import Manifolds
from sandbox.trajectory import FloatArray, IntArray

LEAST_RESTITUTION = 0.02
"""Below, the damper would have to be stiffer than any step could bear."""


def restitution_of(damping: float) -> float:
    """Return the restitution of a spring contact with a damping ratio ζ ≥ 0 that ends when its force does."""
    z = damping
    if z < 1.0:
        root = math.sqrt(1.0 - z * z)
        # The angle at which force ends, π at no damping, falling to 0 at critical: one arc tangent, in two quadrants.
        return math.exp(-z / root * math.atan2(2.0 * z * root, 2.0 * z * z - 1.0))
    if z == 1.0:
        return math.exp(-2.0)
    root = math.sqrt(z * z - 1.0)
    return math.exp(-z / root * math.log((z + root) / (z - root)))


def damping_of(restitution: float) -> float:
    """Return the damping ratio of a restitution from `LEAST_RESTITUTION` to 1, by bisection."""
    low, high = 0.0, 8.0
    while high - low > 1e-15 * (1.0 + low):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (middle, high) if restitution_of(middle) > restitution else (low, middle)
    return low


@kernel
def _forces(
    now: Manifolds,
    k: int,
    rates: FloatArray,
    spin: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    stiffness: float,
) -> tuple[float, float, float, float]:
    """Return contact k's force along its normal and across, N, and how fast it parts and slips, m/s."""
    i, j = now.first[k], now.second[k]
    nx, ny = now.normal[k, 0], now.normal[k, 1]
    a, b = now.arm[k, 0], now.arm[k, 1]
    a_off, b_off = now.offset[k, 0], now.offset[k, 1]
    mass = inverse_mass[i] + inverse_moment[i] * a_off * a_off
    turning = inverse_moment[i] * (a * a - a_off * a_off)
    vx, vy, rub = -rates[i, 0], -rates[i, 1], -spin[i] * a
    roll = spin[i] * a_off
    if j >= 0:
        mass += inverse_mass[j] + inverse_moment[j] * b_off * b_off
        turning += inverse_moment[j] * (b * b - b_off * b_off)
        vx += rates[j, 0]
        vy += rates[j, 1]
        rub -= spin[j] * b
        roll -= spin[j] * b_off
    if mass == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    damper = 2.0 * now.coefficient[k, 0] * math.sqrt(stiffness / mass)
    parting, slip = vx * nx + vy * ny + roll, vy * nx - vx * ny + rub
    normal = max(-stiffness * now.separation[k] - damper * parting, 0.0)
    most = now.coefficient[k, 1] * normal
    # A viscous slope that damps slip as fast as the spring swings, so that it asks for no smaller step.
    tangent = min(max(-math.sqrt(stiffness * mass) / (mass + turning) * slip, -most), most)
    return normal, tangent, parting, slip


@kernel
def penalty_losses(
    now: Manifolds,
    rates: FloatArray,
    spin: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    stiffness: float,
) -> tuple[float, float]:
    """Return the power, W, of dampers, and of forces that were cut short, along normals and across; never above 0.

    Arguments as in `penalty_forces`.
    """
    along, across = 0.0, 0.0
    for k in range(len(now.key)):
        normal, tangent, parting, slip = _forces(now, k, rates, spin, inverse_mass, inverse_moment, stiffness)
        along += (normal + stiffness * now.separation[k]) * parting
        across += tangent * slip
    return along, across


@kernel
def penalty_forces(
    now: Manifolds,
    row: IntArray,
    rates: FloatArray,
    spin: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    stiffness: float,
    acceleration: FloatArray,
    turn: FloatArray,
) -> None:
    """Add the accelerations of spring contacts.

    Args:
        now: K contacts; their first coefficient is the damping ratio.
        row: (K,) where in `acceleration` each contact's own force goes.
        rates: (N + …, ≥ 2) velocities, m/s.
        spin: (N + …,) rad/s.
        inverse_mass: (N,) 1/kg.
        inverse_moment: (N,) 1/(kg·m²).
        stiffness: k, N/m.
        acceleration: (N + …, ≥ 2) added to, m/s²; in a contact's row, the force on its second, N.
        turn: (N + …,) added to, rad/s².
    """
    for k in range(len(now.key)):
        i, j = now.first[k], now.second[k]
        nx, ny = now.normal[k, 0], now.normal[k, 1]
        a, b = now.arm[k, 0], now.arm[k, 1]
        a_off, b_off = now.offset[k, 0], now.offset[k, 1]
        normal, tangent, _, _ = _forces(now, k, rates, spin, inverse_mass, inverse_moment, stiffness)
        x, y = nx * normal - ny * tangent, nx * tangent + ny * normal
        acceleration[i, 0] -= inverse_mass[i] * x
        acceleration[i, 1] -= inverse_mass[i] * y
        turn[i] -= inverse_moment[i] * (a * tangent - a_off * normal)
        if j >= 0:
            acceleration[j, 0] += inverse_mass[j] * x
            acceleration[j, 1] += inverse_mass[j] * y
            turn[j] -= inverse_moment[j] * (b * tangent + b_off * normal)
        acceleration[row[k], 0] += x
        acceleration[row[k], 1] += y
