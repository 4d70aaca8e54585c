"""ContactSolver: velocities after what touches, with the joints and drives that take turns with it."""

import numpy as np

from sandbox.engines.reference.dissipation import ROUNDING, Bilinear, largest_shares
from sandbox.engines.reference.driven.drives import Drives
from sandbox.engines.reference.impulses import approach, solve_once, solve_velocities, start_with
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
        dissipative: whether restitution is cut where it would create energy; for contacts alone.
    """

    def __init__(
        self,
        roster: Roster,
        iterations: int,
        joints: JointSolver | None,
        drives: Drives | None,
        work: dict[str, int],
        dissipative: bool,
    ) -> None:
        self._inverse, self._iterations = (roster.inverse_mass, roster.inverse_moment), iterations
        self._joints, self._drives, self._work = joints, drives, work
        self._dissipative = dissipative
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
        """Change velocities and impulses as `solve` does, until a pass changes nothing.

        A single contact takes one pass. The two corners of a box that falls flat take more, the taller it is. Contacts
        alone: engines refuse drives and joints with the detections that solve impacts one by one.
        """
        assert self._drives is None
        if contacts.size == 1:
            self.solve(contacts, bounce, velocity, impulse)
            return
        spin = self._spin(velocity)
        start_with(contacts, velocity, spin, *self._inverse, impulse)
        for _ in range(MOST_PASSES):
            before = impulse.copy()
            solve_once(contacts, bounce, velocity, spin, *self._inverse, impulse)
            self._work["contact_iterations"] += contacts.size
            if np.abs(impulse - before).max(initial=0.0) <= SETTLED * np.abs(impulse).max(initial=0.0):
                break

    def resolve(
        self,
        contacts: Manifolds,
        bounce: Bounce,
        start: FloatArray,
        velocity: FloatArray,
        impulse: FloatArray,
        joined: bool = False,
        settled: bool = False,
    ) -> None:
        """Change velocities and impulses as `solve` or, if settled, `settle` does, by the chosen law of impact.

        Args:
            contacts: what touches.
            bounce: how fast each is to part.
            start: (N, D) velocities at the beginning of the substep, to which energy is compared.
            velocity: (N, D), changed.
            impulse: (K, 2) N·s to begin with, changed.
            joined: whether joints take turns with contacts.
            settled: whether to iterate until nothing changes.
        """
        limited = self._dissipative and contacts.size > 0
        kicked, warm = (velocity.copy(), impulse.copy()) if limited else (velocity, impulse)
        if settled:
            self.settle(contacts, bounce.speed, velocity, impulse)
        else:
            self.solve(contacts, bounce.speed, velocity, impulse, joined)
        if limited:
            self._limit(contacts, bounce, start, kicked, warm, velocity, impulse)

    def _limit(
        self,
        contacts: Manifolds,
        bounce: Bounce,
        start: FloatArray,
        kicked: FloatArray,
        warm: FloatArray,
        velocity: FloatArray,
        impulse: FloatArray,
    ) -> None:
        """Cut the restitution of groups of bodies whose contacts would give energy.

        Args:
            contacts: what touches.
            bounce: how fast each is to part.
            start: (N, D) velocities at the beginning of the substep.
            kicked: (N, D) velocities before the solution by Newton's law; overwritten.
            warm: (K, 2) N·s, the impulses that this started with; overwritten.
            velocity: (N, D) after it, changed.
            impulse: (K, 2) N·s after it, changed.
        """
        spin, works = self._spin, Bilinear(contacts, *self._inverse)
        kicks = np.zeros(contacts.size) if bounce.worth is None else bounce.worth

        def work(push: FloatArray, rates: FloatArray) -> FloatArray:
            return works.work(push, rates, spin(rates))[0]

        def kicked_by(push: FloatArray) -> FloatArray:
            return np.asarray(np.bincount(works.of_contact, push[:, 0] * kicks, len(works.group)), np.float64)

        given, turnover = works.work(impulse, mean := 0.5 * (start + velocity), spin(mean))
        gains = given - kicked_by(impulse) > ROUNDING * turnover
        if not gains.any():
            return
        free = kicked.copy()
        self.settle(contacts, np.zeros(contacts.size), kicked, warm)
        # The passes may end unconverged, and gravity kicks within the substep: both can give energy at s = 0 too.
        least = largest_shares(0.0 * given, work(warm, 0.5 * (start + free)), work(warm, 0.5 * (kicked - free)))
        least = np.where(gains, least, 1.0)
        warm *= least[works.of_contact][:, None]
        kicked[:] = free + least[works.group][:, None] * (kicked - free)
        push, change = impulse - warm, velocity - kicked
        share = largest_shares(
            work(warm, 0.5 * (start + kicked)) - kicked_by(warm),
            work(push, 0.5 * (start + kicked)) + work(warm, 0.5 * change) - kicked_by(push),
            work(push, 0.5 * change),
        )
        share = np.where(gains, share, 1.0)
        of_contact, of_body = share[works.of_contact][:, None], share[works.group][:, None]
        cut = of_contact[:, 0] < 1.0
        impulse[cut] = (warm + of_contact * push)[cut]
        cut = of_body[:, 0] < 1.0
        velocity[cut] = (kicked + of_body * change)[cut]

    def _spin(self, velocity: FloatArray) -> FloatArray:
        """Return the spins (N,) among rates (N, D): zeros where nothing turns."""
        return (velocity if velocity.shape[1] == 3 else self._no_spin)[:, 2]
