"""Triangulation of simple outlines by ear clipping, and decomposition into convex parts.

An ear is a corner whose triangle with its neighbours contains no other corner. Every simple polygon of four or more
corners has two (G. H. Meisters, Polygons Have Ears, American Mathematical Monthly 82, 1975). The best-shaped ear is cut
first. All signs are exact.

Convex parts are triangles that are merged while the result is convex: at most four times the minimal number of parts
(S. Hertel, K. Mehlhorn, Fast Triangulation of Simple Polygons, 1983). No corners are added, so adjacent parts meet
corner to corner. pymunk.autogeometry.convex_decomposition is not used: it cuts along rays, and where a ray ends in a
corner, as on any grid, it can omit a part or recurse until the process crashes (the tests contain such an outline of
seven corners). With a small stack it overflows from a few hundred corners on.
"""

import math
from collections.abc import Sequence
from heapq import heapify, heappop, heappush
from itertools import pairwise

from sandbox.scene.description.base import Point
from sandbox.scene.geometry.polygon import (
    OutlineError,
    coordinate_rounding,
    extent_of,
    is_convex,
    min_corner_distance,
    orient2d,
    signed_area,
    straightness_tolerance,
    turns_right,
)


def triangles(points: Sequence[Point]) -> list[tuple[int, int, int]]:
    """Divide a counter-clockwise simple outline of n corners into n - 2 triangles; O(n · reflex corners).

    Args:
        points: (n, 2) m; corners on straight edges are allowed.

    Returns:
        (n - 2, 3) indices of corners, each triangle counter-clockwise.

    Raises:
        OutlineError: there is no ear, so the outline is not simple.
    """
    n = len(points)
    before, after = [(i - 1) % n for i in range(n)], [(i + 1) % n for i in range(n)]
    reflex = {i for i in range(n) if orient2d(points[i - 1], points[i], points[(i + 1) % n]) <= 0.0}
    heap = [(-_shape(points, i - 1, i, (i + 1) % n), i, (i - 1) % n, (i + 1) % n) for i in range(n)]
    heapify(heap)
    cut: list[tuple[int, int, int]] = []
    while heap and len(cut) < n - 3:
        _, i, a, b = heappop(heap)
        if before[i] != a or after[i] != b or i in reflex or _blocked(points, reflex, (a, i, b)):
            continue  # outdated, or no ear; it stays blocked until a neighbour is cut
        cut.append((a, i, b))
        after[a], before[b] = b, a
        before[i] = after[i] = -1
        for j in (a, b):
            corner = before[j], j, after[j]
            if j in reflex and orient2d(*(points[k] for k in corner)) > 0.0:
                reflex.remove(j)
            heappush(heap, (-_shape(points, *corner), j, corner[0], corner[2]))
    if len(cut) < n - 3:
        raise OutlineError("the outline cannot be triangulated; it must not cross or touch itself")
    last = next(i for i in range(n) if after[i] >= 0)
    return [*cut, (before[last], last, after[last])]


def _blocked(points: Sequence[Point], reflex: set[int], ear: tuple[int, int, int]) -> bool:
    """Return whether a reflex corner lies in or on the triangle; if any corner does, a reflex one does."""
    a, b, c = (points[i] for i in ear)
    left, right = min(a[0], b[0], c[0]), max(a[0], b[0], c[0])
    low, high = min(a[1], b[1], c[1]), max(a[1], b[1], c[1])
    for i in reflex:
        p = points[i]
        if not (left <= p[0] <= right and low <= p[1] <= high) or i in ear:  # cheap test first
            continue
        if orient2d(a, b, p) >= 0.0 and orient2d(b, c, p) >= 0.0 and orient2d(c, a, p) >= 0.0:
            return True
    return False


def _shape(points: Sequence[Point], i: int, j: int, k: int) -> float:
    """Return the quality of a triangle: its doubled area over the square of its longest side; 0 if degenerate."""
    a, b, c = points[i], points[j], points[k]
    return orient2d(a, b, c) / max(math.dist(a, b), math.dist(b, c), math.dist(c, a)) ** 2


