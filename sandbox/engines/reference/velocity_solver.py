"""The impulse solver: contacts and joints by sequential impulses, restitution targets, and kicks.

`ImpulseSolver` has the verbs that all solvers share, in the order of a step: `integrate`, `detect`, `solve`, `correct`,
`finish`. The other solvers are `drives.DrivenSolver`, `penalty.PenaltySolver` and `penalty.DrivenPenaltySolver`.

`ReboundModel` returns the restitution targets of pairs with kicks or velocity-dependent restitution. For other pairs
the target is restitution times approach.
"""

from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.common.kernel import kernel
from sandbox.engines.common.restitution import fraction_at, kick_gain, kicked, segment_fractions
from sandbox.engines.common.restitution_kernels import compiled_rebound
from sandbox.engines.contract import Exhaustion
from sandbox.engines.forces.tyre import TyreLoads
from sandbox.engines.reference.collision import CollisionPipeline
from sandbox.engines.reference.integrators import INTEGRATORS, Inputs, State, Step, transition
from sandbox.engines.reference.joint_data import select_joints
from sandbox.engines.reference.joint_rows import VelocityConstraints, make_velocity_constraints
from sandbox.engines.reference.joints import JointSolver, kick_pose
from sandbox.engines.reference.manifold import Manifolds
from sandbox.engines.reference.sequential_impulses import (
    NO_ROLLING,
    NO_STOPS,
    TURNOVER_ROUNDING,
    GroupWork,
    RollingRows,
    approach,
    largest_fractions,
    match_impulses,
    rebound_speeds,
    solve_contacts_once,
    solve_overlaps,
    solve_together,
    solve_velocities,
    warm_start_contacts,
)
from sandbox.resource_limits import STEP_WORK
from sandbox.scene.compile.joint_arrays import JointArrays
from sandbox.scene.description.base import Point
from sandbox.scene.description.fixed import Post, Wall
from sandbox.scene.description.world import Kick, Settings
from sandbox.scene.geometry.vectors import nearest_fraction


class Rebound(NamedTuple):
    """Restitution targets of K contacts."""

    speed: FloatArray
    """(K,) m/s, at most 0: the target normal velocity is its opposite"""
    kick_energy: FloatArray | None
    """(K,) J that kicks add for each N·s along the normal; None if nothing was kicked"""


class ReboundModel:
    """Rebound of contacts with kicks, or with restitution that depends on speed."""

    def __init__(self, store: BodyStore) -> None:
        self._store = store
        self._kicks = {k: collider for k, collider in enumerate(store.scene.fixed) if _kick_of(collider) is not None}

    @staticmethod
    def is_needed(store: BodyStore) -> bool:
        """Return whether a pair that can touch has a kick, or restitution that depends on speed."""
        return bool((store.contact_matrix.touching & ~store.contact_matrix.surfaces.fixed_coefficients).any())

    def bounce(self, contacts: Manifolds, approach: FloatArray) -> Rebound:
        """Return the restitution targets of contacts that approach at (K,) m/s, negative."""
        pair = contacts.surface_pair
        restitution, falloff = self._store.restitution.ravel()[pair], self._store.falloff.ravel()[pair]
        speed = np.empty(contacts.size)
        _rebounds(restitution, falloff, approach, speed)
        kick = np.zeros(contacts.size)
        for k in np.flatnonzero(contacts.second < 0).tolist():
            number = -1 - int(contacts.second[k])
            if number in self._kicks:
                x, y = contacts.point[k].tolist()
                kick[k] = self._kick_gain(number, (x, y), restitution[k], falloff[k], -float(approach[k]))
        if not kick.any():
            return Rebound(speed, None)
        whole = kick - speed
        is_kicked = kick > 0.0
        energy = np.zeros(contacts.size)
        # The part of the impulse beyond `-speed` is the kick's. Its work is taken at the mean of the speeds at its
        # ends.
        energy[is_kicked] = (kick / (whole - approach) * 0.5 * (whole - speed))[is_kicked]
        return Rebound(speed - kick, energy)

    def _kick_gain(self, number: int, point: Point, restitution: float, falloff: float, closing: float) -> float:
        """Return the separation speed, m/s, that the kick of a static collider adds at a contact point."""
        collider = self._kicks[number]
        kick = _kick_of(collider)
        assert kick is not None
        fraction, middle = 0.5, kick.profile == "middle"
        if middle and isinstance(collider, Wall):
            ends = (*collider.points, collider.points[0]) if collider.closed else collider.points
            each = zip(ends[:-1], ends[1:], segment_fractions(ends), strict=True)
            fraction = min((_squared_distance(a, b, point), fraction_at(a, b, part, point)) for a, b, part in each)[1]
        speed = kicked(kick.speed, kick.threshold, middle, fraction, closing)
        return kick_gain(restitution, falloff, speed, kick.adds_to == "approach", closing)


