"""Position-based joints: bodies are moved into place, and their velocities follow from the displacement.

Gauss–Seidel iteration over the joints. Without compliance it is relaxation (Jakobsen 2001, Advanced character physics),
with compliance XPBD (Macklin, Müller & Chentanez 2016). Anchors off the centre use generalised inverse masses (Müller
et al. 2020, Detailed rigid body simulation with extended position based dynamics). A pivot is solved in both directions
at once; Müller et al. solve it along its error.

Corrections along the axes at the end of the step are robust and dissipate energy, as an implicit scheme does.
Corrections along the axes at its start are SHAKE (Ryckaert, Ciccotti & Berendsen 1977), which does not dissipate; see
`joints`.

The multipliers λ are sums over the iterations, N·s² or N·m·s²: λ/h² is the force on the second body.
"""

import math

from sandbox.arrays import FloatArray
from sandbox.engines.common.geometry import length_and_direction
from sandbox.engines.common.kernel import bare_kernel
from sandbox.engines.reference.joint_data import (
    JACOBIAN_KINDS,
    LINEAR_MOTOR,
    MOTOR,
    PIVOT,
    ROTARY_LIMIT,
    ROTARY_SPRING,
    SLIDE,
    SPRING,
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
    relative_rotation,
    value_limits,
)
from sandbox.engines.reference.joint_rows import set_jacobian


@bare_kernel
def project(
    joints: JointData,
    pose: FloatArray,
    start: FloatArray,
    h: float,
    iterations: int,
    shake: bool,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    shift: FloatArray,
    multiplier: FloatArray,
    direction: FloatArray,
    jacobian: FloatArray,
) -> None:
    """Move bodies so that joints are satisfied; springs are compliant joints.

    The caller corrects velocities by the shift over h.

    Args:
        joints: K joints.
        pose: (N, 3) m and rad, after free motion; changed.
        start: (N, 3) m and rad, at the start of the step; dampers resist the displacement from it.
        h: step, s.
        iterations: passes over all ties.
        shake: correct along the axes at the start of the step (SHAKE), not along the present ones.
        inverse_mass: (N,) 1/kg, 0 for fixed bodies.
        inverse_moment: (N,) 1/(kg·m²).
        shift: (N, 3) m and rad, displacement of each body; written. The difference of poses would have the rounding
            errors of large coordinates, which divided by h are velocities.
        multiplier: (K, 2) λ along the axis, or x and y of a pivot, or of the angle; written.
        direction: (K, 2) axis when it was last solved; 1, 0 for an angle; written.
        jacobian: (K, 6) of grooves, gears and pulleys, likewise; written.
    """
    shift[:] = 0.0
    multiplier[:] = 0.0
    for _ in range(iterations):
        for k in range(len(joints.kind)):
            kind = joints.kind[k]
            if kind in JACOBIAN_KINDS:
                inverses = inverse_mass, inverse_moment
                _solve_value(joints, k, pose, start, h, shake, *inverses, shift, multiplier, direction, jacobian)
                continue
            if kind in (ROTARY_LIMIT, ROTARY_SPRING, MOTOR):
                _solve_angle(joints, k, pose, start, h, inverse_moment, shift, multiplier)
                direction[k, 0], direction[k, 1] = 1.0, 0.0
                continue
            if kind == PIVOT:
                _solve_pivot(joints, k, pose, start, h, shake, inverse_mass, inverse_moment, shift, multiplier)
                continue
            i, j, old = joints.first[k], joints.second[k], multiplier[k, 0]
            anchors, dx, dy = anchor_separation(joints, k, pose)
            length, nx, ny = length_and_direction(dx, dy)
            displacement = 0.0
            if shake or (kind == SPRING and joints.figures[k, 2] > 0.0):
                start_anchors, sx, sy = anchor_separation(joints, k, start)
                displacement = (dx - sx) * nx + (dy - sy) * ny
                if shake:
                    anchors = start_anchors
                    _, nx, ny = length_and_direction(sx, sy)
            inverse = inverse_effective_mass(i, j, anchors, nx, ny, inverse_mass, inverse_moment)
            if nx == ny == 0.0 or inverse == 0.0:
                continue
            if kind == SPRING:
                new = old + _compliant_change(joints, k, length - joints.figures[k, 0], displacement, old, inverse, h)
                if joints.pulls_only[k]:
                    new = min(new, 0.0)
            else:
                upper = joints.figures[k, 1] if kind == SLIDE else joints.figures[k, 0]
                new = _bounded_multiplier(length - inverse * old, joints.figures[k, 0], upper, inverse)
            bound = joints.max_force[k] * h * h
            new = min(max(new, -bound), bound)
            multiplier[k, 0], direction[k, 0], direction[k, 1] = new, nx, ny
            x, y = (new - old) * nx, (new - old) * ny
            apply_impulse(i, j, anchors, x, y, inverse_mass, inverse_moment, pose)
            apply_impulse(i, j, anchors, x, y, inverse_mass, inverse_moment, shift)


