"""Energy accounting of a pymunk run: the work of gravity, drag, damping, joints, drives and contacts.

A body on a hinge has one degree of freedom: all work on it is an angular impulse about the hinge times a mean spin. The
work of the drive on a kinematic body follows from its change of momentum, minus the impulses of contacts. A body that
is kinematic by itself counts as driven too: the drive keeps up its velocity and carries its weight.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.energy_ledger import Cause, EnergyLedger
from sandbox.engines.forces.air import ALL, mean_acceleration, mean_angular_acceleration
from sandbox.engines.pymunk_adapter.bodies import PymunkBodies
from sandbox.engines.pymunk_adapter.contacts import ContactPoints
from sandbox.engines.pymunk_adapter.drives import SpaceDrivenBody, SpaceHingeMotor, SpacePlunger
from sandbox.engines.pymunk_adapter.forces import damping_factor
from sandbox.engines.pymunk_adapter.joint_impulses import ImpulseSums, JointImpulses, motors, set_unknown_sums, springs
from sandbox.engines.pymunk_adapter.joints import spring_forces
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.joint_arrays import WORLD
from sandbox.scene.compile.potential import Potential
from sandbox.scene.compile.scene import Scene


class EnergyState(NamedTuple):
    """Positions and velocities of N bodies."""

    position: FloatArray
    """(N, 2) m"""
    angle: FloatArray
    """(N,) rad"""
    velocity: FloatArray
    """(N, 2) m/s"""
    spin: FloatArray
    """(N,) rad/s"""


class AppliedImpulses(NamedTuple):
    """Impulses on N bodies in a substep, without contacts and joints, N·s."""

    weight: FloatArray
    """(N, 2) by gravity and attraction"""
    driven: FloatArray
    """(N, 2) by constant forces, thrusts and engines of tyres"""
    angular: FloatArray
    """(N,) by constant torques, thrusts and engines of tyres, N·m·s"""
    drag: FloatArray
    """(N, 2) by air, including its change of other forces, and by damping"""
    angular_drag: FloatArray
    """(N,) by damping, N·m·s"""
    liquid: FloatArray
    """(N, 2) by liquids"""
    angular_liquid: FloatArray
    """(N,) by liquids, N·m·s"""
    tyre: FloatArray
    """(N, 2) by friction of tyres"""
    angular_tyre: FloatArray
    """(N,) by friction of tyres, N·m·s"""


def applied_impulses(
    store: PymunkBodies, before: EnergyState, included: BoolArray, springs: FloatArray | None, h: float
) -> AppliedImpulses:
    """Return the impulses applied in the last substep.

    Args:
        store: as it is after the substep.
        before: state at its start.
        included: (N,) bodies to include; others get 0.
        springs: (N, 2) N, forces of springs, which drag reduces; None: none.
        h: duration of the accounted part of the substep, s.
    """
    bodies, world = store.bodies, store.scene.world
    mass = np.where(included, bodies.mass, 0.0)[:, None]
    constant, torque = _constant_forces(store)
    gravity = store.world_gravity
    if store.scales_by_force:  # in the space it is a part of the constant forces
        excess = bodies.mass[:, None] * (gravity - np.asarray(world.gravity))
        excess[store.particles.indices] = 0.0
        constant -= excess
    attraction, (thrust, thrust_torque) = _attraction(store), _loads(store, store.space_bodies.thrusts.loads)
    liquids = store.space_bodies.liquids
    liquid, liquid_torque = _loads(store, {} if liquids is None else liquids.loads)
    drive, friction = _tyres(store)
    drag, angular_drag = np.zeros_like(before.velocity), np.zeros_like(before.spin)
    air = store.space_bodies.air
    if air.acts_by_force:
        force = constant + thrust + liquid + (0.0 if springs is None else springs)
        applied = force / bodies.mass[:, None] + attraction
        mean = mean_acceleration(air, ALL, gravity, before.velocity, before.spin, applied, store.h)
        drag = mass * (mean - gravity - applied) * h
    if air.damps_bodies:
        turning = (torque + thrust_torque + liquid_torque) / bodies.moment
        mean_turning = mean_angular_acceleration(air, ALL, before.spin, turning, store.h)
        is_damped = included & (air.angular_damping > 0.0)
        angular_drag = np.where(is_damped, bodies.moment * (mean_turning - turning) * h, 0.0)
    if world.has_damping:
        lost = (damping_factor(world.damping, store.h) - 1.0) * (h / store.h)
        drag = lost * mass * before.velocity
        angular_drag = lost * np.where(included, bodies.moment, 0.0) * before.spin
    driven = np.where(included[:, None], constant + thrust + drive[:, :2], 0.0)
    angular = np.where(included, torque + thrust_torque + drive[:, 2], 0.0)
    weight = mass * (gravity + attraction) * h
    by_liquid = np.where(included[:, None], liquid, 0.0) * h, np.where(included, liquid_torque, 0.0) * h
    by_tyre = np.where(included[:, None], friction[:, :2], 0.0) * h, np.where(included, friction[:, 2], 0.0) * h
    return AppliedImpulses(weight, driven * h, angular * h, drag, angular_drag, *by_liquid, *by_tyre)


def _tyres(store: PymunkBodies) -> tuple[FloatArray, FloatArray]:
    """Return the loads (N, 3) by engines and by friction of tyres on all bodies, N and N·m."""
    drive, friction, tyres = (
        np.zeros((len(store.bodies), 3)),
        np.zeros((len(store.bodies), 3)),
        store.space_bodies.tyres,
    )
    if tyres is not None and tyres.loads is not None:
        drive[tyres.indices], friction[tyres.indices] = tyres.loads
    return drive, friction


def _constant_forces(store: PymunkBodies) -> tuple[FloatArray, FloatArray]:
    """Return the constant forces (N, 2), N, and torques (N,), N·m."""
    force, torque = np.zeros_like(store.position), np.zeros(len(store.position))
    for forces in (store.particles.forces, store.space_bodies.constant_forces):
        for index, constant in forces.items():
            force[index], torque[index] = constant
    return force, torque


def _attraction(store: PymunkBodies) -> FloatArray:
    """Return the attraction on all bodies, (N, 2) m/s²."""
    field, particles = store.space_bodies.field, store.particles.indices
    attraction = np.zeros_like(store.position)
    if field.attracts:
        attraction[particles] = field.at(store.position[particles])
    if field.applied:
        number_of = store.bodies.number_of
        attraction[[number_of[name] for name in field.applied]] = np.asarray(list(field.applied.values()))
    return attraction


def _loads(store: PymunkBodies, loads: Mapping[int, tuple[float, float, float]]) -> tuple[FloatArray, FloatArray]:
    """Return loads of bodies, by their indices, as forces (N, 2), N, and torques (N,), N·m."""
    force, torque = np.zeros_like(store.position), np.zeros(len(store.position))
    for index, (x, y, turning) in loads.items():
        force[index], torque[index] = (x, y), turning
    return force, torque


class DriveWorkSums(NamedTuple):
    """Work on driven bodies in a substep, J."""

    driven: float
    """by their drives, including stops and the weight of kinematic bodies"""
    weight: float
    """by the weight of bodies driven by torque, as computed in the steps"""
    potential_change: float
    """gain of potential energy of bodies driven by torque"""
    rolling: float
    """by the rolling resistance of balls on bodies driven by torque, which the drive does not hold at a stop"""


def set_mean_driven_velocity(
    driven_bodies: list[SpaceDrivenBody], before: EnergyState, now: EnergyState, velocity: FloatArray, spin: FloatArray
) -> None:
    """Set mean velocities and spins of driven bodies, about their centres in pymunk."""
    for driven_body in driven_bodies:
        n = driven_body.index
        if isinstance(driven_body, SpacePlunger):
            velocity[n] = 0.5 * (before.velocity[n] + now.velocity[n])
        else:
            spin[n] = 0.5 * (before.spin[n] + now.spin[n])


def drive_work(
    driven_bodies: list[SpaceDrivenBody],
    states: tuple[EnergyState, EnergyState],
    means: tuple[FloatArray, FloatArray],
    points: ContactPoints,
    bodies: Bodies,
    gravity: tuple[float, float],
    h: float,
    rolled: IntArray,
) -> DriveWorkSums:
    """Return the work on driven bodies in a substep.

    Args:
        driven_bodies: the driven bodies.
        states: at the start of the substep, and at its end.
        means: mean velocities (N + 1, 2), m/s, and spins (N + 1,), rad/s.
        points: contacts of the substep.
        bodies: all.
        gravity: m/s².
        h: substep, s.
        rolled: bodies on which rolling resistance acted.
    """
    before, now = states
    velocity, spin = means
    contact_impulses = ImpulseSums(np.zeros_like(velocity), np.zeros_like(spin), np.empty(0, np.int64))
    contact_impulses.subtract(points.joint_impulses)  # the negative of the impulses by contacts
    driven = weight = potential_change = rolling = 0.0
    for driven_body in driven_bodies:
        n = driven_body.index
        mass = float(bodies.mass[n])
        displacement = now.position[n] - before.position[n]
        height_energy = -mass * float(displacement @ np.asarray(gravity))
        if isinstance(driven_body, SpaceHingeMotor):
            potential_change += height_energy
        else:
            driven += height_energy  # a kinematic body's drive carries its weight
        if isinstance(driven_body, SpacePlunger):
            impulse = mass * (now.velocity[n] - before.velocity[n]) + contact_impulses.linear[n]
            driven += float(impulse @ velocity[n])
            continue
        x, y = driven_body.mount.hinge
        moment = float(bodies.moment[n]) + mass * (x * x + y * y)
        if isinstance(driven_body, SpaceHingeMotor):
            weight += driven_body.weight_torque * h * float(spin[n])
        impulse = moment * float(now.spin[n] - before.spin[n]) + float(contact_impulses.angular[n])
        impulse -= driven_body.weight_torque * h if isinstance(driven_body, SpaceHingeMotor) else 0.0
        if isinstance(driven_body, SpaceHingeMotor) and not driven_body.was_locked:
            rolling += (impulse - driven_body.drive_impulse) * float(spin[n]) if n in rolled else 0.0
            impulse = driven_body.drive_impulse
        driven += impulse * float(spin[n])
    return DriveWorkSums(driven, weight, potential_change, rolling)


def kinematic_work(
    indices: IntArray,
    states: tuple[EnergyState, EnergyState],
    means: tuple[FloatArray, FloatArray],
    other_impulses: list[JointImpulses],
    joint_sums: ImpulseSums | None,
    bodies: Bodies,
    gravity: tuple[float, float],
) -> float:
    """Return the work on kinematic bodies that keeps up their velocities against all other impulses, J.

    Args:
        indices: (K,) of the kinematic bodies.
        states: at the start of a substep, and at its end.
        means: mean velocities (N + 1, 2), m/s, and spins (N + 1,), rad/s.
        other_impulses: those of contacts and springs.
        joint_sums: sums of those of other joints and of motors; None: there are none.
        bodies: all.
        gravity: m/s².
    """
    before, now = states
    velocity, spin = means
    sums = ImpulseSums(np.zeros_like(velocity), np.zeros_like(spin), indices)
    sums.linear[indices] = bodies.mass[indices, None] * (now.velocity - before.velocity)[indices]
    sums.angular[indices] = bodies.moment[indices] * (now.spin - before.spin)[indices]
    for each in other_impulses:
        sums.subtract(each)
    work = sums.work(velocity, spin)
    if joint_sums is not None:
        work -= joint_sums._replace(joined=np.intersect1d(indices, joint_sums.joined)).work(velocity, spin)
    rise = (before.position - now.position)[indices] @ np.asarray(gravity)
    return work + float(bodies.mass[indices] @ rise)


class PymunkEnergyLedger:
    """Energy by cause since accounting was switched on.

    All causes within a substep act at the same time: the work of an impulse is the impulse times the mean of the
    velocities at the start and end of the substep, at the point where it acts. The sum of these works is exactly the
    change of kinetic energy. So a body at rest has no entries, though in each substep gravity accelerates it and its
    contact stops it, and a contact removes ½ μ (1 − e²) v² of an impact, except for a part of the gravity impulse
    within that substep. The error of the time step belongs to the integrator: positions move by the old velocity, so
    that gravity's work and the loss of height differ.

    Impulses of contacts, springs and motors are those that pymunk reports. Of other joints pymunk reports magnitudes
    only: their impulses are the remaining changes of momentum of their bodies, so that in scenes with joints the
    residual checks less. So are the angular impulses of rolling resistance on balls; those on balls with joints count
    as impulses of the joints, and those on kinematic bodies are left out, as work between the drive and the ball.
    pymunk corrects joints by velocities, which adds energy; that is phantom energy, not position correction.

    The residual is rounding, in pymunk's sums and here. Over the first 0.1 to 1 s of the shipped scenes it was at most
    6e-13 of the largest kinetic energy or energy turned over by one cause: in the pyramid, whose potential energy is
    2,000 times as large. In scenes with motion it was below 1e-13.
    """

    def __init__(self, store: PymunkBodies) -> None:
        """Start the accounting of a store."""
        self.account = EnergyLedger()
        self._store = store
        self._breaks = np.full(len(store.setup.joints), np.inf)
        self._potential: tuple[tuple[Scene, Bodies], Potential] | None = None
        self._was_asleep: BoolArray | None = None  # at the start of the substep
        store.space_bodies.field.applied = {}
        store.space_bodies.contact_reader.points()  # from now on warm-start impulses are recorded

    def opening(self) -> EnergyState | None:
        """Return the state at the start of a substep; None if only gravity acts on all moving bodies."""
        p = self._store
        self._was_asleep = p.space_bodies.asleep
        return None if p.particles.has_only_gravity and not len(p.space_bodies) else self._state()

    def _state(self) -> EnergyState:
        p = self._store
        p.refresh()
        return EnergyState(p.position.copy(), p.angle.copy(), p.velocity.copy(), p.angular_velocity.copy())

    @np.errstate(over="ignore", invalid="ignore")  # in a diverged state, which the simulation detects next
    def substep(self, before: EnergyState | None) -> None:
        """Account the last substep."""
        p, account = self._store, self.account
        if p.particles.has_only_gravity:
            account.add(Cause.INTEGRATOR, self._free_fall_error())
        if before is None:
            return
        included = p.moving
        if p.particles.has_only_gravity:
            included[p.particles.indices] = False
        driven_bodies = p.space_bodies.drives.driven_bodies
        included[p.space_bodies.drives.indices] = False  # accounted separately below
        kinematic = np.flatnonzero(p.bodies.kinematic & p.present)
        included[kinematic] = False  # likewise
        drifts, asleep = included, p.space_bodies.asleep
        if self._was_asleep is not None and asleep is not None:
            # Bodies fall asleep and wake between the change of positions and that of velocities.
            drifts, included = included & ~self._was_asleep, included & ~asleep
        now = self._state()
        velocity, spin = self._mean(before, now, included)
        set_mean_driven_velocity(driven_bodies, before, now, velocity, spin)
        velocity[kinematic] = 0.5 * (before.velocity[kinematic] + now.velocity[kinematic])
        spin[kinematic] = 0.5 * (before.spin[kinematic] + now.spin[kinematic])
        joints = p.space_bodies.joints.by_kind
        # as the space predicted them before the step, for the air that reduces their effect
        drifted = before.position + before.velocity * p.h, before.angle + before.spin * p.h
        spring_force = spring_forces(joints.springs, *drifted) if len(joints.springs) else None
        applied = applied_impulses(p, before, included, spring_force, p.h)
        applied.angular[~self._can_turn()] = 0.0
        by_stiffness: tuple[JointImpulses, ...]
        by_damping: tuple[JointImpulses, ...]
        by_stiffness, by_damping = springs(p.space_bodies.joints, now.position, now.angle, p.h) if joints else ((), ())
        if asleep is not None:
            by_stiffness, by_damping = (
                tuple(each.without(asleep) for each in impulses) for impulses in (by_stiffness, by_damping)
            )
        points = p.space_bodies.contact_reader.points()
        by_limits = self._limit_impulses()

        self._move(before, now, drifts, applied, (velocity, spin))
        for each in by_stiffness:
            account.add_unchecked(Cause.INTEGRATOR, each.work(velocity, spin))
        account.add(Cause.DRAG, float(np.sum(applied.drag * velocity[:-1]) + applied.angular_drag @ spin[:-1]))
        account.add(Cause.DRIVES, float(np.sum(applied.driven * velocity[:-1]) + applied.angular @ spin[:-1]))
        by_liquids = np.sum(applied.liquid * velocity[:-1]) + applied.angular_liquid @ spin[:-1]
        account.add(Cause.LIQUID, float(by_liquids))
        account.add(Cause.FRICTION, float(np.sum(applied.tyre * velocity[:-1]) + applied.angular_tyre @ spin[:-1]))
        account.add(Cause.SPEED_LIMITS, by_limits.work(velocity, spin))
        account.add(Cause.DAMPING, sum(each.work(velocity, spin) for each in by_damping))
        normal_work, tangential_work, kick_work, surface_work = points.work(velocity, spin)
        account.add_contacts(normal_work, tangential_work)
        account.add(Cause.KICKS, kick_work)
        account.add(Cause.DRIVES, surface_work)
        if driven_bodies:
            gravity = p.scene.world.gravity
            rolled = p.space_bodies.rolled if p.space_bodies.rolling.resisted else np.empty(0, np.int64)
            means = velocity, spin
            work = drive_work(driven_bodies, (before, now), means, points, p.bodies, gravity, p.h, rolled)
            account.add(Cause.ROLLING, work.rolling)
            account.add(Cause.DRIVES, work.driven)
            account.add(Cause.INTEGRATOR, work.weight + work.potential_change)

        other_impulses, joint_sums = [*by_stiffness, *by_damping, by_limits, points.joint_impulses], None
        if len(joints.rigid):
            joint_sums = self._unexplained_impulses(before, now, included, applied)
            for impulses in other_impulses:
                joint_sums.subtract(impulses)
            if np.isin(kinematic, joint_sums.joined).any():
                set_unknown_sums(p.space_bodies.joints, now.position, now.angle, joint_sums, included)
        if len(kinematic):
            means, gravity = (velocity, spin), p.scene.world.gravity
            driven = kinematic_work(kinematic, (before, now), means, other_impulses, joint_sums, p.bodies, gravity)
            account.add(Cause.DRIVES, driven)
        if p.space_bodies.rolling.resisted:
            rolling_sums = self._unexplained_impulses(before, now, included, applied)
            for impulses in other_impulses:
                rolling_sums.subtract(impulses)
            rolled = p.space_bodies.rolled
            rolled = np.setdiff1d(rolled[included[rolled]], np.union1d(joints.rigid.a, joints.rigid.b))
            account.add(Cause.ROLLING, float(rolling_sums.angular[rolled] @ spin[rolled]))
        if joint_sums is not None:
            self._joints(joint_sums, now, velocity, spin, asleep)

    def _limit_impulses(self) -> JointImpulses:
        """Return the impulses, from the world, that reduced speeds to their limits in the last substep."""
        p = self._store
        changes = np.asarray(p.space_bodies.limit_changes, np.float64).reshape(-1, 4)
        body, no_arm = changes[:, 0].astype(np.int64), np.zeros((len(changes), 2))
        impulse, angular = p.bodies.mass[body, None] * changes[:, 1:3], p.bodies.moment[body] * changes[:, 3]
        return JointImpulses(np.full(len(body), WORLD), body, no_arm, no_arm, impulse, angular)

    def joints_broken(self, indices: IntArray) -> None:
        """Account the stored energy of joints, by their indices, that have broken."""
        now = self._state()
        before = self._stored_energy(now)
        self._breaks[indices], self._potential = -np.inf, None
        self.account.add(Cause.PARTED, float(self._stored_energy(now)[0] - before[0]))

    def _free_fall_error(self) -> float:
        """Return the energy error of explicit Euler on bodies under gravity alone: ½ m (g h)² in each substep."""
        p = self._store
        kick = p.h * np.asarray(p.scene.world.gravity)
        if p.ahead.any():  # exact with half a kick
            return 0.0
        mass = float(p.bodies.mass[p.particles.indices].sum())
        return 0.5 * mass * float(kick @ kick)

    def _mean(self, before: EnergyState, now: EnergyState, included: BoolArray) -> tuple[FloatArray, FloatArray]:
        """Return mean reported velocities (N + 1, 2) and spins (N + 1,); 0 for other bodies and the world."""
        velocity = 0.5 * (before.velocity + now.velocity) - self._store.ahead
        spin = 0.5 * (before.spin + now.spin)
        velocity[~included], spin[~included] = 0.0, 0.0
        return np.vstack((velocity, np.zeros((1, 2)))), np.append(spin, 0.0)

    def _move(
        self,
        before: EnergyState,
        now: EnergyState,
        drifts: BoolArray,
        applied: AppliedImpulses,
        mean: tuple[FloatArray, FloatArray],
    ) -> None:
        """Account the difference between gravity's work and the loss of height by the drift, and position corrections.

        The drift is the displacement by the old velocities; displacements beyond it are corrections of overlaps.
        """
        p = self._store
        h = p.h
        drift = np.where(drifts[:, None], before.position + before.velocity * h, now.position)
        drift_angle = np.where(drifts, before.angle + before.spin * h, now.angle)
        weight = np.where(drifts, p.bodies.mass, 0.0)[:, None] * p.world_gravity
        drift_work = float(np.sum(weight * np.where(drifts[:, None], drift - before.position, 0.0)))
        correction_work = float(np.sum(weight * (now.position - drift)))
        start, middle, end = self._stored_energy(before, EnergyState(drift, drift_angle, *now[2:]), now).tolist()
        impulse_work = float(np.sum(applied.weight * mean[0][:-1]))
        self.account.add(Cause.INTEGRATOR, impulse_work - drift_work + (middle - start))
        self.account.add(Cause.CORRECTION, (end - middle) - correction_work)

    def _stored_energy(self, *states: EnergyState) -> FloatArray:
        """Return the energy stored in springs and attraction in some states, (S,) J."""
        p = self._store
        key = p.scene, p.bodies
        if self._potential is None or any(a is not b for a, b in zip(key, self._potential[0], strict=True)):
            self._potential = key, Potential(p.setup, p.bodies, breaks=self._breaks)
        potential = self._potential[1]
        if not potential:
            return np.zeros(len(states))
        present = np.broadcast_to(p.present, (len(states), len(p.present)))
        positions, angles = np.stack([s.position for s in states]), np.stack([s.angle for s in states])
        return potential.at(np.zeros(len(states)), positions, angles, present)

    def _can_turn(self) -> BoolArray:
        """Return which bodies a torque turns, (N,): in the space, those with a finite moment."""
        p = self._store
        turnable = np.ones(len(p.position), np.bool_)
        for index in p.space_bodies.constant_forces:
            turnable[index] = np.isfinite(p.space_bodies.moment(index))
        return turnable

    def _unexplained_impulses(
        self, before: EnergyState, now: EnergyState, included: BoolArray, applied: AppliedImpulses
    ) -> ImpulseSums:
        """Return the impulses on bodies, without those of `applied`."""
        p = self._store
        mass, moment = np.where(included, p.bodies.mass, 0.0), np.where(included, p.bodies.moment, 0.0)
        linear = mass[:, None] * (now.velocity - before.velocity) - applied.weight - applied.driven - applied.drag
        linear -= applied.liquid + applied.tyre
        angular = moment * (now.spin - before.spin) - applied.angular - applied.angular_drag
        angular -= applied.angular_liquid + applied.angular_tyre
        rigid = p.space_bodies.joints.by_kind.rigid
        return ImpulseSums(np.vstack((linear, np.zeros((1, 2)))), np.append(angular, 0.0), np.union1d(rigid.a, rigid.b))

    def _joints(
        self,
        joint_sums: ImpulseSums,
        now: EnergyState,
        velocity: FloatArray,
        spin: FloatArray,
        asleep: BoolArray | None,
    ) -> None:
        """Account the work of joints, with motors as drives."""
        by_motors: JointImpulses = motors(self._store.space_bodies.joints, now.position, now.angle, joint_sums)
        if asleep is not None:
            by_motors = by_motors.without(asleep)
        joint_sums.subtract(by_motors)
        self.account.add(Cause.DRIVES, by_motors.work(velocity, spin))
        self.account.add(Cause.JOINTS, joint_sums.work(velocity, spin))
