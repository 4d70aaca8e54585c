"""Oriented boxes: a rectangle around each convex piece, turned with it, and whether two of them are apart.

Tighter than a disc or an upright box around what is long, and four axes are tested whatever the number of corners.
"""

import math

from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.engines.reference.faces import following
from sandbox.engines.reference.meeting import ROUNDING
from sandbox.trajectory import FloatArray, IntArray

OrientedBox = tuple[float, float, float, float, float, float]
"""centre x, y, m; unit axis x, y; half the extent along that axis and along its normal, m"""


@kernel
def box_of(corner: FloatArray, first: IntArray, radius: FloatArray, p: int) -> OrientedBox:
    """Return the box around piece p that lies along its longest face: the piece itself where that is a rectangle.

    It is not always the smallest: an outline has one of least area along some face, not always the longest.
    """
    start, end, wide = first[p], first[p + 1], radius[p]
    longest, ax, ay = 0.0, 1.0, 0.0
    for k in range(start, end):
        after = following(start, end, k)
        dx, dy = corner[after, 0] - corner[k, 0], corner[after, 1] - corner[k, 1]
        length = math.sqrt(dx * dx + dy * dy)
        if length > longest:
            longest, ax, ay = length, dx / length, dy / length
    x, y = corner[start, 0], corner[start, 1]
    left = right = low = high = 0.0
    for k in range(start + 1, end):
        dx, dy = corner[k, 0] - x, corner[k, 1] - y
        along, across = dx * ax + dy * ay, ax * dy - ay * dx
        left, right = min(left, along), max(right, along)
        low, high = min(low, across), max(high, across)
    along, across = 0.5 * (left + right), 0.5 * (low + high)
    return (
        x + along * ax - across * ay,
        y + along * ay + across * ax,
        ax,
        ay,
        0.5 * (right - left) + wide,
        0.5 * (high - low) + wide,
    )


@kernel
def boxes_apart(a: OrientedBox | FloatArray, b: OrientedBox | FloatArray, margin: float) -> bool:
    """Tell whether two boxes, or rows that hold them, are farther apart than the margin, m, along one of their axes.

    Two whose nearest points are corners may be farther apart than that and not be told so.
    """
    x, y = b[0] - a[0], b[1] - a[1]
    cos, sin = abs(a[2] * b[2] + a[3] * b[3]), abs(a[2] * b[3] - a[3] * b[2])
    # What centres and extents are rounded by must not part two that touch.
    margin += 8.0 * ROUNDING * (abs(a[0]) + abs(a[1]) + abs(b[0]) + abs(b[1]) + a[4] + a[5] + b[4] + b[5])
    return bool(
        abs(x * a[2] + y * a[3]) > a[4] + b[4] * cos + b[5] * sin + margin
        or abs(a[2] * y - a[3] * x) > a[5] + b[4] * sin + b[5] * cos + margin
        or abs(x * b[2] + y * b[3]) > b[4] + a[4] * cos + a[5] * sin + margin
        or abs(b[2] * y - b[3] * x) > b[5] + a[4] * sin + a[5] * cos + margin
    )
