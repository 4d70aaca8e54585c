"""Sequential impulses: kernels that solve contacts, and contacts together with joints (Catto 2005).

Rolling resistance is a friction of the relative spin of two bodies: a row for each contact, whose angular impulse stays
within c·r times the accumulated normal impulse, as in Box2D v3.

As in Munk2D (`cpArbiter.c`), accumulated impulses are clamped to the friction cone and warm-started by those of the
last substep. Overlap is corrected by pseudo-velocities, which move bodies but are not part of their motion.

Energy-limited restitution: with friction, Newton's law of restitution can add energy where normal and tangential
impulses are coupled, as at the corner of a box (Kane & Levinson 1985; Stronge, Impact Mechanics, ch. 3). With the
dissipative law of impact, the impulses of each group of connected bodies are then

    p(s) = p₀ + s (p₁ − p₀),   0 ≤ s < 1,

between those without restitution, p₀, which only remove energy, and Newton's, p₁, with the largest s at which contacts
add none. All p(s) lie within the friction cones, which are convex, and leave no approach.
"""

from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.kernel import bare_kernel, kernel
from sandbox.engines.reference.joint_rows import VelocityConstraints, solve_joints_once, warm_start_joints
from sandbox.engines.reference.manifold import Manifolds


@bare_kernel
def approach(contacts: Manifolds, velocity: FloatArray, spin: FloatArray, out: FloatArray) -> None:
    """Write the normal velocity (K,) of each contact, m/s: negative if the bodies approach."""
    for k in range(len(contacts.key)):
        i, j = contacts.first[k], contacts.second[k]
        vx, vy = -velocity[i, 0], -velocity[i, 1]
        if j >= 0:
            vx += velocity[j, 0]
            vy += velocity[j, 1]
        out[k] = vx * contacts.normal[k, 0] + vy * contacts.normal[k, 1] + spin[i] * contacts.rt[k, 0]
        if j >= 0:
            out[k] -= spin[j] * contacts.rt[k, 1]


@bare_kernel
def rebound_speeds(
    contacts: Manifolds, velocity: FloatArray, spin: FloatArray, restitution: FloatArray, out: FloatArray
) -> None:
    """Write the normal velocity of each contact (K,), m/s, times the restitution, a table (S·S,) of surface pairs."""
    approach(contacts, velocity, spin, out)
    for k in range(len(out)):
        out[k] *= restitution[contacts.surface_pair[k]]


@bare_kernel
def match_impulses(key: IntArray, old_key: IntArray, old: FloatArray, impulse: FloatArray) -> None:
    """Write the impulses of the same contacts in the last substep into `impulse` (K, 2); both keys ascend."""
    index = 0
    for k in range(len(key)):
        while index < len(old_key) and old_key[index] < key[k]:
            index += 1
        if index < len(old_key) and old_key[index] == key[k]:
            impulse[k, 0], impulse[k, 1] = old[index, 0], old[index, 1]


@bare_kernel
def solve_velocities(
    contacts: Manifolds,
    bounce: FloatArray,
    velocity: FloatArray,
    spin: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    impulse: FloatArray,
    iterations: int,
) -> None:
    """Solve contacts by impulses for a restitution target `bounce`, within the friction cone.

    Args:
        contacts: K contacts.
        bounce: (K,) m/s, the negative of the target normal velocity.
        velocity: (N, ≥ 2) m/s, changed.
        spin: (N,) rad/s, changed.
        inverse_mass: (N,) 1/kg.
        inverse_moment: (N,) 1/(kg·m²).
        impulse: (K, 2) N·s along the normal and along the normal turned left: initial, then accumulated.
        iterations: passes over all contacts. After one that changes nothing, further ones would not either.
    """
    warm_start_contacts(contacts, velocity, spin, inverse_mass, inverse_moment, impulse)
    for _ in range(iterations):
        if not solve_contacts_once(contacts, bounce, velocity, spin, inverse_mass, inverse_moment, impulse):
            break


@bare_kernel
def warm_start_contacts(
    contacts: Manifolds,
    velocity: FloatArray,
    spin: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    impulse: FloatArray,
) -> None:
    """Apply the initial impulses (K, 2); the arguments are those of `solve_velocities`."""
    for k in range(len(contacts.key)):
        _apply_impulse(contacts, k, impulse[k, 0], impulse[k, 1], velocity, spin, inverse_mass, inverse_moment)