class RollingModel:
    """Rolling resistance of contacts of balls."""

    def __init__(self, store: BodyStore) -> None:
        self._coefficients: FloatArray = store.contact_matrix.surfaces.rolling.ravel()
        self._radius: FloatArray = np.where(store.bodies.round, store.bodies.radius, 0.0)

    @staticmethod
    def is_needed(store: BodyStore) -> bool:
        """Return whether some contact of a ball has rolling resistance."""
        matrix = store.contact_matrix
        return matrix.rolling > 0.0 and bool((store.bodies.round & matrix.touches).any())

    def rows(self, contacts: Manifolds, memory: "ContactMemory", fraction: float) -> RollingRows:
        """Return the rows of contacts, with a fraction of the impulses of the last step as initial ones."""
        radius = self._radius[contacts.first]
        other = np.where(contacts.second >= 0, self._radius[np.maximum(contacts.second, 0)], 0.0)
        reach = self._coefficients[contacts.surface_pair] * np.maximum(radius, other)
        impulse = np.zeros(contacts.size)
        if len(memory.rolling):
            row = np.minimum(np.searchsorted(memory.key, contacts.key), len(memory.key) - 1)
            impulse = np.where(memory.key[row] == contacts.key, fraction * memory.rolling[row], 0.0)
        return RollingRows(reach, impulse)


def _kick_of(collider: object) -> Kick | None:
    return collider.kick if isinstance(collider, Wall | Post) else None


def _squared_distance(a: Point, b: Point, point: Point) -> float:
    """Return the squared distance of a point from a segment, m²."""
    fraction = nearest_fraction(*a, *b, *point)
    x, y = point[0] - a[0], point[1] - a[1]
    return (x - fraction * (b[0] - a[0])) ** 2 + (y - fraction * (b[1] - a[1])) ** 2


@kernel
def _rebounds(restitution: FloatArray, falloff: FloatArray, approach: FloatArray, out: FloatArray) -> None:
    for k in range(len(out)):
        out[k] = -compiled_rebound(restitution[k], falloff[k], -approach[k])


MAX_IMPACT_PASSES = 1000
"""Largest number of passes over the contacts of one impact"""

CONVERGED = 1e-15
"""Change of an impulse in a pass, as a fraction of the largest impulse, that is rounding error"""


NO_IMPULSE: FloatArray = np.zeros((0, 2))


class SpringContacts(NamedTuple):
    """K penalty contacts that acted as forces in a motion."""

    contacts: Manifolds
    impulse: FloatArray
    """(K, 2) N·s, normal and tangential"""


class Motion(NamedTuple):
    """Motion of all bodies over a step without contact impulses. The arrays are never written to again."""

    start: State
    """(2, N, D) at the start, with the velocities that driven bodies have through the step"""
    free: State
    """(2, N, D) at the end, by forces alone"""
    shift: FloatArray | None
    """(N, D) m and rad, correction of the overlap of the last step; None if nothing overlapped"""
    placed: State
    """(2, N, D) at the end: `free`, shifted, and corrected by joints that are solved by positions"""
    springs: SpringContacts | None = None
    """penalty contacts that acted in the motion; None if contacts are solved by impulses"""
    tyres: TyreLoads | None = None
    """mean loads of tyres; None without any"""


class Impact(NamedTuple):
    """Contacts that act only at the end of a step."""

    contacts: Manifolds
    impulse: FloatArray
    """(K, 2) N·s"""
    kick_energy: FloatArray | None
    """(K,) J that kicks add for each N·s along the normal; None if nothing was kicked"""


