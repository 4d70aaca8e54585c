"""Hulls: convex pieces of bodies where they are now; how far places and one another are from them."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.trajectory import Frame

Distance = Callable[[FloatArray, FloatArray], FloatArray]
"""Takes x and y, that broadcast, and returns the signed distance there, negative inside."""


class Hull(NamedTuple):
    """The hull of some corners, widened by a radius; in metres or in pixels, whichever way round."""

    corners: FloatArray
    """(n, 2); one is a disc, two are a capsule"""
    radius: float


def hulls_of(bodies: Bodies, frame: Frame, number: int) -> list[Hull]:
    """Return the pieces of a body where they are, m."""
    shapes = bodies.shapes
    first, last = np.searchsorted(shapes.body, (number, number + 1)).tolist()
    angle = float(frame.angle[number])
    cos, sin = math.cos(angle), math.sin(angle)
    turn, place = np.asarray(((cos, sin), (-sin, cos))), frame.position[number]
    found = []
    for piece in range(first, last):
        corners = shapes.corner[int(shapes.first[piece]) : int(shapes.first[piece + 1])]
        found.append(Hull(place + corners @ turn, float(shapes.radius[piece])))
    return found


def hull_distance(hull: Hull) -> Distance:
    """Return the distance from one hull, exact inside and outside."""
    corners, radius = hull
    if len(corners) == 1:
        x, y = corners[0].tolist()
        return lambda px, py: np.asarray(np.hypot(px - x, py - y) - radius)
    sides = list(zip(corners.tolist(), np.roll(corners, -1, axis=0).tolist(), strict=True))
    if len(corners) == 2:
        away = segment_distance(sides[0])
        return lambda px, py: away(px, py) - radius
    turned = 1.0 if _area(corners) >= 0.0 else -1.0
    lines = []
    for (ax, ay), (bx, by) in sides:
        length = max(math.hypot(bx - ax, by - ay), 1e-300) * turned
        x, y = (by - ay) / length, (ax - bx) / length
        lines.append((x, y, -(ax * x + ay * y)))
    rims = [segment_distance(side) for side in sides]

    def distance(px: FloatArray, py: FloatArray) -> FloatArray:
        most = np.asarray(np.maximum.reduce([px * x + (py * y + offset) for x, y, offset in lines]))
        beyond = most > 0.0
        if beyond.any():  # near corners its sides' lines are nearer than the hull itself
            x, y = (np.broadcast_to(each, most.shape)[beyond] for each in (px, py))
            most[beyond] = np.minimum.reduce([rim(x, y) for rim in rims])
        return np.asarray(most - radius)

    return distance


def segment_distance(ends: Sequence[Sequence[float]]) -> Distance:
    """Return the distance from a segment, never negative."""
    (ax, ay), (bx, by) = ends
    dx, dy = bx - ax, by - ay
    squared = max(dx * dx + dy * dy, 1e-300)

    def distance(px: FloatArray, py: FloatArray) -> FloatArray:
        x, y = px - ax, py - ay
        share = np.clip(x * (dx / squared) + y * (dy / squared), 0.0, 1.0)
        return np.asarray(np.sqrt((x - share * dx) ** 2 + (y - share * dy) ** 2))

    return distance


def rounded(hull: Hull, steps: int = 6) -> FloatArray:
    """Return the corners of a polygon that is about a hull, (K, 2): around each corner so many and one more."""
    corners, radius = hull
    if radius == 0.0:
        return corners
    if len(corners) == 1:
        spots = np.linspace(0.0, 2.0 * math.pi, 4 * steps, endpoint=False)
        return np.asarray(corners + radius * np.column_stack((np.cos(spots), np.sin(spots))))
    way = np.roll(corners, -1, axis=0) - corners
    sign = 1.0 if _area(corners) >= 0.0 else -1.0
    out = np.arctan2(-way[:, 0] * sign, way[:, 1] * sign)  # of each side's outward normal
    before = np.roll(out, 1)
    turn = np.mod((out - before) * sign, 2.0 * math.pi) * sign
    spots = before[:, None] + turn[:, None] * np.linspace(0.0, 1.0, steps + 1)
    return np.asarray((corners[:, None] + radius * np.stack((np.cos(spots), np.sin(spots)), axis=-1)).reshape(-1, 2))


def area_of(hull: Hull) -> float:
    """Return the area of a hull."""
    corners, radius = hull
    around = float(np.hypot(*(np.roll(corners, -1, axis=0) - corners).T).sum())  # of a segment, there and back
    return abs(_area(corners)) / 2.0 + around * radius + math.pi * radius**2


def _area(corners: FloatArray) -> float:
    x, y = (corners - corners[0]).T
    return float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def nearest(hulls: list[Hull], x: float, y: float) -> float:
    """Return the signed distance of a place from the nearest of some hulls."""
    place = np.asarray(x), np.asarray(y)
    return min((float(hull_distance(hull)(*place)) for hull in hulls), default=math.inf)


def meeting(a: Hull, b: Hull, tolerance: float = 0.0) -> tuple[float, FloatArray]:
    """Return how far two hulls are apart, negative where they overlap, and where they are nearest, (2,).

    Args:
        a: one.
        b: the other.
        tolerance: places that are farther by no more count as nearest as well; theirs is the mean of all.
    """
    gaps, places = [], []
    for one, other in ((a, b), (b, a)):
        foot = _foot(one.corners, other.corners)
        away = one.corners - foot
        length = np.hypot(away[:, 0], away[:, 1])[:, None]
        # Between the two surfaces, in the middle of what is left, or of what overlaps.
        share = 0.5 * (length + other.radius - one.radius)
        places.append(foot + away / np.maximum(length, 1e-300) * share)
        gaps.append(length[:, 0])
    gap, place = np.concatenate(gaps), np.concatenate(places)
    kept = gap <= float(gap.min()) + tolerance
    apart = _separation(a.corners, b.corners)
    least = apart if -math.inf < apart <= 0.0 else float(gap.min())
    return least - a.radius - b.radius, np.asarray(place[kept].mean(axis=0))


def _sides(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return where sides begin and how they go, (n, 2) each; of one corner, a side of no length."""
    if len(corners) < 3:
        return corners[:1], corners[-1:] - corners[:1]
    return corners, np.roll(corners, -1, axis=0) - corners


