"""Hauls: the impulses of springs and motors on the bodies that they join, in a substep."""

from typing import NamedTuple, Self, TypeAlias

import numpy as np

from sandbox.engines.native.tethers import Tethers
from sandbox.scene.links import LinkKind, Links
from sandbox.trajectory import FloatArray, IntArray


class Hauls(NamedTuple):
    """Impulses that K links gave to their second bodies, and took from their first."""

    a: IntArray
    """(K,) first body; −1 is the world"""
    b: IntArray
    """(K,) second"""
    arm_a: FloatArray
    """(K, 2) m, from the first body's centre"""
    arm_b: FloatArray
    """(K, 2) likewise"""
    impulse: FloatArray
    """(K, 2) N·s"""
    twist: FloatArray
    """(K,) N·m·s, apart from what the impulse does by its arms"""

    def times(self, share: float | FloatArray) -> Self:
        """Return shares of them, one or (K,)."""
        return self._replace(impulse=(self.impulse.T * share).T, twist=self.twist * share)

    def parting(self, velocity: FloatArray, spin: FloatArray) -> FloatArray:
        """Return how fast the second's places leave the first's, (K, 2) m/s.

        Args:
            velocity: (N + 1, 2) m/s, of all bodies and of the world, which is the last.
            spin: (N + 1,) rad/s.
        """
        where = (self.a, self.arm_a), (self.b, self.arm_b)
        first, second = (velocity[n] + spin[n, None] * _left(arm) for n, arm in where)
        return np.asarray(second - first)

    def work(self, velocity: FloatArray, spin: FloatArray) -> float:
        """Return their work, J, at mean velocities."""
        turning = self.twist @ (spin[self.b] - spin[self.a])
        return float(np.sum(self.impulse * self.parting(velocity, spin)) + turning)


Pair: TypeAlias = tuple[Hauls, Hauls]


class Momenta(NamedTuple):
    """What N bodies, and the world as the last, were given by some of the things that act on them."""

    linear: FloatArray
    """(N + 1, 2) N·s"""
    angular: FloatArray
    """(N + 1,) N·m·s"""
    joined: IntArray
    """numbers of those that joints hold"""

    def less(self, hauls: Hauls) -> None:
        """Leave out what links, or contacts, gave."""
        for n, arm, sign in ((hauls.a, hauls.arm_a, -1.0), (hauls.b, hauls.arm_b, 1.0)):
            np.subtract.at(self.linear, n, sign * hauls.impulse)
            np.subtract.at(self.angular, n, sign * (cross(arm, hauls.impulse) + hauls.twist))

    def work(self, velocity: FloatArray, spin: FloatArray) -> float:
        """Return their work on those that joints hold, J, at mean velocities and spins."""
        n = self.joined
        return float(np.sum(self.linear[n] * velocity[n]) + self.angular[n] @ spin[n])


def springs(tethers: Tethers, position: FloatArray, angle: FloatArray, h: float) -> tuple[Pair, Pair]:
    """Return what springs and rotary springs gave by their stiffness, and by their dampers.

    Args:
        tethers: the links that hold.
        position: (N, 2) m, at the end of the substep, where pymunk evaluates them.
        angle: (N,) rad.
        h: the substep, s.
    """
    links = tethers.held.springs
    arm_a, place_a = _end(links.a, links.anchor_a, position, angle)
    arm_b, place_b = _end(links.b, links.anchor_b, position, angle)
    way = place_b - place_a
    length = np.hypot(way[:, 0], way[:, 1])
    along = way / np.where(length > 0.0, length, 1.0)[:, None]
    stiff = links.figures[:, 1] * (links.figures[:, 0] - length) * h
    damped = tethers.impulses(links) - stiff
    nothing = np.zeros(len(links))
    ends = links.a, links.b, arm_a, arm_b

    rotary = tethers.held.rotary
    turned = angle[rotary.b] - np.where(rotary.a >= 0, angle[rotary.a], 0.0)
    wound = rotary.figures[:, 1] * (rotary.figures[:, 0] - turned) * h
    slowed = tethers.impulses(rotary) - wound
    still = np.zeros((len(rotary), 2))
    axles = rotary.a, rotary.b, still, still, still
    stiffness = Hauls(*ends, along * stiff[:, None], nothing), Hauls(*axles, wound)
    dampers = Hauls(*ends, along * damped[:, None], nothing), Hauls(*axles, slowed)
    return stiffness, dampers


