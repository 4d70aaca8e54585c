"""ShotResult: result of a shot as arrays; event objects are created on access."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.exact.tabletop import state as c
from sandbox.engines.exact.tabletop.state import contacts_of
from sandbox.html_repr import HtmlRepr
from sandbox.scene.compile.scene import Scene
from sandbox.trajectory import Contacts

KINDS = {c.BALL: "ball", c.LINE: "cushion", c.VERTEX: "jaw", c.POCKET: "pocket"}
PHASES = ("rests", "spins", "rolls", "slides", "captured")


class ShotEvent(NamedTuple):
    """One event of a ball: a collision, a capture or the start of a phase."""

    time: float
    """s"""
    kind: str
    """collision with a `ball`, a `cushion` (straight part of a wall) or a `jaw` (post or end of a wall); capture by a
    `pocket`; or the phase that begins: `rolls`, `spins`, `rests`"""
    ball: str
    """name of the ball; of two balls, the one with the lower index"""
    partner: str | None
    """name of the other ball, of the fixed object or of the pocket; None for a phase"""
    point: tuple[float, float]
    """m, position of the event; for a phase, the centre of the ball"""


MAX_SHOWN = 8
"""Largest number of pocketed balls in the representation of a result."""


@dataclass(frozen=True, eq=False, slots=True)
class ShotResult(HtmlRepr):
    """Shot of N balls, from the stroke until all are at rest or the time limit is reached."""

    names: tuple[str, ...]
    """(N,) names of the balls"""
    fixed_names: tuple[str, ...]
    """names of the fixed objects and pockets, in the order of `Scene.fixed_names`"""
    log: FloatArray
    """(E, 7) time, s; position x, y, m; normal x, y; impulse x, y, N·s, of each event"""
    what: IntArray
    """(E, 3) kind code, ball index and partner index of each event; a fixed object or pocket is −1 − k"""
    state: FloatArray
    """(N, 19) final state, with the columns of the kernel"""
    phase: IntArray
    """(N,) code of the last phase of each ball"""
    complete: bool
    """whether all balls came to rest within the time limit"""
    path: FloatArray | None
    """(M, 12) start of each parabolic segment of all paths, with the first columns of the kernel's state; None if paths
    were not recorded"""
    path_ball: IntArray | None
    """(M,) ball index of each segment; None if paths were not recorded"""
    scene: Scene
    """scene of the table; its balls may be at other positions than before the shot"""

    def __repr__(self) -> str:
        """Return the number of balls and events, and the pocketed balls."""
        pocketed = ", ".join(f"{ball}: {pocket}" for ball, pocket in list(self.pocketed.items())[:MAX_SHOWN])
        counts = f"{len(self.names):,} balls, {len(self.what):,} events, {self.duration:.4g} s"
        return (
            f"<ShotResult: {counts}, {'at rest' if self.complete else 'not at rest'}; pocketed: {pocketed or 'none'}>"
        )

    @property
    def position(self) -> FloatArray:
        """(N, 2) m, final positions of the balls."""
        return self.state[:, c.X : c.Y + 1]

    @property
    def duration(self) -> float:
        """Time of the last event, s."""
        return float(self.log[-1, c.EVENT_TIME]) if len(self.log) else 0.0

    @property
    def pocketed(self) -> Mapping[str, str]:
        """Pocket of each ball that was pocketed, by the name of the ball, in order of time."""
        pocketed = self.what[self.what[:, 0] == c.POCKET]
        return {self.names[ball]: self.fixed_names[-1 - pocket] for _, ball, pocket in pocketed.tolist()}

    @property
    def events(self) -> list[ShotEvent]:
        """All events in order of time."""
        columns = self.log[:, c.EVENT_TIME], self.what, self.log[:, c.POINT_X : c.POINT_X + 2]
        rows = zip(*(column.tolist() for column in columns), strict=True)
        events = []
        for time, (kind, ball, other), (x, y) in rows:
            if kind == c.PHASE_CHANGE:
                events.append(ShotEvent(time, PHASES[other], self.names[ball], None, (x, y)))
            else:
                partner = self.names[other] if other >= 0 else self.fixed_names[-1 - other]
                events.append(ShotEvent(time, KINDS[kind], self.names[ball], partner, (x, y)))
        return events

    @property
    def contacts(self) -> Contacts:
        """All contacts, as `Simulation.contacts` returns them."""
        return contacts_of(self.log, self.what)

    def at(self, times: FloatArray) -> FloatArray:
        """Return the positions of all balls at given times, (T, N, 2) m.

        They are evaluated from the parabolic segments of the paths, so their error is rounding error. A captured ball
        is at the centre of its pocket. After the last event the balls continue in their last phase; at the end of a
        complete shot they are at rest.

        Args:
            times: (T,) s after the stroke, in any order; a negative time gives the initial positions.

        Raises:
            ValueError: paths were not recorded.
        """
        path, owner = self._recorded_paths()
        times = np.maximum(np.asarray(times, dtype=np.float64), 0.0)
        positions = np.empty((len(times), len(self.names), 2))
        for ball in range(len(self.names)):
            segments = path[owner == ball]
            segment = segments[np.maximum(np.searchsorted(segments[:, c.T], times, side="right") - 1, 0)]
            elapsed = (times - segment[:, c.T])[:, None]
            positions[:, ball] = (
                segment[:, c.X : c.Y + 1]
                + (segment[:, c.VX : c.VY + 1] + 0.5 * segment[:, c.AX : c.AY + 1] * elapsed) * elapsed
            )
        return positions

    def path_of(self, ball: str, spacing: float = 0.01) -> FloatArray:
        """Return points along the path of a ball, (K, 2) m, including its corners.

        Args:
            ball: name of the ball.
            spacing: largest distance between successive points, m; a segment has at most 1,000 points.

        Raises:
            KeyError: no ball has that name.
            ValueError: paths were not recorded, or the spacing is not positive.
        """
        path, owner = self._recorded_paths()
        if ball not in self.names:
            raise KeyError(ball)
        if not spacing > 0.0:
            raise ValueError(f"a spacing of {spacing:g} m is not possible; more than 0")
        index = self.names.index(ball)
        segments = path[owner == index]
        ends = np.append(segments[1:, c.T], max(self.duration, float(segments[-1, c.T])))
        parts = []
        for segment, end in zip(segments, ends.tolist(), strict=True):
            span = end - segment[c.T]
            length = float(np.hypot(segment[c.VX], segment[c.VY])) * span
            elapsed = np.linspace(0.0, 1.0, max(2, min(int(length / spacing) + 2, 1000)))[:, None] * span
            parts.append(
                segment[c.X : c.Y + 1] + (segment[c.VX : c.VY + 1] + 0.5 * segment[c.AX : c.AY + 1] * elapsed) * elapsed
            )
        parts.append(self.position[index][None])
        points = np.concatenate(parts)
        return np.asarray(points[np.append(True, np.any(np.diff(points, axis=0) != 0.0, axis=1))])

    def _recorded_paths(self) -> tuple[FloatArray, IntArray]:
        """Return the path segments, (M, 12), and their balls, (M,)."""
        if self.path is None or self.path_ball is None:
            raise ValueError("paths were not recorded; call shoot(…, record_paths=True)")
        return self.path, self.path_ball
