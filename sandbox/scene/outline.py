"""Outlines of polygons: which way round they run, whether they are convex, and what is wrong with one.

What decides is the sign of the doubled area of a triangle. It is computed in floating point where that is
certain, and in fractions where it is not; so an outline is called self-crossing if and only if it is.
"""

import math
from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

from sandbox.scene.part import Point

NEAREST = 1e-9
"""Neighbouring corners must be farther apart than this, in m and as a share of the outline's extent."""

THINNEST = 1e-12
"""Least area, as a share of the extent squared."""

STRAIGHT = 1e-12
"""How far a corner may lie inside the line of its neighbours and still be on it, as a share of the extent."""

TINIEST = 1e-300
"""m²; smaller products have lost digits, or have become zero"""

_EPSILON = 2.0**-53


class OutlineError(ValueError):
    """An outline that no body can have."""


def signed_area(points: Sequence[Point]) -> float:
    """Return the area in m², negative where the outline runs clockwise; counted from the first corner."""
    ox, oy = points[0]
    spokes = [(x - ox, y - oy) for x, y in points[1:]]
    return 0.5 * math.fsum(b[0] * c[1] - b[1] * c[0] for b, c in pairwise(spokes))


def anticlockwise(points: Sequence[Point]) -> tuple[Point, ...]:
    """Return the outline counter-clockwise, from the same first corner."""
    if signed_area(points) < 0.0:
        return (points[0], *reversed(points[1:]))
    return tuple(points)


def extent_of(points: Sequence[Point]) -> float:
    """Return the longer side of the outline's bounding box, m."""
    xs, ys = [x for x, _ in points], [y for _, y in points]
    return max(max(xs) - min(xs), max(ys) - min(ys))


def turn(a: Point, b: Point, c: Point) -> float:
    """Return about twice the signed area of a triangle, m²; its sign is exact, and positive where a, b, c turn left.

    The bound on the rounding error is that of J. R. Shewchuk, Adaptive Precision Floating-Point Arithmetic and Fast
    Robust Geometric Predicates (1997), section 4.3.
    """
    left, right = (a[0] - c[0]) * (b[1] - c[1]), (a[1] - c[1]) * (b[0] - c[0])
    value = left - right
    if abs(value) > (3.0 + 16.0 * _EPSILON) * _EPSILON * (abs(left) + abs(right)) + TINIEST:
        return value
    ax, ay, bx, by, cx, cy = map(Fraction, (*a, *b, *c))
    exact = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
    if abs(exact) < TINIEST:
        return TINIEST if exact > 0 else -TINIEST if exact < 0 else 0.0
    return float(exact)


def rounding_of(points: Sequence[Point]) -> float:
    """Return how far rounding its coordinates can move a corner of the outline, and a neighbour, m."""
    return 4.0 * _EPSILON * max(max(abs(x), abs(y)) for x, y in points)


def slack_of(points: Sequence[Point]) -> float:
    """Return how far inside the line of its neighbours a corner still counts as being on it, m.

    Whoever turns a straight edge with a corner on it, or draws it far from the origin, leaves no more than this.
    """
    return STRAIGHT * extent_of(points) + rounding_of(points)


def turns_right(a: Point, b: Point, c: Point, slack: float) -> bool:
    """Tell whether the way from a over b to c turns right by more than what `slack`, m, forgives."""
    return turn(a, b, c) < -slack * math.dist(a, c)


def is_convex(points: Sequence[Point], slack: float | None = None) -> bool:
    """Tell whether a counter-clockwise simple outline turns right nowhere.

    Args:
        points: (n, 2) m.
        slack: what `turns_right` forgives, m; without, the outline's own.
    """
    forgiven = slack_of(points) if slack is None else slack
    before, after = (*points[-1:], *points[:-1]), (*points[1:], *points[:1])
    return not any(turns_right(a, b, c, forgiven) for a, b, c in zip(before, points, after, strict=True))


