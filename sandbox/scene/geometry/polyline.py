"""Polylines: fillets, offsets, lengths and parts.

A corner is rounded by the arc that is tangent to both its edges, so a rectangle whose two upper corners are rounded by
half its width has a semicircular arch.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from sandbox.scene.description.base import Point, Vector

NEAREST = 1e-7
"""m: points closer together than this are one point."""

Corner = tuple[float, ...]
"""x and y, m, and optionally the radius of the fillet, m"""


class RoundingError(ValueError):
    """A corner cannot be rounded; `corner` is its index."""

    def __init__(self, corner: int, message: str) -> None:
        super().__init__(message)
        self.corner = corner


class Arc(NamedTuple):
    """Arc that rounds a corner."""

    centre: Point
    radius: float
    """m"""
    begin: float
    """direction from the centre to the start of the arc, rad"""
    turn: float
    """angle of the arc, rad, positive to the left"""

    @property
    def tangent_length(self) -> float:
        """Distance from the corner to the tangent points on the edges, m."""
        return self.radius * math.tan(0.5 * abs(self.turn))

    def at(self, fraction: float) -> Point:
        """Return the point at a fraction of the arc."""
        angle = self.begin + fraction * self.turn
        return self.centre[0] + self.radius * math.cos(angle), self.centre[1] + self.radius * math.sin(angle)


def rounded(corners: Sequence[Corner], closed: bool = False, tolerance: float = 2e-5) -> tuple[Point, ...]:
    """Return a polyline with rounded corners; its vertices lie on the exact line.

    Args:
        corners: in order; the ends of an open line are not rounded.
        closed: whether the last corner is joined to the first.
        tolerance: largest distance of a chord from its arc, m.

    Raises:
        RoundingError: an edge is too short for the arcs at its ends, a corner is a reversal, or all corners coincide.
    """
    arcs = [arc_at(corners, k, closed) for k in range(len(corners))]
    _fit(corners, arcs, closed)
    points: list[Point] = []
    for corner, arc in zip(corners, arcs, strict=True):
        for point in [(corner[0], corner[1])] if arc is None else flattened(arc, tolerance):
            if not points or math.dist(point, points[-1]) > NEAREST:
                points.append(point)
    if closed and math.dist(points[0], points[-1]) <= NEAREST:
        points.pop()
    if len(points) < (3 if closed else 2):
        raise RoundingError(len(corners) - 1, "is at the same place as the next corner, so no line is left")
    return tuple(points)


def arc_at(corners: Sequence[Corner], k: int, closed: bool = False) -> Arc | None:
    """Return the arc that rounds a corner, or None for a sharp corner.

    Raises:
        RoundingError: the line reverses its direction there.
    """
    radius = corners[k][2] if len(corners[k]) > 2 else 0.0
    if radius == 0.0 or (not closed and k in (0, len(corners) - 1)):
        return None
    before, corner, after = (corners[n % len(corners)] for n in (k - 1, k, k + 1))
    incoming, outgoing = _direction(before, corner, k), _direction(corner, after, k)
    turn = math.atan2(
        incoming[0] * outgoing[1] - incoming[1] * outgoing[0], incoming[0] * outgoing[0] + incoming[1] * outgoing[1]
    )
    if abs(turn) < 1e-9:
        return None
    if abs(turn) > math.pi - 1e-6:
        raise RoundingError(k, "is a reversal, which cannot be rounded; remove its radius")
    side = math.copysign(1.0, turn)
    length = radius * math.tan(0.5 * abs(turn))
    centre = (
        corner[0] - incoming[0] * length - incoming[1] * side * radius,
        corner[1] - incoming[1] * length + incoming[0] * side * radius,
    )
    return Arc(centre, radius, math.atan2(-incoming[0] * side, incoming[1] * side), turn)


def flattened(arc: Arc, tolerance: float) -> Iterator[Point]:
    """Yield points of an arc, ends included, with no chord farther than a tolerance, m, from it.

    The middle of a chord over the angle δ is r (1 − cos δ/2) inside the arc.
    """
    widest = 2.0 * math.acos(max(1.0 - tolerance / arc.radius, 0.0))
    pieces = max(math.ceil(abs(arc.turn) / widest), 1)
    return (arc.at(k / pieces) for k in range(pieces + 1))


def beside(points: Sequence[Point], distance: float) -> tuple[Point, ...]:
    """Return the polyline at a distance, m, to the left of another; a negative distance is to the right.

    Limits: corners are mitred, and a distance beyond the radius of a bend makes loops.
    """
    directions = [_direction(a, b, k) for k, (a, b) in enumerate(pairwise(points))]
    moved: list[Point] = []
    for k, (x, y) in enumerate(points):
        (ax, ay), (bx, by) = directions[max(k - 1, 0)], directions[min(k, len(directions) - 1)]
        nx, ny = -(ay + by), ax + bx
        scale = 2.0 * distance / max(nx * nx + ny * ny, 1e-3)
        moved.append((x + nx * scale, y + ny * scale))
    return tuple(moved)


def length_of(points: Sequence[Point]) -> float:
    """Return the length of a polyline, m."""
    return math.fsum(math.dist(a, b) for a, b in pairwise(points))


def part_of(points: Sequence[Point], begin: float, end: float) -> tuple[Point, ...]:
    """Return the part of a polyline between two arc lengths, m."""
    cut: list[Point] = []
    passed = 0.0
    for a, b in pairwise(points):
        size = math.dist(a, b)
        low, high = max(begin - passed, 0.0), min(end - passed, size)
        if high - low > 0.0:
            ends = [(a[0] + (b[0] - a[0]) * s / size, a[1] + (b[1] - a[1]) * s / size) for s in (low, high)]
            cut += ends if not cut else ends[1:]
        passed += size
    return tuple(cut)


def _fit(corners: Sequence[Corner], arcs: Sequence[Arc | None], closed: bool) -> None:
    """Refuse arcs that need more length of an edge than it has."""
    for k in range(len(corners) if closed else len(corners) - 1):
        n = (k + 1) % len(corners)
        available = math.dist(corners[k][:2], corners[n][:2])
        required = sum(arc.tangent_length for arc in (arcs[k], arcs[n]) if arc is not None)
        if required > available + NEAREST:
            which = k if arcs[k] is not None else n
            message = (
                f"has too large a radius: its arcs take {required:.4g} m of an edge that is {available:.4g} m long"
            )
            raise RoundingError(which, message)


def _direction(a: Corner, b: Corner, k: int) -> Vector:
    size = math.dist(a[:2], b[:2])
    if size < NEAREST:
        raise RoundingError(k, "is at the same place as the next corner")
    return (b[0] - a[0]) / size, (b[1] - a[1]) / size
