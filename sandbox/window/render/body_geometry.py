"""Outlines: what is seen of the edges of a body of several pieces, those that lie inside another piece left out.

An outline is sides and arcs. With it the distance from the whole body is known, and no seam shows where pieces
overlap or abut.

Anatomy: the pieces and outlines of a scene's bodies, as drawing needs them; it lasts as long as the bodies do.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.geometry.shapes import form_of
from sandbox.window.hit_test import Distance, Hull, hull_distance, segment_distance

Convex = tuple[tuple[tuple[float, float], ...], float]
"""Corners, counter-clockwise, and radius, m."""

ARC = 96
"""Chords of a full circle by which arcs are cut off."""
SAME = 1e-7
"""share of a body's size within which edges lie on each other"""
MOST_PIECES = 200
"""of a body; one of more has no outline, as working it out takes their square"""
WIDTH = 7
"""Figures of a side: 0, its two ends, 0, 0; of an arc: 1, centre, radius, direction of its middle, cosine of half."""


@dataclass(frozen=True, eq=False)
class UnionOutline:
    """The outlines of all elements of a scene, E of them; of those of one piece they are empty."""

    first: IntArray
    """(E + 1,) row of each one's first"""
    edge: FloatArray
    """(P, `WIDTH`) in the frame of the body, m"""


def union_outlines(bodies: Bodies) -> UnionOutline:
    """Return the outlines of a scene's elements."""
    every = []
    for element in bodies.elements:
        pieces = form_of(element).pieces
        every.append(outline(tuple((piece.corners, piece.radius) for piece in pieces)))
    counts = [len(each) for each in every]
    edges = np.concatenate(every) if every else np.empty((0, WIDTH))
    return UnionOutline(np.concatenate(([0], np.cumsum(counts, dtype=np.int64))), edges)


@lru_cache(maxsize=1024)
def outline(pieces: tuple[Convex, ...]) -> FloatArray:
    """Return the outline of a body, (P, `WIDTH`); of one piece, or of too many, none."""
    rows: list[tuple[float, ...]] = []
    if not 1 < len(pieces) <= MOST_PIECES:
        return np.empty((0, WIDTH))
    size = max(max(map(abs, corner)) + radius for corners, radius in pieces for corner in corners)
    for k, (corners, radius) in enumerate(pieces):
        sides = list(pairwise((*corners, corners[0]))) if len(corners) > 1 else []
        ways = [_way(a, b) for a, b in sides]
        for (a, b), (x, y) in zip(sides, ways, strict=True):
            a, b = (a[0] + y * radius, a[1] - x * radius), (b[0] + y * radius, b[1] - x * radius)
            for low, high in _left(a, b, k, pieces, SAME * size):
                rows.append((0.0, *_along(a, b, low), *_along(a, b, high), 0.0, 0.0))
        if radius > 0.0:
            for j, corner in enumerate(corners):
                start, turn = _corner_arc(ways, j)
                rows += _arcs(corner, radius, start, turn, k, pieces, SAME * size)
    return np.asarray(rows).reshape(-1, WIDTH)


def outline_distance(edge: FloatArray) -> Distance:
    """Return the distance from an outline (P, `WIDTH`), never negative, in its own units."""
    parts = [
        segment_distance((row[1:3], row[3:5])) if row[0] == 0.0 else _arc_distance(row[1:]) for row in edge.tolist()
    ]
    return lambda px, py: np.asarray(np.minimum.reduce([part(px, py) for part in parts]))


def _arc_distance(figures: list[float]) -> Distance:
    """Return the distance from an arc, inf beside its ends: what ends there is nearer."""
    cx, cy, radius, right, up, half = figures

    def distance(px: FloatArray, py: FloatArray) -> FloatArray:
        x, y = px - cx, py - cy
        length = np.sqrt(x * x + y * y)
        return np.where(x * right + y * up >= length * half, np.abs(length - radius), np.inf)

    return distance


def _way(a: tuple[float, float], b: tuple[float, float]) -> tuple[float, float]:
    length = max(math.dist(a, b), 1e-300)
    return (b[0] - a[0]) / length, (b[1] - a[1]) / length


def _along(a: tuple[float, float], b: tuple[float, float], share: float) -> tuple[float, float]:
    return a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share


def _corner_arc(ways: list[tuple[float, float]], j: int) -> tuple[float, float]:
    """Return where the arc around a corner begins and how far it goes, rad."""
    if not ways:
        return -math.pi, 2.0 * math.pi
    (px, py), (nx, ny) = ways[j - 1], ways[j]
    start = math.atan2(-px, py)
    turn = (math.atan2(-nx, ny) - start) % (2.0 * math.pi)
    return start, turn


