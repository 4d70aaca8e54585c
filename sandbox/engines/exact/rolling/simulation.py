"""RollingSimulation: a scene on a floor, running from event to event."""

from collections.abc import Mapping

import numpy as np

from sandbox.action import Action
from sandbox.engines.account import Account, Cause
from sandbox.engines.acting import perform
from sandbox.engines.booked import booked
from sandbox.engines.contact_log import MAX_ROWS
from sandbox.engines.exact.driven import EventDriven
from sandbox.engines.exact.rolling.board import (
    BOOKED,
    EVENTS,
    LIMIT,
    NOW,
    PAIR_TESTS,
    PREDICTIONS,
    RECORDING,
    ROWS,
    VX,
    VY,
    WX,
    WY,
    WZ,
    Board,
    T,
    X,
    Y,
    board_of,
    renewed,
)
from sandbox.engines.exact.rolling.book import arrive_all
from sandbox.engines.exact.rolling.books import Books
from sandbox.engines.exact.rolling.motion import evaluate
from sandbox.engines.exact.rolling.play import DONE, FULL, TOO_MANY, play, set_out
from sandbox.engines.exact.rolling.record import taken, too_many, with_room
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import Contacts, Frame, IntArray

PER_SECOND = 200_000
"""Events that each second of simulated time begun may add to those that are allowed."""

FIRST_ROWS = 1024
"""Rows that the log of events starts with."""


class RollingSimulation(EventDriven):
    """A running scene of spheres on a floor. Frames are read off between events, and change nothing."""

    def __init__(self, scene: Scene, settings: Settings) -> None:
        super().__init__(scene, settings)
        self._books: Books | None = None
        self._board: Board = board_of(self._troupe)
        with np.errstate(all="ignore"):
            self._set_out(0.0)

    @property
    def board(self) -> Board:
        """All that its kernels read and write."""
        return self._board

    @property
    def work(self) -> Mapping[str, int]:
        """What was done so far: events, predictions, and at how many others and fixed things these looked."""
        counts = self._board.counts
        return {
            "events": int(counts[EVENTS]),
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
            troupe.roll.copy(),
        )

    def contacts(self) -> Contacts:
        """Return the contacts since the last call; the first call starts the recording."""
        if not self._board.counts[RECORDING]:
            self._board = with_room(self._board, max(FIRST_ROWS, 4 * len(self.bodies)))
            self._board.counts[RECORDING] = 1
        return taken(self._board)

    def account(self) -> Mapping[Cause, float]:
        """Return the energy that each cause has brought since the first call, J; that call starts the accounting."""
        with np.errstate(all="ignore"):
            if self._books is None:
                self._books = Books(self._board, self.time)
            return self._books.entries(self._board, self.time)

    @property
    def _outside(self) -> Account | None:
        return None if self._books is None else self._books.account

    def _advance(self, until: float) -> None:
        """Let all events up to a time happen, and make room in the log."""
        self._board.counts[LIMIT] = PER_SECOND * (1 + int(until))
        self._through(lambda: play(self._board, until), DONE, self._halted)

    def _halted(self, status: int) -> None:
        if status == FULL:
            rows = int(self._board.counts[ROWS])
            if rows > MAX_ROWS:
                self._stop(f"more than {MAX_ROWS:,} contacts in one run")
            self._board = with_room(self._board, 2 * len(self._board.log))
        elif status == TOO_MANY:
            self._stop(too_many(self._board, self.bodies.names, self._troupe.scene.fixed_names))

    @property
    def _last_event(self) -> float:
        return float(self._board.world[NOW])

    def _evaluate(self) -> None:
        troupe = self._troupe
        with np.errstate(all="ignore"):
            state = (troupe.position, troupe.velocity, troupe.roll, troupe.angle, troupe.angular_velocity)
            evaluate(self._board, self.time, *state)

    def _take_out(self, numbers: IntArray) -> None:
        """Remove bodies; they stay where they are, with no velocity."""
        with booked(self._outside, Cause.RETIRED, self), np.errstate(all="ignore"):
            self._troupe.take_out(numbers, self.time)
        self._acted()

    def _acted(self) -> None:
        """Bring into the kernels' arrays what has been done to the roster, and go on from there."""
        arrive_all(self._board, self.time)  # as those who were there until now
        self._board = renewed(self._board, self._troupe)
        self._set_out(self.time)

    def _set_out(self, time: float) -> None:
        rows = int(self._board.counts[ROWS]) + len(self.bodies)  # each may be captured at once
        if self._board.counts[RECORDING] and rows > len(self._board.log):
            self._board = with_room(self._board, 2 * rows)
        troupe, state = self._troupe, self._board.state
        state[:, T] = state[:, BOOKED] = time
        state[:, X : Y + 1], state[:, VX : VY + 1] = troupe.position, troupe.velocity
        state[:, WX : WY + 1], state[:, WZ] = troupe.roll, troupe.angular_velocity
        set_out(self._board, time)
        self._evaluate()
