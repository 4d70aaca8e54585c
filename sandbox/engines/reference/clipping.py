"""Clipping: the contact points of two faces, and how rows of contact are written.

A row of `out` (2, 6) is: normal x, y, from the first piece to the second; separation, m, negative in overlap; point
x, y, midway in the overlap; feature, 0 or 1: which of the two points, counted along the normal turned left.
"""

import math

from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.trajectory import FloatArray


@kernel
def write(
    out: FloatArray, row: int, nx: float, ny: float, separation: float, x: float, y: float, feature: float
) -> None:
    """Write one point of contact."""
    out[row, 0], out[row, 1], out[row, 2] = nx, ny, separation
    out[row, 3], out[row, 4], out[row, 5] = x, y, feature


@kernel
def clip(
    corner: FloatArray, one: int, two: int, first: int, second: int, slack: float
) -> tuple[bool, float, float, float, float, float, float]:
    """Cut a face to what lies over another, as Sutherland and Hodgman (1974) do to one edge.

    Args:
        corner: (V, 2) m.
        one: corner at which the reference face begins.
        two: corner at which it ends.
        first: corner at one end of the incident face.
        second: corner at its other end.
        slack: how far beside the reference face the incident one may lie, and no end is cut, m.

    Returns:
        Whether anything is left; then x, y and height over the reference face, m, of the two ends of what is left, in
        the order in which the reference face runs.
    """
    x, y = corner[one, 0], corner[one, 1]
    tx, ty = corner[two, 0] - x, corner[two, 1] - y
    length = math.sqrt(tx * tx + ty * ty)
    tx, ty = tx / length, ty / length
    low = (corner[first, 0] - x) * tx + (corner[first, 1] - y) * ty
    high = (corner[second, 0] - x) * tx + (corner[second, 1] - y) * ty
    if low > high:
        first, second, low, high = second, first, high, low
    if low > length + slack or high < -slack:
        return False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    ax, ay, bx, by = corner[first, 0], corner[first, 1], corner[second, 0], corner[second, 1]
    dx, dy, width = bx - ax, by - ay, high - low
    begin_x, begin_y, end_x, end_y = ax, ay, bx, by
    if low < -slack:
        share = -low / width if high > 0.0 else 1.0
        begin_x, begin_y = ax + share * dx, ay + share * dy
    if high > length + slack:
        back = (high - length) / width if low < length else 1.0
        end_x, end_y = bx - back * dx, by - back * dy
    begin = (begin_x - x) * ty - (begin_y - y) * tx
    end = (end_x - x) * ty - (end_y - y) * tx
    return True, begin_x, begin_y, begin, end_x, end_y, end


@kernel
def closest_points(
    corner: FloatArray, one: int, two: int, first: int, second: int
) -> tuple[float, float, float, float, float]:
    """Return the distance of two faces that do not cross, m, and x, y of the nearest points of each."""
    best, ax, ay, bx, by = math.inf, 0.0, 0.0, 0.0, 0.0
    for k in range(4):
        # Of two segments that do not cross, one of the nearest points is an end.
        if k < 2:
            end, begin, far = (one if k == 0 else two), first, second
        else:
            end, begin, far = (first if k == 2 else second), one, two
        x, y, qx, qy = corner[end, 0], corner[end, 1], corner[begin, 0], corner[begin, 1]
        dx, dy = corner[far, 0] - qx, corner[far, 1] - qy
        length2 = dx * dx + dy * dy
        if length2 > 0.0:
            share = ((x - qx) * dx + (y - qy) * dy) / length2
            if share >= 1.0:
                qx, qy = corner[far, 0], corner[far, 1]
            elif share > 0.0:
                qx, qy = qx + share * dx, qy + share * dy
        distance2 = (x - qx) * (x - qx) + (y - qy) * (y - qy)
        if distance2 < best:
            best = distance2
            if k < 2:
                ax, ay, bx, by = x, y, qx, qy
            else:
                ax, ay, bx, by = qx, qy, x, y
    return math.sqrt(best), ax, ay, bx, by