@bare_kernel
def solve_contacts_once(
    contacts: Manifolds,
    bounce: FloatArray,
    velocity: FloatArray,
    spin: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    impulse: FloatArray,
) -> bool:
    """Pass over all contacts once; the arguments are those of `solve_velocities`. Return whether an impulse changed."""
    has_changed = False
    for k in range(len(contacts.key)):
        i, j = contacts.first[k], contacts.second[k]
        nx, ny = contacts.normal[k, 0], contacts.normal[k, 1]
        # Effective masses along the normal and the tangent, and the relative velocity at the contact
        rn_a, rt_a = contacts.rn[k, 0], contacts.rt[k, 0]
        mass = inverse_mass[i]
        inverse_normal_mass = mass + inverse_moment[i] * rt_a * rt_a
        inverse_tangent_mass = mass + inverse_moment[i] * rn_a * rn_a
        vx, vy = -velocity[i, 0], -velocity[i, 1]
        slip_of_spin, turn = -spin[i] * rn_a, spin[i] * rt_a
        if j >= 0:
            rn_b, rt_b = contacts.rn[k, 1], contacts.rt[k, 1]
            mass += inverse_mass[j]
            inverse_normal_mass += inverse_mass[j] + inverse_moment[j] * rt_b * rt_b
            inverse_tangent_mass += inverse_mass[j] + inverse_moment[j] * rn_b * rn_b
            vx += velocity[j, 0]
            vy += velocity[j, 1]
            slip_of_spin -= spin[j] * rn_b
            turn -= spin[j] * rt_b
        if mass == 0.0:
            continue
        old_normal, old_tangent = impulse[k, 0], impulse[k, 1]
        # Normal impulse: the accumulated one never pulls
        along = (-(bounce[k] + (vx * nx + vy * ny) + turn)) / inverse_normal_mass
        impulse[k, 0] = max(old_normal + along, 0.0)
        # Friction impulse: the accumulated one stays within Coulomb's cone
        max_friction = contacts.friction[k] * impulse[k, 0]
        across = -(vy * nx - vx * ny + slip_of_spin - contacts.slip_target[k]) / inverse_tangent_mass
        impulse[k, 1] = min(max(old_tangent + across, -max_friction), max_friction)
        # Apply the change of both
        normal, tangent = impulse[k, 0] - old_normal, impulse[k, 1] - old_tangent
        has_changed = has_changed or normal != 0.0 or tangent != 0.0
        _apply_impulse(contacts, k, normal, tangent, velocity, spin, inverse_mass, inverse_moment)
    return has_changed


@bare_kernel
def _apply_impulse(
    contacts: Manifolds,
    k: int,
    normal: float,
    tangent: float,
    velocity: FloatArray,
    spin: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
) -> None:
    """Apply an impulse to the second body of a contact, and its opposite to the first."""
    i, j = contacts.first[k], contacts.second[k]
    nx, ny = contacts.normal[k, 0], contacts.normal[k, 1]
    x, y = nx * normal - ny * tangent, nx * tangent + ny * normal
    velocity[i, 0] -= inverse_mass[i] * x
    velocity[i, 1] -= inverse_mass[i] * y
    # r × J; of discs only rn is not 0
    spin[i] -= inverse_moment[i] * (contacts.rn[k, 0] * tangent - contacts.rt[k, 0] * normal)
    if j >= 0:
        velocity[j, 0] += inverse_mass[j] * x
        velocity[j, 1] += inverse_mass[j] * y
        spin[j] -= inverse_moment[j] * (contacts.rn[k, 1] * tangent + contacts.rt[k, 1] * normal)


@bare_kernel
def work_at(
    contacts: Manifolds, k: int, impulse: FloatArray, velocity: FloatArray, spin: FloatArray
) -> tuple[float, float]:
    """Return the normal and tangential work of the impulses of one contact, J; see `contact_work`."""
    i, j = contacts.first[k], contacts.second[k]
    nx, ny = contacts.normal[k, 0], contacts.normal[k, 1]
    vx, vy = -velocity[i, 0], -velocity[i, 1]
    slip_of_spin, turn = -spin[i] * contacts.rn[k, 0], spin[i] * contacts.rt[k, 0]
    if j >= 0:
        vx += velocity[j, 0]
        vy += velocity[j, 1]
        slip_of_spin -= spin[j] * contacts.rn[k, 1]
        turn -= spin[j] * contacts.rt[k, 1]
    along = impulse[k, 0] * (vx * nx + vy * ny + turn)
    across = impulse[k, 1] * (vy * nx - vx * ny + slip_of_spin)
    return along, across


@bare_kernel
def contact_work(
    contacts: Manifolds, impulse: FloatArray, velocity: FloatArray, spin: FloatArray
) -> tuple[float, float]:
    """Return the normal and tangential work of impulses (K, 2), J.

    Args:
        contacts: K contacts.
        impulse: (K, 2) N·s along the normal and along the normal turned left.
        velocity: (N, ≥ 2) m/s, the mean of those before and after the impulses.
        spin: (N,) rad/s, likewise.
    """
    along, across = 0.0, 0.0
    for k in range(len(contacts.key)):
        work = work_at(contacts, k, impulse, velocity, spin)
        along += work[0]
        across += work[1]
    return along, across