AREA_ERROR = 1e-9
"""Largest relative error of the sum of the parts' areas, besides the rounding of coordinates."""


def convex_parts(points: Sequence[Point]) -> tuple[tuple[Point, ...], ...]:
    """Divide an outline into convex parts that cover it and do not overlap.

    Args:
        points: (n, 2) corners of a simple outline, counter-clockwise, m, for which `outline_fault` returns None.

    Returns:
        The parts, counter-clockwise; a convex outline unchanged. Of a concave outline, corners on straight edges are
        removed first.

    Raises:
        OutlineError: it cannot be divided, as at a waist of no width.
    """
    slack = straightness_tolerance(points)
    if is_convex(points, slack):
        return (tuple(points),)
    bent = _bent(points, slack)
    parts = [tuple(bent[i] for i in part) for part in _merged(bent, triangles(bent), slack)]
    # Corners that are collinear up to rounding leave slivers of no width.
    parts = [part for part in parts if signed_area(part) > slack * extent_of(part)]
    _check(points, parts, slack)
    return tuple(parts)


def _bent(points: Sequence[Point], slack: float) -> list[Point]:
    """Return the corners at which the outline changes its direction."""
    kept: list[Point] = [points[0]]
    for i in range(1, len(points)):
        corner, following = points[i], points[(i + 1) % len(points)]
        if turns_right(kept[-1], corner, following, slack) or turns_right(following, corner, kept[-1], slack):
            kept.append(corner)
    if len(kept) > 3 and not (
        turns_right(kept[-1], kept[0], kept[1], slack) or turns_right(kept[1], kept[0], kept[-1], slack)
    ):
        del kept[0]
    return kept


def _merged(points: Sequence[Point], cut: list[tuple[int, int, int]], slack: float) -> list[list[int]]:
    """Merge parts across their longest common edges first, if the result has no right turn at the ends of the edge."""
    parts: dict[int, list[int]] = {number: list(triangle) for number, triangle in enumerate(cut)}
    owner = {(a, b): number for number, part in parts.items() for a, b in _edges(part)}
    borders = [(i, j) for i, j in owner if i < j and (j, i) in owner]
    borders.sort(key=lambda border: -math.dist(points[border[0]], points[border[1]]))
    for i, j in borders:
        one, other = owner[i, j], owner[j, i]
        p, q = _from(parts[one], j), _from(parts[other], i)  # p runs from j to i, q from i to j
        at_j, at_i = (q[-2], j, p[1]), (p[-2], i, q[1])
        if any(turns_right(points[a], points[b], points[c], slack) for a, b, c in (at_j, at_i)):
            continue
        parts[one] = p + q[1:-1]
        for edge in _edges(parts.pop(other)):
            owner[edge] = one
    return list(parts.values())


def _edges(part: list[int]) -> list[tuple[int, int]]:
    return list(zip(part, part[1:] + part[:1], strict=True))


def _from(part: list[int], corner: int) -> list[int]:
    """Return the part, rotated to start at a given corner."""
    at = part.index(corner)
    return part[at:] + part[:at]


def _check(points: Sequence[Point], parts: Sequence[tuple[Point, ...]], slack: float) -> None:
    """Raise `OutlineError` unless the parts are valid for engines and their areas add up to that of the outline."""
    shortest = min_corner_distance(points)
    for part in parts:
        if any(math.dist(a, b) < shortest for a, b in pairwise((*part, part[0]))) or not is_convex(part, slack):
            x, y = part[0]
            raise OutlineError(
                f"near ({x:g}, {y:g}) the outline is too narrow to be cut into convex parts; "
                f"make it wider than {shortest:g} m there, or split it by hand"
            )
    area = signed_area(points)
    lost = abs(math.fsum(map(signed_area, parts)) - area)
    if not parts or lost > AREA_ERROR * area + len(points) * coordinate_rounding(points) * extent_of(points):
        raise OutlineError("the outline is too thin to be cut into convex parts; make it wider, or split it by hand")
