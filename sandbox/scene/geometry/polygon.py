"""Polygons: orientation, validity, area and moments.

Validity and convexity depend on the signs of triangle areas. These are computed in floating point with an error bound
and, where that is not conclusive, in rational numbers. So an outline is reported as self-intersecting if and only if it
is.

Areas, centroids and second moments of discs, capsules and polygons are in closed form. With a density in kg/m²,
`density * area` is a mass in kg and `density * second` a moment of inertia in kg·m².
"""

import math
from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise
from typing import NamedTuple

from sandbox.scene.description.base import Point

MIN_CORNER_DISTANCE = 1e-9
"""Smallest distance of neighbouring corners, in m, and as a fraction of the outline's extent."""

MIN_AREA = 1e-12
"""Smallest area, as a fraction of the extent squared."""

STRAIGHTNESS = 1e-12
"""Largest distance of a corner inside the line of its neighbours at which it still is on it, relative to the extent."""

MIN_PRODUCT = 1e-300
"""m²; smaller products have lost digits or underflowed to zero."""

_EPSILON = 2.0**-53


class OutlineError(ValueError):
    """An outline that is not valid for a body."""


def signed_area(points: Sequence[Point]) -> float:
    """Return the area in m², negative for a clockwise outline; computed relative to the first corner."""
    ox, oy = points[0]
    spokes = [(x - ox, y - oy) for x, y in points[1:]]
    return 0.5 * math.fsum(b[0] * c[1] - b[1] * c[0] for b, c in pairwise(spokes))


def anticlockwise(points: Sequence[Point]) -> tuple[Point, ...]:
    """Return the outline counter-clockwise, starting at the same corner."""
    if signed_area(points) < 0.0:
        return (points[0], *reversed(points[1:]))
    return tuple(points)


def extent_of(points: Sequence[Point]) -> float:
    """Return the longer side of the outline's bounding box, m."""
    xs, ys = [x for x, _ in points], [y for _, y in points]
    return max(max(xs) - min(xs), max(ys) - min(ys))


def orient2d(a: Point, b: Point, c: Point) -> float:
    """Return about twice the signed area of a triangle, m²: positive if a, b, c turn left. The sign is exact.

    The error bound is that of J. R. Shewchuk, Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric
    Predicates (1997), section 4.3.
    """
    left, right = (a[0] - c[0]) * (b[1] - c[1]), (a[1] - c[1]) * (b[0] - c[0])
    value = left - right
    if abs(value) > (3.0 + 16.0 * _EPSILON) * _EPSILON * (abs(left) + abs(right)) + MIN_PRODUCT:
        return value
    ax, ay, bx, by, cx, cy = map(Fraction, (*a, *b, *c))
    exact = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
    if abs(exact) < MIN_PRODUCT:
        return MIN_PRODUCT if exact > 0 else -MIN_PRODUCT if exact < 0 else 0.0
    return float(exact)


def coordinate_rounding(points: Sequence[Point]) -> float:
    """Return the largest relative displacement of a corner and its neighbour by rounding of the coordinates, m."""
    return 4.0 * _EPSILON * max(max(abs(x), abs(y)) for x, y in points)


def straightness_tolerance(points: Sequence[Point]) -> float:
    """Return the distance inside the line of its neighbours at which a corner still counts as on it, m.

    It exceeds the rounding error of rotating a straight edge with a corner on it, and of coordinates far from the
    origin.
    """
    return STRAIGHTNESS * extent_of(points) + coordinate_rounding(points)


def turns_right(a: Point, b: Point, c: Point, slack: float) -> bool:
    """Return whether the path from a over b to c turns right by more than `slack`, m."""
    return orient2d(a, b, c) < -slack * math.dist(a, c)


def is_convex(points: Sequence[Point], slack: float | None = None) -> bool:
    """Return whether a counter-clockwise simple outline has no right turn.

    Args:
        points: (n, 2) m.
        slack: tolerance of `turns_right`, m; default: `straightness_tolerance`.
    """
    tolerance = straightness_tolerance(points) if slack is None else slack
    before, after = (*points[-1:], *points[:-1]), (*points[1:], *points[:1])
    return not any(turns_right(a, b, c, tolerance) for a, b, c in zip(before, points, after, strict=True))


def min_corner_distance(points: Sequence[Point]) -> float:
    """Return the smallest valid distance of neighbouring corners of an outline, m."""
    return max(MIN_CORNER_DISTANCE, MIN_CORNER_DISTANCE * extent_of(points))