def motors(tethers: Tethers, position: FloatArray, angle: FloatArray, given: Momenta) -> Hauls:
    """Return what motors gave. pymunk tells how much, but not which way round: that follows from all joints' sum.

    Args:
        tethers: the links that hold.
        position: (N, 2) m.
        angle: (N,) rad.
        given: what all joints but springs gave together.
    """
    rigid, chosen = tethers.held.rigid, tethers.held.motors
    still = np.zeros((len(chosen), 2))
    if not len(chosen):
        return Hauls(chosen.a, chosen.b, still, still, still, np.zeros(0))
    unknown = np.linalg.lstsq(_system(rigid, position, angle), _stacked(given), rcond=None)[0]
    first = np.cumsum(_unknowns(rigid)) - _unknowns(rigid)
    way = np.sign(unknown[first[rigid.kind == LinkKind.MOTOR]])
    return Hauls(chosen.a, chosen.b, still, still, still, way * np.abs(tethers.impulses(chosen)))


def _unknowns(links: Links) -> IntArray:
    """Return how many figures the impulse of each link has, (K,)."""
    return np.where(np.isin(links.kind, (LinkKind.PIVOT, LinkKind.GROOVE)), 2, 1)


def _stacked(given: Momenta) -> FloatArray:
    return np.column_stack((given.linear, given.angular))[:-1].reshape(-1)


def _system(links: Links, position: FloatArray, angle: FloatArray) -> FloatArray:
    """Return what unit impulses of links, (U,), give to all bodies: (3N, U), x, y and turning of each."""
    count = _unknowns(links)
    column = np.cumsum(count) - count
    table = np.zeros((len(position) + 1, 3, int(count.sum())))
    arm_a, place_a = _end(links.a, links.anchor_a, position, angle)
    arm_b, place_b = _end(links.b, links.anchor_b, position, angle)
    for k, kind in enumerate(links.kind.tolist()):
        a, b, at = int(links.a[k]), int(links.b[k]), int(column[k])
        if kind in (LinkKind.MOTOR, LinkKind.ROTARY_LIMIT, LinkKind.GEAR):
            table[b, 2, at] += 1.0
            table[a, 2, at] -= 1.0 / links.figures[k, 1] if kind == LinkKind.GEAR else 1.0
            continue
        middle = position[a] if a >= 0 else np.zeros(2)
        own = place_b[k] - middle if kind == LinkKind.GROOVE else arm_a[k]
        ways = np.eye(2) if count[k] == 2 else (place_b - place_a)[k : k + 1]
        for extra, way in enumerate(ways):
            for body, arm, sign in ((a, own, -1.0), (b, arm_b[k], 1.0)):
                table[body, :2, at + extra] += sign * way
                table[body, 2, at + extra] += sign * float(cross(arm, way))
    return table[:-1].reshape(-1, table.shape[2])


def cross(arm: FloatArray, impulse: FloatArray) -> FloatArray:
    """Return the turning impulses (…,) of impulses (…, 2) at arms (…, 2)."""
    return np.asarray(arm[..., 0] * impulse[..., 1] - arm[..., 1] * impulse[..., 0])


def _left(arm: FloatArray) -> FloatArray:
    return np.column_stack((-arm[:, 1], arm[:, 0]))


def _end(
    number: IntArray, anchor: FloatArray, position: FloatArray, angle: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return where links hold bodies, (K, 2) m, from their centres and in the world."""
    cos, sin = np.cos(angle[number]), np.sin(angle[number])
    x, y = anchor.T
    arm = np.column_stack((cos * x - sin * y, sin * x + cos * y))
    world = (number < 0)[:, None]
    return np.where(world, 0.0, arm), np.where(world, anchor, position[number] + arm)
