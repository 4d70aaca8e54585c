"""Velocity constraints of joints, and their sequential impulses.

As in Munk2D (`cpPinJoint.c`, `cpPivotJoint.c`, `cpSlideJoint.c`, `cpRotaryLimitJoint.c`, `cpGearJoint.c`,
`cpSimpleMotor.c`): the target velocity of a row corrects the fraction 1 − bias^h of the position error within a step,
and is bounded by the `max_bias` of the joint. A groove has two rows, across it and along it, as Box2D's prismatic
joint; Munk2D clamps the impulse of a point instead.
"""

import math
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.geometry import length_and_direction
from sandbox.engines.common.kernel import bare_kernel
from sandbox.engines.reference.joint_data import (
    GEAR,
    GROOVE_ENDS,
    JACOBIAN_KINDS,
    LINEAR_MOTOR,
    MOTOR,
    PIVOT,
    PULLEY,
    ROD,
    ROTARY_LIMIT,
    ROTARY_SPRING,
    Jacobian,
    JointData,
    anchor_separation,
    apply_along_jacobian,
    apply_angular_impulse,
    apply_impulse,
    constrained_value,
    effective_mass_matrix,
    inverse_effective_mass,
    inverse_effective_moment,
    inverse_jacobian_mass,
    jacobian_rate,
    relative_rotation,
    relative_velocity,
    value_limits,
)

DISTANCE, POINT, ANGLE, JACOBIAN = 0, 1, 2, 3
"""Constrained quantity of a row: distance of the anchors along the axis, position in both directions, angle, or another
quantity by its Jacobian"""


class VelocityConstraints(NamedTuple):
    """K rows, one for each joint, two for each groove. Impulses are those on the second body."""

    kind: IntArray
    """(K,) `DISTANCE`, `POINT`, `ANGLE` or `JACOBIAN`"""
    first: IntArray
    """(K,) body index, or −1 for the world"""
    second: IntArray
    """(K,)"""
    anchor: FloatArray
    """(K, 4) m, from the centres to the anchors: ax, ay, bx, by"""
    normal: FloatArray
    """(K, 2) unit axis of a `DISTANCE` row, from the first anchor to the second; of a `JACOBIAN` row the direction of
    its impulse on the second body; 1, 0 if that is angular"""
    jacobian: FloatArray
    """(K, 6) of a `JACOBIAN` row"""
    mass: FloatArray
    """(K, 3) effective mass, kg or kg·m², in the first column; of `POINT` rows the matrix xx, xy, yy. 0 if immovable"""
    target: FloatArray
    """(K, 2) m/s or rad/s, target velocity of the second anchor relative to the first"""
    bound: FloatArray
    """(K, 2) N·s or N·m·s, bounds of the accumulated impulse; 0, 0 if inactive"""
    impulse: FloatArray
    """(K, 2) N·s or N·m·s, accumulated impulse: along the normal or the Jacobian, or x and y, or angular"""


def make_velocity_constraints(joints: JointData) -> VelocityConstraints:
    """Return rows for joints, with zero impulses. Rows of springs only store impulses."""
    count = len(joints.kind)
    kind = np.full(count, DISTANCE)
    kind[joints.kind == PIVOT] = POINT
    kind[np.isin(joints.kind, (ROTARY_LIMIT, ROTARY_SPRING, MOTOR))] = ANGLE
    kind[np.isin(joints.kind, JACOBIAN_KINDS)] = JACOBIAN
    pairs = [np.zeros((count, 2)) for _ in range(4)]
    return VelocityConstraints(
        kind,
        joints.first,
        joints.second,
        np.zeros((count, 4)),
        pairs[0],
        np.zeros((count, 6)),
        np.zeros((count, 3)),
        pairs[1],
        pairs[2],
        pairs[3],
    )


