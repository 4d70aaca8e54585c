"""Table: a scene on a floor, made ready once, for shots by the thousand.

    table = Table(load("scenes/billiards/9-ball.toml"))
    outcome = table.shoot(Stroke(aim=1.57, speed=6.0))

A shot is one call of a kernel; a fan of them is one for each thread.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import deepcopy
from itertools import pairwise
from math import isfinite
from threading import Event, Lock
from typing import Any, Self

import numpy as np

from sandbox.engines.contract import Exhaustion, Refusal
from sandbox.engines.exact.engine import ExactEngine, overlap_of
from sandbox.engines.exact.rolling.board import LIMIT, PHASE, RECORDING, ROWS, STEPS, TRACING, VX, WZ, Board, X, Y
from sandbox.engines.exact.rolling.fan import Fan
from sandbox.engines.exact.rolling.outcome import Outcome
from sandbox.engines.exact.rolling.play import DONE, FULL, TOO_MANY
from sandbox.engines.exact.rolling.record import too_many, with_paths, with_room
from sandbox.engines.exact.rolling.shoot import UNSTRUCK, shoot, shoot_many
from sandbox.engines.exact.rolling.simulation import RollingSimulation
from sandbox.engines.floor.phase import CAPTURED, RESTING
from sandbox.engines.floor.pockets import caught
from sandbox.scene.cue import Stroke, struck
from sandbox.scene.demands import on_floor
from sandbox.scene.model import Scene
from sandbox.trajectory import FloatArray

UNTIL = 120.0
"""s: a shot takes no longer, whatever the floor."""

MOST_EVENTS = 2_000_000
"""of a shot"""

BATCH = 256
"""Shots of a fan after which Python sees to signals: some hundredths of a second."""

NO_MOTION = (0.0, 0.0, 0.0, 0.0, 0.0)

ROOM = 512
"""Events, and motions, that there is room for at first, and no less than some for each ball."""


class Table:
    """A scene on a floor as it stands; its own shots and velocities count as its state before the first stroke."""

    def __init__(self, scene: Scene) -> None:
        """Make a scene ready.

        Raises:
            Refusal: the exact engine lacks something, or the scene has no floor.
        """
        engine = ExactEngine()
        missing = engine.missing(scene, scene.solver)
        if not missing and not on_floor(scene):
            missing = ("shots are played on a floor; give the scene a [surface]",)
        if missing:
            raise Refusal(engine.name, missing, ())
        self.scene = scene
        self.names = scene.bodies.names
        self._fixed_names = scene.fixed_names
        self._number = {name: k for k, name in enumerate(self.names)}
        simulation = RollingSimulation(scene, scene.solver)
        count = len(scene.bodies)
        board = with_paths(with_room(simulation.board, max(ROOM, 2 * count)), max(ROOM, 4 * count))
        board.counts[RECORDING], board.counts[LIMIT] = 1, MOST_EVENTS
        self._board = board
        self._state, self._tags = board.state.copy(), board.tags.copy()
        self._motion = np.zeros(5)
        self._turn = Lock()
        self._fixed = scene.bodies.fixed
        self._mass, self._radius = scene.bodies.mass.tolist(), scene.bodies.radius.tolist()

    @property
    def position(self) -> FloatArray:
        """(N, 2) m, where the balls stand before a shot."""
        return self._state[:, X : Y + 1].copy()

    def shoot(
        self, stroke: Stroke | None = None, ball: str = "cue", *, until: float = UNTIL, ways: bool = False
    ) -> Outcome:
        """Play a shot until everything rests; the table itself stays as it is.

        Args:
            stroke: how the ball is struck; none lets the balls go on as they stand.
            ball: which.
            until: s, when to stop at the latest.
            ways: keep the ways of all balls too.

        Raises:
            KeyError: no ball has that name.
            ValueError: it is fixed, or lies in a pocket; or there is no such time.
            Exhaustion: more events than `MOST_EVENTS`.
        """
        if stroke is None:
            return self._play(UNSTRUCK, NO_MOTION, until, ways)
        number = self._free(ball)
        velocity, spin = struck(stroke, self._mass[number], self._radius[number])
        return self._play(number, (*velocity, *spin), until, ways)

    def send(
        self,
        velocity: tuple[float, float],
        spin: tuple[float, float, float],
        ball: str = "cue",
        *,
        until: float = UNTIL,
        ways: bool = False,
    ) -> Outcome:
        """Play a shot from the velocity, m/s, and the spin, rad/s, that a ball has right after its stroke.

        Raises:
            KeyError: no ball has that name.
            ValueError: as `shoot`, or that is no motion.
            Exhaustion: as `shoot`.
        """
        motion = (*velocity, *spin)
        if len(motion) != 5 or not all(map(isfinite, motion)):
            raise ValueError(f"{motion} is no velocity and spin; two and three finite numbers")
        return self._play(self._free(ball), motion, until, ways)

    def fan(self, strokes: Sequence[Stroke], ball: str = "cue", *, threads: int = 1, until: float = UNTIL) -> Fan:
        """Play many shots from where the balls stand, each for itself, on several threads.

        Raises:
            KeyError: no ball has that name.
            ValueError: as `shoot`.
        """
        number = self._free(ball)
        figures = self._mass[number], self._radius[number]
        motions = np.empty((len(strokes), 5))
        for k, stroke in enumerate(strokes):
            velocity, spin = struck(stroke, *figures)
            motions[k] = (*velocity, *spin)
        return self.fan_of(motions, ball, threads=threads, until=until)

    def fan_of(self, motions: FloatArray, ball: str = "cue", *, threads: int = 1, until: float = UNTIL) -> Fan:
        """Play many shots as `fan` does, from the velocity and spin of the ball after each stroke, (M, 5).

        Raises:
            KeyError: no ball has that name.
            ValueError: as `shoot`, or those are no motions.
        """
        number = self._free(ball)
        _check_time(until)
        motions = np.ascontiguousarray(motions, dtype=np.float64)
        if motions.ndim != 2 or motions.shape[1] != 5 or not np.isfinite(motions).all():
            raise ValueError(f"an array {motions.shape} of motions is not possible; finite numbers, five in each row")
        count, balls = len(motions), len(self.names)
        numbers = np.full(count, number, dtype=np.int64)
        rest, pocket = np.empty((count, balls, 2)), np.empty((count, balls), np.int64)
        ends, events, status = np.empty(count), np.empty(count, np.int64), np.empty(count, np.int64)

        stopped = Event()

        def part(low: int, high: int) -> None:
            own = self._own()
            for first in range(low, high, BATCH):
                if stopped.is_set():
                    return
                some = slice(first, min(first + BATCH, high))
                shoot_many(
                    own, self._state, self._tags, numbers[some], motions[some], until,
                    rest[some], pocket[some], ends[some], events[some], status[some],
                )  # fmt: skip

        bounds = np.linspace(0, count, min(max(threads, 1), max(count, 1)) + 1).astype(int).tolist()
        parts = list(pairwise(bounds))
        if len(parts) == 1:
            part(*parts[0])
        else:
            with ThreadPoolExecutor(len(parts)) as pool:
                try:
                    list(pool.map(lambda each: part(*each), parts))
                finally:
                    stopped.set()  # an interrupt need not wait for the rest
        return Fan(rest, pocket, ends, events, status == DONE)

    def with_balls(self, position: dict[str, tuple[float, float]]) -> Self:
        """Return a table with balls at rest elsewhere, m; those that are not named stay.

        Who is put into a pocket lies in it.

        Raises:
            KeyError: no ball has that name.
            ValueError: that is no place, or one where they overlap something.
        """
        other = self._copy()
        down = caught(self.scene, np.array(list(position.values()), dtype=float).reshape(-1, 2)) >= 0
        for (name, place), inside in zip(position.items(), down.tolist(), strict=True):
            number = self._number[name]
            other._state[number, X : Y + 1] = place
            other._state[number, VX : WZ + 1] = 0.0
            other._tags[number, PHASE] = CAPTURED if inside else RESTING
        if not np.isfinite(other._state[:, X : Y + 1]).all():
            raise ValueError("a place that is not finite is none")
        overlap = overlap_of(self.scene, other.position)
        if overlap is not None:
            raise ValueError(overlap)
        return other

    def after(self, outcome: Outcome) -> Self:
        """Return the table as a shot has left it.

        Raises:
            ValueError: that was a shot of other balls.
        """
        if outcome.names != self.names:
            raise ValueError("that shot was played with other balls")
        other = self._copy()
        other._state[:] = outcome.state
        other._state[:, 0] = 0.0
        other._tags[:, PHASE] = outcome.phase
        return other

    def _copy(self) -> Self:
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        other._state, other._tags = self._state.copy(), self._tags.copy()
        return other

    def __getstate__(self) -> dict[str, Any]:
        return {key: value for key, value in self.__dict__.items() if key != "_turn"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, _turn=Lock())

    def _free(self, ball: str) -> int:
        """Return the number of a ball that can be struck."""
        number = self._number[ball]
        if self._fixed[number]:
            raise ValueError(f"{ball!r} is fixed; nothing can move it")
        if self._tags[number, PHASE] == CAPTURED:
            raise ValueError(f"{ball!r} lies in a pocket; put it elsewhere first")
        return number

    def _own(self) -> Board:
        """Return a board for another thread, which logs nothing."""
        with self._turn:
            own: Board = deepcopy(self._board)
        own.counts[RECORDING] = own.counts[TRACING] = 0
        return own

    def _play(self, number: int, motion: tuple[float, ...], until: float, ways: bool) -> Outcome:
        _check_time(until)
        with self._turn:  # copies of a table share its board
            if number != UNSTRUCK:
                self._motion[:] = motion
            return self._played(number, until, ways)

    def _played(self, number: int, until: float, ways: bool) -> Outcome:
        board, motion = self._board, self._motion
        board.counts[TRACING] = ways
        while (status := shoot(board, self._state, self._tags, number, motion, until)) == FULL:
            if ways and board.counts[STEPS] + 2 > len(board.path):
                board = with_paths(board, 2 * len(board.path))
            else:
                board = with_room(board, 2 * len(board.log))
            self._board = board
        if status == TOO_MANY:
            raise Exhaustion(too_many(board, self.names, self.scene.fixed_names))
        rows, steps = int(board.counts[ROWS]), int(board.counts[STEPS])
        return Outcome(
            self.names,
            self._fixed_names,
            board.log[:rows].copy(),
            board.log_what[:rows].copy(),
            board.state.copy(),
            board.tags[:, PHASE].copy(),
            status == DONE,
            board.path[:steps].copy() if ways else None,
            board.path_what[:steps, 0].copy() if ways else None,
        )


def _check_time(until: float) -> None:
    if not until >= 0.0:
        raise ValueError(f"a shot until {until:g} s is not possible; 0 or later")
