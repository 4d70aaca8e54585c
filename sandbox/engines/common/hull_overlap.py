"""Overlaps of convex hulls of corners, widened by radii: of a piece of a sensor with bodies and with static objects.

Two shapes overlap if their hulls do, or are nearer to each other than the sum of the radii. Shapes that only touch do
not overlap.
"""

import math

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.geometry import nearest_fraction
from sandbox.engines.common.kernel import kernel


@kernel
def _is_separated(a: FloatArray, b: FloatArray) -> bool:
    """Return whether another hull is beyond an edge of a hull, or touches its line from there.

    Two hulls are apart if one of them is so. Parallel segments always are: their distance decides whether they overlap.

    Args:
        a: (V, 2) m, corners, counter-clockwise; one corner has no edge.
        b: (W, 2) m, corners of the other hull.
    """
    count = len(a)
    if count == 1:
        return False
    for k in range(count):  # of a segment both directions, one for each side
        ax, ay = a[k, 0], a[k, 1]
        following = (k + 1) % count
        dx, dy = a[following, 0] - ax, a[following, 1] - ay
        beyond = True
        for j in range(len(b)):
            x, y = b[j, 0] - ax, b[j, 1] - ay
            beyond = beyond and dy * x - dx * y >= 0.0
        if beyond:
            return True
    return False


@kernel
def _distance_squared(a: FloatArray, b: FloatArray) -> float:
    """Return the squared distance, m², from the corners of a hull to the nearest edge of another hull."""
    nearest = math.inf
    count = len(b)
    for k in range(count):
        following = (k + 1) % count
        ax, ay, bx, by = b[k, 0], b[k, 1], b[following, 0], b[following, 1]
        for j in range(len(a)):
            x, y = a[j, 0], a[j, 1]
            fraction = nearest_fraction(ax, ay, bx, by, x, y)
            dx, dy = x - ax - fraction * (bx - ax), y - ay - fraction * (by - ay)
            nearest = min(nearest, dx * dx + dy * dy)
    return nearest


@kernel
def hulls_overlap(a: FloatArray, b: FloatArray, width: float) -> bool:
    """Return whether two convex hulls overlap.

    Args:
        a: (V, 2) m, corners, counter-clockwise.
        b: (W, 2) m, corners of the other hull.
        width: sum of the radii by which the hulls are widened, m.
    """
    if len(a) + len(b) > 2 and not _is_separated(a, b) and not _is_separated(b, a):
        return True
    return min(_distance_squared(a, b), _distance_squared(b, a)) < width * width


@kernel
def place(corner: FloatArray, x: float, y: float, angle: float, out: FloatArray) -> None:
    """Write corners (V, 2), m, of a body's frame about its centre of mass in the world."""
    cos, sin = math.cos(angle), math.sin(angle)
    for k in range(len(corner)):
        out[k, 0] = x + cos * corner[k, 0] - sin * corner[k, 1]
        out[k, 1] = y + sin * corner[k, 0] + cos * corner[k, 1]


@kernel
def mark_bodies(
    hull: FloatArray,
    radius: float,
    middle: FloatArray,
    reach: float,
    position: FloatArray,
    angle: FloatArray,
    body_reach: FloatArray,
    is_detectable: BoolArray,
    piece_body: IntArray,
    piece_first: IntArray,
    piece_corner: FloatArray,
    piece_radius: FloatArray,
    found: BoolArray,
) -> None:
    """Mark the bodies that overlap a piece of a sensor.

    Args:
        hull: (V, 2) m, corners of the piece in the world.
        radius: of the piece, m.
        middle: (2,) m, centre of a disc that contains the piece.
        reach: radius of that disc, m.
        position: (N, 2) m, of the bodies.
        angle: (N,) rad.
        body_reach: (N,) m, distance from the position to the farthest point of each.
        is_detectable: (N,) whether each can be detected.
        piece_body: (P,) of `Shapes`, as the next three arguments.
        piece_first: (P + 1,).
        piece_corner: (C, 2) m.
        piece_radius: (P,) m.
        found: (N,) marks; added to.
    """
    for k in range(len(piece_body)):
        n = piece_body[k]
        if not is_detectable[n] or found[n]:
            continue
        dx, dy = position[n, 0] - middle[0], position[n, 1] - middle[1]
        near = reach + body_reach[n]
        if not dx * dx + dy * dy <= near * near:
            continue
        own = piece_corner[piece_first[k] : piece_first[k + 1]]
        placed = np.empty_like(own)
        place(own, position[n, 0], position[n, 1], angle[n], placed)
        found[n] = hulls_overlap(hull, placed, radius + piece_radius[k])


@kernel
def mark_static(
    hull: FloatArray,
    radius: float,
    middle: FloatArray,
    reach: float,
    owner: IntArray,
    first: IntArray,
    corner: FloatArray,
    width: FloatArray,
    centre: FloatArray,
    extent: FloatArray,
    is_detectable: BoolArray,
    found: BoolArray,
) -> None:
    """Mark the walls and posts that overlap a piece of a sensor.

    Args:
        hull: (V, 2) m, corners of the piece in the world.
        radius: of the piece, m.
        middle: (2,) m, centre of a disc that contains the piece.
        reach: radius of that disc, m.
        owner: (H,) number of the static object of each hull.
        first: (H + 1,) row in `corner` of the first corner of each hull.
        corner: (C, 2) m.
        width: (H,) m, radius of each hull.
        centre: (H, 2) m, centre of a disc that contains each hull.
        extent: (H,) m, radius of that disc.
        is_detectable: (F,) whether each static object can be detected.
        found: (F,) marks; added to.
    """
    for k in range(len(owner)):
        n = owner[k]
        if not is_detectable[n] or found[n]:
            continue
        dx, dy, near = centre[k, 0] - middle[0], centre[k, 1] - middle[1], reach + extent[k]
        if dx * dx + dy * dy <= near * near:
            found[n] = hulls_overlap(hull, corner[first[k] : first[k + 1]], radius + width[k])
