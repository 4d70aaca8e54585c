"""Strides: what drives gave to their bodies in a substep, and what these gave back, for the account.

A body on a hinge has one degree of freedom: all work on it is an angular impulse about the hinge times a mean spin.
What pushes a kinematic body is whatever it takes to move it so: what it changed by, less what contacts gave.
"""

from typing import NamedTuple

import numpy as np

from sandbox.engines.native.axle import Axle
from sandbox.engines.native.hauls import Momenta
from sandbox.engines.native.hinge import Hinge
from sandbox.engines.native.points import Points
from sandbox.engines.native.states import State
from sandbox.engines.native.strokes import Plunger
from sandbox.scene.bodies import Bodies
from sandbox.trajectory import FloatArray


class Worked(NamedTuple):
    """The work on driven bodies in a substep, J."""

    driven: float
    """by their drives, stops included; with the height of what nothing stops"""
    weight: float
    """by their weight, as the steps have it"""
    lifted: float
    """the potential energy that those by torque gained"""


def meant(axles: list[Axle], before: State, now: State, velocity: FloatArray, spin: FloatArray) -> None:
    """Put mean velocities and spins of driven bodies in place: those about what pymunk takes for their centres."""
    for axle in axles:
        n = axle.number
        if isinstance(axle, Plunger):
            velocity[n] = 0.5 * (before.velocity[n] + now.velocity[n])
        else:
            spin[n] = 0.5 * (before.spin[n] + now.spin[n])


def worked(
    axles: list[Axle],
    states: tuple[State, State],
    means: tuple[FloatArray, FloatArray],
    points: Points,
    bodies: Bodies,
    gravity: tuple[float, float],
    h: float,
    share: float,
) -> Worked:
    """Return the work on driven bodies in a substep, or in a first share of it.

    Args:
        axles: those bodies.
        states: at its beginning, and at its end or where it is cut.
        means: velocities (N + 1, 2), m/s, and spins (N + 1,), rad/s, of both.
        points: the contacts of the substep, or a share of their impulses.
        bodies: all.
        gravity: m/s².
        h: the whole substep, s.
        share: of it.
    """
    before, now = states
    velocity, spin = means
    met = Momenta(np.zeros_like(velocity), np.zeros_like(spin), np.empty(0, np.int64))
    met.less(points.hauls)  # so that it is what contacts took
    driven = weight = lifted = 0.0
    for axle in axles:
        n = axle.number
        mass = float(bodies.mass[n])
        shift = now.position[n] - before.position[n]
        rise = -mass * float(shift @ np.asarray(gravity))
        if isinstance(axle, Hinge):
            lifted += rise
        else:
            driven += rise  # it carries that weight, whatever this is
        if isinstance(axle, Plunger):
            given = mass * (now.velocity[n] - before.velocity[n]) + met.linear[n]
            driven += float(given @ velocity[n])
            continue
        x, y = axle.mount.hinge
        moment = float(bodies.moment[n]) + mass * (x * x + y * y)
        if isinstance(axle, Hinge):
            weight += axle.fall * h * share * float(spin[n])
        if isinstance(axle, Hinge) and not axle.stuck:
            given = axle.given * share
        else:
            given = moment * float(now.spin[n] - before.spin[n]) + float(met.angular[n])
            given -= axle.fall * h * share if isinstance(axle, Hinge) else 0.0
        driven += given * float(spin[n])
    return Worked(driven, weight, lifted)
