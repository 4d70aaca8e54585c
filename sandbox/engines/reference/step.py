"""The world of a running simulation, and one step of it with discrete collision detection.

    motion = world.advance(h)                          forces and free motion
    contacts = world.solver.detect(motion.placed)      broad phase, filter, narrow phase
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
from sandbox.engines.reference.collision import WORK, CollisionPipeline, is_suitable, make_pipeline
from sandbox.engines.reference.drives import DrivenSolver, Drives
from sandbox.engines.reference.filtering import CollisionFilter, OneWayWalls
from sandbox.engines.reference.forces import ForceField, forces_on
from sandbox.engines.reference.integrators import INTEGRATORS, State
from sandbox.engines.reference.joints import JointSolver
from sandbox.engines.reference.manifold import Manifolds
from sandbox.engines.reference.penalty import DrivenPenaltySolver, PenaltyContacts, PenaltySolver
from sandbox.engines.reference.velocity_solver import ContactMemory, Impact, ImpulseSolver, Motion, Solution
from sandbox.scene.description.world import Settings


class StepRecord(NamedTuple):
    """One step, or one piece of it up to an impact, as the energy ledger, contact log, joints and walls read it.

    The states are never written to again. Contacts are valid until the next collision detection.
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
    """contacts that act at the end of the step alone; None with discrete detection"""

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
    # 1. Forces and free motion: where bodies go if they hit nothing; joints solved by positions hold them
    motion = world.advance(h)
    # 2. Detect: broad phase, filter, narrow phase
    contacts = world.solver.detect(motion.placed)
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
        """how often each kind of work was done so far"""
        self.memory = ContactMemory(settings.h)
        self.field = ForceField(store)
        self.joints = self._new_joints()
        self._posed = self.joints is not None or not self.field.empty
        self.filter = CollisionFilter(store) if CollisionFilter.is_needed(store.scene) else None
        self.walls: OneWayWalls | None = None if self.filter is None else self.filter.walls
        self.pipeline = self._new_pipeline(self.work)
        self._penalty = self._new_penalty(self.pipeline)
        self._fixtures = store.fixtures
        self.drives: Drives | None = None
        self.time = 0.0
        self.rebuild()

    def _new_pipeline(self, work: Counter[str]) -> CollisionPipeline:
        assert self._settings.broad_phase
        return make_pipeline(self._store, self._settings.broad_phase, self.filter, work)

    def _new_penalty(self, pipeline: CollisionPipeline) -> PenaltyContacts | None:
        penalty = self._settings.response == "penalty"
        return PenaltyContacts(self._store, self._settings, pipeline) if penalty else None

    def _new_joints(self) -> JointSolver | None:
        """Return a solver of the scene's joints, if it has any."""
        store, settings = self._store, self._settings
        links = store.setup.links
        if not len(links):
            return None
        assert settings.joints is not None and settings.bias is not None
        cap = math.inf if settings.stretch is None else settings.stretch
        inverse = store.inverse_mass, store.inverse_moment
        return JointSolver(links, *inverse, settings.bias, settings.iterations, settings.joints, cap)

    def rebuild(self) -> None:
        """Derive state, forces, collision data and solver anew from the body store."""
        store = self._store
        self.x = self._stored_state()
        if self.filter is not None:
            self.filter.rebuild(self.x[0])  # centres: hinges take their places only below
        self.drives = Drives.of(store, self.drives)
        if self.drives is not None:
            self.drives.use_hinges(self.x)
        self.memory.rebuild(store.moving)
        if not is_suitable(self.pipeline, store):  # keys mean other pairs from now on
            self.pipeline = self._new_pipeline(self.work)
            self._penalty = self._new_penalty(self.pipeline)
            self.memory.forget(self._settings.h)
        if store.fixtures is not self._fixtures:  # keys may mean other segments from now on
            self._fixtures = store.fixtures
            self.memory.forget(self._settings.h)
        self.pipeline.rebuild()
        self._choose_solver()
        if self.walls is not None:
            overlaps = self.pipeline.at_one_way_walls(self.x[0])
            self.walls.begin(overlaps, self.closing_speed(overlaps, self.x))
        if self.joints is not None:
            self.joints.rebuild(store.inverse_mass, store.inverse_moment, store.linked())
        self.forces = forces_on(store, self.field, self.joints, self.x.shape[2])

    def _choose_solver(self) -> None:
        """Choose among the four solvers by the contact response and by whether a body is driven."""
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
        """Return the state in the body store, (2, N, D), with angles only if something can turn."""
        store = self._store
        if not self._turns():
            return np.stack((store.position, store.velocity))
        poses = np.column_stack((store.position, store.angle))
        return np.stack((poses, np.column_stack((store.velocity, store.angular_velocity))))

    def _turns(self) -> bool:
        """Return whether states need angles: a body turns, or a joint, drive, attraction or thrust may turn it."""
        store = self._store
        return bool(self._posed or store.held or store.inverse_moment.any() or store.angular_velocity.any())

    def read_velocities(self) -> bool:
        """Take velocities from the body store after an impulse; return False if `rebuild` has to do it.

        One-way walls depend on velocities, zones release a body that gets a velocity, and angular velocities can change
        the shape of states. Nothing else that `rebuild` derives depends on velocities.
        """
        if self.walls is not None or self._store.scene.zones or self._turns() != (self.x.shape[2] == 3):
            return False
        self.x = self._stored_state()
        if self.drives is not None:
            self.drives.use_hinges(self.x)
        return True

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

    def ledger_penalty(self) -> PenaltyContacts | None:
        """Return penalty contacts for the energy ledger, which are not counted as work; None for other responses."""
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

    def advance(self, h: float) -> Motion:
        """Return the motion of all bodies over h, s, as if they hit nothing. The present state is not changed."""
        return self.solver.integrate(self.x, self.forces, self.time, h)

    def commit(self, motion: Motion, solution: Solution, h: float) -> StepRecord:
        """Take a solution at the end of h, s, as the present state."""
        before, start = self.x, self.time
        self.x, self.time = self.solver.finish(solution.after), start + h
        return StepRecord(start, h, before, motion, self.x, *solution[1:])

    def impact(self, motion: Motion, lasting: Manifolds, clash: Manifolds, h: float) -> StepRecord:
        """Take the end of a motion of h, s, as the present state, with an impact at that time.

        Args:
            motion: over h.
            lasting: contacts that act through h; as in `step`, else gravity's kick would make them bounce.
            clash: contacts that begin at the end of h.
            h: s.
        """
        return self.commit(motion, self.impulses.impact(motion, lasting, clash, h), h)

    def resting_speed(self, h: float) -> float:
        """Return the closing speed, m/s, that the forces of two substeps cause: slower contacts rest on each other."""
        return 2.0 * h * float(np.abs(self.forces.steady[:, :2]).max(initial=0.0))

    def closing_speed(self, contacts: Manifolds, x: State) -> FloatArray:
        """Return how fast each contact closes in a state, (K,) m/s."""
        return -self.impulses.approach(contacts, x[1])
