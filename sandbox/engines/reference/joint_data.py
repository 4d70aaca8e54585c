"""Joints as arrays: anchors, Jacobians, effective masses, spring forces and stretch limits.

The axis of a joint points from its anchor on the first body to its anchor on the second. An impulse acts on the second
body, and its opposite on the first.

Springs are forces: F = −k (l − l₀) − c l̇ along the axis of a spring, τ = −k (φ − φ₀) − c φ̇ of a rotary spring. They
are part of the state transition, so that the integrator evaluates them at every stage. A force computed once per step
would reduce every integrator to first order.
"""

import math
from typing import NamedTuple, TypeAlias

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.geometry import length_and_direction, rotate
from sandbox.engines.common.kernel import bare_kernel
from sandbox.engines.common.springs import spring_law
from sandbox.scene.compile.joint_arrays import JointArrays, JointKind

# Plain integers: numba compares them faster than members of an enumeration.
ROD, PIVOT, SLIDE = int(JointKind.ROD), int(JointKind.PIVOT), int(JointKind.SLIDE)
ROTARY_LIMIT, MOTOR, GEAR = int(JointKind.ROTARY_LIMIT), int(JointKind.MOTOR), int(JointKind.GEAR)
GROOVE, PULLEY = int(JointKind.GROOVE), int(JointKind.PULLEY)
LINEAR_MOTOR = int(JointKind.LINEAR_MOTOR)
SPRING, ROTARY_SPRING = int(JointKind.SPRING), int(JointKind.ROTARY_SPRING)

SPRINGS = (JointKind.SPRING, JointKind.ROTARY_SPRING)
CONSTRAINTS = tuple(kind for kind in JointKind if kind not in SPRINGS)

GROOVE_ENDS = 1 + int(max(JointKind))
"""Second constraint of a groove, along it; that of the kind `GROOVE` is across it"""

JACOBIAN_KINDS = (GROOVE, GROOVE_ENDS, GEAR, PULLEY, LINEAR_MOTOR)
"""Kinds whose quantity and limits are those of `constrained_value` and `value_limits`"""

_spring_law = bare_kernel(spring_law)


Anchors: TypeAlias = tuple[float, float, float, float]
"""ax, ay, bx, by, m: from the centres of two bodies to the anchors of a joint; Box2D's rA, rB"""


class JointData(NamedTuple):
    """K joints by the indices of their bodies; the first may be `WORLD`, −1."""

    joint: IntArray
    """(K,) index among all joints of the setup"""
    kind: IntArray
    """(K,) `JointKind`"""
    first: IntArray
    """(K,)"""
    second: IntArray
    """(K,)"""
    anchor: FloatArray
    """(K, 4) m, anchors ax, ay, bx, by in the frames of the bodies; for the world, a point in space"""
    figures: FloatArray
    """(K, 3), as defined by `JointKind`"""
    wheel: FloatArray
    """(K, 4) m, positions of both wheels of a pulley in the world: ax, ay, bx, by"""
    max_force: FloatArray
    """(K,) N or N·m"""
    max_bias: FloatArray
    """(K,) m/s or rad/s, largest speed of a correction; impulses alone have it"""
    pulls_only: BoolArray
    """(K,) whether a spring acts only while longer than its rest length, and never pushes"""

    def take(self, which: IntArray) -> "JointData":
        """Return the joints of some rows."""
        return JointData._make(column[which] for column in self)

    def joined(self, more: "JointData") -> "JointData":
        """Return these joints, followed by others."""
        return JointData._make(np.concatenate(pair) for pair in zip(self, more, strict=True))


def select_joints(joints: JointArrays, *kinds: JointKind, among: IntArray | None = None) -> JointData:
    """Return the joints of some kinds, in their order; with `among`, only those with these indices.

    A groove is followed by its second constraint, `GROOVE_ENDS`.
    """
    which = np.isin(joints.kind, kinds)
    if among is not None:
        which &= np.isin(np.arange(len(joints)), among)
    anchor = np.column_stack((joints.anchor_a, joints.anchor_b))
    columns = (
        *(joints.kind, joints.a, joints.b, anchor, joints.figures, joints.wheels),
        *(joints.max_force, joints.max_bias, joints.pulls_only),
    )
    found = JointData(np.arange(len(joints)), *columns).take(np.flatnonzero(which))
    if not (found.kind == GROOVE).any():
        return found
    found = found.take(np.repeat(np.arange(len(found.kind)), np.where(found.kind == GROOVE, 2, 1)))
    found.kind[1:][(found.kind[1:] == GROOVE) & (found.joint[1:] == found.joint[:-1])] = GROOVE_ENDS
    return found


