"""Energy ledger of a reference run: the energy change in each stage of a step, by cause.

A contact or a joint acts during the whole step. The kick by the step's forces, which precedes its impulse, is not
attributed to it. So the work of its impulse J is computed at the mean of the velocities u at both ends of the step,

    work = J·(u_start + u_end)/2,

which is ½μ(1 − e²)u² for an impact, μ m g s for sliding, and 0 for a resting contact. The rest of its change of the
kinetic energy, J·(kick)/2, reverses a change by the integrator; it is attributed to the integrator, as are positions
that follow velocities. Joints solved by positions are treated in the same way, by their change of velocity; position
changes beyond that count as position correction. An impact within a step is entered with the velocities just before and
after it. Attraction, drag, liquids, damping and drives are entered with their work along the actual path of each body.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.energy_ledger import Cause, EnergyLedger
from sandbox.engines.forces.air import air_accelerations
from sandbox.engines.reference.drives import Drives, DriveWork
from sandbox.engines.reference.integrators import State
from sandbox.engines.reference.manifold import Manifolds
from sandbox.engines.reference.sequential_impulses import contact_work
from sandbox.engines.reference.step import StepRecord, WorldState
from sandbox.engines.reference.velocity_solver import Motion
from sandbox.scene.compile.potential import Potential

GAUSS_NODES = tuple((0.5 + 0.5 * node * math.sqrt(0.6), weight / 18.0) for node, weight in ((-1, 5), (0, 8), (1, 5)))
"""Gauss–Legendre nodes, as fractions of a step, and their weights: exact for polynomials up to degree 5"""


class StepEnergyLedger:
    """Energy ledger of a running world, updated from the record of each step.

    Args:
        store: the bodies.
        world: their state, forces, joints and drives.
    """

    def __init__(self, store: BodyStore, world: WorldState) -> None:
        self.account = EnergyLedger()
        self._store, self._world, self._field = store, world, world.field
        self._fraction = world.position_fraction
        world.records_work = True
        self.rebuild()

    def rebuild(self) -> None:
        """Update after a change of the bodies, forces, joints or drives of the world.

        The penalty contacts of the ledger use a collision pipeline of their own, so that they are not counted as work.
        """
        store, world = self._store, self._world
        self._forces, self._joints, self._drives = world.forces, world.joints, world.drives
        self._penalty = world.ledger_penalty()
        moving = store.mobile  # includes bodies held by zones, which have potential energy
        self._all_inertia: FloatArray = np.where(moving, (store.bodies.mass,) * 2 + (store.bodies.moment,), 0.0).T
        self._inertia = self._all_inertia
        if self._drives is not None:  # the motion of driven bodies is entered separately
            self._inertia = self._all_inertia.copy()
            self._inertia[store.driven] = 0.0
        self._weight: FloatArray = self._inertia[:, :1] * store.world_gravity
        self._zone_weight: FloatArray = self._inertia[:, :1] * (store.gravity - store.world_gravity)
        breaks = np.full(len(store.setup.joints), np.inf)
        breaks[list(store.broken)] = -np.inf
        self._potential = Potential(store.setup, store.bodies, breaks=breaks)
        self._no_spin: FloatArray = np.zeros(len(moving))
        u = self._forces
        has_constant_forces = store.force.any() or store.torque.any() or self._zone_weight.any()
        has_varying_forces = (
            u.damped or self._field.thrusting or self._field.liquids is not None or self._penalty is not None
        )
        self._has_work = bool(has_constant_forces or has_varying_forces)
        self._compliant = self._joints is not None and self._joints.method == "xpbd"

    @contextmanager
    def attributing(self, cause: Cause) -> Iterator[None]:
        """Attribute the change of energy by changes of the body store within the context to one cause."""
        before = self._total()
        yield
        self.account.add(cause, self._total() - before)

    def enter_step(self, record: StepRecord) -> None:
        """Enter a step: its contacts and joints, the impact at its end, drives, forces and the integrator."""
        if record.unlimited is not None:
            self._enter_limits(record.motion.start[1], record.unlimited, record.after)
            record = record._replace(after=record.unlimited)
        start, impact = record.motion.start[1], record.impact
        mean = 0.5 * (start + record.end)
        if self._penalty is None:
            self._enter_contacts(record.contacts, record.impulse, mean, record.kick_energy)
        if record.rolling is not None:
            self._enter_rolling(record.contacts, record.rolling, mean[:, 2])
        assert record.work is not None  # this ledger has switched it on
        if self._joints is not None and self._joints.method == "impulses":
            self.account.add(Cause.JOINTS, record.work.joints)
        self.account.add(Cause.DRIVES, record.work.motors)
        if impact is not None:
            at_impact = 0.5 * (record.end + record.after[1])
            self._enter_contacts(impact.contacts, impact.impulse, at_impact, impact.kick_energy)
        if self._drives is not None and record.work.drives is not None:
            self._enter_drives(self._drives, record.work.drives, record, mean)
        self._enter_motion(record, record.work.motors)

    def _enter_rolling(self, contacts: Manifolds, impulse: FloatArray, spin: FloatArray) -> None:
        """Enter the work of angular impulses (K,), N·m·s, at mean spins (N,); drives supply that on their bodies."""
        is_body = contacts.second >= 0
        second = np.where(is_body, contacts.second, 0)

        def work(spins: FloatArray) -> float:
            return float(impulse @ (np.where(is_body, spins[second], 0.0) - spins[contacts.first]))

        self.account.add(Cause.ROLLING, work(spin))
        self.account.add(Cause.DRIVES, -work(np.where(self._store.driven, spin, 0.0)))

    def _enter_limits(self, start: FloatArray, before: State, after: State) -> None:
        """Enter the reduction of speeds to their limits, in a step that began with rates `start`, (N, D).

        It reverses a part of the step's kicks, and positions follow it: that is the integrator's, as for contacts.
        """
        work = self._product(after[1] - before[1], 0.5 * (start + after[1]))
        change = self._kinetic(before[1], after[1]) + self._potential_change(before[0], after[0])
        change += self._spring_energy_change(before[0], after[0])
        self.account.add(Cause.SPEED_LIMITS, work)
        self.account.add(Cause.INTEGRATOR, change - work)

    def _enter_drives(self, drives: Drives, work: DriveWork, record: StepRecord, mean: FloatArray) -> None:
        """Enter the work of drives: the energy gain of driven bodies less the work of contacts and weight."""
        impulse_work = drives.impulse_work(record.contacts, record.impulse, mean)
        if self._penalty is not None:  # the work of its forces is entered for freely moving bodies only
            self.account.add(Cause.INTEGRATOR, impulse_work)
        self.account.add(Cause.DRIVES, work.gained - impulse_work - work.weight)
        self.account.add(Cause.INTEGRATOR, work.weight + work.potential_change)

    def _enter_contacts(
        self, contacts: Manifolds, impulse: FloatArray, mean: FloatArray, kick_energy: FloatArray | None
    ) -> None:
        if contacts.size:
            spin = mean[:, 2] if mean.shape[1] == 3 else self._no_spin
            along, across = contact_work(contacts, impulse, mean, spin)
            kicks = 0.0 if kick_energy is None else float(impulse[:, 0] @ kick_energy)
            surfaces = float(impulse[:, 1] @ contacts.slip_target)  # work of moving surfaces
            self.account.add_contacts(along - kicks, across - surfaces)
            self.account.add(Cause.KICKS, kicks)
            self.account.add(Cause.DRIVES, surfaces)

    def _enter_motion(self, record: StepRecord, motors: float) -> None:
        """Enter forces, joints solved by positions, position correction, and the integrator.

        Args:
            record: of the step.
            motors: J, work of motors, which has been entered.
        """
        h, after, end, motion = record.h, record.after, record.end, record.motion
        start, free, placed = motion.start, motion.free, motion.placed
        shift = 0.0 if motion.shift is None else motion.shift
        work = self._work(record.time, start, np.stack((after[0] - shift, end)), h)
        for cause in (Cause.DRAG, Cause.LIQUID, Cause.DAMPING, Cause.DRIVES):
            self.account.add(cause, work[cause])
        tyres = self._enter_tyres(motion, 0.5 * h * (start[1] + end))
        forces = tyres + (
            work[Cause.DRAG] + work[Cause.LIQUID] + work[Cause.DRIVES] + self._spring_contacts(work, start[0], after[0])
        )

        joint_change = placed[1] - free[1]  # by joints that are solved by positions
        displaced = bool(joint_change.any())
        corrected = free[0] if motion.shift is None else free[0] + shift
        followed = corrected + (self._fraction * h) * (end - free[1]) if displaced else after[0]
        drift = (
            self._kinetic(start[1], free[1])
            + self._potential_change(start[0], free[0])
            + self._potential_change(corrected, followed)
        )
        # The part of the kick that contacts and joints have reversed
        drift += 0.5 * self._product(joint_change, free[1] - start[1] + placed[1] - end)
        drift += 0.5 * self._product(end - placed[1], placed[1] - start[1])
        correction = (
            self._potential_change(free[0], corrected)
            + self._spring_energy_change(free[0], corrected)
            + self._potential_change(followed, after[0])
        )
        strain, strain_after = (
            self._spring_energy_change(start[0], free[0]) + self._spring_energy_change(corrected, followed),
            0.0,
        )
        if displaced:
            strain_after = self._spring_energy_change(followed, after[0])
        joints = 0.5 * self._product(joint_change, start[1] + end) - (motors if displaced else 0.0)
        if self._compliant:  # springs are solved as joints are: their stored energy counts, except for damping
            joints += strain + strain_after - work[Cause.DAMPING]
        else:
            drift, correction, forces = drift + strain, correction + strain_after, forces + work[Cause.DAMPING]
        self.account.add(Cause.JOINTS, joints)
        self.account.add(Cause.CORRECTION, correction)
        self.account.add(Cause.INTEGRATOR, drift - forces)

    def _enter_tyres(self, motion: Motion, path: FloatArray) -> float:
        """Enter the work of tyres along a path (N, 3), m and rad; return the sum, J."""
        if motion.tyres is None or self._field.tyres is None:
            return 0.0
        moved = path[self._field.tyres.bodies]
        drive, friction = float((motion.tyres.drive * moved).sum()), float((motion.tyres.friction * moved).sum())
        self.account.add(Cause.DRIVES, drive)
        self.account.add(Cause.FRICTION, friction)
        return drive + friction

    def _spring_contacts(self, work: dict[Cause, float], start: FloatArray, end: FloatArray) -> float:
        """Enter penalty contacts; return their work, J. Stored energy counts as restitution until it is released."""
        if self._penalty is None:
            return 0.0
        given_back = self._penalty.stored_energy(start) - self._penalty.stored_energy(end)
        self.account.add_unchecked(Cause.RESTITUTION, given_back)
        self.account.add_contacts(work[Cause.RESTITUTION], work[Cause.FRICTION])
        return given_back + work[Cause.RESTITUTION] + work[Cause.FRICTION]

    def _work(self, time: float, start: State, end: State, h: float) -> dict[Cause, float]:
        """Return the work, J, of drag, liquids, damping and drives along the path of a step, a parabola."""
        work = dict.fromkeys(Cause, 0.0)
        if h <= 0.0 or not self._has_work:
            return work
        deviation = end[0] - start[0] - (0.5 * h) * (start[1] + end[1])  # deviation of the scheme from a parabola
        for fraction, weight in GAUSS_NODES:
            rate = start[1] + fraction * (end[1] - start[1]) + deviation / h
            pose = (
                start[0] + (fraction * h) * (start[1] + (0.5 * fraction) * (end[1] - start[1])) + fraction * deviation
            )
            for cause, power in self._powers(time + fraction * h, np.stack((pose, rate))):
                work[cause] += weight * h * power
        return work

    def _powers(self, time: float, x: State) -> Iterator[tuple[Cause, float]]:
        """Yield the power, W, of each cause in a state."""
        u, store, rate = self._forces, self._store, x[1]
        if u.air.acts:
            yield Cause.DRAG, self._product(air_accelerations(u.air, rate), rate)
        if u.damped_forces and self._joints is not None:
            yield Cause.DAMPING, self._joints.damper_power(x)
        if store.force.any() or store.torque.any():
            yield Cause.DRIVES, float((store.force * rate[:, :2]).sum())
            yield Cause.DRIVES, float(store.torque @ rate[:, 2]) if rate.shape[1] == 3 else 0.0
        if self._zone_weight.any():  # gravity of zones in excess of the world's
            yield Cause.DRIVES, float((self._zone_weight * rate[:, :2]).sum())
        if self._field.liquids is not None:
            yield Cause.LIQUID, self._product(self._field.by_liquids(time, x), rate)
        if self._field.thrusting:
            yield Cause.DRIVES, self._product(self._field.by_thrusts(time, x), rate)
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

    def _potential_change(self, before: FloatArray, after: FloatArray) -> float:
        """Return the change of the potential energy of gravity and attraction, J, between two sets of poses."""
        if before is after:
            return 0.0
        change = -float((self._weight * (after[:, :2] - before[:, :2])).sum())
        if self._potential.attracts:
            change += self._attraction_energy(after) - self._attraction_energy(before)
        return change

    def _spring_energy_change(self, before: FloatArray, after: FloatArray) -> float:
        """Return the change of the energy stored in springs, J, between two sets of poses."""
        if before is after or not self._potential.springs:
            return 0.0
        return self._spring_energy(after) - self._spring_energy(before)

    def _attraction_energy(self, pose: FloatArray) -> float:
        return float(self._potential.of_attraction(pose[None, :, :2], self._store.present[None])[0])

    def _spring_energy(self, pose: FloatArray) -> float:
        angle = pose[:, 2] if pose.shape[1] == 3 else self._store.angle
        here = pose[None, :, :2], angle[None], self._store.present[None]
        return float(self._potential.of_springs(np.zeros(1), *here)[0])

    def _total(self) -> float:
        """Return the energy of all bodies, J."""
        store = self._store
        pose = np.column_stack((store.position, store.angle))
        rate = np.column_stack((store.velocity, store.angular_velocity))
        weight = self._all_inertia[:, :1] * store.world_gravity
        total = 0.5 * float((self._all_inertia * rate * rate).sum()) - float((weight * store.position).sum())
        if self._potential.attracts:
            total += self._attraction_energy(pose)
        return total + self._spring_energy(pose) if self._potential.springs else total