def closest_of(points: Sequence[Point]) -> float:
    """Return how far apart neighbouring corners of an outline must be, m."""
    return max(NEAREST, NEAREST * extent_of(points))


def fault_of(points: Sequence[Point]) -> tuple[int | None, str] | None:
    """Return the first thing wrong with an outline as it was drawn, either way round; None where nothing is.

    Returns:
        The index of the corner at fault, where there is one, and what is wrong and would be right.
    """
    extent, least, n = extent_of(points), closest_of(points), len(points)
    for j in range(n):
        i, away = (j - 1) % n, math.dist(points[j - 1], points[j])
        if away < least:
            return j, (
                f"points[{i}] and points[{j}] are {away:g} m apart; leave one of them out, "
                f"or put them at least {least:g} m apart"
            )
    for i in range(n):
        if _folds(points[i - 1], points[i], points[(i + 1) % n]):
            return i, f"the outline turns straight back at points[{i}]; leave it out, or give the spike a width"
    if (pair := _crossing(points)) is not None:
        first, second = (f"points[{k}] to points[{(k + 1) % n}]" for k in pair)
        return pair[1], (
            f"the edge from {second} meets the edge from {first}; an outline may not cross or touch itself: "
            "order its points as on a walk around it"
        )
    area = abs(signed_area(points))
    if area < THINNEST * extent * extent:
        return None, (f"the outline encloses {area:g} m², nothing against its extent of {extent:g} m; give it a width")
    return None


def _crossing(points: Sequence[Point]) -> tuple[int, int] | None:
    """Return the first two edges, from left to right, that meet and are no neighbours; O(n²) where all overlap in x."""
    n = len(points)
    extent = extent_of(points)
    alive: list[tuple[int, float, float, float, float, float, float]] = []
    for j in sorted(range(n), key=lambda i: min(points[i][0], points[(i + 1) % n][0])):
        (cx, cy), (dx, dy) = points[j], points[(j + 1) % n]
        left = min(cx, dx)
        alive = [edge for edge in alive if edge[1] >= left]
        for i, _, ax, ay, along, up, doubt in alive:
            # Most edges lie on one side of each other, and far from it; exact signs are for the rest.
            one, two = along * (cy - ay) - up * (cx - ax), along * (dy - ay) - up * (dx - ax)
            if (one > doubt and two > doubt) or (one < -doubt and two < -doubt):
                continue
            if _meet(points, min(i, j), max(i, j)):
                return min(i, j), max(i, j)
        along, up = dx - cx, dy - cy
        doubt = 16.0 * _EPSILON * (abs(along) + abs(up)) * extent + TINIEST  # four roundings, each of 1 part in 2^53
        alive.append((j, max(cx, dx), cx, cy, along, up, doubt))
    return None


def _meet(points: Sequence[Point], i: int, j: int) -> bool:
    """Tell whether edges i < j, that are no neighbours, meet; neighbours meet by right."""
    n = len(points)
    a, b, c, d = points[i], points[(i + 1) % n], points[j], points[(j + 1) % n]
    if j == i + 1 or (j + 1) % n == i:
        return False
    abc, abd = turn(a, b, c), turn(a, b, d)
    if min(abc, abd) > 0.0 or max(abc, abd) < 0.0:
        return False
    if abc == abd == 0.0:
        return all(max(min(a[k], b[k]), min(c[k], d[k])) <= min(max(a[k], b[k]), max(c[k], d[k])) for k in (0, 1))
    cda, cdb = turn(c, d, a), turn(c, d, b)
    return min(cda, cdb) <= 0.0 <= max(cda, cdb)


def _folds(a: Point, b: Point, c: Point) -> bool:
    """Tell whether the way from a to b turns straight back at b."""
    return turn(a, b, c) == 0.0 and (a[0] - b[0]) * (c[0] - b[0]) + (a[1] - b[1]) * (c[1] - b[1]) > 0.0
