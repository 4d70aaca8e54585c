"""Balls and pucks on a surface: the tabletop stepper, with the circle pipeline as its collision detector.

Balls move in closed form within a substep, and each collision is resolved at its time of impact; see
`engines.tabletop`. The candidates of a substep are all pairs that can have touched within it: those whose separation at
its end is less than their largest relative displacement. So no ball tunnels, at any speed.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from sandbox.action import Action, ActionError
from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.actions import apply_action
from sandbox.engines.common.base import SteppedSimulation
from sandbox.engines.common.body_store import NOTHING, BodyStore, HasBodyStore
from sandbox.engines.common.contact_log import ContactLog
from sandbox.engines.common.energy_balance import record_energy_change
from sandbox.engines.common.kernel import warn_if_uncompiled
from sandbox.engines.contract import Divergence, Exhaustion, Observer
from sandbox.engines.energy_ledger import Cause, EnergyLedger
from sandbox.engines.reference.collision import CirclePipeline
from sandbox.engines.tabletop.contacts import SKIN
from sandbox.engines.tabletop.requirements import unsupported_by_steppers
from sandbox.engines.tabletop.stepper import BallArrays, TabletopStepper
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import BodySource, BodySpec
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Contacts, Frame


class TabletopBodyStore(BodyStore):
    """Bodies of a running scene on a surface, and the stepper that advances them in their arrays."""

    def __init__(self, setup: Setup, settings: Settings) -> None:
        super().__init__(setup, settings.h)
        self.stepper = TabletopStepper(setup.scene, settings)
        self._rebuild_stepper()

    def _rebuild_stepper(self) -> None:
        """Update the stepper after a change of the bodies or of the scene."""
        self.stepper.rebuild(self.scene, self.contact_matrix)
        state = BallArrays(self.position, self.velocity, self.roll, self.angular_velocity, self.angle)
        self.stepper.rebuild_arrays(state, self.bodies, self.present)

    def constant_forces(self) -> Iterator[tuple[int, tuple[FloatArray, float]]]:
        """Yield the index of each body with a constant force or torque, and these, N and N·m."""
        for index in np.flatnonzero(self.force.any(axis=1) | (self.torque != 0.0)).tolist():
            yield index, (self.force[index], float(self.torque[index]))

    def set_velocity(self, index: int, velocity: FloatArray) -> None:
        """Set the velocity of a body, m/s.

        Raises:
            ActionError: it lies in a pocket.
        """
        self.stepper.check_in_play(index, self.bodies.names[index])
        super().set_velocity(index, velocity)

    def set_spin(self, index: int, spin: float) -> None:
        """Set the angular velocity of a body, rad/s.

        Raises:
            ActionError: it lies in a pocket.
        """
        self.stepper.check_in_play(index, self.bodies.names[index])
        super().set_spin(index, spin)

    def set_constant_force(self, index: int, force: FloatArray, torque: float) -> None:
        """Apply a constant force (N) and torque (N·m) to a body from now on.

        Raises:
            ActionError: it lies in a pocket.
        """
        self.stepper.check_in_play(index, self.bodies.names[index])
        super().set_constant_force(index, force, torque)

    def move_body(self, index: int, position: FloatArray) -> None:
        """Set the position of a body, m; a body in a pocket returns to play."""
        super().move_body(index, position)
        if self.stepper.pocket[index] >= 0:
            self.stepper.return_to_play(index)

    def change(self, setup: Setup, spawned: tuple[BodySource, ...] | None = None) -> None:
        """Continue with a changed scene, as `BodyStore.change`.

        Raises:
            ActionError: as `BodyStore.change`, or the scene has something that is not supported on a surface.
        """
        reason = next(unsupported_by_steppers(setup, self.bodies), None)
        if reason is not None:
            raise ActionError(reason)
        super().change(setup, spawned)
        self._rebuild_stepper()

    def add(self, single: BodySpec, name: str) -> int:
        """Add a body that has been checked, and return its index.

        Raises:
            ActionError: as `BodyStore.add`, or the body is not supported on a surface.
        """
        reason = next(unsupported_by_steppers(self.setup, self.bodies.joined_by(single, name)), None)
        if reason is not None:
            raise ActionError(reason)
        index = super().add(single, name)
        self._rebuild_stepper()
        return index

    def remove_bodies(self, indices: IntArray, time: float) -> None:
        """Remove bodies at a time, s, also from their pockets."""
        super().remove_bodies(indices, time)
        self.stepper.remove(indices)
        self._rebuild_stepper()


class CirclePairFinder:
    """`PairFinder` that uses the broad phase and narrow phase of this engine.

    Args:
        store: the bodies, whose positions the stepper writes.
        settings: with every choice filled in.
    """

    def __init__(self, store: TabletopBodyStore, settings: Settings) -> None:
        assert settings.broad_phase is not None
        self._store, self._h = store, settings.h
        self.pipeline = CirclePipeline(store, settings.broad_phase)

    def rebuild(self) -> None:
        """Update after a change of the bodies or static colliders."""
        self.pipeline.rebuild()

    def find_pairs(self, velocity: FloatArray) -> IntArray:
        """Return the pairs (K, 2) that can have touched in a substep with mean velocities (N, 2), m/s."""
        pipeline, position = self.pipeline, self._store.position
        fastest = float(np.sqrt((velocity * velocity).sum(axis=1).max(initial=0.0)))
        margin = 2.0 * (SKIN * pipeline.max_radius + self._h * fastest)
        contacts = pipeline.manifolds(position, pipeline.candidates(position, margin), margin)
        first, second = contacts.first, contacts.second
        mask = self._store.stepper.balls.collision_mask  # NOTHING for balls in pockets, too
        collides = (mask[first] != NOTHING) & ((second < 0) | (mask[np.maximum(second, 0)] != NOTHING))
        return np.column_stack((first[collides], second[collides]))

    def set_position(self, index: int, position: FloatArray) -> None:
        """Set the position of a ball: it is in the arrays of the store already."""


class ReferenceTabletopSimulation(HasBodyStore, SteppedSimulation):
    """A running scene of balls or pucks on a surface."""

    _store: TabletopBodyStore

    def __init__(self, setup: Setup, settings: Settings) -> None:
        """Start from a setup.

        Raises:
            Exhaustion: the first collision detection needs more memory or work than its limit.
        """
        super().__init__(settings)
        self._store = TabletopBodyStore(setup, settings)
        self._stepper, self._h = self._store.stepper, settings.h
        self._finder = CirclePairFinder(self._store, settings)
        self._log: ContactLog | None = None
        self._stepper.capture()
        self._finder.pipeline.check_limits(self._store.position)
        warn_if_uncompiled(len(setup.bodies))

    @property
    def work(self) -> Mapping[str, int]:
        """Work counters since the start. Collisions are resolved one by one, without iterations."""
        return {"substeps": self.substeps, **self._finder.pipeline.work}

    def _advance(self, part: float) -> None:
        """Advance by the whole substeps in a fraction of dt, then by a shorter one."""
        whole, rest = divmod(part * self._settings.substeps, 1.0)
        begin = self._steps * self._settings.dt
        for k in range(int(whole)):
            self._substep(begin + k * self._h, 1.0)
        if rest > 0.0:
            self._substep(begin + whole * self._h, rest)

    def _substep(self, start: float, fraction: float) -> None:
        """Advance by a fraction of a substep from a time, s; log contacts and call the observer."""
        stepper = self._stepper
        before = self._observed_positions() if self._observer is not None else None
        if self._log is None:
            stepper.drain_contacts()  # captures before recording started are dropped
        try:
            stepper.step(self._finder, self._store.constant_forces(), fraction)
        except Exhaustion:
            self._ended = True
            raise
        stepper.capture()
        if self._log is not None:
            self._log.record(start + self._h * fraction, stepper.drain_contacts())
            if self._observer is not None and before is not None:
                self._observer(start, before, self._observed_positions(), self._log.pairs())

    def _observed_positions(self) -> FloatArray:
        """Return the centres, (N, 2) m, for an observer; nan for balls in pockets."""
        position = self._store.position.copy()
        position[self._stepper.pocket >= 0] = np.nan
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
        self._finder.rebuild()

    def apply(self, action: Action) -> None:
        """Apply an action at once.

        Raises:
            ActionError: the action cannot be applied. The simulation is left unchanged.
        """
        with self._lock:
            self._check_running()
            with record_energy_change(self._stepper.account, Cause.ACTIONS, self):
                leaving = apply_action(action, self._store)
            self._stepper.capture()
            self._finder.rebuild()
            if leaving is not None:
                self._remove_bodies(np.asarray([leaving]))

    def frame(self) -> Frame:
        """Return the present state."""
        store = self._store
        position, velocity, roll = store.position.copy(), store.velocity.copy(), store.roll.copy()
        angle, spin = store.angle.copy(), store.angular_velocity.copy()
        return Frame(self.time, position, velocity, angle, spin, store.present.copy(), roll)

    def contacts(self) -> Contacts:
        """Return the contacts since the last call; the first call starts the recording."""
        if self._log is None:
            self._log = ContactLog(len(self.scene.fixed_names), self._stepper.can_repeat_pairs)
            self._log.record(self.time, self._stepper.drain_contacts())
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
