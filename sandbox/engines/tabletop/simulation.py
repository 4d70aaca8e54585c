"""Balls and pucks on a surface: the simulation that engines with time steps start for such a scene.

Balls move in closed form within a substep, and each collision is resolved at its time of impact; see `stepper`. An
engine adds its collision detector, which decides whether fast balls can tunnel.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Protocol

import numpy as np

from sandbox.action import Action, ActionError
from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.actions import apply_action, has_same_bodies
from sandbox.engines.common.base import SteppedSimulation
from sandbox.engines.common.body_store import BodyStore, HasBodyStore
from sandbox.engines.common.contact_log import ContactBatch, ContactLog, join_batches
from sandbox.engines.common.energy_balance import record_energy_change
from sandbox.engines.common.kernel import warn_if_uncompiled
from sandbox.engines.common.zoned_bodies import ZonedBodyStore
from sandbox.engines.contract import Divergence, Exhaustion, Observer
from sandbox.engines.energy_ledger import Cause, EnergyLedger
from sandbox.engines.tabletop.motion import TabletopBalls
from sandbox.engines.tabletop.requirements import pockets_at, unsupported_by_steppers
from sandbox.engines.tabletop.stepper import BallArrays, PairFinder, TabletopStepper
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import ContactMatrix
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import BodySource, BodySpec
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Contacts, Frame


class CollisionDetector(PairFinder, Protocol):
    """`PairFinder` of a running scene."""

    @property
    def work(self) -> Mapping[str, int]:
        """Work counters since the start."""

    def rebuild(self) -> None:
        """Update after a change of the bodies, of their positions or layers, or of the static colliders.

        Raises:
            Exhaustion: collision detection needs more memory or work than its limit.
        """


class TabletopBodyStore(BodyStore):
    """Bodies of a running scene on a surface, and the stepper that advances them in their arrays."""

    stepper: TabletopStepper | None = None
    """advances the bodies; None while they are being created"""

    def start(self, settings: Settings) -> TabletopStepper:
        """Create the stepper, capture the balls that start in pockets, and return it."""
        self.stepper = TabletopStepper(self.scene, settings)
        self._rebuild_stepper()
        self.capture()
        return self.stepper

    @property
    def pocket(self) -> IntArray:
        """(N,) index of the pocket that each body lies in; −1 for none."""
        assert self.stepper is not None
        return self.stepper.pocket

    @property
    def balls(self) -> TabletopBalls:
        """Arrays of the balls, for kernels."""
        assert self.stepper is not None
        return self.stepper.balls

    def capture(self) -> bool:
        """Capture balls in pockets; return whether there were any."""
        assert self.stepper is not None
        return len(self.stepper.capture()) > 0

    def _rebuild(self, setup: Setup, bodies: Bodies, matrix: ContactMatrix) -> None:
        super()._rebuild(setup, bodies, matrix)
        self._rebuild_stepper()

    def _rebuild_stepper(self) -> None:
        """Update the stepper after a change of the bodies or of the scene."""
        if self.stepper is not None:
            self.stepper.rebuild(self.scene, self.contact_matrix, self.static_colliders)
            state = BallArrays(self.position, self.velocity, self.roll, self.angular_velocity, self.angle)
            self.stepper.rebuild_arrays(state, self.bodies, self.present, self.held_by_zone)

    def constant_forces(self) -> Iterator[tuple[int, tuple[FloatArray, float]]]:
        """Yield the index of each body with a constant force or torque, and these, N and N·m."""
        if self.force.any() or self.torque.any():
            yield from self._forces_of(self.force)

    def _forces_of(self, force: FloatArray) -> Iterator[tuple[int, tuple[FloatArray, float]]]:
        """Yield index, force and torque of each body that moves and has one, given all forces (N, 2), N."""
        acts = (force.any(axis=1) | (self.torque != 0.0)) & self.moving
        for index in np.flatnonzero(acts).tolist():
            yield index, (force[index], float(self.torque[index]))

    def _check_in_play(self, index: int) -> None:
        """Refuse to set a body in motion that lies in a pocket.

        Raises:
            ActionError: it does.
        """
        if self.stepper is not None:
            self.stepper.check_in_play(index, self.bodies.names[index])

    def set_velocity(self, index: int, velocity: FloatArray) -> None:
        """Set the velocity of a body, m/s.

        Raises:
            ActionError: it lies in a pocket.
        """
        self._check_in_play(index)
        super().set_velocity(index, velocity)

    def set_spin(self, index: int, spin: float) -> None:
        """Set the angular velocity of a body, rad/s.

        Raises:
            ActionError: it lies in a pocket.
        """
        self._check_in_play(index)
        super().set_spin(index, spin)

    def set_constant_force(self, index: int, force: FloatArray, torque: float) -> None:
        """Apply a constant force (N) and torque (N·m) to a body from now on.

        Raises:
            ActionError: it lies in a pocket.
        """
        self._check_in_play(index)
        super().set_constant_force(index, force, torque)

    def move_body(self, index: int, position: FloatArray) -> None:
        """Set the position of a body, m; a body in a pocket returns to play."""
        if self.stepper is not None and self.pocket[index] >= 0:
            self.stepper.return_to_play(index)
        super().move_body(index, position)

    def change(self, setup: Setup, spawned: tuple[BodySource, ...] | None = None) -> None:
        """Continue with a changed scene, as `BodyStore.change`.

        Raises:
            ActionError: as `BodyStore.change`, or the scene has something that is not supported on a surface.
        """
        has_same = spawned is None and has_same_bodies(setup.scene, self.scene)
        is_checked = has_same and setup.scene.world is self.scene.world
        if not is_checked and (reason := next(unsupported_by_steppers(setup, self.bodies), None)):
            raise ActionError(reason)
        super().change(setup, spawned)
        if has_same:  # else it has been rebuilt with the bodies
            self._rebuild_stepper()

    def add(self, single: BodySpec, name: str) -> int:
        """Add a body that has been checked, and return its index.

        Raises:
            ActionError: as `BodyStore.add`, or the body is not supported on a surface.
        """
        reason = next(unsupported_by_steppers(self.setup, self.bodies.joined_by(single, name)), None)
        if reason is not None:
            raise ActionError(reason)
        return super().add(single, name)

    def remove_bodies(self, indices: IntArray, time: float) -> None:
        """Remove bodies at a time, s, also from their pockets."""
        super().remove_bodies(indices, time)
        if self.stepper is not None:
            self.stepper.remove(indices)


class ZonedTabletopBodyStore(TabletopBodyStore, ZonedBodyStore):
    """Body store of a scene with zones, in which no zone senses a ball in a pocket."""

    def constant_forces(self) -> Iterator[tuple[int, tuple[FloatArray, float]]]:
        """Yield the index of each body with a constant force or torque, and these, N and N·m; with zones' gravity."""
        if self.with_own_gravity:
            return self._forces_of(self.force + self.gravity * self.bodies.mass[:, None])
        return super().constant_forces()

    def _sensed(self) -> BoolArray:
        pocket = pockets_at(self.scene, self.position) if self.stepper is None else self.pocket
        return super()._sensed() & (pocket < 0)

    def capture(self) -> bool:
        """Capture balls in pockets; return whether there were any."""
        captured = super().capture()
        if captured:
            self._rebuild_zones()
        return captured

    def move_body(self, index: int, position: FloatArray) -> None:
        """Set the position of a body, m; a body in a pocket returns to play, and a zone that holds it releases it."""
        was_in_pocket = self.stepper is not None and bool(self.pocket[index] >= 0)
        super().move_body(index, position)
        if was_in_pocket:
            self._rebuild_zones()
            self.tracker.update_position(index)