def _arcs(
    centre: tuple[float, float],
    radius: float,
    start: float,
    turn: float,
    own: int,
    pieces: tuple[Convex, ...],
    same: float,
) -> list[tuple[float, ...]]:
    """Return what is left of an arc, chord by chord, joined again where chords follow one another."""
    count = max(math.ceil(turn / (2.0 * math.pi) * ARC), 1)
    spots = [start + turn * k / count for k in range(count + 1)]
    points = [(centre[0] + radius * math.cos(s), centre[1] + radius * math.sin(s)) for s in spots]
    runs: list[list[float]] = []
    for k, (a, b) in enumerate(pairwise(points)):
        for low, high in _left(a, b, own, pieces, same):
            first, last = spots[k] + low * turn / count, spots[k] + high * turn / count
            if runs and first - runs[-1][1] < 1e-9:
                runs[-1][1] = last
            else:
                runs.append([first, last])
    rows: list[tuple[float, ...]] = []
    for first, last in runs:
        middle, half = 0.5 * (first + last), 0.5 * (last - first)
        rows.append((1.0, *centre, radius, math.cos(middle), math.sin(middle), math.cos(min(half, math.pi))))
    return rows


def _left(
    a: tuple[float, float], b: tuple[float, float], own: int, pieces: tuple[Convex, ...], same: float
) -> list[tuple[float, float]]:
    """Return the shares of a segment of piece `own` that lie in no other piece."""
    left = [(0.0, 1.0)]
    for k, piece in enumerate(pieces):
        if k == own or not left:
            continue
        low, high = _within(a, b, piece, same, k < own)
        if low < high:
            cut = [part for p, q in left for part in ((p, min(q, low)), (max(p, high), q))]
            left = [(p, q) for p, q in cut if q - p > 1e-9]
    return left


def _within(
    a: tuple[float, float], b: tuple[float, float], piece: Convex, same: float, yields: bool
) -> tuple[float, float]:
    """Return the shares of a segment between which it lies in a piece; low ≥ high where it does not.

    A widened hull is its core, a strip about each side and a disc about each corner; a line meets it in one interval,
    from the first of what it meets of these to the last.
    """
    corners, radius = piece
    found = []
    if len(corners) > 2:
        found.append(_in_polygon(a, b, corners, same, yields))
    if radius > 0.0:
        found += [_in_disc(a, b, corner, radius) for corner in corners]
        for p, q in pairwise((*corners, corners[0])) if len(corners) > 1 else ():
            x, y = _way(p, q)
            x, y = x * radius, y * radius
            strip = ((p[0] + y, p[1] - x), (q[0] + y, q[1] - x), (q[0] - y, q[1] + x), (p[0] - y, p[1] + x))
            found.append(_in_polygon(a, b, strip, same, yields))
    met = [part for part in found if part[0] < part[1]]
    return (min(p for p, _ in met), max(q for _, q in met)) if met else (1.0, 0.0)


def _in_polygon(
    a: tuple[float, float],
    b: tuple[float, float],
    corners: tuple[tuple[float, float], ...],
    same: float,
    yields: bool,
) -> tuple[float, float]:
    """Clip a segment by the sides of a polygon, as Cyrus and Beck did, 1978.

    Of two edges on one line, that look the same way, the one that does not yield is seen; that look at each other,
    none.
    """
    low, high = 0.0, 1.0
    way = b[0] - a[0], b[1] - a[1]
    for p, q in pairwise((*corners, corners[0])):
        x, y = _way(p, q)
        from_a = (a[0] - p[0]) * y - (a[1] - p[1]) * x
        from_b = (b[0] - p[0]) * y - (b[1] - p[1]) * x
        if abs(from_a) <= same and abs(from_b) <= same and way[0] * x + way[1] * y > 0.0 and not yields:
            return 1.0, 0.0
        if from_a > same and from_b > same:
            return 1.0, 0.0
        if from_a > same:
            low = max(low, (from_a - same) / (from_a - from_b))
        elif from_b > same:
            high = min(high, (same - from_a) / (from_b - from_a))
    return low, high


def _in_disc(
    a: tuple[float, float], b: tuple[float, float], centre: tuple[float, float], radius: float
) -> tuple[float, float]:
    x, y, dx, dy = a[0] - centre[0], a[1] - centre[1], b[0] - a[0], b[1] - a[1]
    squared, half = max(dx * dx + dy * dy, 1e-300), x * dx + y * dy
    under = half * half - squared * (x * x + y * y - radius * radius)
    if under <= 0.0:
        return 1.0, 0.0
    root = math.sqrt(under)
    return max((-half - root) / squared, 0.0), min((-half + root) / squared, 1.0)


SEAM = 1e-3
"""px: what is no farther from a piece lies in it, so that no seam shows where two abut"""


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
    element: IntArray
    """(N,)"""
    edge_first: IntArray
    """(E + 1,) where the outline of each element begins"""
    edge: FloatArray
    """(P, 7), see `outlines`"""


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
        shapes, outlines = bodies.shapes, union_outlines(bodies)
        self.pieces = ConvexPieces(
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
    thickest = np.zeros(len(pieces.element))
    np.maximum.at(thickest, np.repeat(np.arange(len(pieces.element)), np.diff(pieces.piece)), girth)
    return thickest
