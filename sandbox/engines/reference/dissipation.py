"""Dissipation: impacts with friction whose restitution is cut where it would create energy.

Newton's law asks for a rebound of e times the approach, whatever friction does meanwhile. Where the two are coupled, as
at the corner of a box, both together can give more energy than there was (Kane & Levinson 1985; Stronge, Impact
Mechanics, ch. 3). The law here is Newton's as long as it does not. Else the impulses of each group of bodies in contact
are

    p(s) = p₀ + s (p₁ − p₀),   0 ≤ s < 1,

between those without restitution, p₀, which only take energy, and Newton's, p₁, with the largest s at which contacts
give none. All the p(s) lie within the friction cones, which are convex, and leave no approach.
"""

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.kernel import kernel
from sandbox.engines.reference.manifold import Manifolds
from sandbox.engines.reference.sequential_impulses import work_at

ROUNDING = 1e-13
"""Part of what impulses turn over that is no gain of energy but rounding."""


class Bilinear:
    """The works of impulses of K contacts at velocities, J, summed by group of bodies in contact."""

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
        """Return the work of impulses (K, 2) at velocities (N, D) and spins (N,) by group, (N,), and its turnover."""
        out, turnover = np.zeros(len(self.group)), np.zeros(len(self.group))
        sum_work(self._contacts, impulse, velocity, spin, self.of_contact, out, turnover)
        return out, turnover


def largest_fractions(work: FloatArray, slope: FloatArray, curve: FloatArray) -> FloatArray:
    """Return the largest s ≤ 1, (N,), at which work + slope·s + curve·s² ≤ 0, curve ≥ 0; 0 where there is none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(np.maximum(slope * slope - 4.0 * curve * work, 0.0))
        # Two forms of the larger root: that which subtracts nothing
        fraction = np.where(slope > 0.0, -2.0 * work / (slope + root), (root - slope) / (2.0 * curve))
    fraction = np.where(work + slope + curve <= 0.0, 1.0, fraction)
    return np.where(np.isfinite(fraction), np.clip(fraction, 0.0, 1.0), 0.0)


@kernel
def join_groups(first: IntArray, second: IntArray, moves: BoolArray, group: IntArray) -> None:
    """Write into group (N,) the lowest number of the bodies that contacts connect each with, fixed ones aside."""
    for k in range(len(first)):
        i, j = first[k], second[k]
        if j < 0 or not (moves[i] and moves[j]):
            continue
        while group[i] != i:  # halving the ways to the lowest keeps them short: a long chain would take its square
            group[i] = group[group[i]]
            i = group[i]
        while group[j] != j:
            group[j] = group[group[j]]
            j = group[j]
        group[max(i, j)] = min(i, j)
    for i in range(len(group)):  # the lowest is a body before it
        group[i] = group[group[i]]


@kernel
def sum_work(
    now: Manifolds,
    impulse: FloatArray,
    velocity: FloatArray,
    spin: FloatArray,
    group: IntArray,
    out: FloatArray,
    turnover: FloatArray,
) -> None:
    """Add the work of each contact's impulse to that of its group, as `impulses.contact_work` does for all."""
    for k in range(len(now.key)):
        along, across = work_at(now, k, impulse, velocity, spin)
        out[group[k]] += along + across
        turnover[group[k]] += abs(along) + abs(across)
