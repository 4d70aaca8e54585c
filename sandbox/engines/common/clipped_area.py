"""Area and moments of the part of a convex piece inside a convex polygon, exact also for round corners.

The outline of a piece, the hull of its corners widened by a radius, is a ring of edges: straight ones and arcs about
the corners. Each side of the polygon cuts it along a line, as by Sutherland & Hodgman (1974), where a line cuts an arc
at up to two angles; a chord closes the ring. Moments are sums over the edges, by Green's theorem.
"""

import math

from sandbox.arrays import FloatArray
from sandbox.engines.common.kernel import bare_kernel

EDGE_SIZE = 9
"""Columns of an edge: start (x, y) and end (x, y), centre (x, y), radius, which is 0 for a straight edge, and the
angles of start and end, rad"""

RELATIVE_GAP = 1e-13
"""Distance between two edges, relative to the size of the piece, that is rounding: it gets no chord."""


def edge_capacity(corners: int, sides: int) -> int:
    """Return a sufficient number of rows for the outlines of pieces of up to some corners in polygons of some sides.

    A line cuts a convex outline twice, which adds up to two edges and a chord.
    """
    return 2 * corners + 4 * sides + 8


@bare_kernel
def add_straight(edges: FloatArray, count: int, ax: float, ay: float, bx: float, by: float) -> int:
    """Write a straight edge after `count` edges and return the new number."""
    row = edges[count]
    row[0], row[1], row[2], row[3], row[6] = ax, ay, bx, by, 0.0
    return count + 1


@bare_kernel
def add_arc(edges: FloatArray, count: int, x: float, y: float, radius: float, begin: float, end: float) -> int:
    """Write an arc about a centre from one angle to a larger one after `count` edges and return the new number."""
    row = edges[count]
    row[0], row[1] = x + radius * math.cos(begin), y + radius * math.sin(begin)
    row[2], row[3] = x + radius * math.cos(end), y + radius * math.sin(end)
    row[4], row[5], row[6], row[7], row[8] = x, y, radius, begin, end
    return count + 1


@bare_kernel
def write_outline(
    corner: FloatArray, first: int, end: int, radius: float, cos: float, sin: float, edges: FloatArray
) -> int:
    """Write the outline of a piece, turned about the centre of its body, and return the number of edges.

    Args:
        corner: (V, 2) m, of all pieces, counter-clockwise, in the frame of the body.
        first: row of the first corner of the piece.
        end: row after its last.
        radius: m.
        cos: of the angle of the body.
        sin: likewise.
        edges: (E, 9), written.
    """
    count, corners = 0, end - first
    if corners == 1:
        x, y = corner[first, 0], corner[first, 1]
        return add_arc(edges, 0, cos * x - sin * y, sin * x + cos * y, radius, 0.0, 2.0 * math.pi)
    ax, ay = corner[end - 1, 0], corner[end - 1, 1]
    ax, ay = cos * ax - sin * ay, sin * ax + cos * ay
    bx, by = corner[first, 0], corner[first, 1]
    bx, by = cos * bx - sin * by, sin * bx + cos * by
    before = math.atan2(ax - bx, by - ay)  # direction of the outward normal of the edge that ends at b
    for k in range(corners):
        row = first + (k + 1) % corners
        cx, cy = corner[row, 0], corner[row, 1]
        cx, cy = cos * cx - sin * cy, sin * cx + cos * cy
        if radius == 0.0:
            count = add_straight(edges, count, bx, by, cx, cy)
        else:
            after = math.atan2(bx - cx, cy - by)
            turn = after - before
            if turn < -0.5 * math.pi:
                turn += 2.0 * math.pi
            elif turn > 1.5 * math.pi:
                turn -= 2.0 * math.pi
            count = add_arc(edges, count, bx, by, radius, before, before + max(turn, 0.0))
            nx, ny = radius * math.cos(after), radius * math.sin(after)
            count = add_straight(edges, count, bx + nx, by + ny, cx + nx, cy + ny)
            before = after
        bx, by = cx, cy
    return count


@bare_kernel
def close_gap(edges: FloatArray, count: int, x: float, y: float, gap: float) -> int:
    """Write a chord from the last edge to a point if it is farther than a gap, m, and return the number of edges."""
    if count == 0:
        return 0
    ax, ay = edges[count - 1, 2], edges[count - 1, 3]
    if (x - ax) * (x - ax) + (y - ay) * (y - ay) <= gap * gap:
        return count
    return add_straight(edges, count, ax, ay, x, y)


