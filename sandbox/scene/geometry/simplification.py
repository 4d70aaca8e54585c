"""Simplification of polylines: fewer corners, none farther from the line than a tolerance.

Source: U. Ramer, "An iterative procedure for the polygonal approximation of plane curves", 1972; D. Douglas and T.
Peucker, 1973.
"""

from collections.abc import Sequence

import numpy as np

from sandbox.scene.description.base import Point
from sandbox.scene.geometry.vectors import offset_from_segment


def simplify_polyline(points: Sequence[Point], tolerance: float) -> list[Point]:
    """Return some of the points of a polyline, so that all others are within a tolerance of the line through them.

    Args:
        points: of the polyline, m; its ends are kept.
        tolerance: m.
    """
    if len(points) < 3:
        return list(points)
    line = np.asarray(points, np.float64)
    kept = np.zeros(len(line), np.bool_)
    kept[[0, -1]] = True
    open_parts = [(0, len(line) - 1)]
    while open_parts:
        first, last = open_parts.pop()
        if last - first < 2:
            continue
        offset = offset_from_segment(line[first + 1 : last], line[first], line[last] - line[first])
        distance = np.hypot(offset[:, 0], offset[:, 1])
        farthest = int(np.argmax(distance))
        if distance[farthest] > tolerance:
            middle = first + 1 + farthest
            kept[middle] = True
            open_parts += [(first, middle), (middle, last)]
    return [points[k] for k in np.flatnonzero(kept).tolist()]


def simplify_loop(points: Sequence[Point], tolerance: float) -> list[Point]:
    """Return the corners of a closed outline, simplified likewise; the first point is not repeated at the end.

    Args:
        points: of the outline, m.
        tolerance: m.
    """
    loop = np.asarray(points, np.float64)
    if len(loop) < 4:
        return list(points)
    split = int(np.argmax(np.hypot(*(loop - loop[0]).T)))  # the ends of the halves stay, so they are far apart
    first = simplify_polyline(points[: split + 1], tolerance)
    second = simplify_polyline([*points[split:], points[0]], tolerance)
    return [*first[:-1], *second[:-1]]
