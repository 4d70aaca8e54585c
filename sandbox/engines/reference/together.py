"""Together: contacts, joints, and the stops of what drives turn, as impulses that take turns until all agree."""

from typing import NamedTuple

import numpy as np

from sandbox.engines.kernel import bare_kernel
from sandbox.engines.reference.impulses import solve_once, start_with
from sandbox.engines.reference.joints.impulses import one_pass, warm_start
from sandbox.engines.reference.joints.rows import Rows
from sandbox.engines.reference.manifolds import Manifolds
from sandbox.trajectory import FloatArray, IntArray


class Stops(NamedTuple):
    """S bodies that are pressed onto a stop."""

    body: IntArray
    """(S,)"""
    way: FloatArray
    """(S,) 1 or −1: the sense in which the stop lets it turn no further"""
    given: FloatArray
    """(S,) N·m·s, against that sense; that to start with, and then the sum"""


NO_STOPS = Stops(np.empty(0, np.int64), np.empty(0), np.empty(0))


@bare_kernel
def solve_together(
    now: Manifolds,
    bounce: FloatArray,
    rows: Rows,
    stops: Stops,
    velocity: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    impulse: FloatArray,
    iterations: int,
) -> None:
    """Give contacts, joints and stops the impulses that they ask for, in this order in each pass, as Munk2D does.

    Args:
        now: K contacts.
        bounce: (K,) m/s, as `solve_velocities` takes it.
        rows: of the joints, prepared.
        stops: one-sided: they push, and never pull.
        velocity: (N, 3) m/s and rad/s, changed.
        inverse_mass: (N,) 1/kg.
        inverse_moment: (N,) 1/(kg·m²).
        impulse: (K, 2) N·s of the contacts; those to start with, and then the sums.
        iterations: passes over all.
    """
    spin = velocity[:, 2]
    start_with(now, velocity, spin, inverse_mass, inverse_moment, impulse)
    warm_start(rows, velocity, inverse_mass, inverse_moment)
    for k in range(len(stops.body)):
        spin[stops.body[k]] -= stops.way[k] * stops.given[k] * inverse_moment[stops.body[k]]
    for _ in range(iterations):
        solve_once(now, bounce, velocity, spin, inverse_mass, inverse_moment, impulse)
        one_pass(rows, velocity, inverse_mass, inverse_moment)
        for k in range(len(stops.body)):
            n, way, old = stops.body[k], stops.way[k], stops.given[k]
            stops.given[k] = max(old + way * spin[n] / inverse_moment[n], 0.0)
            spin[n] -= way * (stops.given[k] - old) * inverse_moment[n]
