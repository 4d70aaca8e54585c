"""Event-driven simulation of discs among planes, walls and posts."""

from collections.abc import Callable, Mapping
from typing import ClassVar

import numpy as np

from sandbox.arrays import BoolArray, IntArray
from sandbox.engines.common.energy_balance import record_energy_change
from sandbox.engines.common.frame_rows import FrameRows
from sandbox.engines.contract import Members
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.exact.common import state as c
from sandbox.engines.exact.common.bodies import EventDrivenBodies
from sandbox.engines.exact.common.event_driven import FIRST_LOG_ROWS, EventDrivenSimulation, last_event_bodies
from sandbox.engines.exact.common.record import account_slips, drain_log, log_supports, open_support_row, with_log_rows
from sandbox.engines.exact.common.state import EventState, make_state, rebuild, with_new_walls
from sandbox.engines.exact.events import (
    BATCHES_PER_BUDGET,
    MAX_BATCH_RATE,
    MOVING_CORNER,
    TOO_DENSE,
    TOO_FAST,
    advance,
    advance_frames,
    advance_to,
    evaluate,
    predict_all,
    rebuild_all,
    rebuild_ball,
    rebuild_from,
    run_starts,
)
from sandbox.engines.exact.prediction import predict_next_event
from sandbox.engines.exact.rest import recheck_supports, release_supports
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Contacts

MEMBERS_PER_CALL = 64
"""Runs of an ensemble in one call of a kernel, so that Python can handle signals in between."""

PER_SECOND, PER_SECOND_AND_BALL = 1_000_000, 1_000
"""Largest number of events in one simulated second: the first, or the second for each ball if that is more."""


