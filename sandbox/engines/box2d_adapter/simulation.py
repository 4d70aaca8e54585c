"""Box2DSimulation: a scene running in a Box2D world."""

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from sandbox.action import Action
from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.box2d_adapter.bodies import BodyState, ZonedBox2DBodies, far_away, make_store
from sandbox.engines.box2d_adapter.drives import KinematicDrives, KinematicPaths
from sandbox.engines.box2d_adapter.joints import WorldJoints
from sandbox.engines.box2d_adapter.limits import FARTHEST_LENGTHS, FASTEST_LENGTHS, MAX_TURN
from sandbox.engines.box2d_adapter.world import Box2DWorld, StateRows
from sandbox.engines.common.actions import apply_action, sets_level
from sandbox.engines.common.base import BEYOND, SteppedSimulation, observe_path
from sandbox.engines.common.body_store import HasBodyStore
from sandbox.engines.common.contact_log import ContactLog, join_batches
from sandbox.engines.common.speed_limits import SpeedLimits
from sandbox.engines.contract import Divergence, Observer, Refusal
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.forces.air import ALL, Air, mean_acceleration
from sandbox.engines.forces.field import ForceField
from sandbox.frame_table import FrameTable
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.fixed import Plane, PlaneReach, Post, Wall
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Contacts, Frame

MAX_BATCH = 256
"""Steps that are made before their states are converted, which spreads the cost of numpy calls"""

BATCH_ROWS = 1 << 16
"""States of bodies in such a batch"""

SPIN_ROUNDING = 1e-5
"""relative, rounding of Box2D's clamped spins"""


