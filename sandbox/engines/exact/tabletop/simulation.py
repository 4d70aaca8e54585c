"""Event-driven simulation of balls or pucks on a surface: its steps, contact log and energy accounting."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.energy_balance import record_energy_change
from sandbox.engines.common.frame_rows import FrameRows
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.exact.common.bodies import EventDrivenBodies
from sandbox.engines.exact.common.event_driven import FIRST_LOG_ROWS, EventDrivenSimulation, last_event_bodies
from sandbox.engines.exact.common.record import resize_rows
from sandbox.engines.exact.tabletop import state as c
from sandbox.engines.exact.tabletop.events import advance, advance_frames, rebuild_all
from sandbox.engines.exact.tabletop.impact import account_floor, advance_all_to, evaluate
from sandbox.engines.exact.tabletop.state import TabletopState, contacts_of, make_tabletop_state, rebuild
from sandbox.resource_limits import EVENTS as EVENT_LIMIT
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Contacts


def with_log_rows(data: TabletopState, rows: int) -> TabletopState:
    """Return the state with room for the given number of log rows."""
    used = int(data.counts[c.LOG_ROWS])
    return data._replace(log=resize_rows(data.log, used, rows), log_tags=resize_rows(data.log_tags, used, rows))


def with_path_rows(data: TabletopState, rows: int) -> TabletopState:
    """Return the state with room for the given number of path segments."""
    used = int(data.counts[c.PATH_ROWS])
    return data._replace(path=resize_rows(data.path, used, rows), path_tags=resize_rows(data.path_tags, used, rows))


def drain_log(data: TabletopState) -> Contacts:
    """Return all logged contacts and clear the log."""
    rows = int(data.counts[c.LOG_ROWS])
    data.counts[c.LOG_ROWS] = 0
    return contacts_of(data.log[:rows], data.log_tags[:rows])


def too_many_events(data: TabletopState, names: Sequence[str], fixed_names: Sequence[str]) -> str:
    """Return the message for an exceeded event limit, with the time and the bodies of the last event."""
    last = last_event_bodies(data, names, fixed_names, (c.LINE, c.VERTEX, c.BALL))
    return (
        f"at {float(data.world[c.NOW]):.9g} s: {int(data.counts[c.EVENTS]):,} events, more than allowed, "
        f"last of {last}; an engine with time steps can continue: pymunk"
    )


PER_SECOND = 0.1
"""Events that each simulated second adds to the limit, as a fraction of the limit of one shot."""


class TabletopSimulation(EventDrivenSimulation[TabletopState]):
    """A running scene of balls or pucks on a `[surface]`.

    The work of the surface is accounted to friction. A captured ball is retired with all its energy. The energy of a
    micro-bounce is phantom energy.
    """

    ENERGY_COLUMNS: ClassVar[Mapping[Cause, tuple[int, ...]]] = {
        Cause.RESTITUTION: (c.BY_NORMAL,),
        Cause.FRICTION: (c.BY_FRICTION, c.BY_FLOOR),
        Cause.PHANTOM: (c.BY_PHANTOM, c.BY_MICRO_BOUNCES),
        Cause.RETIRED: (c.BY_CAPTURE,),
    }

    def __init__(self, setup: Setup, settings: Settings) -> None:
        store = EventDrivenBodies(setup, settings.dt)
        super().__init__(settings, make_tabletop_state(store), store)
        self._events_per_second = int(PER_SECOND * EVENT_LIMIT.value)
        with np.errstate(all="ignore"):
            self._rebuild_rows(0.0)

    @property
    def data(self) -> TabletopState:
        """State arrays of the kernels."""
        return self._data

    def contacts(self) -> Contacts:
        """Return the contacts since the last call; the first call starts the recording."""
        if not self._data.counts[c.RECORDING]:
            self._data = with_log_rows(self._data, max(FIRST_LOG_ROWS, 4 * len(self.bodies)))
            self._data.counts[c.RECORDING] = 1
        return drain_log(self._data)

    def _call_event_loop(self, until: float) -> int:
        self._data.counts[c.MAX_EVENTS] = self._events_per_second * (1 + int(until))
        return advance(self._data, until)

    def _advance_frames(self, rows: FrameRows, steps: int) -> tuple[int, int, int, int]:
        store = self._store
        state = store.position, store.velocity, store.roll, store.angle, store.angular_velocity
        numbers = self._settings.dt, self._steps, steps, self._events_per_second
        return advance_frames(self._data, rows, *numbers, *state)

    def _too_many_events(self, status: int) -> str:  # noqa: ARG002, there is only one limit
        reason = too_many_events(self._data, self.bodies.names, self.scene.fixed_names)
        return f"{reason}; {EVENT_LIMIT.remedy(10 * EVENT_LIMIT.value)}"

    def _double_log(self) -> None:
        self._data = with_log_rows(self._data, 2 * len(self._data.log))

    def _start_accounting(self) -> None:
        self._data.state[:, c.ENERGY_UNTIL] = self.time

    def _account_motion(self) -> None:
        account_floor(self._data, self.time)

    def _roll(self) -> FloatArray:
        return self._store.roll.copy()

    def _evaluate(self) -> None:
        store = self._store
        with np.errstate(all="ignore"):
            state = (store.position, store.velocity, store.roll, store.angle, store.angular_velocity)
            evaluate(self._data, self.time, *state)

    def _remove(self, indices: IntArray) -> None:
        """Remove bodies by index; they keep their positions and have no velocity."""
        with record_energy_change(self._ledger, Cause.RETIRED, self), np.errstate(all="ignore"):
            self._store.remove_bodies(indices, self.time)
        self._rebuild()

    def _rebuild(self) -> None:
        """Copy the changes of an action from the body store into the state arrays, and predict again."""
        advance_all_to(self._data, self.time)  # with the friction that held until now
        self._data = rebuild(self._data, self._store)
        self._rebuild_rows(self.time)

    def _rebuild_rows(self, time: float) -> None:
        rows = int(self._data.counts[c.LOG_ROWS]) + len(self.bodies)  # each ball may be captured at once
        if self._data.counts[c.RECORDING] and rows > len(self._data.log):
            self._data = with_log_rows(self._data, 2 * rows)
        store, state = self._store, self._data.state
        state[:, c.T] = state[:, c.ENERGY_UNTIL] = time
        state[:, c.X : c.Y + 1], state[:, c.VX : c.VY + 1] = store.position, store.velocity
        state[:, c.WX : c.WY + 1], state[:, c.WZ] = store.roll, store.angular_velocity
        rebuild_all(self._data, time)
        self._evaluate()
