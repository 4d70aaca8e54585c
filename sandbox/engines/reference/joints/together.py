"""Contacts and joints in one: sequential impulses that take turns, so that they agree with each other."""

from sandbox.engines.kernel import bare_kernel
from sandbox.engines.reference.impulses import solve_once, start_with
from sandbox.engines.reference.joints.impulses import one_pass, warm_start
from sandbox.engines.reference.joints.rows import Rows
from sandbox.engines.reference.manifolds import Manifolds
from sandbox.trajectory import FloatArray


@bare_kernel
def solve_together(
    now: Manifolds,
    bounce: FloatArray,
    rows: Rows,
    velocity: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    impulse: FloatArray,
    iterations: int,
) -> None:
    """Give contacts and joints the impulses that they ask for, contacts first in each pass, as Munk2D does.

    Args:
        now: K contacts.
        bounce: (K,) m/s, as `solve_velocities` takes it.
        rows: of the joints, prepared.
        velocity: (N, 3) m/s and rad/s, changed.
        inverse_mass: (N,) 1/kg.
        inverse_moment: (N,) 1/(kg·m²).
        impulse: (K, 2) N·s of the contacts; those to start with, and then the sums.
        iterations: passes over all.
    """
    spin = velocity[:, 2]
    start_with(now, velocity, spin, inverse_mass, inverse_moment, impulse)
    warm_start(rows, velocity, inverse_mass, inverse_moment)
    for _ in range(iterations):
        solve_once(now, bounce, velocity, spin, inverse_mass, inverse_moment, impulse)
        one_pass(rows, velocity, inverse_mass, inverse_moment)