class SteppedTabletopSimulation(HasBodyStore, SteppedSimulation):
    """A running scene of balls or pucks on a surface."""

    _store: TabletopBodyStore

    def __init__(
        self,
        setup: Setup,
        settings: Settings,
        make_detector: Callable[[TabletopBodyStore, Settings], CollisionDetector],
    ) -> None:
        """Start from a setup.

        Args:
            setup: the setup.
            settings: with every choice filled in.
            make_detector: returns the collision detector of the engine.

        Raises:
            Exhaustion: the first collision detection needs more memory or work than its limit.
        """
        super().__init__(settings)
        self._zoned = ZonedTabletopBodyStore(setup, settings.h) if setup.scene.zones else None
        self._store = self._zoned or TabletopBodyStore(setup, settings.h)
        self._stepper, self._h = self._store.start(settings), settings.h
        self._detector = make_detector(self._store, settings)
        self._log: ContactLog | None = None
        warn_if_uncompiled(len(setup.bodies))

    @property
    def work(self) -> Mapping[str, int]:
        """Work counters since the start. Collisions are resolved one by one, without iterations."""
        return {"substeps": self.substeps, **self._detector.work}

    def _make_step(self, part: float) -> None:
        """Advance by the whole substeps in a fraction of dt, then by a shorter one."""
        whole, rest = divmod(part * self._settings.substeps, 1.0)
        begin = self._steps * self._settings.dt
        for k in range(int(whole)):
            self._substep(begin + k * self._h, 1.0)
        if rest > 0.0:
            self._substep(begin + whole * self._h, rest)

    def _substep(self, start: float, fraction: float) -> None:
        """Advance by a fraction of a substep from a time, s; capture balls, apply zones, and log contacts."""
        stepper, log = self._stepper, self._log
        before = self._observed_positions() if self._observer is not None else None
        if log is None:
            stepper.drain_contacts()  # captures before recording started are dropped
        try:
            stepper.step(self._detector, self._store.constant_forces(), fraction)
        except Exhaustion:
            self._ended = True
            raise
        if self._store.capture():
            self._detector.rebuild()
        entries = None if self._zoned is None else self._visit_zones(self._zoned)
        if log is not None:
            contacts = stepper.drain_contacts()
            log.record(start + self._h * fraction, contacts if entries is None else join_batches(contacts, entries))
            if self._observer is not None and before is not None:
                self._observer(start, before, self._observed_positions(), log.pairs())

    def _visit_zones(self, store: ZonedTabletopBodyStore) -> ContactBatch | None:
        """Apply zones to the bodies that have entered or left one; return the entries, None without any."""
        if store.detect(store.position):
            with record_energy_change(self._stepper.account, Cause.DRIVES, self):
                if store.apply_zones():
                    self._detector.rebuild()
        return store.tracker.drain_entries()

    def _observed_positions(self) -> FloatArray:
        """Return the centres, (N, 2) m, for an observer; nan for balls in pockets."""
        position = self._store.position.copy()
        position[self._store.pocket >= 0] = np.nan
        return position

    def _finish_step(self) -> None:
        """Check that the state is finite and bounded, and remove expired bodies."""
        beyond = self._stepper.beyond()
        if beyond is not None:
            self._ended = True
            raise Divergence(self.time, self.bodies.names[beyond[0]], beyond[1])
        expired = self._store.expired(self.time)
        if len(expired):
            self._remove_bodies(expired)

    def _remove_bodies(self, indices: IntArray) -> None:
        with record_energy_change(self._stepper.account, Cause.RETIRED, self):
            self._store.remove_bodies(indices, self.time)
        self._detector.rebuild()

    def apply(self, action: Action) -> None:
        """Apply an action at once.

        Raises:
            ActionError: the action cannot be applied. The simulation is left unchanged.
        """
        with self._lock:
            self._check_running()
            with record_energy_change(self._stepper.account, Cause.ACTIONS, self):
                leaving = apply_action(action, self._store)
            self._store.capture()
            self._detector.rebuild()
            if leaving is not None:
                self._remove_bodies(np.asarray([leaving]))

    def frame(self) -> Frame:
        """Return the present state."""
        store, scene = self._store, self.scene
        position, velocity, roll = store.position.copy(), store.velocity.copy(), store.roll.copy()
        angle, spin = store.angle.copy(), store.angular_velocity.copy()
        layer = store.layer.copy() if len(scene.layers) > 1 else None
        visits = store.visits.copy() if scene.zones else None
        return Frame(self.time, position, velocity, angle, spin, store.present.copy(), roll, layer, visits)

    def contacts(self) -> Contacts:
        """Return the contacts since the last call; the first call starts the recording."""
        if self._log is None:
            self._log = ContactLog(len(self.scene.fixed_names), self._stepper.can_repeat_pairs)
            contacts = self._stepper.drain_contacts()
            # Entries are logged now, and again with the first substep.
            entries = None if self._zoned is None else self._zoned.tracker.drain_entries(repeat=True)
            self._log.record(self.time, contacts if entries is None else join_batches(contacts, entries))
        return self._log.take()

    def account(self) -> Mapping[Cause, float]:
        """Return the energy change, J, by each cause since the first call."""
        self._stepper.account = self._stepper.account or EnergyLedger()
        return self._stepper.account.entries()

    def watch(self, observer: Observer) -> None:
        """Register an observer, called after every substep; records contacts too."""
        if self._log is None:
            self.contacts()
        self._observer = observer
