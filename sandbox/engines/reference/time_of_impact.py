"""Time of impact: when a circle on a straight path first touches something, in closed form.

Each function returns the fraction of the path, 0…1, or `NEVER`. A circle that touches already touches at 0 if it
approaches, and never if it moves away or along.
"""

import math

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.reference.broad_phase import FIRST, SECOND, contains_key, pair_key
from sandbox.engines.reference.manifold import KIND, circle_segment, is_covered

NEVER = 2.0
"""Larger than any fraction of the path"""


@kernel
def touch_circle(x: float, y: float, mx: float, my: float, distance: float) -> float:
    """Return when a point at (x, y) that moves by (mx, my) comes within a distance of the origin, m.

    The discriminant is computed from the cross product, without cancellation in a graze: D = A·R² − (x × m)².
    """
    length2, along = mx * mx + my * my, x * mx + y * my
    if along >= 0.0:
        return NEVER
    excess = x * x + y * y - distance * distance
    if excess <= 0.0:
        return 0.0
    cross = x * my - y * mx
    discriminant = length2 * distance * distance - cross * cross
    if discriminant < 0.0:
        return NEVER
    fraction = excess / (-along + math.sqrt(discriminant))
    return fraction if fraction <= 1.0 else NEVER


@kernel
def touch_line(gap: float, approach: float) -> float:
    """Return when a gap, m, that shrinks by `approach`, m, over the whole displacement is closed."""
    if approach <= 0.0:
        return NEVER
    fraction = max(gap, 0.0) / approach
    return fraction if fraction <= 1.0 else NEVER


@kernel
def touch_segment(
    x: float, y: float, mx: float, my: float, ax: float, ay: float, bx: float, by: float, distance: float
) -> float:
    """Return when a point at (x, y) that moves by (mx, my) comes within a distance of a segment, m."""
    along_x, along_y = bx - ax, by - ay
    length = math.sqrt(along_x * along_x + along_y * along_y)
    along = 0.0
    if length > 0.0:
        along_x, along_y = along_x / length, along_y / length
        along = min(max((x - ax) * along_x + (y - ay) * along_y, 0.0), length)
    dx, dy = x - ax - along * along_x, y - ay - along * along_y
    if dx * dx + dy * dy <= distance * distance:
        # The shape is convex: a circle that moves away from its nearest point does not come nearer later.
        return 0.0 if dx * mx + dy * my < 0.0 else NEVER
    first = min(
        touch_circle(x - ax, y - ay, mx, my, distance),
        touch_circle(x - bx, y - by, mx, my, distance),
    )
    if length == 0.0:
        return first
    side = along_x * (y - ay) - along_y * (x - ax)
    rate = along_x * my - along_y * mx
    if side < 0.0:
        side, rate = -side, -rate
    fraction = touch_line(side - distance, -rate)
    if fraction < first:
        along = (x + fraction * mx - ax) * along_x + (y + fraction * my - ay) * along_y
        if 0.0 <= along <= length:
            first = fraction
    return first


@kernel
def first_touch(
    start: FloatArray,
    end: FloatArray,
    radius: FloatArray,
    can_touch: BoolArray,
    balls: IntArray,
    planes: FloatArray,
    segment_keys: IntArray,
    segments: FloatArray,
    joints: FloatArray,
    resting: IntArray,
) -> tuple[float, int]:
    """Return the fraction of the displacement, and the key, of the first touch among candidates; key −1 for none.

    Args:
        start: (N, ≥ 2) centres, m.
        end: (N, ≥ 2) m.
        radius: (N,) m.
        can_touch: (N,) whether each body can touch planes.
        balls: keys of two balls.
        planes: (P, 4).
        segment_keys: keys of a ball and a segment.
        segments: (G, 5).
        joints: (G, 4) m, as in `StaticColliders.joints`.
        resting: keys, ascending, of pairs that are ignored.
    """
    first, found = NEVER, -1
    for k in range(len(balls)):
        i, j = balls[k] >> FIRST, balls[k] & SECOND
        x, y = start[j, 0] - start[i, 0], start[j, 1] - start[i, 1]
        mx, my = end[j, 0] - end[i, 0] - x, end[j, 1] - end[i, 1] - y
        fraction = touch_circle(x, y, mx, my, radius[i] + radius[j])
        if fraction < first and not contains_key(resting, balls[k]):
            first, found = fraction, balls[k]
    for i in range(len(start)):
        if can_touch[i]:
            mx, my = end[i, 0] - start[i, 0], end[i, 1] - start[i, 1]
            for p in range(len(planes)):
                nx, ny = planes[p, 2], planes[p, 3]
                gap = (start[i, 0] - planes[p, 0]) * nx + (start[i, 1] - planes[p, 1]) * ny - radius[i]
                fraction = touch_line(gap, -(mx * nx + my * ny))
                key = (1 << KIND) + pair_key(i, p)
                if fraction < first and not contains_key(resting, key):
                    first, found = fraction, key
    for k in range(len(segment_keys)):
        i, s = segment_keys[k] >> FIRST, segment_keys[k] & SECOND
        x, y = start[i, 0], start[i, 1]
        ax, ay, bx, by = segments[s, 0], segments[s, 1], segments[s, 2], segments[s, 3]
        fraction = touch_segment(x, y, end[i, 0] - x, end[i, 1] - y, ax, ay, bx, by, radius[i] + segments[s, 4])
        key = (2 << KIND) + segment_keys[k]
        if fraction < first and not contains_key(resting, key):
            x, y = x + fraction * (end[i, 0] - x), y + fraction * (end[i, 1] - y)
            _, nx, ny = circle_segment(x, y, radius[i], ax, ay, bx, by, segments[s, 4])
            before_x, before_y, after_x, after_y = joints[s, 0], joints[s, 1], joints[s, 2], joints[s, 3]
            if not is_covered(x, y, ax, ay, bx, by, nx, ny, before_x, before_y, after_x, after_y):
                first, found = fraction, key
    return first, found