class ImpulseSolution(NamedTuple):
    """State at the end of a step, with its contacts and impulses."""

    after: State
    """(2, N, D)"""
    end: FloatArray
    """(N, D) rates after contacts and joints that act through the step"""
    contacts: Manifolds
    impulse: FloatArray
    """(K, 2) N·s"""
    kick_energy: FloatArray | None
    """(K,) J that kicks add for each N·s along the normal; None if nothing was kicked"""
    impact: Impact | None = None
    rolling: FloatArray | None = None
    """(K,) N·m·s on the second bodies, by rolling resistance; None without any"""


class ContactMemory:
    """Data that a step passes to the next: impulses for warm starting, and velocities that correct overlap."""

    def __init__(self, h: float) -> None:
        self.forget(h)
        self.pseudo_velocity: FloatArray = np.zeros((0, 3))
        """(N, 3) m/s and rad/s, velocities that correct overlap in the next step; not part of the motion"""
        self.has_pseudo_velocity = False
        """whether any of these is not 0"""

    def forget(self, h: float) -> None:
        """Forget the impulses, because keys now mean other pairs; h is the substep, s."""
        self.key: IntArray = np.empty(0, np.int64)
        self.impulse: FloatArray = np.empty((0, 2))
        self.rolling: FloatArray = np.empty(0)
        """(K,) N·m·s, by rolling resistance; empty without any"""
        self.h = h

    def rebuild(self, moving: BoolArray) -> None:
        """Update after a change of the bodies; (N,) whether each moves."""
        kept = np.zeros((len(moving), 3))
        kept[: len(self.pseudo_velocity)] = self.pseudo_velocity
        self.pseudo_velocity = np.where(moving[:, None], kept, 0.0)
        self.has_pseudo_velocity = bool(self.pseudo_velocity.any())


