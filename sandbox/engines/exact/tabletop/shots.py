"""Shots on one table, prepared once and computed without frames.

    table = Table(load("scenes/billiards/9-ball.toml"))
    outcome = table.shoot(Stroke(aim=1.57, speed=6.0))

A shot is one call of a compiled kernel. Many shots are one call for each thread.
"""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import deepcopy
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite
from threading import Event, Lock
from typing import Any, Self

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.contract import Exhaustion, Refusal
from sandbox.engines.exact.common.requirements import overlap_of, unsupported
from sandbox.engines.exact.common.state import DONE, FULL, PAUSED, TOO_MANY
from sandbox.engines.exact.tabletop import state as c
from sandbox.engines.exact.tabletop.events import advance, rebuild_all
from sandbox.engines.exact.tabletop.impact import advance_all_to, record_path
from sandbox.engines.exact.tabletop.shot_result import ShotResult
from sandbox.engines.exact.tabletop.simulation import TabletopSimulation, too_many_events, with_log_rows, with_path_rows
from sandbox.engines.exact.tabletop.state import TabletopState
from sandbox.engines.tabletop.motion import CAPTURED, RESTING
from sandbox.engines.tabletop.requirements import pockets_at
from sandbox.resource_limits import EVENTS as EVENT_LIMIT
from sandbox.scene.compile.demands import on_floor
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.surface import Stroke, struck


@dataclass(frozen=True, eq=False, slots=True)
class ShotBatch:
    """Results of M shots of N balls from one state."""

    position: FloatArray
    """(M, N, 2) m, final positions"""
    pocket: IntArray
    """(M, N) index of the pocket that captured each ball, −1 for none"""
    duration: FloatArray
    """(M,) s, time of the last event"""
    events: IntArray
    """(M,) number of events"""
    complete: FloatArray
    """(M,) whether all balls came to rest"""

    def __repr__(self) -> str:
        """Return the number of shots and balls."""
        shots, balls = self.pocket.shape
        return f"<ShotBatch: {shots:,} shots of {balls:,} balls>"


TIME_LIMIT = 4
"""Status of a shot that ends at its time limit with balls in motion, besides the return codes of the event loop."""

NO_BALL = -1
"""Index in place of the struck ball: all balls continue with their present motion."""


@kernel
def shoot(data: TabletopState, state: FloatArray, tags: IntArray, ball: int, motion: FloatArray, until: float) -> int:
    """Play a shot; return `DONE` if all balls are at rest, `TIME_LIMIT` if not, else the return code of `advance`.

    Args:
        data: state arrays to play on; their contents are overwritten.
        state: (N, 19) rows of the balls before the shot.
        tags: (N, 3) likewise.
        ball: index of the struck ball, or `NO_BALL`.
        motion: (5,) its velocity, m/s, and spin, rad/s, after the stroke.
        until: time limit, s.
    """
    counts = data.counts
    for i in range(len(state)):
        for column in range(state.shape[1]):
            data.state[i, column] = state[i, column]
        for column in range(tags.shape[1]):
            data.tags[i, column] = tags[i, column]
    counts[c.LOG_ROWS], counts[c.PATH_ROWS], counts[c.EVENTS], counts[c.MOVING] = 0, 0, 0, 0
    for i in range(len(state)):
        counts[c.MOVING] += data.tags[i, c.PHASE] not in (RESTING, CAPTURED)
        if counts[c.ACCOUNTING] != 0:
            data.state[i, c.ENERGY_UNTIL] = 0.0
    if ball >= 0:
        for k in range(2):
            data.state[ball, c.VX + k] = motion[k]
        for k in range(3):
            data.state[ball, c.WX + k] = motion[2 + k]
    data.world[c.NOW] = 0.0
    rebuild_all(data, 0.0)
    if counts[c.RECORDING_PATHS] != 0:
        for i in range(len(state)):
            record_path(data, i)
    status = advance(data, until)
    while status == PAUSED:
        status = advance(data, until)
    if status == DONE and counts[c.MOVING] != 0:
        advance_all_to(data, until if until < math.inf else data.world[c.NOW])
        status = TIME_LIMIT
    return status


