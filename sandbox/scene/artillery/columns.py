"""Columns: the heights of a ground, and the wall that is their surface.

Heights are whole numbers of a millionth of a metre or so, `QUANTUM`: a power of two, so that sums and differences of
them are exact, and what is dug away here and heaped up there can be counted to the last bit.
"""

from collections.abc import Sequence

from sandbox.scene.part import Point

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