@bare_kernel
def anchor_separation(joints: JointData, k: int, pose: FloatArray) -> tuple[Anchors, float, float]:
    """Return the anchors of joint k, and the vector from the first to the second, x and y, m."""
    i, j = joints.first[k], joints.second[k]
    ax, ay, bx, by = joints.anchor[k, 0], joints.anchor[k, 1], joints.anchor[k, 2], joints.anchor[k, 3]
    if bx != 0.0 or by != 0.0:
        cos, sin = math.cos(pose[j, 2]), math.sin(pose[j, 2])
        bx, by = rotate(bx, by, cos, sin)
    if i < 0:
        return (0.0, 0.0, bx, by), pose[j, 0] + bx - ax, pose[j, 1] + by - ay
    if ax != 0.0 or ay != 0.0:
        cos, sin = math.cos(pose[i, 2]), math.sin(pose[i, 2])
        ax, ay = rotate(ax, ay, cos, sin)
    return (ax, ay, bx, by), pose[j, 0] + bx - (pose[i, 0] + ax), pose[j, 1] + by - (pose[i, 1] + ay)


@bare_kernel
def relative_velocity(i: int, j: int, anchors: Anchors, velocity: FloatArray) -> tuple[float, float]:
    """Return the velocity of the anchor on body j relative to that on body i, m/s; velocities are (N, 3)."""
    ax, ay, bx, by = anchors
    vx = velocity[j, 0] - velocity[j, 2] * by
    vy = velocity[j, 1] + velocity[j, 2] * bx
    if i >= 0:
        vx -= velocity[i, 0] - velocity[i, 2] * ay
        vy -= velocity[i, 1] + velocity[i, 2] * ax
    return vx, vy


@bare_kernel
def relative_rotation(i: int, j: int, rate: FloatArray) -> float:
    """Return the angle, or angular velocity, of body j relative to body i."""
    turned: float = rate[j, 2]
    return turned - rate[i, 2] if i >= 0 else turned


@bare_kernel
def apply_impulse(
    i: int,
    j: int,
    anchors: Anchors,
    x: float,
    y: float,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    out: FloatArray,
) -> None:
    """Apply a force (x, y) to accelerations, or an impulse to velocities, both (N, 3)."""
    ax, ay, bx, by = anchors
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
def inverse_effective_mass(
    i: int,
    j: int,
    anchors: Anchors,
    nx: float,
    ny: float,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
) -> float:
    """Return the relative velocity of the anchors along (nx, ny) per unit impulse: an inverse mass, 1/kg."""
    ax, ay, bx, by = anchors
    lever = bx * ny - by * nx
    inverse: float = inverse_mass[j] + inverse_moment[j] * lever * lever
    if i >= 0:
        lever = ax * ny - ay * nx
        inverse += inverse_mass[i] + inverse_moment[i] * lever * lever
    return inverse


@bare_kernel
def inverse_effective_moment(i: int, j: int, inverse_moment: FloatArray) -> float:
    """Return the relative angular velocity per unit angular impulse, 1/(kg·m²)."""
    inverse: float = inverse_moment[j]
    return inverse + inverse_moment[i] if i >= 0 else inverse


@bare_kernel
def effective_mass_matrix(
    i: int, j: int, anchors: Anchors, inverse_mass: FloatArray, inverse_moment: FloatArray
) -> tuple[float, float, float]:
    """Return the effective mass matrix xx, xy, yy, kg: impulse per relative velocity; 0 if nothing can move."""
    ax, ay, bx, by = anchors
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


Jacobian: TypeAlias = tuple[float, float, float, float, float, float]
"""Rate of a quantity per velocity x, y and spin of the first body, then of the second"""


@bare_kernel
def constrained_value(joints: JointData, k: int, pose: FloatArray) -> tuple[float, Jacobian]:
    """Return the quantity that joint k, of one of `JACOBIAN_KINDS`, constrains, and its Jacobian.

    It is the position of the second anchor across a groove, m, or along it, as that of a linear motor; the angle of the
    second body relative to that of a gear, rad; or the length of a pulley's rope, m. An impulse along the Jacobian acts
    on the second body as an impulse along the groove's normal or axis, as an angular impulse, or along the rope.
    """
    i, j = joints.first[k], joints.second[k]
    kind = joints.kind[k]
    if kind == GEAR:
        phase, ratio = joints.figures[k, 0], joints.figures[k, 1]
        angle = pose[j, 2]
        if i >= 0:
            angle -= pose[i, 2] / ratio
        return angle - phase / ratio, (0.0, 0.0, -1.0 / ratio, 0.0, 0.0, 1.0)
    anchors, dx, dy = anchor_separation(joints, k, pose)
    ax, ay, bx, by = anchors
    if kind == PULLEY:
        x, y = pose[i, 0] + ax, pose[i, 1] + ay
        first, ux, uy = length_and_direction(x - joints.wheel[k, 0], y - joints.wheel[k, 1])
        second, vx, vy = length_and_direction(x + dx - joints.wheel[k, 2], y + dy - joints.wheel[k, 3])
        ratio = joints.figures[k, 1]
        vx, vy = ratio * vx, ratio * vy
        return first + ratio * second, (ux, uy, ax * uy - ay * ux, vx, vy, bx * vy - by * vx)
    x, y = joints.figures[k, 0] - joints.anchor[k, 0], joints.figures[k, 1] - joints.anchor[k, 1]
    _, nx, ny = length_and_direction(x, y)
    if i >= 0:
        nx, ny = rotate(nx, ny, math.cos(pose[i, 2]), math.sin(pose[i, 2]))
    if kind == GROOVE:
        nx, ny = -ny, nx
    # The axis turns with the first body, so that its lever is that of the point which coincides with the second anchor.
    lever = (ax + dx) * ny - (ay + dy) * nx
    return nx * dx + ny * dy, (-nx, -ny, -lever, nx, ny, bx * ny - by * nx)


