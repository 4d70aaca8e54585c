"""Sequential impulses: kernels that solve contacts, and contacts together with joints.

Sequential impulses: contacts solved one after the other, again and again, until they agree (Catto 2005).

As in Munk2D (`cpArbiter.c`): accumulated impulses clamped to the friction cone, warm-started by those of the
last substep; overlap corrected by velocities of their own, which move bodies but are no part of their motion.
"""

from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.kernel import bare_kernel
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.reference.joint_rows import VelocityConstraints, one_pass, warm_start
from sandbox.engines.reference.manifold import Manifolds


@kernel
def approach(now: Manifolds, velocity: FloatArray, spin: FloatArray, out: FloatArray) -> None:
    """Write the normal velocity (K,) of each contact, m/s: negative where the two approach."""
    for k in range(len(now.key)):
        i, j = now.first[k], now.second[k]
        vx, vy = -velocity[i, 0], -velocity[i, 1]
        if j >= 0:
            vx += velocity[j, 0]
            vy += velocity[j, 1]
        out[k] = vx * now.normal[k, 0] + vy * now.normal[k, 1] + spin[i] * now.offset[k, 0]
        if j >= 0:
            out[k] -= spin[j] * now.offset[k, 1]


@kernel
def rebound_speeds(
    now: Manifolds, velocity: FloatArray, spin: FloatArray, restitution: FloatArray, out: FloatArray
) -> None:
    """Write the approach of each contact (K,), m/s, times its restitution; that is a table (S·S,) of surface pairs."""
    approach(now, velocity, spin, out)
    for k in range(len(out)):
        out[k] *= restitution[now.surface_pair[k]]


@kernel
def remembered(key: IntArray, old_key: IntArray, old: FloatArray, impulse: FloatArray) -> None:
    """Write the impulses of the same contacts in the last substep into impulse (K, 2); both keys ascend."""
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
    start_with(now, velocity, spin, inverse_mass, inverse_moment, impulse)
    for _ in range(iterations):
        solve_once(now, bounce, velocity, spin, inverse_mass, inverse_moment, impulse)


@kernel
def start_with(
    now: Manifolds,
    velocity: FloatArray,
    spin: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    impulse: FloatArray,
) -> None:
    """Apply the impulses (K, 2) that contacts start with; the arguments are those of `solve_velocities`."""
    for k in range(len(now.key)):
        _apply_impulse(now, k, impulse[k, 0], impulse[k, 1], velocity, spin, inverse_mass, inverse_moment)


@kernel
def solve_once(
    now: Manifolds,
    bounce: FloatArray,
    velocity: FloatArray,
    spin: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    impulse: FloatArray,
) -> None:
    """Pass over all contacts once; the arguments are those of `solve_velocities`."""
    for k in range(len(now.key)):
        i, j = now.first[k], now.second[k]
        nx, ny = now.normal[k, 0], now.normal[k, 1]
        a, a_off = now.arm[k, 0], now.offset[k, 0]
        mass = inverse_mass[i]
        along_mass = mass + inverse_moment[i] * a_off * a_off
        across_mass = mass + inverse_moment[i] * a * a
        vx, vy = -velocity[i, 0], -velocity[i, 1]
        slip_of_spin, turn = -spin[i] * a, spin[i] * a_off
        if j >= 0:
            b, b_off = now.arm[k, 1], now.offset[k, 1]
            mass += inverse_mass[j]
            along_mass += inverse_mass[j] + inverse_moment[j] * b_off * b_off
            across_mass += inverse_mass[j] + inverse_moment[j] * b * b
            vx += velocity[j, 0]
            vy += velocity[j, 1]
            slip_of_spin -= spin[j] * b
            turn -= spin[j] * b_off
        if mass == 0.0:
            continue
        along = (-(bounce[k] + (vx * nx + vy * ny) + turn)) / along_mass
        old_normal, old_tangent = impulse[k, 0], impulse[k, 1]
        impulse[k, 0] = max(old_normal + along, 0.0)
        most = now.friction[k] * impulse[k, 0]
        across = -(vy * nx - vx * ny + slip_of_spin) / across_mass
        impulse[k, 1] = min(max(old_tangent + across, -most), most)
        normal, tangent = impulse[k, 0] - old_normal, impulse[k, 1] - old_tangent
        _apply_impulse(now, k, normal, tangent, velocity, spin, inverse_mass, inverse_moment)


