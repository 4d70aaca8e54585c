"""Geometry of the bodies of a scene for drawing: their convex pieces, on the screen and in kernels.

The distance from a body of several pieces is that from its nearest piece. It is 0 along a seam, where two pieces abut,
although a seam lies inside the body. So seams get patches, further convex pieces that lie within the body: a hexagon
along each seam, and a disc where several meet. Rims then follow the edge of the whole body.
"""

import math
from typing import NamedTuple

import numpy as np
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.window.hit_test import Distance, Hull, hull_distance

PATCH_DEPTH = 0.5
"""Depth of a patch in each piece, as a fraction of half the thickness of the thinner one; a rim takes at most 0.16."""
ABUTTING = 1e-6
"""Distance between edges that abut, as a fraction of the size of a body: rounding of corners in scene files."""


class ConvexPieces(NamedTuple):
    """What the bodies of a scene consist of."""

    piece: IntArray
    """(N + 1,) where each body's pieces begin"""
    first: IntArray
    """(S + 1,) where each piece's corners begin"""
    corner: FloatArray
    """(V, 2) m, in the body's frame"""
    radius: FloatArray
    """(S,) m"""


class ScreenPose(NamedTuple):
    """Where a body is in a picture."""

    x: float
    """px"""
    y: float
    angle: float
    """rad, counted as in the world, where y is up"""
    scale: float
    """px/m"""


class BodyGeometry:
    """What the bodies of a scene consist of."""

    def __init__(self, bodies: Bodies) -> None:
        self._bodies = bodies
        shapes = bodies.shapes
        pieces = ConvexPieces(
            piece=np.searchsorted(shapes.body, np.arange(len(bodies) + 1)).astype(np.int64),
            first=shapes.first,
            corner=shapes.corner,
            radius=shapes.radius,
        )
        girth = _girths(pieces)
        self._girth = np.zeros(len(bodies))
        np.maximum.at(self._girth, np.repeat(np.arange(len(bodies)), np.diff(pieces.piece)), girth)
        self.pieces = _with_patches(pieces, girth)

    def rims(self, who: IntArray, scale: float, line: float) -> FloatArray:
        """Return the widths of the rims of bodies, (K,) px: as of discs of about the same thickness."""
        girth = self._girth[who] * scale
        return np.asarray(np.minimum(0.16 * girth, line * np.minimum(1.0 + girth / 80.0, 2.5)))

    def hulls(self, number: int, place: ScreenPose) -> list[Hull]:
        """Return the pieces of a body in the picture, px."""
        pieces, found = self.pieces, []
        cos, sin = math.cos(place.angle) * place.scale, math.sin(place.angle) * place.scale
        turn = np.asarray(((cos, -sin), (-sin, -cos)))
        for piece in range(int(pieces.piece[number]), int(pieces.piece[number + 1])):
            corners = pieces.corner[int(pieces.first[piece]) : int(pieces.first[piece + 1])]
            found.append(Hull(corners @ turn + place[:2], float(pieces.radius[piece]) * place.scale))
        return found

    def distance(self, number: int, place: ScreenPose) -> Distance:
        """Return the signed distance from a body, px; inside a compound body, that from its nearest piece."""
        parts = [hull_distance(hull) for hull in self.hulls(number, place)]
        if len(parts) == 1:
            return parts[0]
        return lambda x, y: np.asarray(np.minimum.reduce([part(x, y) for part in parts]))

    def within(self, number: int, place: ScreenPose, margin: float = 1.0) -> tuple[float, float, float, float]:
        """Return left, top, right and bottom of the box around a body and a margin, px."""
        hulls = self.hulls(number, place)
        low = np.min([hull.corners.min(axis=0) - hull.radius for hull in hulls], axis=0) - margin
        high = np.max([hull.corners.max(axis=0) + hull.radius for hull in hulls], axis=0) + margin
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])

    def boxes(self, who: IntArray, centre: FloatArray, angle: FloatArray, scale: float) -> FloatArray:
        """Return left, top, right and bottom of the boxes around bodies, (K, 4) px; they are given as to be drawn."""
        pieces = self.pieces
        begin, end = pieces.first[pieces.piece[who]], pieces.first[pieces.piece[who + 1]]
        count = end - begin
        start = np.cumsum(count) - count
        row = np.repeat(begin - start, count) + np.arange(int(count.sum()))
        cos, sin = np.repeat(np.cos(angle), count), np.repeat(np.sin(angle), count)
        x, y = pieces.corner[row].T
        wide = np.repeat(pieces.radius, np.diff(pieces.first))[row]
        right, down = cos * x - sin * y, -(sin * x + cos * y)
        if not len(who):
            return np.empty((0, 4))
        low = [np.minimum.reduceat(each - wide, start) for each in (right, down)]
        high = [np.maximum.reduceat(each + wide, start) for each in (right, down)]
        return np.asarray(np.stack((*low, *high), axis=1) * scale + np.hstack((centre, centre)))


def clipped_box(box: tuple[float, float, float, float], area: pygame.Rect) -> pygame.Rect:
    """Return the part of an area that a box touches, whatever its size."""
    left, top = max(box[0], area.left), max(box[1], area.top)
    right, bottom = min(box[2], area.right), min(box[3], area.bottom)
    if not (left < right and top < bottom):
        return pygame.Rect(0, 0, 0, 0)
    corner = math.floor(left), math.floor(top)
    return pygame.Rect(*corner, math.ceil(right) - corner[0], math.ceil(bottom) - corner[1])


