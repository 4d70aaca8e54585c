"""Destructible terrain: a height field of columns, from which craters are carved and to which dirt is added.

All heights are integer multiples of `QUANTUM`, so that sums are exact: the sum of the heights after a crater equals the
sum before minus the removed heights, bit for bit.
"""

import math
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.games.artillery.scene import QUANTUM, course_of
from sandbox.scene.description.base import Point


class LooseDirt(NamedTuple):
    """Dirt of one column that falls: undermined by a crater, or dropped as a heap."""

    column: int
    bottom: float
    """m, height of its lower end before the fall"""
    top: float
    """m, height of its upper end before the fall"""
    drop: float
    """m, height of the fall"""


class Crater(NamedTuple):
    """Change of the terrain by an explosion."""

    ground: "Ground"
    """terrain after the loose dirt has fallen"""
    removed: FloatArray
    """(N,) m, height removed from each column; negative where dirt was added"""
    loose: tuple[LooseDirt, ...]


class Ground:
    """Height field of N columns of equal width, from x = 0 to `width`, each solid from y = 0 to its height.

    The surface is piecewise linear between the centres of the columns' tops. A `Ground` is not changed in place.
    """

    def __init__(self, heights: FloatArray, width: float) -> None:
        """Create terrain from heights (N,), m, integer multiples of `QUANTUM`, and a width, m."""
        self.heights, self.width = heights, width
        self.each = width / len(heights)
        self.middles = (np.arange(len(heights)) + 0.5) * self.each
        """(N,) m, x of the centres of the columns"""
        self.kinks = np.concatenate(([0.0], self.middles, [width]))
        """(N + 2,) m, x of the vertices of the surface, including both ends"""

    @property
    def points(self) -> tuple[Point, ...]:
        """Vertices of the wall that represents the surface, m."""
        return course_of(self.heights.tolist(), self.width)

    def surface(self, x: FloatArray | float) -> FloatArray:
        """Return the heights of the surface at positions x, m; −inf outside the terrain."""
        return np.interp(x, self.middles, self.heights) + np.where(
            (np.asarray(x) < 0.0) | (np.asarray(x) > self.width), -np.inf, 0.0
        )

    def under(self, x: float, half: float) -> float:
        """Return the maximum height of the surface within `half` of x, m: the support height of a body there."""
        inner = self.heights[np.abs(self.middles - x) <= half]
        ends = self.surface(np.clip(np.array([x - half, x + half]), 0.0, self.width))
        return float(max(inner.max(initial=-math.inf), ends.max()))

    def without(self, centre: Point, radius: float) -> Crater:
        """Carve a disc out of the terrain: each column loses the chord at its centre, as far as it is solid.

        Undermined dirt falls. The removed area is a midpoint sum of chords; for a complete disc its error decreases
        as (column width / radius)^1.5.
        """
        half = self._chords(centre[0], radius)
        low = np.clip(_whole(centre[1] - half), 0.0, self.heights)
        high = np.clip(_whole(centre[1] + half), 0.0, self.heights)
        removed = np.where(half > 0.0, high - low, 0.0)
        hanging = np.flatnonzero((removed > 0.0) & (high < self.heights))
        loose = tuple(LooseDirt(k, float(high[k]), float(self.heights[k]), float(removed[k])) for k in hanging.tolist())
        return Crater(Ground(self.heights - removed, self.width), removed, loose)

    def with_heap(self, centre: Point, radius: float) -> Crater:
        """Drop a disc of dirt: each column gains the chord at its centre. `Crater.removed` is negative."""
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
        """Return half of the chord of a disc at x at the centre of each column, (N,) m."""
        square = radius * radius - (self.middles - x) ** 2
        return np.asarray(np.sqrt(np.maximum(square, 0.0)))


def _whole(height: FloatArray) -> FloatArray:
    """Return heights rounded to multiples of `QUANTUM`."""
    return np.asarray(np.round(height / QUANTUM) * QUANTUM)
