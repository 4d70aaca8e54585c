"""ReferenceSimulation: a scene running on the hand-written solvers, one fixed step after the other."""

import copy
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from time import perf_counter
from typing import Any, Self

import numpy as np

from sandbox.action import Action, ActionError, Impulse, Spawn, Steer, Throttle
from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.actions import apply_action
from sandbox.engines.common.base import BEYOND, SteppedSimulation, observe_path
from sandbox.engines.common.body_store import BodyStore, HasBodyStore
from sandbox.engines.common.contact_log import NO_CONTACTS, ContactBatch, ContactLog, join_batches
from sandbox.engines.common.frame_rows import free_rows
from sandbox.engines.common.kernel import warn_if_uncompiled
from sandbox.engines.common.zoned_bodies import ZonedBodyStore
from sandbox.engines.contract import Divergence, Exhaustion, Members, Observer
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.reference.compiled_stepper import (
    CAPACITY,
    CompiledStepper,
    CompiledSteps,
    MemberStepper,
    record_contacts,
)
from sandbox.engines.reference.continuous import DETECTIONS
from sandbox.engines.reference.energy import StepEnergyLedger
from sandbox.engines.reference.joints import JointBreaker
from sandbox.engines.reference.manifold import CONTACT_ROUNDING, Manifolds
from sandbox.engines.reference.step import StepRecord, WorldState
from sandbox.engines.reference.step_kernels import STOPPED, UNCHECKED
from sandbox.engines.reference.world_batch import ConvexWorldBatch
from sandbox.frame_table import FrameTable
from sandbox.scene.compile.contacts import surface_parts
from sandbox.scene.compile.demands import may_resist_rolling
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import BodySpec
from sandbox.scene.description.discs import Disc
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Contacts, Frame

MIN_FIRST_STEPS = 4
"""Steps of a first call of `advance` from which on preparing compiled steps pays"""


