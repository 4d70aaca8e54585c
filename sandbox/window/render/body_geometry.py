"""Geometry of bodies for drawing: their convex pieces in body coordinates, and in pixels for a given pose.

The distance from a compound body is the distance from its nearest piece. It is 0 along a seam, where two pieces abut,
although a seam lies inside the body. Seams therefore get patches, additional convex pieces within the body: a hexagon
along each seam, and a disc where several seams meet. Rims then follow the outline of the whole body.
"""

import math
from typing import NamedTuple

import numpy as np
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.geometry.vectors import offset_from_segment
from sandbox.window.hit_test import Distance, Hull, distance_from_hull

PATCH_DEPTH = 0.5
"""Depth of a patch in each piece, as a fraction of half the thickness of the thinner piece; a rim takes at most 0.16.
"""
ABUTTING_TOLERANCE = 1e-6
"""Tolerance of abutting edges as a fraction of the size of a body, for rounded corners in scene files."""


class ConvexPieces(NamedTuple):
    """Convex pieces of the N bodies of a scene: S rounded polygons with V corners in total."""

    piece: IntArray
    """(N + 1,) index of the first piece of each body"""
    first: IntArray
    """(S + 1,) index of the first corner of each piece"""
    corner: FloatArray
    """(V, 2) m, in the body's frame"""
    radius: FloatArray
    """(S,) m, rounding radius"""


class ScreenPose(NamedTuple):
    """Pose of a body on the screen."""

    x: float
    """px"""
    y: float
    angle: float
    """rad, counter-clockwise, as in the world (y up)"""
    scale: float
    """px/m"""


class BodyGeometry:
    """Convex pieces and patches of the bodies of a scene, with the queries that drawing needs."""

    def __init__(self, bodies: Bodies) -> None:
        self._bodies = bodies
        shapes = bodies.shapes
        pieces = ConvexPieces(
            piece=np.searchsorted(shapes.body, np.arange(len(bodies) + 1)).astype(np.int64),
            first=shapes.first,
            corner=shapes.corner,
            radius=shapes.radius,
        )
        half_thickness = _half_thicknesses(pieces)
        self._half_thickness = np.zeros(len(bodies))
        np.maximum.at(self._half_thickness, np.repeat(np.arange(len(bodies)), np.diff(pieces.piece)), half_thickness)
        self.pieces = _with_patches(pieces, half_thickness)

    def rims(self, indices: IntArray, scale: float, line: float) -> FloatArray:
        """Return the rim widths of bodies, (K,) px: those of discs of about the same thickness."""
        half_thickness = self._half_thickness[indices] * scale
        return np.asarray(np.minimum(0.16 * half_thickness, line * np.minimum(1.0 + half_thickness / 80.0, 2.5)))

    def hulls(self, number: int, pose: ScreenPose) -> list[Hull]:
        """Return the pieces of a body in screen coordinates, px."""
        pieces, found = self.pieces, []
        cos, sin = math.cos(pose.angle) * pose.scale, math.sin(pose.angle) * pose.scale
        rotation = np.asarray(((cos, -sin), (-sin, -cos)))
        for piece in range(int(pieces.piece[number]), int(pieces.piece[number + 1])):
            corners = pieces.corner[int(pieces.first[piece]) : int(pieces.first[piece + 1])]
            found.append(Hull(corners @ rotation + pose[:2], float(pieces.radius[piece]) * pose.scale))
        return found

    def distance(self, number: int, pose: ScreenPose) -> Distance:
        """Return the signed distance function of a body, px: the minimum over its pieces."""
        distances = [distance_from_hull(hull) for hull in self.hulls(number, pose)]
        if len(distances) == 1:
            return distances[0]
        return lambda x, y: np.asarray(np.minimum.reduce([piece_distance(x, y) for piece_distance in distances]))

    def within(self, number: int, pose: ScreenPose, margin: float = 1.0) -> tuple[float, float, float, float]:
        """Return left, top, right and bottom of the bounding box of a body, enlarged by `margin`, px."""
        hulls = self.hulls(number, pose)
        low = np.min([hull.corners.min(axis=0) - hull.radius for hull in hulls], axis=0) - margin
        high = np.max([hull.corners.max(axis=0) + hull.radius for hull in hulls], axis=0) + margin
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])

    def boxes(self, indices: IntArray, centre: FloatArray, angle: FloatArray, scale: float) -> FloatArray:
        """Return left, top, right and bottom of the bounding boxes of bodies, (K, 4) px.

        `centre` (K, 2) is in px, `angle` (K,) in rad, finite, and `scale` in px/m.
        """
        pieces = self.pieces
        begin, end = pieces.first[pieces.piece[indices]], pieces.first[pieces.piece[indices + 1]]
        count = end - begin
        start = np.cumsum(count) - count
        row = np.repeat(begin - start, count) + np.arange(int(count.sum()))
        cos, sin = np.repeat(np.cos(angle), count), np.repeat(np.sin(angle), count)
        x, y = pieces.corner[row].T
        wide = np.repeat(pieces.radius, np.diff(pieces.first))[row]
        right, down = cos * x - sin * y, -(sin * x + cos * y)
        if not len(indices):
            return np.empty((0, 4))
        low = [np.minimum.reduceat(each - wide, start) for each in (right, down)]
        high = [np.maximum.reduceat(each + wide, start) for each in (right, down)]
        return np.asarray(np.stack((*low, *high), axis=1) * scale + np.hstack((centre, centre)))


