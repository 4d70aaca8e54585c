"""Joints as arrays: geometry, lengths, spring laws and the limit of stretch.

JointData: joints in the form of kernel arguments, their anchors, and the effect of an impulse at an anchor.

A tie's line goes from its end on the first body to its end on the second. An impulse acts on the second body, and its
opposite on the first.

Springs as forces: F = −k (l − l₀) − c l̇ along the line of a spring, τ = −k (φ − φ₀) − c φ̇ of a rotary one.

They are part of the state transition, so that an integrator finds them wherever it asks for forces. A force worked out
once and held for the step would make any scheme an explicit Euler.
"""

import math
from typing import NamedTuple, TypeAlias

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.kernel import bare_kernel
from sandbox.scene.compile.joint_arrays import JointArrays, LinkKind

# Plain numbers: compiled code compares them without an enumeration's detour.
ROD, PIVOT, SLIDE = int(LinkKind.ROD), int(LinkKind.PIVOT), int(LinkKind.SLIDE)
ROTARY_LIMIT = int(LinkKind.ROTARY_LIMIT)
SPRING, ROTARY_SPRING = int(LinkKind.SPRING), int(LinkKind.ROTARY_SPRING)

SPRINGS = (LinkKind.SPRING, LinkKind.ROTARY_SPRING)
HOLDS = (LinkKind.ROD, LinkKind.PIVOT, LinkKind.SLIDE, LinkKind.ROTARY_LIMIT)


Arms: TypeAlias = tuple[float, float, float, float]
"""ax, ay, bx, by, m: from the centres of two bodies to the anchors of a joint"""


class JointData(NamedTuple):
    """K joints, by body indices; the first may be `WORLD`, −1."""

    link: IntArray
    """(K,) index among all joints of the setup"""
    kind: IntArray
    """(K,) `LinkKind`"""
    first: IntArray
    """(K,)"""
    second: IntArray
    """(K,)"""
    anchor: FloatArray
    """(K, 4) m, anchors ax, ay, bx, by in the frames of the bodies; for the world, a point in space"""
    figures: FloatArray
    """(K, 3) as `LinkKind` says"""
    most_force: FloatArray
    """(K,) N or N·m"""

    def some(self, which: IntArray) -> "JointData":
        """Return the joints in some rows."""
        return JointData._make(column[which] for column in self)

    def joined(self, more: "JointData") -> "JointData":
        """Return these joints and more."""
        return JointData._make(np.concatenate(pair) for pair in zip(self, more, strict=True))


def ties_of(links: JointArrays, *kinds: LinkKind, among: IntArray | None = None) -> JointData:
    """Return the joints of some kinds, in their order; with `among`, only those with these indices."""
    which = np.isin(links.kind, kinds)
    if among is not None:
        which &= np.isin(np.arange(len(links)), among)
    anchor = np.column_stack((links.anchor_a, links.anchor_b))
    every = JointData(np.arange(len(links)), links.kind, links.a, links.b, anchor, links.figures, links.most_force)
    return every.some(np.flatnonzero(which))


@bare_kernel
def reach(ties: JointData, k: int, pose: FloatArray) -> tuple[Arms, float, float]:
    """Return the arms of joint k, and the vector from its first anchor to its second, x and y, m."""
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
    """Return the length of a vector and its direction; both are 0 for a zero vector."""
    length = math.sqrt(x * x + y * y)
    if length == 0.0:
        return 0.0, 0.0, 0.0
    return length, x / length, y / length


@bare_kernel
def parting(i: int, j: int, arms: Arms, velocity: FloatArray) -> tuple[float, float]:
    """Return the velocity of the anchor on body j relative to that on body i, m/s; velocities are (N, 3)."""
    ax, ay, bx, by = arms
    vx = velocity[j, 0] - velocity[j, 2] * by
    vy = velocity[j, 1] + velocity[j, 2] * bx
    if i >= 0:
        vx -= velocity[i, 0] - velocity[i, 2] * ay
        vy -= velocity[i, 1] + velocity[i, 2] * ax
    return vx, vy


@bare_kernel
def turning(i: int, j: int, rate: FloatArray) -> float:
    """Return the angle, or angular velocity, of body j relative to body i."""
    turned: float = rate[j, 2]
    return turned - rate[i, 2] if i >= 0 else turned


@bare_kernel
def apply_impulse(
    i: int,
    j: int,
    arms: Arms,
    x: float,
    y: float,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    out: FloatArray,
) -> None:
    """Apply a force (x, y) to accelerations, or an impulse to velocities, both (N, 3)."""
    ax, ay, bx, by = arms
    out[j, 0] += inverse_mass[j] * x
    out[j, 1] += inverse_mass[j] * y
    out[j, 2] += inverse_moment[j] * (bx * y - by * x)
    if i >= 0:
        out[i, 0] -= inverse_mass[i] * x
        out[i, 1] -= inverse_mass[i] * y
        out[i, 2] -= inverse_moment[i] * (ax * y - ay * x)


@bare_kernel
def apply_angular_impulse(i: int, j: int, torque: float, inverse_moment: FloatArray, out: FloatArray) -> None:
    """Apply a torque, as `apply_impulse` applies a force."""
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
    """Return the relative velocity of the anchors along (nx, ny) per unit impulse: an inverse mass, 1/kg."""
    ax, ay, bx, by = arms
    lever = bx * ny - by * nx
    inverse: float = inverse_mass[j] + inverse_moment[j] * lever * lever
    if i >= 0:
        lever = ax * ny - ay * nx
        inverse += inverse_mass[i] + inverse_moment[i] * lever * lever
    return inverse