def _girths(pieces: ConvexPieces) -> FloatArray:
    """Return half of the thickness of each piece, about, (S,) m: its area by half its perimeter."""
    start = pieces.first[:-1]
    count = np.diff(pieces.first)
    following = np.arange(len(pieces.corner)) + 1
    following[pieces.first[1:] - 1] = start
    a, b = pieces.corner, pieces.corner[following]
    twice = np.add.reduceat(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], start) if len(start) else np.empty(0)
    around = np.add.reduceat(np.hypot(*(b - a).T), start) if len(start) else np.empty(0)
    return np.asarray(pieces.radius + np.where(count > 2, twice / np.maximum(around, 1e-300), 0.0))


def _with_patches(pieces: ConvexPieces, girth: FloatArray) -> ConvexPieces:
    """Return the pieces of bodies, followed by the patches of their seams, body by body."""
    compound = np.flatnonzero(np.diff(pieces.piece) > 1)
    patches = {int(body): patches for body in compound if (patches := _patches(pieces, int(body), girth))}
    if not patches:
        return pieces
    piece, first, corner, radius = [0], [0], list[FloatArray](), list[float]()
    for body in range(len(pieces.piece) - 1):
        begin, end = int(pieces.piece[body]), int(pieces.piece[body + 1])
        hulls = [pieces.corner[pieces.first[k] : pieces.first[k + 1]] for k in range(begin, end)]
        added = patches.get(body, [])
        corner += [*hulls, *(patch.corners for patch in added)]
        radius += [*pieces.radius[begin:end].tolist(), *(patch.radius for patch in added)]
        first += [len(each) for each in corner[len(corner) - len(hulls) - len(added) :]]
        piece.append(len(hulls) + len(added))
    return ConvexPieces(
        np.cumsum(piece).astype(np.int64), np.cumsum(first).astype(np.int64), np.concatenate(corner), np.asarray(radius)
    )


def _patches(pieces: ConvexPieces, body: int, girth: FloatArray) -> list[Hull]:
    """Return the patches of a body, m."""
    begin, end = int(pieces.piece[body]), int(pieces.piece[body + 1])
    corners = {k: pieces.corner[pieces.first[k] : pieces.first[k + 1]] for k in range(begin, end)}
    sharp = [k for k, each in corners.items() if len(each) > 2 and pieces.radius[k] == 0.0]
    if len(sharp) < 2:
        return []
    polygons = [corners[k] for k in sharp]
    tolerance = ABUTTING * float(np.ptp(np.concatenate(polygons), axis=0).max())
    patches, junctions = [], list[FloatArray]()
    for i, one in enumerate(sharp):
        for other in sharp[i + 1 :]:
            for ends in _seams(corners[one], corners[other], tolerance):
                depth = PATCH_DEPTH * min(girth[one], girth[other])
                patches.append(Hull(_hexagon(ends, min(depth, 0.4 * math.dist(*ends.tolist()))), 0.0))
                junctions += [each for each in ends if not _is_among(each, junctions, tolerance)]
    room = ((point, _room_around(point, polygons, tolerance)) for point in junctions)
    return patches + [Hull(point[None], radius) for point, radius in room if radius > 0.0]


def _is_among(point: FloatArray, points: list[FloatArray], tolerance: float) -> bool:
    return any(math.dist(point.tolist(), each.tolist()) <= tolerance for each in points)


def _room_around(point: FloatArray, polygons: list[FloatArray], tolerance: float) -> float:
    """Return the radius, m, of a disc around the end of a seam within the pieces there; 0 at a body's edge."""
    angle, radius = 0.0, math.inf
    for polygon in polygons:
        along = np.roll(polygon, -1, axis=0) - polygon
        length = np.maximum(np.hypot(*along.T), 1e-300)
        share = np.clip(((point - polygon) * along).sum(axis=1) / length**2, 0.0, 1.0)
        away = np.hypot(*(polygon + share[:, None] * along - point).T)
        (sides,) = np.nonzero(away <= tolerance)
        if not len(sides):
            continue
        if len(sides) == 1:
            angle += math.pi
        else:
            one, other = (along[k] / length[k] for k in sides[:2])
            angle += math.pi - math.acos(min(max(float(one @ other), -1.0), 1.0))
        radius = min(radius, float(np.min(away[away > tolerance], initial=math.inf)))
    return radius if angle > 2.0 * math.pi - 1e-3 and math.isfinite(radius) else 0.0


def _seams(one: FloatArray, other: FloatArray, tolerance: float) -> list[FloatArray]:
    """Return the ends of the segments that two anticlockwise polygons abut along, (2, 2) m each."""
    seams = []
    following = np.roll(other, -1, axis=0)
    for a, b in zip(one, np.roll(one, -1, axis=0), strict=True):
        length = math.dist(a.tolist(), b.tolist())
        if length <= tolerance:
            continue
        along = (b - a) / length
        across = np.asarray((along[1], -along[0]))
        near = (np.abs((other - a) @ across) <= tolerance) & (np.abs((following - a) @ across) <= tolerance)
        for k in np.flatnonzero(near):
            begin, end = float((following[k] - a) @ along), float((other[k] - a) @ along)  # it runs the other way
            begin, end = max(begin, 0.0), min(end, length)
            if end - begin > tolerance:
                seams.append(np.asarray((a + begin * along, a + end * along)))
    return seams


def _hexagon(ends: FloatArray, depth: float) -> FloatArray:
    """Return the hexagon around a segment: `depth` wide on both sides, with bevels at its ends, (6, 2) m."""
    begin, end = ends
    along = (end - begin) / math.dist(begin.tolist(), end.tolist()) * depth
    across = np.asarray((along[1], -along[0]))
    return np.asarray(
        (begin, begin + along + across, end - along + across, end, end - along - across, begin + along - across)
    )