@bare_kernel
def clip(edges: FloatArray, count: int, nx: float, ny: float, depth: float, gap: float, out: FloatArray) -> int:
    """Write the part of a convex outline where n·p ≤ depth, and return its number of edges.

    Args:
        edges: (E, 9) outline.
        count: its number of edges.
        nx: unit normal of the line, outwards.
        ny: likewise.
        depth: m.
        gap: m, see `close_gap`.
        out: (E, 9), written.
    """
    made = 0
    towards = math.atan2(ny, nx)
    for k in range(count):
        ax, ay, bx, by, radius = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3], edges[k, 6]
        if radius == 0.0:
            a, b = nx * ax + ny * ay - depth, nx * bx + ny * by - depth
            if a > 0.0 and b > 0.0:
                continue
            if a > 0.0:
                ax, ay = ax + a / (a - b) * (bx - ax), ay + a / (a - b) * (by - ay)
            elif b > 0.0:
                bx, by = ax + a / (a - b) * (bx - ax), ay + a / (a - b) * (by - ay)
            made = close_gap(out, made, ax, ay, gap)
            made = add_straight(out, made, ax, ay, bx, by)
            continue
        x, y, begin, end = edges[k, 4], edges[k, 5], edges[k, 7], edges[k, 8]
        height = (depth - nx * x - ny * y) / radius
        if height <= -1.0:
            continue
        if height >= 1.0:
            made = close_gap(out, made, ax, ay, gap)
            made = add_arc(out, made, x, y, radius, begin, end)
            continue
        half = math.acos(height)  # of the range of angles about `towards` that is outside
        turns = math.floor((begin - towards + math.pi) / (2.0 * math.pi))
        middle = towards + 2.0 * math.pi * turns  # so that begin is within π of it
        for part in range(3):
            low = begin if part == 0 else middle + 2.0 * math.pi * (part - 1) + half
            high = middle + 2.0 * math.pi * part - half
            low, high = max(low, begin), min(high, end)
            if high > low:
                made = close_gap(out, made, x + radius * math.cos(low), y + radius * math.sin(low), gap)
                made = add_arc(out, made, x, y, radius, low, high)
    if made:
        made = close_gap(out, made, out[0, 0], out[0, 1], gap)
    return made


@bare_kernel
def straight_moments(ax: float, ay: float, bx: float, by: float) -> tuple[float, float, float, float]:
    """Return area, first moments and polar second moment of the triangle of the origin and an edge, with its sign."""
    cross = ax * by - ay * bx
    second = ax * ax + ax * bx + bx * bx + ay * ay + ay * by + by * by
    return 0.5 * cross, cross * (ax + bx) / 6.0, cross * (ay + by) / 6.0, cross * second / 12.0


@bare_kernel
def moments(edges: FloatArray, count: int) -> tuple[float, float, float, float]:
    """Return the area, m², its first moments (x, y), m³, and its polar second moment, m⁴, about the origin.

    The sector of an arc and the edges from its start over the centre to its end replace the arc.
    """
    area, mx, my, second = 0.0, 0.0, 0.0, 0.0
    for k in range(count):
        ax, ay, bx, by, radius = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3], edges[k, 6]
        if radius == 0.0:
            a, sx, sy, j = straight_moments(ax, ay, bx, by)
        else:
            x, y, begin, end = edges[k, 4], edges[k, 5], edges[k, 7], edges[k, 8]
            half, middle = 0.5 * (end - begin), 0.5 * (begin + end)
            sector, arm = radius * radius * half, 2.0 / 3.0 * radius * radius * radius * math.sin(half)
            px, py = arm * math.cos(middle), arm * math.sin(middle)  # first moments about the centre
            about_centre = 0.5 * radius * radius * sector
            a1, sx1, sy1, j1 = straight_moments(ax, ay, x, y)
            a2, sx2, sy2, j2 = straight_moments(x, y, bx, by)
            a = sector + a1 + a2
            sx, sy = sector * x + px + sx1 + sx2, sector * y + py + sy1 + sy2
            j = about_centre + 2.0 * (x * px + y * py) + sector * (x * x + y * y) + j1 + j2
        area, mx, my, second = area + a, mx + sx, my + sy, second + j
    return area, mx, my, second
