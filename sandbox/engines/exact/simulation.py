"""ExactSimulation: a scene running from event to event."""

from collections.abc import Mapping

import numpy as np

from sandbox.action import Action
from sandbox.engines.account import Account, Cause
from sandbox.engines.acting import perform
from sandbox.engines.booked import booked
from sandbox.engines.contact_log import MAX_ROWS
from sandbox.engines.exact.advance import (
    DONE,
    FULL,
    PAUSED,
    advance,
    arrive,
    changed,
    evaluate,
    look_ahead,
    renew,
    start,
)
from sandbox.engines.exact.arena import (
    ANGLE,
    BUDGET,
    EVENTS,
    LIGHTNESS,
    NOW,
    NOW_LATE,
    PAIR_TESTS,
    PREDICTIONS,
    RECORDING,
    ROWS,
    SINCE,
    SPIN,
    STAMP,
    SUPPORT,
    VX,
    VY,
    Arena,
    T,
    X,
    Y,
    arena_of,
    renewed,
    reshaped,
)
from sandbox.engines.exact.books import Books
from sandbox.engines.exact.driven import EventDriven
from sandbox.engines.exact.excess import too_many
from sandbox.engines.exact.hold import freed
from sandbox.engines.exact.log import log_rests, open_rest, taken, with_room
from sandbox.engines.exact.predict import predict
from sandbox.engines.exact.support import knocked
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import Contacts, Frame, IntArray

PER_SECOND, PER_SECOND_AND_BALL = 1_000_000, 1_000
"""Events that one simulated second may have: the first, or the second for each ball where that is more."""

FIRST_ROWS = 1024
"""Rows that the log of contacts starts with."""


class ExactSimulation(EventDriven):
    """A running scene.

    Between events every ball moves in closed form from its own last event on; frames are read off and change nothing.
    So positions do not depend on dt, bit for bit.
    """

    def __init__(self, scene: Scene, settings: Settings) -> None:
        super().__init__(scene, settings)
        self._books: Books | None = None
        self._arena: Arena = arena_of(self._troupe)
        self._allow()
        with np.errstate(all="ignore"):
            start(self._arena)

    @property
    def events(self) -> int:
        """How many events there have been."""
        return int(self._arena.counts[EVENTS])

    @property
    def work(self) -> Mapping[str, int]:
        """What was done so far: events, predictions, and at how many others, flats and knobs these looked."""
        counts = self._arena.counts
        return {
            "events": self.events,
            "predictions": int(counts[PREDICTIONS]),
            "pair_tests": int(counts[PAIR_TESTS]),
        }

    def apply(self, action: Action) -> None:
        """Do what an action says, now.

        Raises:
            ActionError: it cannot be done. Nothing has changed then.
        """
        with self._turn, np.errstate(all="ignore"):
            self._check_running()
            self._troupe.settled()
            with booked(self._outside, Cause.ACTIONS, self):
                leaving = perform(action, self._troupe)
            self._acted()
            if leaving is not None:
                self._take_out(np.asarray([leaving]))

    def frame(self) -> Frame:
        """Return the present state."""
        troupe = self._troupe
        return Frame(
            self.time,
            troupe.position.copy(),
            troupe.velocity.copy(),
            troupe.angle.copy(),
            troupe.angular_velocity.copy(),
            troupe.present.copy(),
        )

    def contacts(self) -> Contacts:
        """Return the contacts since the last call; the first call starts the recording."""
        arena, now = self._arena, self.time
        with np.errstate(all="ignore"):
            if not arena.counts[RECORDING]:
                self._arena = arena = with_room(arena, max(FIRST_ROWS, 4 * len(arena.state)))
                arena.counts[RECORDING], arena.world[NOW] = 1, now
                arena.state[:, SINCE] = now
                for i, which in np.argwhere(arena.tags[:, SUPPORT : SUPPORT + 2] >= 0).tolist():
                    open_rest(arena, i, which)
            log_rests(arena, now)
        return taken(arena)

    def account(self) -> Mapping[Cause, float]:
        """Return the energy that each cause has brought since the first call, J; that call starts the accounting."""
        with np.errstate(all="ignore"):
            if self._books is None:
                self._books = Books(self._arena, self.time)
            return self._books.entries(self._arena, self.time)

    @property
    def _outside(self) -> Account | None:
        return None if self._books is None else self._books.account

    def _advance(self, until: float) -> None:
        """Let all events up to a time happen, and make room in the log."""
        self._through(lambda: advance(self._arena, until), DONE, self._halted)

    def _halted(self, status: int) -> None:
        if status == FULL:
            rows = int(self._arena.counts[ROWS])
            if rows > MAX_ROWS:
                self._stop(f"more than {MAX_ROWS:,} contacts in one run")
            self._arena = with_room(self._arena, 2 * len(self._arena.log))
        elif status != PAUSED:
            self._stop(too_many(self._arena, self.bodies.names, self._troupe.scene.fixed_names, status))

    @property
    def _last_event(self) -> float:
        return float(self._arena.world[NOW])

    def _evaluate(self) -> None:
        troupe = self._troupe
        with np.errstate(all="ignore"):
            state = (troupe.position, troupe.velocity, troupe.angle, troupe.angular_velocity)
            evaluate(self._arena, self.time, *state)

    def _acted(self) -> None:
        """Bring into the kernels' arrays what an action has done to the roster."""
        troupe, now = self._troupe, self.time
        touched = sorted(troupe.kicked | troupe.moved)
        for i in touched:
            arrive(self._arena, i, now, 0.0)
            self._arena.state[i, X : Y + 1], self._arena.state[i, VX : VY + 1] = troupe.position[i], troupe.velocity[i]
            self._arena.state[i, ANGLE], self._arena.state[i, SPIN] = troupe.angle[i], troupe.angular_velocity[i]
        arena = self._arena
        for i in troupe.moved:
            freed(arena, i)
        if troupe.reshaped:
            for i in arena.movers.tolist():
                arrive(arena, i, now, 0.0)
                freed(arena, i)
            self._arena = arena = reshaped(arena, troupe)
        if troupe.renewed:
            known = len(arena.state)
            self._arena = arena = renewed(arena, troupe)
            arena.state[known:, T] = now  # who has just been spawned has not moved before
            self._allow()
            renew(arena, now)
            return
        arena.world[NOW], arena.world[NOW_LATE] = now, 0.0
        for i in touched:
            if arena.state[i, LIGHTNESS] > 0.0:
                knocked(arena, i)
                changed(arena, i)
        if any(self.bodies.fixed[i] for i in touched):
            look_ahead(arena)  # others may now be in the way of what stood elsewhere
        for i in touched:
            if arena.state[i, LIGHTNESS] > 0.0:
                predict(arena, i, now, 0.0)

    def _take_out(self, numbers: IntArray) -> None:
        """Remove bodies; they stay where they are, with no velocity."""
        now = self.time
        with np.errstate(all="ignore"):
            for i in numbers.tolist():
                arrive(self._arena, i, now, 0.0)
                freed(self._arena, i)
                self._arena.state[i, VX : SPIN + 2] = 0.0
                self._arena.next_time[i] = np.inf
                self._arena.tags[i, STAMP] += 1
        with booked(self._outside, Cause.RETIRED, self):
            self._troupe.take_out(numbers, now)
        self._arena = renewed(self._arena, self._troupe)

    def _allow(self) -> None:
        """Set how many events a second may have."""
        self._arena.counts[BUDGET] = max(PER_SECOND, PER_SECOND_AND_BALL * len(self._arena.movers))
