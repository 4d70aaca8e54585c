"""Landscape: hills by midpoint displacement, from a seed.

Fournier, Fussell, Carpenter, "Computer rendering of stochastic models", Communications of the ACM 25 (1982): the middle
of each stretch is moved off the mean of its ends at random, by less and less as stretches are halved.
"""

from __future__ import annotations  # `np.random` in an annotation would import it wherever scenes are read

import numpy as np

from sandbox.scene.artillery.columns import settled
from sandbox.scene.artillery.described import Terrain
from sandbox.scene.streams import Stream, draws


def heights_of(terrain: Terrain, seed: int) -> tuple[float, ...]:
    """Return the height of each column of a ground, m."""
    if terrain.heights is not None:
        return tuple(settled(height) for height in terrain.heights)
    line = displaced(terrain.columns, 2.0 ** -(1.0 - terrain.roughness), seed)
    low, high = float(line.min()), float(line.max())
    share = (line - low) / (high - low)
    return tuple(settled(terrain.base + terrain.height * each) for each in share.tolist())


def displaced(count: int, shrink: float, seed: int) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Return `count` ≥ 2 points of a random line; each halving displaces by `shrink` times the halving before."""
    random = draws(Stream.LANDSCAPE, seed)
    line, spread = random.standard_normal(3), 1.0
    while len(line) < count:
        spread *= shrink
        finer = np.empty(2 * len(line) - 1)
        finer[::2] = line
        finer[1::2] = 0.5 * (line[1:] + line[:-1]) + spread * random.standard_normal(len(line) - 1)
        line = finer
    places = np.linspace(0.0, len(line) - 1.0, count)
    return np.interp(places, np.arange(len(line)), line)


def levelled(heights: tuple[float, ...], width: float, at: float, half: float) -> tuple[float, ...]:
    """Return heights with the columns whose middles lie within `half` of a place, m, as high as the nearest to it."""
    each = width / len(heights)
    level = heights[min(max(int(at / each), 0), len(heights) - 1)]
    return tuple(level if abs((k + 0.5) * each - at) <= half else height for k, height in enumerate(heights))
