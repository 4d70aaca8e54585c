"""Placement of a ball in hand: allowed places, and the nearest of them to a point."""

import math
from collections.abc import Sequence

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.games.billiards.rules.base import PlacementRegion
from sandbox.games.billiards.table_geometry import PLACEMENT_GAP, PlacedDisc, TableGeometry
from sandbox.scene.description.base import Point

POSITION_TOLERANCE = 1e-9
"""m by which a place may exceed a bound: tolerance for rounding errors"""

CIRCLE_POINTS = 72
"""number of candidate places around each ball"""


GRID_SIZE = 16
"""columns and rows of candidate places over the allowed area"""


def placement_refusal(
    layout: TableGeometry, place: PlacementRegion, at: Point, radius: float, others: Sequence[PlacedDisc]
) -> str | None:
    """Return why a ball in hand may not be placed at a point; None if it may.

    Args:
        layout: geometry of the table.
        place: area that the rules allow.
        at: centre of the ball, m.
        radius: radius of the ball, m.
        others: other balls on the table.
    """
    point = np.array([at])
    if not np.all(np.isfinite(point)) or layout.room(point)[0] < radius - POSITION_TOLERANCE:
        return "the ball would be outside the cushions"
    if not _within(layout, place, point)[0]:
        return f"the ball must be placed {place}"
    if _gap(point, radius, others)[0] < -POSITION_TOLERANCE:
        return "another ball is there"
    return None


def allowed(
    layout: TableGeometry, place: PlacementRegion, points: FloatArray, radius: float, others: Sequence[PlacedDisc]
) -> BoolArray:
    """Return whether a ball may be placed at (M, 2) points, m, as (M,) booleans."""
    free = (layout.room(points) >= radius - POSITION_TOLERANCE) & (_gap(points, radius, others) >= -POSITION_TOLERANCE)
    return np.asarray(free & _within(layout, place, points))


def nearest(
    layout: TableGeometry, place: PlacementRegion, at: Point, radius: float, others: Sequence[PlacedDisc]
) -> Point | None:
    """Return the allowed place nearest to a point, to about 1 mm beside curves; None if there is no room.

    Takes the same arguments as `placement_refusal`.
    """
    if placement_refusal(layout, place, at, radius, others) is None:
        return at
    target = np.array([at])
    candidates = [
        _clamped(layout, place, target, radius),
        np.array(spread(layout, place, radius, others)).reshape(-1, 2),
    ]
    discs = np.array(others, dtype=float).reshape(-1, 3)
    for x, y, r in discs.tolist():
        bearing, centre_distance = math.atan2(at[1] - y, at[0] - x), radius + r + PLACEMENT_GAP
        angles = bearing + np.linspace(-math.pi, math.pi, CIRCLE_POINTS + 1)  # includes the nearest point of the circle
        ring = np.array([x, y]) + centre_distance * np.column_stack((np.cos(angles), np.sin(angles)))
        candidates += [ring, _clamped(layout, place, ring, radius)]
    candidates.append(_touching_two(discs, radius))
    points = np.concatenate(candidates)
    points = points[allowed(layout, place, points, radius, others)]
    if not len(points):
        return None
    best = points[np.argmin(np.hypot(*(points - target).T))]
    return float(best[0]), float(best[1])


def spread(layout: TableGeometry, place: PlacementRegion, radius: float, others: Sequence[PlacedDisc]) -> list[Point]:
    """Return allowed places of a ball in hand, m, spread over the allowed area."""
    points = layout.places.get((place, radius))
    if points is None:
        points = _grid_points(layout, place, radius)
        points = points[allowed(layout, place, points, radius, ())]
        layout.places[place, radius] = points
    free = points[_gap(points, radius, others) >= -POSITION_TOLERANCE]
    return [(x, y) for x, y in free.tolist()]


def _within(layout: TableGeometry, place: PlacementRegion, points: FloatArray) -> BoolArray:
    """Return whether (M, 2) points are in the area that the rules allow, as (M,) booleans."""
    if place == "anywhere":
        return np.ones(len(points), dtype=bool)
    home, along = np.array(layout.home), np.array(layout.along)
    is_behind = (points - home) @ along <= POSITION_TOLERANCE
    if place == "in the D" and layout.d_radius:
        is_behind &= np.hypot(*(points - home).T) <= layout.d_radius + POSITION_TOLERANCE
    return np.asarray(is_behind)


def _clamped(layout: TableGeometry, place: PlacementRegion, points: FloatArray, radius: float) -> FloatArray:
    """Return (M, 2) points clamped to the playing area and to the area that the rules allow."""
    (x0, y0), (x1, y1) = layout.area
    inside = np.clip(points, (x0 + radius, y0 + radius), (x1 - radius, y1 - radius))
    if place == "anywhere":
        return inside
    home, along = np.array(layout.home), np.array(layout.along)
    inside = inside - np.maximum((inside - home) @ along, 0.0)[:, None] * along
    if place == "in the D" and layout.d_radius:
        offset = inside - home
        distance = np.hypot(*offset.T)[:, None]
        inside = home + offset * np.minimum(1.0, layout.d_radius / np.maximum(distance, 1e-300))
    return np.asarray(inside)


def _grid_points(layout: TableGeometry, place: PlacementRegion, radius: float) -> FloatArray:
    """Return a grid of points over the area that the rules allow, (M, 2) m."""
    (x0, y0), (x1, y1) = layout.area
    if place == "in the D" and layout.d_radius:
        (x, y), reach = layout.home, layout.d_radius + radius
        x0, y0, x1, y1 = max(x0, x - reach), max(y0, y - reach), min(x1, x + reach), min(y1, y + reach)
    columns, rows = np.linspace(x0 + radius, x1 - radius, GRID_SIZE), np.linspace(y0 + radius, y1 - radius, GRID_SIZE)
    grid = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    return _clamped(layout, place, grid, radius)


def _gap(points: FloatArray, radius: float, others: Sequence[PlacedDisc]) -> FloatArray:
    """Return the gap between a ball at (M, 2) points and the nearest other ball, (M,) m; negative for overlap."""
    gap = np.full(len(points), np.inf)
    for x, y, r in others:
        gap = np.minimum(gap, np.hypot(points[:, 0] - x, points[:, 1] - y) - radius - r)
    return gap


def _touching_two(others: FloatArray, radius: float) -> FloatArray:
    """Return the centres of a ball that touches two others, with a gap of `PLACEMENT_GAP`, (M, 2) m."""
    candidates = []
    for i, (ax, ay, ar) in enumerate(others.tolist()):
        for bx, by, br in others[i + 1 :].tolist():
            a, b, d = ar + radius + PLACEMENT_GAP, br + radius + PLACEMENT_GAP, math.hypot(bx - ax, by - ay)
            if not 0.0 < d < a + b:
                continue
            forward = 0.5 * (a * a - b * b + d * d) / d
            sideways = math.sqrt(max(a * a - forward * forward, 0.0))
            ux, uy = (bx - ax) / d, (by - ay) / d
            candidates += [
                (ax + ux * forward - s * uy * sideways, ay + uy * forward + s * ux * sideways) for s in (1.0, -1.0)
            ]
    return np.array(candidates).reshape(-1, 2)
