"""Simulation on a pymunk space, and the recording of its contacts and zone entries."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from sandbox.action import Action, Force, Impulse
from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.actions import apply_action, sets_level
from sandbox.engines.common.base import BaseSimulation, observe_path
from sandbox.engines.common.body_store import HasBodyStore
from sandbox.engines.common.contact_log import ContactBatch, ContactLog, join_batches
from sandbox.engines.common.energy_balance import record_energy_change
from sandbox.engines.contract import Divergence, Observer, PairRuns
from sandbox.engines.energy_ledger import Cause, EnergyLedger
from sandbox.engines.pymunk_adapter.batch_reader import MAX_CONTACTS
from sandbox.engines.pymunk_adapter.bodies import PymunkBodies
from sandbox.engines.pymunk_adapter.contacts import ContactLists
from sandbox.engines.pymunk_adapter.energy import PymunkEnergyLedger
from sandbox.frame_table import FrameTable
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.fixed import PlaneReach
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Contacts, Frame

if TYPE_CHECKING:
    from sandbox.engines.pymunk_adapter.zoned_bodies import ZonedPymunkBodies

NO_POSITIONS: FloatArray = np.empty((0, 2))


class EventRecorder:
    """Records contacts and zone entries, until they are taken."""

    def __init__(self, store: PymunkBodies, zoned: "ZonedPymunkBodies | None", time: float) -> None:
        """Start with the contacts at a time, s. Zone entries so far are recorded now and at the end of the substep."""
        self._store, self._zoned = store, zoned
        self._log = ContactLog(len(store.scene.fixed_names), store.space_bodies.can_repeat_pairs)
        self.contacts = 0
        """number of contacts found so far; a lasting contact counts at every substep"""
        self.record(time, opening=True)

    def record(self, time: float, opening: bool = False) -> None:
        """Record contacts and zone entries at a time, s; at the opening, zone entries stay for the next call."""
        log = self._log
        entries = None if self._zoned is None else self._zoned.tracker.drain_entries(repeat=opening)
        impulses_suffice = log.has_distinct_rows and entries is None
        contacts = self._store.space_bodies.touching(impulses_suffice)
        if isinstance(contacts, ContactBatch):
            log.record(time, contacts if entries is None else join_batches(contacts, entries))
            self.contacts += len(contacts.a)
        else:
            log.add_impulses(contacts)
            self.contacts += len(contacts)
        if entries is not None:
            log.has_distinct_rows = False  # a zone entry does not last: the next contacts are different ones

    def record_lists(self, lists: ContactLists, times: FloatArray, wants_pairs: bool) -> PairRuns:
        """Record the contacts of a batch of substeps.

        Args:
            lists: the contacts.
            times: (B,) s, end of each substep.
            wants_pairs: whether to return the pairs.

        Returns:
            The pairs of the substeps; none unless they are wanted.
        """
        pairs = []
        for end, count in self._store.space_bodies.read_batch(lists, self._log, times):
            self.contacts += count
            if wants_pairs:
                pairs.append((end, self._log.pairs()))
        return pairs

    def has_new(self, lists: ContactLists) -> bool:
        """Return whether there is something to record: contacts in the lists of a batch, or before it."""
        return bool(lists.count) or self._store.space_bodies.contact_reader.is_listed or self.is_open

    @property
    def is_open(self) -> bool:
        """Whether there were contacts at the last record."""
        return self._log.is_open

    @property
    def can_batch(self) -> bool:
        """Whether a batch of substeps can be recorded: contacts have been read before, and there is space for more."""
        return self._store.space_bodies.contact_reader.is_started and self._log.can_hold(MAX_CONTACTS)

    def rebuild(self) -> None:
        """Update after an action: a spawned body may have several shapes."""
        self._log.can_repeat_pairs = self._store.space_bodies.can_repeat_pairs

    def pairs(self) -> IntArray:
        """Return the pairs (K, 2) of the last record."""
        return self._log.pairs()

    def take(self) -> Contacts:
        """Return the contacts since the last call."""
        return self._log.take()


class PymunkSimulation(HasBodyStore, BaseSimulation):
    """Running scene.

    Scheme: drift–kick, explicit Euler for free motion (position error +g·h·T/2, velocity exact). With `half_kick`
    velocities start g·h/2 ahead and are reported without that offset: positions under gravity are then exact to
    rounding until the first contact. In contact the offset is still subtracted, but has no meaning there.

    Contacts are found at the end of a substep, without a time of impact: a body that passes a thin collider within a
    substep is not found in contact with it.
    """

    _store: PymunkBodies
    _zoned: "ZonedPymunkBodies | None"

    uncopied: ClassVar[str | None] = (
        "pymunk keeps the impulses of contacts and the order of its collision tree inside its space; a copied space "
        "computes other contacts than the original. Simulations on exact and reference can be copied"
    )

    def __init__(self, setup: Setup, settings: Settings) -> None:
        super().__init__(settings)
        self._zoned = None
        if setup.scene.zones:
            from sandbox.engines.pymunk_adapter.zoned_bodies import ZonedPymunkBodies  # with a compiler

            self._zoned = ZonedPymunkBodies(setup, settings)
        self._store = self._zoned or PymunkBodies(setup, settings)
        self._h = settings.h
        self._recorder: EventRecorder | None = None
        self._ledger: PymunkEnergyLedger | None = None
        self._joint_iterations = 0
        self._shared_angles: tuple[FloatArray, FloatArray] | None = None  # angles and spins, shared by frames

    @property
    def plane_reach(self) -> PlaneReach | None:
        """Present extent of pymunk's half-planes; None while there are none."""
        return self._store.space_bodies.plane_reach

    @property
    def work(self) -> Mapping[str, int]:
        """Work counters since the start. pymunk does not report the number of pairs that it tests.

        Contacts, and with them `contact_iterations`, are counted from the first call of `contacts` or `watch` on:
        before that they are not read from pymunk.
        """
        contacts = 0 if self._recorder is None else self._recorder.contacts
        return {
            "substeps": self.substeps,
            "contacts": contacts,
            "contact_iterations": contacts * self._settings.iterations,
            "joint_iterations": self._joint_iterations,
        }

    @property
    def flying(self) -> int:
        """Number of bodies that are advanced as arrays, outside of pymunk."""
        return len(self._store.particles)

    def step(self) -> None:
        """Advance by one time step dt.

        Raises:
            Divergence: a body is not finite, or out of bounds. The state can still be read.
        """
        with self._lock:
            self._check_running()
            self._make_step(self._settings.substeps)
            self._steps += 1
            if self._needs_check:
                self._check_state()
                self._retire()

    @property
    def _needs_check(self) -> bool:
        """Whether a body may have diverged, or may have to be removed."""
        store = self._store
        return len(store.particles) > 0 or store.has_lifetimes or store.space_bodies.needs_check

    def advance(self, steps: int, frames: FrameTable, *, until_event: bool = False) -> None:
        """Advance by at most so many time steps, and record the frames that are due, as `Simulation.advance`.

        Where nothing has to be done between two substeps, Munk2D makes many of them before Python reads the results.

        Raises:
            Divergence: as `step`.
        """
        # A contact that was open at the last call of `contacts` is in the next one too.
        is_watched = until_event and (self._recorder is None or self._recorder.is_open)
        if is_watched or not self._can_batch:
            super().advance(steps, frames, until_event=until_event)
            return
        with self._lock:
            self._check_running()
            frames.prepare(steps, len(self.bodies))
            end, is_over = frames.steps + steps, False
            while frames.steps < end and not is_over:
                self._advance_batch(end - frames.steps, frames, until_event)
                is_over = until_event or not self._can_batch

    @property
    def _can_batch(self) -> bool:
        """Whether a batch of substeps gives the same results as one substep after the other."""
        store = self._store
        return (
            store.space_bodies.can_batch
            and not len(store.particles)
            and self._ledger is None
            and not store.has_lifetimes
            and (self._recorder is None or self._recorder.can_batch)
        )

    def _advance_batch(self, steps: int, frames: FrameTable, until_contact: bool) -> None:
        """Make at most so many steps in one batch, which ends when a body leaves or, if wanted, has a contact."""
        store, observed = self._store, self._observer is not None
        space_bodies, substeps, h = store.space_bodies, self._settings.substeps, self._h
        steps = min(steps, space_bodies.batch_steps(observed))
        start = self._state()[0].copy() if observed else NO_POSITIONS
        batch = space_bodies.step_batch(
            self._steps,
            steps,
            lists_substeps=observed,
            lists_contacts=self._recorder is not None,
            until_contact=until_contact,
        )
        recorder, lists = self._recorder, batch.contacts
        if recorder is not None and lists is not None and (observed or recorder.has_new(lists)):
            # The time of a substep is that of `_make_step`: counted from the start of its step.
            step_index, k = np.divmod(np.arange(batch.steps * substeps), substeps)
            starts = (self._steps + step_index) * self._settings.dt + k * h
            pairs = recorder.record_lists(lists, starts + h, observed)
            if self._observer is not None:
                path = np.empty((len(starts) + 1, *start.shape))
                path[: None if len(space_bodies) < len(start) else 1] = start
                space_bodies.write_positions(batch.states, path[1:])
                observe_path(self._observer, starts, path, pairs)
        if space_bodies.joints.count:
            count = space_bodies.solved_joint_count * self._settings.iterations
            self._joint_iterations += count * batch.steps * substeps
        states = batch.states[substeps - 1 :: substeps] if observed else batch.states
        self._record_states(states[:-1] if batch.needs_check else states, frames)
        self._steps += batch.steps
        store.invalidate()
        self._shared_angles = None
        if batch.needs_check:
            self._check_state()
            self._retire()
            frames.steps += 1
            if frames.is_due():
                frames.record(self.frame())

    def _record_states(self, states: FloatArray, frames: FrameTable) -> None:
        """Count steps, and record the frames that are due, by the states (S, R, 6) after each step."""
        store, every, first_due = self._store, frames.every, frames.every - frames.steps % frames.every
        frames.steps += len(states)
        states = states[first_due - 1 :: every]
        if not len(states):
            return
        rows, n = slice(frames.count, frames.count + len(states)), len(self.bodies)
        due = np.arange(self._steps + first_due, self._steps + first_due + every * len(states), every)
        frames.time[rows] = due * self._settings.dt
        arrays = frames.position, frames.velocity, frames.angle, frames.angular_velocity
        if len(store.space_bodies) < n:  # of those outside the space, and those that do not move
            fixed = store.position, store.velocity, store.angle, store.angular_velocity
            for array, values in zip(arrays, fixed, strict=True):
                array[rows, :n] = values
        store.space_bodies.write_states(states, rows, *arrays)
        if self._settings.half_kick:
            frames.velocity[rows, :n][:, store.mobile] -= store.ahead
        if len(store.scene.layers) > 1:
            frames.layer_rows()[rows, :n] = store.layer
        frames.finish_rows(len(states), n)

    @property
    def makes_whole_steps(self) -> bool:
        """Whether no step is shorter than dt.

        Munk2D applies the impulses that it keeps in proportion to the length of a step, but accumulates them in full.
        In a step shorter than the last one a contact that has just bounced pulls, and a motor brakes.
        """
        return True

    def finish(self, part: float) -> None:
        """Advance by a last, whole step. No step can follow.

        Args:
            part: the fraction of dt that remains of the run, 0 < part < 1.

        Raises:
            Divergence: as `step`.
            ValueError: `part` is out of range.
        """
        self._check_part(part)
        self.step()
        self._store.end()

    def apply(self, action: Action) -> None:
        """Apply an action at once.

        Raises:
            ActionError: the action cannot be applied. The simulation is left unchanged.
        """
        with self._lock:
            self._check_running()
            if sets_level(action):
                apply_action(action, self._store)
                return
            self._shared_angles = None
            with record_energy_change(self._action_ledger, Cause.ACTIONS, self):
                leaving = apply_action(action, self._store)
                self._store.invalidate()
                self._shared_angles = None
            if type(action) in (Impulse, Force):  # which neither place nor change bodies
                return
            self._store.space_bodies.extend_planes()
            if self._recorder is not None:
                self._recorder.rebuild()
            if leaving is not None:
                self._remove_bodies(np.asarray([leaving]))

    def frame(self) -> Frame:
        """Return the present state."""
        store = self._store
        position, velocity, angle, angular_velocity = self._state()
        position, velocity = position.copy(), velocity.copy()
        if self._settings.half_kick:
            velocity[store.mobile] -= store.ahead
        if store.can_turn or self._shared_angles is None:
            self._shared_angles = angle.copy(), angular_velocity.copy()
        angle, angular_velocity = self._shared_angles
        scene, present = store.scene, store.present.copy()
        layer = store.layer.copy() if len(scene.layers) > 1 else None
        visits = store.visits.copy() if scene.zones else None
        drives = store.space_bodies.drives.current_state() if scene.drives else None
        passing = store.space_bodies.passing()
        return Frame(
            self.time, position, velocity, angle, angular_velocity, present, None, layer, visits, drives, passing
        )

    def contacts(self) -> Contacts:
        """Return the contacts since the last call; the first call starts the recording."""
        if self._recorder is None:
            self._recorder = EventRecorder(self._store, self._zoned, self.time)
        return self._recorder.take()

    def account(self) -> Mapping[Cause, float]:
        """Return the energy change, J, by each cause since the first call, which switches accounting on."""
        if self._ledger is None:
            self._ledger = PymunkEnergyLedger(self._store)
        return self._ledger.account.entries()

    @property
    def _action_ledger(self) -> EnergyLedger | None:
        return None if self._ledger is None else self._ledger.account

    def watch(self, observer: Observer) -> None:
        """Register an observer that is called after every substep. This records contacts too."""
        if self._recorder is None:
            self.contacts()
        self._observer = observer

    def close(self) -> None:
        """End the simulation and release what it holds."""
        self._store.end()
        super().close()

    def _check_running(self) -> None:
        if self._store.ended:
            raise RuntimeError("the simulation has ended; its state can be read, but it cannot continue")

    def _make_step(self, substeps: int) -> None:
        """Advance by some substeps from the start of a step. Particles and the space are independent of each other."""
        # An observer gets all bodies after each substep, and the ledger needs them all too.
        with_particles = self._observer is not None or self._ledger is not None
        if not with_particles:
            self._store.particles.step(substeps)
        if with_particles or self._recorder is not None or len(self._store.space_bodies):
            time = self.time
            for k in range(substeps):
                self._substep(k, time, with_particles=with_particles)

    def _substep(self, k: int, time: float, with_particles: bool) -> None:
        """Advance by one substep as `_integrate`, and process its events: broken joints, zone entries, contacts."""
        observer, start = self._observer, time + k * self._h
        before = self._observed_positions() if observer is not None else None
        self._integrate(k, time, with_particles)
        store = self._store
        if store.space_bodies.joints.has_breakable:
            self._record_broken(store.break_joints(), self._after(k + 1))
        if self._zoned is not None:
            self._visit_zones(self._zoned)
        if self._recorder is not None:
            self._recorder.record(start + self._h)
            if observer is not None and before is not None:
                observer(start, before, self._observed_positions(), self._recorder.pairs())

    def _integrate(self, k: int, time: float, with_particles: bool) -> None:
        """Advance by h, the k-th substep of the step that began at a time, s.

        Args:
            k: index of the substep.
            time: start of the step, s.
            with_particles: whether to advance the particles; False if they have been advanced already.
        """
        store, ledger = self._store, self._ledger
        space_bodies = store.space_bodies
        opening_state = ledger.opening() if ledger is not None else None
        if with_particles:
            store.particles.step()
        space_bodies.step(time + k * self._h)
        if space_bodies.joints.count:
            self._joint_iterations += space_bodies.solved_joint_count * self._settings.iterations
        store.invalidate()
        if ledger is not None:
            ledger.substep(opening_state)

    def _visit_zones(self, store: "ZonedPymunkBodies") -> None:
        """Apply zones to the bodies that have entered or left one."""
        if store.find_zones():
            store.refresh()
            with record_energy_change(self._action_ledger, Cause.DRIVES, self):
                store.apply_zones()
            if self._recorder is None:
                store.tracker.drain_entries()  # entries before recording started are dropped

    def _observed_positions(self) -> FloatArray:
        """Return the centres, (N, 2) m, for an observer."""
        return self._state()[0].copy()

    def _record_broken(self, indices: IntArray, time: float) -> None:
        """Record that joints, by their indices, have broken."""
        self._store.mark_broken(indices, time)
        if self._ledger is not None and len(indices):
            self._ledger.joints_broken(indices)

    def _state(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return the present arrays in scene order; they belong to the store."""
        store = self._store
        store.refresh()
        return store.position, store.velocity, store.angle, store.angular_velocity

    def _check_state(self) -> None:
        """Check the state, and end the simulation if a body is not finite, out of bounds, or beyond the half-planes."""
        store = self._store
        for owner in (store.particles, store.space_bodies):
            diverged = owner.beyond()
            if diverged is not None:
                self._store.end()
                index, description = diverged
                raise Divergence(self.time, self.bodies.names[index], description)

    def _retire(self) -> None:
        """Remove bodies whose lifetime has ended or that are outside of world.bounds."""
        store = self._store
        if store.scene.world.bounds is not None:
            store.refresh()
        removed = store.expired(self.time)
        if len(removed):
            self._remove_bodies(removed)

    def _remove_bodies(self, indices: IntArray) -> None:
        with record_energy_change(self._action_ledger, Cause.RETIRED, self):
            self._shared_angles = None
            self._store.remove_bodies(indices, self.time)
        self._shared_angles = None
