"""Convex polygons: separating axes, clipping, and the contact points of a pair.

A piece is the convex hull of its corners, widened by a radius: a disc has one corner, a capsule or a wall segment two,
a polygon three or more. Its corners are the rows start…end of `corner`, counter-clockwise, in world coordinates. Face k
runs from corner k to the next; its normal points to the right of that direction. Two corners have two opposite faces
and no area.

The test depends on the numbers of corners: 1 and 1, distance of points; 1 and 2, distance from a segment; 1 and more,
the Voronoi region of the polygon in which the centre lies; else separating axes, then clipping (Gottschalk, Lin &
Manocha 1996). The contact points are those of Box2D, except that the distance between corners is exact here.

Every test writes the points with a separation below `max_separation` as rows of `out` and returns their number. A row
of `out` (2, 6) is: normal x, y, from the first piece to the second; separation, m, negative in overlap; point x, y, in
the middle of the overlap; feature, 0 or 1, the order of the two points along the normal turned left.
"""

import math

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.reference.manifold import circle_circle, circle_segment


@kernel
def write_point(
    out: FloatArray, row: int, nx: float, ny: float, separation: float, x: float, y: float, feature: float
) -> None:
    """Write one contact point."""
    out[row, 0], out[row, 1], out[row, 2] = nx, ny, separation
    out[row, 3], out[row, 4], out[row, 5] = x, y, feature


