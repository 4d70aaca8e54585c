"""Ties: links as kernels take them, and what all of them need: where they hold, and how a push at one acts.

A tie's line goes from its end on the first body to its end on the second. A push is on the second body, and its
opposite on the first.
"""

import math
from typing import NamedTuple, TypeAlias

import numpy as np

from sandbox.engines.kernel import bare_kernel
from sandbox.scene.links import LinkKind, Links
from sandbox.trajectory import FloatArray, IntArray

# Plain numbers: compiled code compares them without an enumeration's detour.
ROD, PIVOT, SLIDE = int(LinkKind.ROD), int(LinkKind.PIVOT), int(LinkKind.SLIDE)
ROTARY_LIMIT = int(LinkKind.ROTARY_LIMIT)
SPRING, ROTARY_SPRING = int(LinkKind.SPRING), int(LinkKind.ROTARY_SPRING)

SPRINGS = (LinkKind.SPRING, LinkKind.ROTARY_SPRING)
HOLDS = (LinkKind.ROD, LinkKind.PIVOT, LinkKind.SLIDE, LinkKind.ROTARY_LIMIT)


Arms: TypeAlias = tuple[float, float, float, float]
"""ax, ay, bx, by, m: from the centres of two bodies to where a tie holds them"""


class Ties(NamedTuple):
    """K links, by number of body; the first may be `links.WORLD`, −1."""

    link: IntArray
    """(K,) number among all links of the scene"""
    kind: IntArray
    """(K,) `LinkKind`"""
    first: IntArray
    """(K,)"""
    second: IntArray
    """(K,)"""
    anchor: FloatArray
    """(K, 4) m, ax, ay, bx, by, in the bodies' own frames; of the world, a place"""
    figures: FloatArray
    """(K, 3) as `LinkKind` says"""
    most_force: FloatArray
    """(K,) N or N·m"""

    def some(self, which: IntArray) -> "Ties":
        """Return those at some places."""
        return Ties._make(column[which] for column in self)

    def joined(self, more: "Ties") -> "Ties":
        """Return these and more."""
        return Ties._make(np.concatenate(pair) for pair in zip(self, more, strict=True))


def ties_of(links: Links, *kinds: LinkKind, among: IntArray | None = None) -> Ties:
    """Return the links of some kinds, in their order; with `among`, only those of these numbers."""
    which = np.isin(links.kind, kinds)
    if among is not None:
        which &= np.isin(np.arange(len(links)), among)
    anchor = np.column_stack((links.anchor_a, links.anchor_b))
    every = Ties(np.arange(len(links)), links.kind, links.a, links.b, anchor, links.figures, links.most_force)
    return every.some(np.flatnonzero(which))


@bare_kernel
def reach(ties: Ties, k: int, pose: FloatArray) -> tuple[Arms, float, float]:
    """Return the arms of tie k, and the way from its first end to its second, x and y, m."""
    i, j = ties.first[k], ties.second[k]
    ax, ay, bx, by = ties.anchor[k, 0], ties.anchor[k, 1], ties.anchor[k, 2], ties.anchor[k, 3]
    if bx != 0.0 or by != 0.0:
        cos, sin = math.cos(pose[j, 2]), math.sin(pose[j, 2])
        bx, by = cos * bx - sin * by, sin * bx + cos * by
    if i < 0:
        return (0.0, 0.0, bx, by), pose[j, 0] + bx - ax, pose[j, 1] + by - ay
    if ax != 0.0 or ay != 0.0:
        cos, sin = math.cos(pose[i, 2]), math.sin(pose[i, 2])
        ax, ay = cos * ax - sin * ay, sin * ax + cos * ay
    return (ax, ay, bx, by), pose[j, 0] + bx - (pose[i, 0] + ax), pose[j, 1] + by - (pose[i, 1] + ay)


@bare_kernel
def line(x: float, y: float) -> tuple[float, float, float]:
    """Return the length of a vector and its direction, which is none, 0, where it has no length."""
    length = math.sqrt(x * x + y * y)
    if length == 0.0:
        return 0.0, 0.0, 0.0
    return length, x / length, y / length


@bare_kernel
def parting(i: int, j: int, arms: Arms, velocity: FloatArray) -> tuple[float, float]:
    """Return how fast the end on body j moves as seen from the one on i, m/s; velocities are (N, 3)."""
    ax, ay, bx, by = arms
    vx = velocity[j, 0] - velocity[j, 2] * by
    vy = velocity[j, 1] + velocity[j, 2] * bx
    if i >= 0:
        vx -= velocity[i, 0] - velocity[i, 2] * ay
        vy -= velocity[i, 1] + velocity[i, 2] * ax
    return vx, vy


@bare_kernel
def turning(i: int, j: int, rate: FloatArray) -> float:
    """Return the angle, or spin, of body j as seen from i."""
    turned: float = rate[j, 2]
    return turned - rate[i, 2] if i >= 0 else turned


@bare_kernel
def push(
    i: int,
    j: int,
    arms: Arms,
    x: float,
    y: float,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    out: FloatArray,
) -> None:
    """Add what a push (x, y) does: a force to accelerations, an impulse to velocities, both (N, 3)."""
    ax, ay, bx, by = arms
    out[j, 0] += inverse_mass[j] * x
    out[j, 1] += inverse_mass[j] * y
    out[j, 2] += inverse_moment[j] * (bx * y - by * x)
    if i >= 0:
        out[i, 0] -= inverse_mass[i] * x
        out[i, 1] -= inverse_mass[i] * y
        out[i, 2] -= inverse_moment[i] * (ax * y - ay * x)


@bare_kernel
def twist(i: int, j: int, torque: float, inverse_moment: FloatArray, out: FloatArray) -> None:
    """Add what a torque does, as `push` does a force."""
    out[j, 2] += inverse_moment[j] * torque
    if i >= 0:
        out[i, 2] -= inverse_moment[i] * torque


@bare_kernel
def yielding(
    i: int,
    j: int,
    arms: Arms,
    nx: float,
    ny: float,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
) -> float:
    """Return how much a unit push along (nx, ny) parts the two ends along it: an inverse mass, 1/kg."""
    ax, ay, bx, by = arms
    lever = bx * ny - by * nx
    share: float = inverse_mass[j] + inverse_moment[j] * lever * lever
    if i >= 0:
        lever = ax * ny - ay * nx
        share += inverse_mass[i] + inverse_moment[i] * lever * lever
    return share


@bare_kernel
def slackness(i: int, j: int, inverse_moment: FloatArray) -> float:
    """Return how much a unit torque turns the second as seen from the first, 1/(kg·m²)."""
    share: float = inverse_moment[j]
    return share + inverse_moment[i] if i >= 0 else share


@bare_kernel
def block(
    i: int, j: int, arms: Arms, inverse_mass: FloatArray, inverse_moment: FloatArray
) -> tuple[float, float, float]:
    """Return the push that parts the ends by a unit: a matrix's xx, xy, yy, kg; 0 where nothing can move."""
    ax, ay, bx, by = arms
    xx = yy = inverse_mass[j]
    xx += inverse_moment[j] * by * by
    xy = -inverse_moment[j] * bx * by
    yy += inverse_moment[j] * bx * bx
    if i >= 0:
        xx += inverse_mass[i] + inverse_moment[i] * ay * ay
        xy -= inverse_moment[i] * ax * ay
        yy += inverse_mass[i] + inverse_moment[i] * ax * ax
    determinant = xx * yy - xy * xy
    if determinant == 0.0:
        return 0.0, 0.0, 0.0
    return yy / determinant, -xy / determinant, xx / determinant
