"""Precinct: the ground that a zone covers, as convex pieces; where its centre is, and what is inside."""

import math
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

from sandbox.scene.decompose import convex_parts
from sandbox.scene.model import Zone
from sandbox.scene.outline import anticlockwise
from sandbox.scene.part import Point


class Piece(NamedTuple):
    """A disc about one corner, a segment with round ends between two, or a convex polygon of more."""

    corners: tuple[Point, ...]
    """m, counter-clockwise"""
    radius: float
    """m; of a polygon 0"""


@lru_cache(maxsize=1024)
def pieces_of(zone: Zone) -> tuple[Piece, ...]:
    """Return the pieces of a zone that has a shape.

    Raises:
        OutlineError: its outline cannot be cut into convex pieces.
    """
    if zone.points is None:
        assert zone.position is not None and zone.radius is not None
        return (Piece((zone.position,), zone.radius),)
    if zone.thickness is not None:
        return tuple(Piece((a, b), 0.5 * zone.thickness) for a, b in pairwise(zone.points))
    return tuple(Piece(tuple(part), 0.0) for part in convex_parts(anticlockwise(zone.points)))


@lru_cache(maxsize=1024)
def middle_of(zone: Zone) -> Point:
    """Return the centre of a zone, m: of a polygon its centroid, of a strip the middle of its line."""
    if zone.points is None:
        assert zone.position is not None
        return zone.position
    if zone.thickness is not None:
        left = 0.5 * math.fsum(math.dist(a, b) for a, b in pairwise(zone.points))
        for a, b in pairwise(zone.points):
            way = math.dist(a, b)
            if left <= way:
                break
            left -= way
        share = min(left / way, 1.0)
        return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])
    corners = anticlockwise(zone.points)
    ox, oy = corners[0]
    spokes = [(x - ox, y - oy) for x, y in corners[1:]]
    crosses = [(a[0] * b[1] - a[1] * b[0], a, b) for a, b in pairwise(spokes)]
    area = 3.0 * math.fsum(cross for cross, _, _ in crosses)
    x = math.fsum(cross * (a[0] + b[0]) for cross, a, b in crosses) / area
    y = math.fsum(cross * (a[1] + b[1]) for cross, a, b in crosses) / area
    return ox + x, oy + y


def contains(zone: Zone, place: Point) -> bool:
    """Tell whether a place, m, is inside a zone."""
    return any(_holds(piece, place) for piece in pieces_of(zone))


def _holds(piece: Piece, place: Point) -> bool:
    corners = piece.corners
    if len(corners) > 2:
        sides = zip(corners, (*corners[1:], corners[0]), strict=True)
        return all((bx - ax) * (place[1] - ay) - (by - ay) * (place[0] - ax) >= 0.0 for (ax, ay), (bx, by) in sides)
    (ax, ay), (bx, by) = corners[0], corners[-1]
    x, y = bx - ax, by - ay
    length2 = x * x + y * y
    share = min(max(((place[0] - ax) * x + (place[1] - ay) * y) / length2, 0.0), 1.0) if length2 else 0.0
    return math.hypot(place[0] - ax - share * x, place[1] - ay - share * y) < piece.radius


def width_of(zone: Zone) -> float:
    """Return about how wide a zone is where it is narrowest, m: what goes farther in a substep can miss it."""
    return min(2.0 * piece.radius if len(piece.corners) < 3 else _width(piece.corners) for piece in pieces_of(zone))


def _width(corners: tuple[Point, ...]) -> float:
    """Return the least distance of two parallel lines that a convex polygon fits between, m."""
    width = math.inf
    for (ax, ay), (bx, by) in zip(corners, (*corners[1:], corners[0]), strict=True):
        length = math.hypot(bx - ax, by - ay)
        width = min(width, max((bx - ax) * (y - ay) - (by - ay) * (x - ax) for x, y in corners) / length)
    return width
