"""Height fields: random landscapes by midpoint displacement, and height fields as the points of a wall."""

from __future__ import annotations  # numpy is imported for random landscapes alone

from collections.abc import Sequence
from typing import TYPE_CHECKING

from sandbox.games.artillery.terrain import Terrain
from sandbox.scene.description.base import Point

if TYPE_CHECKING:
    import numpy as np

QUANTUM = 2.0**-20
"""m: 0.95 µm. Heights up to 8 million metres are exact in double precision, and so is the sum of 5,000 of them"""


EVEN = 1e-9
"""How far off its place a column may stand, as a share of the ground's width: rounding"""


def settled(height: float) -> float:
    """Return the height nearest to one, m, that a column can have; none is below its foot."""
    return max(round(height / QUANTUM), 0) * QUANTUM


def course_of(heights: Sequence[float], width: float) -> tuple[Point, ...]:
    """Return the points of the wall over columns: level to either side, through the middles of their tops."""
    each = width / len(heights)
    tops = [((k + 0.5) * each, height) for k, height in enumerate(heights)]
    return ((0.0, heights[0]), *tops, (width, heights[-1]))


def columns_of(points: Sequence[Point]) -> tuple[tuple[float, ...], float] | None:
    """Return the heights, m, and the width, m, of the columns that a wall goes over; None where it goes over none."""
    if len(points) < 4 or points[0][0] != 0.0:
        return None
    width, heights = points[-1][0], tuple(y for _, y in points[1:-1])
    if width <= 0.0 or points[0][1] != heights[0] or points[-1][1] != heights[-1] or min(heights) < 0.0:
        return None
    for (x, _), (there, _) in zip(points, course_of(heights, width), strict=True):
        if abs(x - there) > EVEN * width:
            return None
    return heights, width


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
    import numpy as np

    from sandbox.scene.random_streams import Stream, draws

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