@bare_kernel
def prepare(
    rows: VelocityConstraints,
    joints: JointData,
    pose: FloatArray,
    h: float,
    old_h: float,
    bias: float,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
) -> None:
    """Update rows to the present poses; their impulses become the warm start.

    An impulse is proportional to its time, so that a shorter step starts from a smaller impulse. A longer step does not
    start from a larger one: the impulse of an impact does not grow with time and would be too large after a short step.

    Args:
        rows: K of them, changed.
        joints: the K joints of these rows.
        pose: (N, 3) m and rad.
        h: step, s.
        old_h: step in which the present impulses were found, s.
        bias: fraction of an error that remains after one second, 0 to 1.
        inverse_mass: (N,) 1/kg.
        inverse_moment: (N,) 1/(kg·m²).
    """
    rate = (1.0 - bias**h) / h
    kept = min(h / old_h, 1.0)
    for k in range(len(rows.kind)):
        i, j = joints.first[k], joints.second[k]
        upper = joints.max_force[k] * h
        rows.bound[k, 0], rows.bound[k, 1] = -upper, upper
        if upper == 0.0:  # a motor that was switched off: rows without freedom are not solved
            rows.impulse[k, 0] = rows.impulse[k, 1] = 0.0
        rows.impulse[k, 0] *= kept
        rows.impulse[k, 1] *= kept
        if rows.kind[k] == ANGLE:
            inverse = inverse_effective_moment(i, j, inverse_moment)
            rows.mass[k, 0] = 1.0 / inverse if inverse > 0.0 else 0.0
            if joints.kind[k] == MOTOR:
                rows.target[k, 0] = joints.figures[k, 0]
                continue
            turned = relative_rotation(i, j, pose)
            error = _limit_error(rows, k, turned, joints.figures[k, 0], joints.figures[k, 1])
            rows.target[k, 0] = _correction(rate, error, joints.max_bias[k])
            continue
        if rows.kind[k] == JACOBIAN:
            value, jacobian = constrained_value(joints, k, pose)
            set_jacobian(rows.jacobian, rows.normal, k, joints.kind[k], jacobian)
            inverse = inverse_jacobian_mass(i, j, jacobian, inverse_mass, inverse_moment)
            rows.mass[k, 0] = 1.0 / inverse if inverse > 0.0 else 0.0
            lower_limit, upper_limit = value_limits(joints, k)
            if joints.kind[k] == LINEAR_MOTOR:  # not beyond the end of the travel
                rows.target[k, 0] = min(max(joints.figures[k, 2], (lower_limit - value) / h), (upper_limit - value) / h)
                continue
            if joints.kind[k] == PULLEY:
                # The rope may become taut within the step: as Box2D's limits, it bounds the velocity before that.
                slack = upper_limit - value
                rows.bound[k, 1] = 0.0
                rows.target[k, 0] = slack / h if slack > 0.0 else _correction(rate, -slack, joints.max_bias[k])
                continue
            if lower_limit < upper_limit:
                value = _limit_error(rows, k, value, lower_limit, upper_limit)
            rows.target[k, 0] = _correction(rate, value, joints.max_bias[k])
            continue
        anchors, dx, dy = anchor_separation(joints, k, pose)
        rows.anchor[k, 0], rows.anchor[k, 1], rows.anchor[k, 2], rows.anchor[k, 3] = anchors
        if rows.kind[k] == POINT:
            xx, xy, yy = effective_mass_matrix(i, j, anchors, inverse_mass, inverse_moment)
            rows.mass[k, 0], rows.mass[k, 1], rows.mass[k, 2] = xx, xy, yy
            speed, limit = rate * math.hypot(dx, dy), joints.max_bias[k]
            own_rate = rate if speed <= limit else rate * limit / speed
            rows.target[k, 0], rows.target[k, 1] = -own_rate * dx, -own_rate * dy
            continue
        length, nx, ny = length_and_direction(dx, dy)
        rows.normal[k, 0], rows.normal[k, 1] = nx, ny
        inverse = inverse_effective_mass(i, j, anchors, nx, ny, inverse_mass, inverse_moment) if length > 0.0 else 0.0
        rows.mass[k, 0] = 1.0 / inverse if inverse > 0.0 else 0.0
        if joints.kind[k] == ROD:
            error = length - joints.figures[k, 0]
        else:
            error = _limit_error(rows, k, length, joints.figures[k, 0], joints.figures[k, 1])
        rows.target[k, 0] = _correction(rate, error, joints.max_bias[k])


