"""Sequential impulses: contacts solved one after the other, again and again, until they agree (Catto 2005).

As in Munk2D (`cpArbiter.c`): accumulated impulses clamped to what a contact can give, warm-started by those of the
last substep; overlap corrected by velocities of their own, which move bodies but are no part of their motion.
"""

from sandbox.engines.kernel import kernel
from sandbox.engines.reference.manifolds import Manifolds
from sandbox.trajectory import FloatArray, IntArray


@kernel
def approach(now: Manifolds, velocity: FloatArray, out: FloatArray) -> None:
    """Write the normal velocity (K,) of each contact, m/s: negative where the two approach."""
    for k in range(len(now.key)):
        i, j = now.first[k], now.second[k]
        vx, vy = -velocity[i, 0], -velocity[i, 1]
        if j >= 0:
            vx += velocity[j, 0]
            vy += velocity[j, 1]
        out[k] = vx * now.normal[k, 0] + vy * now.normal[k, 1]


@kernel
def remembered(key: IntArray, old_key: IntArray, old: FloatArray, impulse: FloatArray) -> None:
    """Write into impulse (K, 2) what the same contacts had in the last substep; both keys ascend."""
    place = 0
    for k in range(len(key)):
        while place < len(old_key) and old_key[place] < key[k]:
            place += 1
        if place < len(old_key) and old_key[place] == key[k]:
            impulse[k, 0], impulse[k, 1] = old[place, 0], old[place, 1]


@kernel
def solve_velocities(
    now: Manifolds,
    bounce: FloatArray,
    velocity: FloatArray,
    spin: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    impulse: FloatArray,
    iterations: int,
) -> None:
    """Give contacts the impulses that part them with `bounce`, within the friction cone.

    Args:
        now: K contacts.
        bounce: (K,) m/s, the wanted normal velocity is its negative.
        velocity: (N, ≥ 2) m/s, changed.
        spin: (N,) rad/s, changed.
        inverse_mass: (N,) 1/kg.
        inverse_moment: (N,) 1/(kg·m²).
        impulse: (K, 2) N·s along the normal and along the normal turned left; those to start with, and then the sums.
        iterations: passes over all contacts.
    """
    for k in range(len(now.key)):
        _push(now, k, impulse[k, 0], impulse[k, 1], velocity, spin, inverse_mass, inverse_moment)
    for _ in range(iterations):
        for k in range(len(now.key)):
            i, j = now.first[k], now.second[k]
            nx, ny = now.normal[k, 0], now.normal[k, 1]
            a, b = now.arm[k, 0], now.arm[k, 1]
            mass = inverse_mass[i]
            turning = inverse_moment[i] * a * a
            vx, vy = -velocity[i, 0], -velocity[i, 1]
            rub = -spin[i] * a
            if j >= 0:
                mass += inverse_mass[j]
                turning += inverse_moment[j] * b * b
                vx += velocity[j, 0]
                vy += velocity[j, 1]
                rub -= spin[j] * b
            if mass == 0.0:
                continue
            along = (-(bounce[k] + (vx * nx + vy * ny))) / mass
            old_normal, old_tangent = impulse[k, 0], impulse[k, 1]
            impulse[k, 0] = max(old_normal + along, 0.0)
            most = now.coefficient[k, 1] * impulse[k, 0]
            across = -(vy * nx - vx * ny + rub) / (mass + turning)
            impulse[k, 1] = min(max(old_tangent + across, -most), most)
            normal, tangent = impulse[k, 0] - old_normal, impulse[k, 1] - old_tangent
            _push(now, k, normal, tangent, velocity, spin, inverse_mass, inverse_moment)


@kernel
def _push(
    now: Manifolds,
    k: int,
    normal: float,
    tangent: float,
    velocity: FloatArray,
    spin: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
) -> None:
    """Apply an impulse to the second of a contact, and its opposite to the first."""
    i, j = now.first[k], now.second[k]
    nx, ny = now.normal[k, 0], now.normal[k, 1]
    x, y = nx * normal - ny * tangent, nx * tangent + ny * normal
    velocity[i, 0] -= inverse_mass[i] * x
    velocity[i, 1] -= inverse_mass[i] * y
    # The lever is the normal itself times the arm: only the tangential part turns anything.
    spin[i] -= inverse_moment[i] * now.arm[k, 0] * tangent
    if j >= 0:
        velocity[j, 0] += inverse_mass[j] * x
        velocity[j, 1] += inverse_mass[j] * y
        spin[j] -= inverse_moment[j] * now.arm[k, 1] * tangent


@kernel
def solve_overlaps(
    now: Manifolds,
    target: FloatArray,
    push: FloatArray,
    inverse_mass: FloatArray,
    iterations: int,
) -> None:
    """Find the velocities that undo overlap, apart from those of the motion.

    Args:
        now: K contacts.
        target: (K,) m/s, how fast each is to part.
        push: (N, ≥ 2) m/s, changed.
        inverse_mass: (N,) 1/kg.
        iterations: passes over all contacts.
    """
    total = target * 0.0
    for _ in range(iterations):
        for k in range(len(now.key)):
            i, j = now.first[k], now.second[k]
            nx, ny = now.normal[k, 0], now.normal[k, 1]
            mass = inverse_mass[i]
            vx, vy = -push[i, 0], -push[i, 1]
            if j >= 0:
                mass += inverse_mass[j]
                vx += push[j, 0]
                vy += push[j, 1]
            if mass == 0.0:
                continue
            old = total[k]
            total[k] = max(old + (target[k] - (vx * nx + vy * ny)) / mass, 0.0)
            change = total[k] - old
            push[i, 0] -= inverse_mass[i] * change * nx
            push[i, 1] -= inverse_mass[i] * change * ny
            if j >= 0:
                push[j, 0] += inverse_mass[j] * change * nx
                push[j, 1] += inverse_mass[j] * change * ny