def clipped_box(box: tuple[float, float, float, float], area: pygame.Rect) -> pygame.Rect:
    """Return the part of `area` that a box of any size overlaps; an empty rectangle if there is none."""
    left, top = max(box[0], area.left), max(box[1], area.top)
    right, bottom = min(box[2], area.right), min(box[3], area.bottom)
    if not (left < right and top < bottom):
        return pygame.Rect(0, 0, 0, 0)
    corner = math.floor(left), math.floor(top)
    return pygame.Rect(*corner, math.ceil(right) - corner[0], math.ceil(bottom) - corner[1])


def _half_thicknesses(pieces: ConvexPieces) -> FloatArray:
    """Return the approximate half thickness of each piece, (S,) m: 2 · area / perimeter."""
    start = pieces.first[:-1]
    count = np.diff(pieces.first)
    following = np.arange(len(pieces.corner)) + 1
    following[pieces.first[1:] - 1] = start
    a, b = pieces.corner, pieces.corner[following]
    area2 = np.add.reduceat(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], start) if len(start) else np.empty(0)
    perimeter = np.add.reduceat(np.hypot(*(b - a).T), start) if len(start) else np.empty(0)
    return np.asarray(pieces.radius + np.where(count > 2, area2 / np.maximum(perimeter, 1e-300), 0.0))


def _with_patches(pieces: ConvexPieces, half_thickness: FloatArray) -> ConvexPieces:
    """Return the pieces of each body followed by the patches of its seams."""
    compound = np.flatnonzero(np.diff(pieces.piece) > 1)
    patches = {int(body): patches for body in compound if (patches := _patches(pieces, int(body), half_thickness))}
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


def _patches(pieces: ConvexPieces, body: int, half_thickness: FloatArray) -> list[Hull]:
    """Return the patches of a body, m."""
    begin, end = int(pieces.piece[body]), int(pieces.piece[body + 1])
    corners = {k: pieces.corner[pieces.first[k] : pieces.first[k + 1]] for k in range(begin, end)}
    sharp = [k for k, each in corners.items() if len(each) > 2 and pieces.radius[k] == 0.0]
    if len(sharp) < 2:
        return []
    polygons = [corners[k] for k in sharp]
    tolerance = ABUTTING_TOLERANCE * float(np.ptp(np.concatenate(polygons), axis=0).max())
    patches, junctions = [], list[FloatArray]()
    for i, a in enumerate(sharp):
        for b in sharp[i + 1 :]:
            for ends in _seams(corners[a], corners[b], tolerance):
                depth = PATCH_DEPTH * min(half_thickness[a], half_thickness[b])
                patches.append(Hull(_hexagon(ends, min(depth, 0.4 * math.dist(*ends.tolist()))), 0.0))
                junctions += [each for each in ends if not _is_among(each, junctions, tolerance)]
    discs = ((point, _inscribed_radius(point, polygons, tolerance)) for point in junctions)
    return patches + [Hull(point[None], radius) for point, radius in discs if radius > 0.0]


def _is_among(point: FloatArray, points: list[FloatArray], tolerance: float) -> bool:
    return any(math.dist(point.tolist(), each.tolist()) <= tolerance for each in points)


def _inscribed_radius(point: FloatArray, polygons: list[FloatArray], tolerance: float) -> float:
    """Return the radius, m, of a disc around a seam end that fits within the pieces; 0 on the outline of the body."""
    angle, radius = 0.0, math.inf
    for polygon in polygons:
        along = np.roll(polygon, -1, axis=0) - polygon
        length = np.maximum(np.hypot(*along.T), 1e-300)
        distance = np.hypot(*offset_from_segment(point, polygon, along).T)
        (sides,) = np.nonzero(distance <= tolerance)
        if not len(sides):
            continue
        if len(sides) == 1:
            angle += math.pi
        else:
            one, other = (along[k] / length[k] for k in sides[:2])
            angle += math.pi - math.acos(min(max(float(one @ other), -1.0), 1.0))
        radius = min(radius, float(np.min(distance[distance > tolerance], initial=math.inf)))
    return radius if angle > 2.0 * math.pi - 1e-3 and math.isfinite(radius) else 0.0


def _seams(one: FloatArray, other: FloatArray, tolerance: float) -> list[FloatArray]:
    """Return the end points of the segments along which two counter-clockwise polygons abut, (2, 2) m each."""
    seams = []
    following = np.roll(other, -1, axis=0)
    for a, b in zip(one, np.roll(one, -1, axis=0), strict=True):
        length = math.dist(a.tolist(), b.tolist())
        if length <= tolerance:
            continue
        along = (b - a) / length
        across = np.asarray((along[1], -along[0]))
        is_collinear = (np.abs((other - a) @ across) <= tolerance) & (np.abs((following - a) @ across) <= tolerance)
        for k in np.flatnonzero(is_collinear):
            begin, end = float((following[k] - a) @ along), float((other[k] - a) @ along)  # opposite direction
            begin, end = max(begin, 0.0), min(end, length)
            if end - begin > tolerance:
                seams.append(np.asarray((a + begin * along, a + end * along)))
    return seams


def _hexagon(ends: FloatArray, depth: float) -> FloatArray:
    """Return a hexagon around a segment: `depth` wide on both sides, bevelled at the ends, (6, 2) m."""
    begin, end = ends
    along = (end - begin) / math.dist(begin.tolist(), end.tolist()) * depth
    across = np.asarray((along[1], -along[0]))
    return np.asarray(
        (begin, begin + along + across, end - along + across, end, end - along - across, begin + along - across)
    )
