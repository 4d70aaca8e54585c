"""Position-based joints: bodies are moved into place, and their velocities follow from the displacement.

Gauss-Seidel: one link after the other, again and again. Without compliance it is relaxation (Jakobsen 2001, Advanced
character physics), with it XPBD (Macklin, Müller & Chentanez 2016). Bodies off their centres are moved and turned by
generalised inverse masses (Müller et al. 2020, Detailed rigid body simulation with extended position based dynamics).
A pivot is solved in both directions at once here, there along its error alone.

Pushing along the lines of where bodies have got to is robust and takes energy, as an implicit scheme does. Pushing
along those of where they started is SHAKE (Ryckaert, Ciccotti & Berendsen 1977), which takes none: see `solver`.

The multipliers λ are sums over the iterations, N·s² or N·m·s²: λ/h² is the force on the second body.
"""

import math

from sandbox.arrays import FloatArray
from sandbox.engines.common.kernel import bare_kernel
from sandbox.engines.reference.joint_data import (
    PIVOT,
    ROTARY_LIMIT,
    ROTARY_SPRING,
    SLIDE,
    SPRING,
    JointData,
    apply_angular_impulse,
    apply_impulse,
    block,
    line,
    reach,
    slackness,
    turning,
    yielding,
)


@bare_kernel
def project(
    ties: JointData,
    pose: FloatArray,
    start: FloatArray,
    h: float,
    iterations: int,
    lagged: bool,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    shift: FloatArray,
    multiplier: FloatArray,
    direction: FloatArray,
) -> None:
    """Move bodies to where their ties are fulfilled; springs as compliant ones.

    The caller corrects velocities by the shift over h.

    Args:
        ties: K of them.
        pose: (N, 3) m and rad where the bodies would go, changed.
        start: (N, 3) where they were at the start of the step: dampers resist the displacement from there.
        h: step, s.
        iterations: passes over all ties.
        lagged: apply impulses along the lines as they were at the start; else as they are.
        inverse_mass: (N,) 1/kg, 0 for fixed bodies.
        inverse_moment: (N,) 1/(kg·m²).
        shift: (N, 3) how far each was moved and turned; written. Taken from poses, it would have their rounding: that
            of a place far out, over h, is a velocity.
        multiplier: (K, 2) λ along the line, or x and y of a pivot, or of the angle; written.
        direction: (K, 2) the direction of the line when it was last solved; 1, 0 of an angle; written.
    """
    shift[:] = 0.0
    multiplier[:] = 0.0
    for _ in range(iterations):
        for k in range(len(ties.kind)):
            kind = ties.kind[k]
            if kind in (ROTARY_LIMIT, ROTARY_SPRING):
                _angle(ties, k, pose, start, h, inverse_moment, shift, multiplier)
                direction[k, 0], direction[k, 1] = 1.0, 0.0
                continue
            if kind == PIVOT:
                _together(ties, k, pose, start, h, lagged, inverse_mass, inverse_moment, shift, multiplier)
                continue
            i, j, old = ties.first[k], ties.second[k], multiplier[k, 0]
            arms, dx, dy = reach(ties, k, pose)
            length, nx, ny = line(dx, dy)
            moved = 0.0
            if lagged or (kind == SPRING and ties.figures[k, 2] > 0.0):
                old_arms, sx, sy = reach(ties, k, start)
                moved = (dx - sx) * nx + (dy - sy) * ny
                if lagged:
                    arms = old_arms
                    _, nx, ny = line(sx, sy)
            inverse = yielding(i, j, arms, nx, ny, inverse_mass, inverse_moment)
            if nx == ny == 0.0 or inverse == 0.0:
                continue
            if kind == SPRING:
                new = old + _compliant(ties, k, length - ties.figures[k, 0], moved, old, inverse, h)
            else:
                most = ties.figures[k, 1] if kind == SLIDE else ties.figures[k, 0]
                new = _bounded(length - inverse * old, ties.figures[k, 0], most, inverse)
            bound = ties.most_force[k] * h * h
            new = min(max(new, -bound), bound)
            multiplier[k, 0], direction[k, 0], direction[k, 1] = new, nx, ny
            x, y = (new - old) * nx, (new - old) * ny
            apply_impulse(i, j, arms, x, y, inverse_mass, inverse_moment, pose)
            apply_impulse(i, j, arms, x, y, inverse_mass, inverse_moment, shift)


@bare_kernel
def _angle(
    ties: JointData,
    k: int,
    pose: FloatArray,
    start: FloatArray,
    h: float,
    inverse_moment: FloatArray,
    shift: FloatArray,
    multiplier: FloatArray,
) -> None:
    """Bring the angle of tie k into its bounds, or towards its rest."""
    i, j = ties.first[k], ties.second[k]
    inverse = slackness(i, j, inverse_moment)
    if inverse == 0.0:
        return
    old, turned = multiplier[k, 0], turning(i, j, pose)
    if ties.kind[k] == ROTARY_SPRING:
        moved = turned - turning(i, j, start)
        new = old + _compliant(ties, k, turned - ties.figures[k, 0], moved, old, inverse, h)
    else:
        new = _bounded(turned - inverse * old, ties.figures[k, 0], ties.figures[k, 1], inverse)
    bound = ties.most_force[k] * h * h
    multiplier[k, 0] = min(max(new, -bound), bound)
    apply_angular_impulse(i, j, multiplier[k, 0] - old, inverse_moment, pose)
    apply_angular_impulse(i, j, multiplier[k, 0] - old, inverse_moment, shift)


@bare_kernel
def _together(
    ties: JointData,
    k: int,
    pose: FloatArray,
    start: FloatArray,
    h: float,
    lagged: bool,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    shift: FloatArray,
    multiplier: FloatArray,
) -> None:
    """Bring the ends of pivot k together."""
    i, j = ties.first[k], ties.second[k]
    arms, dx, dy = reach(ties, k, pose)
    if lagged:
        arms, _, _ = reach(ties, k, start)
    xx, xy, yy = block(i, j, arms, inverse_mass, inverse_moment)
    old_x, old_y = multiplier[k, 0], multiplier[k, 1]
    x, y = old_x - (xx * dx + xy * dy), old_y - (xy * dx + yy * dy)
    if ties.most_force[k] < math.inf:
        size, bound = math.sqrt(x * x + y * y), ties.most_force[k] * h * h
        scale = bound / size if size > bound else 1.0
        x, y = scale * x, scale * y
    multiplier[k, 0], multiplier[k, 1] = x, y
    apply_impulse(i, j, arms, x - old_x, y - old_y, inverse_mass, inverse_moment, pose)
    apply_impulse(i, j, arms, x - old_x, y - old_y, inverse_mass, inverse_moment, shift)


@bare_kernel
def _compliant(ties: JointData, k: int, stretch: float, moved: float, old: float, inverse: float, h: float) -> float:
    """Return by how much λ of spring k changes: Macklin et al. 2016, (26), with α̃ = 1/(k h²) and γ = c/(k h)."""
    compliance: float = 1.0 / (ties.figures[k, 1] * h * h)
    resistance: float = ties.figures[k, 2] / (ties.figures[k, 1] * h)
    return -(stretch + compliance * old + resistance * moved) / ((1.0 + resistance) * inverse + compliance)


@bare_kernel
def _bounded(free: float, least: float, most: float, inverse: float) -> float:
    """Return the λ that brings what would be at `free` without it into its bounds: none, if it is there."""
    return (min(max(free, least), most) - free) / inverse
