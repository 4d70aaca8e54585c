"""Simulation on a pymunk space, and the recording of its contacts and zone entries."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from sandbox.action import Action
from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.actions import apply_action, sets_level
from sandbox.engines.common.base import BaseSimulation, observe_path
from sandbox.engines.common.contact_log import ContactBatch, ContactLog, join_batches
from sandbox.engines.common.energy_balance import record_energy_change
from sandbox.engines.common.lifetimes import Lifetimes
from sandbox.engines.contract import Divergence, Exhaustion, Observer, PairRuns
from sandbox.engines.energy_ledger import Cause, EnergyLedger
from sandbox.engines.pymunk_adapter.batch_reader import MAX_CONTACTS
from sandbox.engines.pymunk_adapter.bodies import PymunkBodies
from sandbox.engines.pymunk_adapter.contacts import ContactLists
from sandbox.engines.pymunk_adapter.energy import PymunkEnergyLedger
from sandbox.frame_table import FrameTable
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.fixed import PlaneReach
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Contacts, Frame

NO_POSITIONS: FloatArray = np.empty((0, 2))


class EventRecorder:
    """Records contacts and zone entries, until they are taken."""

    def __init__(self, population: PymunkBodies, time: float) -> None:
        """Start with the contacts at a time, s. Zone entries so far are recorded now and at the end of the substep."""
        self._population = population
        self._log = ContactLog(len(population.scene.fixed_names), population.space_bodies.can_repeat_pairs)
        self.contacts = 0
        """number of contacts found so far; a lasting contact counts at every substep"""
        self.record(time, opening=True)

    def record(self, time: float, opening: bool = False) -> None:
        """Record contacts and zone entries at a time, s; at the opening, zone entries stay for the next call."""
        tabletop, zone_tracker, log = self._population.tabletop, self._population.zone_tracker, self._log
        entries = None if zone_tracker is None else zone_tracker.drain_entries(repeat=opening)
        impulses_suffice = log.has_distinct_rows and entries is None
        contacts = (
            self._population.space_bodies.touching(impulses_suffice) if tabletop is None else tabletop.drain_contacts()
        )
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
        for end, count in self._population.space_bodies.read_batch(lists, self._log, times):
            self.contacts += count
            if wants_pairs:
                pairs.append((end, self._log.pairs()))
        return pairs

    def has_new(self, lists: ContactLists) -> bool:
        """Return whether there is something to record: contacts in the lists of a batch, or before it."""
        return bool(lists.count) or self._population.space_bodies.contact_reader.is_listed or self.is_open

    @property
    def is_open(self) -> bool:
        """Whether there were contacts at the last record."""
        return self._log.is_open

    @property
    def can_batch(self) -> bool:
        """Whether a batch of substeps can be recorded: contacts have been read before, and there is space for more."""
        return self._population.space_bodies.contact_reader.is_started and self._log.can_hold(MAX_CONTACTS)

    def rebuild(self) -> None:
        """Update after an action: a spawned body may have several shapes."""
        self._log.can_repeat_pairs = self._population.space_bodies.can_repeat_pairs

    def pairs(self) -> IntArray:
        """Return the pairs (K, 2) of the last record."""
        return self._log.pairs()

    def take(self) -> Contacts:
        """Return the contacts since the last call."""
        return self._log.take()


class PymunkSimulation(BaseSimulation):
    """Running scene.

    Scheme: drift–kick, explicit Euler for free motion (position error +g·h·T/2, velocity exact). With `half_kick`
    velocities start g·h/2 ahead and are reported without that offset: positions under gravity are then exact to
    rounding until the first contact. In contact the offset is still subtracted, but has no meaning there.

    Contacts are found at the end of a substep, without a time of impact: a body that passes a thin collider within a
    substep is not found in contact with it.

    On a surface, balls slide and roll as in `tabletop/stepper.py`: exactly without contacts, and collisions are
    resolved at the time of impact.
    """

    uncopied: ClassVar[str | None] = (
        "pymunk keeps the impulses of contacts and the order of its collision tree inside its space; a copied space "
        "computes other contacts than the original. Simulations on exact and reference can be copied"
    )

    def __init__(self, setup: Setup, settings: Settings) -> None:
        super().__init__(settings)
        self._population = PymunkBodies(setup, settings)
        self._h = settings.h
        self._recorder: EventRecorder | None = None
        self._ledger: PymunkEnergyLedger | None = None
        self._retired: dict[int, float] = {}
        self._broken: dict[int, float] = {}
        self._joint_iterations = 0
        self._lifetimes = Lifetimes(setup.bodies, setup.time, settings.h)
        self._shared_angles: tuple[FloatArray, FloatArray] | None = None  # angles and spins, shared by frames

    @property
    def setup(self) -> Setup:
        """State from which the simulation started, with the changes that actions have made to its scene."""
        return self._population.setup

    @property
    def bodies(self) -> Bodies:
        """Bodies at their start as arrays; spawned bodies are appended."""
        return self._population.bodies

    @property
    def retired(self) -> Mapping[int, float]:
        """Time in s, by body index, at which bodies were removed, left `world.bounds` or ended their lifetime."""
        return MappingProxyType(self._retired)

    @property
    def broken(self) -> Mapping[int, float]:
        """Time in s, by index in `setup.links`, at which joints broke."""
        return MappingProxyType(self._broken)

    @property
    def plane_reach(self) -> PlaneReach | None:
        """Present extent of pymunk's half-planes; None while there are none."""
        return self._population.space_bodies.plane_reach

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
        return len(self._population.particles)

    def step(self) -> None:
        """Advance by one time step dt.

        Raises:
            Divergence: a body is not finite, or out of bounds. The state can still be read.
            Exhaustion: so many balls on a surface touch at once that resolving their collisions would take too long.
        """
        with self._lock:
            self._check_running()
            self._advance(self._settings.substeps)
            self._steps += 1
            self._check_state()
            self._retire()

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
            while frames.steps < end and self._can_batch and not is_over:
                self._advance_batch(end - frames.steps, frames, until_event)
                is_over = until_event

    @property
    def _can_batch(self) -> bool:
        """Whether a batch of substeps gives the same results as one substep after the other."""
        population = self._population
        return (
            population.space_bodies.can_batch
            and population.tabletop is None
            and not len(population.particles)
            and self._ledger is None
            and not self._lifetimes.any_left
            and (self._recorder is None or self._recorder.can_batch)
        )

    def _advance_batch(self, steps: int, frames: FrameTable, until_contact: bool) -> None:
        """Make at most so many steps in one batch, which ends when a body leaves or, if wanted, has a contact."""
        population, observed = self._population, self._observer is not None
        space_bodies, substeps, h = population.space_bodies, self._settings.substeps, self._h
        steps = min(steps, space_bodies.batch_steps(substeps, observed))
        start = self._state()[0].copy() if observed else NO_POSITIONS
        batch = space_bodies.step_batch(
            self._steps,
            steps,
            substeps,
            lists_substeps=observed,
            lists_contacts=self._recorder is not None,
            until_contact=until_contact,
        )
        recorder, lists = self._recorder, batch.contacts
        if recorder is not None and lists is not None and (observed or recorder.has_new(lists)):
            # The time of a substep is that of `_advance`: counted from the start of its step.
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
        population.invalidate()
        self._shared_angles = None
        if batch.needs_check:
            self._check_state()
            self._retire()
            frames.steps += 1
            if frames.is_due():
                frames.record(self.frame())

    def _record_states(self, states: FloatArray, frames: FrameTable) -> None:
        """Count steps, and record the frames that are due, by the states (S, R, 6) after each step."""
        population, every, first_due = self._population, frames.every, frames.every - frames.steps % frames.every
        frames.steps += len(states)
        states = states[first_due - 1 :: every]
        if not len(states):
            return
        rows, n = slice(frames.count, frames.count + len(states)), len(self.bodies)
        due = np.arange(self._steps + first_due, self._steps + first_due + every * len(states), every)
        frames.time[rows] = due * self._settings.dt
        columns = [
            array[rows, :n] for array in (frames.position, frames.velocity, frames.angle, frames.angular_velocity)
        ]
        fixed = (population.position, population.velocity, population.angle, population.angular_velocity)
        if len(population.space_bodies) < n:  # without those in the space that move
            for column, values in zip(columns, fixed, strict=True):
                column[:] = values
        population.space_bodies.write_states(states, *columns)
        if self._settings.half_kick:
            columns[1][:, population.moving] -= population.ahead
        if len(population.scene.layers) > 1:
            frames.layer_rows()[rows, :n] = population.layer
        frames.finish_rows(len(states), n)

    @property
    def makes_whole_steps(self) -> bool:
        """Whether no step is shorter than dt: not on a surface, whose stepper does not use Munk2D's solver.

        Munk2D applies the impulses that it keeps in proportion to the length of a step, but accumulates them in full.
        In a step shorter than the last one a contact that has just bounced pulls, and a motor brakes.
        """
        return self._population.tabletop is None

    def finish(self, part: float) -> None:
        """Advance by a last fraction of dt. No step can follow.

        On a surface, whole substeps come first, and then a shorter one; elsewhere the step is whole.

        Args:
            part: fraction of dt, 0 < part < 1.

        Raises:
            Divergence: as `step`.
            Exhaustion: as `step`.
            ValueError: `part` is out of range.
        """
        self._check_part(part)
        if self.makes_whole_steps:
            self.step()
            self._population.end()
            return
        with self._lock:
            self._check_running()
            substeps, fraction = divmod(part * self._settings.substeps, 1.0)
            self._advance(int(substeps))
            if fraction:
                self._substep(int(substeps), self.time, fraction=fraction)
            self._part = part
            self._check_state()
            self._retire()
            self._population.end()

    def apply(self, action: Action) -> None:
        """Apply an action at once.

        Raises:
            ActionError: the action cannot be applied. The simulation is left unchanged.
        """
        with self._lock:
            self._check_running()
            if sets_level(action):
                apply_action(action, self._population)
                return
            self._shared_angles = None
            with record_energy_change(self._action_ledger, Cause.ACTIONS, self):
                leaving = apply_action(action, self._population)
                self._population.invalidate()
                self._shared_angles = None
            self._population.space_bodies.extend_planes()
            self._population.capture()
            if self._recorder is not None:
                self._recorder.rebuild()
            if leaving is not None:
                self._remove_bodies(np.asarray([leaving]))

    def frame(self) -> Frame:
        """Return the present state."""
        population = self._population
        position, velocity, angle, angular_velocity = self._state()
        position, velocity = position.copy(), velocity.copy()
        if self._settings.half_kick:
            velocity[population.moving] -= population.ahead
        if population.can_turn or population.tabletop is not None or self._shared_angles is None:
            self._shared_angles = angle.copy(), angular_velocity.copy()
        angle, angular_velocity = self._shared_angles
        roll = None if population.tabletop is None else population.roll.copy()
        scene, present = population.scene, population.present.copy()
        layer = population.layer.copy() if len(scene.layers) > 1 else None
        visits = population.visits.copy() if scene.zones else None
        drives = population.space_bodies.drives.current_state() if scene.drives else None
        passing = population.space_bodies.passing()
        return Frame(
            self.time, position, velocity, angle, angular_velocity, present, roll, layer, visits, drives, passing
        )

    def contacts(self) -> Contacts:
        """Return the contacts since the last call; the first call starts the recording."""
        if self._recorder is None:
            self._recorder = EventRecorder(self._population, self.time)
        return self._recorder.take()

    def account(self) -> Mapping[Cause, float]:
        """Return the energy change, J, by each cause since the first call, which switches accounting on."""
        tabletop = self._population.tabletop
        if tabletop is not None:  # it keeps its own ledger
            tabletop.account = tabletop.account or EnergyLedger()
            return tabletop.account.entries()
        if self._ledger is None:
            self._ledger = PymunkEnergyLedger(self._population)
        return self._ledger.account.entries()

    @property
    def _action_ledger(self) -> EnergyLedger | None:
        tabletop = self._population.tabletop
        if tabletop is not None:
            return tabletop.account
        return None if self._ledger is None else self._ledger.account

    def watch(self, observer: Observer) -> None:
        """Register an observer that is called after every substep. This records contacts too."""
        if self._recorder is None:
            self.contacts()
        self._observer = observer

    def close(self) -> None:
        """End the simulation and release what it holds."""
        self._population.end()
        super().close()

    def _check_running(self) -> None:
        if self._population.ended:
            raise RuntimeError("the simulation has ended; its state can be read, but it cannot continue")

    def _advance(self, substeps: int) -> None:
        """Advance by some substeps from the start of a step. Particles and the space are independent of each other."""
        # An observer gets all bodies after each substep, and the ledger needs them all too.
        with_particles = self._observer is not None or self._ledger is not None
        if not with_particles:
            self._population.particles.step(substeps)
        if with_particles or self._recorder is not None or len(self._population.space_bodies):
            time = self.time
            for k in range(substeps):
                self._substep(k, time, with_particles=with_particles)

    def _substep(self, k: int, time: float, with_particles: bool = True, fraction: float = 1.0) -> None:
        """Advance by one substep as `_integrate`, and process its events: broken joints, zone entries, contacts."""
        observer, start = self._observer, time + k * self._h
        before = self._observed_positions() if observer is not None else None
        self._integrate(k, time, with_particles, fraction)
        population = self._population
        if population.space_bodies.joints.has_breakable:
            self._record_broken(population.break_joints(), self._after(k + fraction))
        if population.has_pending_zones:
            self._update_zones()
        if self._recorder is not None:
            self._recorder.record(start + self._h * fraction)
            if observer is not None and before is not None:
                observer(start, before, self._observed_positions(), self._recorder.pairs())

    def _integrate(self, k: int, time: float, with_particles: bool = True, fraction: float = 1.0) -> None:
        """Advance by h, the k-th substep of the step that began at a time, s.

        Args:
            k: index of the substep.
            time: start of the step, s.
            with_particles: whether to advance the particles; False if they have been advanced already.
            fraction: length of a shorter substep as a fraction of h.
        """
        population, ledger = self._population, self._ledger
        space_bodies, tabletop, start = population.space_bodies, population.tabletop, time + k * self._h
        opening_state = ledger.opening() if ledger is not None else None
        if with_particles:
            population.particles.step()
        if tabletop is None:
            space_bodies.step(start)
        else:
            if self._recorder is None:
                tabletop.drain_contacts()  # captures before recording started are dropped
            try:
                tabletop.step(space_bodies, space_bodies.constant_forces.items(), fraction)
            except Exhaustion:
                population.end()
                raise
            population.capture()
        if space_bodies.joints.count:
            self._joint_iterations += space_bodies.solved_joint_count * self._settings.iterations
        population.invalidate()
        if ledger is not None:
            ledger.substep(opening_state)

    def _update_zones(self) -> None:
        """Apply the effects of zones that bodies have entered."""
        with record_energy_change(self._action_ledger, Cause.DRIVES, self):
            self._population.update_zones()
        zone_tracker = self._population.zone_tracker
        if self._recorder is None and zone_tracker is not None:
            zone_tracker.drain_entries()  # entries before recording started are dropped

    def _observed_positions(self) -> FloatArray:
        """Return the centres, (N, 2) m, for an observer; nan for balls that lie in pockets."""
        position, tabletop = self._state()[0].copy(), self._population.tabletop
        if tabletop is not None:
            position[tabletop.pocket >= 0] = np.nan
        return position

    def _record_broken(self, indices: IntArray, time: float) -> None:
        """Record that joints, by their indices, have broken."""
        self._broken |= dict.fromkeys(indices.tolist(), time)
        if self._ledger is not None and len(indices):
            self._ledger.joints_broken(indices)

    def _state(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return the present arrays in scene order; they belong to the population."""
        population = self._population
        population.refresh()
        return population.position, population.velocity, population.angle, population.angular_velocity

    def _check_state(self) -> None:
        """Check the state, and end the simulation if a body is not finite, out of bounds, or beyond the half-planes."""
        population = self._population
        for owner in (
            population.particles,
            population.space_bodies,
            *(() if population.tabletop is None else (population.tabletop,)),
        ):
            diverged = owner.beyond()
            if diverged is not None:
                self._population.end()
                index, description = diverged
                raise Divergence(self.time, self.bodies.names[index], description)

    def _retire(self) -> None:
        """Remove bodies whose lifetime has ended or that are outside of world.bounds."""
        population, bounds = self._population, self._population.scene.world.bounds
        if bounds is not None:
            population.refresh()
        removed = self._lifetimes.expired(
            self.time, population.position, population.present, population.bodies.fixed, bounds
        )
        if len(removed):
            self._remove_bodies(removed)

    def _remove_bodies(self, indices: IntArray) -> None:
        with record_energy_change(self._action_ledger, Cause.RETIRED, self):
            self._shared_angles = None
            self._population.remove_bodies(indices)
        self._shared_angles = None
        self._retired |= dict.fromkeys(indices.tolist(), self.time)
