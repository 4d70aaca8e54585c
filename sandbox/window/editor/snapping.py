"""Snapping of points in the editor: to a grid that depends on the zoom, to centres and corners, and to surfaces."""

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.editing.elements import ElementKey, bodies_of, elements_of_table
from sandbox.window.editor.picking import start_frame
from sandbox.window.hit_test import hulls_of

MIN_GRID = 6.0
"""px at UI scale 1: smallest distance of grid points"""
REACH = 8.0
"""px at UI scale 1: distance within which a point snaps"""


@dataclass(frozen=True)
class SnappedPoint:
    """A point of the pointer, snapped."""

    point: Point
    """m"""
    to: str = ""
    """what it has snapped to: `grid`, `centre`, `corner`, `surface`, or nothing"""


def grid_step(scale: float, ui_scale: float = 1.0) -> float:
    """Return the grid step for a camera scale, px/m: 1, 2 or 5 times a power of ten, m."""
    smallest = MIN_GRID * ui_scale / scale
    power = 10.0 ** math.floor(math.log10(smallest))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0, 20.0) if factor * power >= smallest * (1.0 - 1e-9))


def rounded(value: float, step: float) -> float:
    """Return the nearest multiple of a step, with the digits that the step needs: 0.30000000000000004 is 0.3."""
    digits = max(0, 2 - math.floor(math.log10(step)))
    return round(round(value / step) * step, min(digits, 15)) + 0.0


def on_grid(point: Point, step: float) -> Point:
    """Return the nearest point of the grid, m."""
    return rounded(point[0], step), rounded(point[1], step)


def snap_point(
    scene: Scene, point: Point, scale: float, ui_scale: float = 1.0, without: Collection[ElementKey] = ()
) -> SnappedPoint:
    """Return a point snapped to the nearest centre, corner or end within reach, else to the grid.

    Args:
        scene: the scene.
        point: m.
        scale: of the camera, px/m.
        ui_scale: UI scale.
        without: elements that are being moved, to which nothing snaps.
    """
    reach = REACH * ui_scale / scale
    targets = _targets(scene, without)
    if len(targets[0]):
        distance = np.hypot(*(targets[0] - np.asarray(point)).T)
        nearest = int(np.argmin(distance))
        if distance[nearest] <= reach:
            x, y = targets[0][nearest].tolist()
            return SnappedPoint((x, y), targets[1][nearest])
    return SnappedPoint(on_grid(point, grid_step(scale, ui_scale)), "grid")


def _targets(scene: Scene, without: Collection[ElementKey]) -> tuple[FloatArray, list[str]]:
    """Return the points to which others snap, (K, 2) m, and what each is."""
    hidden = {body for key in without for body in bodies_of(scene, key)}
    points = [position for k, position in enumerate(scene.bodies.position.tolist()) if k not in hidden]
    kinds = ["centre"] * len(points)
    for table, attribute, kind in (("post", "position", "centre"), ("pocket", "position", "centre")):
        more = [
            list(getattr(element, attribute))
            for k, element in enumerate(elements_of_table(scene, table))
            if ElementKey(table, k) not in without
        ]
        points, kinds = points + more, kinds + [kind] * len(more)
    for k, wall in enumerate(scene.walls):
        if ElementKey("wall", k) not in without:
            points += [list(each) for each in wall.points]
            kinds += ["corner"] * len(wall.points)
    return np.asarray(points, np.float64).reshape(-1, 2), kinds


def surface_shift(scene: Scene, keys: Collection[ElementKey], scale: float, ui_scale: float = 1.0) -> Point | None:
    """Return the shift, m, that makes moved bodies touch the nearest plane within reach; None without one.

    Args:
        scene: the scene, with the bodies at their present places.
        keys: the elements that are moved.
        scale: of the camera, px/m.
        ui_scale: UI scale.
    """
    reach, frame = REACH * ui_scale / scale, start_frame(scene)
    bodies = [body for key in keys for body in bodies_of(scene, key)]
    nearest: tuple[float, Point] | None = None
    for k, plane in enumerate(scene.planes):
        if ElementKey("plane", k) in keys or not bodies:
            continue
        normal = np.asarray(plane.normal) / math.hypot(*plane.normal)
        gap = min(
            float(((hull.corners - np.asarray(plane.point)) @ normal).min()) - hull.radius
            for body in bodies
            for hull in hulls_of(scene.bodies, frame, body)
        )
        if abs(gap) <= reach and (nearest is None or abs(gap) < abs(nearest[0])):
            x, y = (-gap * normal).tolist()
            nearest = gap, (x, y)
    return None if nearest is None else nearest[1]
