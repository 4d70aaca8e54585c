"""Convex pieces of bodies with their mass properties, and the areas of zones and sensors.

A piece is the convex hull of its corners, widened by its radius: one corner is a disc, two are a capsule, three or more
a polygon. So one narrow phase and one drawing routine serve all of them. Pieces are in the frame of their body, about
its centre of mass.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.scene.description.base import BodySource, BodySpec, Point
from sandbox.scene.description.bodies import (
    AnyPart,
    Attached,
    BallPart,
    Box,
    BoxPart,
    Capsule,
    CapsulePart,
    Compound,
    Polygon,
    PolygonPart,
)
from sandbox.scene.description.discs import Disc
from sandbox.scene.description.fixed import Sensor, Zone
from sandbox.scene.description.generators import Stack
from sandbox.scene.geometry.polygon import (
    Moments,
    anticlockwise,
    capsule_moments,
    disc_moments,
    rounded_polygon_moments,
)
from sandbox.scene.geometry.triangulation import convex_parts
from sandbox.scene.geometry.vectors import nearest_on_segment, to_world


class Piece(NamedTuple):
    """One convex piece of a body."""

    corners: tuple[Point, ...]
    """counter-clockwise, m, about the centre of mass of its body"""
    radius: float
    """m"""
    part: int = 0
    """index of the part of the body that it belongs to"""


class ElementGeometry(NamedTuple):
    """Pieces and mass properties of an element."""

    pieces: tuple[Piece, ...]
    mass: float
    """kg"""
    moment: float
    """moment of inertia about the centre of mass, kg·m²"""
    centre: Point
    """centre of mass in the frame in which the element is described, m"""
    bounding_radius: float
    """distance from the centre of mass to the farthest point, m"""
    inner_radius: float
    """radius of the largest disc about the centre of mass inside one piece, m; 0 if the centre is outside all pieces"""
    half_width: float
    """half the smallest width of the thinnest piece, m; of a disc its radius"""


def geometry_of(element: BodySource) -> ElementGeometry:
    """Return pieces, mass and moment of inertia of an element; of a generator, those of one of its bodies.

    Raises:
        OutlineError: an outline cannot be divided into convex pieces.
    """
    if isinstance(element, Disc):
        area = math.pi * element.radius**2
        mass = element.mass if element.mass is not None else 1.0 if element.density is None else element.density * area
        piece = Piece(((0.0, 0.0),), element.radius)
        moment = _stated_moment(element) or 0.5 * mass * (element.radius * element.radius)
        radius = element.radius
        return ElementGeometry(
            (piece,), mass, moment, (0.0, 0.0), bounding_radius=radius, inner_radius=radius, half_width=radius
        )
    return _solid_geometry(element)


def area_of(element: BodySource) -> float:
    """Return the area of an element, m², as the sum over its pieces; of a generator, that of one of its bodies."""
    return math.fsum(_moments(piece).area for piece in geometry_of(element).pieces)


UNTURNABLE = 1e42
"""kg·m², moment of inertia of bodies with `fixed_rotation`: no torque in range turns them by a measurable angle"""


def _stated_moment(element: BodySource) -> float | None:
    """Return the moment of inertia that an element states, kg·m²; None without one, as of generators."""
    if not isinstance(element, BodySpec):
        return None
    return UNTURNABLE if element.fixed_rotation else element.moment


@lru_cache(maxsize=4096)
def _solid_geometry(element: BodySource) -> ElementGeometry:
    pieces_and_densities = tuple(_described_pieces(element))
    moments = [_moments(piece) for piece, _ in pieces_and_densities]
    density = _densities(
        element, [stated for _, stated in pieces_and_densities], [fraction.area for fraction in moments]
    )
    weight = [rho * fraction.area for rho, fraction in zip(density, moments, strict=True)]
    total = math.fsum(weight)
    mass = total if element.mass is None else element.mass  # to the bit as stated
    x, y = (math.fsum(w * s.centroid[k] for w, s in zip(weight, moments, strict=True)) / total for k in (0, 1))
    if isinstance(element, Compound) and element.centre_of_mass is not None:
        x, y = element.centre_of_mass
    moment = _stated_moment(element) or math.fsum(
        rho * s.second + w * math.dist(s.centroid, (x, y)) ** 2
        for rho, w, s in zip(density, weight, moments, strict=True)
    )
    pieces = tuple(p._replace(corners=tuple((a - x, b - y) for a, b in p.corners)) for p, _ in pieces_and_densities)
    bounding_radius = max(math.hypot(*corner) + p.radius for p in pieces for corner in p.corners)
    inner_radius, half_width = max(map(_inside, pieces)), min(map(_half_width, pieces))
    return ElementGeometry(pieces, mass, moment, (x, y), bounding_radius, inner_radius, half_width)


def _densities(element: BodySource, stated: list[float | None], area: list[float]) -> list[float]:
    """Return the density of each piece, kg/m²: of its part, else of the body, else 1; scaled to a stated mass."""
    stated_or_body = [element.density if rho is None else rho for rho in stated]
    density = [1.0 if rho is None else rho for rho in stated_or_body]
    mass = element.mass
    if mass is None and all(rho is None for rho in stated_or_body):
        mass = 1.0
    if mass is None:
        return density
    total = math.fsum(rho * a for rho, a in zip(density, area, strict=True))
    return [rho * (mass / total) for rho in density]


def _described_pieces(element: BodySource) -> list[tuple[Piece, float | None]]:
    """Return the pieces of an element in the frame in which it is described, with their stated densities."""
    if isinstance(element, Compound):
        return [
            (_moved(piece, part)._replace(part=index), part.density)
            for index, part in enumerate(element.parts)
            for piece in _pieces_of(part)
        ]
    assert isinstance(element, Box | Capsule | Polygon | Stack)
    return [(piece, None) for piece in _pieces_of(element)]


def _pieces_of(shape: Box | Capsule | Polygon | Stack | AnyPart) -> list[Piece]:
    match shape:
        case BallPart():
            return [Piece(((0.0, 0.0),), shape.radius)]
        case Capsule():
            half = 0.5 * shape.length
            return [Piece(((-half, 0.0), (half, 0.0)), shape.radius)]
        case CapsulePart():
            return [Piece(shape.centres, shape.radius)]
        case Box() | BoxPart() | Stack():
            x, y = 0.5 * shape.size[0], 0.5 * shape.size[1]
            rounding = 0.0 if isinstance(shape, Stack) else shape.radius
            return [Piece(((-x, -y), (x, -y), (x, y), (-x, y)), rounding)]
        case Polygon() | PolygonPart():
            return [Piece(part, shape.radius) for part in convex_parts(anticlockwise(shape.points))]


def _moved(piece: Piece, part: Attached) -> Piece:
    """Return a piece of a part in the frame of its body."""
    cos, sin = math.cos(part.angle), math.sin(part.angle)
    return piece._replace(corners=tuple(to_world(corner, cos, sin, part.position) for corner in piece.corners))


def _moments(piece: Piece) -> Moments:
    match len(piece.corners):
        case 1:
            return disc_moments(piece.corners[0], piece.radius)
        case 2:
            return capsule_moments(piece.corners[0], piece.corners[1], piece.radius)
        case _:
            return rounded_polygon_moments(piece.corners, piece.radius)


def _inside(piece: Piece) -> float:
    """Return the radius of the largest disc about the origin inside a piece, m; 0 if the origin is outside."""
    corners = piece.corners
    if len(corners) < 3:
        _, distance = nearest_on_segment((0.0, 0.0), corners[0], corners[-1])
        return max(piece.radius - distance, 0.0)
    depth = math.inf
    for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1], strict=True):
        depth = min(depth, (ax * by - ay * bx) / math.hypot(bx - ax, by - ay))
    return max(depth + piece.radius, 0.0)


def _half_width(piece: Piece) -> float:
    """Return half the smallest distance of two parallel lines enclosing a piece, m; one contains an edge."""
    if len(piece.corners) < 3:
        return piece.radius
    return 0.5 * _width(piece.corners) + piece.radius


def _width(corners: tuple[Point, ...]) -> float:
    """Return the smallest distance of two parallel lines enclosing a convex polygon, m."""
    width = math.inf
    for (ax, ay), (bx, by) in zip(corners, (*corners[1:], corners[0]), strict=True):
        length = math.hypot(bx - ax, by - ay)
        width = min(width, max((bx - ax) * (y - ay) - (by - ay) * (x - ax) for x, y in corners) / length)
    return width


@dataclass(frozen=True, eq=False)
class Shapes:
    """Pieces of N bodies: S pieces with V corners in all."""

    body: IntArray
    """(S,) index of the body of each piece, ascending"""
    first: IntArray
    """(S + 1,) row in `corner` of the first corner of each piece; the last entry is V"""
    corner: FloatArray
    """(V, 2) m, counter-clockwise, in the frame of the body about its centre of mass"""
    radius: FloatArray
    """(S,) m"""
    middle: FloatArray
    """(S, 2) m, centre of the bounding disc, in the same frame"""
    bounding_radius: FloatArray
    """(S,) m, radius of the disc about `middle` that contains the piece"""
    piece: IntArray
    """(S,) index of the piece within its element"""
    part: IntArray
    """(S,) index of the part within its element; 0 without parts"""

    def __len__(self) -> int:
        return len(self.body)

    @property
    def corners(self) -> IntArray:
        """(S,) number of corners of each piece."""
        return np.diff(self.first)


def shapes_of(element: IntArray, elements: tuple[BodySource, ...]) -> Shapes:
    """Return the pieces of N bodies as arrays.

    Args:
        element: (N,) index of each body's element.
        elements: the elements.
    """
    pieces_of_element = [geometry_of(each).pieces for each in elements]
    count = np.asarray([len(pieces) for pieces in pieces_of_element], dtype=np.int64)
    of_body = count[element]
    body = np.repeat(np.arange(len(element)), of_body)
    piece = np.arange(len(body)) - np.repeat(np.cumsum(of_body) - of_body, of_body)
    begin = np.cumsum(count) - count
    which = begin[element[body]] + piece  # among all pieces of all elements
    flat = [p for pieces in pieces_of_element for p in pieces]
    size = np.asarray([len(p.corners) for p in flat], dtype=np.int64)
    start = np.cumsum(size) - size
    all_corners = np.asarray([c for p in flat for c in p.corners], dtype=np.float64).reshape(-1, 2)
    middle = np.asarray([_middle(p) for p in flat], dtype=np.float64).reshape(-1, 2)
    radius = np.asarray([p.radius for p in flat], dtype=np.float64)
    bounding_radius = np.asarray(
        [max(math.dist(c, m) for c in p.corners) + p.radius for p, m in zip(flat, middle.tolist(), strict=True)]
    ).reshape(-1)
    part = np.asarray([p.part for p in flat], dtype=np.int64)
    corner_counts = size[which]
    first = np.concatenate(([0], np.cumsum(corner_counts)))
    row = np.repeat(start[which], corner_counts) + np.arange(first[-1]) - np.repeat(first[:-1], corner_counts)
    return Shapes(
        body, first, all_corners[row], radius[which], middle[which], bounding_radius[which], piece, part[which]
    )


def _middle(piece: Piece) -> tuple[float, float]:
    """Return the centre of the bounding box of a piece."""
    xs, ys = [x for x, _ in piece.corners], [y for _, y in piece.corners]
    return 0.5 * (min(xs) + max(xs)), 0.5 * (min(ys) + max(ys))


class ZonePiece(NamedTuple):
    """A disc (one corner), a segment with round ends (two corners) or a convex polygon (more)."""

    corners: tuple[Point, ...]
    """m, counter-clockwise"""
    radius: float
    """m; 0 for a polygon"""


@lru_cache(maxsize=1024)
def pieces_of(zone: Zone | Sensor) -> tuple[ZonePiece, ...]:
    """Return the pieces of a zone or sensor that has a shape.

    Raises:
        OutlineError: its outline cannot be divided into convex pieces.
    """
    if zone.points is None:
        assert zone.position is not None and zone.radius is not None
        return (ZonePiece((zone.position,), zone.radius),)
    if zone.thickness is not None:
        return tuple(ZonePiece((a, b), 0.5 * zone.thickness) for a, b in pairwise(zone.points))
    return tuple(ZonePiece(tuple(part), 0.0) for part in convex_parts(anticlockwise(zone.points)))


def placed_sensor(sensor: Sensor, origin: Point, angle: float) -> Sensor:
    """Return a sensor of a body as one in the world.

    Args:
        sensor: with a shape in the frame of its body.
        origin: of that frame, m.
        angle: of that frame, rad.
    """
    cos, sin = math.cos(angle), math.sin(angle)
    position, points = sensor.position, sensor.points
    placed = {
        "body": None,
        "position": None if position is None else to_world(position, cos, sin, origin),
        "points": None if points is None else tuple(to_world(each, cos, sin, origin) for each in points),
    }
    return sensor.model_copy(update=placed)


@lru_cache(maxsize=1024)
def middle_of(zone: Zone | Sensor) -> Point:
    """Return the centre of a zone or sensor, m: the centroid of a polygon, the midpoint of a strip's line."""
    if zone.points is None:
        assert zone.position is not None
        return zone.position
    if zone.thickness is not None:
        remaining = 0.5 * math.fsum(math.dist(a, b) for a, b in pairwise(zone.points))
        for a, b in pairwise(zone.points):
            length = math.dist(a, b)
            if remaining <= length:
                break
            remaining -= length
        fraction = min(remaining / length, 1.0)
        return a[0] + fraction * (b[0] - a[0]), a[1] + fraction * (b[1] - a[1])
    corners = anticlockwise(zone.points)
    ox, oy = corners[0]
    spokes = [(x - ox, y - oy) for x, y in corners[1:]]
    crosses = [(a[0] * b[1] - a[1] * b[0], a, b) for a, b in pairwise(spokes)]
    area = 3.0 * math.fsum(cross for cross, _, _ in crosses)
    x = math.fsum(cross * (a[0] + b[0]) for cross, a, b in crosses) / area
    y = math.fsum(cross * (a[1] + b[1]) for cross, a, b in crosses) / area
    return ox + x, oy + y


def contains(zone: Zone, point: Point) -> bool:
    """Return whether a point, m, is inside a zone."""
    return any(_contains(piece, point) for piece in pieces_of(zone))


def _contains(piece: ZonePiece, point: Point) -> bool:
    corners = piece.corners
    if len(corners) > 2:
        sides = zip(corners, (*corners[1:], corners[0]), strict=True)
        return all((bx - ax) * (point[1] - ay) - (by - ay) * (point[0] - ax) >= 0.0 for (ax, ay), (bx, by) in sides)
    _, distance = nearest_on_segment(point, corners[0], corners[-1])
    return distance < piece.radius


def width_of(zone: Zone | Sensor) -> float:
    """Return the approximate smallest width of a zone or sensor, m; a body that moves farther at once can miss it."""
    return min(2.0 * piece.radius if len(piece.corners) < 3 else _width(piece.corners) for piece in pieces_of(zone))
