"""Springs as forces: F = −k (l − l₀) − c l̇ along the line of a spring, τ = −k (φ − φ₀) − c φ̇ of a rotary one.

They are part of the state transition, so that an integrator finds them wherever it asks for forces. A force worked out
once and held for the step would make any scheme an explicit Euler.
"""

from sandbox.engines.kernel import bare_kernel
from sandbox.engines.reference.joints.ties import (
    ROTARY_SPRING,
    SPRING,
    Arms,
    Ties,
    line,
    parting,
    push,
    reach,
    turning,
    twist,
)
from sandbox.trajectory import FloatArray


@bare_kernel
def spring_forces(
    ties: Ties,
    pose: FloatArray,
    rates: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    out: FloatArray,
) -> None:
    """Add the accelerations by springs.

    Args:
        ties: of them, the springs and rotary springs.
        pose: (N, 3) m and rad.
        rates: (N, 3) m/s and rad/s.
        inverse_mass: (N,) 1/kg, 0 for what is fixed.
        inverse_moment: (N,) 1/(kg·m²).
        out: (N, 3) m/s² and rad/s², added to.
    """
    for k in range(len(ties.kind)):
        i, j = ties.first[k], ties.second[k]
        if ties.kind[k] == SPRING:
            arms, dx, dy = reach(ties, k, pose)
            x, y = tension(ties, k, arms, dx, dy, rates)
            push(i, j, arms, x, y, inverse_mass, inverse_moment, out)
        elif ties.kind[k] == ROTARY_SPRING:
            twist(i, j, torsion(ties, k, pose, rates), inverse_moment, out)


@bare_kernel
def tension(ties: Ties, k: int, arms: Arms, dx: float, dy: float, rates: FloatArray) -> tuple[float, float]:
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
def torsion(ties: Ties, k: int, pose: FloatArray, rates: FloatArray) -> float:
    """Return the torque of rotary spring k on its second body, N·m."""
    i, j = ties.first[k], ties.second[k]
    turned = turning(i, j, pose) - ties.figures[k, 0]
    torque: float = -ties.figures[k, 1] * turned - ties.figures[k, 2] * turning(i, j, rates)
    return torque


@bare_kernel
def damper_power(ties: Ties, pose: FloatArray, rates: FloatArray) -> float:
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
def spring_loads(ties: Ties, pose: FloatArray, rates: FloatArray, load: FloatArray) -> None:
    """Write what each spring gives its second body into its link's row: force, N, or torque, N·m, and 0.

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