@bare_kernel
def solve_overlaps(
    contacts: Manifolds,
    target: FloatArray,
    pseudo_velocity: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    total: FloatArray,
    iterations: int,
) -> None:
    """Find the pseudo-velocities that correct overlap.

    Args:
        contacts: K contacts.
        target: (K,) m/s, target separation rate.
        pseudo_velocity: (N, 3) m/s and rad/s, changed.
        inverse_mass: (N,) 1/kg.
        inverse_moment: (N,) 1/(kg·m²).
        total: (K,) accumulated impulse of each contact, kg·m/s; initially 0.
        iterations: passes over all contacts, as in `solve_velocities`.
    """
    for _ in range(iterations):
        has_changed = False
        for k in range(len(contacts.key)):
            i, j = contacts.first[k], contacts.second[k]
            nx, ny = contacts.normal[k, 0], contacts.normal[k, 1]
            # Effective mass and separation rate
            rt_a, rt_b = contacts.rt[k, 0], contacts.rt[k, 1]
            mass = inverse_mass[i] + inverse_moment[i] * rt_a * rt_a
            vx, vy, turn = -pseudo_velocity[i, 0], -pseudo_velocity[i, 1], pseudo_velocity[i, 2] * rt_a
            if j >= 0:
                mass += inverse_mass[j] + inverse_moment[j] * rt_b * rt_b
                vx += pseudo_velocity[j, 0]
                vy += pseudo_velocity[j, 1]
                turn -= pseudo_velocity[j, 2] * rt_b
            if mass == 0.0:
                continue
            # Normal impulse: the accumulated one never pulls
            old = total[k]
            total[k] = max(old + (target[k] - (vx * nx + vy * ny) - turn) / mass, 0.0)
            change = total[k] - old
            has_changed = has_changed or change != 0.0
            # Apply its change
            pseudo_velocity[i, 0] -= inverse_mass[i] * change * nx
            pseudo_velocity[i, 1] -= inverse_mass[i] * change * ny
            pseudo_velocity[i, 2] += inverse_moment[i] * change * rt_a
            if j >= 0:
                pseudo_velocity[j, 0] += inverse_mass[j] * change * nx
                pseudo_velocity[j, 1] += inverse_mass[j] * change * ny
                pseudo_velocity[j, 2] -= inverse_moment[j] * change * rt_b
        if not has_changed:
            break


TURNOVER_ROUNDING = 1e-13
"""Energy gain, as a fraction of the sum of absolute works, that is rounding error"""