def outline_fault(points: Sequence[Point]) -> tuple[int | None, str] | None:
    """Return the first fault of an outline in either orientation, or None.

    Returns:
        The index of the corner, or None if the fault concerns the whole outline, and a message with a remedy.
    """
    extent, shortest, n = extent_of(points), min_corner_distance(points), len(points)
    for j in range(n):
        i, length = (j - 1) % n, math.dist(points[j - 1], points[j])
        if length < shortest:
            return j, (
                f"points[{i}] and points[{j}] are {length:g} m apart; remove one of them, "
                f"or place them at least {shortest:g} m apart"
            )
    for i in range(n):
        if _is_fold(points[i - 1], points[i], points[(i + 1) % n]):
            return i, f"the outline turns straight back at points[{i}]; remove that point, or give the spike a width"
    if (pair := _crossing(points)) is not None:
        first, second = (f"points[{k}] to points[{(k + 1) % n}]" for k in pair)
        return pair[1], (
            f"the edge from {second} meets the edge from {first}; an outline must not cross or touch itself: "
            "list its points in order around it"
        )
    area = abs(signed_area(points))
    if area < MIN_AREA * extent * extent:
        return None, (f"the outline encloses {area:g} m², too little for its extent of {extent:g} m; give it a width")
    return None


def _crossing(points: Sequence[Point]) -> tuple[int, int] | None:
    """Return the first two non-adjacent edges, in order of x, that intersect; O(n²) if all overlap in x."""
    n = len(points)
    extent = extent_of(points)
    active: list[tuple[int, float, float, float, float, float, float]] = []
    for j in sorted(range(n), key=lambda i: min(points[i][0], points[(i + 1) % n][0])):
        (cx, cy), (dx, dy) = points[j], points[(j + 1) % n]
        left = min(cx, dx)
        active = [edge for edge in active if edge[1] >= left]
        for i, _, ax, ay, along, up, error_bound in active:
            # Most edges lie clearly on one side of each other; only the rest needs exact signs.
            first_side, second_side = along * (cy - ay) - up * (cx - ax), along * (dy - ay) - up * (dx - ax)
            if (first_side > error_bound and second_side > error_bound) or (
                first_side < -error_bound and second_side < -error_bound
            ):
                continue
            if _edges_intersect(points, min(i, j), max(i, j)):
                return min(i, j), max(i, j)
        along, up = dx - cx, dy - cy
        error_bound = (
            16.0 * _EPSILON * (abs(along) + abs(up)) * extent + MIN_PRODUCT
        )  # four roundings, each of 1 part in 2^53
        active.append((j, max(cx, dx), cx, cy, along, up, error_bound))
    return None


def _edges_intersect(points: Sequence[Point], i: int, j: int) -> bool:
    """Return whether edges i < j intersect; adjacent edges do not count."""
    n = len(points)
    a, b, c, d = points[i], points[(i + 1) % n], points[j], points[(j + 1) % n]
    if j == i + 1 or (j + 1) % n == i:
        return False
    abc, abd = orient2d(a, b, c), orient2d(a, b, d)
    if min(abc, abd) > 0.0 or max(abc, abd) < 0.0:
        return False
    if abc == abd == 0.0:
        return all(max(min(a[k], b[k]), min(c[k], d[k])) <= min(max(a[k], b[k]), max(c[k], d[k])) for k in (0, 1))
    cda, cdb = orient2d(c, d, a), orient2d(c, d, b)
    return min(cda, cdb) <= 0.0 <= max(cda, cdb)


def _is_fold(a: Point, b: Point, c: Point) -> bool:
    """Return whether the path from a over b to c reverses its direction at b."""
    return orient2d(a, b, c) == 0.0 and (a[0] - b[0]) * (c[0] - b[0]) + (a[1] - b[1]) * (c[1] - b[1]) > 0.0


class Moments(NamedTuple):
    """Area, centroid and second moment of a plane figure."""

    area: float
    """m²"""
    centroid: Point
    """m"""
    second: float
    """polar second moment of area about the centroid, m⁴"""


def disc_moments(centre: Point, radius: float) -> Moments:
    """Return the moments of a disc: πr² and πr⁴/2."""
    area = math.pi * radius * radius
    return Moments(area, centre, 0.5 * area * radius * radius)


