"""Anatomy: the pieces and outlines of a scene's bodies, as drawing needs them; it lasts as long as the bodies do."""

import math
from typing import NamedTuple

import numpy as np
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.play.drawing.outlines import outline_distance, outlines_of
from sandbox.play.hulls import Distance, Hull, hull_distance
from sandbox.scene.compile.bodies import Bodies

SEAM = 1e-3
"""px: what is no farther from a piece lies in it, so that no seam shows where two abut"""


class Pieces(NamedTuple):
    """What the bodies of a scene consist of."""

    piece: IntArray
    """(N + 1,) where each body's pieces begin"""
    first: IntArray
    """(S + 1,) where each piece's corners begin"""
    corner: FloatArray
    """(V, 2) m, in the body's frame"""
    radius: FloatArray
    """(S,) m"""
    element: IntArray
    """(N,)"""
    edge_first: IntArray
    """(E + 1,) where the outline of each element begins"""
    edge: FloatArray
    """(P, 7), see `outlines`"""


class Place(NamedTuple):
    """Where a body is in a picture."""

    x: float
    """px"""
    y: float
    angle: float
    """rad, counted as in the world, where y is up"""
    scale: float
    """px/m"""


class Anatomy:
    """What the bodies of a scene consist of."""

    def __init__(self, bodies: Bodies) -> None:
        self._bodies = bodies
        shapes, outlines = bodies.shapes, outlines_of(bodies)
        self.pieces = Pieces(
            piece=np.searchsorted(shapes.body, np.arange(len(bodies) + 1)).astype(np.int64),
            first=shapes.first,
            corner=shapes.corner,
            radius=shapes.radius,
            element=bodies.element,
            edge_first=outlines.first,
            edge=outlines.edge,
        )
        self._girth = _girths(self.pieces)

    def rims(self, who: IntArray, scale: float, line: float) -> FloatArray:
        """Return how wide the rims of bodies are, (K,) px: as those of discs that are about as thick."""
        girth = self._girth[who] * scale
        return np.asarray(np.minimum(0.16 * girth, line * np.minimum(1.0 + girth / 80.0, 2.5)))

    def hulls(self, number: int, place: Place) -> list[Hull]:
        """Return the pieces of a body in the picture, px."""
        pieces, found = self.pieces, []
        cos, sin = math.cos(place.angle) * place.scale, math.sin(place.angle) * place.scale
        turn = np.asarray(((cos, -sin), (-sin, -cos)))
        for piece in range(int(pieces.piece[number]), int(pieces.piece[number + 1])):
            corners = pieces.corner[int(pieces.first[piece]) : int(pieces.first[piece + 1])]
            found.append(Hull(corners @ turn + place[:2], float(pieces.radius[piece]) * place.scale))
        return found

    def distance(self, number: int, place: Place) -> Distance:
        """Return the distance from a whole body, px."""
        away = [hull_distance(hull) for hull in self.hulls(number, place)]
        first, last = self.pieces.edge_first[(element := int(self.pieces.element[number])) : element + 2].tolist()
        if len(away) == 1:
            return away[0]

        def nearest(x: FloatArray, y: FloatArray) -> FloatArray:
            return np.asarray(np.minimum.reduce([each(x, y) for each in away]))

        if first == last:  # of too many pieces there is no outline
            return nearest
        edge = outline_distance(self.pieces.edge[first:last])
        cos, sin = math.cos(place.angle) / place.scale, math.sin(place.angle) / place.scale

        def whole(x: FloatArray, y: FloatArray) -> FloatArray:
            right, up = x - place.x, place.y - y
            near = place.scale * edge(cos * right + sin * up, cos * up - sin * right)
            return np.asarray(np.where(nearest(x, y) <= SEAM, -near, near))

        return whole

    def within(self, number: int, place: Place, margin: float = 1.0) -> tuple[float, float, float, float]:
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


def _girths(pieces: Pieces) -> FloatArray:
    """Return half of how thick each body is about, (N,) m: that of its thickest piece, area by half its perimeter."""
    start = pieces.first[:-1]
    count = np.diff(pieces.first)
    following = np.arange(len(pieces.corner)) + 1
    following[pieces.first[1:] - 1] = start
    a, b = pieces.corner, pieces.corner[following]
    twice = np.add.reduceat(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], start) if len(start) else np.empty(0)
    around = np.add.reduceat(np.hypot(*(b - a).T), start) if len(start) else np.empty(0)
    girth = pieces.radius + np.where(count > 2, twice / np.maximum(around, 1e-300), 0.0)
    thickest = np.zeros(len(pieces.element))
    np.maximum.at(thickest, np.repeat(np.arange(len(pieces.element)), np.diff(pieces.piece)), girth)
    return thickest
