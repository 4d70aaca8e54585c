"""Narrow phase: whether and how a circle touches a half-plane, a segment or another circle.

NARROW_PHASE is the table, keyed by shape pair. Each entry takes two shapes with their poses and returns a manifold:
the separation (m; negative in overlap, and only then is there contact) and the unit normal from the first shape to
the second. For circles one point is enough: it lies on the normal through the centre.
"""

import math
from collections.abc import Callable

from sandbox.engines.kernel import kernel

Manifold = tuple[float, float, float]
"""separation, m, and normal x, y"""


@kernel
def circle_circle(ax: float, ay: float, a_radius: float, bx: float, by: float, b_radius: float) -> Manifold:
    """Return how two circles lie; coincident centres have the normal (1, 0), as in Munk2D."""
    x, y = bx - ax, by - ay
    distance = math.sqrt(x * x + y * y)
    if distance == 0.0:
        return -(a_radius + b_radius), 1.0, 0.0
    # By the reciprocal, as Munk2D divides: the same roundings.
    inverse = 1.0 / distance
    return distance - (a_radius + b_radius), x * inverse, y * inverse


@kernel
def circle_half_plane(x: float, y: float, radius: float, px: float, py: float, nx: float, ny: float) -> Manifold:
    """Return how a circle lies to a half-plane that is solid behind its normal: the tutorial's example 4.

    They intersect when the centre's height over the surface is less than the radius. With radius 1 over y = 0:

    >>> [circle_half_plane(0.0, y, 1.0, 0.0, 0.0, 0.0, 1.0)[0] < 0.0 for y in (2.0, 1.001, 1.0)]
    [False, False, False]
    >>> [circle_half_plane(0.0, y, 1.0, 0.0, 0.0, 0.0, 1.0)[0] < 0.0 for y in (0.999, 0.009, 0.0, -1.0)]
    [True, True, True, True]
    """
    return (x - px) * nx + (y - py) * ny - radius, -nx, -ny


@kernel
def circle_segment(
    x: float, y: float, radius: float, ax: float, ay: float, bx: float, by: float, half_thickness: float
) -> Manifold:
    """Return how a circle lies to a segment with round ends; one of no length is a circle.

    A centre on the segment itself leaves to its left; on one of no length, along x.
    """
    along_x, along_y = bx - ax, by - ay
    length2 = along_x * along_x + along_y * along_y
    share = 0.0
    if length2 > 0.0:
        share = min(max((along_x * (x - ax) + along_y * (y - ay)) / length2, 0.0), 1.0)
    dx, dy = ax + along_x * share - x, ay + along_y * share - y
    distance = math.sqrt(dx * dx + dy * dy)
    separation = distance - (radius + half_thickness)
    if distance > 0.0:
        inverse = 1.0 / distance
        return separation, dx * inverse, dy * inverse
    if length2 > 0.0:
        inverse = 1.0 / math.sqrt(length2)
        return separation, along_y * inverse, -along_x * inverse
    return separation, 1.0, 0.0


NARROW_PHASE: dict[tuple[str, str], Callable[..., Manifold]] = {
    ("circle", "circle"): circle_circle,
    ("circle", "half_plane"): circle_half_plane,
    ("circle", "segment"): circle_segment,
}
