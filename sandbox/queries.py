"""Spatial queries: ray casts, casts of discs and of convex shapes, and distances in one state of a scene.

    queries = SceneQueries(simulation.setup, simulation.frame())
    hits = queries.cast_rays(starts, ends)

They depend on the scene and on the state only, not on the engine that computed it, so that all engines agree bit for
bit. Objects are the bodies that are present, planes, walls that are solid, and posts. Bodies that collide with nothing
are not seen, nor are zones and sensors.

Every shape is a convex hull of corners, widened by a radius. Its boundary consists of arcs about the corners and of
edges moved outward by the radius, and a disc is cast as a ray against shapes that are wider by its radius. A ray enters
a hull where it first enters one of these, so all of them are tested for all rays at once. A convex shape is cast as a
ray of its origin against the Minkowski differences of the hulls and the shape.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.echo import short_repr
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.filters import filter_table
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.fixed import Post, Wall, mask_of
from sandbox.scene.geometry.hulls import convex_hull, minkowski_difference
from sandbox.scene.geometry.vectors import offset_from_segment, rotate
from sandbox.trajectory import Frame

NOTHING = 2**63 - 1
"""Index in the place of an object where a ray hits nothing; no scene has as many"""
CHUNK = 2_000_000
"""Rays × features that are tested at once"""


class RayHits(NamedTuple):
    """First hits of R rays."""

    fraction: FloatArray
    """(R,) part of the way from start to end, 0 to 1; inf where nothing is hit"""
    target: IntArray
    """(R,) index of the body, or −1 − k for the k-th static object, as in `Contacts`; `NOTHING` where nothing is hit"""
    point: FloatArray
    """(R, 2) m, centre of the cast disc, of a ray the point itself; nan where nothing is hit"""
    normal: FloatArray
    """(R, 2) unit normal out of the object; nan where nothing is hit"""


class RayHit(NamedTuple):
    """First hit of one ray."""

    name: str
    """name of the body or of the static object"""
    fraction: float
    """part of the way from start to end, 0 to 1"""
    point: tuple[float, float]
    """m, centre of the cast disc, of a ray the point itself"""
    normal: tuple[float, float]
    """unit normal out of the object"""


class NearestObject(NamedTuple):
    """Object nearest to a point."""

    name: str
    """name of the body or of the static object"""
    distance: float
    """m, from the point to its surface; negative inside it"""
    point: tuple[float, float]
    """m, the point of its surface that is nearest"""


class _Features(NamedTuple):
    """Discs, edges and half-planes of all objects that are seen, and the order in which they count."""

    centre: FloatArray
    """(D, 2) m, corners of the hulls"""
    radius: FloatArray
    """(D,) m, radius of the hull of each"""
    tail: FloatArray
    """(E, 2) m, start of each edge, before it is moved outward by the radius"""
    along: FloatArray
    """(E, 2) m, from the start to the end of each edge"""
    outward: FloatArray
    """(E, 2) unit normal of each edge"""
    width: FloatArray
    """(E,) m, radius of the hull of each"""
    area: IntArray
    """(A,) number of edges of each hull with three or more corners; these edges come first, hull by hull"""
    surface: FloatArray
    """(P, 2) m, a point of each half-plane"""
    normal: FloatArray
    """(P, 2) unit normal of each"""
    owner: IntArray
    """(D + E + P,) index of the object of each disc, edge and half-plane"""
    order: IntArray
    """(D + E + P,) these by their objects: bodies, then static objects"""


class SceneQueries:
    """Queries of one state of a scene: ray casts, casts of discs and distances, equal on all engines.

    Example:
        >>> queries = sandbox.SceneQueries(sandbox.load("bounce"))
        >>> queries.nearest((0.0, 0.3)).name
        'ground'
    """

    def __init__(
        self,
        start: Scene | Setup,
        frame: Frame | None = None,
        *,
        ignore: Iterable[str] = (),
        categories: Iterable[str] = (),
    ) -> None:
        """Prepare queries.

        Args:
            start: the scene, or the setup of a simulation.
            frame: the state; default: that of the setup.
            ignore: names of bodies and static objects that are not seen, such as the body that looks.
            categories: collision categories that are seen; default: all.

        Raises:
            ValueError: the scene has no such object or category.
        """
        self._setup = Setup.of(start)
        self._hulls, self._planes = _seen_shapes(self._setup, frame, frozenset(ignore), frozenset(categories))
        self._features = _features_of(self._hulls, self._planes, len(self._setup.bodies))

    def name_of(self, index: int) -> str:
        """Return the name of a body, or of the static object −1 − k.

        Args:
            index: as in `RayHits`.
        """
        if index >= 0:
            return self._setup.bodies.names[index]
        return self._setup.scene.fixed_names[-1 - index]

    def cast_ray(self, start: Sequence[float], end: Sequence[float], radius: float = 0.0) -> RayHit | None:
        """Return the first object on the way of a ray, or of a disc; None if nothing is hit.

        Args:
            start: (2,) m.
            end: (2,) m.
            radius: of a disc that moves from start to end, m; default: a ray.

        Raises:
            ValueError: a coordinate is not finite, or the radius is negative or not finite.
        """
        return self._first(self.cast_rays([start], [end], radius))

    def _first(self, hits: RayHits) -> RayHit | None:
        """Return the hit of the first ray."""
        if hits.target[0] == NOTHING:
            return None
        (x, y), (nx, ny) = hits.point[0].tolist(), hits.normal[0].tolist()
        return RayHit(self.name_of(int(hits.target[0])), float(hits.fraction[0]), (x, y), (nx, ny))

    def cast_rays(self, start: npt.ArrayLike, end: npt.ArrayLike, radius: float = 0.0) -> RayHits:
        """Return the first object on the way of each of R rays, or discs.

        An object is not hit by a ray that starts inside it. Of several at equal distance, it is the first body, or the
        first static object if none is a body. One-way walls are hit from both sides.

        Args:
            start: (R, 2) m.
            end: (R, 2) m, or one point for all.
            radius: of a disc that moves from start to end, m; default: rays.

        Raises:
            ValueError: a coordinate is not finite, the shapes do not fit, or the radius is negative or not finite.
        """
        origins = np.asarray(start, np.float64).reshape(-1, 2)
        ends = np.broadcast_to(np.asarray(end, np.float64), origins.shape)
        if not (np.isfinite(origins).all() and np.isfinite(ends).all()):
            raise ValueError("a ray has a coordinate that is not finite")
        if not 0.0 <= radius < math.inf:
            raise ValueError(f"radius: must be at least 0 and finite, is {radius:g}")
        count = len(origins)
        found = RayHits(
            np.full(count, np.inf), np.full(count, NOTHING), np.full((count, 2), np.nan), np.full((count, 2), np.nan)
        )
        rows = max(1, CHUNK // max(1, len(self._features.owner)))
        for first in range(0, count, rows):
            part = slice(first, first + rows)
            of_part = RayHits(found.fraction[part], found.target[part], found.point[part], found.normal[part])
            _cast(self._features, origins[part], ends[part] - origins[part], radius, of_part)
        return found

    def cast_shape(
        self,
        corners: npt.ArrayLike,
        start: Sequence[float],
        end: Sequence[float],
        *,
        angle: float = 0.0,
        radius: float = 0.0,
    ) -> RayHit | None:
        """Return the first object on the way of a convex shape that moves without turning; None if nothing is hit.

        An object that the shape overlaps at the start is not hit.

        Args:
            corners: (V, 2) m, about the point that moves from start to end. The shape is their convex hull: one corner
                and a radius are a disc, two a capsule.
            start: (2,) m.
            end: (2,) m.
            angle: of the shape, rad.
            radius: rounding of the shape, m.

        Returns:
            The hit, whose `point` is where the moving point is then.

        Raises:
            ValueError: a coordinate or the angle is not finite, there is no corner, or the radius is negative or not
                finite.

        Example:
            >>> queries = sandbox.SceneQueries(sandbox.load("bounce"))
            >>> hit = queries.cast_shape([(-0.5, -1.0), (0.5, -1.0), (0.5, 1.0), (-0.5, 1.0)], (3.0, 4.0), (3.0, 0.0))
            >>> hit.name, hit.fraction, hit.point
            ('ground', 0.75, (3.0, 1.0))
        """
        own = np.asarray(corners, np.float64).reshape(-1, 2)
        origin, way = np.asarray(start, np.float64), np.asarray(end, np.float64) - np.asarray(start, np.float64)
        if not len(own):
            raise ValueError("corners: a shape needs at least one")
        if not all(np.isfinite(each).all() for each in (own, origin, way, angle)):
            raise ValueError("a shape has a coordinate or an angle that is not finite")
        if not 0.0 <= radius < math.inf:
            raise ValueError(f"radius: must be at least 0 and finite, is {radius:g}")
        own = convex_hull(np.column_stack(rotate(own[:, 0], own[:, 1], np.cos(angle), np.sin(angle))))
        low = np.minimum(origin, origin + way) + own.min(axis=0) - radius
        high = np.maximum(origin, origin + way) + own.max(axis=0) + radius
        near = [
            ObjectHull(each.owner, minkowski_difference(each.corners, own), each.radius)
            for each in self._hulls
            if (each.corners.min(axis=0) - each.radius <= high).all()
            and (each.corners.max(axis=0) + each.radius >= low).all()
        ]
        planes = [each.raised(-float((own @ each.normal).min())) for each in self._planes]
        found = RayHits(np.full(1, np.inf), np.full(1, NOTHING), np.full((1, 2), np.nan), np.full((1, 2), np.nan))
        _cast(_features_of(near, planes, len(self._setup.bodies)), origin[None], way[None], radius, found)
        return self._first(found)

    def nearest(self, point: Sequence[float]) -> NearestObject | None:
        """Return the object whose surface is nearest to a point, or that the point is deepest in; None without any.

        Inside an object of several pieces, the depth is that in the piece in which it is deepest.

        Args:
            point: (2,) m.

        Raises:
            ValueError: a coordinate is not finite.
        """
        if not all(map(math.isfinite, point)):
            raise ValueError(f"point: must be finite, is {short_repr(point)}")
        if not len(self._features.owner):
            return None
        index, distance, surface = _nearest(self._features, np.asarray(point, np.float64))
        return NearestObject(self.name_of(index), distance, surface)


def _cast(features: _Features, origin: FloatArray, way: FloatArray, radius: float, found: RayHits) -> None:
    """Write the first hits of rays into `found`, whose rows are those of the rays.

    Args:
        features: of the objects.
        origin: (R, 2) m.
        way: (R, 2) m, from the starts to the ends.
        radius: of the discs that are cast, m.
        found: hits, without any so far.
    """
    if not len(features.owner):
        return
    to_discs = origin[:, None] - features.centre
    to_edges = origin[:, None] - features.tail
    height = (to_edges * features.outward).sum(axis=2)  # of the starts above the edges, before these are moved
    above = ((origin[:, None] - features.surface) * features.normal).sum(axis=2) - radius
    fraction = np.concatenate(
        (
            _enter_discs(to_discs, features.radius + radius, way),
            _enter_edges(features, to_edges, height - features.width - radius, way),
            _enter_planes(above, _dots(way, features.normal)),
        ),
        axis=1,
    )
    inside = np.concatenate(
        (
            np.hypot(to_discs[..., 0], to_discs[..., 1]) < features.radius + radius,
            _is_inside(features, to_edges, height, radius),
            above < 0.0,
        ),
        axis=1,
    )
    fraction[_of_objects(inside, features.owner)] = np.inf
    least = fraction.min(axis=1)
    hit = np.isfinite(least)
    first = features.order[(fraction == least[:, None])[:, features.order].argmax(axis=1)]
    found.fraction[hit], found.target[hit] = least[hit], features.owner[first[hit]]
    found.point[hit] = origin[hit] + least[hit, None] * way[hit]
    found.normal[hit] = _normals(features, first[hit], found.point[hit], way[hit])


def _dots(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the products of vectors (R, 2) and (K, 2), (R, K); a row does not depend on the others, as in BLAS."""
    return first[:, None, 0] * second[:, 0] + first[:, None, 1] * second[:, 1]


