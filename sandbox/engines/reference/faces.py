"""Faces: the separating axis test of one convex outline against another, and the face that a contact lies on.

A piece is the rows start…end of `corner`, counter-clockwise: face k runs from corner k to the one after it, and its
normal looks to the right of that. Two corners are an outline of no area with two faces, back to back.
"""

import math

from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.trajectory import FloatArray

ROUGH = 1e-13
"""A face shorter than this part of its coordinates has no direction but what rounding gave it: it is passed over."""

STRAIGHT = 1e-9
"""Angle up to which two neighbouring faces are one, rad: corners set in the middle of a face make it no shorter."""


@kernel
def following(start: int, end: int, k: int) -> int:
    """Return the corner after k, going round."""
    return k + 1 if k + 1 < end else start


@kernel
def widest_gap(
    corner: FloatArray, start: int, end: int, other: int, other_end: int, enough: float
) -> tuple[float, int, int]:
    """Return how far the faces of one piece keep the other away, which face does, and the other's corner nearest to it.

    The gap is the least height of the other's corners over a face, m; the best face is the one of the largest gap: the
    axis of least penetration where all are negative. The search ends at a gap of `enough`. Where no face has a
    direction the gap is −inf.

    It is a lower bound of the distance of the pieces, and it is the distance wherever the nearest points lie in that
    face and at that corner. Where they lie at two corners, those are that corner and an end of that face: the face is
    then next to the corner of the Minkowski difference that is nearest to the origin.
    """
    best, face, nearest = -math.inf, start, other
    for k in range(start, end):
        after = following(start, end, k)
        x, y = corner[k, 0], corner[k, 1]
        along_x, along_y = corner[after, 0] - x, corner[after, 1] - y
        length = math.sqrt(along_x * along_x + along_y * along_y)
        if length <= ROUGH * (abs(x) + abs(y)):
            continue
        nx, ny = along_y / length, -along_x / length
        low, lowest = math.inf, other
        for j in range(other, other_end):
            gap = nx * (corner[j, 0] - x) + ny * (corner[j, 1] - y)
            if gap < low:
                low, lowest = gap, j
                if low <= best:  # this face is not the best, whatever the other corners do
                    break
        if low > best:
            best, face, nearest = low, k, lowest
            if best >= enough:
                break
    return best, face, nearest


@kernel
def whole_face(corner: FloatArray, start: int, end: int, one: int, two: int) -> tuple[int, int]:
    """Return the ends of the face that two neighbouring corners lie on, past those in line with them."""
    dx, dy = corner[two, 0] - corner[one, 0], corner[two, 1] - corner[one, 1]
    limit = STRAIGHT * STRAIGHT * (dx * dx + dy * dy)
    while True:
        far = following(start, end, two)
        ex, ey = corner[far, 0] - corner[two, 0], corner[far, 1] - corner[two, 1]
        cross = dx * ey - dy * ex
        if far == one or dx * ex + dy * ey < 0.0 or cross * cross > limit * (ex * ex + ey * ey):
            break
        two = far
    while True:
        far = one - 1 if one > start else end - 1
        ex, ey = corner[one, 0] - corner[far, 0], corner[one, 1] - corner[far, 1]
        cross = dx * ey - dy * ex
        if far == two or dx * ex + dy * ey < 0.0 or cross * cross > limit * (ex * ex + ey * ey):
            break
        one = far
    return one, two


@kernel
def face_at(corner: FloatArray, start: int, end: int, k: int, nx: float, ny: float) -> tuple[int, int]:
    """Return the ends of that face next to corner k whose normal looks the more along (nx, ny)."""
    x, y = corner[k, 0], corner[k, 1]
    shortest = ROUGH * (abs(x) + abs(y))
    # Corners that coincide with k, but for rounding, are passed over.
    after, out_x, out_y, out_length = k, 0.0, 0.0, 0.0
    before, in_x, in_y, in_length = k, 0.0, 0.0, 0.0
    for _ in range(start, end):
        after = following(start, end, after)
        out_x, out_y = corner[after, 0] - x, corner[after, 1] - y
        out_length = math.sqrt(out_x * out_x + out_y * out_y)
        if out_length > shortest:
            break
    for _ in range(start, end):
        before = before - 1 if before > start else end - 1
        in_x, in_y = x - corner[before, 0], y - corner[before, 1]
        in_length = math.sqrt(in_x * in_x + in_y * in_y)
        if in_length > shortest:
            break
    if out_length <= shortest or in_length <= shortest:
        return k, k
    if (out_y * nx - out_x * ny) * in_length >= (in_y * nx - in_x * ny) * out_length:
        return whole_face(corner, start, end, k, after)
    return whole_face(corner, start, end, before, k)