@bare_kernel
def _correction(rate: float, error: float, limit: float) -> float:
    """Return the target velocity that corrects an error, at a rate in 1/s, no faster than a limit."""
    return min(max(-rate * error, -limit), limit)


@bare_kernel
def set_jacobian(jacobian: FloatArray, normal: FloatArray, k: int, kind: int, values: Jacobian) -> None:
    """Set the Jacobian of row k, and the direction of its impulse on the second body."""
    ax, ay, aw, bx, by, bw = values
    jacobian[k, 0], jacobian[k, 1], jacobian[k, 2] = ax, ay, aw
    jacobian[k, 3], jacobian[k, 4], jacobian[k, 5] = bx, by, bw
    normal[k, 0], normal[k, 1] = (1.0, 0.0) if kind == GEAR else (bx, by)


@bare_kernel
def _row_jacobian(rows: VelocityConstraints, k: int) -> Jacobian:
    row = rows.jacobian[k]
    return row[0], row[1], row[2], row[3], row[4], row[5]


@bare_kernel
def _limit_error(rows: VelocityConstraints, k: int, value: float, lower: float, upper: float) -> float:
    """Return by how much a value exceeds its limits. Bound the impulse of row k to one sign, or to 0."""
    if value > upper:
        rows.bound[k, 1] = 0.0
        rows.impulse[k, 0] = min(rows.impulse[k, 0], 0.0)
        return value - upper
    if value < lower:
        rows.bound[k, 0] = 0.0
        rows.impulse[k, 0] = max(rows.impulse[k, 0], 0.0)
        return value - lower
    rows.bound[k, 0] = rows.bound[k, 1] = 0.0
    rows.impulse[k, 0] = 0.0
    return 0.0


def write_joint_impulses(rows: VelocityConstraints, joints: JointData, out: FloatArray) -> None:
    """Write the impulse of each joint on its second body: x and y, N·s, or an angular impulse, N·m·s, and 0.

    Args:
        rows: K of them.
        joints: the K joints of these rows.
        out: (J, 2), by index of the joint in the setup.
    """
    along = ((rows.kind == DISTANCE) | (rows.kind == JACOBIAN))[:, None]
    impulse = np.where(along, rows.impulse[:, :1] * rows.normal, rows.impulse)
    out[joints.joint] = impulse
    ends = joints.kind == GROOVE_ENDS
    out[joints.joint[ends]] += impulse[:-1][ends[1:]]  # those across the groove, in the rows before


@bare_kernel
def warm_start_joints(
    rows: VelocityConstraints, velocity: FloatArray, inverse_mass: FloatArray, inverse_moment: FloatArray
) -> None:
    """Apply the accumulated impulses; the arguments are those of `solve_joints_once`."""
    for k in range(len(rows.kind)):
        _apply_row_impulse(rows, k, rows.impulse[k, 0], rows.impulse[k, 1], velocity, inverse_mass, inverse_moment)


