"""The world of a running simulation, and one step of it with discrete collision detection.

    motion = world.integrate(h)                        forces and free motion
    contacts = world.solver.detect(motion)             broad phase, filter, narrow phase
    solution = world.solver.solve(motion, contacts, h) contacts, joints and stops
    world.solver.correct(solution, h)                  overlap, for the next step
    record = world.commit(motion, solution, h)         the result becomes the present state

Only `commit` changes the present state. `continuous` builds the other detections from the same verbs.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.common.speed_limits import SpeedLimits
from sandbox.engines.forces.field import ForceField
from sandbox.engines.reference.collision import WORK, CollisionPipeline, is_suitable, make_pipeline
from sandbox.engines.reference.drives import DrivenSolver, Drives, DriveWork
from sandbox.engines.reference.filtering import CollisionFilter, OneWayColliders
from sandbox.engines.reference.forces import forces_on
from sandbox.engines.reference.integrators import INTEGRATORS, State, transition
from sandbox.engines.reference.joints import JointSolver
from sandbox.engines.reference.manifold import Manifolds
from sandbox.engines.reference.penalty import DrivenPenaltySolver, PenaltyContacts, PenaltySolver
from sandbox.engines.reference.velocity_solver import ContactMemory, Impact, ImpulseSolution, ImpulseSolver, Motion
from sandbox.scene.description.world import Settings


class SolverWork(NamedTuple):
    """Work in a step that depends on the state of the solver, for the energy ledger."""

    joints: float
    """J, of joint impulses but those of motors; 0 for joints that are solved by positions"""
    motors: float
    """J, of motors"""
    drives: DriveWork | None
    """energy given to driven bodies; None if there are none"""


class StepRecord(NamedTuple):
    """One step, or one piece of it up to an impact, for the energy ledger, contact log, joint breaker and walls.

    The states are never written to again. Contacts are valid until the next step.
    """

    time: float
    """s, at the start"""
    h: float
    """length, s"""
    before: State
    """(2, N, D) at the start"""
    motion: Motion
    """without contacts"""
    after: State
    """(2, N, D) at the end"""
    end: FloatArray
    """(N, D) rates after contacts and joints that act through the step, m/s and rad/s"""
    contacts: Manifolds
    """K contacts that act through the step"""
    impulse: FloatArray
    """(K, 2) N·s, along the normals and along the normals turned left"""
    kick_energy: FloatArray | None
    """(K,) J that kicks add for each N·s along the normal; None if nothing was kicked"""
    impact: Impact | None
    """contacts that act only at the end of the step; None with discrete detection"""
    rolling: FloatArray | None
    """(K,) N·m·s on the second bodies of the contacts, by rolling resistance; None without any"""
    joint_load: FloatArray | None
    """(L, 2) N or N·m, force of each joint on its second body; None if no joint can break"""
    work: "SolverWork | None"
    """work of joints and drives; None while energy accounting is off"""
    unlimited: State | None = None
    """(2, N, D) end before speeds were reduced to their limits; None if they were not"""

    def all_contacts(self) -> tuple[Manifolds, FloatArray]:
        """Return all contacts, those of the impact last, and their impulses (K, 2), N·s."""
        if self.impact is None:
            return self.contacts, self.impulse
        impact = self.impact
        return self.contacts.joined(impact.contacts), np.concatenate((self.impulse, impact.impulse))


def step(world: "WorldState", h: float) -> StepRecord:
    """Advance a world by h, s, with discrete collision detection; return its record.

    Contacts are detected at the end of the step only. A ball tunnels through a thin wall when v·h > r + half its
    thickness, and through another ball when v·h > r₁ + r₂.

    The rebound is e times the approach before the step's forces, as in Munk2D, so that a resting body does not bounce
    by the kick of gravity. Positions follow a change of velocity as far as the integrator moves them within the step.

    Raises:
        Exhaustion: there are too many contacts for the limits of work or memory.
    """
    # 1. Forces and free motion without contacts, with joints that are solved by positions
    motion = world.integrate(h)
    # 2. Detect: broad phase, filter, narrow phase
    contacts = world.solver.detect(motion)
    # 3. Solve: impulses of contacts, joints and stops, warm-started by those of the last step
    solution = world.solver.solve(motion, contacts, h)
    # 4. Correct: velocities that undo overlap beyond the slop during the next step
    world.solver.correct(solution, h)
    # 5. Commit: the result becomes the present state
    return world.commit(motion, solution, h)


def discrete(world: "WorldState", h: float) -> Iterator[StepRecord]:
    """Advance by h, s, in one step with discrete collision detection."""
    yield step(world, h)


Detection = Callable[["WorldState", float], Iterator[StepRecord]]
"""Advances a world by h, s, in one or more pieces, and yields the record of each before the next begins."""


class WorldState:
    """State x of N bodies at `time`, the forces on them, and the solver that advances them.

    Args:
        store: the bodies.
        settings: with every choice filled in.
    """

    def __init__(self, store: BodyStore, settings: Settings) -> None:
        assert settings.broad_phase and settings.slop is not None and settings.bias is not None
        self._store, self._settings = store, settings
        self.work: Counter[str] = Counter(dict.fromkeys(WORK, 0))
        """work counters"""
        self.memory = ContactMemory(settings.h)
        self.field = ForceField(store)
        self.joints = self._new_joints()
        self._posed = self.joints is not None or not self.field.empty or self.field.tyres is not None
        self.filter = CollisionFilter(store, settings.slop) if CollisionFilter.is_needed(store) else None
        self.one_way: OneWayColliders | None = None if self.filter is None else self.filter.one_way
        self.pipeline = self._new_pipeline(self.work)
        self._penalty = self._new_penalty(self.pipeline)
        self._fixtures = store.static_colliders
        self.drives: Drives | None = None
        self.records_joint_load = self.records_work = False
        """whether step records contain `joint_load`, and `work`"""
        self.time = 0.0
        self._rebuild(is_start=True)

    def _new_pipeline(self, work: Counter[str]) -> CollisionPipeline:
        assert self._settings.broad_phase
        return make_pipeline(self._store, self._settings.broad_phase, self.filter, work)

    def _new_penalty(self, pipeline: CollisionPipeline) -> PenaltyContacts | None:
        penalty = self._settings.response == "penalty"
        return PenaltyContacts(self._store, self._settings, pipeline) if penalty else None

    def _new_joints(self) -> JointSolver | None:
        """Return a solver of the scene's joints, if it has any."""
        store, settings = self._store, self._settings
        joints = store.all_joints
        if not len(joints):
            return None
        assert settings.joints is not None and settings.bias is not None
        cap = math.inf if settings.stretch is None else settings.stretch
        inverse = store.inverse_mass, store.inverse_moment
        return JointSolver(joints, *inverse, settings.bias, settings.iterations, settings.joints, cap)

    def rebuild(self) -> None:
        """Update state, forces, collision data and solver after a change of the body store."""
        self._rebuild(is_start=False)

    def _rebuild(self, is_start: bool) -> None:
        store = self._store
        self.x = self._stored_state()
        if self.filter is not None:
            self.filter.rebuild(self.x[0])  # centres; `use_hinges` below replaces them by hinges
        self.drives = Drives.of(store, self.drives)
        if self.drives is not None:
            self.drives.use_hinges(self.x)
        self.memory.rebuild(store.moving)
        self.limits = SpeedLimits.of(store.bodies, store.moving)
        if not is_suitable(self.pipeline, store):  # keys mean other pairs in the new pipeline
            self.pipeline = self._new_pipeline(self.work)
            self._penalty = self._new_penalty(self.pipeline)
            self.memory.forget(self._settings.h)
        if store.static_colliders is not self._fixtures:  # keys may mean other segments now
            self._fixtures = store.static_colliders
            self.memory.forget(self._settings.h)
        if not is_start:  # a new pipeline is up to date
            self.pipeline.rebuild()
        self._choose_solver()
        if self.one_way is not None:
            overlaps = self.pipeline.at_one_way(self.x[0])
            self.one_way.begin(overlaps, self.closing_speed(overlaps, self.x))
        if self.joints is not None:
            self.joints.joints = store.all_joints  # motors may have other values
            self.joints.rebuild(store.inverse_mass, store.inverse_moment, store.intact_joints())
        self.forces = forces_on(store, self.field, self.joints, self.x.shape[2])

    def _choose_solver(self) -> None:
        """Choose one of the four solvers by the contact response and by whether a body is driven."""
        store, drives, penalty = self._store, self.drives, self._penalty
        given = store, self._settings, self.pipeline, self.joints, self.memory
        self.impulses = ImpulseSolver(*given) if drives is None else DrivenSolver(drives, *given)
        self.solver: ImpulseSolver | PenaltySolver = self.impulses
        if penalty is not None:
            penalty.rebuild(drives)
            self.solver = PenaltySolver(penalty, self.impulses)
            if drives is not None:
                self.solver = DrivenPenaltySolver(drives, penalty, self.impulses)

    def _stored_state(self) -> State:
        """Return the state in the body store, (2, N, D), with angles only if a body can turn."""
        store = self._store
        if not self._turns():
            return np.stack((store.position, store.velocity))
        poses = np.column_stack((store.position, store.angle))
        return np.stack((poses, np.column_stack((store.velocity, store.angular_velocity))))

    def _turns(self) -> bool:
        """Return whether states need angles: a body turns, or a joint, drive, attraction, thrust or tyre may."""
        store = self._store
        return bool(self._posed or store.has_driven or store.inverse_moment.any() or store.angular_velocity.any())

    def read_velocities(self) -> bool:
        """Read velocities from the body store after an impulse; return False if `rebuild` is needed instead.

        One-way walls depend on velocities, zones release a body that gets a velocity, and angular velocities can change
        the shape of states. Nothing else that `rebuild` derives depends on velocities.
        """
        if self.one_way is not None or self._store.scene.zones or self._turns() != (self.x.shape[2] == 3):
            return False
        self.x = self._stored_state()
        if self.drives is not None:
            self.drives.use_hinges(self.x)
        return True

    def restart(self) -> bool:
        """Return to time 0 with the state in the body store, which has changed in no other way.

        Return false if `rebuild` is needed too, because angles now matter, or no longer do.
        """
        self.time = 0.0
        self.memory.forget(self._settings.h)
        self.memory.pseudo_velocity[:] = 0.0
        self.memory.has_pseudo_velocity = False
        if self.joints is not None:
            self.joints.forget()
        turns = self.x.shape[2] == 3
        self.x = self._stored_state()
        return bool(self._turns() == turns)

    def write_state(self) -> None:
        """Write the state into the body store."""
        store = self._store
        store.position[:], store.velocity[:] = self.x[0, :, :2], self.x[1, :, :2]
        if self.x.shape[2] == 3:
            store.angle[:], store.angular_velocity[:] = self.x[0, :, 2], self.x[1, :, 2]
        if self.drives is not None:
            self.drives.write_centres(self.x)

    @property
    def substeps(self) -> int:
        """Number of substeps in a step."""
        return self._settings.substeps

    def centres(self, x: State) -> FloatArray:
        """Return the centres of mass of all bodies in a state, (N, 2) m."""
        return x[0, :, :2] if self.drives is None else self.drives.centres(x)

    def poses(self, x: State) -> FloatArray:
        """Return the centres of mass of all bodies in a state, with their angles if it has these, (N, 2 or 3)."""
        return x[0] if self.drives is None else np.column_stack((self.drives.centres(x), x[0, :, 2]))

    def ledger_penalty(self) -> PenaltyContacts | None:
        """Return penalty contacts for the energy ledger, whose work is not counted; None for other responses."""
        if self._penalty is None:
            return None
        own = PenaltyContacts(self._store, self._settings, self._new_pipeline(Counter()))
        own.rebuild(self.drives)
        return own

    @property
    def position_fraction(self) -> float:
        """Fraction of a velocity change that the positions of the same step include: `Integrator.fraction`."""
        assert self._settings.integrator is not None
        return INTEGRATORS[self._settings.integrator].fraction

    def integrate(self, h: float) -> Motion:
        """Return the motion of all bodies over h, s, without contact impulses. The present state is not changed.

        Tyres act by their mean loads in the step, which every integrator takes as constant forces.
        """
        if self.field.tyres is None:
            return self.solver.integrate(self.x, self.forces, self.time, h)
        rate = self.x[1] + h * transition(self.time, self.x, self.forces)[1]
        loads = self.field.tyre_loads(self.x[0], rate, h)
        constant, which = self.forces.constant.copy(), self.field.tyres.bodies
        inverse = np.column_stack((self._store.inverse_mass, self._store.inverse_mass, self._store.inverse_moment))
        constant[which] += inverse[which] * (loads.drive + loads.friction)
        motion = self.solver.integrate(self.x, self.forces._replace(constant=constant), self.time, h)
        return motion._replace(tyres=loads)

    def commit(self, motion: Motion, solution: ImpulseSolution, h: float) -> StepRecord:
        """Take a solution at the end of h, s, as the present state."""
        before, start = self.x, self.time
        after = self.solver.finish(solution.after)
        self.x, self.time = self._limited(after, h), start + h
        load = self.joints.load(self.x) if self.joints is not None and self.records_joint_load else None
        work = self._solver_work(before, motion, solution.end, h) if self.records_work else None
        unlimited = None if self.x is after else after
        return StepRecord(start, h, before, motion, self.x, *solution[1:], load, work, unlimited)

    def _limited(self, x: State, h: float) -> State:
        """Return the end of a step of h, s, with speeds within their limits.

        Positions follow as far as the integrator moves them within the step.
        """
        rates = x[1] if self.limits is None else self.limits.reduced(x[1])
        return x if rates is x[1] else np.stack((x[0] + (self.position_fraction * h) * (rates - x[1]), rates))

    def _solver_work(self, before: State, motion: Motion, end: FloatArray, h: float) -> SolverWork:
        """Return the work of joints and drives in a step of h, s, that ended with rates `end` before its impact."""
        joints, drives = self.joints, self.drives
        by_impulses = joints is not None and joints.method == "impulses"
        joint_work, motor_work = (0.0, 0.0) if joints is None else joints.work(0.5 * (motion.start[1] + end))
        return SolverWork(
            joint_work if by_impulses else 0.0, motor_work, None if drives is None else drives.work(before, self.x, h)
        )

    def present_contacts(self) -> Manifolds:
        """Return the contacts in the present state; penalty contacts are those of the last motion."""
        return self.pipeline.overlaps(self.x[0]) if self._penalty is None else self._penalty.last.contacts

    def impact(self, motion: Motion, persistent: Manifolds, colliding: Manifolds, h: float) -> StepRecord:
        """Take the end of a motion of h, s, as the present state, with an impact at that time.

        Args:
            motion: over h.
            persistent: contacts that act through h, as in `step`; otherwise gravity's kick would make them bounce.
            colliding: contacts that begin at the end of h.
            h: s.
        """
        return self.commit(motion, self.impulses.impact(motion, persistent, colliding, h), h)

    def resting_speed(self, h: float) -> float:
        """Return the closing speed, m/s, caused by the forces of two substeps; slower contacts are resting."""
        return 2.0 * h * float(np.abs(self.forces.constant[:, :2]).max(initial=0.0))

    def closing_speed(self, contacts: Manifolds, x: State) -> FloatArray:
        """Return the closing speed of each contact in a state, (K,) m/s."""
        return -self.impulses.approach(contacts, x[1])