def _enter_discs(offset: FloatArray, radius: FloatArray, way: FloatArray) -> FloatArray:
    """Return the fraction of the way at which rays enter discs, (R, D); inf where they do not.

    Args:
        offset: (R, D, 2) m, of the starts from the centres.
        radius: (D,) m.
        way: (R, 2) m.
    """
    # The distance of the line from the centre has no difference of large squares.
    length2 = (way * way).sum(axis=1)[:, None]
    along = (offset * way[:, None]).sum(axis=2)
    across = offset[..., 0] * way[:, None, 1] - offset[..., 1] * way[:, None, 0]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # short ways
        half = np.sqrt(radius**2 * length2 - across**2)
        fraction = (-along - half) / length2
    return np.where((fraction >= 0.0) & (fraction <= 1.0), fraction, np.inf)


def _enter_edges(features: _Features, offset: FloatArray, height: FloatArray, way: FloatArray) -> FloatArray:
    """Return the fraction of the way at which rays enter hulls through edges, (R, E); inf where they do not.

    Args:
        features: of the objects.
        offset: (R, E, 2) m, of the starts from those of the edges.
        height: (R, E) m, of the starts above the moved edges.
        way: (R, 2) m.
    """
    fraction = _enter_planes(height, _dots(way, features.outward))
    length2 = (features.along * features.along).sum(axis=1)
    with np.errstate(invalid="ignore", over="ignore"):
        place = (offset * features.along).sum(axis=2) + fraction * _dots(way, features.along)
    return np.where((place >= 0.0) & (place <= length2), fraction, np.inf)


