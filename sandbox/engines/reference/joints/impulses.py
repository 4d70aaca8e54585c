"""Joint impulses: rows fulfilled one after the other, again and again, until they agree (Catto 2005)."""

import math

from sandbox.engines.kernel import bare_kernel
from sandbox.engines.reference.joints.rows import BOTH, TURN, Rows
from sandbox.engines.reference.joints.ties import parting, push, turning, twist
from sandbox.trajectory import FloatArray


@bare_kernel
def warm_start(rows: Rows, velocity: FloatArray, inverse_mass: FloatArray, inverse_moment: FloatArray) -> None:
    """Apply the impulses that rows start from; arguments as in `one_pass`."""
    for k in range(len(rows.holds)):
        _give(rows, k, rows.impulse[k, 0], rows.impulse[k, 1], velocity, inverse_mass, inverse_moment)


@bare_kernel
def one_pass(rows: Rows, velocity: FloatArray, inverse_mass: FloatArray, inverse_moment: FloatArray) -> None:
    """Fulfil each row once, in order; a sum of impulses never leaves its bounds.

    Args:
        rows: K of them; their impulses are changed.
        velocity: (N, 3) m/s and rad/s, changed.
        inverse_mass: (N,) 1/kg, 0 for what is fixed.
        inverse_moment: (N,) 1/(kg·m²).
    """
    for k in range(len(rows.holds)):
        least, most = rows.bound[k, 0], rows.bound[k, 1]
        if least == most:
            continue
        i, j = rows.first[k], rows.second[k]
        old_x, old_y = rows.impulse[k, 0], rows.impulse[k, 1]
        if rows.holds[k] == TURN:
            missing = rows.target[k, 0] - turning(i, j, velocity)
            rows.impulse[k, 0] = min(max(old_x + rows.mass[k, 0] * missing, least), most)
        else:
            arms = rows.arm[k, 0], rows.arm[k, 1], rows.arm[k, 2], rows.arm[k, 3]
            vx, vy = parting(i, j, arms, velocity)
            if rows.holds[k] == BOTH:
                vx, vy = rows.target[k, 0] - vx, rows.target[k, 1] - vy
                x = old_x + rows.mass[k, 0] * vx + rows.mass[k, 1] * vy
                y = old_y + rows.mass[k, 1] * vx + rows.mass[k, 2] * vy
                if most < math.inf:
                    size = math.sqrt(x * x + y * y)
                    share = most / size if size > most else 1.0
                    x, y = share * x, share * y
                rows.impulse[k, 0], rows.impulse[k, 1] = x, y
            else:
                missing = rows.target[k, 0] - (vx * rows.normal[k, 0] + vy * rows.normal[k, 1])
                rows.impulse[k, 0] = min(max(old_x + rows.mass[k, 0] * missing, least), most)
        more_x, more_y = rows.impulse[k, 0] - old_x, rows.impulse[k, 1] - old_y
        _give(rows, k, more_x, more_y, velocity, inverse_mass, inverse_moment)


@bare_kernel
def row_work(rows: Rows, velocity: FloatArray) -> float:
    """Return the work, J, of all rows' impulses: times how fast their bodies part, where velocities are (N, 3)."""
    work = 0.0
    for k in range(len(rows.holds)):
        i, j, x, y = rows.first[k], rows.second[k], rows.impulse[k, 0], rows.impulse[k, 1]
        if rows.holds[k] == TURN:
            work += x * turning(i, j, velocity)
            continue
        if rows.holds[k] != BOTH:
            x, y = x * rows.normal[k, 0], x * rows.normal[k, 1]
        arms = rows.arm[k, 0], rows.arm[k, 1], rows.arm[k, 2], rows.arm[k, 3]
        vx, vy = parting(i, j, arms, velocity)
        work += x * vx + y * vy
    return work


@bare_kernel
def _give(
    rows: Rows,
    k: int,
    x: float,
    y: float,
    velocity: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
) -> None:
    """Apply an impulse of row k, in the row's own terms."""
    i, j = rows.first[k], rows.second[k]
    if rows.holds[k] == TURN:
        twist(i, j, x, inverse_moment, velocity)
        return
    if rows.holds[k] != BOTH:
        x, y = x * rows.normal[k, 0], x * rows.normal[k, 1]
    arms = rows.arm[k, 0], rows.arm[k, 1], rows.arm[k, 2], rows.arm[k, 3]
    push(i, j, arms, x, y, inverse_mass, inverse_moment, velocity)