@bare_kernel
def _solve_angle(
    joints: JointData,
    k: int,
    pose: FloatArray,
    start: FloatArray,
    h: float,
    inverse_moment: FloatArray,
    shift: FloatArray,
    multiplier: FloatArray,
) -> None:
    """Solve rotary limit, rotary spring or motor k. A motor turns from the start of the step at its rate."""
    i, j = joints.first[k], joints.second[k]
    inverse = inverse_effective_moment(i, j, inverse_moment)
    if inverse == 0.0:
        return
    old, angle = multiplier[k, 0], relative_rotation(i, j, pose)
    if joints.kind[k] == ROTARY_SPRING:
        displacement = angle - relative_rotation(i, j, start)
        new = old + _compliant_change(joints, k, angle - joints.figures[k, 0], displacement, old, inverse, h)
    elif joints.kind[k] == MOTOR:
        target = relative_rotation(i, j, start) + joints.figures[k, 0] * h
        new = _bounded_multiplier(angle - inverse * old, target, target, inverse)
    else:
        new = _bounded_multiplier(angle - inverse * old, joints.figures[k, 0], joints.figures[k, 1], inverse)
    bound = joints.max_force[k] * h * h
    multiplier[k, 0] = min(max(new, -bound), bound)
    apply_angular_impulse(i, j, multiplier[k, 0] - old, inverse_moment, pose)
    apply_angular_impulse(i, j, multiplier[k, 0] - old, inverse_moment, shift)


@bare_kernel
def _solve_value(
    joints: JointData,
    k: int,
    pose: FloatArray,
    start: FloatArray,
    h: float,
    shake: bool,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    shift: FloatArray,
    multiplier: FloatArray,
    direction: FloatArray,
    jacobian: FloatArray,
) -> None:
    """Solve joint k of one of the kinds of `constrained_value`. A motor moves its value from that at the start."""
    i, j = joints.first[k], joints.second[k]
    value, axes = constrained_value(joints, k, pose)
    lower, upper = value_limits(joints, k)
    if shake or joints.kind[k] == LINEAR_MOTOR:
        start_value, start_axes = constrained_value(joints, k, start)
        if shake:
            axes = start_axes
        if joints.kind[k] == LINEAR_MOTOR:
            lower = upper = min(max(start_value + joints.figures[k, 2] * h, lower), upper)
    inverse = inverse_jacobian_mass(i, j, axes, inverse_mass, inverse_moment)
    if inverse == 0.0:
        return
    old = multiplier[k, 0]
    new, bound = _bounded_multiplier(value - inverse * old, lower, upper, inverse), joints.max_force[k] * h * h
    new = min(max(new, -bound), bound)
    multiplier[k, 0] = new
    set_jacobian(jacobian, direction, k, joints.kind[k], axes)
    apply_along_jacobian(i, j, axes, new - old, inverse_mass, inverse_moment, pose)
    apply_along_jacobian(i, j, axes, new - old, inverse_mass, inverse_moment, shift)


@bare_kernel
def _solve_pivot(
    joints: JointData,
    k: int,
    pose: FloatArray,
    start: FloatArray,
    h: float,
    shake: bool,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    shift: FloatArray,
    multiplier: FloatArray,
) -> None:
    """Solve pivot k."""
    i, j = joints.first[k], joints.second[k]
    anchors, dx, dy = anchor_separation(joints, k, pose)
    if shake:
        anchors, _, _ = anchor_separation(joints, k, start)
    xx, xy, yy = effective_mass_matrix(i, j, anchors, inverse_mass, inverse_moment)
    old_x, old_y = multiplier[k, 0], multiplier[k, 1]
    x, y = old_x - (xx * dx + xy * dy), old_y - (xy * dx + yy * dy)
    if joints.max_force[k] < math.inf:
        size, bound = math.sqrt(x * x + y * y), joints.max_force[k] * h * h
        scale = bound / size if size > bound else 1.0
        x, y = scale * x, scale * y
    multiplier[k, 0], multiplier[k, 1] = x, y
    apply_impulse(i, j, anchors, x - old_x, y - old_y, inverse_mass, inverse_moment, pose)
    apply_impulse(i, j, anchors, x - old_x, y - old_y, inverse_mass, inverse_moment, shift)


@bare_kernel
def _compliant_change(
    joints: JointData, k: int, stretch: float, displacement: float, old: float, inverse: float, h: float
) -> float:
    """Return the change of λ of spring k: Macklin et al. 2016, (26), with α̃ = 1/(k h²) and γ = c/(k h)."""
    compliance: float = 1.0 / (joints.figures[k, 1] * h * h)
    resistance: float = joints.figures[k, 2] / (joints.figures[k, 1] * h)
    return -(stretch + compliance * old + resistance * displacement) / ((1.0 + resistance) * inverse + compliance)


@bare_kernel
def _bounded_multiplier(free: float, lower: float, upper: float, inverse: float) -> float:
    """Return the λ that moves a value from `free`, where it is without λ, into its bounds; 0 if it is within them."""
    return (min(max(free, lower), upper) - free) / inverse