def _enter_planes(height: FloatArray, rate: FloatArray) -> FloatArray:
    """Return the fraction of the way at which rays cross half-planes inward, (R, P); inf where they do not.

    Args:
        height: (R, P) m, of the starts.
        rate: (R, P) m, change of the height on the whole way.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # short ways
        fraction = -height / rate
    return np.where((rate < 0.0) & (height >= 0.0) & (fraction <= 1.0), fraction, np.inf)


def _is_inside(features: _Features, offset: FloatArray, height: FloatArray, radius: float) -> BoolArray:
    """Return which starts are inside the hull of an edge, (R, E), so that a disc about them overlaps it."""
    away = offset_from_segment(offset, np.zeros_like(features.tail), features.along)
    near = np.hypot(away[..., 0], away[..., 1]) < features.width + radius
    total = int(features.area.sum())
    if total:
        below = np.logical_and.reduceat(height[:, :total] < 0.0, _area_starts(features), axis=1)
        near[:, :total] |= np.repeat(below, features.area, axis=1)
    return np.asarray(near)


def _area_starts(features: _Features) -> IntArray:
    """Return the first edge of each area, (A,)."""
    return np.cumsum(features.area) - features.area


def _of_objects(inside: BoolArray, owner: IntArray) -> BoolArray:
    """Return which features belong to an object of which a feature is marked, (R, F).

    Args:
        inside: (R, F) marks.
        owner: (F,) index of the object of each feature.
    """
    rays, columns = np.nonzero(inside)
    if not len(rays):
        return inside
    names, number = np.unique(owner, return_inverse=True)
    marked = np.zeros((len(inside), len(names)), np.bool_)
    marked[rays, number[columns]] = True
    return marked[:, number]


def _normals(features: _Features, which: IntArray, point: FloatArray, way: FloatArray) -> FloatArray:
    """Return the unit normals of features, (K, 2), where a disc or ray enters them.

    Args:
        features: of the objects.
        which: (K,) index of each, among discs, edges and half-planes.
        point: (K, 2) m, where it is entered.
        way: (K, 2) m, of the rays; the end of a wall without thickness faces them.
    """
    discs = len(features.radius)
    normal = np.concatenate((np.zeros((discs, 2)), features.outward, features.normal))[which]
    is_disc: BoolArray = np.asarray(which < discs)
    offset = point[is_disc] - features.centre[which[is_disc]]
    offset = np.where((offset != 0.0).any(axis=1, keepdims=True), offset, -way[is_disc])
    normal[is_disc] = offset / np.hypot(*offset.T)[:, None]
    return normal


def _nearest(features: _Features, point: FloatArray) -> tuple[int, float, tuple[float, float]]:
    """Return the object nearest to a point, its signed distance, m, and the nearest point of its surface, m."""
    to_discs, to_edges = point - features.centre, point - features.tail
    away = offset_from_segment(to_edges, np.zeros_like(features.tail), features.along)
    height = (to_edges * features.outward).sum(axis=1)
    to_hulls = np.hypot(*away.T)
    away = np.where(to_hulls[:, None] > 0.0, away, features.outward)  # on the middle line of a capsule, to either side
    total = int(features.area.sum())
    if total:  # inside an area the nearest edge is the one that the point is least deep below
        highest = np.repeat(np.maximum.reduceat(height[:total], _area_starts(features)), features.area)
        inside = highest <= 0.0
        depth = np.where(height[:total] == highest, highest, np.inf)
        to_hulls[:total] = np.where(inside, depth, to_hulls[:total])
        away[:total] = np.where(inside[:, None], features.outward[:total], away[:total])
    planes = ((point - features.surface) * features.normal).sum(axis=1)
    distance = np.concatenate((np.hypot(*to_discs.T) - features.radius, to_hulls - features.width, planes))
    outward = np.concatenate((to_discs, away, features.normal))
    which = int(features.order[distance[features.order].argmin()])
    length = math.hypot(*outward[which])
    normal = outward[which] / length if length > 0.0 else np.array((0.0, 1.0))  # from the centre of a disc, upwards
    x, y = (point - distance[which] * normal).tolist()
    return int(features.owner[which]), float(distance[which]), (x, y)


class ObjectHull(NamedTuple):
    """Convex hull of corners, widened by a radius."""

    owner: int
    """index of its object"""
    corners: FloatArray
    """(V, 2) m, counter-clockwise"""
    radius: float
    """m"""


class ObjectHalfPlane(NamedTuple):
    """A half-plane."""

    owner: int
    """index of its object"""
    point: FloatArray
    """(2,) m, of its surface"""
    normal: FloatArray
    """(2,) unit normal"""

    def raised(self, height: float) -> "ObjectHalfPlane":
        """Return the half-plane whose surface is higher, m."""
        return self._replace(point=self.point + height * self.normal)


def _seen_shapes(
    setup: Setup, frame: Frame | None, ignore: frozenset[str], categories: frozenset[str]
) -> tuple[list[ObjectHull], list[ObjectHalfPlane]]:
    """Return the hulls and half-planes of all objects that are seen.

    Raises:
        ValueError: the scene has no object or category with a name.
    """
    scene = setup.scene
    is_seen = visible_objects(scene, setup.bodies, ignore, categories)
    hulls = [each for each in (*_body_hulls(setup, frame), *static_hulls(scene)) if is_seen[each.owner]]
    normals = np.asarray([each.normal for each in scene.planes], np.float64).reshape(-1, 2)
    normals /= np.hypot(*normals.T)[:, None]
    planes = [
        ObjectHalfPlane(-1 - k, np.asarray(plane.point, np.float64), normals[k])
        for k, plane in enumerate(scene.planes)
        if is_seen[-1 - k]
    ]
    return hulls, planes


def _features_of(hulls: Sequence[ObjectHull], planes: Sequence[ObjectHalfPlane], bodies: int) -> _Features:
    """Return the features of objects.

    Args:
        hulls: of bodies, walls and posts.
        planes: half-planes.
        bodies: number of bodies of the scene.
    """
    areas = [each for each in hulls if len(each.corners) > 2]
    lines = [each for each in hulls if len(each.corners) == 2]
    tails = [each.corners for each in (*areas, *lines)]
    sides = [np.roll(each, -1, axis=0) - each for each in tails]
    along = np.concatenate((np.empty((0, 2)), *sides))
    edge_owner = [each.owner for each in (*areas, *lines) for _ in each.corners]
    owner = [each.owner for each in hulls for _ in each.corners] + edge_owner + [each.owner for each in planes]
    owners = np.asarray(owner, np.int64)
    return _Features(
        centre=np.concatenate((np.empty((0, 2)), *(each.corners for each in hulls))),
        radius=np.asarray([each.radius for each in hulls for _ in each.corners], np.float64),
        tail=np.concatenate((np.empty((0, 2)), *tails)),
        along=along,
        outward=np.column_stack((along[:, 1], -along[:, 0])) / np.hypot(*along.T)[:, None],
        width=np.asarray([each.radius for each in (*areas, *lines) for _ in each.corners], np.float64),
        area=np.asarray([len(each.corners) for each in areas], np.int64),
        surface=np.asarray([each.point for each in planes], np.float64).reshape(-1, 2),
        normal=np.asarray([each.normal for each in planes], np.float64).reshape(-1, 2),
        owner=owners,
        order=np.argsort(np.where(owners >= 0, owners, bodies - 1 - owners), kind="stable"),
    )


def visible_objects(
    scene: Scene, bodies: Bodies, ignore: frozenset[str], categories: frozenset[str]
) -> dict[int, bool]:
    """Return for each body and static object, by its index, whether it is seen, apart from whether it is present.

    Args:
        scene: the scene.
        bodies: bodies of the scene, and those that were added.
        ignore: names of bodies and static objects that are not seen.
        categories: collision categories that are seen; empty means all.

    Raises:
        ValueError: the scene has no body, static object or category with a name.
    """
    names = [*bodies.names, *scene.fixed_names[: len(scene.fixed)]]
    numbers = [*range(len(bodies)), *(-1 - k for k in range(len(scene.fixed)))]
    if unknown := ignore - set(names):
        raise ValueError(f"ignore: the scene has no body or static object {short_repr(min(unknown))}")
    if unknown := categories - set(scene.categories):
        known = ", ".join(scene.categories) or "none"
        raise ValueError(f"categories: unknown {short_repr(min(unknown))}; those of the scene: {known}")
    filters = filter_table(scene, bodies)
    wanted = mask_of(tuple(categories), scene.categories) if categories else -1
    bits = [*filters.categories.tolist(), *filters.fixed_categories.tolist()]
    solid = [element.collides != "none" for element in bodies.elements]
    is_solid = [solid[k] for k in bodies.element.tolist()]
    is_solid += [getattr(thing, "solid", True) for thing in scene.fixed]
    return {
        number: is_there and name not in ignore and bool(bit & wanted)
        for number, name, bit, is_there in zip(numbers, names, bits, is_solid, strict=True)
    }


def _body_hulls(setup: Setup, frame: Frame | None) -> Iterator[ObjectHull]:
    """Yield the hulls of the bodies that are present, where a frame has them, or else the setup."""
    bodies = setup.bodies
    state = bodies if frame is None else frame
    present = np.ones(len(bodies), np.bool_) if frame is None else frame.present
    shapes, position, angle = bodies.shapes, state.position, state.angle
    owner = np.repeat(shapes.body, shapes.corners)
    x, y = rotate(shapes.corner[:, 0], shapes.corner[:, 1], np.cos(angle[owner]), np.sin(angle[owner]))
    corners = position[owner] + np.column_stack((x, y))
    for k in np.flatnonzero(present[shapes.body]).tolist():
        yield ObjectHull(int(shapes.body[k]), corners[shapes.first[k] : shapes.first[k + 1]], float(shapes.radius[k]))


def static_hulls(scene: Scene) -> Iterator[ObjectHull]:
    """Yield the hulls of walls, a segment each, and of posts."""
    for k, thing in enumerate(scene.fixed):
        if isinstance(thing, Post):
            yield ObjectHull(-1 - k, np.asarray([thing.position], np.float64), thing.radius)
        elif isinstance(thing, Wall):
            line = np.asarray([*thing.points, thing.points[0]] if thing.closed else thing.points, np.float64)
            for segment in np.stack((line[:-1], line[1:]), axis=1):
                if (segment[0] != segment[1]).any():
                    yield ObjectHull(-1 - k, segment, 0.5 * thing.thickness)