@kernel
def shoot_many(
    data: TabletopState,
    state: FloatArray,
    tags: IntArray,
    balls: IntArray,
    motions: FloatArray,
    until: float,
    final_position: FloatArray,
    pocket: IntArray,
    ends: FloatArray,
    events: IntArray,
    status: IntArray,
) -> None:
    """Play M shots from one state of N balls, as `shoot` does.

    Args:
        data: state arrays to play on; nothing is logged.
        state: as in `shoot`.
        tags: as in `shoot`.
        balls: (M,) index of each struck ball.
        motions: (M, 5) as in `shoot`.
        until: as in `shoot`.
        final_position: (M, N, 2) final positions, m; written.
        pocket: (M, N) index of the pocket that captured each ball, −1 for none; written.
        ends: (M,) time of the last event, s; written.
        events: (M,) number of events; written.
        status: (M,) return code of each shot; written.
    """
    for m in range(len(balls)):
        status[m] = shoot(data, state, tags, balls[m], motions[m], until)
        ends[m], events[m] = data.world[c.NOW], data.counts[c.EVENTS]
        for i in range(len(state)):
            final_position[m, i, 0], final_position[m, i, 1] = data.state[i, c.X], data.state[i, c.Y]
            pocket[m, i] = -1
            if data.tags[i, c.PHASE] == CAPTURED:  # it lies exactly at the centre
                for k in range(len(data.pockets)):
                    if data.pockets[k, 0] == data.state[i, c.X] and data.pockets[k, 1] == data.state[i, c.Y]:
                        pocket[m, i] = k


UNTIL = 120.0
"""s, default time limit of a shot"""

BATCH = 256
"""Shots after which Python can handle signals: some 1/100 s."""

NO_MOTION = (0.0, 0.0, 0.0, 0.0, 0.0)

MIN_LOG_ROWS = 512
"""Initial rows of the event log and of the paths; more for many balls."""