class ImpulseSolver:
    """Solver by sequential impulses (Catto 2005). Its verbs, in the order of a step: integrate, detect, solve, correct.

    `DrivenSolver` overrides `integrate`, `finish`, and the two verbs within `solve`: `iterate` and `remove_stop_rates`.

    Args:
        store: the bodies.
        settings: with every choice filled in.
        pipeline: detects collisions; its work counters also count the iterations.
        joints: solver of the scene's joints, if it has any.
        memory: of the last step, changed by `correct`.
        inverse_moment_overlap: inverse moments for the correction of overlap, if they differ, (N,) 1/(kg·m²).
        has_constraints: whether there is something to solve without any contact, apart from joints.
    """

    def __init__(
        self,
        store: BodyStore,
        settings: Settings,
        pipeline: CollisionPipeline,
        joints: JointSolver | None,
        memory: ContactMemory,
        inverse_moment_overlap: FloatArray | None = None,
        has_constraints: bool = False,
    ) -> None:
        assert settings.integrator and settings.slop is not None and settings.bias is not None
        self._integrator = INTEGRATORS[settings.integrator]
        self._pipeline, self._memory, self._work = pipeline, memory, pipeline.work
        by_impulses = joints is not None and joints.method == "impulses"
        self._velocity_joints = joints if by_impulses else None
        self._position_joints = None if by_impulses else joints
        self._has_constraints = has_constraints or by_impulses
        """whether there is something to solve without any contact"""
        self._inverse = store.inverse_mass, store.inverse_moment
        overlap_moment = store.inverse_moment if inverse_moment_overlap is None else inverse_moment_overlap
        self._inverse_overlap = store.inverse_mass, overlap_moment
        """inverse masses and moments for the correction of overlap"""
        self._iterations, self._slop, self._bias = settings.iterations, settings.slop, settings.bias
        self._dissipative = settings.impact == "dissipative"
        self._substeps, self._max_work = settings.substeps, STEP_WORK.value // settings.substeps
        self._no_spin: FloatArray = np.zeros((len(store.position), 3))
        self._restitution: FloatArray = store.restitution.ravel()
        self._rebound_model = ReboundModel(store) if ReboundModel.is_needed(store) else None
        """for kicks and velocity-dependent restitution; None if every pair has constant restitution and no kick"""
        self._rolling_model = RollingModel(store) if RollingModel.is_needed(store) else None
        self._rolling, self._no_rows = NO_ROLLING, make_velocity_constraints(select_joints(JointArrays.none()))

    @property
    def scheme(self) -> Step:
        """The step function of the integrator."""
        return self._integrator.step

    def integrate(self, x: State, forces: Inputs, time: float, h: float) -> Motion:
        """Return the motion from a state at a time, s, over h, s, without contacts."""
        return self.complete_motion(x, self._integrator.step(transition, time, x, forces, h), h)

    def complete_motion(self, start: State, free: State, h: float, springs: SpringContacts | None = None) -> Motion:
        """Return a motion from `start` to `free`, with overlap corrected, and joints that are solved by positions.

        `springs` are the penalty contacts that acted in it.
        """
        shift, placed = None, free
        if self._memory.has_pseudo_velocity:
            shift = h * self._memory.pseudo_velocity[:, : free.shape[2]]
            placed = np.empty_like(free)
            np.add(free[0], shift, out=placed[0])
            placed[1] = free[1]
        if self._position_joints is not None:
            placed = free.copy() if placed is free else placed
            self._position_joints.project(start, placed, h)
            self._work["joint_iterations"] += self._position_joints.visits_per_step
        return Motion(start, free, shift, placed, springs)

    def detect(self, motion: Motion) -> Manifolds:
        """Return the contacts at the end of a motion. They are valid until the next detection.

        Raises:
            Exhaustion: there are too many.
        """
        return self._pipeline.overlaps(motion.placed[0])

    def solve(self, motion: Motion, contacts: Manifolds, h: float) -> ImpulseSolution:
        """Return the state at the end of a motion over h, s, with contacts and joints that act through it.

        The separations of contacts are updated.

        Raises:
            Exhaustion: it would take too many passes over contacts.
        """
        placed = motion.placed
        if not (len(contacts.key) or self._has_constraints):
            return ImpulseSolution(placed, placed[1], contacts, NO_IMPULSE, None)
        after, impulse = placed.copy(), np.zeros((contacts.size, 2))
        memory, fraction = self._memory, self._integrator.fraction
        if self._velocity_joints is not None:
            self._velocity_joints.prepare(kick_pose(placed, fraction, h), h)
        bounce = self.bounce(contacts, motion.start[1])
        match_impulses(contacts.key, memory.key, memory.impulse, impulse)
        # The impulse of a resting contact is proportional to the step. It is not scaled up: that of an impact is not.
        fraction_kept = min(h / memory.h, 1.0)
        impulse *= fraction_kept
        if self._rolling_model is not None and after.shape[2] == 3:
            self._rolling = self._rolling_model.rows(contacts, memory, fraction_kept)
        self._resolve(contacts, bounce, motion.start[1], after[1], impulse, with_joints=True)
        rolling, self._rolling = self._rolling, NO_ROLLING
        if fraction:
            change = after[1] - self.remove_stop_rates(placed[1])
            after[0] += (fraction * h) * change
            contacts.separation[:] += (fraction * h) * self.approach(contacts, change)
        given = rolling.impulse if len(rolling.impulse) else None
        return ImpulseSolution(after, after[1], contacts, impulse, bounce.kick_energy, None, given)

    def impact(self, motion: Motion, persistent: Manifolds, colliding: Manifolds, h: float) -> ImpulseSolution:
        """Return the state at the end of a motion over h, s, with persistent contacts and an impact at its end.

        The engine refuses drives and joints with the detections that solve impacts one by one. Rolling resistance acts
        in persistent contacts only.
        """
        through = self.solve(motion, persistent, h)
        after, impulse = through.after.copy(), np.zeros((colliding.size, 2))
        bounce = self.bounce(colliding, after[1])
        self._resolve(colliding, bounce, through.after[1], after[1], impulse, until_converged=True)
        return through._replace(after=after, impact=Impact(colliding, impulse, bounce.kick_energy))

    def correct(self, solution: ImpulseSolution, h: float) -> None:
        """Find the velocities that correct overlap in the next step; store the impulses of this step, h in s."""
        contacts, memory = solution.contacts, self._memory
        if memory.has_pseudo_velocity:
            memory.has_pseudo_velocity = False
            memory.pseudo_velocity[:] = 0.0
        memory.key, memory.impulse, memory.h = contacts.key, solution.impulse, h
        memory.rolling = np.empty(0) if solution.rolling is None else solution.rolling
        if len(contacts.key):
            memory.key = contacts.key.copy()
            target = self.correction_rate(h) * np.minimum(contacts.separation + self._slop, 0.0)
            memory.has_pseudo_velocity = bool(target.any())
            if memory.has_pseudo_velocity:
                self._work["contact_iterations"] += contacts.size * self._iterations
                total = np.zeros_like(target)
                solve_overlaps(
                    contacts, target, memory.pseudo_velocity, *self._inverse_overlap, total, self._iterations
                )

    def correction_rate(self, h: float) -> float:
        """Return the factor, 1/s, from a (negative) separation to the rate at which a substep of h, s, corrects it."""
        return float(-(1.0 - self._bias**h) / h)

    @property
    def max_contacts(self) -> int:
        """Largest number of contacts in a substep: with more it takes too long."""
        return self._max_work // self._iterations

    @property
    def is_plain(self) -> bool:
        """Whether there are only contacts by Newton's law of constant restitution, and joints by impulses."""
        has_other_methods = self._position_joints is not None or self._dissipative
        return not has_other_methods and self._rebound_model is None and self._rolling_model is None

    def finish(self, after: State) -> State:
        """Return the state with which the next step begins."""
        return after

    def remove_stop_rates(self, rates: FloatArray) -> FloatArray:
        """Return rates (N, D) at the end of a motion without the parts that stops will remove; here there are none."""
        return rates

    def approach(self, contacts: Manifolds, velocity: FloatArray) -> FloatArray:
        """Return the normal velocity of each contact at velocities (N, D), (K,) m/s: negative if it closes."""
        out = np.empty(contacts.size)
        approach(contacts, velocity, self._spin(velocity), out)
        return out

    def bounce(self, contacts: Manifolds, velocity: FloatArray) -> Rebound:
        """Return the restitution targets of contacts at velocities (N, D)."""
        if self._rebound_model is not None:
            return self._rebound_model.bounce(contacts, self.approach(contacts, velocity))
        speed = np.empty(contacts.size)
        rebound_speeds(contacts, velocity, self._spin(velocity), self._restitution, speed)
        return Rebound(speed, None)

    def _solve(
        self,
        contacts: Manifolds,
        bounce: FloatArray,
        velocity: FloatArray,
        impulse: FloatArray,
        with_joints: bool = False,
    ) -> None:
        """Change velocities (N, D) and impulses (K, 2), N·s, by passes over contacts and, if `with_joints`, joints.

        Args:
            contacts: K contacts.
            bounce: (K,) m/s, restitution targets as in `Rebound.speed`.
            velocity: (N, D).
            impulse: (K, 2) N·s, initial impulses.
            with_joints: whether each pass also solves the joints.

        Raises:
            Exhaustion: it would take too many passes over contacts.
        """
        passes, rows = self._iterations, None
        if contacts.size * passes > self._max_work:
            work = contacts.size * passes * self._substeps
            raise Exhaustion(f"a step of {contacts.size:,} contacts takes too long; {STEP_WORK.remedy(work)}")
        self._work["contact_iterations"] += contacts.size * passes
        if self._velocity_joints is not None and with_joints:
            self._work["joint_iterations"] += self._velocity_joints.visits_per_step
            rows = self._velocity_joints.rows
        self.iterate(contacts, bounce, rows, velocity, impulse)

    def iterate(
        self,
        contacts: Manifolds,
        bounce: FloatArray,
        rows: VelocityConstraints | None,
        velocity: FloatArray,
        impulse: FloatArray,
    ) -> None:
        """Iterate over contacts, their rolling resistance and rows of joints; other arguments are those of `_solve`."""
        if rows is None and not len(self._rolling.reach):
            solve_velocities(
                contacts, bounce, velocity, self._spin(velocity), *self._inverse, impulse, self._iterations
            )
        else:
            rows = self._no_rows if rows is None else rows
            own = velocity, *self._inverse, impulse, self._iterations
            solve_together(contacts, bounce, rows, NO_STOPS, self._rolling, *own)

    def _solve_until_converged(
        self, contacts: Manifolds, bounce: FloatArray, velocity: FloatArray, impulse: FloatArray
    ) -> None:
        """Change velocities and impulses as `_solve` does, until a pass changes nothing; contacts only.

        A single contact takes one pass. The two corners of a box that lands flat take more passes, the taller it is.
        """
        if contacts.size == 1:
            self._solve(contacts, bounce, velocity, impulse)
            return
        spin = self._spin(velocity)
        warm_start_contacts(contacts, velocity, spin, *self._inverse, impulse)
        for _ in range(min(MAX_IMPACT_PASSES, max(self._max_work // max(contacts.size, 1), 1))):
            before = impulse.copy()
            solve_contacts_once(contacts, bounce, velocity, spin, *self._inverse, impulse)
            self._work["contact_iterations"] += contacts.size
            if np.abs(impulse - before).max(initial=0.0) <= CONVERGED * np.abs(impulse).max(initial=0.0):
                break

    def _resolve(
        self,
        contacts: Manifolds,
        bounce: Rebound,
        start: FloatArray,
        velocity: FloatArray,
        impulse: FloatArray,
        with_joints: bool = False,
        until_converged: bool = False,
    ) -> None:
        """Change velocities and impulses as `_solve` or `_solve_until_converged` does, by the chosen law of impact.

        Args:
            contacts: the contacts.
            bounce: restitution targets.
            start: (N, D) velocities at the beginning of the substep, the reference of the energy.
            velocity: (N, D), changed.
            impulse: (K, 2) N·s, initial impulses, changed.
            with_joints: whether each pass also solves the joints.
            until_converged: whether to iterate until nothing changes.
        """
        limits_energy = self._dissipative and contacts.size > 0
        kicked, warm = (velocity.copy(), impulse.copy()) if limits_energy else (velocity, impulse)
        if until_converged:
            self._solve_until_converged(contacts, bounce.speed, velocity, impulse)
        else:
            self._solve(contacts, bounce.speed, velocity, impulse, with_joints)
        if limits_energy:
            self._limit_energy(contacts, bounce, start, kicked, warm, velocity, impulse)

    def _limit_energy(
        self,
        contacts: Manifolds,
        bounce: Rebound,
        start: FloatArray,
        kicked: FloatArray,
        warm: FloatArray,
        velocity: FloatArray,
        impulse: FloatArray,
    ) -> None:
        """Reduce the restitution of groups of bodies whose contacts would add energy.

        Args:
            contacts: the contacts.
            bounce: restitution targets.
            start: (N, D) velocities at the beginning of the substep.
            kicked: (N, D) velocities before the solution by Newton's law; overwritten.
            warm: (K, 2) N·s, initial impulses of that solution; overwritten.
            velocity: (N, D) of the solution, changed.
            impulse: (K, 2) N·s of the solution, changed.
        """
        spin, works = self._spin, GroupWork(contacts, *self._inverse)
        kicks = np.zeros(contacts.size) if bounce.kick_energy is None else bounce.kick_energy

        def work(impulses: FloatArray, rates: FloatArray) -> FloatArray:
            return works.work(impulses, rates, spin(rates))[0]

        def kicked_by(impulses: FloatArray) -> FloatArray:
            return np.asarray(np.bincount(works.of_contact, impulses[:, 0] * kicks, len(works.group)), np.float64)

        given, turnover = works.work(impulse, mean := 0.5 * (start + velocity), spin(mean))
        gains = given - kicked_by(impulse) > TURNOVER_ROUNDING * turnover
        if not gains.any():
            return
        free = kicked.copy()
        self._solve_until_converged(contacts, np.zeros(contacts.size), kicked, warm)
        # Unconverged passes, and gravity's kick within the substep, can add energy at s = 0 too.
        minimum = largest_fractions(0.0 * given, work(warm, 0.5 * (start + free)), work(warm, 0.5 * (kicked - free)))
        minimum = np.where(gains, minimum, 1.0)
        warm *= minimum[works.of_contact][:, None]
        kicked[:] = free + minimum[works.group][:, None] * (kicked - free)
        impulses, change = impulse - warm, velocity - kicked
        fraction = largest_fractions(
            work(warm, 0.5 * (start + kicked)) - kicked_by(warm),
            work(impulses, 0.5 * (start + kicked)) + work(warm, 0.5 * change) - kicked_by(impulses),
            work(impulses, 0.5 * change),
        )
        fraction = np.where(gains, fraction, 1.0)
        of_contact, of_body = fraction[works.of_contact][:, None], fraction[works.group][:, None]
        cut = of_contact[:, 0] < 1.0
        impulse[cut] = (warm + of_contact * impulses)[cut]
        cut = of_body[:, 0] < 1.0
        velocity[cut] = (kicked + of_body * change)[cut]

    def _spin(self, velocity: FloatArray) -> FloatArray:
        """Return the spins (N,) of rates (N, D); zeros if nothing turns."""
        return (velocity if velocity.shape[1] == 3 else self._no_spin)[:, 2]