class ExactSimulation(EventDrivenSimulation[EventState]):
    """A running scene of discs. Balls rest, slide and roll on lines in closed form.

    The end of a series of bounces is accounted to restitution, and the energy of a micro-bounce is phantom energy.
    """

    ENERGY_COLUMNS: ClassVar[Mapping[Cause, tuple[int, ...]]] = {
        Cause.RESTITUTION: (c.BY_NORMAL,),
        Cause.FRICTION: (c.BY_FRICTION,),
        Cause.KICKS: (c.BY_KICKS,),
        Cause.DRIVES: (c.BY_SURFACES,),
        Cause.PHANTOM: (c.BY_PHANTOM,),
    }

    def __init__(self, setup: Setup, settings: Settings) -> None:
        store = EventDrivenBodies(setup, settings.dt)
        super().__init__(settings, make_state(store), store)
        self._set_event_limit()
        with np.errstate(all="ignore"):
            rebuild_all(self._data)

    @property
    def events(self) -> int:
        """Number of events so far."""
        return int(self._data.counts[c.EVENTS])

    def contacts(self) -> Contacts:
        """Return the contacts since the last call; the first call starts the recording."""
        data, now = self._data, self.time
        with np.errstate(all="ignore"):
            if not data.counts[c.RECORDING]:
                self._data = data = with_log_rows(data, max(FIRST_LOG_ROWS, 4 * len(data.state)))
                data.counts[c.RECORDING], data.world[c.NOW] = 1, now
                data.state[:, c.LOGGED_UNTIL] = now
                for i, slot in np.argwhere(data.tags[:, c.SUPPORT : c.SUPPORT + 2] >= 0).tolist():
                    open_support_row(data, i, slot)
            log_supports(data, now)
        return drain_log(data)

    def _call_event_loop(self, until: float) -> int:
        return advance(self._data, until)

    def run_members(self, members: Members, steps: float, is_stopped: Callable[[], bool]) -> BoolArray:
        """Run the scene from each start, and write the end states in their place, as `MemberRunner.run_members`."""
        is_done = np.zeros(len(members.position), np.bool_)
        if self._store.can_expire:
            return is_done
        data, start = make_state(self._store), make_state(self._store)
        for each in (data, start):
            each.counts[c.MAX_EVENTS] = self._data.counts[c.MAX_EVENTS]
        for begin in range(0, len(is_done), MEMBERS_PER_CALL):
            if is_stopped():
                break
            rows = slice(begin, begin + MEMBERS_PER_CALL)
            run_starts(
                data,
                start,
                steps * self._settings.dt,
                members.position[rows],
                members.velocity[rows],
                members.angle[rows],
                members.angular_velocity[rows],
                is_done[rows],
            )
        return is_done

    def _advance_frames(self, rows: FrameRows, steps: int) -> tuple[int, int, int, int]:
        store = self._store
        state = store.position, store.velocity, store.roll, store.angle, store.angular_velocity
        return advance_frames(self._data, rows, self._settings.dt, self._steps, steps, *state)

    def _too_many_events(self, status: int) -> str:
        """Return the message for an exceeded event limit or a motion that is not modelled.

        It has the time, the limit and the bodies of the last event.
        """
        counts, limit = self._data.counts, int(self._data.counts[c.MAX_EVENTS])
        if status == MOVING_CORNER:
            ball = self.bodies.names[int(counts[c.EVENT_BODY])]
            return (
                f"at {float(self._data.world[c.NOW]):.9g} s: a ball between two supports, one of which has a moving "
                f"surface, which the engine does not model; last event of {ball!r}; engines that can: pymunk, reference"
            )
        if status == TOO_FAST:
            count, span = 2 * limit // BATCHES_PER_BUDGET, 2.0 / (MAX_BATCH_RATE * BATCHES_PER_BUDGET)
            excess = f"{count:,} events within {span:.3g} s where the limit is {limit:,} per second"
        elif status == TOO_DENSE:
            excess = f"more than {int(counts[c.IN_INSTANT]) - 1:,} events within an instant"
        else:
            excess = f"more than {int(counts[c.IN_SECOND]) - 1:,} events within one second"
        kinds = c.LINE, c.VERTEX, c.BALL
        last_bodies = last_event_bodies(self._data, self.bodies.names, self.scene.fixed_names, kinds)
        return (
            f"at {float(self._data.world[c.NOW]):.9g} s: {excess}, last of {last_bodies}; engines with time steps can "
            "continue: pymunk, reference"
        )

    def _double_log(self) -> None:
        self._data = with_log_rows(self._data, 2 * len(self._data.log))

    def _start_accounting(self) -> None:
        self._data.state[:, c.ENERGY_UNTIL], self._data.state[:, c.ENERGY_RESIDUAL] = self.time, 0.0

    def _account_motion(self) -> None:
        account_slips(self._data, self.time, 0.0)

    def _evaluate(self) -> None:
        store = self._store
        with np.errstate(all="ignore"):
            state = (store.position, store.velocity, store.angle, store.angular_velocity)
            evaluate(self._data, self.time, *state)

    def _rebuild(self) -> None:
        """Copy the changes of an action from the body store into the state arrays, and predict again."""
        store, now = self._store, self.time
        changed = sorted(store.velocity_set | store.position_set)
        for i in changed:
            advance_to(self._data, i, now, 0.0)
            self._data.state[i, c.X : c.Y + 1], self._data.state[i, c.VX : c.VY + 1] = (
                store.position[i],
                store.velocity[i],
            )
            self._data.state[i, c.ANGLE], self._data.state[i, c.SPIN] = store.angle[i], store.angular_velocity[i]
        data = self._data
        for i in store.position_set:
            release_supports(data, i)
        if store.walls_changed:
            for i in data.moving_balls.tolist():
                advance_to(data, i, now, 0.0)
                release_supports(data, i)
            self._data = data = with_new_walls(data, store)
        if store.scene_changed:
            known = len(data.state)
            self._data = data = rebuild(data, store)
            data.state[known:, c.T] = now  # the rows of spawned bodies begin now
            self._set_event_limit()
            rebuild_from(data, now)
            return
        data.world[c.NOW], data.world[c.NOW_RESIDUAL] = now, 0.0
        for i in changed:
            if data.state[i, c.INVERSE_MASS] > 0.0:
                recheck_supports(data, i)
                rebuild_ball(data, i)
        if any(self.bodies.fixed[i] for i in changed):
            predict_all(data)  # a fixed body that has moved may now be in the path of any ball
        for i in changed:
            if data.state[i, c.INVERSE_MASS] > 0.0:
                predict_next_event(data, i, now, 0.0)

    def _remove(self, indices: IntArray) -> None:
        """Remove bodies by index; they keep their positions and have no velocity."""
        now = self.time
        with np.errstate(all="ignore"):
            for i in indices.tolist():
                advance_to(self._data, i, now, 0.0)
                release_supports(self._data, i)
                self._data.state[i, c.VX : c.SPIN + 2] = 0.0
                self._data.next_time[i] = np.inf
                self._data.tags[i, c.VERSION] += 1
        with record_energy_change(self._ledger, Cause.RETIRED, self):
            self._store.remove_bodies(indices, now)
        self._data = rebuild(self._data, self._store)

    def _set_event_limit(self) -> None:
        """Set the largest number of events in one second."""
        self._data.counts[c.MAX_EVENTS] = max(PER_SECOND, PER_SECOND_AND_BALL * len(self._data.moving_balls))