@bare_kernel
def solve_joints_once(
    rows: VelocityConstraints, velocity: FloatArray, inverse_mass: FloatArray, inverse_moment: FloatArray
) -> None:
    """Solve each row once, in order. Accumulated impulses stay within their bounds.

    Args:
        rows: K of them; their impulses are changed.
        velocity: (N, 3) m/s and rad/s, changed.
        inverse_mass: (N,) 1/kg, 0 for fixed bodies.
        inverse_moment: (N,) 1/(kg·m²).
    """
    for k in range(len(rows.kind)):
        lower, upper = rows.bound[k, 0], rows.bound[k, 1]
        if lower == upper:
            continue
        i, j = rows.first[k], rows.second[k]
        old_x, old_y = rows.impulse[k, 0], rows.impulse[k, 1]
        if rows.kind[k] == ANGLE:
            missing = rows.target[k, 0] - relative_rotation(i, j, velocity)
            rows.impulse[k, 0] = min(max(old_x + rows.mass[k, 0] * missing, lower), upper)
        elif rows.kind[k] == JACOBIAN:
            missing = rows.target[k, 0] - jacobian_rate(i, j, _row_jacobian(rows, k), velocity)
            rows.impulse[k, 0] = min(max(old_x + rows.mass[k, 0] * missing, lower), upper)
        else:
            anchors = rows.anchor[k, 0], rows.anchor[k, 1], rows.anchor[k, 2], rows.anchor[k, 3]
            vx, vy = relative_velocity(i, j, anchors, velocity)
            if rows.kind[k] == POINT:
                vx, vy = rows.target[k, 0] - vx, rows.target[k, 1] - vy
                x = old_x + rows.mass[k, 0] * vx + rows.mass[k, 1] * vy
                y = old_y + rows.mass[k, 1] * vx + rows.mass[k, 2] * vy
                if upper < math.inf:
                    size = math.sqrt(x * x + y * y)
                    scale = upper / size if size > upper else 1.0
                    x, y = scale * x, scale * y
                rows.impulse[k, 0], rows.impulse[k, 1] = x, y
            else:
                missing = rows.target[k, 0] - (vx * rows.normal[k, 0] + vy * rows.normal[k, 1])
                rows.impulse[k, 0] = min(max(old_x + rows.mass[k, 0] * missing, lower), upper)
        more_x, more_y = rows.impulse[k, 0] - old_x, rows.impulse[k, 1] - old_y
        _apply_row_impulse(rows, k, more_x, more_y, velocity, inverse_mass, inverse_moment)


@bare_kernel
def solve_joints(
    rows: VelocityConstraints,
    iterations: int,
    velocity: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
) -> None:
    """Solve all rows `iterations` times; the other arguments are those of `solve_joints_once`."""
    for _ in range(iterations):
        solve_joints_once(rows, velocity, inverse_mass, inverse_moment)


@bare_kernel
def joint_work(rows: VelocityConstraints, joints: JointData, velocity: FloatArray) -> tuple[float, float]:
    """Return the work of the accumulated impulses of all rows but motors, and that of motors, J.

    Args:
        rows: K of them.
        joints: the K joints of these rows.
        velocity: (N, 3) m/s and rad/s.
    """
    work = motors = 0.0
    for k in range(len(rows.kind)):
        i, j, x, y = rows.first[k], rows.second[k], rows.impulse[k, 0], rows.impulse[k, 1]
        if rows.kind[k] == ANGLE:
            done = x * relative_rotation(i, j, velocity)
            if joints.kind[k] == MOTOR:
                motors += done
            else:
                work += done
            continue
        if rows.kind[k] == JACOBIAN:
            done = x * jacobian_rate(i, j, _row_jacobian(rows, k), velocity)
            if joints.kind[k] == LINEAR_MOTOR:
                motors += done
            else:
                work += done
            continue
        if rows.kind[k] != POINT:
            x, y = x * rows.normal[k, 0], x * rows.normal[k, 1]
        anchors = rows.anchor[k, 0], rows.anchor[k, 1], rows.anchor[k, 2], rows.anchor[k, 3]
        vx, vy = relative_velocity(i, j, anchors, velocity)
        work += x * vx + y * vy
    return work, motors


@bare_kernel
def _apply_row_impulse(
    rows: VelocityConstraints,
    k: int,
    x: float,
    y: float,
    velocity: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
) -> None:
    """Apply an impulse (x, y) of row k, in the components of its `impulse` column."""
    i, j = rows.first[k], rows.second[k]
    if rows.kind[k] == ANGLE:
        apply_angular_impulse(i, j, x, inverse_moment, velocity)
        return
    if rows.kind[k] == JACOBIAN:
        apply_along_jacobian(i, j, _row_jacobian(rows, k), x, inverse_mass, inverse_moment, velocity)
        return
    if rows.kind[k] != POINT:
        x, y = x * rows.normal[k, 0], x * rows.normal[k, 1]
    anchors = rows.anchor[k, 0], rows.anchor[k, 1], rows.anchor[k, 2], rows.anchor[k, 3]
    apply_impulse(i, j, anchors, x, y, inverse_mass, inverse_moment, velocity)
