"""Convex pieces: where two of them touch, or one touches a half-plane, by the cheapest test that fits.

A piece is the hull of its corners, widened by a radius: a disc has one corner, a capsule or a wall two, a polygon three
or more, counter-clockwise, in the world's coordinates. By the corners of the two: 1 and 1 a distance; 1 and 2 a
distance from a segment; 1 and more the faces of one and the region its centre lies in; else separating axes, then
clipping (Gottschalk, Lin & Manocha 1996; the contact points as in Box2D, whose distance of corners is here exact).

Every test returns how many points lie nearer than `reach` and writes them as rows of `out`: see clipping.
"""

import math

from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.engines.reference.clipping import clip, closest_points, write
from sandbox.engines.reference.faces import ROUGH, face_at, following, whole_face, widest_gap
from sandbox.engines.reference.narrow_phase import NARROW_PHASE
from sandbox.trajectory import FloatArray, IntArray

# Looked up once: compiled code cannot search a table.
circle_circle = NARROW_PHASE["circle", "circle"]
circle_segment = NARROW_PHASE["circle", "segment"]

FAVOUR = 5e-4
"""By which part of a face's length the other piece's face must part them better to be the one that is clipped to: Box2D
takes 0.5 mm. Without it two boxes at rest would change roles, and so their normal, from step to step."""

LEVEL = 0.01
"""Angle up to which two faces are level, rad."""

SLACK = 1e-9
"""Part of a face's length by which corners may lie beside each other and still count as face to face."""


@kernel
def meet_pieces(
    corner: FloatArray, first: IntArray, radius: FloatArray, p: int, q: int, reach: float, out: FloatArray
) -> int:
    """Write where pieces p and q are nearer than `reach`, m; return at how many points: 0, 1 or 2.

    Args:
        corner: (V, 2) of all pieces, m.
        first: row in `corner` of each one's first; piece p ends where p + 1 begins.
        radius: of each, m.
        p: the first, from which normals point.
        q: the second.
        reach: separation from which on nothing is written, m.
        out: (2, 6).
    """
    a, a_end, b, b_end = first[p], first[p + 1], first[q], first[q + 1]
    if a_end - a == 1:
        return meet_disc(corner, a, radius[p], b, b_end, radius[q], 1.0, reach, out)
    if b_end - b == 1:
        return meet_disc(corner, b, radius[q], a, a_end, radius[p], -1.0, reach, out)
    return meet_faces(corner, a, a_end, radius[p], b, b_end, radius[q], reach, out)


@kernel
def meet_disc(
    corner: FloatArray,
    c: int,
    disc_radius: float,
    start: int,
    end: int,
    piece_radius: float,
    sign: float,
    reach: float,
    out: FloatArray,
) -> int:
    """Write where a disc about corner c touches a piece; the sign is −1 where normals point to the disc."""
    x, y = corner[c, 0], corner[c, 1]
    px, py = corner[start, 0], corner[start, 1]
    if end - start == 1:
        separation, nx, ny = circle_circle(x, y, disc_radius, px, py, piece_radius)
    elif end - start == 2:
        qx, qy = corner[start + 1, 0], corner[start + 1, 1]
        separation, nx, ny = circle_segment(x, y, disc_radius, px, py, qx, qy, piece_radius)
    else:
        separation, nx, ny = disc_polygon(corner, c, disc_radius, start, end, piece_radius, reach)
    if separation >= reach:
        return 0
    middle = disc_radius + 0.5 * separation
    write(out, 0, sign * nx, sign * ny, separation, x + nx * middle, y + ny * middle, 0.0)
    return 1


@kernel
def disc_polygon(
    corner: FloatArray, c: int, disc_radius: float, start: int, end: int, piece_radius: float, reach: float
) -> tuple[float, float, float]:
    """Return separation and normal from a disc to a polygon: by the Voronoi region, of a face or a corner, it lies in.

    A centre inside leaves through the nearest face. Apart by `reach` or more, the separation is a lower bound.
    """
    x, y, wide = corner[c, 0], corner[c, 1], disc_radius + piece_radius
    gap, k, _ = widest_gap(corner, start, end, c, c + 1, reach + wide)
    if gap == -math.inf:  # no larger than rounding: a disc
        return circle_circle(x, y, disc_radius, corner[start, 0], corner[start, 1], piece_radius)
    one, two = whole_face(corner, start, end, k, following(start, end, k))
    tx, ty = corner[two, 0] - corner[one, 0], corner[two, 1] - corner[one, 1]
    length = math.sqrt(tx * tx + ty * ty)
    tx, ty = tx / length, ty / length
    if 0.0 < gap < reach + wide:
        near = one
        place = (x - corner[one, 0]) * tx + (y - corner[one, 1]) * ty
        if place > 0.0:
            near = two
            place = length - place
        if place < 0.0:
            separation, nx, ny = circle_circle(x, y, disc_radius, corner[near, 0], corner[near, 1], piece_radius)
            return separation, nx, ny
    return gap - wide, -ty, tx


