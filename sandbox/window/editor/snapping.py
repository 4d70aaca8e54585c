"""The pointer of the editor, which snaps to a grid that depends on the zoom, to centres, corners and surfaces."""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.editing.elements import ElementKey, bodies_of, element_at
from sandbox.scene.geometry.vectors import offset_from_segment
from sandbox.window.editor.picking import bounds_of, start_frame
from sandbox.window.hit_test import hulls_of

MIN_GRID = 6.0
"""px at UI scale 1: smallest distance of grid points"""
SNAP_DISTANCE = 8.0
"""px at UI scale 1: distance within which a point snaps"""
PICK_REACH = 6.0
"""px at UI scale 1 beside an element within which it is picked"""


class ViewScale(NamedTuple):
    """Scale and size of the view of the editor."""

    scale: float
    """px/m"""
    ui_scale: float
    size: float
    """m, shorter side of the visible area"""

    def metres(self, pixels: float) -> float:
        """Return a length of pixels at UI scale 1, m."""
        return pixels * self.ui_scale / self.scale

    @property
    def grid(self) -> float:
        """Step of the grid, m."""
        return grid_step(self.scale, self.ui_scale)


class Pointer(NamedTuple):
    """The pointer of the mouse."""

    point: Point
    """m"""
    view: ViewScale
    is_free: bool = False
    """whether Ctrl is held, so that it does not snap"""
    is_dragging: bool = False
    """whether the button is held and the pointer has been moved since the press"""

    @property
    def pick_reach(self) -> float:
        """Distance beside an element within which it is picked, m."""
        return self.view.metres(PICK_REACH)


@dataclass(frozen=True)
class SnappedPoint:
    """A point of the pointer, snapped."""

    point: Point
    """m"""
    to: Literal["grid", "centre", "corner"]
    """what it has snapped to"""


def grid_step(scale: float, ui_scale: float = 1.0) -> float:
    """Return the grid step for a camera scale, px/m: 1, 2 or 5 times a power of ten, m."""
    smallest = MIN_GRID * ui_scale / scale
    power = 10.0 ** math.floor(math.log10(smallest))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0, 20.0) if factor * power >= smallest * (1.0 - 1e-9))


def rounded(value: float, step: float) -> float:
    """Return the nearest multiple of a step, with the digits that the step needs: 0.30000000000000004 is 0.3."""
    digits = max(0, 2 - math.floor(math.log10(step)))
    return round(round(value / step) * step, min(digits, 15)) + 0.0


def snap_point(scene: Scene, point: Point, view: ViewScale, without: Collection[ElementKey] = ()) -> SnappedPoint:
    """Return a point snapped to the nearest centre, corner or end within reach, else to the grid.

    Args:
        scene: the scene.
        point: m.
        view: scale of the view.
        without: elements that are being moved, to which nothing snaps.
    """
    targets = _targets(scene, without)
    if len(targets[0]):
        distance = np.hypot(*(targets[0] - np.asarray(point)).T)
        nearest = int(np.argmin(distance))
        if distance[nearest] <= view.metres(SNAP_DISTANCE):
            x, y = targets[0][nearest].tolist()
            return SnappedPoint((x, y), targets[1][nearest])
    step = view.grid
    return SnappedPoint((rounded(point[0], step), rounded(point[1], step)), "grid")


def anchor_of(scene: Scene, key: ElementKey) -> Point | None:
    """Return the point of an element that lies on the grid when it is moved, m; None if it has no place."""
    element = element_at(scene, key)
    for name in ("position", "origin", "base", "start", "corner", "point", "lower"):
        value = getattr(element, name, None)
        if isinstance(value, tuple):
            return value[0], value[1]
    points = getattr(element, "points", None)
    if points:
        return points[0][0], points[0][1]
    box = bounds_of(scene, key)
    return None if box is None else box[0]


def _targets(scene: Scene, without: Collection[ElementKey]) -> tuple[FloatArray, list[Literal["centre", "corner"]]]:
    """Return the points to which others snap, (K, 2) m, and what each is."""
    hidden = {body for key in without for body in bodies_of(scene, key)}
    points = [position for k, position in enumerate(scene.bodies.position.tolist()) if k not in hidden]
    points += [list(post.position) for k, post in enumerate(scene.posts) if ElementKey("post", k) not in without]
    points += [list(each.position) for k, each in enumerate(scene.pockets) if ElementKey("pocket", k) not in without]
    kinds: list[Literal["centre", "corner"]] = ["centre"] * len(points)
    for k, wall in enumerate(scene.walls):
        if ElementKey("wall", k) not in without:
            points += [list(each) for each in wall.points]
            kinds += ["corner"] * len(wall.points)
    return np.asarray(points, np.float64).reshape(-1, 2), kinds


def surface_shift(scene: Scene, keys: Collection[ElementKey], view: ViewScale) -> Point | None:
    """Return the shift, m, that makes moved bodies touch the nearest surface within reach; None without one.

    All bodies snap to planes, balls also to walls, posts and other balls.

    Args:
        scene: the scene, with the bodies at their present places.
        keys: the elements that are moved.
        view: scale of the view.
    """
    reach = view.metres(SNAP_DISTANCE)
    moved = [body for key in keys for body in bodies_of(scene, key)]
    gaps = list(_plane_gaps(scene, keys, moved))
    if len(moved) == 1 and scene.bodies.round[moved[0]]:
        gaps += _ball_gaps(scene, keys, moved[0])
    near = [(abs(gap), (-gap * x, -gap * y)) for gap, (x, y) in gaps if abs(gap) <= reach]
    return min(near)[1] if near else None


def _plane_gaps(
    scene: Scene, keys: Collection[ElementKey], moved: Sequence[int]
) -> Iterator[tuple[float, tuple[float, float]]]:
    """Yield the gap of moved bodies to each plane, m, and its normal."""
    frame = start_frame(scene)
    for k, plane in enumerate(scene.planes):
        if ElementKey("plane", k) in keys or not moved:
            continue
        normal = np.asarray(plane.normal) / math.hypot(*plane.normal)
        gap = min(
            float(((hull.corners - np.asarray(plane.point)) @ normal).min()) - hull.radius
            for body in moved
            for hull in hulls_of(scene.bodies, frame, body)
        )
        x, y = normal.tolist()
        yield gap, (x, y)


def _ball_gaps(scene: Scene, keys: Collection[ElementKey], ball: int) -> Iterator[tuple[float, tuple[float, float]]]:
    """Yield the gap of a ball to each wall, post and other ball, m, and the direction from there to the ball."""
    bodies = scene.bodies
    centre, radius = bodies.position[ball], float(bodies.radius[ball])
    offsets: list[tuple[FloatArray, float]] = []
    for k, wall in enumerate(scene.walls):
        if ElementKey("wall", k) not in keys:
            points = np.asarray((*wall.points, wall.points[0]) if wall.closed else wall.points)
            sides = offset_from_segment(centre, points[:-1], np.diff(points, axis=0))
            offsets += [(offset, 0.5 * wall.thickness) for offset in sides]
    offsets += [
        (centre - np.asarray(post.position), post.radius)
        for k, post in enumerate(scene.posts)
        if ElementKey("post", k) not in keys
    ]
    others = np.flatnonzero(bodies.round & (np.hypot(*(bodies.position - centre).T) <= 2.0 * radius + bodies.radius))
    offsets += [(centre - bodies.position[k], float(bodies.radius[k])) for k in others.tolist() if k != ball]
    for offset, margin in offsets:
        distance = float(np.hypot(*offset))
        if distance > 0.0:
            x, y = (offset / distance).tolist()
            yield distance - radius - margin, (x, y)