def _foot(places: FloatArray, corners: FloatArray) -> FloatArray:
    """Return the point on the sides of a hull that is nearest to each of some places, (K, 2)."""
    start, along = _sides(corners)
    way = places[:, None] - start[None]
    share = np.clip((way * along).sum(-1) / np.maximum((along**2).sum(-1), 1e-300), 0.0, 1.0)
    foot = start + share[..., None] * along
    best = np.argmin(((places[:, None] - foot) ** 2).sum(-1), axis=1)
    return np.asarray(foot[np.arange(len(places)), best])


def _separation(a: FloatArray, b: FloatArray) -> float:
    """Return how far two hulls without radius are apart along the side that parts them best; negative: they overlap.

    The separating axis theorem. Of places alone, which have no sides, it knows nothing: −inf.
    """
    best = -math.inf
    for one, other in ((a, b), (b, a)):
        start, along = _sides(one)
        length = np.hypot(along[:, 0], along[:, 1])
        normal = (np.column_stack((along[:, 1], -along[:, 0])) / np.maximum(length, 1e-300)[:, None])[length > 0.0]
        if not len(normal):
            continue
        if len(one) == 2:
            normal, start = np.vstack((normal, -normal)), np.vstack((start, start))
        elif _area(one) < 0.0:
            normal = -normal
        best = max(best, float(((other[None] - start[:, None]) * normal[:, None]).sum(-1).min(axis=1).max()))
    return best
