"""Obstacles: the fixed things of a scene, and which moving circles an engine let through them."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.measure.audit.looks import Looks
from sandbox.measure.audit.sweep import (
    CLEAR,
    DEEP,
    JUMP,
    TOLERANCE,
    approaching,
    closest_to_segment,
    dot,
    from_segment,
)
from sandbox.scene.description.base import BACKING, Point
from sandbox.scene.description.fixed import Plane, Post, Wall, mask_of
from sandbox.scene.scene import Scene

PLANE_ROUNDING = 1e-11
"""m: the tolerance at planes is no less; engines make them of shapes kilometres large, which round at 3e-13 m."""

CHUNK = 1 << 18
"""Circles × obstacles looked at together: bounds memory."""


@dataclass(frozen=True, eq=False)
class Paths:
    """Where F circles went in one substep each."""

    when: IntArray
    """(F,) the substep"""
    who: IntArray
    """(F,) number of the body"""
    start: FloatArray
    """(F, 2) m, finite"""
    end: FloatArray
    """(F, 2) m"""
    radius: FloatArray
    """(F,) m"""
    on: IntArray | None = None
    """(F,) the layers on which each was all the while, as bits; none where there is one alone"""

    def some(self, which: IntArray) -> Self:
        """Return some of them."""
        on, radius = None if self.on is None else self.on[which], self.radius[which]
        return type(self)(self.when[which], self.who[which], self.start[which], self.end[which], radius, on)


@dataclass(frozen=True, eq=False)
class Obstacles:
    """The planes, and the walls and posts as segments with round ends: a post is a segment of no length."""

    point: FloatArray
    """(L, 2) of each plane, m"""
    normal: FloatArray
    """(L, 2) of each plane, unit, out of the solid"""
    tail: FloatArray
    """(S, 2) of each segment, m"""
    along: FloatArray
    """(S, 2) from its tail to its head, m"""
    half: FloatArray
    """(S,) half its thickness, m"""
    number: IntArray
    """(S,) the fixed thing that it is part of, −1 − k"""
    plane_layers: IntArray
    """(L,) the layers of each plane, as bits"""
    layers: IntArray
    """(S,) the layers of each segment, as bits"""

    @classmethod
    def of(cls, scene: Scene) -> Self:
        """Gather a scene's fixed things, but those that are not solid, or let pass from one side: they miss nothing."""
        normal = _rows([plane.normal for plane in scene.planes])
        normal /= np.abs(normal).max(axis=1, keepdims=True, initial=0.0)  # any length may be given: 1e±300 too
        rows: list[tuple[float, ...]] = []
        half: list[float] = []
        number: list[int] = []
        line: tuple[Point, ...]
        for k, thing in enumerate(scene.fixed):
            if isinstance(thing, Plane) or not thing.solid or (isinstance(thing, Wall) and thing.one_way):
                continue
            if isinstance(thing, Post):
                line, width = (thing.position, thing.position), thing.radius
            else:
                line, width = thing.points + thing.points[: thing.closed], thing.thickness / 2
            rows += [(*a, *b) for a, b in pairwise(line)]
            half += [width] * (len(line) - 1)
            number += [-1 - k] * (len(line) - 1)
        masks = np.asarray([mask_of(thing.layers, scene.layers) for thing in scene.fixed], dtype=np.int64)
        things = -1 - np.asarray(number, dtype=np.int64)
        ends = np.asarray(rows, dtype=np.float64).reshape(-1, 4)
        return cls(
            point=_rows([plane.point for plane in scene.planes]),
            normal=normal / np.sqrt(dot(normal, normal))[:, None],
            tail=ends[:, :2],
            along=ends[:, 2:] - ends[:, :2],
            half=np.asarray(half, dtype=np.float64),
            number=np.asarray(number, dtype=np.int64),
            plane_layers=masks[: len(scene.planes)],
            layers=masks[things],
        )

    def __len__(self) -> int:
        return len(self.point) + len(self.tail)

    def missed(self, paths: Paths, looks: Looks) -> tuple[IntArray, IntArray]:
        """Return when (M,) which pairs (M, 2) were missed, as `Audit` defines it; look k precedes substep k."""
        found = [(np.empty(0, np.int64), np.empty((0, 2), np.int64))]
        parts = len(paths.who) * max(len(self.point), len(self.tail)) // CHUNK + 1
        for part in np.array_split(np.arange(len(paths.who)), parts):
            if len(part) and len(self.point):
                found.append(self._planes(paths.some(part), looks))
            if len(part) and len(self.tail):
                found.append(self._walls(paths.some(part), looks))
        return np.concatenate([when for when, _ in found]), np.concatenate([pair for _, pair in found])

    def _planes(self, paths: Paths, looks: Looks) -> tuple[IntArray, IntArray]:
        # Of most bodies it is plain that they end above; that is found in one product, if with more rounding.
        above = paths.end @ self.normal.T - dot(self.point, self.normal)
        rounding = 1e-12 * (np.abs(paths.end).max() + np.abs(self.point).max())
        paths = paths.some(np.flatnonzero((above < (paths.radius + rounding)[:, None]).any(axis=1)))

        first = dot(paths.start[:, None] - self.point, self.normal)
        last = dot(paths.end[:, None] - self.point, self.normal)
        tolerance = np.maximum(TOLERANCE * paths.radius, PLANE_ROUNDING)
        came_in = first >= (paths.radius - tolerance / 2)[:, None]
        came_in &= last < (paths.radius - tolerance)[:, None]
        move = paths.end - paths.start
        came_in &= (dot(move, move) >= (JUMP * paths.radius) ** 2)[:, None]
        if paths.on is not None:
            came_in &= (paths.on[:, None] & self.plane_layers) != 0
        i, plane = np.nonzero(came_in)
        when, pair = paths.when[i], np.column_stack((paths.who[i], -1 - plane))
        in_time = looks.found(when + 1, pair) & (last[i, plane] >= -BACKING)
        missed = ~in_time & ~looks.found(when, pair)
        return when[missed], pair[missed]

    def _walls(self, paths: Paths, looks: Looks) -> tuple[IntArray, IntArray]:
        i, s = self._in_reach(paths)
        tail, along, contact = self.tail[s], self.along[s], paths.radius[i] + self.half[s]
        here, there = paths.start[i], paths.end[i]
        nearest2, crossed = closest_to_segment(here, there, tail, along)
        deep = nearest2 < (DEEP * contact) ** 2
        if not deep.any():
            return np.empty(0, np.int64), np.empty((0, 2), np.int64)

        first = from_segment(here, tail, along)
        first2 = dot(first, first)
        last = from_segment(there, tail, along)
        approached = (dot(last, last) < contact**2) & approaching(last, there - here)
        apart = first2 >= (CLEAR * contact) ** 2

        # From segments to things: rows of one path and one wall share a place.
        both, place = np.unique(np.column_stack((i, self.number[s])), axis=0, return_inverse=True)
        place, count = place.reshape(-1), len(both)
        when, pair = paths.when[both[:, 0]], np.column_stack((paths.who[both[:, 0]], both[:, 1]))
        known = looks.found(when, pair)
        nearest = np.full(count, np.inf)
        np.minimum.at(nearest, place, first2)

        # A contact at the start was with the nearest segment, or with those as near.
        held = known[place] & (first2 <= nearest[place] + TOLERANCE * contact**2)
        through = _any(crossed & apart & ~held, place, count)
        came_in = _any(deep, place, count) & ~_any(~apart, place, count) & ~known
        in_time = looks.found(when + 1, pair) & _any(approached, place, count)
        missed = through | (came_in & ~in_time)
        return when[missed], pair[missed]

    def _in_reach(self, paths: Paths) -> tuple[IntArray, IntArray]:
        """Return the paths and segments, (K,) each, that may meet, where the path can skip a look."""
        middle = self.tail + 0.5 * self.along
        size = 0.5 * np.sqrt(dot(self.along, self.along)) + self.half
        move = paths.end - paths.start
        length2 = dot(move, move)
        mean = paths.start + 0.5 * move
        across, up = (mean[:, axis, None] - middle[:, axis] for axis in (0, 1))
        reach = (paths.radius + 0.5 * np.sqrt(length2))[:, None] + size
        near = across * across + up * up <= reach * reach * (1 + 1e-9)  # rounding must not hide a pair
        near &= length2[:, None] >= (JUMP * (paths.radius[:, None] + self.half)) ** 2
        if paths.on is not None:
            near &= (paths.on[:, None] & self.layers) != 0
        i, s = np.nonzero(near)
        first = from_segment(paths.start[i], self.tail[s], self.along[s])
        reach = paths.radius[i] + self.half[s] + np.sqrt(length2[i])
        close = dot(first, first) <= reach * reach
        return i[close], s[close]


def _any(condition: BoolArray, place: IntArray, count: int) -> BoolArray:
    """Return for which of `count` places any condition holds."""
    return np.asarray(np.bincount(place[condition], minlength=count) > 0)


def _rows(pairs: list[tuple[float, float]]) -> FloatArray:
    return np.asarray(pairs, dtype=np.float64).reshape(-1, 2)