class ReferenceSimulation(HasBodyStore, SteppedSimulation):
    """A running scene. A substep applies forces, advances bodies, detects and resolves contacts; see `step.step`.

    Zones detect centres at the end of a substep, so that the delay of their effects depends only on the substep.
    """

    def __init__(self, setup: Setup, settings: Settings) -> None:
        """Start from a setup.

        Raises:
            Exhaustion: the first collision detection needs more memory or work than its limit.
        """
        assert settings.detection is not None
        super().__init__(settings)
        self._zoned = ZonedBodyStore(setup, settings.h) if setup.scene.zones else None
        self._store = self._zoned or BodyStore(setup, settings.h)
        self._world = WorldState(self._store, settings)
        self._detection = DETECTIONS[settings.detection]
        self._energy: StepEnergyLedger | None = None
        self._breaker = JointBreaker(setup.joints) if np.isfinite(setup.joints.strength).any() else None
        """finds the joints that break; None if no joint can break any more"""
        self._world.records_joint_load = self._breaker is not None
        self._h = settings.h
        self._log: ContactLog | None = None
        self._stepper: CompiledStepper | None = None
        self._last_contacts = NO_CONTACTS  # contacts of the last record
        self._initial_entries: ContactBatch | None = None  # zone entries before the recording began
        self._world.pipeline.check_limits(self._world.x[0])  # exceeding a limit raises before the run begins
        warn_if_uncompiled(len(setup.bodies))

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return an independent simulation in the same state, without the memory of compiled steps."""
        self._stepper = None
        return super().__deepcopy__(memo)

    @property
    def work(self) -> Mapping[str, int]:
        """Work counters since the start: all those of the contract but events and predictions."""
        return {"substeps": self.substeps, **self._world.work}

    def advance(self, steps: int, frames: FrameTable, *, until_event: bool = False) -> None:
        """Advance by at most so many time steps, and record the frames that are due, as `Simulation.advance`.

        Where nothing has to be done between two substeps, one compiled call makes many steps.

        Raises:
            Divergence: the state of a body is not finite, or exceeds the bounds. It can still be read.
            Exhaustion: a step exceeds a resource limit.
        """
        end, kernel, is_over = frames.steps + steps, CompiledStepper.kernel_for(self._world), False
        frames.prepare(steps, len(self.bodies))
        while frames.steps < end and not is_over:
            # A contact that was open at the last call of `contacts` is in the next one too.
            is_watched = until_event and (self._log is None or self._log.is_open)
            is_short = end - frames.steps < MIN_FIRST_STEPS and not self._steps
            if is_short or is_watched or not self._can_batch():
                super().advance(end - frames.steps, frames, until_event=until_event)
                return
            if not kernel.is_worthwhile:
                began = perf_counter()
                super().advance(end - frames.steps, frames, until_event=until_event)
                kernel.spent += perf_counter() - began
                return
            with self._lock, np.errstate(all="ignore"):
                self._check_running()
                self._advance_compiled(end - frames.steps, frames, until_event)
            is_over = until_event

    def run_members(self, members: Members, steps: float, is_stopped: Callable[[], bool]) -> BoolArray:
        """Run the scene from each start, and write the end states in their place, as `MemberRunner.run_members`."""
        is_done = np.zeros(len(members.position), np.bool_)
        is_compiled = self._can_batch() and CompiledStepper.kernel_for(self._world).is_worthwhile
        if not is_compiled or self._store.can_expire or steps % 1.0:
            return is_done
        stepper = MemberStepper(
            copy.deepcopy(self._store), self._settings
        )  # its own, as several threads may run at once
        for m in range(len(is_done)):
            if is_stopped():
                break
            start = (array[m] for array in members)
            is_done[m] = stepper.run(*start, steps=int(steps), is_stopped=is_stopped)
        return is_done

    def world_batch(self, count: int) -> ConvexWorldBatch | None:
        """Return many worlds of the scene, as `HasWorldBatch.world_batch`."""
        if not (self._can_batch() and ConvexWorldBatch.is_suitable(self._world, self._store, self._settings)):
            return None
        return ConvexWorldBatch(copy.deepcopy(self._store), self._settings, count)

    def _can_batch(self) -> bool:
        """Whether nothing has to be done between two substeps, so that `CompiledStepper` can make many."""
        return (
            self._zoned is None
            and self._energy is None
            and not self._store.has_lifetimes
            and (self._log is None or self._log.can_hold(CAPACITY))
            and CompiledStepper.is_suitable(self._world, self._store, self._settings)
        )

    def _advance_compiled(self, steps: int, frames: FrameTable, until_contact: bool) -> None:
        """Make at most so many steps by `CompiledStepper`, and those substeps that it cannot make."""
        if self._stepper is None or self._stepper.forces is not self._world.forces:
            self._stepper = CompiledStepper(self._world, self._store, self._settings)
        observed, n = self._observer is not None, len(self.bodies)
        steps = min(steps, self._stepper.max_steps(observed=observed))
        result = self._stepper.advance(
            self._steps,
            steps,
            free_rows(frames),
            records=self._log is not None,
            observed=observed,
            until_contact=until_contact,
        )
        if self._world.x.shape[2] == 2:
            written = slice(frames.count, frames.count + result.frames)
            frames.angle[written, :n], frames.angular_velocity[written, :n] = (
                self._store.angle,
                self._store.angular_velocity,
            )
        frames.finish_rows(result.frames, n)
        self._record_compiled(result)
        self._steps += result.steps
        frames.steps += result.steps
        if result.code == UNCHECKED or (result.code == STOPPED and result.steps < steps):
            first = result.substeps if result.code == STOPPED else self._settings.substeps
            self._finish_substeps(first)
            frames.steps += 1
            if frames.is_due():
                frames.record(self.frame())
        else:
            self._world.write_state()

    def _finish_substeps(self, first: int) -> None:
        """Complete a step from a substep on."""
        begin, h = self._steps * self._settings.dt, self._h
        for k in range(first, self._settings.substeps):
            start = begin + k * h
            self._substep(start, h)
            self._end_substep(h, self._after(k + 1), start + h)
        self._steps += 1
        self._finish_step()

    def _record_compiled(self, result: CompiledSteps) -> None:
        """Log the contacts of substeps, and call the observer."""
        if self._log is None:
            return
        if self._observer is None and not (len(result.log.pair) or self._log.is_open):
            return
        step, k = np.divmod(np.arange(len(result.log.same)), self._settings.substeps)
        starts = (self._steps + step) * self._settings.dt + k * self._h
        pairs = record_contacts(self._log, result.log, starts + self._h, self._observer is not None)
        if self._observer is not None:
            observe_path(self._observer, starts, result.path, pairs)

    def _make_step(self, part: float) -> None:
        """Advance by the whole substeps in a fraction of dt, then by a shorter one."""
        whole, rest = divmod(part * self._settings.substeps, 1.0)
        begin, h = self._steps * self._settings.dt, self._h
        for k in range(int(whole)):
            start = begin + k * h
            self._substep(start, h)
            self._end_substep(h, self._after(k + 1), start + h)
        if rest > 0.0:
            end = (self._steps + part) * self._settings.dt
            self._substep(begin + whole * h, rest * h)
            self._end_substep(rest * h, end, end)

    def _substep(self, time: float, h: float) -> None:
        """Advance by h, s, from a time, s, and process the record of each step."""
        self._world.time = time
        try:
            for record in self._detection(self._world, h):
                self._observe(record)
        except Exhaustion:
            self._ended = True
            raise

    def _observe(self, record: StepRecord) -> None:
        """Update the energy ledger, joint breaker, contact log and one-way colliders from the record of a step."""
        world = self._world
        if self._energy is not None:
            self._energy.enter_step(record)
        if self._breaker is not None and record.joint_load is not None:
            self._breaker.add(record.h * record.joint_load)
        if self._log is not None:
            self._log_contacts(self._log, record)
        if world.one_way is not None:
            world.one_way.settle(world.pipeline.at_one_way(record.after[0]), world.poses(record.after))

    def _end_substep(self, h: float, broken_at: float, noted_at: float) -> None:
        """Break joints that were overloaded in a substep of h, s, and apply zones; the times are those of both, s."""
        if self._breaker is not None:
            self._break_joints(self._breaker.find_broken(h), broken_at)
            if not self._breaker.any_breakable:
                self._breaker, self._world.records_joint_load = None, False
        if self._zoned is not None:
            self._visit_zones(noted_at, self._zoned)

    def _break_joints(self, broken: IntArray, time: float) -> None:
        if len(broken):
            self._world.write_state()
            with self._attributed(Cause.PARTED):
                self._store.mark_broken(broken, time)
                self._rebuild()

    def _visit_zones(self, time: float, store: ZonedBodyStore) -> None:
        """Apply zones to the bodies that entered or left one, and log the entries at a time, s."""
        if store.detect(self._world.centres(self._world.x)):
            self._world.write_state()
            with self._attributed(Cause.DRIVES):
                if store.apply_zones():
                    self._rebuild()
        visits = store.tracker.drain_entries()
        if self._log is not None and visits is not None:
            # The contacts of the substep are already logged with their impulses; here they only continue.
            lasting = self._last_contacts._replace(impulse=np.zeros_like(self._last_contacts.impulse))
            self._log.record(time, join_batches(lasting, visits))

    def _rebuild(self) -> None:
        """Update the world and the energy ledger after a change of the body store."""
        self._world.rebuild()
        if self._energy is not None:
            self._energy.rebuild()
        if self._log is not None:
            self._log.can_repeat_pairs = self._can_repeat_pairs

    @property
    def _can_repeat_pairs(self) -> bool:
        """Whether one record can contain several contacts of a pair: of its shapes, or before and at an impact."""
        return self._settings.detection != "discrete" or self._world.pipeline.can_repeat_pairs

    def _attributed(self, cause: Cause) -> AbstractContextManager[None]:
        """Attribute the change of energy by changes of the body store within the context to one cause."""
        return nullcontext() if self._energy is None else self._energy.attributing(cause)

    def _finish_step(self) -> None:
        """Write the state to the body store, check that it is finite and bounded, and remove expired bodies."""
        self._world.write_state()
        beyond = self._store.beyond()
        if beyond is not None:
            self._ended = True
            raise Divergence(self.time, self.bodies.names[beyond], BEYOND)
        if self._store.can_expire:
            expired = self._store.expired(self.time)
            if len(expired):
                self._remove_bodies(expired)

    def _remove_bodies(self, indices: IntArray) -> None:
        with self._attributed(Cause.RETIRED):
            self._store.remove_bodies(indices, self.time)
            self._rebuild()

    def apply(self, action: Action) -> None:
        """Apply an action at once.

        Raises:
            ActionError: the action cannot be applied. The simulation is left unchanged.
        """
        with self._lock:
            self._check_running()
            if isinstance(action, (Throttle, Steer)):  # nothing is derived from the levels of thrusts and tyres
                apply_action(action, self._store)
                return
            if isinstance(action, Spawn):
                self._check_shape(action.single)
            with self._attributed(Cause.ACTIONS):
                leaving = apply_action(action, self._store)
                if not (isinstance(action, Impulse) and self._world.read_velocities()):
                    self._rebuild()
            if leaving is not None:
                self._remove_bodies(np.asarray([leaving]))

    def _check_shape(self, spec: BodySpec) -> None:
        """Refuse a body that the chosen detection or response does not support.

        Raises:
            ActionError: it is not supported.
        """
        if self._settings.detection == "swept" and spec.collides != "none" and not isinstance(spec, Disc):
            raise ActionError("detection 'swept' supports balls only; 'bisect' supports polygons too")
        if spec.kinematic and self._settings.detection in ("bisect", "swept"):
            raise ActionError(f"detection {self._settings.detection!r} does not support kinematic bodies")
        if spec.kinematic and (self._settings.impact == "dissipative" or self.scene.attractions):
            other = "attraction" if self.scene.attractions else "impact 'dissipative'"
            raise ActionError(f"reference does not model {other} and kinematic bodies together")
        resists = may_resist_rolling(spec, self.scene)
        if resists and self._settings.response == "penalty":
            raise ActionError("response 'penalty' does not support rolling_resistance; response 'impulse' does")
        if resists and self._settings.impact == "dissipative":
            raise ActionError("impact 'dissipative' does not support rolling_resistance; impact 'newton' does")
        if self._settings.response == "penalty" and _has_falloff(spec, self.scene):
            raise ActionError("response 'penalty' does not support restitution_falloff; response 'impulse' does")

    def frame(self) -> Frame:
        """Return the present state."""
        r = self._store
        position, velocity, angle, spin = (a.copy() for a in (r.position, r.velocity, r.angle, r.angular_velocity))
        layer = r.layer.copy() if len(r.scene.layers) > 1 else None
        visits = r.visits.copy() if r.scene.zones else None
        drives = r.drives.copy() if len(r.drives) else None
        present, passing = r.present.copy(), None if self._world.one_way is None else self._world.one_way.passing
        return Frame(self.time, position, velocity, angle, spin, present, None, layer, visits, drives, passing)

    def contacts(self) -> Contacts:
        """Return the contacts since the last call; the first call starts the recording."""
        if self._log is None:
            self._log = ContactLog(len(self._store.scene.fixed_names), self._can_repeat_pairs)
            overlaps = self._world.present_contacts()
            now = _contact_batch(overlaps, np.zeros((overlaps.size, 2)))
            if self._zoned is not None:  # entries are logged now and again with the first substep
                self._initial_entries = self._zoned.tracker.drain_entries()
            self._log.record(
                self.time, now if self._initial_entries is None else join_batches(now, self._initial_entries)
            )
        return self._log.take()

    def account(self) -> Mapping[Cause, float]:
        """Return the energy change, J, by each cause since the first call."""
        if self._energy is None:
            self._energy = StepEnergyLedger(self._store, self._world)
        return self._energy.account.entries()

    def watch(self, observer: Observer) -> None:
        """Register an observer, called after every substep and every impact within one; records contacts too."""
        if self._log is None:
            self.contacts()
        self._observer = observer

    def _log_contacts(self, log: ContactLog, record: StepRecord) -> None:
        """Log the contacts of a step, and call the observer."""
        end = self._world.time
        self._last_contacts = now = _contact_batch(
            *_drop_rounding(*record.all_contacts(), record.after[1], self._store.inverse_mass)
        )
        visits, self._initial_entries = self._initial_entries, None
        log.record(end, now if visits is None else join_batches(now, visits))
        if self._observer is not None:
            # The observer may keep these arrays: they are never written to again.
            centres = self._world.centres
            self._observer(record.time, centres(record.before), centres(record.after), log.pairs())


def _has_falloff(spec: BodySpec, scene: Scene) -> bool:
    """Return whether a body to be added has contacts with velocity-dependent restitution."""
    own = {element.material for element in surface_parts((spec,))}
    falloffs = [element.restitution_falloff for element in surface_parts((spec,))]
    falloffs += [material.restitution_falloff for material in scene.materials if material.name in own]
    falloffs += [pair.restitution_falloff for pair in scene.pairs if own.intersection(pair.between)]
    return any(falloffs)


def _drop_rounding(
    contacts: Manifolds, impulse: FloatArray, rates: FloatArray, inverse_mass: FloatArray
) -> tuple[Manifolds, FloatArray]:
    """Drop contacts whose overlap and impulse are rounding errors, as of bodies that move together after an impact."""
    if not contacts.size:
        return contacts, impulse
    first, second = contacts.first, contacts.second
    speed = np.hypot(rates[:, 0], rates[:, 1])
    # A static collider has no row; that of the first body is used for it.
    other = np.where(second >= 0, second, first)
    kick = np.hypot(impulse[:, 0], impulse[:, 1]) * np.maximum(inverse_mass[first], inverse_mass[other])
    real = contacts.separation < -CONTACT_ROUNDING * contacts.rn.sum(axis=1)
    real |= kick > CONTACT_ROUNDING * (speed[first] + speed[other])
    return (contacts, impulse) if real.all() else (contacts.of(real), impulse[real])


def _contact_batch(contacts: Manifolds, impulse: FloatArray) -> ContactBatch:
    """Return contacts as the contact log stores them: complex numbers, with the impulse on the first body."""
    if not contacts.size:
        return NO_CONTACTS
    normal = contacts.normal[:, 0] + 1j * contacts.normal[:, 1]
    point = contacts.point[:, 0] + 1j * contacts.point[:, 1]
    given = normal * (impulse[:, 0] + 1j * impulse[:, 1])
    return ContactBatch(contacts.first.copy(), contacts.second.copy(), -given, normal, point)
