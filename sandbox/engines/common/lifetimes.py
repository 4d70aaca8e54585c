"""Removal of bodies at frames: bodies whose lifetime has ended, and bodies outside of `world.bounds`.

This module imports no kernels.
"""

import math

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.base import Point

SLACK = 1e-6
"""Fraction of a step by which a frame may precede the end of a lifetime and still be the first after it.

Frame times are products and sums that round. So a lifetime of 1 s ends at the 100th frame of 0.01 s on every engine,
however often the engine was switched before.
"""


NO_BODIES: IntArray = np.empty(0, np.int64)


class Lifetimes:
    """Queue of lifetimes by their ends. A frame at which no lifetime ends costs one comparison.

    Args:
        bodies: bodies of a running scene; bodies added later have no lifetime.
        began: time of the scene at the start of the run, s.
        dt: step, s.
    """

    def __init__(self, bodies: Bodies, began: float, dt: float) -> None:
        end = bodies.born + bodies.lifetime - began
        limited = np.flatnonzero(np.isfinite(end))
        self._indices: IntArray = limited[np.argsort(end[limited], kind="stable")]
        self._ends = end[self._indices]
        self._slack = SLACK * dt
        self._ended = 0
        self._next = self._first_end()

    @property
    def any_left(self) -> bool:
        """Whether a lifetime is still to end."""
        return self._next < math.inf

    def due(self, time: float) -> IntArray:
        """Return the indices, ascending, of the bodies whose lifetime has ended by a time of the run, s.

        Each is returned once. Some may have been removed already for another reason.
        """
        latest = time + self._slack
        if latest < self._next:
            return NO_BODIES
        first, self._ended = self._ended, int(np.searchsorted(self._ends, latest, side="right"))
        self._next = self._first_end()
        return np.sort(self._indices[first : self._ended])

    def expired(
        self,
        time: float,
        position: FloatArray,
        present: BoolArray,
        fixed: BoolArray,
        bounds: tuple[Point, Point] | None,
    ) -> IntArray:
        """Return the indices, ascending, of the bodies to be removed at a time of the run, s.

        Args:
            time: as of `due`.
            position: (N, 2) m; only used if there are bounds.
            present: (N,) whether each body is in the scene.
            fixed: (N,) bodies that are never removed.
            bounds: lower left and upper right corner, m.
        """
        due = self.due(time)
        if bounds is None:
            return due[present[due]] if len(due) else due
        is_expired: BoolArray = np.asarray(((position < bounds[0]) | (position > bounds[1])).any(axis=1))
        is_expired[due] = True
        return np.flatnonzero(is_expired & present & ~fixed)

    def _first_end(self) -> float:
        return float(self._ends[self._ended]) if self._ended < len(self._ends) else math.inf