@bare_kernel
def value_limits(joints: JointData, k: int) -> tuple[float, float]:
    """Return the smallest and largest value of the quantity that `constrained_value` returns."""
    if joints.kind[k] == PULLEY:
        return -math.inf, joints.figures[k, 0]
    if joints.kind[k] == GROOVE_ENDS or joints.kind[k] == LINEAR_MOTOR:
        x, y = joints.figures[k, 0] - joints.anchor[k, 0], joints.figures[k, 1] - joints.anchor[k, 1]
        return 0.0, math.sqrt(x * x + y * y)
    return 0.0, 0.0


@bare_kernel
def jacobian_rate(i: int, j: int, jacobian: Jacobian, velocity: FloatArray) -> float:
    """Return the rate of a quantity by its Jacobian, at velocities (N, 3)."""
    ax, ay, aw, bx, by, bw = jacobian
    rate: float = bx * velocity[j, 0] + by * velocity[j, 1] + bw * velocity[j, 2]
    if i >= 0:
        rate += ax * velocity[i, 0] + ay * velocity[i, 1] + aw * velocity[i, 2]
    return rate


@bare_kernel
def apply_along_jacobian(
    i: int,
    j: int,
    jacobian: Jacobian,
    size: float,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    out: FloatArray,
) -> None:
    """Apply an impulse along a Jacobian to velocities (N, 3)."""
    ax, ay, aw, bx, by, bw = jacobian
    out[j, 0] += inverse_mass[j] * bx * size
    out[j, 1] += inverse_mass[j] * by * size
    out[j, 2] += inverse_moment[j] * bw * size
    if i >= 0:
        out[i, 0] += inverse_mass[i] * ax * size
        out[i, 1] += inverse_mass[i] * ay * size
        out[i, 2] += inverse_moment[i] * aw * size


@bare_kernel
def inverse_jacobian_mass(
    i: int, j: int, jacobian: Jacobian, inverse_mass: FloatArray, inverse_moment: FloatArray
) -> float:
    """Return J M⁻¹ Jᵀ: the rate of a quantity per unit impulse along its Jacobian J."""
    ax, ay, aw, bx, by, bw = jacobian
    inverse: float = inverse_mass[j] * (bx * bx + by * by) + inverse_moment[j] * bw * bw
    if i >= 0:
        inverse += inverse_mass[i] * (ax * ax + ay * ay) + inverse_moment[i] * aw * aw
    return inverse


@bare_kernel
def add_spring_forces(
    joints: JointData,
    pose: FloatArray,
    rates: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    out: FloatArray,
) -> None:
    """Add the accelerations caused by springs.

    Args:
        joints: joints other than springs have no effect.
        pose: (N, 3) m and rad.
        rates: (N, 3) m/s and rad/s.
        inverse_mass: (N,) 1/kg, 0 for fixed bodies.
        inverse_moment: (N,) 1/(kg·m²).
        out: (N, 3) m/s² and rad/s², added to.
    """
    for k in range(len(joints.kind)):
        i, j = joints.first[k], joints.second[k]
        if joints.kind[k] == SPRING:
            anchors, dx, dy = anchor_separation(joints, k, pose)
            x, y = spring_force(joints, k, anchors, dx, dy, rates)
            apply_impulse(i, j, anchors, x, y, inverse_mass, inverse_moment, out)
        elif joints.kind[k] == ROTARY_SPRING:
            apply_angular_impulse(i, j, spring_torque(joints, k, pose, rates), inverse_moment, out)


