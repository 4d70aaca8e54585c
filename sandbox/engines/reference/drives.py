"""Driven bodies: motors, flippers and plungers in the solver.

In states of the solver, the position of a body on a hinge is that of the hinge, which cannot move. The anchors of its
contacts start there, and its moment of inertia is that about the hinge.

The stops of a hinge are one-sided constraints. If all contacts of a body press it onto its stop as well, it is
immovable in that substep, because contacts and stop, solved alternately, would not converge in 10 iterations. A body
moved by a stroke or a plunger is kinematic, and has its planned velocity during the whole substep. Bodies that are
kinematic by themselves keep their velocity, or have the one that leads to the next pose on their path.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import NamedTuple, Self

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.common.motors import (
    HingeDrive,
    HingeState,
    advance_plunger,
    centre_about_pivot,
    gravity_torque,
    hinge_to_centre,
    plunger_state,
    stroke_direction,
    turn_at_rate,
)
from sandbox.engines.reference.collision import CollisionPipeline
from sandbox.engines.reference.integrators import Inputs, State, transition
from sandbox.engines.reference.joint_data import select_joints
from sandbox.engines.reference.joint_rows import VelocityConstraints, make_velocity_constraints
from sandbox.engines.reference.joints import JointSolver
from sandbox.engines.reference.manifold import Manifolds
from sandbox.engines.reference.sequential_impulses import AngularStops, RollingRows, solve_together
from sandbox.engines.reference.velocity_solver import ContactMemory, ImpulseSolver, Motion, SpringContacts
from sandbox.scene.compile.drives import Mount, about_hinge
from sandbox.scene.compile.paths import PathMotion
from sandbox.scene.description.base import Point
from sandbox.scene.description.forces import PlungerDrive, StrokeDrive, TorqueDrive
from sandbox.scene.description.world import Settings

STILL = 1e-9
"""rad/s, rounding error of the angular velocity of a body pressed onto its stop"""


class DrivenBody(ABC):
    """Base class of driven bodies. A substep calls `plan`, `begin`, `place`, and after the contacts `commit`.

    In states, positions are those of centres of mass, except of bodies on a hinge.
    """

    def __init__(self, store: BodyStore, index: int) -> None:
        self.index = index
        self.mass, self.moment = float(store.bodies.mass[index]), float(store.bodies.moment[index])
        """mass, kg, and moment of inertia about the point whose position is in states, kg·m²"""
        self.gravity: Point = store.scene.world.gravity

    @abstractmethod
    def plan(self, x: State, h: float) -> None:
        """Plan the motion of the body from a state (2, N, 3) over h, s, without contacts."""

    @abstractmethod
    def begin(self, x: State) -> None:
        """Write into a state the velocity that the body has during the planned substep."""

    def use_mean_velocity(self, x: State, h: float) -> None:
        """Write into a state the constant velocity that leads to the end of the planned substep of h, s."""
        n = self.index
        end = np.zeros_like(x)
        self.place(end)
        x[1, n] = (end[0, n] - x[0, n]) / h

    @abstractmethod
    def place(self, moved: State) -> None:
        """Write the end of the planned substep into a state."""

    @abstractmethod
    def commit(self, after: State) -> None:
        """Commit the planned substep, after its contacts are solved."""

    def centre(self, pose: FloatArray, rate: FloatArray) -> tuple[Point, Point]:
        """Return position, m, and velocity, m/s, of the centre of mass for poses and rates (N, 3)."""
        x, y = pose[self.index, :2].tolist()
        vx, vy = rate[self.index, :2].tolist()
        return (x, y), (vx, vy)

    def kinetic(self, rate: FloatArray) -> float:
        """Return the kinetic energy of the body, J, for rates (N, 3)."""
        vx, vy, spin = rate[self.index].tolist()
        return 0.5 * float(self.mass * (vx * vx + vy * vy) + self.moment * spin * spin)

    def height(self, pose: FloatArray) -> float:
        """Return the potential energy in gravity, J, up to a constant."""
        return -self.mass * float(np.dot(self.gravity, pose[self.index, :2]))


class MountedBody(DrivenBody):
    """A driven body with a drive that an action sets."""

    def __init__(self, store: BodyStore, index: int, mount: Mount) -> None:
        super().__init__(store, index)
        self.mount = mount
        self._drives: FloatArray = store.drives

    @property
    def state(self) -> FloatArray:
        """(3,) of its drive, as in a frame; written to.

        It is looked up each time: the copy of a stored view would not be a view of the copied drives.
        """
        state: FloatArray = self._drives[self.mount.number]
        return state


class HingedBody(MountedBody):
    """A driven body that turns about a hinge, whose position is in states."""

    def __init__(self, store: BodyStore, index: int, mount: Mount) -> None:
        super().__init__(store, index, mount)
        assert isinstance(mount.drive, TorqueDrive | StrokeDrive)
        self._origin = mount.drive.pivot
        self.moment = about_hinge(mount, self.mass, self.moment)

    def use_hinges(self, x: State) -> None:
        """Replace the centre of mass by the hinge in a state."""
        n = self.index
        x[0, n, 0], x[0, n, 1] = self._origin
        x[1, n, 0] = x[1, n, 1] = 0.0

    def centre(self, pose: FloatArray, rate: FloatArray) -> tuple[Point, Point]:
        """Return position, m, and velocity, m/s, of the centre of mass for poses and rates (N, 3)."""
        return centre_about_pivot(
            self.mount.hinge, self._origin, float(pose[self.index, 2]), float(rate[self.index, 2])
        )

    def kinetic(self, rate: FloatArray) -> float:
        """Return the kinetic energy of the body, J, for rates (N, 3)."""
        return 0.5 * self.moment * float(rate[self.index, 2]) ** 2

    def height(self, pose: FloatArray) -> float:
        """Return the potential energy in gravity, J, up to a constant."""
        x, y = hinge_to_centre(self.mount.hinge, float(pose[self.index, 2]))
        return -self.mass * (self.gravity[0] * x + self.gravity[1] * y)


class HingeMotor(HingedBody):
    """A body on a hinge, driven by a torque."""

    planned: HingeState
    weight_torque: float
    """torque of the weight in the planned substep, N·m"""

    def __init__(self, store: BodyStore, index: int, mount: Mount) -> None:
        super().__init__(store, index, mount)
        assert isinstance(mount.drive, TorqueDrive)
        self._law = HingeDrive(mount.drive, self.moment)
        self._h = 0.0
        self._planned = 0.0, 0.0, 0.0, 0.0  # angle, spin, torque of the drive, its level
        self._last_stop = 0, 0.0, 0.0  # of the last substep: stop, impulse in N·m·s, duration in s
        self._low, self._high = sorted(mount.drive.stops)

    @property
    def direction(self) -> float:
        """Direction in which the planned substep presses it onto a stop: 1, −1, or 0 for none."""
        return self.planned.stop * self._law.sense

    @property
    def stop_impulse(self) -> float:
        """Initial impulse of the stop, N·m·s: that of the last substep, scaled down if this one is shorter."""
        at, impulse, h = self._last_stop
        return impulse * min(self._h / h, 1.0) if at and at == self.planned.stop else 0.0

    def store_stop_impulse(self, given: float) -> None:
        """Store the impulse of the stop, N·m·s, for warm starting."""
        self._last_stop = self.planned.stop, given, self._h

    def copy_stop_impulse(self, old: "HingeMotor") -> None:
        """Take over the impulse of the stop from another body object."""
        self._last_stop = old._last_stop

    def plan(self, x: State, h: float) -> None:
        """Plan the motion under the ramped torque, between the stops."""
        level, torque, _ = self.state.tolist()
        angle, spin = float(x[0, self.index, 2]), float(x[1, self.index, 2])
        self.weight_torque = gravity_torque(self.mount.hinge, angle, self.mass, self.gravity)
        self._planned = angle, spin, torque, level
        self.planned, self._h = self._law.turn(*self._planned, self.weight_torque, h), h

    def begin(self, x: State) -> None:
        """Do nothing: the torque is a force, and the velocity at the start of the substep is the present one."""

    def place(self, moved: State) -> None:
        """Write the end of the planned substep; the stop later removes the angular velocity that presses onto it."""
        n, planned = self.index, self.planned
        self.use_hinges(moved)
        moved[0, n, 2] = planned.angle
        moved[1, n, 2] = planned.spin + planned.press * self._h / self.moment

    @property
    def is_at_stop(self) -> bool:
        """Whether the body is pressed onto a stop during the whole planned substep."""
        return self.planned.stop != 0 and not self._planned[1] and self._planned[0] == self.planned.angle

    def apply_spring_torque(self, spin_change: float) -> bool:
        """Add a change of angular velocity by springs, rad/s, to the planned substep as a torque.

        Return whether a body at rest on a stop remains pressed onto it.
        """
        stood = self.is_at_stop
        planned = self._law.turn(*self._planned, self.weight_torque + self.moment * spin_change / self._h, self._h)
        self.planned = planned._replace(press=0.0)
        return stood and self.is_at_stop

    def commit(self, after: State) -> None:
        """Limit the angle to the stops, also after contacts, and set a velocity of rounding error at a stop to 0."""
        n = self.index
        after[0, n, 2] = min(max(after[0, n, 2], self._low), self._high)
        if self.planned.stop and abs(after[1, n, 2]) <= STILL:
            after[1, n, 2] = 0.0
        self.state[1] = self.planned.torque


class KinematicHinge(HingedBody):
    """A body that turns about a hinge at a prescribed rate."""

    def plan(self, x: State, h: float) -> None:
        """Plan a rotation at the rate."""
        assert isinstance(self.mount.drive, StrokeDrive)
        self._planned = turn_at_rate(self.mount.drive, float(self.state[0]), float(x[0, self.index, 2]), h)

    def begin(self, x: State) -> None:
        """Write the rate, from the beginning of the substep."""
        x[1, self.index, 2] = self._planned.spin

    def place(self, moved: State) -> None:
        """Write the end of the planned substep."""
        self.use_hinges(moved)
        moved[0, self.index, 2], moved[1, self.index, 2] = self._planned.angle, self._planned.spin

    def commit(self, after: State) -> None:
        """Set the rate to 0 at a stop."""
        if self._planned.arrives:
            after[1, self.index, 2] = 0.0


class DrivenPlunger(MountedBody):
    """A body that is drawn back along a line and driven forward by a spring."""

    def __init__(self, store: BodyStore, index: int, mount: Mount) -> None:
        super().__init__(store, index, mount)
        assert isinstance(mount.drive, PlungerDrive)
        self._home, self._drive, self._direction = mount.home, mount.drive, stroke_direction(mount.drive)

    def plan(self, x: State, h: float) -> None:
        """Plan the motion by the hand or by the spring, depending on the level."""
        del x
        level, pull, rate = self.state.tolist()
        self._planned = advance_plunger(self._drive, level, pull, rate, h)

    def begin(self, x: State) -> None:
        """Write the velocity at the end of the substep, which it has throughout."""
        x[1, self.index, :2] = self._centre_state()[1]

    def _centre_state(self) -> tuple[Point, Point]:
        return plunger_state(self._home, self._direction, self._planned.pull, self._planned.rate)

    def place(self, moved: State) -> None:
        """Write the end of the planned substep."""
        n = self.index
        moved[0, n, :2], moved[1, n, :2] = self._centre_state()
        moved[1, n, 2] = 0.0

    def commit(self, after: State) -> None:
        """Set the velocity to 0 at the target."""
        rate = 0.0 if self._planned.arrives else self._planned.rate
        if not rate:
            after[1, self.index, :2] = 0.0
        self.state[1:] = self._planned.pull, rate


class KinematicBody(DrivenBody):
    """A body that keeps its velocity and angular velocity."""

    def plan(self, x: State, h: float) -> None:
        """Plan a motion at the present velocities."""
        self._rate = x[1, self.index].copy()
        self._end = x[0, self.index] + h * self._rate

    def begin(self, x: State) -> None:
        """Do nothing: the body has its velocities already."""

    def place(self, moved: State) -> None:
        """Write the end of the planned substep."""
        moved[0, self.index], moved[1, self.index] = self._end, self._rate

    def commit(self, after: State) -> None:
        """Write the end again, without rounding by the solver."""
        self.place(after)


class PathBody(KinematicBody):
    """A kinematic body on a path: in each substep it has the constant velocity that leads to its pose at the end."""

    time = 0.0
    """start of the substep that is planned next, s"""

    def __init__(self, store: BodyStore, index: int, motion: PathMotion) -> None:
        super().__init__(store, index)
        self._motion, self._began = motion, store.setup.time

    def plan(self, x: State, h: float) -> None:
        """Plan a motion to the pose at the end of the substep."""
        self._end = np.asarray(self._motion.pose(self._began + self.time + h))
        self._rate = (self._end - x[0, self.index]) / h

    def begin(self, x: State) -> None:
        """Write the velocities of the substep."""
        x[1, self.index] = self._rate


def make_driven_body(store: BodyStore, index: int, mount: Mount) -> DrivenBody:
    """Return the body with an index, which has a drive."""
    kinds: dict[str, type[HingeMotor] | type[KinematicHinge] | type[DrivenPlunger]]
    kinds = {"torque": HingeMotor, "stroke": KinematicHinge, "plunger": DrivenPlunger}
    return kinds[mount.drive.kind](store, index, mount)


def make_kinematic_body(store: BodyStore, index: int) -> KinematicBody:
    """Return the body with an index, which is kinematic by itself."""
    motion = store.bodies.paths.get(index)
    return KinematicBody(store, index) if motion is None else PathBody(store, index, motion)


class DriveWork(NamedTuple):
    """Energy that a substep gave to driven bodies, J."""

    gained: float
    """increase of kinetic energy, and of the potential energy of kinematic bodies"""
    weight: float
    """work of the weight of bodies on motor hinges, as the step computes it"""
    potential_change: float
    """increase of the potential energy of bodies on motor hinges"""


class Drives:
    """All present driven bodies of a simulation."""

    def __init__(self, store: BodyStore) -> None:
        self._store = store
        kinematic = np.flatnonzero(store.bodies.kinematic & store.present).tolist()
        self.driven_bodies: list[DrivenBody] = [
            *(make_driven_body(store, index, mount) for index, mount in store.mounts.items()),
            *(make_kinematic_body(store, index) for index in kinematic),
        ]
        self._on_paths = [driven for driven in self.driven_bodies if isinstance(driven, PathBody)]
        self._hinges = [driven for driven in self.driven_bodies if isinstance(driven, HingeMotor)]
        self._indices: IntArray = np.asarray([driven.index for driven in self.driven_bodies], np.int64)
        self._turning = not store.kinematic[self._indices].all()
        self.inverse_moment_overlap: FloatArray = store.inverse_moment.copy()
        """(N,) 1/(kg·m²), inverse moments for the correction of overlap: 0 for driven bodies"""
        self.inverse_moment_overlap[self._indices] = 0.0
        self.inverse_moment_forces: FloatArray = store.inverse_moment
        """(N,) 1/(kg·m²), inverse moments for forces in the planned substep: 0 for a body pressed onto a stop"""
        self._no_rows: VelocityConstraints = make_velocity_constraints(
            select_joints(store.setup.joints, among=np.empty(0, np.int64))
        )

    @classmethod
    def of(cls, store: BodyStore, old: Self | None) -> Self | None:
        """Return the drives of the bodies in a body store, with the stop impulses of old ones, or None."""
        if not store.driven.any():
            return None
        new = cls(store)
        stopped = {} if old is None else {hinge.index: hinge for hinge in old._hinges}
        for hinge in new._hinges:
            if hinge.index in stopped:
                hinge.copy_stop_impulse(stopped[hinge.index])
        return new

    def use_hinges(self, x: State) -> None:
        """Replace centres of mass by hinges in a state (2, N, 3)."""
        for driven in self.driven_bodies:
            if isinstance(driven, HingedBody):
                driven.use_hinges(x)

    def write_centres(self, x: State) -> None:
        """Write the centres of mass of a state into the body store."""
        store = self._store
        for driven in self.driven_bodies:
            store.position[driven.index], store.velocity[driven.index] = driven.centre(*x)

    def centres(self, x: State) -> FloatArray:
        """Return the centres of mass of all bodies in a state, (N, 2) m."""
        position = x[0, :, :2].copy()
        for driven in self.driven_bodies:
            position[driven.index] = driven.centre(*x)[0]
        return position

    def begin(self, x: State, time: float, h: float) -> State:
        """Plan a substep from a state at a time, s, over h, s.

        Return the state with the velocities of kinematic bodies during it.
        """
        self.start = x.copy()
        """(2, N, 3) state at the beginning of the planned substep"""
        for on_path in self._on_paths:
            on_path.time = time
        for driven in self.driven_bodies:
            driven.plan(x, h)
            driven.begin(self.start)
        return self.start

    def advance_with_springs(
        self, x: State, time: float, h: float, advance: Callable[[State], tuple[State, SpringContacts]]
    ) -> tuple[State, SpringContacts]:
        """Return the state after h, s, under contacts that act as forces during the whole substep, and these contacts.

        A body on a stop remains at rest if the contacts press it onto the stop, or away from it with a smaller torque
        than its drive. Other bodies on hinges move at a constant rate, changed by the contacts; their drives apply the
        stops.

        Args:
            x: (2, N, 3) the state.
            time: s, of the state.
            h: s.
            advance: returns the end state for a start state, and the contacts.
        """
        self.begin(x, time, h)
        for driven in self.driven_bodies:
            driven.use_mean_velocity(self.start, h)
        self.inverse_moment_forces = self._store.inverse_moment.copy()
        standing = [hinge for hinge in self._hinges if hinge.is_at_stop]
        self.inverse_moment_forces[[hinge.index for hinge in standing]] = 0.0
        while True:  # each pass releases at least one of them
            moved, springs = advance(self.start)
            released = [each for each in standing if not each.apply_spring_torque(self._spin_change(each, *springs))]
            if not released:
                break
            for hinge in released:
                hinge.plan(x, h)
                self.inverse_moment_forces[hinge.index] = 1.0 / hinge.moment
            standing = [hinge for hinge in standing if hinge not in released]
            for hinge in standing:
                hinge.plan(x, h)
        for hinge in self._hinges:
            if hinge not in standing:
                n = hinge.index
                hinge.apply_spring_torque(float(moved[1, n, 2] - self.start[1, n, 2]))
        return moved, springs

    def _spin_change(self, hinge: HingeMotor, contacts: Manifolds, impulse: FloatArray) -> float:
        """Return the change of angular velocity, rad/s, of a body on a hinge by impulses (K, 2), N·s."""
        turn = 0.0
        for body, side, sign in ((contacts.first, 0, -1.0), (contacts.second, 1, 1.0)):
            which = body == hinge.index
            turn -= float(contacts.rn[which, side] @ impulse[which, 1])
            turn -= sign * float(contacts.rt[which, side] @ impulse[which, 0])
        return turn / hinge.moment

    def place(self, moved: State) -> None:
        """Write the end of the planned substep into a state."""
        for driven in self.driven_bodies:
            driven.place(moved)

    def remove_stop_rates(self, rates: FloatArray) -> FloatArray:
        """Return rates (N, 3) after the planned substep, without the parts that press onto stops."""
        rates = rates.copy()
        for hinge in self._hinges:
            rates[hinge.index, 2] = hinge.planned.spin
        return rates

    def solve(
        self,
        contacts: Manifolds,
        bounce: FloatArray,
        rows: VelocityConstraints | None,
        rolling: RollingRows,
        velocity: FloatArray,
        impulse: FloatArray,
        iterations: int,
    ) -> None:
        """Solve contacts, joints and stops together; the arguments are those of `solve_together`."""
        inverse_moment, stopped = self._store.inverse_moment.copy(), list[HingeMotor]()
        for hinge in self._hinges:
            if hinge.direction and _press_onto_stop(contacts, hinge.index, hinge.direction):
                inverse_moment[hinge.index] = velocity[hinge.index, 2] = 0.0
            elif hinge.direction:
                stopped.append(hinge)
        stops = AngularStops(
            np.asarray([hinge.index for hinge in stopped], np.int64),
            np.asarray([hinge.direction for hinge in stopped]),
            np.asarray([hinge.stop_impulse for hinge in stopped]),
        )
        rows = self._no_rows if rows is None else rows
        inverse = self._store.inverse_mass, inverse_moment
        solve_together(contacts, bounce, rows, stops, rolling, velocity, *inverse, impulse, iterations)
        given = dict(zip(stops.body.tolist(), stops.impulse.tolist(), strict=True))
        for hinge in self._hinges:
            hinge.store_stop_impulse(given.get(hinge.index, 0.0))

    def commit(self, after: State) -> None:
        """Commit the planned substep."""
        for driven in self.driven_bodies:
            driven.commit(after)

    def impulse_work(self, contacts: Manifolds, impulse: FloatArray, mean: FloatArray) -> float:
        """Return the work of impulses (K, 2), N·s, on driven bodies at mean rates (N, 3), J."""
        if not contacts.size:
            return 0.0
        along, across = impulse.T
        impulse_xy = contacts.normal * along[:, None] + _left(contacts.normal) * across[:, None]
        work = 0.0
        for body, side, sign in ((contacts.first, 0, -1.0), (contacts.second, 1, 1.0)):
            which = np.isin(body, self._indices)
            rate = mean[body[which]]
            lever = contacts.rn[which, side] * across[which] + sign * contacts.rt[which, side] * along[which]
            work += sign * float((impulse_xy[which] * rate[:, :2]).sum()) - float(lever @ rate[:, 2])
        return work

    def work(self, before: State, after: State, h: float) -> DriveWork:
        """Return the energy that a substep of h, s, between two states gave to driven bodies."""
        gained = weight = potential_change = 0.0
        for driven in self.driven_bodies:
            gained += driven.kinetic(after[1]) - driven.kinetic(before[1])
            rise = driven.height(after[0]) - driven.height(before[0])
            if isinstance(driven, HingeMotor):
                n = driven.index
                weight += driven.weight_torque * h * 0.5 * float(before[1, n, 2] + after[1, n, 2])
                potential_change += rise
            else:
                gained += rise
        return DriveWork(gained, weight, potential_change)


class DrivenSolver(ImpulseSolver):
    """Sequential impulses with driven bodies: drives plan the motion, and stops are solved together with contacts.

    Args:
        drives: of the driven bodies.
        store: as in `ImpulseSolver`, as the following arguments.
        settings: likewise.
        pipeline: likewise.
        joints: likewise.
        memory: likewise.
    """

    def __init__(
        self,
        drives: Drives,
        store: BodyStore,
        settings: Settings,
        pipeline: CollisionPipeline,
        joints: JointSolver | None,
        memory: ContactMemory,
    ) -> None:
        super().__init__(store, settings, pipeline, joints, memory, drives.inverse_moment_overlap, has_constraints=True)
        self._drives = drives

    def integrate(self, x: State, forces: Inputs, time: float, h: float) -> Motion:
        """Return the motion from a state at a time, s, over h, s, without contacts."""
        start = self._drives.begin(x, time, h)
        free = self._integrator.step(transition, time, start, forces, h)
        self._drives.place(free)
        return self.complete_motion(start, free, h)

    def finish(self, after: State) -> State:
        """Return the state with which the next step begins, with driven bodies between their stops."""
        after = after.copy()
        self._drives.commit(after)
        return after

    def remove_stop_rates(self, rates: FloatArray) -> FloatArray:
        """Return rates (N, 3) at the end of a motion without the parts that stops will remove."""
        return self._drives.remove_stop_rates(rates)

    def iterate(
        self,
        contacts: Manifolds,
        bounce: FloatArray,
        rows: VelocityConstraints | None,
        velocity: FloatArray,
        impulse: FloatArray,
    ) -> None:
        """Iterate over contacts, joints and stops; the arguments are those of `ImpulseSolver.iterate`."""
        self._drives.solve(contacts, bounce, rows, self._rolling, velocity, impulse, self._iterations)


def _left(normal: FloatArray) -> FloatArray:
    """Return normals (K, 2) turned left."""
    return np.column_stack((-normal[:, 1], normal[:, 0]))


def _press_onto_stop(contacts: Manifolds, index: int, direction: float) -> bool:
    """Return whether a body has contacts, all of which turn it in a direction, or not at all."""
    first, second = contacts.first == index, contacts.second == index
    if not (first.any() or second.any()):
        return False
    return bool((direction * contacts.rt[first, 0] >= 0.0).all() and (direction * contacts.rt[second, 1] <= 0.0).all())