class GroupWork:
    """Work of the impulses of K contacts, J, summed over each group of connected bodies."""

    def __init__(self, contacts: Manifolds, inverse_mass: FloatArray, inverse_moment: FloatArray) -> None:
        bodies = len(inverse_mass)
        moves = (inverse_mass > 0.0) | (inverse_moment > 0.0)
        self.group: IntArray = np.arange(bodies)
        join_groups(contacts.first, contacts.second, moves, self.group)
        self._contacts = contacts
        self.of_contact: IntArray = self.group[
            np.where(moves[contacts.first], contacts.first, np.maximum(contacts.second, 0))
        ]

    def work(self, impulse: FloatArray, velocity: FloatArray, spin: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the work of impulses (K, 2) at velocities (N, D) and spins (N,) by group, (N,), and its modulus."""
        out, turnover = np.zeros(len(self.group)), np.zeros(len(self.group))
        sum_work(self._contacts, impulse, velocity, spin, self.of_contact, out, turnover)
        return out, turnover


def largest_fractions(work: FloatArray, slope: FloatArray, curve: FloatArray) -> FloatArray:
    """Return the largest s ≤ 1, (N,), with work + slope·s + curve·s² ≤ 0, curve ≥ 0; 0 if there is none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(np.maximum(slope * slope - 4.0 * curve * work, 0.0))
        # The larger root, in the form without cancellation
        fraction = np.where(slope > 0.0, -2.0 * work / (slope + root), (root - slope) / (2.0 * curve))
    fraction = np.where(work + slope + curve <= 0.0, 1.0, fraction)
    return np.where(np.isfinite(fraction), np.clip(fraction, 0.0, 1.0), 0.0)


@kernel
def join_groups(first: IntArray, second: IntArray, moves: BoolArray, group: IntArray) -> None:
    """Write into group (N,) the lowest index among the bodies connected to each by contacts, ignoring fixed bodies."""
    for k in range(len(first)):
        i, j = first[k], second[k]
        if j < 0 or not (moves[i] and moves[j]):
            continue
        while group[i] != i:  # path halving: without it a chain of bodies takes quadratic time
            group[i] = group[group[i]]
            i = group[i]
        while group[j] != j:
            group[j] = group[group[j]]
            j = group[j]
        group[max(i, j)] = min(i, j)
    for i in range(len(group)):  # the root of a group has a lower index
        group[i] = group[group[i]]


@kernel
def sum_work(
    contacts: Manifolds,
    impulse: FloatArray,
    velocity: FloatArray,
    spin: FloatArray,
    group: IntArray,
    out: FloatArray,
    turnover: FloatArray,
) -> None:
    """Add the work of each contact's impulse to that of its group; `contact_work` returns the sum over all."""
    for k in range(len(contacts.key)):
        along, across = work_at(contacts, k, impulse, velocity, spin)
        out[group[k]] += along + across
        turnover[group[k]] += abs(along) + abs(across)


class AngularStops(NamedTuple):
    """S bodies that are pressed against a stop."""

    body: IntArray
    """(S,)"""
    direction: FloatArray
    """(S,) 1 or −1: direction of rotation that the stop blocks"""
    impulse: FloatArray
    """(S,) N·m·s, against that direction: initial, then accumulated"""


NO_STOPS = AngularStops(np.empty(0, np.int64), np.empty(0), np.empty(0))


class RollingRows(NamedTuple):
    """Rolling resistance of K contacts: an angular impulse up to `reach` times the normal impulse opposes rolling."""

    reach: FloatArray
    """(K,) c·r, m; 0 for contacts without. Empty if there is no such contact"""
    impulse: FloatArray
    """(K,) N·m·s on the second body, and its opposite on the first: initial, then accumulated"""


NO_ROLLING = RollingRows(np.empty(0), np.empty(0))


@bare_kernel
def _apply_rolling(contacts: Manifolds, k: int, change: float, spin: FloatArray, inverse_moment: FloatArray) -> None:
    """Apply an angular impulse to the second body of a contact, and its opposite to the first."""
    i, j = contacts.first[k], contacts.second[k]
    spin[i] -= inverse_moment[i] * change
    if j >= 0:
        spin[j] += inverse_moment[j] * change


@bare_kernel
def solve_rolling_once(
    contacts: Manifolds, rolling: RollingRows, spin: FloatArray, inverse_moment: FloatArray, impulse: FloatArray
) -> None:
    """Pass over the rolling resistance of all contacts once, within the bounds by their normal impulses so far."""
    for k in range(len(rolling.reach)):
        i, j = contacts.first[k], contacts.second[k]
        inverse, rate = inverse_moment[i], -spin[i]
        if j >= 0:
            inverse += inverse_moment[j]
            rate += spin[j]
        if rolling.reach[k] == 0.0 or inverse == 0.0:
            continue
        bound, old = rolling.reach[k] * impulse[k, 0], rolling.impulse[k]
        rolling.impulse[k] = min(max(old - rate / inverse, -bound), bound)
        _apply_rolling(contacts, k, rolling.impulse[k] - old, spin, inverse_moment)


@bare_kernel
def solve_together(
    contacts: Manifolds,
    bounce: FloatArray,
    rows: VelocityConstraints,
    stops: AngularStops,
    rolling: RollingRows,
    velocity: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    impulse: FloatArray,
    iterations: int,
) -> None:
    """Solve contacts, rolling resistance, joints and stops by impulses, in this order in each pass, as Munk2D does.

    Args:
        contacts: K contacts.
        bounce: (K,) m/s, as in `solve_velocities`.
        rows: of the joints, prepared.
        stops: one-sided constraints.
        rolling: of the contacts.
        velocity: (N, 3) m/s and rad/s, changed.
        inverse_mass: (N,) 1/kg.
        inverse_moment: (N,) 1/(kg·m²).
        impulse: (K, 2) N·s of the contacts: initial, then accumulated.
        iterations: number of passes.
    """
    spin = velocity[:, 2]
    warm_start_contacts(contacts, velocity, spin, inverse_mass, inverse_moment, impulse)
    for k in range(len(rolling.reach)):
        _apply_rolling(contacts, k, rolling.impulse[k], spin, inverse_moment)
    warm_start_joints(rows, velocity, inverse_mass, inverse_moment)
    for k in range(len(stops.body)):
        spin[stops.body[k]] -= stops.direction[k] * stops.impulse[k] * inverse_moment[stops.body[k]]
    for _ in range(iterations):
        solve_contacts_once(contacts, bounce, velocity, spin, inverse_mass, inverse_moment, impulse)
        solve_rolling_once(contacts, rolling, spin, inverse_moment, impulse)
        solve_joints_once(rows, velocity, inverse_mass, inverse_moment)
        for k in range(len(stops.body)):
            n, direction, old = stops.body[k], stops.direction[k], stops.impulse[k]
            stops.impulse[k] = max(old + direction * spin[n] / inverse_moment[n], 0.0)
            spin[n] -= direction * (stops.impulse[k] - old) * inverse_moment[n]