def capsule_moments(a: Point, b: Point, radius: float) -> Moments:
    """Return the moments of a capsule: all points within `radius` of the segment from `a` to `b`.

    It consists of a rectangle of length L and height 2r and of two half discs. The centroid of a half disc is 4r/3π
    from its diameter; moving both halves from the middle to the ends adds πr²(L/2)² + 2·πr²·(L/2)·(4r/3π) to the disc's
    own πr⁴/2 (parallel axis theorem, twice).

    Args:
        a: one end of the segment, m.
        b: the other, m; if it equals `a`, the capsule is a disc.
        radius: m.
    """
    length = math.dist(a, b)
    half = 0.5 * length
    square = radius * radius
    rectangle, disc = 2.0 * radius * length, math.pi * square
    second = rectangle * (length * length + 4.0 * square) / 12.0
    second += disc * (0.5 * square + half * half) + 8.0 / 3.0 * half * (square * radius)
    middle = (a[0] + 0.5 * (b[0] - a[0]), a[1] + 0.5 * (b[1] - a[1]))
    return Moments(rectangle + disc, middle, second)


def polygon_moments(points: Sequence[Point]) -> Moments:
    """Return the moments of a simple polygon, as the sum of the triangles of its edges and its first corner.

    Coordinates are relative to that corner, and finally to the centroid, which keeps precision far from the origin.

    Args:
        points: (n, 2) corners, counter-clockwise, m; three or more.

    Raises:
        ValueError: the corners enclose no area, or are clockwise.
    """
    ox, oy = points[0]
    spokes = [(x - ox, y - oy) for x, y in points[1:]]
    fan = [(b, c, b[0] * c[1] - b[1] * c[0]) for b, c in pairwise(spokes)]
    double = math.fsum(cross for _, _, cross in fan)
    if not double > 0.0:
        raise ValueError("an outline must enclose an area, counter-clockwise")
    x, y = (math.fsum((b[k] + c[k]) * cross for b, c, cross in fan) / (3.0 * double) for k in (0, 1))
    # Second moment of a triangle about a point: area/6 times the sum of squares and pairwise products of its corners.
    apex = (-x, -y)
    terms = []
    for b, c, cross in fan:
        p, q = (b[0] - x, b[1] - y), (c[0] - x, c[1] - y)
        squares = _dot(apex, apex) + _dot(p, p) + _dot(q, q)
        terms.append(cross / 12.0 * (squares + _dot(apex, p) + _dot(p, q) + _dot(q, apex)))
    return Moments(0.5 * double, (ox + x, oy + y), math.fsum(terms))


def rounded_polygon_moments(points: Sequence[Point], radius: float) -> Moments:
    """Return the moments of all points within a radius of a convex polygon.

    Its parts are the polygon, a rectangle along each edge, and a sector at each corner, whose angles add up to 2π. The
    centroid of a sector of angle θ is 4r sin(θ/2) / 3θ from the corner, its second moment about the corner θr⁴/4.

    Args:
        points: (n, 2) corners, counter-clockwise, m; three or more.
        radius: m; 0 for the polygon itself.

    Raises:
        ValueError: the corners enclose no area, or are clockwise.
    """
    parts = [polygon_moments(points)]
    if radius == 0.0:
        return parts[0]
    edges = list(zip(points, (*points[1:], points[0]), strict=True))
    normals = [math.atan2(a[0] - b[0], b[1] - a[1]) for a, b in edges]
    for (a, b), normal in zip(edges, normals, strict=True):
        length, cos, sin = math.dist(a, b), math.cos(normal), math.sin(normal)
        centre = 0.5 * (a[0] + b[0] + radius * cos), 0.5 * (a[1] + b[1] + radius * sin)
        area = length * radius
        parts.append(Moments(area, centre, area * (length * length + radius * radius) / 12.0))
    for k, corner in enumerate(points):
        turn = math.remainder(normals[k] - normals[k - 1], math.tau)
        if turn <= 0.0:  # a straight corner
            continue
        middle = normals[k] - 0.5 * turn
        distance, area = 4.0 * radius * math.sin(0.5 * turn) / (3.0 * turn), 0.5 * radius * radius * turn
        centre = corner[0] + distance * math.cos(middle), corner[1] + distance * math.sin(middle)
        parts.append(Moments(area, centre, 0.25 * turn * radius**4 - area * distance * distance))
    total = math.fsum(part.area for part in parts)
    x, y = (math.fsum(part.area * part.centroid[k] for part in parts) / total for k in (0, 1))
    second = math.fsum(part.second + part.area * math.dist(part.centroid, (x, y)) ** 2 for part in parts)
    return Moments(total, (x, y), second)


def _dot(p: Point, q: Point) -> float:
    return p[0] * q[0] + p[1] * q[1]
