"""Cuts concave outlines into convex parts, for engines that know no others.

Triangles, merged for as long as the result is convex: at most four times as many parts as the least that there are
(S. Hertel, K. Mehlhorn, Fast Triangulation of Simple Polygons, 1983). No corner is made up, so neighbouring parts meet
corner to corner. pymunk.autogeometry.convex_decomposition is not asked: it cuts along rays, and where one ends in a
corner, as on any grid, it may leave a part out, or recurse until the process dies; tests keep an outline of seven
corners that does it. Small stacks overflow from a few hundred corners on.
"""

import math
from collections.abc import Sequence
from itertools import pairwise

from sandbox.scene.ears import triangles
from sandbox.scene.outline import (
    OutlineError,
    closest_of,
    extent_of,
    is_convex,
    rounding_of,
    signed_area,
    slack_of,
    turns_right,
)
from sandbox.scene.part import Point

AREA_ERROR = 1e-9
"""How far the areas of the parts may be from adding up, as a share, beside what rounding the coordinates takes."""


def convex_parts(points: Sequence[Point]) -> tuple[tuple[Point, ...], ...]:
    """Cut an outline into convex parts that cover it and do not overlap.

    Args:
        points: (n, 2) corners of a simple outline, counter-clockwise, m: one in which `fault_of` finds no fault.

    Returns:
        The parts, counter-clockwise; a convex outline as it is. Of a concave one, corners on straight edges are left
        out before it is cut.

    Raises:
        OutlineError: it cannot be cut, as at a waist that is too narrow to have a width.
    """
    slack = slack_of(points)
    if is_convex(points, slack):
        return (tuple(points),)
    bent = _bent(points, slack)
    parts = [tuple(bent[i] for i in part) for part in _merged(bent, triangles(bent), slack)]
    # Between corners that would be on one line but for rounding, slivers are left that have no width.
    parts = [part for part in parts if signed_area(part) > slack * extent_of(part)]
    _check(points, parts, slack)
    return tuple(parts)


def _bent(points: Sequence[Point], slack: float) -> list[Point]:
    """Return the corners at which the outline turns."""
    kept: list[Point] = [points[0]]
    for i in range(1, len(points)):
        here, ahead = points[i], points[(i + 1) % len(points)]
        if turns_right(kept[-1], here, ahead, slack) or turns_right(ahead, here, kept[-1], slack):
            kept.append(here)
    if len(kept) > 3 and not (
        turns_right(kept[-1], kept[0], kept[1], slack) or turns_right(kept[1], kept[0], kept[-1], slack)
    ):
        del kept[0]
    return kept


def _merged(points: Sequence[Point], cut: list[tuple[int, int, int]], slack: float) -> list[list[int]]:
    """Merge parts across their longest borders first, wherever both ends of a border then turn nowhere right."""
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
    """Return the part, counted from a corner of it."""
    at = part.index(corner)
    return part[at:] + part[:at]


def _check(points: Sequence[Point], parts: Sequence[tuple[Point, ...]], slack: float) -> None:
    """Raise OutlineError unless the parts are what an engine can take, and as large together as the outline."""
    least = closest_of(points)
    for part in parts:
        if any(math.dist(a, b) < least for a, b in pairwise((*part, part[0]))) or not is_convex(part, slack):
            x, y = part[0]
            raise OutlineError(
                f"near ({x:g}, {y:g}) the outline is too narrow to be cut into convex parts; "
                f"make it wider than {least:g} m there, or split it by hand"
            )
    whole = signed_area(points)
    lost = abs(math.fsum(map(signed_area, parts)) - whole)
    if not parts or lost > AREA_ERROR * whole + len(points) * rounding_of(points) * extent_of(points):
        raise OutlineError("the outline is too thin to be cut into convex parts; make it wider, or split it by hand")
