"""Ground: columns of dirt, out of which circles are taken and on which dirt falls. Nothing of it gets lost.

All heights are whole numbers of `QUANTUM`, so that every sum here is exact: after a crater the columns' sum is the sum
before less what was taken out, bit for bit.
"""

import math
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.games.artillery.scene import QUANTUM, course_of
from sandbox.scene.description.base import Point


class LooseDirt(NamedTuple):
    """Dirt that hangs in the air once a circle below it is gone, and falls."""

    column: int
    bottom: float
    """m, of where it hung"""
    top: float
    """m"""
    drop: float
    """m, that it falls"""


class Crater(NamedTuple):
    """What a blast did to ground."""

    ground: "Ground"
    """after the loose dirt has fallen"""
    removed: FloatArray
    """(N,) m, of each column"""
    loose: tuple[LooseDirt, ...]


class Ground:
    """N columns of one width, from 0 to `width`, each solid from 0 to its height."""

    def __init__(self, heights: FloatArray, width: float) -> None:
        """Take heights (N,), m, that are whole numbers of the quantum, and a width, m."""
        self.heights, self.width = heights, width
        self.each = width / len(heights)
        self.middles = (np.arange(len(heights)) + 0.5) * self.each
        """(N,) m"""
        self.kinks = np.concatenate(([0.0], self.middles, [width]))
        """(N + 2,) m, where the surface may bend, and where it ends"""

    @property
    def points(self) -> tuple[Point, ...]:
        """The course of the wall that is its surface, m."""
        return course_of(self.heights.tolist(), self.width)

    def surface(self, x: FloatArray | float) -> FloatArray:
        """Return the heights of the surface at places, m; beside the ground there is none, −inf."""
        return np.interp(x, self.middles, self.heights) + np.where(
            (np.asarray(x) < 0.0) | (np.asarray(x) > self.width), -np.inf, 0.0
        )

    def under(self, x: float, half: float) -> float:
        """Return the highest that the surface is within `half` of a place, m: what stands there stands on it."""
        inner = self.heights[np.abs(self.middles - x) <= half]
        ends = self.surface(np.clip(np.array([x - half, x + half]), 0.0, self.width))
        return float(max(inner.max(initial=-math.inf), ends.max()))

    def without(self, centre: Point, radius: float) -> Crater:
        """Take a circle out: of each column the chord through its middle, as far as it is solid; the rest settles.

        The area so taken differs from the circle's by what a sum of chords does from their integral, which for a
        whole circle falls as (column / radius)^1.5.
        """
        half = self._chords(centre[0], radius)
        low = np.clip(_whole(centre[1] - half), 0.0, self.heights)
        high = np.clip(_whole(centre[1] + half), 0.0, self.heights)
        removed = np.where(half > 0.0, high - low, 0.0)
        hanging = np.flatnonzero((removed > 0.0) & (high < self.heights))
        loose = tuple(LooseDirt(k, float(high[k]), float(self.heights[k]), float(removed[k])) for k in hanging.tolist())
        return Crater(Ground(self.heights - removed, self.width), removed, loose)

    def with_heap(self, centre: Point, radius: float) -> Crater:
        """Let a disc of dirt fall: onto each column as much as the disc's chord over it. `removed` is negative."""
        half = self._chords(centre[0], radius)
        added = _whole(2.0 * half)
        bottom = np.maximum(_whole(centre[1] - half), self.heights)
        falling = np.flatnonzero(added > 0.0)
        loose = tuple(
            LooseDirt(k, float(bottom[k]), float(bottom[k] + added[k]), float(bottom[k] - self.heights[k]))
            for k in falling.tolist()
        )
        return Crater(Ground(self.heights + added, self.width), -added, loose)

    def _chords(self, x: float, radius: float) -> FloatArray:
        """Return half the chord that a circle at x has in each column's middle, (N,) m."""
        square = radius * radius - (self.middles - x) ** 2
        return np.asarray(np.sqrt(np.maximum(square, 0.0)))


def _whole(height: FloatArray) -> FloatArray:
    """Return heights rounded to the quantum."""
    return np.asarray(np.round(height / QUANTUM) * QUANTUM)
