"""Shapes: the convex pieces that bodies consist of, each the hull of its corners, widened by its radius.

One corner is a disc, two are a capsule, three or more a polygon. So one narrow phase, one way of drawing and one of
weighing serve them all. Pieces lie in their body's own frame, about its centre of mass.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from sandbox.scene.decompose import convex_parts
from sandbox.scene.discs import Disc
from sandbox.scene.moments import Moments, capsule_moments, disc_moments, polygon_moments
from sandbox.scene.near import FloatArray, IntArray
from sandbox.scene.outline import anticlockwise
from sandbox.scene.part import Point
from sandbox.scene.solids import (
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
from sandbox.scene.stacks import Stack
from sandbox.scene.surfaced import Mover


class Piece(NamedTuple):
    """One convex piece."""

    corners: tuple[Point, ...]
    """counter-clockwise, m, about the centre of mass of its body"""
    radius: float
    """m"""
    bearer: int = 0
    """which part of a body it is of"""


class Form(NamedTuple):
    """What an element looks like and weighs."""

    pieces: tuple[Piece, ...]
    mass: float
    """kg"""
    moment: float
    """of inertia about the centre of mass, kg·m²"""
    centre: Point
    """of mass, in the frame that the element was drawn in, m"""
    reach: float
    """from the centre of mass to the farthest point, m"""
    core: float
    """radius of the largest disc about the centre of mass that lies inside one piece, m; 0 where there is none"""
    thin: float
    """half the width of its thinnest piece where that is narrowest, m; of a disc its radius"""


def form_of(element: Mover) -> Form:
    """Work out an element's pieces, mass and moment of inertia; of a generator, those of one of its bodies.

    Raises:
        OutlineError: an outline cannot be cut into convex pieces.
    """
    if isinstance(element, Disc):
        area = math.pi * element.radius**2
        mass = element.mass if element.mass is not None else 1.0 if element.density is None else element.density * area
        piece = Piece(((0.0, 0.0),), element.radius)
        moment = 0.5 * mass * (element.radius * element.radius)
        radius = element.radius
        return Form((piece,), mass, moment, (0.0, 0.0), reach=radius, core=radius, thin=radius)
    return _solid_form(element)


@lru_cache(maxsize=4096)
def _solid_form(element: Mover) -> Form:
    drawn = tuple(_drawn(element))
    shares = [_moments(piece) for piece, _ in drawn]
    density = _densities(element, [stated for _, stated in drawn], [share.area for share in shares])
    weight = [rho * share.area for rho, share in zip(density, shares, strict=True)]
    mass = math.fsum(weight)
    x, y = (math.fsum(w * s.centroid[k] for w, s in zip(weight, shares, strict=True)) / mass for k in (0, 1))
    moment = math.fsum(
        rho * s.second + w * math.dist(s.centroid, (x, y)) ** 2
        for rho, w, s in zip(density, weight, shares, strict=True)
    )
    pieces = tuple(p._replace(corners=tuple((a - x, b - y) for a, b in p.corners)) for p, _ in drawn)
    reach = max(math.hypot(*corner) + p.radius for p in pieces for corner in p.corners)
    core, thin = max(map(_inside, pieces)), min(map(_half_width, pieces))
    return Form(pieces, mass, moment, (x, y), reach, core, thin)


def _densities(element: Mover, stated: list[float | None], area: list[float]) -> list[float]:
    """Return each piece's density, kg/m²: its part's, else the body's, else 1; scaled to the mass if that is known."""
    own = [element.density if rho is None else rho for rho in stated]
    density = [1.0 if rho is None else rho for rho in own]
    mass = element.mass
    if mass is None and all(rho is None for rho in own):
        mass = 1.0
    if mass is None:
        return density
    total = math.fsum(rho * a for rho, a in zip(density, area, strict=True))
    return [rho * (mass / total) for rho in density]


def _drawn(element: Mover) -> list[tuple[Piece, float | None]]:
    """Return the pieces of an element as it was drawn, with the density that each states."""
    if isinstance(element, Compound):
        return [
            (_moved(piece, part)._replace(bearer=bearer), part.density)
            for bearer, part in enumerate(element.parts)
            for piece in _pieces_of(part)
        ]
    assert isinstance(element, Box | Capsule | Polygon | Stack)
    return [(piece, None) for piece in _pieces_of(element)]


def _pieces_of(shape: Box | Capsule | Polygon | Stack | AnyPart) -> list[Piece]:
    match shape:
        case BallPart():
            return [Piece(((0.0, 0.0),), shape.radius)]
        case Capsule() | CapsulePart():
            half = 0.5 * shape.length
            return [Piece(((-half, 0.0), (half, 0.0)), shape.radius)]
        case Box() | BoxPart() | Stack():
            x, y = 0.5 * shape.size[0], 0.5 * shape.size[1]
            return [Piece(((-x, -y), (x, -y), (x, y), (-x, y)), 0.0)]
        case Polygon() | PolygonPart():
            return [Piece(part, 0.0) for part in convex_parts(anticlockwise(shape.points))]


