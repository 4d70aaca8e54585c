"""Bookkeeper: books what each verb of a stage does to the energy, by cause.

A contact, or a joint, acts through the whole of a step, and is not to be blamed for the kick that the step's forces
give before it can answer. So its impulse J is booked with the mean of the velocities u at the step's two ends,

    work = J·(u_start + u_end)/2,

which is ½μ(1 − e²)u² for an impact, μ m g s for a slide, and nothing at all for what rests. The rest of what it did to
the kinetic energy, J·(kick)/2, it took back from the integrator, and so did positions that follow velocities: both are
the integrator's. Joints that are held by positions are booked likewise, by the velocities that they give; where they
shift positions beyond what follows from those, that is position correction. An impact at a moment of its own is booked
with the velocities just before and after it. What acts from afar, in the air or by design is booked with its work along
the way that each body really went.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from sandbox.engines.account import Account, Cause
from sandbox.engines.reference.driven.drives import Drives
from sandbox.engines.reference.impulses import contact_work
from sandbox.engines.reference.joints.field import Field
from sandbox.engines.reference.joints.solver import JointSolver
from sandbox.engines.reference.manifolds import Manifolds
from sandbox.engines.reference.motion import Inputs, State
from sandbox.engines.reference.penalty import Penalty
from sandbox.engines.roster import Roster
from sandbox.scene.potential import Potential
from sandbox.trajectory import FloatArray

GAUSS = tuple((0.5 + 0.5 * node * math.sqrt(0.6), weight / 18.0) for node, weight in ((-1, 5), (0, 8), (1, 5)))
"""Places in a step, as shares of it, and their weights: exact for polynomials up to degree 5."""


class Idle:
    """Who keeps no books, and takes no notice."""

    def population_changed(
        self, u: Inputs, joints: JointSolver | None, penalty: Penalty | None, drives: Drives | None
    ) -> None:
        """Take note of who is there, and what acts on them."""

    def flown(self, start: State, free: State, shift: FloatArray | None) -> None:
        """Take note of free motion; it is booked if a stage goes on from there.

        Args:
            start: (2, N, D) from where.
            free: (2, N, D) to where, before positions are put right.
            shift: (N, D) m and rad, by which overlap is undone; none where there is none.
        """

    def met(self, moved: State) -> None:
        """Take note of the state in which contacts and joints are resolved: joints held by positions are done."""

    def held(self, moved: State, contacts: Manifolds, impulse: FloatArray, worth: FloatArray | None) -> None:
        """Book what impulses (K, 2), N·s, of contacts through the step, and of joints, did to velocities.

        Of contacts that were kicked `worth` (K,) is what that brought for each N·s along the normal, J; else none.
        """

    def struck(self, moved: State, contacts: Manifolds, impulse: FloatArray, worth: FloatArray | None) -> None:
        """Book what impulses (K, 2), N·s, of impacts at the end of a step did to velocities; `worth` as above."""

    def led(self, before: State, after: State, h: float, contacts: Manifolds, impulse: FloatArray) -> None:
        """Book what drives did in a step of h, s, between two states, and with what impulses (K, 2) of contacts."""

    def done(self, time: float, after: State, h: float) -> None:
        """Book the rest of a step of h, s, that began at a time, s, and led to a state."""

    @contextmanager
    def doing(self, cause: Cause) -> Iterator[None]:
        """Book all that is done to the roster meanwhile to one cause."""
        del cause
        yield


class Bookkeeper(Idle):
    """Keeps an account of a running stage."""

    def __init__(self, roster: Roster, field: Field, share: float) -> None:
        """Open an account.

        Args:
            roster: the bodies.
            field: what acts on them from afar and from within.
            share: of the stage's integrator, `Integrator.share`.
        """
        self.account = Account()
        self._roster, self._field, self._share = roster, field, share

    def population_changed(
        self, u: Inputs, joints: JointSolver | None, penalty: Penalty | None, drives: Drives | None
    ) -> None:
        """Take note of who is there, and what acts on them; `penalty` is one of the books' own."""
        roster = self._roster
        self._u, self._joints, self._penalty, self._drives = u, joints, penalty, drives
        moving = roster.mobile  # who is held has no motion, but height
        self._everyone: FloatArray = np.where(moving, (roster.bodies.mass,) * 2 + (roster.bodies.moment,), 0.0).T
        self._inertia = self._everyone
        if drives is not None:  # the motion of the driven is booked for itself
            self._inertia = self._everyone.copy()
            self._inertia[list(roster.held)] = 0.0
        self._weight: FloatArray = self._inertia[:, :1] * roster.scene.world.gravity
        self._lifted: FloatArray = self._inertia[:, :1] * (roster.gravity - np.asarray(roster.scene.world.gravity))
        breaks = np.full(len(roster.scene.links), np.inf)
        breaks[list(roster.broken)] = -np.inf
        self._potential = Potential(roster.scene, roster.bodies, breaks=breaks)
        self._no_spin: FloatArray = np.zeros(len(moving))
        steady = bool(roster.force.any() or roster.torque.any() or self._lifted.any())
        self._worked = u.dragged or u.rubbing or steady or self._field.thrusting or penalty is not None
        self._compliant = joints is not None and joints.how == "xpbd"

    @contextmanager
    def doing(self, cause: Cause) -> Iterator[None]:
        """Book all that is done to the roster meanwhile to one cause."""
        before = self._total()
        yield
        self.account.enter(cause, self._total() - before)

    def flown(self, start: State, free: State, shift: FloatArray | None) -> None:
        """Take note of free motion."""
        self._start, self._free, self._shift = start, free.copy(), shift

    def met(self, moved: State) -> None:
        """Take note of the state in which contacts and joints are resolved."""
        self._met = moved.copy()
        self._end = self._met[1]  # the velocities at the end of what acts through the step

    def held(self, moved: State, contacts: Manifolds, impulse: FloatArray, worth: FloatArray | None) -> None:
        """Book contacts through the step, and joints held by impulses."""
        self._end = moved[1].copy()
        mean = 0.5 * (self._start[1] + self._end)
        self._touch(contacts, impulse, mean, worth)
        self._taken = 0.0 if self._drives is None else self._drives.taken(contacts, impulse, mean)
        if self._joints is not None and self._joints.how == "impulses":
            self.account.enter(Cause.JOINTS, self._joints.work(mean))

    def led(self, before: State, after: State, h: float, contacts: Manifolds, impulse: FloatArray) -> None:
        """Book drives: what the driven gained, less what contacts and weight gave them."""
        assert self._drives is not None
        work = self._drives.work(before, after, h)
        if self._penalty is not None:  # whose forces are booked whole, and against what moves freely alone
            self._taken = self._drives.taken(contacts, impulse, 0.5 * (self._start[1] + self._end))
            self.account.enter(Cause.INTEGRATOR, self._taken)
        self.account.enter(Cause.DRIVES, work.gained - self._taken - work.weight)
        self.account.enter(Cause.INTEGRATOR, work.weight + work.lifted)

    def struck(self, moved: State, contacts: Manifolds, impulse: FloatArray, worth: FloatArray | None) -> None:
        """Book impacts."""
        self._touch(contacts, impulse, 0.5 * (self._end + moved[1]), worth)

    def _touch(self, contacts: Manifolds, impulse: FloatArray, mean: FloatArray, worth: FloatArray | None) -> None:
        if contacts.size:
            spin = mean[:, 2] if mean.shape[1] == 3 else self._no_spin
            along, across = contact_work(contacts, impulse, mean, spin)
            kicks = 0.0 if worth is None else float(impulse[:, 0] @ worth)
            self.account.touch(along - kicks, across)
            self.account.enter(Cause.KICKS, kicks)

    def done(self, time: float, after: State, h: float) -> None:
        """Book the rest of a step: forces, joints held by positions, positions put right, the integrator."""
        start, free, met, end = self._start, self._free, self._met, self._end
        shift = 0.0 if self._shift is None else self._shift
        work = self._work(time, start, np.stack((after[0] - shift, end)), h)
        for cause in (Cause.DRAG, Cause.DAMPING, Cause.DRIVES):
            self.account.enter(cause, work[cause])
        forces = work[Cause.DRAG] + work[Cause.DRIVES] + self._spring_contacts(work, start[0], after[0])

        put = met[1] - free[1]  # by joints that are held by positions
        placed = bool(put.any())
        pushed = free[0] if self._shift is None else free[0] + shift
        followed = pushed + (self._share * h) * (end - free[1]) if placed else after[0]
        drift = self._kinetic(start[1], free[1]) + self._lift(start[0], free[0]) + self._lift(pushed, followed)
        # What contacts and joints took back of the kick that they were not given time to withstand.
        drift += 0.5 * self._product(put, free[1] - start[1] + met[1] - end)
        drift += 0.5 * self._product(end - met[1], met[1] - start[1])
        correction = self._lift(free[0], pushed) + self._strain(free[0], pushed) + self._lift(followed, after[0])
        strain, strain_after = self._strain(start[0], free[0]) + self._strain(pushed, followed), 0.0
        if placed:
            strain_after = self._strain(followed, after[0])
        joints = 0.5 * self._product(put, start[1] + end)
        if self._compliant:  # springs are held as joints are: what they store is theirs, but for what dampers take
            joints += strain + strain_after - work[Cause.DAMPING]
        else:
            drift, correction, forces = drift + strain, correction + strain_after, forces + work[Cause.DAMPING]
        self.account.enter(Cause.JOINTS, joints)
        self.account.enter(Cause.CORRECTION, correction)
        self.account.enter(Cause.INTEGRATOR, drift - forces)

    def _spring_contacts(self, work: dict[Cause, float], start: FloatArray, end: FloatArray) -> float:
        """Book contacts that are springs; return their work, J. What they store is restitution's until given back."""
        if self._penalty is None:
            return 0.0
        given_back = self._penalty.stored(start) - self._penalty.stored(end)
        self.account.add(Cause.RESTITUTION, given_back)
        self.account.touch(work[Cause.RESTITUTION], work[Cause.FRICTION])
        return given_back + work[Cause.RESTITUTION] + work[Cause.FRICTION]

    def _work(self, time: float, start: State, end: State, h: float) -> dict[Cause, float]:
        """Return the work, J, of what takes or gives along the way of a step, a parabola between its ends."""
        work = dict.fromkeys(Cause, 0.0)
        if h <= 0.0 or not self._worked:
            return work
        off = end[0] - start[0] - (0.5 * h) * (start[1] + end[1])  # where the scheme leaves the parabola of its kick
        for share, weight in GAUSS:
            rate = start[1] + share * (end[1] - start[1]) + off / h
            pose = start[0] + (share * h) * (start[1] + (0.5 * share) * (end[1] - start[1])) + share * off
            for cause, power in self._powers(time + share * h, np.stack((pose, rate))):
                work[cause] += weight * h * power
        return work

    def _powers(self, time: float, x: State) -> Iterator[tuple[Cause, float]]:
        """Yield the power, W, of each cause in a state."""
        u, roster, rate = self._u, self._roster, x[1]
        if u.dragged:
            wind = rate[:, :2] - u.wind
            share = u.linear_drag + u.quadratic_drag * np.hypot(wind[:, :1], wind[:, 1:])
            yield Cause.DRAG, -float((self._inertia[:, :1] * share * wind * rate[:, :2]).sum())
        if u.rubbing and self._joints is not None:
            yield Cause.DAMPING, self._joints.damper_power(x)
        if roster.force.any() or roster.torque.any():
            yield Cause.DRIVES, float((roster.force * rate[:, :2]).sum())
            yield Cause.DRIVES, float(roster.torque @ rate[:, 2]) if rate.shape[1] == 3 else 0.0
        if self._lifted.any():  # what zones give beyond the world's gravity
            yield Cause.DRIVES, float((self._lifted * rate[:, :2]).sum())
        if self._field.thrusting:
            yield Cause.DRIVES, self._product(self._field.thrusts(time, x), rate)
        if self._penalty is not None:
            normal, tangential = self._penalty.losses(x)
            yield Cause.RESTITUTION, normal
            yield Cause.FRICTION, tangential

    def _product(self, change: FloatArray, rate: FloatArray) -> float:
        """Return m Δv·w + I Δω w, J, summed over all bodies."""
        return float((self._inertia[:, : rate.shape[1]] * change * rate).sum())

    def _kinetic(self, before: FloatArray, after: FloatArray) -> float:
        """Return the change of kinetic energy, J, between two sets of rates."""
        return 0.5 * self._product(after - before, after + before)

    def _lift(self, before: FloatArray, after: FloatArray) -> float:
        """Return the change, J, of what gravity and attraction store, between two sets of poses."""
        if before is after:
            return 0.0
        change = -float((self._weight * (after[:, :2] - before[:, :2])).sum())
        if self._potential.attracts:
            change += self._attracted(after) - self._attracted(before)
        return change

    def _strain(self, before: FloatArray, after: FloatArray) -> float:
        """Return the change, J, of what springs store, between two sets of poses."""
        if before is after or not self._potential.springs:
            return 0.0
        return self._strained(after) - self._strained(before)

    def _attracted(self, pose: FloatArray) -> float:
        return float(self._potential.of_attraction(pose[None, :, :2], self._roster.present[None])[0])

    def _strained(self, pose: FloatArray) -> float:
        angle = pose[:, 2] if pose.shape[1] == 3 else self._roster.angle
        here = pose[None, :, :2], angle[None], self._roster.present[None]
        return float(self._potential.of_springs(np.zeros(1), *here)[0])

    def _total(self) -> float:
        """Return the energy of the roster, J."""
        roster = self._roster
        pose = np.column_stack((roster.position, roster.angle))
        rate = np.column_stack((roster.velocity, roster.angular_velocity))
        weight = self._everyone[:, :1] * roster.scene.world.gravity
        total = 0.5 * float((self._everyone * rate * rate).sum()) - float((weight * roster.position).sum())
        if self._potential.attracts:
            total += self._attracted(pose)
        return total + self._strained(pose) if self._potential.springs else total
