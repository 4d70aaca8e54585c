"""Outcome: what came of a shot, as arrays; objects are made only when someone asks."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandbox.engines.exact.rolling.board import (
    ALONG_X,
    AT_X,
    AX,
    AY,
    BALL,
    EVENT_TIME,
    GAVE_X,
    KNOB,
    LINE,
    PHASE_ENDS,
    POCKET,
    VX,
    VY,
    T,
    X,
    Y,
)
from sandbox.trajectory import Contacts, FloatArray, IntArray

KINDS = {BALL: "ball", LINE: "cushion", KNOB: "jaw", POCKET: "pocket"}
PHASES = ("rests", "spins", "rolls", "slides", "captured")


class Event(NamedTuple):
    """What happened to a ball."""

    time: float
    """s"""
    kind: str
    """`ball`, `cushion` (a line), `jaw` (a post or the end of a wall), `pocket`; or that it now `rolls`, `spins`,
    `rests`"""
    ball: str
    """of two the one with the lower number"""
    partner: str | None
    """the other ball, the fixed thing or the pocket; none where it is alone"""
    point: tuple[float, float]
    """where, m; of a phase that ends, the ball's centre"""


@dataclass(frozen=True, eq=False, slots=True)
class Outcome:
    """A shot of N balls, from the stroke until all rest, or until its time was up."""

    names: tuple[str, ...]
    fixed_names: tuple[str, ...]
    log: FloatArray
    """(E, 7) as the kernel writes it"""
    what: IntArray
    """(E, 3) kind and the two concerned, likewise"""
    state: FloatArray
    """(N, 19) the end, likewise"""
    phase: IntArray
    """(N,) the last phase of each ball"""
    complete: bool
    """whether everything came to rest in time"""
    path: FloatArray | None
    """(M, 12) every motion that began, where it was asked for"""
    path_ball: IntArray | None
    """(M,) whose"""

    @property
    def position(self) -> FloatArray:
        """(N, 2) m, where the balls are in the end."""
        return self.state[:, X : Y + 1]

    @property
    def duration(self) -> float:
        """When the last event was, s."""
        return float(self.log[-1, EVENT_TIME]) if len(self.log) else 0.0

    @property
    def pocketed(self) -> Mapping[str, str]:
        """Which balls fell during this shot, in order, and into which pockets."""
        fell = self.what[self.what[:, 0] == POCKET]
        return {self.names[ball]: self.fixed_names[-1 - hole] for _, ball, hole in fell.tolist()}

    @property
    def events(self) -> list[Event]:
        """What happened, in order."""
        columns = self.log[:, EVENT_TIME], self.what, self.log[:, AT_X : AT_X + 2]
        rows = zip(*(column.tolist() for column in columns), strict=True)
        made = []
        for time, (kind, ball, other), (x, y) in rows:
            if kind == PHASE_ENDS:
                made.append(Event(time, PHASES[other], self.names[ball], None, (x, y)))
            else:
                partner = self.names[other] if other >= 0 else self.fixed_names[-1 - other]
                made.append(Event(time, KINDS[kind], self.names[ball], partner, (x, y)))
        return made

    @property
    def contacts(self) -> Contacts:
        """Everything that touched, as a simulation tells it."""
        touched = self.what[:, 0] > PHASE_ENDS
        log = self.log[touched]
        return Contacts(
            log[:, EVENT_TIME].copy(),
            self.what[touched, 1:].copy(),
            log[:, AT_X : AT_X + 2].copy(),
            log[:, ALONG_X : ALONG_X + 2].copy(),
            log[:, GAVE_X : GAVE_X + 2].copy(),
        )

    def at(self, times: FloatArray) -> FloatArray:
        """Return where all balls are at some times, (T, N, 2) m: read off their parabolas, so right to rounding.

        From its capture on a ball is at its pocket's centre. After the last event all go on as they do then, which at
        the end of a whole shot is to rest.

        Args:
            times: (T,) s from the stroke on, in any order; before it all are where they were struck.

        Raises:
            ValueError: ways were not asked for.
        """
        path, owner = self._ways()
        times = np.maximum(np.asarray(times, dtype=np.float64), 0.0)
        places = np.empty((len(times), len(self.names), 2))
        for number in range(len(self.names)):
            legs = path[owner == number]
            leg = legs[np.maximum(np.searchsorted(legs[:, T], times, side="right") - 1, 0)]
            gone = (times - leg[:, T])[:, None]
            places[:, number] = leg[:, X : Y + 1] + (leg[:, VX : VY + 1] + 0.5 * leg[:, AX : AY + 1] * gone) * gone
        return places

    def way(self, ball: str, spacing: float = 0.01) -> FloatArray:
        """Return points along a ball's way, (K, 2) m, no farther apart than asked for, its turns among them.

        Raises:
            KeyError: no ball has that name.
            ValueError: ways were not asked for, or the spacing is no length.
        """
        path, owner = self._ways()
        if ball not in self.names:
            raise KeyError(ball)
        if not spacing > 0.0:
            raise ValueError(f"a spacing of {spacing:g} m is not possible; more than 0")
        number = self.names.index(ball)
        legs = path[owner == number]
        ends = np.append(legs[1:, T], max(self.duration, float(legs[-1, T])))
        parts = []
        for leg, end in zip(legs, ends.tolist(), strict=True):
            span = end - leg[T]
            far = float(np.hypot(leg[VX], leg[VY])) * span
            share = np.linspace(0.0, 1.0, max(2, min(int(far / spacing) + 2, 1000)))[:, None] * span
            parts.append(leg[X : Y + 1] + (leg[VX : VY + 1] + 0.5 * leg[AX : AY + 1] * share) * share)
        parts.append(self.position[number][None])
        points = np.concatenate(parts)
        return np.asarray(points[np.append(True, np.any(np.diff(points, axis=0) != 0.0, axis=1))])

    def _ways(self) -> tuple[FloatArray, IntArray]:
        """Return every motion, (M, 12), and whose it is, (M,)."""
        if self.path is None or self.path_ball is None:
            raise ValueError("ways are kept only where they are asked for: shoot(…, ways=True)")
        return self.path, self.path_ball