def _moved(piece: Piece, part: Attached) -> Piece:
    """Return a part's piece in the frame of its body."""
    cos, sin = math.cos(part.angle), math.sin(part.angle)
    px, py = part.position
    return piece._replace(corners=tuple((px + cos * x - sin * y, py + sin * x + cos * y) for x, y in piece.corners))


def _moments(piece: Piece) -> Moments:
    match len(piece.corners):
        case 1:
            return disc_moments(piece.corners[0], piece.radius)
        case 2:
            return capsule_moments(piece.corners[0], piece.corners[1], piece.radius)
        case _:
            return polygon_moments(piece.corners)


def _inside(piece: Piece) -> float:
    """Return the radius of the largest disc about the origin that lies in a piece, m; 0 if the origin does not."""
    corners = piece.corners
    if len(corners) < 3:
        (ax, ay), (bx, by) = corners[0], corners[-1]
        x, y = bx - ax, by - ay
        length2 = x * x + y * y
        share = min(max(-(ax * x + ay * y) / length2, 0.0), 1.0) if length2 else 0.0
        return max(piece.radius - math.hypot(ax + share * x, ay + share * y), 0.0)
    depth = math.inf
    for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1], strict=True):
        depth = min(depth, (ax * by - ay * bx) / math.hypot(bx - ax, by - ay))
    return max(depth, 0.0)


def _half_width(piece: Piece) -> float:
    """Return half the least distance of two parallel lines that a piece fits between, m: one lies along an edge."""
    corners = piece.corners
    if len(corners) < 3:
        return piece.radius
    width = math.inf
    for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1], strict=True):
        length = math.hypot(bx - ax, by - ay)
        width = min(width, max((bx - ax) * (y - ay) - (by - ay) * (x - ax) for x, y in corners) / length)
    return 0.5 * width + piece.radius


@dataclass(frozen=True, eq=False)
class Shapes:
    """The pieces of N bodies, S of them, with V corners in all."""

    body: IntArray
    """(S,) number of the body that each belongs to, ascending"""
    first: IntArray
    """(S + 1,) row in `corner` of each one's first; the last is V"""
    corner: FloatArray
    """(V, 2) m, counter-clockwise, in the frame of the body about its centre of mass"""
    radius: FloatArray
    """(S,) m"""
    middle: FloatArray
    """(S, 2) m, about which `reach` is taken, in the same frame"""
    reach: FloatArray
    """(S,) radius of a disc about `middle` that holds the piece, m"""
    piece: IntArray
    """(S,) which piece of its element each is"""
    bearer: IntArray
    """(S,) which part of its element each is of; 0 where it has none"""

    def __len__(self) -> int:
        return len(self.body)

    @property
    def corners(self) -> IntArray:
        """(S,) how many corners each has."""
        return np.diff(self.first)


def shapes_of(element: IntArray, elements: tuple[Mover, ...]) -> Shapes:
    """Lay out the pieces of N bodies.

    Args:
        element: (N,) index of each body's element.
        elements: what they stand for.
    """
    forms = [form_of(each).pieces for each in elements]
    count = np.asarray([len(pieces) for pieces in forms], dtype=np.int64)
    of_body = count[element]
    body = np.repeat(np.arange(len(element)), of_body)
    piece = np.arange(len(body)) - np.repeat(np.cumsum(of_body) - of_body, of_body)
    begin = np.cumsum(count) - count
    which = begin[element[body]] + piece  # among all pieces of all elements
    flat = [p for pieces in forms for p in pieces]
    size = np.asarray([len(p.corners) for p in flat], dtype=np.int64)
    start = np.cumsum(size) - size
    every = np.asarray([c for p in flat for c in p.corners], dtype=np.float64).reshape(-1, 2)
    middle = np.asarray([_middle(p) for p in flat], dtype=np.float64).reshape(-1, 2)
    radius = np.asarray([p.radius for p in flat], dtype=np.float64)
    reach = np.asarray(
        [max(math.dist(c, m) for c in p.corners) + p.radius for p, m in zip(flat, middle.tolist(), strict=True)]
    ).reshape(-1)
    bearer = np.asarray([p.bearer for p in flat], dtype=np.int64)
    own = size[which]
    first = np.concatenate(([0], np.cumsum(own)))
    row = np.repeat(start[which], own) + np.arange(first[-1]) - np.repeat(first[:-1], own)
    return Shapes(body, first, every[row], radius[which], middle[which], reach[which], piece, bearer[which])


def _middle(piece: Piece) -> tuple[float, float]:
    """Return the middle of a piece's bounding box."""
    xs, ys = [x for x, _ in piece.corners], [y for _, y in piece.corners]
    return 0.5 * (min(xs) + max(xs)), 0.5 * (min(ys) + max(ys))
