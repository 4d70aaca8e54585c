"""Spans: the part of a row of pixels that lies in a piece, compiled where it can be.

A piece's `room` is (V, 5 or more): x and y of each corner, px, then normal and offset of the side behind it.
"""

import math

from sandbox.arrays import FloatArray
from sandbox.engines.common.kernel import bare_kernel


@bare_kernel
def span(
    y: float, room: FloatArray, first: int, last: int, offset: float, left: float, right: float
) -> tuple[float, float]:
    """Return from where to where a row lies no farther than an offset outside all sides of a polygon."""
    from_x, to_x = left, right
    for k in range(first, last):
        across, bound = room[k, 2], offset - (room[k, 3] * y + room[k, 4])
        if across > 1e-9:
            to_x = min(to_x, bound / across)
        elif across < -1e-9:
            from_x = max(from_x, bound / across)
        elif bound < 0.0:
            to_x = left - 1.0
    return from_x, to_x


@bare_kernel
def inner_span(
    y: float, room: FloatArray, first: int, last: int, radius: float, left: float, right: float
) -> tuple[float, float]:
    """Return from where to where a row surely lies within a piece whose radius is this, which may be negative."""
    if last - first > 2:
        return span(y, room, first, last, min(radius, 0.0), left, right)
    if radius <= 0.0:
        return left, left - 1.0
    if last - first == 1:
        under = radius * radius - (y - room[first, 1]) ** 2
        half = math.sqrt(max(under, 0.0))
        return max(left, room[first, 0] - half), min(right, room[first, 0] + half) if under > 0.0 else left - 1.0
    from_x, to_x = span(y, room, first, last, radius, left, right)
    for k in range(first, last):  # no farther than the ends
        after = 2 * first + 1 - k
        dx, dy = room[after, 0] - room[k, 0], room[after, 1] - room[k, 1]
        bound = dy * (room[k, 1] - y)
        if dx > 1e-9:
            from_x = max(from_x, room[k, 0] + bound / dx)
        elif dx < -1e-9:
            to_x = min(to_x, room[k, 0] + bound / dx)
        elif bound > 0.0:
            to_x = left - 1.0
    return from_x, to_x


@bare_kernel
def outer_span(
    y: float, room: FloatArray, first: int, last: int, radius: float, left: float, right: float
) -> tuple[float, float]:
    """Return from where to where a row may lie within a piece whose radius is this: beyond, it surely does not."""
    low_x, high_x, low_y, high_y = math.inf, -math.inf, math.inf, -math.inf
    for k in range(first, last):
        low_x, high_x = min(low_x, room[k, 0]), max(high_x, room[k, 0])
        low_y, high_y = min(low_y, room[k, 1]), max(high_y, room[k, 1])
    if y < low_y - radius or y > high_y + radius:
        return left, left - 1.0
    from_x, to_x = max(left, low_x - radius), min(right, high_x + radius)
    if last - first == 1:
        return from_x, to_x
    return span(y, room, first, last, radius, from_x, to_x)
