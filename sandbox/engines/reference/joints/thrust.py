"""Thrust: a force at a point of a body, both turning with it, as a spaceship's nozzle."""

import math

from sandbox.engines.kernel import bare_kernel
from sandbox.trajectory import FloatArray, IntArray


@bare_kernel
def thrust(
    pose: FloatArray,
    body: IntArray,
    point: FloatArray,
    force: FloatArray,
    throttle: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    out: FloatArray,
) -> None:
    """Add the accelerations by T thrusts.

    Args:
        pose: (N, 3) m and rad.
        body: (T,) whom each drives.
        point: (T, 2) m, where it acts, in the body's own frame about its centre of mass.
        force: (T, 2) N, in that frame, at full throttle.
        throttle: (T,) the share of it that acts.
        inverse_mass: (N,) 1/kg.
        inverse_moment: (N,) 1/(kg·m²).
        out: (N, 3) m/s² and rad/s², added to.
    """
    for k in range(len(body)):
        i = body[k]
        x, y = throttle[k] * force[k, 0], throttle[k] * force[k, 1]
        cos, sin = math.cos(pose[i, 2]), math.sin(pose[i, 2])
        out[i, 0] += inverse_mass[i] * (cos * x - sin * y)
        out[i, 1] += inverse_mass[i] * (sin * x + cos * y)
        out[i, 2] += inverse_moment[i] * (point[k, 0] * y - point[k, 1] * x)