@kernel
def clip(
    corner: FloatArray, one: int, two: int, first: int, second: int, slack: float
) -> tuple[bool, float, float, float, float, float, float]:
    """Clip a face to the extent of another, as Sutherland and Hodgman (1974) do to one edge.

    Args:
        corner: (V, 2) m.
        one: corner at which the reference face begins.
        two: corner at which it ends.
        first: corner at one end of the incident face.
        second: corner at its other end.
        slack: distance beside the reference face, m, up to which an end is not clipped.

    Returns:
        Whether a part remains; then x, y and height over the reference face, m, of the two ends of that part, in
        the direction of the reference face.
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
        fraction = -low / width if high > 0.0 else 1.0
        begin_x, begin_y = ax + fraction * dx, ay + fraction * dy
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
    """Return the distance of two faces that do not intersect, m, and x, y of the closest point of each."""
    best, ax, ay, bx, by = math.inf, 0.0, 0.0, 0.0, 0.0
    for k in range(4):
        # One of the closest points of two segments that do not intersect is an end.
        if k < 2:
            end, begin, far = (one if k == 0 else two), first, second
        else:
            end, begin, far = (first if k == 2 else second), one, two
        x, y, qx, qy = corner[end, 0], corner[end, 1], corner[begin, 0], corner[begin, 1]
        dx, dy = corner[far, 0] - qx, corner[far, 1] - qy
        length2 = dx * dx + dy * dy
        if length2 > 0.0:
            fraction = ((x - qx) * dx + (y - qy) * dy) / length2
            if fraction >= 1.0:
                qx, qy = corner[far, 0], corner[far, 1]
            elif fraction > 0.0:
                qx, qy = qx + fraction * dx, qy + fraction * dy
        distance2 = (x - qx) * (x - qx) + (y - qy) * (y - qy)
        if distance2 < best:
            best = distance2
            if k < 2:
                ax, ay, bx, by = x, y, qx, qy
            else:
                ax, ay, bx, by = qx, qy, x, y
    return math.sqrt(best), ax, ay, bx, by


DEGENERATE = 1e-13
"""Length of a face, as a fraction of its coordinates, below which its direction is rounding error; it is ignored"""

COLLINEAR = 1e-9
"""rad, angle between neighbouring faces up to which they are one face: corners in the middle of a face do not divide
it"""


@kernel
def next_corner(start: int, end: int, k: int) -> int:
    """Return the corner after k, cyclically."""
    return k + 1 if k + 1 < end else start


@kernel
def widest_gap(
    corner: FloatArray, start: int, end: int, other: int, other_end: int, enough: float
) -> tuple[float, int, int]:
    """Return the largest gap over the faces of one piece, its face, and the other piece's corner nearest to that face.

    The gap of a face is the smallest height of the other piece's corners over it, m. The face of the largest gap is the
    axis of least penetration if all gaps are negative. The search stops at a gap of `enough`. If all faces are
    degenerate, the gap is −inf.

    The gap is a lower bound of the distance of the pieces. It equals the distance if the closest points are that corner
    and a point of that face. If they are two corners, they are that corner and an end of that face, because the face is
    then adjacent to the corner of the Minkowski difference closest to the origin.
    """
    best, face, nearest = -math.inf, start, other
    for k in range(start, end):
        after = next_corner(start, end, k)
        x, y = corner[k, 0], corner[k, 1]
        along_x, along_y = corner[after, 0] - x, corner[after, 1] - y
        length = math.sqrt(along_x * along_x + along_y * along_y)
        if length <= DEGENERATE * (abs(x) + abs(y)):
            continue
        nx, ny = along_y / length, -along_x / length
        low, lowest = math.inf, other
        for j in range(other, other_end):
            gap = nx * (corner[j, 0] - x) + ny * (corner[j, 1] - y)
            if gap < low:
                low, lowest = gap, j
                if low <= best:  # the gap of this face is not the largest
                    break
        if low > best:
            best, face, nearest = low, k, lowest
            if best >= enough:
                break
    return best, face, nearest


@kernel
def whole_face(corner: FloatArray, start: int, end: int, one: int, two: int) -> tuple[int, int]:
    """Return the ends of the face of two neighbouring corners, across corners that are collinear with them."""
    dx, dy = corner[two, 0] - corner[one, 0], corner[two, 1] - corner[one, 1]
    limit = COLLINEAR * COLLINEAR * (dx * dx + dy * dy)
    while True:
        far = next_corner(start, end, two)
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
    """Return the ends of the face adjacent to corner k whose normal is closer to (nx, ny)."""
    x, y = corner[k, 0], corner[k, 1]
    shortest = DEGENERATE * (abs(x) + abs(y))
    # Skip corners that coincide with k up to rounding.
    after, out_x, out_y, out_length = k, 0.0, 0.0, 0.0
    before, in_x, in_y, in_length = k, 0.0, 0.0, 0.0
    for _ in range(start, end):
        after = next_corner(start, end, after)
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


REFERENCE_FACE_BIAS = 5e-4
"""Gap difference, as a fraction of a face's length, above which the second piece gets the reference face; Box2D uses
0.5 mm. Without it two boxes at rest would swap roles, and with them the normal, from step to step."""

PARALLEL = 0.01
"""rad, angle up to which two faces are parallel"""

SLACK = 1e-9
"""Distance along a face, as a fraction of its length, within which two corners are opposite each other"""


@kernel
def collide_pieces(
    corner: FloatArray, first: IntArray, radius: FloatArray, p: int, q: int, max_separation: float, out: FloatArray
) -> int:
    """Write the contact of pieces p and q; return its number of points: 0, 1 or 2.

    Args:
        corner: (V, 2) of all pieces, m.
        first: row of the first corner of each piece; piece p ends where p + 1 begins.
        radius: of each piece, m.
        p: first piece, from which normals point.
        q: second piece.
        max_separation: points of a contact have a smaller separation, m.
        out: (2, 6).
    """
    a, a_end, b, b_end = first[p], first[p + 1], first[q], first[q + 1]
    if a_end - a == 1:
        return collide_disc(corner, a, radius[p], b, b_end, radius[q], 1.0, max_separation, out)
    if b_end - b == 1:
        return collide_disc(corner, b, radius[q], a, a_end, radius[p], -1.0, max_separation, out)
    return collide_faces(corner, a, a_end, radius[p], b, b_end, radius[q], max_separation, out)


@kernel
def collide_disc(
    corner: FloatArray,
    c: int,
    disc_radius: float,
    start: int,
    end: int,
    piece_radius: float,
    sign: float,
    max_separation: float,
    out: FloatArray,
) -> int:
    """Write the contact of a disc about corner c with a piece; `sign` is −1 if normals point to the disc."""
    x, y = corner[c, 0], corner[c, 1]
    px, py = corner[start, 0], corner[start, 1]
    if end - start == 1:
        separation, nx, ny = circle_circle(x, y, disc_radius, px, py, piece_radius)
    elif end - start == 2:
        qx, qy = corner[start + 1, 0], corner[start + 1, 1]
        separation, nx, ny = circle_segment(x, y, disc_radius, px, py, qx, qy, piece_radius)
    else:
        separation, nx, ny = disc_polygon(corner, c, disc_radius, start, end, piece_radius, max_separation)
    if separation >= max_separation:
        return 0
    middle = disc_radius + 0.5 * separation
    write_point(out, 0, sign * nx, sign * ny, separation, x + nx * middle, y + ny * middle, 0.0)
    return 1


@kernel
def disc_polygon(
    corner: FloatArray, c: int, disc_radius: float, start: int, end: int, piece_radius: float, max_separation: float
) -> tuple[float, float, float]:
    """Return separation and normal from a disc to a polygon, by the Voronoi region that contains the centre.

    For a centre inside the polygon, the nearest face determines them. A separation of `max_separation` or more is a
    lower bound.
    """
    x, y, radii = corner[c, 0], corner[c, 1], disc_radius + piece_radius
    gap, k, _ = widest_gap(corner, start, end, c, c + 1, max_separation + radii)
    if gap == -math.inf:  # degenerate: the polygon is a disc
        return circle_circle(x, y, disc_radius, corner[start, 0], corner[start, 1], piece_radius)
    one, two = whole_face(corner, start, end, k, next_corner(start, end, k))
    tx, ty = corner[two, 0] - corner[one, 0], corner[two, 1] - corner[one, 1]
    length = math.sqrt(tx * tx + ty * ty)
    tx, ty = tx / length, ty / length
    if 0.0 < gap < max_separation + radii:
        near = one
        position = (x - corner[one, 0]) * tx + (y - corner[one, 1]) * ty
        if position > 0.0:
            near = two
            position = length - position
        if position < 0.0:
            separation, nx, ny = circle_circle(x, y, disc_radius, corner[near, 0], corner[near, 1], piece_radius)
            return separation, nx, ny
    return gap - radii, -ty, tx


@kernel
def collide_faces(
    corner: FloatArray,
    a: int,
    a_end: int,
    a_radius: float,
    b: int,
    b_end: int,
    b_radius: float,
    max_separation: float,
    out: FloatArray,
) -> int:
    """Write the contact of two pieces of two corners or more: separating axes, then clipping of faces."""
    radii = a_radius + b_radius
    a_gap, a_face, b_corner = widest_gap(corner, a, a_end, b, b_end, max_separation + radii)
    if a_gap >= max_separation + radii:
        return 0
    b_gap, b_face, a_corner = widest_gap(corner, b, b_end, a, a_end, max_separation + radii)
    if b_gap >= max_separation + radii:
        return 0
    gap = max(a_gap, b_gap)
    if gap == -math.inf:  # both are degenerate: two discs
        return collide_disc(corner, a, a_radius, b, b + 1, b_radius, 1.0, max_separation, out)

    # The reference face, which defines the normal, and the incident face opposite to it
    swapped, one, two, incident, other = select_faces(
        corner, a, a_end, a_gap, a_face, a_corner, b, b_end, b_gap, b_face, b_corner
    )
    sign = -1.0 if swapped else 1.0
    own_radius, other_radius = (b_radius, a_radius) if swapped else (a_radius, b_radius)
    nx, ny = corner[two, 1] - corner[one, 1], corner[one, 0] - corner[two, 0]
    length = math.sqrt(nx * nx + ny * ny)
    nx, ny = nx / length, ny / length
    across = math.sqrt((corner[other, 0] - corner[incident, 0]) ** 2 + (corner[other, 1] - corner[incident, 1]) ** 2)
    slack = SLACK * min(length, across) + DEGENERATE * (abs(corner[one, 0]) + abs(corner[one, 1]))
    over, begin_x, begin_y, begin, end_x, end_y, end = clip(corner, one, two, incident, other, slack)

    # Without overlap the closest points may be corners; so may those of two collinear segments, which no face
    # separates.
    if gap > 0.0 or (not over and a_end - a == 2 and b_end - b == 2):
        distance, x, y, its_x, its_y = closest_points(corner, one, two, incident, other)
        # The closest points lie along the normal of the face of the larger gap, which need not be the reference face.
        dx, dy = nx, ny
        if swapped != (b_gap > a_gap):
            dx = (corner[incident, 1] - corner[other, 1]) / across
            dy = (corner[other, 0] - corner[incident, 0]) / across
        if not over or abs((its_x - x) * dy - (its_y - y) * dx) > slack:
            if distance - radii >= max_separation:
                return 0
            nx, ny = sign * (its_x - x) / distance, sign * (its_y - y) / distance
            middle = 0.5 * sign * (distance + own_radius - other_radius)
            write_point(out, 0, nx, ny, distance - radii, x + nx * middle, y + ny * middle, 0.0)
            return 1
    if not over:  # slivers, by rounding
        deepest = a_corner if swapped else b_corner
        incident, other, begin_x, begin_y, begin = deepest, deepest, corner[deepest, 0], corner[deepest, 1], gap

    count = 0
    for row in range(1 if incident == other else 2):
        x, y, height = (begin_x, begin_y, begin) if (row == 0) != swapped else (end_x, end_y, end)
        if height - radii < max_separation:
            middle = 0.5 * (height + other_radius - own_radius)
            write_point(out, count, sign * nx, sign * ny, height - radii, x - nx * middle, y - ny * middle, float(row))
            count += 1
    return count


@kernel
def select_faces(
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
    """Return whether the second piece has the reference face, the ends of that face, and those of the incident face."""
    a_one, a_two = whole_face(corner, a, a_end, a_face, next_corner(a, a_end, a_face))
    if b_gap > a_gap:
        b_one, b_two = whole_face(corner, b, b_end, b_face, next_corner(b, b_end, b_face))
        dx, dy = corner[b_two, 0] - corner[b_one, 0], corner[b_two, 1] - corner[b_one, 1]
        incident, other = face_at(corner, a, a_end, a_corner, -dy, dx)
        ex, ey = corner[a_two, 0] - corner[a_one, 0], corner[a_two, 1] - corner[a_one, 1]
        own_radius, other_radius = math.sqrt(dx * dx + dy * dy), math.sqrt(ex * ex + ey * ey)
        if b_gap > a_gap + REFERENCE_FACE_BIAS * min(own_radius, other_radius):
            return True, b_one, b_two, incident, other
        # Without overlap the normal must remain the direction between the closest points: only parallel faces opposite
        # each other swap roles.
        if b_gap > 0.0:
            if incident != a_one or other != a_two or abs(dx * ey - dy * ex) > PARALLEL * own_radius * other_radius:
                return True, b_one, b_two, incident, other
            return False, a_one, a_two, b_one, b_two
    dx, dy = corner[a_two, 0] - corner[a_one, 0], corner[a_two, 1] - corner[a_one, 1]
    incident, other = face_at(corner, b, b_end, b_corner, -dy, dx)
    return False, a_one, a_two, incident, other


@kernel
def collide_half_plane(
    corner: FloatArray,
    first: IntArray,
    radius: FloatArray,
    p: int,
    px: float,
    py: float,
    nx: float,
    ny: float,
    max_separation: float,
    out: FloatArray,
) -> int:
    """Write the contact of piece p with a half-plane, at the piece's lowest face; return its number of points.

    The half-plane is solid behind its unit normal at (px, py). Contact normals point into it.
    """
    start, end, radii = first[p], first[p + 1], radius[p]
    low, lowest = math.inf, start
    for k in range(start, end):
        height = (corner[k, 0] - px) * nx + (corner[k, 1] - py) * ny
        if height < low:
            low, lowest = height, k
    if low - radii >= max_separation:
        return 0
    one, two = face_at(corner, start, end, lowest, -nx, -ny)
    # In the order along the contact normal turned left
    if (corner[one, 0] - corner[two, 0]) * ny > (corner[one, 1] - corner[two, 1]) * nx:
        one, two = two, one
    count = 0
    for row in range(1 if one == two else 2):
        k = one if row == 0 else two
        separation = (corner[k, 0] - px) * nx + (corner[k, 1] - py) * ny - radii
        if separation < max_separation:
            middle = radii + 0.5 * separation
            x, y = corner[k, 0] - nx * middle, corner[k, 1] - ny * middle
            write_point(out, count, -nx, -ny, separation, x, y, float(row))
            count += 1
    return count
