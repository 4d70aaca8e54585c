"""Attraction: towards a place or a body, a = strength / (r² + softening²), as the sun does."""

from sandbox.engines.kernel import bare_kernel
from sandbox.engines.reference.joints.ties import line
from sandbox.trajectory import FloatArray, IntArray


@bare_kernel
def attract(
    pose: FloatArray,
    target: IntArray,
    place: FloatArray,
    strength: FloatArray,
    softening: FloatArray,
    inverse_mass: FloatArray,
    out: FloatArray,
) -> None:
    """Add the accelerations of N bodies by A attractions, and what they give back to the bodies that attract.

    A strength is G·M. The attracting body's own mass counts only in its answer: it is pulled with the force that it
    gives. What coincides with its target is not pulled. Costs A·N.

    Args:
        pose: (N, 2 or 3) m.
        target: (A,) body number, or −1 for a place.
        place: (A, 2) m, of those with none.
        strength: (A,) m³/s².
        softening: (A,) m.
        inverse_mass: (N,) 1/kg; where 0, no pull is felt.
        out: (N, 2 or 3) m/s², added to.
    """
    for k in range(len(target)):
        own = target[k]
        x, y = (pose[own, 0], pose[own, 1]) if own >= 0 else (place[k, 0], place[k, 1])
        for i in range(len(pose)):
            if i == own or inverse_mass[i] == 0.0:
                continue
            distance, nx, ny = line(x - pose[i, 0], y - pose[i, 1])
            if distance == 0.0:
                continue
            pull = strength[k] / (distance * distance + softening[k] * softening[k])
            out[i, 0] += pull * nx
            out[i, 1] += pull * ny
            if own >= 0:
                answer = pull * (inverse_mass[own] / inverse_mass[i])
                out[own, 0] -= answer * nx
                out[own, 1] -= answer * ny
