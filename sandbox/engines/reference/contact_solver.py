"""ContactSolver: velocities after what touches, with the joints and drives that take turns with it."""

import numpy as np

from sandbox.engines.reference.driven.drives import Drives
from sandbox.engines.reference.impulses import approach, solve_once, solve_velocities
from sandbox.engines.reference.joints.solver import JointSolver
from sandbox.engines.reference.manifolds import Manifolds
from sandbox.engines.reference.parting import Bounce, Parting
from sandbox.engines.reference.together import NO_STOPS, solve_together
from sandbox.engines.roster import Roster
from sandbox.trajectory import FloatArray

MOST_PASSES = 1000
"""Passes over the contacts of one impact."""

SETTLED = 1e-15
"""Part of the largest impulse by which a pass changes others by rounding alone."""


class ContactSolver:
    """Solves contacts of the bodies that are there, in so many iterations.

    Args:
        roster: the bodies.
        iterations: passes over all contacts.
        joints: what holds the scene's links, if it has any.
        drives: what drives bodies, if any are driven.
        work: counts the iterations.
    """

    def __init__(
        self,
        roster: Roster,
        iterations: int,
        joints: JointSolver | None,
        drives: Drives | None,
        work: dict[str, int],
    ) -> None:
        self._inverse, self._iterations = (roster.inverse_mass, roster.inverse_moment), iterations
        self._joints, self._drives, self._work = joints, drives, work
        self._no_spin: FloatArray = np.zeros((len(roster.position), 3))
        self.parting = Parting(roster) if Parting.needed(roster) else None
        """how fast what kicks, or bounces less the faster it is hit, lets go; none where all goes by the coefficient"""

    def approach(self, contacts: Manifolds, velocity: FloatArray) -> FloatArray:
        """Return how fast each contact opens under velocities (N, D), (K,) m/s."""
        out = np.empty(contacts.size)
        approach(contacts, velocity, self._spin(velocity), out)
        return out

    def bounce(self, contacts: Manifolds, velocity: FloatArray) -> Bounce:
        """Return how fast contacts are to part that approach with velocities (N, D)."""
        found = self.approach(contacts, velocity)
        if self.parting is None:
            return Bounce(found * contacts.coefficient[:, 0], None)
        return self.parting.bounce(contacts, found)

    def solve(
        self, contacts: Manifolds, bounce: FloatArray, velocity: FloatArray, impulse: FloatArray, joined: bool = False
    ) -> None:
        """Change velocities (N, D) and impulses (K, 2), N·s, until what touches parts as it should.

        Args:
            contacts: what touches.
            bounce: (K,) m/s, how fast each is to part.
            velocity: (N, D).
            impulse: (K, 2) N·s to begin with.
            joined: whether joints take turns with contacts.
        """
        times, rows = self._iterations, None
        self._work["contact_iterations"] += contacts.size * times
        if self._joints is not None and joined:
            self._work["joint_iterations"] += self._joints.visits
            rows = self._joints.rows
        if self._drives is not None:
            self._drives.solve(contacts, bounce, rows, velocity, impulse, times)
        elif rows is not None:
            solve_together(contacts, bounce, rows, NO_STOPS, velocity, *self._inverse, impulse, times)
        else:
            solve_velocities(contacts, bounce, velocity, self._spin(velocity), *self._inverse, impulse, times)

    def settle(self, contacts: Manifolds, bounce: FloatArray, velocity: FloatArray, impulse: FloatArray) -> None:
        """Change velocities and impulses as `solve` does, of an impact: until they no longer change.

        A single contact is solved at once. The two corners of a box that falls flat agree the later the taller it is.
        """
        if contacts.size == 1:
            self.solve(contacts, bounce, velocity, impulse)
            return
        spin = self._spin(velocity)
        for _ in range(MOST_PASSES):
            before = impulse.copy()
            solve_once(contacts, bounce, velocity, spin, *self._inverse, impulse)
            self._work["contact_iterations"] += contacts.size
            if np.abs(impulse - before).max(initial=0.0) <= SETTLED * np.abs(impulse).max(initial=0.0):
                break

    def _spin(self, velocity: FloatArray) -> FloatArray:
        """Return the spins (N,) among rates (N, D): zeros where nothing turns."""
        return (velocity if velocity.shape[1] == 3 else self._no_spin)[:, 2]