@kernel
def meet_faces(
    corner: FloatArray,
    a: int,
    a_end: int,
    a_radius: float,
    b: int,
    b_end: int,
    b_radius: float,
    reach: float,
    out: FloatArray,
) -> int:
    """Write where two pieces of two corners or more touch: separating axes, then one face clipped to the other."""
    wide = a_radius + b_radius
    a_gap, a_face, b_corner = widest_gap(corner, a, a_end, b, b_end, reach + wide)
    if a_gap >= reach + wide:
        return 0
    b_gap, b_face, a_corner = widest_gap(corner, b, b_end, a, a_end, reach + wide)
    if b_gap >= reach + wide:
        return 0
    gap = max(a_gap, b_gap)
    if gap == -math.inf:  # neither is larger than rounding: two discs
        return meet_disc(corner, a, a_radius, b, b + 1, b_radius, 1.0, reach, out)

    # The reference face, whose normal counts, and the incident one across from it
    turned, one, two, incident, other = facing(
        corner, a, a_end, a_gap, a_face, a_corner, b, b_end, b_gap, b_face, b_corner
    )
    sign = -1.0 if turned else 1.0
    own, its = (b_radius, a_radius) if turned else (a_radius, b_radius)
    nx, ny = corner[two, 1] - corner[one, 1], corner[one, 0] - corner[two, 0]
    length = math.sqrt(nx * nx + ny * ny)
    nx, ny = nx / length, ny / length
    across = math.sqrt((corner[other, 0] - corner[incident, 0]) ** 2 + (corner[other, 1] - corner[incident, 1]) ** 2)
    slack = SLACK * min(length, across) + ROUGH * (abs(corner[one, 0]) + abs(corner[one, 1]))
    over, begin_x, begin_y, begin, end_x, end_y, end = clip(corner, one, two, incident, other, slack)

    # Apart, the nearest points may be corners. So may those of two segments in line, which no face keeps apart.
    if gap > 0.0 or (not over and a_end - a == 2 and b_end - b == 2):
        distance, x, y, its_x, its_y = closest_points(corner, one, two, incident, other)
        # Seen from the face of the wider gap, which need not be the reference, nearest points lie straight across.
        dx, dy = nx, ny
        if turned != (b_gap > a_gap):
            dx = (corner[incident, 1] - corner[other, 1]) / across
            dy = (corner[other, 0] - corner[incident, 0]) / across
        if not over or abs((its_x - x) * dy - (its_y - y) * dx) > slack:
            if distance - wide >= reach:
                return 0
            nx, ny = sign * (its_x - x) / distance, sign * (its_y - y) / distance
            middle = 0.5 * sign * (distance + own - its)
            write(out, 0, nx, ny, distance - wide, x + nx * middle, y + ny * middle, 0.0)
            return 1
    if not over:  # by rounding: slivers
        deepest = a_corner if turned else b_corner
        incident, other, begin_x, begin_y, begin = deepest, deepest, corner[deepest, 0], corner[deepest, 1], gap

    count = 0
    for row in range(1 if incident == other else 2):
        x, y, height = (begin_x, begin_y, begin) if (row == 0) != turned else (end_x, end_y, end)
        if height - wide < reach:
            middle = 0.5 * (height + its - own)
            write(out, count, sign * nx, sign * ny, height - wide, x - nx * middle, y - ny * middle, float(row))
            count += 1
    return count


@kernel
def facing(
    corner: FloatArray,
    a: int,
    a_end: int,
    a_gap: float,
    a_face: int,
    a_corner: int,
    b: int,
    b_end: int,
    b_gap: float,
    b_face: int,
    b_corner: int,
) -> tuple[bool, int, int, int, int]:
    """Return whether the second piece has the reference face, the ends of that, and those of the incident face."""
    a_one, a_two = whole_face(corner, a, a_end, a_face, following(a, a_end, a_face))
    if b_gap > a_gap:
        b_one, b_two = whole_face(corner, b, b_end, b_face, following(b, b_end, b_face))
        dx, dy = corner[b_two, 0] - corner[b_one, 0], corner[b_two, 1] - corner[b_one, 1]
        incident, other = face_at(corner, a, a_end, a_corner, -dy, dx)
        ex, ey = corner[a_two, 0] - corner[a_one, 0], corner[a_two, 1] - corner[a_one, 1]
        own, its = math.sqrt(dx * dx + dy * dy), math.sqrt(ex * ex + ey * ey)
        if b_gap > a_gap + FAVOUR * min(own, its):
            return True, b_one, b_two, incident, other
        # Apart, the normal must remain the way between the nearest points: only faces across from each other, and
        # level, change roles.
        if b_gap > 0.0:
            if incident != a_one or other != a_two or abs(dx * ey - dy * ex) > LEVEL * own * its:
                return True, b_one, b_two, incident, other
            return False, a_one, a_two, b_one, b_two
    dx, dy = corner[a_two, 0] - corner[a_one, 0], corner[a_two, 1] - corner[a_one, 1]
    incident, other = face_at(corner, b, b_end, b_corner, -dy, dx)
    return False, a_one, a_two, incident, other


@kernel
def meet_half_plane(
    corner: FloatArray,
    first: IntArray,
    radius: FloatArray,
    p: int,
    px: float,
    py: float,
    nx: float,
    ny: float,
    reach: float,
    out: FloatArray,
) -> int:
    """Write where piece p is nearer than `reach`, m, to a half-plane, at its lowest face; return at how many points.

    The half-plane is solid behind its unit normal at (px, py); normals of contact point into it.
    """
    start, end, wide = first[p], first[p + 1], radius[p]
    low, lowest = math.inf, start
    for k in range(start, end):
        height = (corner[k, 0] - px) * nx + (corner[k, 1] - py) * ny
        if height < low:
            low, lowest = height, k
    if low - wide >= reach:
        return 0
    one, two = face_at(corner, start, end, lowest, -nx, -ny)
    # Counted along the normal of contact turned left
    if (corner[one, 0] - corner[two, 0]) * ny > (corner[one, 1] - corner[two, 1]) * nx:
        one, two = two, one
    count = 0
    for row in range(1 if one == two else 2):
        k = one if row == 0 else two
        separation = (corner[k, 0] - px) * nx + (corner[k, 1] - py) * ny - wide
        if separation < reach:
            middle = wide + 0.5 * separation
            x, y = corner[k, 0] - nx * middle, corner[k, 1] - ny * middle
            write(out, count, -nx, -ny, separation, x, y, float(row))
            count += 1
    return count