@bare_kernel
def spring_force(
    joints: JointData, k: int, anchors: Anchors, dx: float, dy: float, rates: FloatArray
) -> tuple[float, float]:
    """Return the force of spring k on its second body, x and y, N; (dx, dy) is the vector between its anchors, m.

    If the anchors coincide, the axis is the direction of their relative velocity. If that is 0 too, the force is 0: a
    spring of rest length 0 is in equilibrium there, any other in unstable equilibrium.
    """
    vx, vy = relative_velocity(joints.first[k], joints.second[k], anchors, rates)
    length, nx, ny = length_and_direction(dx, dy)
    if length == 0.0:
        _, nx, ny = length_and_direction(vx, vy)
    rest, stiffness, damping = joints.figures[k, 0], joints.figures[k, 1], joints.figures[k, 2]
    force = _spring_law(rest, stiffness, damping, length, vx * nx + vy * ny)
    if joints.pulls_only[k] and (length <= rest or force > 0.0):
        return 0.0, 0.0
    return force * nx, force * ny


@bare_kernel
def spring_torque(joints: JointData, k: int, pose: FloatArray, rates: FloatArray) -> float:
    """Return the torque of rotary spring k on its second body, N·m."""
    i, j = joints.first[k], joints.second[k]
    rest, stiffness, damping = joints.figures[k, 0], joints.figures[k, 1], joints.figures[k, 2]
    angle, rate = relative_rotation(i, j, pose), relative_rotation(i, j, rates)
    torque: float = _spring_law(rest, stiffness, damping, angle, rate)
    return torque


@bare_kernel
def damper_power(joints: JointData, pose: FloatArray, rates: FloatArray) -> float:
    """Return the power, W, of the dampers of springs: −c l̇² and −c φ̇²; at most 0.

    Where a spring that only pulls would push, its damper takes what its stiffness gives.

    Args:
        joints: joints other than springs have no effect.
        pose: (N, 3) m and rad.
        rates: (N, 3) m/s and rad/s.
    """
    power = 0.0
    for k in range(len(joints.kind)):
        i, j = joints.first[k], joints.second[k]
        if joints.kind[k] == SPRING:
            anchors, dx, dy = anchor_separation(joints, k, pose)
            vx, vy = relative_velocity(i, j, anchors, rates)
            length, nx, ny = length_and_direction(dx, dy)
            if length == 0.0:
                _, nx, ny = length_and_direction(vx, vy)
            rate, stretch = vx * nx + vy * ny, length - joints.figures[k, 0]
            if joints.pulls_only[k]:
                if stretch > 0.0:
                    power -= max(joints.figures[k, 2] * rate, -joints.figures[k, 1] * stretch) * rate
                continue
            power -= joints.figures[k, 2] * rate**2
        elif joints.kind[k] == ROTARY_SPRING:
            power -= joints.figures[k, 2] * relative_rotation(i, j, rates) ** 2
    return power


@bare_kernel
def write_spring_loads(joints: JointData, pose: FloatArray, rates: FloatArray, load: FloatArray) -> None:
    """Write the load of each spring on its second body into its row: force, N, or torque, N·m, and 0.

    Args:
        joints: joints other than springs have no effect.
        pose: (N, 3) m and rad.
        rates: (N, 3) m/s and rad/s.
        load: (J, 2), by index of the joint in the setup.
    """
    for k in range(len(joints.kind)):
        if joints.kind[k] == SPRING:
            anchors, dx, dy = anchor_separation(joints, k, pose)
            load[joints.joint[k], 0], load[joints.joint[k], 1] = spring_force(joints, k, anchors, dx, dy, rates)
        elif joints.kind[k] == ROTARY_SPRING:
            load[joints.joint[k], 0], load[joints.joint[k], 1] = spring_torque(joints, k, pose, rates), 0.0


MAX_STRETCH = 0.1
"""Largest stretch of cloth, as a fraction of the rest length of a spring."""


def stretch_limits(joints: JointData, max_stretch: float) -> JointData:
    """Return slide joints that limit the stretch of springs.

    Springs of rest length 0 get none, because that would be a pivot. Rotary springs get none.

    Args:
        joints: joints other than springs are ignored.
        max_stretch: largest stretch as a fraction of the rest length; inf for no limit.
    """
    rows = np.flatnonzero((joints.kind == SPRING) & (joints.figures[:, 0] > 0.0) & np.isfinite(max_stretch))
    own = joints.take(rows)
    figures = np.zeros((len(rows), 3))
    figures[:, 1] = (1.0 + max_stretch) * own.figures[:, 0]
    unlimited = np.full(len(rows), np.inf)
    return own._replace(
        kind=np.full(len(rows), SLIDE),
        figures=figures,
        max_force=unlimited,
        max_bias=unlimited.copy(),
        pulls_only=np.zeros(len(rows), np.bool_),
    )
