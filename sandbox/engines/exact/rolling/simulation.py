"""RollingSimulation: a scene on a floor, running from event to event."""

from collections.abc import Mapping
from time import perf_counter
from typing import NoReturn

import numpy as np

from sandbox.action import Action
from sandbox.engines.account import Account, Cause
from sandbox.engines.acting import perform
from sandbox.engines.booked import booked
from sandbox.engines.compiling import COMPILING
from sandbox.engines.contact_log import MAX_ROWS
from sandbox.engines.contract import Divergence, Exhaustion, Observer
from sandbox.engines.exact.rolling.board import (
    BOOKED,
    EVENTS,
    LIMIT,
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
from sandbox.engines.exact.troupe import Troupe
from sandbox.engines.kernel import tell_if_slow
from sandbox.engines.limits import BEYOND
from sandbox.engines.running import Running
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import Contacts, Frame, IntArray

PER_SECOND = 200_000
"""Events that each second of simulated time begun may add to those that are allowed."""

FIRST_ROWS = 1024
"""Rows that the log of events starts with."""


class RollingSimulation(Running):
    """A running scene of spheres on a floor. Frames are read off between events, and change nothing."""

    def __init__(self, scene: Scene, settings: Settings) -> None:
        super().__init__(settings)
        self._troupe = Troupe(scene, settings.dt)
        self._stopped: float | None = None
        self._books: Books | None = None
        self._board: Board = board_of(self._troupe)
        tell_if_slow(len(scene.bodies))
        with np.errstate(all="ignore"):
            self._set_out(0.0)

    @property
    def time(self) -> float:
        """Simulated time, s; after an exhaustion, that of the last event."""
        return super().time if self._stopped is None else self._stopped

    @property
    def scene(self) -> Scene:
        """What runs, with all that was set since."""
        return self._troupe.scene

    @property
    def bodies(self) -> Bodies:
        """The bodies by number, as they started; spawned ones join at the end."""
        return self._troupe.bodies

    @property
    def retired(self) -> Mapping[int, float]:
        """When each body that is no longer there was gone: number → s. Who lies in a pocket is still there."""
        return self._troupe.retired

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

    def step(self) -> None:
        """Advance by one dt.

        Raises:
            Divergence: a body is no longer finite, or beyond all bounds. The state can still be read.
            Exhaustion: too many events, or too many contacts to keep.
        """
        with self._turn:
            self._check_running()
            self._advance((self._steps + 1) * self._settings.dt)
            self._steps += 1
            self._look()

    def finish(self, part: float) -> None:
        """Advance by a last part of dt, 0 < part < 1.

        Raises:
            Divergence: as `step`.
            Exhaustion: as `step`.
            ValueError: there is no such part.
        """
        self._check_part(part)
        with self._turn:
            self._check_running()
            self._advance((self._steps + part) * self._settings.dt)
            self._part = part
            self._look()
            self._ended = True

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
            if leaving is not None:
                self._take_out(np.asarray([leaving]))
            self._acted()

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

    def watch(self, observer: Observer) -> None:
        """Do nothing: there are no substeps to call an observer after, and no contact is missed."""

    def _advance(self, until: float) -> None:
        """Let all events up to a time happen. Python sees to signals now and then, and makes room in the log."""
        began, compiled = perf_counter(), COMPILING.seconds
        self._board.counts[LIMIT] = PER_SECOND * (1 + int(until))
        with np.errstate(all="ignore"):
            while (status := play(self._board, until)) != DONE:
                waited = perf_counter() - began - (COMPILING.seconds - compiled)
                if self.patience is not None and waited > self.patience:
                    self._stop(f"a step of {self._settings.dt:g} s takes longer than {self.patience:g} s to compute")
                if status == FULL:
                    rows = int(self._board.counts[ROWS])
                    if rows > MAX_ROWS:
                        self._stop(f"more than {MAX_ROWS:,} contacts in one run")
                    self._board = with_room(self._board, 2 * len(self._board.log))
                elif status == TOO_MANY:
                    self._stop(too_many(self._board, self.bodies.names, self._troupe.scene.fixed_names))

    def _stop(self, why: str) -> NoReturn:
        self._ended = True
        self._stopped = float(self._board.world[0])
        self._evaluate()
        raise Exhaustion(why)

    def _evaluate(self) -> None:
        troupe = self._troupe
        with np.errstate(all="ignore"):
            state = (troupe.position, troupe.velocity, troupe.roll, troupe.angle, troupe.angular_velocity)
            evaluate(self._board, self.time, *state)

    def _look(self) -> None:
        """Read the state off, stop what is no longer finite and bounded, retire whose time is up."""
        self._evaluate()
        beyond = self._troupe.beyond()
        if beyond is not None:
            self._ended = True
            raise Divergence(self.time, self.bodies.names[beyond], BEYOND)
        going = self._troupe.going(self.time)
        if len(going):
            with np.errstate(all="ignore"):
                self._take_out(going)
                self._acted()

    def _take_out(self, numbers: IntArray) -> None:
        """Remove bodies; they stay where they are, with no velocity."""
        with booked(self._outside, Cause.RETIRED, self):
            self._troupe.take_out(numbers, self.time)

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