class Table:
    """Scene on a floor, prepared for shots on the `exact` engine.

    Its state is that of the scene at the start, including the scene's own `[[shot]]`s and velocities. Shots do not
    change it: `after` returns the table after a shot.

    Attributes:
        scene: the scene.
        names: (N,) names of the balls.
    """

    def __init__(self, scene: Scene) -> None:
        """Prepare a scene.

        Args:
            scene: scene with a `[surface]`.

        Raises:
            Refusal: the exact engine does not support the scene, or the scene has no floor.
        """
        missing = unsupported(Setup.of(scene), scene.solver)
        if not missing and not on_floor(scene):
            missing = ("a shot needs a floor; add a [surface]",)
        if missing:
            raise Refusal("exact", missing, ())
        self.scene = scene
        self.names = scene.bodies.names
        self._fixed_names = scene.fixed_names
        self._index_of = {name: k for k, name in enumerate(self.names)}
        simulation = TabletopSimulation(Setup.of(scene), scene.solver)
        count = len(scene.bodies)
        data = with_path_rows(
            with_log_rows(simulation.data, max(MIN_LOG_ROWS, 2 * count)), max(MIN_LOG_ROWS, 4 * count)
        )
        data.counts[c.RECORDING], data.counts[c.MAX_EVENTS] = 1, EVENT_LIMIT.value
        self._data = data
        self._state, self._tags = data.state.copy(), data.tags.copy()
        self._motion = np.zeros(5)
        self._lock = Lock()
        self._fixed = scene.bodies.fixed
        self._mass, self._radius = scene.bodies.mass.tolist(), scene.bodies.radius.tolist()

    @property
    def position(self) -> FloatArray:
        """(N, 2) m, positions of the balls before a shot."""
        return self._state[:, c.X : c.Y + 1].copy()

    def shoot(
        self, stroke: Stroke | None = None, ball: str = "cue", *, until: float = UNTIL, record_paths: bool = False
    ) -> ShotResult:
        """Play a shot until all balls are at rest. The table does not change.

        Args:
            stroke: stroke of the cue; None lets the balls continue from their present state.
            ball: name of the struck ball.
            until: largest duration, s.
            record_paths: record the paths of all balls, for `ShotResult.at` and `ShotResult.path_of`.

        Raises:
            KeyError: no ball has that name.
            ValueError: the ball is fixed or in a pocket, or `until` is negative or nan.
            Exhaustion: the shot has more events than the limit.
        """
        if stroke is None:
            return self._play(NO_BALL, NO_MOTION, until, record_paths)
        index = self._strikable_index(ball)
        velocity, spin = struck(stroke, self._mass[index], self._radius[index])
        return self._play(index, (*velocity, *spin), until, record_paths)

    def send(
        self,
        velocity: tuple[float, float],
        spin: tuple[float, float, float],
        ball: str = "cue",
        *,
        until: float = UNTIL,
        record_paths: bool = False,
    ) -> ShotResult:
        """Play a shot from the velocity and spin of a ball directly after the stroke.

        Args:
            velocity: (x, y), m/s.
            spin: (x, y, z), rad/s, right-handed, z up.
            ball: name of the struck ball.
            until: largest duration, s.
            record_paths: record the paths of all balls.

        Raises:
            KeyError: no ball has that name.
            ValueError: as `shoot`, or the velocity and spin are not two and three finite numbers.
            Exhaustion: as `shoot`.
        """
        motion = (*velocity, *spin)
        if len(motion) != 5 or not all(map(isfinite, motion)):
            raise ValueError(f"{motion} is not a velocity and a spin: two and three finite numbers")
        return self._play(self._strikable_index(ball), motion, until, record_paths)

    def fan(self, strokes: Sequence[Stroke], ball: str = "cue", *, threads: int = 1, until: float = UNTIL) -> ShotBatch:
        """Play many independent shots from the present positions.

        Args:
            strokes: M strokes.
            ball: name of the struck ball.
            threads: number of threads.
            until: largest duration of each shot, s.

        Returns:
            Final positions, pockets and durations as arrays. A shot with more events than the limit is not complete.

        Raises:
            KeyError: no ball has that name.
            ValueError: as `shoot`.
        """
        index = self._strikable_index(ball)
        mass_and_radius = self._mass[index], self._radius[index]
        motions = np.empty((len(strokes), 5))
        for k, stroke in enumerate(strokes):
            velocity, spin = struck(stroke, *mass_and_radius)
            motions[k] = (*velocity, *spin)
        return self.fan_of(motions, ball, threads=threads, until=until)

    def fan_of(self, motions: FloatArray, ball: str = "cue", *, threads: int = 1, until: float = UNTIL) -> ShotBatch:
        """Play many independent shots from the velocity and spin of the ball directly after each stroke.

        Args:
            motions: (M, 5) velocity x, y, m/s, and spin x, y, z, rad/s.
            ball: name of the struck ball.
            threads: number of threads.
            until: largest duration of each shot, s.

        Raises:
            KeyError: no ball has that name.
            ValueError: as `shoot`, or `motions` does not have five finite numbers in each row.
        """
        index = self._strikable_index(ball)
        _check_time(until)
        motions = np.ascontiguousarray(motions, dtype=np.float64)
        if motions.ndim != 2 or motions.shape[1] != 5 or not np.isfinite(motions).all():
            raise ValueError(
                f"an array {motions.shape} of motions is invalid; it needs five finite numbers in each row"
            )
        count, balls = len(motions), len(self.names)
        ball_indices = np.full(count, index, dtype=np.int64)
        final_position, pocket = np.empty((count, balls, 2)), np.empty((count, balls), np.int64)
        ends, events, status = np.empty(count), np.empty(count, np.int64), np.empty(count, np.int64)

        is_stopped = Event()

        def play_range(low: int, high: int) -> None:
            data = self._thread_data()
            for first in range(low, high, BATCH):
                if is_stopped.is_set():
                    return
                rows = slice(first, min(first + BATCH, high))
                shoot_many(
                    data, self._state, self._tags, ball_indices[rows], motions[rows], until,
                    final_position[rows], pocket[rows], ends[rows], events[rows], status[rows],
                )  # fmt: skip

        bounds = np.linspace(0, count, min(max(threads, 1), max(count, 1)) + 1).astype(int).tolist()
        ranges = list(pairwise(bounds))
        if len(ranges) == 1:
            play_range(*ranges[0])
        else:
            with ThreadPoolExecutor(len(ranges)) as pool:
                try:
                    list(pool.map(lambda each: play_range(*each), ranges))
                finally:
                    is_stopped.set()  # after an interrupt do not wait for the other threads
        return ShotBatch(final_position, pocket, ends, events, status == DONE)

    def with_balls(self, position: dict[str, tuple[float, float]]) -> Self:
        """Return a table with some balls at rest at other positions. A ball placed inside a pocket is captured.

        Args:
            position: new position of each moved ball by name, m.

        Raises:
            KeyError: no ball has that name.
            ValueError: a position is not finite, or a ball overlaps another object there.
        """
        other = self._copy()
        is_in_pocket = pockets_at(self.scene, np.array(list(position.values()), dtype=float).reshape(-1, 2)) >= 0
        for (name, point), captured in zip(position.items(), is_in_pocket.tolist(), strict=True):
            index = self._index_of[name]
            other._state[index, c.X : c.Y + 1] = point
            other._state[index, c.VX : c.WZ + 1] = 0.0
            other._tags[index, c.PHASE] = CAPTURED if captured else RESTING
        if not np.isfinite(other._state[:, c.X : c.Y + 1]).all():
            raise ValueError("a position must be finite")
        overlap = overlap_of(self.scene, other.position)
        if overlap is not None:
            raise ValueError(overlap)
        return other

    def after(self, outcome: ShotResult) -> Self:
        """Return the table with the balls as they are at the end of a shot.

        Args:
            outcome: a shot at the balls of this table.

        Raises:
            ValueError: the shot was played with other balls.
        """
        if outcome.names != self.names:
            raise ValueError("the shot was played with other balls")
        other = self._copy()
        other._state[:] = outcome.state
        other._state[:, 0] = 0.0
        other._tags[:, c.PHASE] = outcome.phase
        return other

    def _copy(self) -> Self:
        other = object.__new__(type(self))
        for name, value in vars(self).items():  # the arrays to play on and their lock are shared
            setattr(other, name, value)
        other._state, other._tags = self._state.copy(), self._tags.copy()
        return other

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "_lock"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            setattr(self, name, value)
        self._lock = Lock()

    def _strikable_index(self, ball: str) -> int:
        """Return the index of a ball that can be struck."""
        index = self._index_of[ball]
        if self._fixed[index]:
            raise ValueError(f"{ball!r} is fixed and cannot move")
        if self._tags[index, c.PHASE] == CAPTURED:
            raise ValueError(f"{ball!r} is in a pocket; move it first")
        return index

    def _thread_data(self) -> TabletopState:
        """Return state arrays for another thread, which record nothing."""
        with self._lock:
            data: TabletopState = deepcopy(self._data)
        data.counts[c.RECORDING] = data.counts[c.RECORDING_PATHS] = 0
        return data

    def _play(self, index: int, motion: tuple[float, ...], until: float, record_paths: bool) -> ShotResult:
        _check_time(until)
        with self._lock:  # copies of a table share its state arrays
            if index != NO_BALL:
                self._motion[:] = motion
            return self._play_locked(index, until, record_paths)

    def _play_locked(self, index: int, until: float, record_paths: bool) -> ShotResult:
        data, motion = self._data, self._motion
        data.counts[c.RECORDING_PATHS] = record_paths
        while (status := shoot(data, self._state, self._tags, index, motion, until)) == FULL:
            if record_paths and data.counts[c.PATH_ROWS] + 2 > len(data.path):
                data = with_path_rows(data, 2 * len(data.path))
            else:
                data = with_log_rows(data, 2 * len(data.log))
            self._data = data
        if status == TOO_MANY:
            reason = too_many_events(data, self.names, self.scene.fixed_names)
            raise Exhaustion(f"{reason}; {EVENT_LIMIT.remedy(2 * int(data.counts[c.MAX_EVENTS]))}")
        rows, path_rows = int(data.counts[c.LOG_ROWS]), int(data.counts[c.PATH_ROWS])
        return ShotResult(
            self.names,
            self._fixed_names,
            data.log[:rows].copy(),
            data.log_tags[:rows].copy(),
            data.state.copy(),
            data.tags[:, c.PHASE].copy(),
            status == DONE,
            data.path[:path_rows].copy() if record_paths else None,
            data.path_tags[:path_rows, 0].copy() if record_paths else None,
            self.scene,
        )


def _check_time(until: float) -> None:
    if not until >= 0.0:
        raise ValueError(f"a shot until {until:g} s is invalid; it must be 0 or later")
