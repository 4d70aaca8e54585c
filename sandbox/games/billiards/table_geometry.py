"""Geometry of a billiard table as games use it: spots, cushions, pockets, distances."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Self

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point, Vector
from sandbox.scene.geometry.vectors import offset_from_segment

MAX_TOUCH_GAP = 1e-6
"""m: gap up to which balls touch, for the rules; far above the rounding errors of engines"""

PLACEMENT_GAP = 1e-5
"""m: gap between balls that the referee places, above `MAX_TOUCH_GAP`, so that they do not touch"""

PlacedDisc = tuple[float, float, float]
"""x, y and radius, m"""


@dataclass(frozen=True, eq=False)
class TableGeometry:
    """Geometry of a scene with a `[surface]`."""

    scene: Scene
    places: dict[tuple[str, float], FloatArray] = field(default_factory=dict, repr=False)
    """cache: (M, 2) m, allowed places of a ball, by the name of the area and the radius"""

    @classmethod
    def of(cls, scene: Scene) -> Self:
        """Return the geometry of a scene without its shots, which the players make in a game."""
        return cls(scene.model_copy(update={"shots": ()}))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the bodies, by index."""
        return self.scene.bodies.names

    @cached_property
    def number(self) -> dict[str, int]:
        """Index of each body."""
        return {name: k for k, name in enumerate(self.names)}

    @cached_property
    def start(self) -> tuple[Point, ...]:
        """Initial positions of the bodies, m."""
        return tuple((x, y) for x, y in self.scene.bodies.position.tolist())

    @cached_property
    def radius(self) -> tuple[float, ...]:
        """Radii of the bodies, m."""
        return tuple(self.scene.bodies.radius.tolist())

    @cached_property
    def pockets(self) -> dict[str, PlacedDisc]:
        """The pockets by name."""
        names = self.scene.fixed_names[len(self.scene.fixed) :]
        return {name: (*each.position, each.radius) for name, each in zip(names, self.scene.pockets, strict=False)}

    @cached_property
    def spots(self) -> dict[str, Point]:
        """The spots by name, m."""
        return {spot.name: spot.position for spot in self.scene.play.spots}

    @cached_property
    def area(self) -> tuple[Point, Point]:
        """Lower left and upper right corner of the playing area, m; default: the bounding box of walls and planes."""
        if self.scene.play.area is not None:
            return self.scene.play.area
        points = [point for wall in self.scene.walls for point in wall.points]
        points += [plane.point for plane in self.scene.planes]
        points = points or list(self.start) or [(0.0, 0.0)]
        xs, ys = [x for x, _ in points], [y for _, y in points]
        return (min(xs), min(ys)), (max(xs), max(ys))

    @cached_property
    def along(self) -> Vector:
        """Unit vector from the head of the table to its foot; +y without spots."""
        for head, foot in (("head", "foot"), ("brown", "blue")):
            if head in self.spots and foot in self.spots and self.spots[head] != self.spots[foot]:
                (ax, ay), (bx, by) = self.spots[head], self.spots[foot]
                size = math.hypot(bx - ax, by - ay)
                return (bx - ax) / size, (by - ay) / size
        return 0.0, 1.0

    @cached_property
    def home(self) -> Point:
        """Head spot, in snooker the brown spot, m; default: the centre of the playing area."""
        (x0, y0), (x1, y1) = self.area
        middle = (0.5 * (x0 + x1), 0.5 * (y0 + y1))
        return self.spots.get("head", self.spots.get("brown", middle))

    @cached_property
    def d_radius(self) -> float:
        """Radius of the D, m: distance from the brown to the yellow spot; 0 without these spots."""
        if "brown" not in self.spots or "yellow" not in self.spots:
            return 0.0
        return math.dist(self.spots["brown"], self.spots["yellow"])

    def before_head(self, point: Point) -> float:
        """Return the distance of a point from the head string (baulk line) towards the foot, m; negative behind it."""
        x, y = self.home
        return (point[0] - x) * self.along[0] + (point[1] - y) * self.along[1]

    def discs(self, numbers: Iterable[int], position: tuple[Point, ...]) -> list[PlacedDisc]:
        """Return the bodies with some indices as discs."""
        return [(*position[k], self.radius[k]) for k in numbers]

    def pocket_at(self, point: Point) -> str | None:
        """Return the name of the pocket that contains a point; None if none does."""
        for name, (x, y, radius) in self.pockets.items():
            if math.hypot(point[0] - x, point[1] - y) < radius:
                return name
        return None

    def room(self, points: FloatArray) -> FloatArray:
        """Return the distance of (M, 2) points from the nearest fixed object, (M,) m; negative outside the area."""
        (x0, y0), (x1, y1) = self.area
        x, y = points[:, 0], points[:, 1]
        clearance = np.minimum(np.minimum(x - x0, x1 - x), np.minimum(y - y0, y1 - y))
        for distance in (self.from_planes(points), self.from_segments(points)):
            if distance.shape[1]:
                clearance = np.minimum(clearance, distance.min(axis=1))
        for px, py, radius in (*self.pockets.values(), *((*post.position, post.radius) for post in self.scene.posts)):
            clearance = np.minimum(clearance, np.hypot(x - px, y - py) - radius)
        return clearance

    @cached_property
    def segments(self) -> tuple[FloatArray, FloatArray, list[int]]:
        """Segments of the walls, (K, 4) m, their half thicknesses, (K,) m, and their fixed objects, −1 − k."""
        rows, owner = [], []
        for k, wall in enumerate(self.scene.walls, len(self.scene.planes)):
            points = (*wall.points, wall.points[0]) if wall.closed else wall.points
            rows += [(*a, *b, 0.5 * wall.thickness) for a, b in pairwise(points)]
            owner += [-1 - k] * (len(points) - 1)
        table = np.array(rows, dtype=float).reshape(-1, 5)
        return table[:, :4], table[:, 4], owner

    def from_segments(self, points: FloatArray) -> FloatArray:
        """Return the distance of (M, 2) points from the faces of the wall segments, (M, K) m."""
        ends, half, _ = self.segments
        a, segment = ends[:, :2], ends[:, 2:] - ends[:, :2]
        offset = offset_from_segment(points[:, None], a, segment)
        return np.asarray(np.hypot(offset[..., 0], offset[..., 1]) - half)

    def from_planes(self, points: FloatArray) -> FloatArray:
        """Return the distance of (M, 2) points from each plane, (M, K) m."""
        planes = [(*plane.point, *plane.normal) for plane in self.scene.planes]
        table = np.array(planes, dtype=float).reshape(-1, 4)
        normal = table[:, 2:] / np.maximum(np.hypot(table[:, 2], table[:, 3]), 1e-300)[:, None]
        return np.asarray(np.einsum("mkc,kc->mk", points[:, None] - table[:, :2], normal))

    def against_fixed(self, position: tuple[Point, ...]) -> list[tuple[int, int]]:
        """Return the pairs of bodies and planes, walls or posts that touch; fixed objects are −1 − k."""
        points, radius = np.array(position).reshape(-1, 2), np.array(self.radius)[:, None]
        planes = [-1 - k for k in range(len(self.scene.planes))]
        found = _touching(self.from_planes(points) - radius, planes)
        found += _touching(self.from_segments(points) - radius, self.segments[2])
        begin = len(self.scene.planes) + len(self.scene.walls)
        for k, post in enumerate(self.scene.posts, begin):
            distance = np.hypot(*(points - post.position).T) - post.radius
            found += _touching(distance[:, None] - radius, [-1 - k])
        return found


def _touching(distance: FloatArray, owner: list[int]) -> list[tuple[int, int]]:
    """Return the pairs that touch, from (M, K) distances between bodies and fixed objects."""
    return [(i, owner[k]) for i, k in np.argwhere(distance <= MAX_TOUCH_GAP).tolist()]