@bare_kernel
def slackness(i: int, j: int, inverse_moment: FloatArray) -> float:
    """Return the relative angular velocity per unit angular impulse, 1/(kg·m²)."""
    inverse: float = inverse_moment[j]
    return inverse + inverse_moment[i] if i >= 0 else inverse


@bare_kernel
def block(
    i: int, j: int, arms: Arms, inverse_mass: FloatArray, inverse_moment: FloatArray
) -> tuple[float, float, float]:
    """Return the effective mass matrix xx, xy, yy, kg: impulse per relative velocity; 0 if nothing can move."""
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


@bare_kernel
def spring_forces(
    ties: JointData,
    pose: FloatArray,
    rates: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    out: FloatArray,
) -> None:
    """Add the accelerations caused by springs.

    Args:
        ties: of them, the springs and rotary springs.
        pose: (N, 3) m and rad.
        rates: (N, 3) m/s and rad/s.
        inverse_mass: (N,) 1/kg, 0 for fixed bodies.
        inverse_moment: (N,) 1/(kg·m²).
        out: (N, 3) m/s² and rad/s², added to.
    """
    for k in range(len(ties.kind)):
        i, j = ties.first[k], ties.second[k]
        if ties.kind[k] == SPRING:
            arms, dx, dy = reach(ties, k, pose)
            x, y = tension(ties, k, arms, dx, dy, rates)
            apply_impulse(i, j, arms, x, y, inverse_mass, inverse_moment, out)
        elif ties.kind[k] == ROTARY_SPRING:
            apply_angular_impulse(i, j, torsion(ties, k, pose, rates), inverse_moment, out)


@bare_kernel
def tension(ties: JointData, k: int, arms: Arms, dx: float, dy: float, rates: FloatArray) -> tuple[float, float]:
    """Return the force of spring k, which reaches over (dx, dy), on its second body, x and y, N.

    Where its ends coincide, its line is that of their motion, as it will be at once. Without motion there is none,
    and no force: a spring of no rest length is at rest there, any other in unstable balance.
    """
    vx, vy = parting(ties.first[k], ties.second[k], arms, rates)
    length, nx, ny = line(dx, dy)
    if length == 0.0:
        _, nx, ny = line(vx, vy)
    force = -ties.figures[k, 1] * (length - ties.figures[k, 0]) - ties.figures[k, 2] * (vx * nx + vy * ny)
    return force * nx, force * ny


@bare_kernel
def torsion(ties: JointData, k: int, pose: FloatArray, rates: FloatArray) -> float:
    """Return the torque of rotary spring k on its second body, N·m."""
    i, j = ties.first[k], ties.second[k]
    turned = turning(i, j, pose) - ties.figures[k, 0]
    torque: float = -ties.figures[k, 1] * turned - ties.figures[k, 2] * turning(i, j, rates)
    return torque


@bare_kernel
def damper_power(ties: JointData, pose: FloatArray, rates: FloatArray) -> float:
    """Return the power, W, of the dampers of springs: −c l̇² and −c φ̇²; never more than 0.

    Args:
        ties: of them, the springs and rotary springs.
        pose: (N, 3) m and rad.
        rates: (N, 3) m/s and rad/s.
    """
    power = 0.0
    for k in range(len(ties.kind)):
        i, j = ties.first[k], ties.second[k]
        if ties.kind[k] == SPRING:
            arms, dx, dy = reach(ties, k, pose)
            vx, vy = parting(i, j, arms, rates)
            length, nx, ny = line(dx, dy)
            if length == 0.0:
                _, nx, ny = line(vx, vy)
            power -= ties.figures[k, 2] * (vx * nx + vy * ny) ** 2
        elif ties.kind[k] == ROTARY_SPRING:
            power -= ties.figures[k, 2] * turning(i, j, rates) ** 2
    return power


@bare_kernel
def spring_loads(ties: JointData, pose: FloatArray, rates: FloatArray, load: FloatArray) -> None:
    """Write the load of each spring on its second body into its row: force, N, or torque, N·m, and 0.

    Args:
        ties: of them, the springs and rotary springs.
        pose: (N, 3) m and rad.
        rates: (N, 3) m/s and rad/s.
        load: (J, 2), by number of link.
    """
    for k in range(len(ties.kind)):
        if ties.kind[k] == SPRING:
            arms, dx, dy = reach(ties, k, pose)
            load[ties.link[k], 0], load[ties.link[k], 1] = tension(ties, k, arms, dx, dy, rates)
        elif ties.kind[k] == ROTARY_SPRING:
            load[ties.link[k], 0], load[ties.link[k], 1] = torsion(ties, k, pose, rates), 0.0


CAP = 0.1
"""Largest stretch of cloth, as a fraction of the rest length of a spring."""


def cap_stretch(ties: JointData, cap: float) -> JointData:
    """Return the strings that keep springs from stretching farther, to be held with whatever else is.

    Springs of no rest length get none, for that would be a pivot; rotary springs neither.

    Args:
        ties: any.
        cap: the most stretch as a part of the rest length; inf for none.
    """
    some = np.flatnonzero((ties.kind == SPRING) & (ties.figures[:, 0] > 0.0) & np.isfinite(cap))
    own = ties.some(some)
    figures = np.zeros((len(some), 3))
    figures[:, 1] = (1.0 + cap) * own.figures[:, 0]
    return own._replace(kind=np.full(len(some), SLIDE), figures=figures, most_force=np.full(len(some), np.inf))
