"""Areas, centroids and second moments of discs, capsules and polygons, in closed form.

With a density in kg/m², `density * area` is a mass in kg and `density * second` a moment of inertia in kg·m².
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from sandbox.scene.part import Point


class Moments(NamedTuple):
    """What a plane figure weighs, at 1 kg/m²."""

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
    """Return the moments of all that is nearer than `radius` to the segment from `a` to `b`.

    A rectangle of length L and height 2r, and a disc cut in halves. A half disc's centroid is 4r/3π from its
    diameter; moving both halves from the middle to the ends adds πr²(L/2)² + 2·πr²·(L/2)·(4r/3π)
    to the disc's own πr⁴/2 (parallel axes, twice).

    Args:
        a: one end of the segment, m.
        b: the other, m; where it is `a`, the capsule is a disc.
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
    """Return the moments of a simple polygon: those of the triangles that its edges form with its first corner.

    Counted from that corner, and at last about the centroid, so that an outline far from the origin keeps its digits.

    Args:
        points: (n, 2) corners, counter-clockwise, m; three or more.

    Raises:
        ValueError: the corners enclose no area, or run clockwise.
    """
    ox, oy = points[0]
    spokes = [(x - ox, y - oy) for x, y in points[1:]]
    fan = [(b, c, b[0] * c[1] - b[1] * c[0]) for b, c in pairwise(spokes)]
    double = math.fsum(cross for _, _, cross in fan)
    if not double > 0.0:
        raise ValueError("an outline must enclose an area, counter-clockwise")
    x, y = (math.fsum((b[k] + c[k]) * cross for b, c, cross in fan) / (3.0 * double) for k in (0, 1))
    # A triangle's second moment about a point is area/6 times the squares of its corners and their products in pairs.
    apex = (-x, -y)
    terms = []
    for b, c, cross in fan:
        p, q = (b[0] - x, b[1] - y), (c[0] - x, c[1] - y)
        squares = _dot(apex, apex) + _dot(p, p) + _dot(q, q)
        terms.append(cross / 12.0 * (squares + _dot(apex, p) + _dot(p, q) + _dot(q, apex)))
    return Moments(0.5 * double, (ox + x, oy + y), math.fsum(terms))


def _dot(p: Point, q: Point) -> float:
    return p[0] * q[0] + p[1] * q[1]
