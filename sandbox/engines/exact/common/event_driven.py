"""Base class of the event-driven simulations: discs in the plane, and balls or pucks on a surface."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from time import perf_counter
from typing import ClassVar, Generic, NoReturn, Protocol, TypeVar

import numpy as np

from sandbox.action import Action
from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.actions import apply_action
from sandbox.engines.common.base import BEYOND, SteppedSimulation, step_and_record
from sandbox.engines.common.compile_clock import COMPILE_CLOCK
from sandbox.engines.common.contact_log import too_many_contacts
from sandbox.engines.common.energy_balance import record_energy_change
from sandbox.engines.common.frame_rows import FrameRows, free_rows
from sandbox.engines.common.kernel import warn_if_uncompiled
from sandbox.engines.contract import Divergence, Exhaustion, Observer
from sandbox.engines.energy_ledger import Cause, EnergyLedger
from sandbox.engines.exact.common import state as c
from sandbox.engines.exact.common.bodies import EventDrivenBodies
from sandbox.frame_table import FrameTable
from sandbox.resource_limits import CONTACTS, PAIRS
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Contacts, Frame

FIRST_LOG_ROWS = 1024
"""Initial number of rows of the contact log."""


class StateArrays(Protocol):
    """State arrays that both simulations have, with the columns of `state`."""

    @property
    def world(self) -> FloatArray:
        """Global numbers, as `EventState.world`."""

    @property
    def counts(self) -> IntArray:
        """Global integers, as `EventState.counts`."""

    @property
    def line_tags(self) -> IntArray:
        """(F, …) tags of lines."""

    @property
    def vertex_tags(self) -> IntArray:
        """(K, …) tags of vertices."""


Data = TypeVar("Data", bound=StateArrays)


class EventDrivenSimulation(SteppedSimulation, Generic[Data]):
    """A simulation that advances from event to event in closed form.

    A kernel, the event loop, works on state arrays. Frames are evaluated between events and do not change these, so the
    motion does not depend on dt, bit for bit.
    """

    ENERGY_COLUMNS: ClassVar[Mapping[Cause, tuple[int, ...]]]
    """columns of `world` with the energy changes of each cause, J"""

    def __init__(self, settings: Settings, data: Data, store: EventDrivenBodies) -> None:
        """Take over the state arrays of a scene.

        Args:
            settings: solver settings; dt is the interval of frames.
            data: state arrays.
            store: bodies of the scene.
        """
        super().__init__(settings)
        self._store = store
        self._data: Data = data
        self._stopped: float | None = None
        self._ledger: EnergyLedger | None = None
        self._max_pair_tests = PAIRS.value
        self._tests_before: int | None = None  # `PAIR_TESTS` at the start of a step that a kernel has begun
        warn_if_uncompiled(len(store.bodies))

    @property
    def time(self) -> float:
        """Simulated time, s; after an `Exhaustion`, the time of the last event."""
        return super().time if self._stopped is None else self._stopped

    @property
    def setup(self) -> Setup:
        """State from which the simulation started, with the changes that actions have made to its scene."""
        return self._store.setup

    @property
    def bodies(self) -> Bodies:
        """The bodies by index, as they started; spawned bodies are appended."""
        return self._store.bodies

    @property
    def retired(self) -> Mapping[int, float]:
        """Time of removal of each removed body by index, s. Balls in pockets are not removed."""
        return self._store.retired

    @property
    def work(self) -> Mapping[str, int]:
        """Number of events, of predictions, and of balls, colliders and pockets tested in them, so far."""
        counts = self._data.counts
        return {
            "events": int(counts[c.EVENTS]),
            "predictions": int(counts[c.PREDICTIONS]),
            "pair_tests": int(counts[c.PAIR_TESTS]),
        }

    def apply(self, action: Action) -> None:
        """Apply an action now.

        Raises:
            ActionError: it cannot be applied. The simulation is unchanged.
        """
        with self._lock, np.errstate(all="ignore"):
            self._check_running()
            self._store.clear_changes()
            with record_energy_change(self._ledger, Cause.ACTIONS, self):
                leaving = apply_action(action, self._store)
            self._rebuild()
            if leaving is not None:
                self._remove(np.asarray([leaving]))

    def advance(self, steps: int, frames: FrameTable, *, until_event: bool = False) -> None:
        """Advance by at most so many time steps, and record the frames that are due, as `Simulation.advance`.

        One call of a kernel makes all steps, up to one that needs a larger log, or that the kernel interrupts.

        Raises:
            Divergence: the state of a body is not finite, or exceeds the bounds. It can still be read.
            Exhaustion: a step exceeds a resource limit.
        """
        if until_event or self.patience is not None or self._store.can_expire:
            step_and_record(self, 1 if until_event else steps, frames)
            return
        with self._lock, np.errstate(all="ignore"):
            self._check_running()
            made, status, tests = self._make_steps(steps, frames)
            frames.steps += made
            self._steps += made
            if status == c.BEYOND:
                self._steps += 1
                self._check_bounds()
        if status != c.DONE:
            self._tests_before = tests
            step_and_record(self, 1, frames)

    def _make_steps(self, steps: int, frames: FrameTable) -> tuple[int, int, int]:
        """Make steps and frames by the kernel; return the number of steps, the status and `PAIR_TESTS`, as it does."""
        bodies = len(self.bodies)
        frames.prepare(steps, bodies)
        rows = free_rows(frames, has_spin=self._roll() is not None)
        made, written, status, tests = self._advance_frames(rows, steps)
        frames.finish_rows(written, bodies)
        return made, status, tests

    def watch(self, observer: Observer) -> None:
        """Do nothing: there are no substeps after which an observer could be called."""

    def frame(self) -> Frame:
        """Return the present state."""
        store = self._store
        return Frame(
            self.time,
            store.position.copy(),
            store.velocity.copy(),
            store.angle.copy(),
            store.angular_velocity.copy(),
            store.present.copy(),
            self._roll(),
        )

    @abstractmethod
    def contacts(self) -> Contacts:
        """Return the contacts since the last call; the first call starts the recording."""

    def account(self) -> Mapping[Cause, float]:
        """Return the energy change by cause since the first call, J; the first call starts the accounting.

        Motion between events is in closed form, so there is no integration error and no correction of positions. What
        remains unexplained is rounding: at most 1e-9 of the kinetic energy.
        """
        with np.errstate(all="ignore"):
            if self._ledger is None:
                self._ledger = EnergyLedger()
                self._data.counts[c.ACCOUNTING] = 1
                self._start_accounting()
            self._account_motion()
            entries = dict(self._ledger.entries())
            for cause, columns in self.ENERGY_COLUMNS.items():
                entries[cause] += sum(float(self._data.world[column]) for column in columns)
            return entries

    @abstractmethod
    def _call_event_loop(self, until: float) -> int:
        """Process events up to a time, s; return `DONE`, `PAUSED`, `FULL` or the code of an exceeded limit."""

    @abstractmethod
    def _advance_frames(self, rows: FrameRows, steps: int) -> tuple[int, int, int, int]:
        """Make steps and frames as the kernel `advance_frames` does."""

    @abstractmethod
    def _too_many_events(self, status: int) -> str:
        """Return the message for an exceeded event limit."""

    @abstractmethod
    def _double_log(self) -> None:
        """Double the number of rows of the contact log."""

    @abstractmethod
    def _evaluate(self) -> None:
        """Write the motion at the present time into the body store."""

    @abstractmethod
    def _remove(self, indices: IntArray) -> None:
        """Remove bodies by index; they keep their positions and have no velocity."""

    @abstractmethod
    def _rebuild(self) -> None:
        """Copy the changes of an action from the body store into the state arrays, and predict again."""

    @abstractmethod
    def _start_accounting(self) -> None:
        """Mark the present time as the start of the accounting in each ball's row."""

    @abstractmethod
    def _account_motion(self) -> None:
        """Add the work of friction between events up to the present time."""

    def _roll(self) -> FloatArray | None:
        """Return the angular velocity about x and y, (N, 2) rad/s, for scenes that have one."""
        return None

    def _make_step(self, part: float) -> None:
        """Process all events in a fraction of dt; between calls of the event loop check the limits and grow the log."""
        until = (self._steps + part) * self._settings.dt
        start, compile_start = perf_counter(), COMPILE_CLOCK.seconds
        tests_before = int(self._data.counts[c.PAIR_TESTS]) if self._tests_before is None else self._tests_before
        self._tests_before = None
        while (status := self._call_event_loop(until)) != c.DONE:
            elapsed = perf_counter() - start - (COMPILE_CLOCK.seconds - compile_start)
            if self.patience is not None and elapsed > self.patience:
                self._exhaust(f"a step of {self._settings.dt:g} s takes longer than {self.patience:g} s to compute")
            if int(self._data.counts[c.PAIR_TESTS]) - tests_before > self._max_pair_tests:
                self._exhaust(
                    f"a step of {self._settings.dt:g} s has more than {PAIRS.shown(self._max_pair_tests)} pairs to "
                    f"test, after {self.work['events']:,} events; {PAIRS.remedy(10 * self._max_pair_tests)}"
                )
            if status == c.FULL:
                rows = int(self._data.counts[c.LOG_ROWS])
                if rows > CONTACTS.value:
                    self._exhaust(too_many_contacts(rows))
                self._double_log()
            elif status != c.PAUSED:
                self._exhaust(self._too_many_events(status))

    def _exhaust(self, reason: str) -> NoReturn:
        """End the simulation at the time of the last event."""
        self._ended = True
        self._stopped = float(self._data.world[c.NOW])
        self._evaluate()
        raise Exhaustion(reason)

    def _finish_step(self) -> None:
        """Evaluate the state, check that it is finite and in range, and remove expired bodies."""
        self._evaluate()
        self._check_bounds()
        expired = self._store.expired(self.time)
        if len(expired):
            self._remove(expired)

    def _check_bounds(self) -> None:
        """Check that the evaluated state is finite and in range."""
        diverged = self._store.beyond()
        if diverged is not None:
            self._ended = True
            raise Divergence(self.time, self.bodies.names[diverged], BEYOND)


def last_event_bodies(
    data: StateArrays,
    names: Sequence[str],
    fixed_names: Sequence[str],
    kinds: tuple[int, int, int],
) -> str:
    """Return the quoted names of the bodies of the last event.

    Args:
        data: state arrays.
        names: of the bodies.
        fixed_names: of the static colliders.
        kinds: codes of collisions with a line, a vertex and a ball.
    """
    kind, partner = int(data.counts[c.EVENT_KIND]), int(data.counts[c.EVENT_PARTNER])
    line, vertex, ball = kinds
    first = repr(names[data.counts[c.EVENT_BODY]])
    if kind == ball:
        return f"{first} and {names[partner]!r}"
    if kind in (line, vertex):
        collider = (data.line_tags if kind == line else data.vertex_tags)[partner, c.COLLIDER]
        return f"{first} and {fixed_names[collider]!r}"
    return first