class Box2DSimulation(HasBodyStore, SteppedSimulation):
    """A running scene. States are read from Box2D after every step; contacts come from its events.

    A step finds contacts at its start and before anything moves. They are those at the end of the step before, to which
    the time of the contact log refers.
    """

    uncopied: ClassVar[str | None] = (
        "Box2D cannot copy the state of its solver; a snapshot needs the engine 'reference' or 'exact'"
    )

    @property
    def makes_whole_steps(self) -> bool:
        """True: Box2D applies the impulses that it keeps in full, however much shorter a step is than the last one."""
        return True

    def __init__(self, setup: Setup, settings: Settings) -> None:
        """Start from a setup.

        Raises:
            TooManyWorldsError: Box2D has no room for another world.
        """
        super().__init__(settings)
        self._store = make_store(setup, settings)
        self._zoned = self._store if isinstance(self._store, ZonedBox2DBodies) else None
        self._world = Box2DWorld(self._store, settings, setup.plane_reach)
        self._joints = WorldJoints(self._world, self._store)
        self._drives = KinematicDrives(self._store, self._world) if setup.scene.drives else None
        self._paths = KinematicPaths(self._store, self._world) if setup.bodies.paths else None
        self._field = ForceField(self._store)
        self._largest_spin = MAX_TURN * (1.0 - SPIN_ROUNDING) / settings.h
        self._log: ContactLog | None = None
        self._has_entries = False
        """whether the last record of the log has entries of zones, which do not last"""
        self._unobserved: tuple[float, FloatArray, FloatArray] | None = None
        """start time of the last step, s, and positions before and after it, which the next step shows the observer"""
        self._set_air(self._store.scene)

    @property
    def plane_reach(self) -> PlaneReach | None:
        """Present extent of half-planes as (x, y, distance), m; None without any."""
        return self._world.plane_reach

    @property
    def work(self) -> Mapping[str, int]:
        """Work counters since the start."""
        return {"substeps": self.substeps}

    def _set_air(self, scene: Scene) -> None:
        """Apply gravity, drag and damping of a scene.

        Box2D has drag in still air, and damping, also for each body. With wind, quadratic drag or lift, the air is a
        force, constant during a substep.
        """
        air = Air.of(scene.world, self._store.bodies, self._store.present)
        self._air = air._replace(damps_bodies=False)
        self._world.set_gravity(scene.world.gravity)
        is_still = air.is_linear and not any(scene.world.wind)
        self._has_air_forces = air.flows and not is_still
        self._limits = SpeedLimits.of(self._store.bodies, self._store.present)
        self._damping = air.linear_drag * is_still + air.damping_rate, air.damping_rate
        self._world.set_damping(*self._damping)

    @property
    def _has_varying_forces(self) -> bool:
        """Whether each substep has to be a step of Box2D.

        Forces depend on the state, or there are drives, motors along an axis, paths, zones or limits of speeds.
        """
        forces = self._has_air_forces or self._joints.has_springs or not self._field.empty
        forces = forces or self._field.tyres is not None
        moves = self._joints.has_linear_motors or self._drives is not None or self._paths is not None
        return forces or moves or self._zoned is not None or self._limits is not None

    @property
    def _has_forces(self) -> bool:
        store = self._store
        return self._has_varying_forces or bool(store.force.any() or store.torque.any())

    def _apply_forces(self, time: float, length: float) -> None:
        """Apply the forces of a step of Box2D that starts at a time, s, and takes a length, s.

        They are constant forces, attraction, thrusts, springs, liquids, the air and tyres.
        """
        store, air = self._store, self._air
        force, torque = store.force.copy(), store.torque.copy()
        mass, moving = store.bodies.mass, store.moving & ~store.kinematic
        gravity = store.gravity
        if gravity.ndim == 2:  # some bodies have that of a zone
            force += np.where(moving[:, None], mass[:, None] * (gravity - store.world_gravity), 0.0)
        if not self._field.empty:
            x = np.zeros((2, len(mass), 3))
            x[0, :, :2], x[0, :, 2] = store.position, store.angle
            acceleration = self._field(time, x)
            force += np.where(moving[:, None], mass[:, None] * acceleration[:, :2], 0.0)
            torque += np.where(moving, store.bodies.moment * acceleration[:, 2], 0.0)
        if self._joints.has_springs:
            self._joints.add_spring_forces(force, torque)
        if self._field.liquids is not None:
            weight = np.where(moving[:, None], mass[:, None] * store.world_gravity, 0.0)
            by_liquids = self._field.liquid_loads((force + weight, torque), length)
            force, torque = force + by_liquids[0], torque + by_liquids[1]
        if self._has_air_forces:
            world_gravity, applied = store.world_gravity, force / mass[:, None]
            state = store.velocity, store.angular_velocity
            mean = mean_acceleration(air, ALL, world_gravity, *state, applied, length)
            force = np.where(moving[:, None], mass[:, None] * (mean - world_gravity), 0.0)
        if self._field.tyres is not None:
            pose, rates = np.column_stack((store.position, store.angle)), self._damped_rates(force, torque, length)
            loads = self._field.tyre_loads(pose, rates, length)
            total = loads.drive + loads.friction
            force[self._field.tyres.bodies] += total[:, :2]
            torque[self._field.tyres.bodies] += total[:, 2]
        if self._limits is not None:  # positions follow the velocities that these forces give
            own = store.world_gravity + force / mass[:, None], torque * store.inverse_moment
            rates = np.column_stack((store.velocity + length * own[0], store.angular_velocity + length * own[1]))
            excess = rates - self._limits.reduced(rates)
            force -= mass[:, None] * excess[:, :2] / length
            torque -= store.bodies.moment * excess[:, 2] / length
        for index in np.flatnonzero((force.any(axis=1) | (torque != 0.0)) & moving).tolist():
            self._world.push(index, force[index], float(torque[index]))

    def _damped_rates(self, force: FloatArray, torque: FloatArray, length: float) -> FloatArray:
        """Return the rates (N, 3), m/s and rad/s, to which forces and torques lead in a step, after damping."""
        store, (linear, angular) = self._store, self._damping
        velocity = store.velocity / (1.0 + length * (linear + store.bodies.linear_damping))[:, None]
        spin = store.angular_velocity / (1.0 + length * (angular + store.bodies.angular_damping))
        velocity = velocity + length * (store.world_gravity + force / store.bodies.mass[:, None])
        return np.column_stack((velocity, spin + length * torque * store.inverse_moment))

    def _make_step(self, part: float) -> None:
        """Advance by a fraction of dt: in one step of Box2D, or in one for each substep if forces vary."""
        substeps = self._settings.substeps
        count = substeps if self._has_varying_forces else 1
        length = part * self._settings.dt / count
        for k in range(count):
            self._step_world(self.time + k * length, length, substeps // count)
        if self._joints.has_breakable:
            self._break_joints((self._steps + part) * self._settings.dt)

    def _step_world(self, time: float, length: float, substeps: int) -> None:
        """Make one step of Box2D from a time, s, over a length, s; record its contacts and show it to the observer."""
        store, world = self._store, self._world
        start = store.position.copy() if self._observer is not None else None
        if self._has_forces:
            self._apply_forces(time, length)
        if self._joints.has_linear_motors:
            self._joints.limit_linear_motors(length)
        if self._drives is not None:
            self._drives.plan(length)
        if self._paths is not None:
            self._paths.plan(time, length)
        rows = world.raw_rows(1)
        changed = world.step(length, substeps, rows, 0)
        world.read(rows, 1, length, substeps)
        if self._limits is not None:
            self._limit_speeds(self._limits)
        if self._drives is not None:
            self._drives.place()
        if self._paths is not None:
            self._paths.place()
        if self._log is not None and (changed or self._has_entries):
            self._log.record(time, world.contact_batch())
            self._has_entries = False
        if self._zoned is not None:
            self._visit_zones(time + length, self._zoned)
        if self._observer is not None and start is not None:
            self._observe_last()
            self._unobserved = time, start, store.position.copy()

    def _limit_speeds(self, limits: SpeedLimits) -> None:
        """Reduce speeds to their limits, in the store and in the world."""
        store = self._store
        rates = np.column_stack((store.velocity, store.angular_velocity))
        reduced = limits.reduced(rates)
        if reduced is not rates:
            store.velocity[:], store.angular_velocity[:] = reduced[:, :2], reduced[:, 2]
            for index in np.flatnonzero((reduced != rates).any(axis=1)).tolist():
                self._world.set_motion(index)

    def _visit_zones(self, time: float, store: ZonedBox2DBodies) -> None:
        """Apply zones to the bodies that have entered or left one, and record the entries at a time, s."""
        if store.detect(store.position):
            before = BodyState.of(store)
            if store.apply_zones():
                self._update_bodies(before)
        entries = store.tracker.drain_entries()
        if self._log is not None and entries is not None:
            self._log.record(time, join_batches(self._world.contact_batch(), entries))
            self._has_entries = True

    def _observe_last(self) -> None:
        """Show the observer the last step but one, with the contacts that were found at its end."""
        if self._unobserved is not None and self._observer is not None and self._log is not None:
            self._observer(*self._unobserved, self._log.pairs())

    def advance(self, steps: int, frames: FrameTable, *, until_event: bool = False) -> None:
        """Advance by at most so many time steps, and record the frames that are due, as `Simulation.advance`.

        Where nothing has to be done between two steps, states are converted for many steps at once.

        Raises:
            Divergence: as `step`.
        """
        store, end = self._store, frames.steps + steps
        frames.prepare(steps, len(self.bodies))
        while frames.steps < end:
            if until_event or self._has_forces or self._joints.has_breakable or store.can_expire:
                super().advance(end - frames.steps, frames, until_event=until_event)
                return
            with self._lock, np.errstate(all="ignore"):
                self._check_running()
                self._advance_batch(end - frames.steps, frames)

    def _advance_batch(self, steps: int, frames: FrameTable) -> None:
        """Make at most so many steps, and record their frames."""
        world, dt, substeps, first = self._world, self._settings.dt, self._settings.substeps, self._steps
        count, observed = min(steps, MAX_BATCH, max(BATCH_ROWS // max(world.count, 1), 1)), self._observer is not None
        rows, bound, pairs = world.raw_rows(count), world.quick_bound(self._largest_spin), []
        made, is_within = 0, True
        while made < count and is_within:
            changed = world.step(dt, substeps, rows, made)
            if self._log is not None and changed:
                if observed:
                    pairs.append((made, self._log.pairs()))
                self._log.record((first + made) * dt, world.contact_batch())
            is_within = world.is_quickly_within(rows, made, bound)
            made += 1
        path: FloatArray | None = np.tile(self._store.position, (made + 1, 1, 1)) if observed else None
        states = world.read(rows, made, dt, substeps)
        if path is not None and self._log is not None:
            path[1:, world.indices] = states.position
            self._observe_path(first, path, [*pairs, (made, self._log.pairs())])
        complete = made if is_within else made - 1  # the last may be beyond the limits
        self._record(states, complete, frames)
        self._steps += complete
        if not is_within:
            self._steps += 1
            self._finish_step()
            frames.steps += 1
            if frames.is_due():
                frames.record(self.frame())

    def _observe_path(self, first: int, path: FloatArray, pairs: list[tuple[int, IntArray]]) -> None:
        """Show the observer the last step and the steps of a batch but its last one.

        Args:
            first: number of steps before the batch.
            path: (B + 1, N, 2) m.
            pairs: pairs found at the starts of the batch's steps: entries as in `PairRuns`.
        """
        observer, dt, made = self._observer, self._settings.dt, len(path) - 1
        assert observer is not None
        if self._unobserved is not None:
            time, start, end = self._unobserved
            observer(time, start, end, next(found for until, found in pairs if until > 0))
        shifted = [(end - 1, found) for end, found in pairs if end > 1]  # those of a step's start are of the one before
        times: FloatArray = np.arange(first, first + made - 1) * np.float64(dt)
        observe_path(observer, times, path[:-1], shifted)
        self._unobserved = (first + made - 1) * dt, path[-2].copy(), path[-1].copy()

    def _record(self, states: StateRows, steps: int, frames: FrameTable) -> None:
        """Count steps, and record the frames that are due by their states."""
        every, n, store = frames.every, len(self._store.position), self._store
        due = np.arange(every - frames.steps % every - 1, steps, every)
        frames.steps += steps
        if not len(due):
            return
        rows, moving = slice(frames.count, frames.count + len(due)), self._world.indices
        frames.time[rows] = (self._steps + due + 1) * self._settings.dt
        for column, fixed, values in (
            (frames.position, store.position, states.position),
            (frames.velocity, store.velocity, states.velocity),
            (frames.angle, store.angle, states.angle),
            (frames.angular_velocity, store.angular_velocity, states.spin),
        ):
            column[rows, :n] = fixed
            column[rows, moving] = values[due]
        if len(store.scene.layers) > 1:
            frames.layer_rows()[rows, :n] = store.layer
        frames.finish_rows(len(due), n)

    def _break_joints(self, time: float) -> None:
        broken = self._joints.overloaded()
        if len(broken):
            self._joints.remove(broken)
            self._store.mark_broken(broken, time)

    def _finish_step(self) -> None:
        """Check that the state is finite and within Box2D's limits, and remove expired bodies."""
        store = self._store
        beyond, reason = store.beyond(), BEYOND
        if beyond is None:
            beyond, reason = self._beyond_limits()
        if beyond is not None:
            self.close()
            raise Divergence(self.time, self.bodies.names[beyond], reason)
        if store.can_expire:
            expired = store.expired(self.time)
            if len(expired):
                self._remove_bodies(expired)
        self._world.extend_planes()

    def _beyond_limits(self) -> tuple[int | None, str]:
        """Return the first body that Box2D slows down or cannot resolve, and the reason."""
        store, scale = self._store, self._world.scale
        position, velocity = (
            np.abs(array).max(axis=1, initial=0.0) * scale for array in (store.position, store.velocity)
        )
        for values, limit, reason in (
            (position, FARTHEST_LENGTHS, f"is too far away: {far_away(scale)}"),
            (velocity, FASTEST_LENGTHS, f"is faster than {FASTEST_LENGTHS / scale:g} m/s, Box2D's limit"),
            (
                np.abs(store.angular_velocity),
                self._largest_spin,
                "turns by 45° in a substep, the limit of Box2D; use more substeps",
            ),
        ):
            found = np.flatnonzero((values >= limit) & store.moving)
            if len(found):
                return int(found[0]), reason
        return None, ""

    def _remove_bodies(self, indices: IntArray) -> None:
        self._store.remove_bodies(indices, self.time)
        self._world.remove(indices.tolist())
        self._joints.forget()
        self._record_contacts()

    def _record_contacts(self) -> None:
        """Record the present contacts, after some have ended between two steps."""
        if self._log is not None:
            self._log.record(self.time, self._world.contact_batch())

    def apply(self, action: Action) -> None:
        """Apply an action at once.

        Raises:
            ActionError: the action cannot be applied. The simulation is left unchanged.
        """
        with self._lock:
            self._check_running()
            store = self._store
            if sets_level(action):
                joints = store.all_joints
                apply_action(action, store)
                self._joints.update_motors(joints)
                return
            before = BodyState.of(store)
            scene, matrix, inverse_moment = store.scene, store.contact_matrix, store.inverse_moment
            joints = store.all_joints
            leaving = apply_action(action, store)
            if store.contact_matrix is not matrix or store.inverse_moment is not inverse_moment:
                self._joints.renew(self._world.update_surfaces())  # first: new shapes need the new values
            self._update_world(before, scene)
            self._joints.update_motors(joints)
            if store.scene is not scene or len(store.position) > len(before.position):
                self._set_air(store.scene)
            if leaving is not None:
                self._remove_bodies(np.asarray([leaving]))
            self._world.extend_planes()

    def _update_world(self, before: BodyState, scene: Scene) -> None:
        """Apply to the world what an action has changed in the body store.

        Args:
            before: the bodies before it.
            scene: the scene before it.
        """
        store = self._store
        if store.scene.fixed != scene.fixed:
            pairs = enumerate(zip(scene.fixed, store.scene.fixed, strict=True))
            self._world.update_static([k for k, (old, new) in pairs if _has_other_form(old, new)])
            self._record_contacts()
        self._update_bodies(before)
        for index in range(len(before.position), len(store.position)):
            self._world.add(index)

    def _update_bodies(self, before: BodyState) -> None:
        """Apply to the world what has changed in the state of bodies."""
        store, world = self._store, self._world
        now, count = BodyState.of(store), len(before.position)
        relayered = np.flatnonzero(now.layer[:count] != before.layer).tolist()
        for index in relayered:
            world.replace(index)
        if relayered:
            self._joints.renew(set(relayered))
            self._record_contacts()
        moved = (now.position[:count] != before.position).any(axis=1) | (now.angle[:count] != before.angle)
        for index in np.flatnonzero(moved).tolist():
            world.set_pose(index)
        held = now.held[:count] != before.held
        for index in np.flatnonzero(held).tolist():
            world.set_mass(index)
        pushed = (now.velocity[:count] != before.velocity).any(axis=1) | (now.spin[:count] != before.spin)
        for index in np.flatnonzero(pushed | held).tolist():
            world.set_motion(index)

    def frame(self) -> Frame:
        """Return the present state."""
        store = self._store
        position, velocity, angle = store.position.copy(), store.velocity.copy(), store.angle.copy()
        layer = store.layer.copy() if len(store.scene.layers) > 1 else None
        present, spin = store.present.copy(), store.angular_velocity.copy()
        visits = store.visits.copy() if store.scene.zones else None
        drives = store.drives.copy() if store.scene.drives else None
        return Frame(self.time, position, velocity, angle, spin, present, None, layer, visits, drives)

    def contacts(self) -> Contacts:
        """Return the contacts since the last call, and entries of zones.

        The impulses of contacts are nan, as Box2D does not report them; those of entries are 0.
        """
        if self._log is None:
            self._log = ContactLog(len(self._store.scene.fixed_names), can_repeat_pairs=False)
            batch = self._world.contact_batch()
            entries = None if self._zoned is None else self._zoned.tracker.drain_entries()
            self._has_entries = entries is not None
            self._log.record(self.time, batch if entries is None else join_batches(batch, entries))
        taken, scene = self._log.take(), self._store.scene
        if not len(taken):
            return taken
        colliders = len(scene.fixed) + len(scene.pockets)
        is_entry: BoolArray = np.asarray(taken.pair.min(axis=1) < -colliders)
        return replace(taken, impulse=np.tile(np.where(is_entry, 0.0, np.nan)[:, None], 2))

    def account(self) -> Mapping[Cause, float]:
        """Refuse: without the impulses of contacts no energy account is possible.

        Raises:
            Refusal: always.
        """
        raise Refusal(
            "box2d",
            ("energy accounting: Box2D does not report the impulses of contacts",),
            ("pymunk", "reference", "exact"),
        )

    def watch(self, observer: Observer) -> None:
        """Register an observer that is called for every step, one step later, when its contacts are known."""
        if self._log is None:
            self.contacts()
        self._observer = observer

    def close(self) -> None:
        """End the simulation and destroy its world."""
        super().close()
        self._world.close()


FORM = "points", "position", "radius", "thickness", "solid"
"""fields of static colliders that actions can change, other than coefficients, and those that go with them"""


def _has_other_form(old: Plane | Wall | Post, new: Plane | Wall | Post) -> bool:
    """Return whether a static collider has other shapes than before."""
    return any(getattr(old, key, None) != getattr(new, key, None) for key in FORM)
