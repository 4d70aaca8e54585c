"""Geometry of the bodies of a scene for drawing: their convex pieces, on the screen and in kernels.

Bodies of several pieces are painted in two passes, first all pieces enlarged in the colour of the rim, then all pieces
in the fill colour. So no seam shows where pieces overlap or abut, and the rim of such a body lies outside its edge.
"""

import math
from typing import NamedTuple

import numpy as np
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.window.hit_test import Distance, Hull, hull_distance

SEAM = 0.5
"""px by which the pieces of a compound body are enlarged, so that antialiased edges that abut cover each other"""


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
        self.pieces = ConvexPieces(
            piece=np.searchsorted(shapes.body, np.arange(len(bodies) + 1)).astype(np.int64),
            first=shapes.first,
            corner=shapes.corner,
            radius=shapes.radius,
        )
        self._girth = _girths(self.pieces)
        self._compound = np.diff(self.pieces.piece) > 1

    def rims(self, who: IntArray, scale: float, line: float) -> FloatArray:
        """Return the widths of the rims of bodies, (K,) px: as of discs of about the same thickness.

        Rims of compound bodies lie outside, and do not become wider than `line`.
        """
        girth = self._girth[who] * scale
        widest = np.where(self._compound[who], 1.0, np.minimum(1.0 + girth / 80.0, 2.5))
        return np.asarray(np.minimum(0.16 * girth, line * widest))

    def is_compound(self, number: int) -> bool:
        """Tell whether a body has several pieces."""
        return bool(self._compound[number])

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
    """Return half of how thick each body is about, (N,) m: that of its thickest piece, area by half its perimeter."""
    start = pieces.first[:-1]
    count = np.diff(pieces.first)
    following = np.arange(len(pieces.corner)) + 1
    following[pieces.first[1:] - 1] = start
    a, b = pieces.corner, pieces.corner[following]
    twice = np.add.reduceat(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], start) if len(start) else np.empty(0)
    around = np.add.reduceat(np.hypot(*(b - a).T), start) if len(start) else np.empty(0)
    girth = pieces.radius + np.where(count > 2, twice / np.maximum(around, 1e-300), 0.0)
    thickest = np.zeros(len(pieces.piece) - 1)
    np.maximum.at(thickest, np.repeat(np.arange(len(pieces.piece) - 1), np.diff(pieces.piece)), girth)
    return thickest