@kernel
def _apply_impulse(
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
    # The lever has two parts, along the normal and beside it: for discs only the first, which turns by rubbing.
    spin[i] -= inverse_moment[i] * (now.arm[k, 0] * tangent - now.offset[k, 0] * normal)
    if j >= 0:
        velocity[j, 0] += inverse_mass[j] * x
        velocity[j, 1] += inverse_mass[j] * y
        spin[j] -= inverse_moment[j] * (now.arm[k, 1] * tangent + now.offset[k, 1] * normal)


@kernel
def work_at(now: Manifolds, k: int, impulse: FloatArray, velocity: FloatArray, spin: FloatArray) -> tuple[float, float]:
    """Return the work of the impulses of one contact, J, along its normal and across it; see `contact_work`."""
    i, j = now.first[k], now.second[k]
    nx, ny = now.normal[k, 0], now.normal[k, 1]
    vx, vy = -velocity[i, 0], -velocity[i, 1]
    slip_of_spin, turn = -spin[i] * now.arm[k, 0], spin[i] * now.offset[k, 0]
    if j >= 0:
        vx += velocity[j, 0]
        vy += velocity[j, 1]
        slip_of_spin -= spin[j] * now.arm[k, 1]
        turn -= spin[j] * now.offset[k, 1]
    along = impulse[k, 0] * (vx * nx + vy * ny + turn)
    across = impulse[k, 1] * (vy * nx - vx * ny + slip_of_spin)
    return along, across


@kernel
def contact_work(now: Manifolds, impulse: FloatArray, velocity: FloatArray, spin: FloatArray) -> tuple[float, float]:
    """Return the work of impulses (K, 2), J, along the normals and across them.

    Args:
        now: K contacts.
        impulse: (K, 2) N·s along the normal and along the normal turned left.
        velocity: (N, ≥ 2) m/s, the mean of those before and after the impulses.
        spin: (N,) rad/s, likewise.
    """
    along, across = 0.0, 0.0
    for k in range(len(now.key)):
        work = work_at(now, k, impulse, velocity, spin)
        along += work[0]
        across += work[1]
    return along, across


@kernel
def solve_overlaps(
    now: Manifolds,
    target: FloatArray,
    pseudo_velocity: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    total: FloatArray,
    iterations: int,
) -> None:
    """Find the velocities that undo overlap, apart from those of the motion.

    Args:
        now: K contacts.
        target: (K,) m/s, how fast each is to part.
        pseudo_velocity: (N, 3) m/s and rad/s, changed.
        inverse_mass: (N,) 1/kg.
        inverse_moment: (N,) 1/(kg·m²).
        total: (K,) accumulated impulse of each, kg·m/s; 0 at first.
        iterations: passes over all contacts.
    """
    for _ in range(iterations):
        for k in range(len(now.key)):
            i, j = now.first[k], now.second[k]
            nx, ny = now.normal[k, 0], now.normal[k, 1]
            a_off, b_off = now.offset[k, 0], now.offset[k, 1]
            mass = inverse_mass[i] + inverse_moment[i] * a_off * a_off
            vx, vy, turn = -pseudo_velocity[i, 0], -pseudo_velocity[i, 1], pseudo_velocity[i, 2] * a_off
            if j >= 0:
                mass += inverse_mass[j] + inverse_moment[j] * b_off * b_off
                vx += pseudo_velocity[j, 0]
                vy += pseudo_velocity[j, 1]
                turn -= pseudo_velocity[j, 2] * b_off
            if mass == 0.0:
                continue
            old = total[k]
            total[k] = max(old + (target[k] - (vx * nx + vy * ny) - turn) / mass, 0.0)
            change = total[k] - old
            pseudo_velocity[i, 0] -= inverse_mass[i] * change * nx
            pseudo_velocity[i, 1] -= inverse_mass[i] * change * ny
            pseudo_velocity[i, 2] += inverse_moment[i] * change * a_off
            if j >= 0:
                pseudo_velocity[j, 0] += inverse_mass[j] * change * nx
                pseudo_velocity[j, 1] += inverse_mass[j] * change * ny
                pseudo_velocity[j, 2] -= inverse_moment[j] * change * b_off


class AngularStops(NamedTuple):
    """S bodies that are pressed onto a stop."""

    body: IntArray
    """(S,)"""
    direction: FloatArray
    """(S,) 1 or −1: the sense in which the stop lets it turn no further"""
    impulse: FloatArray
    """(S,) N·m·s, against that sense; that to start with, and then the sum"""


NO_STOPS = AngularStops(np.empty(0, np.int64), np.empty(0), np.empty(0))


@bare_kernel
def solve_together(
    now: Manifolds,
    bounce: FloatArray,
    rows: VelocityConstraints,
    stops: AngularStops,
    velocity: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    impulse: FloatArray,
    iterations: int,
) -> None:
    """Give contacts, joints and stops the impulses that they ask for, in this order in each pass, as Munk2D does.

    Args:
        now: K contacts.
        bounce: (K,) m/s, as `solve_velocities` takes it.
        rows: of the joints, prepared.
        stops: one-sided constraints.
        velocity: (N, 3) m/s and rad/s, changed.
        inverse_mass: (N,) 1/kg.
        inverse_moment: (N,) 1/(kg·m²).
        impulse: (K, 2) N·s of the contacts; those to start with, and then the sums.
        iterations: passes over all.
    """
    spin = velocity[:, 2]
    start_with(now, velocity, spin, inverse_mass, inverse_moment, impulse)
    warm_start(rows, velocity, inverse_mass, inverse_moment)
    for k in range(len(stops.body)):
        spin[stops.body[k]] -= stops.direction[k] * stops.impulse[k] * inverse_moment[stops.body[k]]
    for _ in range(iterations):
        solve_once(now, bounce, velocity, spin, inverse_mass, inverse_moment, impulse)
        one_pass(rows, velocity, inverse_mass, inverse_moment)
        for k in range(len(stops.body)):
            n, direction, old = stops.body[k], stops.direction[k], stops.impulse[k]
            stops.impulse[k] = max(old + direction * spin[n] / inverse_moment[n], 0.0)
            spin[n] -= direction * (stops.impulse[k] - old) * inverse_moment[n]
