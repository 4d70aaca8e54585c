"""Expiry: who is to be retired at a frame: whose life is over by then, or who has left world.bounds."""

import math

import numpy as np

from sandbox.scene.bodies import Bodies
from sandbox.scene.near import BoolArray, FloatArray, IntArray
from sandbox.scene.part import Point

SLACK = 1e-6
"""Share of a step by which a frame may come before the end of a life and still be the first after it.

Times of frames are products and sums that round. So a life of 1 s ends at the 100th frame of 0.01 s on every engine,
and at the same frame however often the engine was exchanged before.
"""

NOBODY: IntArray = np.empty(0, np.int64)


class Expiry:
    """The ends of the lives of bodies, in order; nothing but one comparison is done at a frame where none is due.

    Args:
        bodies: those of a running scene; who joins later lives for ever.
        began: what the scene's clock showed when the run began, s.
        dt: the step, s.
    """

    def __init__(self, bodies: Bodies, began: float, dt: float) -> None:
        end = bodies.born + bodies.lifetime - began
        mortal = np.flatnonzero(np.isfinite(end))
        self._numbers: IntArray = mortal[np.argsort(end[mortal], kind="stable")]
        self._ends = end[self._numbers]
        self._slack = SLACK * dt
        self._told = 0
        self._next = self._first_end()

    def due(self, time: float) -> IntArray:
        """Return the numbers of those whose life has ended by a time of the run, s, in order; each is told once.

        They may be gone already, for another reason.
        """
        latest = time + self._slack
        if latest < self._next:
            return NOBODY
        first, self._told = self._told, int(np.searchsorted(self._ends, latest, side="right"))
        self._next = self._first_end()
        return np.sort(self._numbers[first : self._told])

    def going(
        self,
        time: float,
        position: FloatArray,
        present: BoolArray,
        fixed: BoolArray,
        bounds: tuple[Point, Point] | None,
    ) -> IntArray:
        """Return the numbers, in order, of those to be retired at a time of the run, s.

        Args:
            time: as of `due`.
            position: (N, 2) m; only looked at where there are bounds.
            present: (N,) who is there.
            fixed: (N,) who stays whatever happens.
            bounds: lower left and upper right corner, m.
        """
        due = self.due(time)
        if bounds is None:
            return due[present[due]] if len(due) else due
        out: BoolArray = np.asarray(((position < bounds[0]) | (position > bounds[1])).any(axis=1))
        out[due] = True
        return np.flatnonzero(out & present & ~fixed)

    def _first_end(self) -> float:
        return float(self._ends[self._told]) if self._told < len(self._ends) else math.inf
