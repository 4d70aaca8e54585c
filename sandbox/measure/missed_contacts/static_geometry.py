"""Static geometry of a scene, and the moving circles that passed through it undetected."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.measure.missed_contacts.contact_history import ContactHistory
from sandbox.measure.missed_contacts.swept_geometry import (
    CLEAR,
    DEEP,
    JUMP,
    TOLERANCE,
    approaching,
    closest_to_segment,
    dot,
)
from sandbox.scene.compile.filters import FilterTable, fixed_layers
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BACKING, Point
from sandbox.scene.description.fixed import Plane, Post, Wall
from sandbox.scene.geometry.vectors import offset_from_segment

PLANE_ROUNDING = 1e-11
"""m: smallest tolerance at planes. Engines build planes from shapes of kilometres, whose rounding is 3e-13 m."""

CHUNK = 1 << 18
"""Circles × obstacles that are examined together, which bounds memory."""


@dataclass(frozen=True, eq=False)
class SweptCircles:
    """Paths of F circles, each in one substep."""

    when: IntArray
    """(F,) index of the substep"""
    body: IntArray
    """(F,) index of the body"""
    start: FloatArray
    """(F, 2) m, finite"""
    end: FloatArray
    """(F, 2) m"""
    radius: FloatArray
    """(F,) m"""
    on: IntArray | None = None
    """(F,) layer throughout the substep as a bit; None if there is a single layer"""

    def some(self, which: IntArray) -> Self:
        """Return the paths with some indices."""
        on, radius = None if self.on is None else self.on[which], self.radius[which]
        return type(self)(self.when[which], self.body[which], self.start[which], self.end[which], radius, on)


@dataclass(frozen=True, eq=False)
class StaticGeometry:
    """Planes, and walls and posts as segments with round ends; a post is a segment of length 0."""

    point: FloatArray
    """(L, 2) of each plane, m"""
    normal: FloatArray
    """(L, 2) unit normal of each plane, out of the solid"""
    tail: FloatArray
    """(S, 2) of each segment, m"""
    along: FloatArray
    """(S, 2) m from the tail of each segment to its head"""
    half: FloatArray
    """(S,) m, half the thickness"""
    number: IntArray
    """(S,) index of the static object of each segment, −1 − k"""
    plane_layers: IntArray
    """(L,) layers of each plane as bits"""
    layers: IntArray
    """(S,) layers of each segment as bits"""

    @classmethod
    def of(cls, scene: Scene) -> Self:
        """Collect the static objects of a scene, without those that are not solid or are one-way walls."""
        normal = _rows([plane.normal for plane in scene.planes])
        normal /= np.abs(normal).max(axis=1, keepdims=True, initial=0.0)  # normals can have any length, also 1e±300
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
        masks = fixed_layers(scene)
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

    def missed(
        self, paths: SweptCircles, history: ContactHistory, filters: FilterTable | None = None
    ) -> tuple[IntArray, IntArray]:
        """Return substeps (M,) and pairs (M, 2) that missed a contact, as `Audit` defines it.

        Args:
            paths: paths of the circles.
            history: contacts that the engine found; entry k precedes substep k.
            filters: of the bodies and static objects, if some belong to collision categories.
        """
        found = [(np.empty(0, np.int64), np.empty((0, 2), np.int64))]
        parts = len(paths.body) * max(len(self.point), len(self.tail)) // CHUNK + 1
        for part in np.array_split(np.arange(len(paths.body)), parts):
            if len(part) and len(self.point):
                found.append(self._planes(paths.some(part), history, filters))
            if len(part) and len(self.tail):
                found.append(self._walls(paths.some(part), history, filters))
        return np.concatenate([when for when, _ in found]), np.concatenate([pair for _, pair in found])

    def _planes(
        self, paths: SweptCircles, history: ContactHistory, filters: FilterTable | None
    ) -> tuple[IntArray, IntArray]:
        # Most bodies clearly end above; one product finds them, with more rounding.
        above = paths.end @ self.normal.T - dot(self.point, self.normal)
        rounding = 1e-12 * (np.abs(paths.end).max() + np.abs(self.point).max())
        paths = paths.some(np.flatnonzero((above < (paths.radius + rounding)[:, None]).any(axis=1)))

        first = dot(paths.start[:, None] - self.point, self.normal)
        last = dot(paths.end[:, None] - self.point, self.normal)
        tolerance = np.maximum(TOLERANCE * paths.radius, PLANE_ROUNDING)
        entered = first >= (paths.radius - tolerance / 2)[:, None]
        entered &= last < (paths.radius - tolerance)[:, None]
        move = paths.end - paths.start
        entered &= (dot(move, move) >= (JUMP * paths.radius) ** 2)[:, None]
        if paths.on is not None:
            entered &= (paths.on[:, None] & self.plane_layers) != 0
        if filters is not None:
            entered &= filters.share_categories_with_fixed(paths.body[:, None], np.arange(len(self.point)))
        i, plane = np.nonzero(entered)
        when, pair = paths.when[i], np.column_stack((paths.body[i], -1 - plane))
        in_time = history.found(when + 1, pair) & (last[i, plane] >= -BACKING)
        missed = ~in_time & ~history.found(when, pair)
        return when[missed], pair[missed]

    def _walls(
        self, paths: SweptCircles, history: ContactHistory, filters: FilterTable | None
    ) -> tuple[IntArray, IntArray]:
        i, s = self._in_reach(paths, filters)
        tail, along, contact = self.tail[s], self.along[s], paths.radius[i] + self.half[s]
        here, there = paths.start[i], paths.end[i]
        nearest2, crossed = closest_to_segment(here, there, tail, along)
        deep = nearest2 < (DEEP * contact) ** 2
        if not deep.any():
            return np.empty(0, np.int64), np.empty((0, 2), np.int64)

        first = offset_from_segment(here, tail, along)
        first2 = dot(first, first)
        last = offset_from_segment(there, tail, along)
        approached = (dot(last, last) < contact**2) & approaching(last, there - here)
        apart = first2 >= (CLEAR * contact) ** 2

        # From segments to objects: rows of one path and one wall share an index.
        both, group = np.unique(np.column_stack((i, self.number[s])), axis=0, return_inverse=True)
        group, count = group.reshape(-1), len(both)
        when, pair = paths.when[both[:, 0]], np.column_stack((paths.body[both[:, 0]], both[:, 1]))
        known = history.found(when, pair)
        nearest = np.full(count, np.inf)
        np.minimum.at(nearest, group, first2)

        # A contact at the start is with the nearest segments, unless the body has bounced off another one.
        touched = first2 <= ((1.0 + TOLERANCE) * contact) ** 2
        rested = known[group] & touched & (first2 <= nearest[group] + TOLERANCE * contact**2)
        through = _any(crossed & apart & ~rested, group, count)
        entered = _any(deep, group, count) & ~_any(~apart, group, count) & ~known
        in_time = history.found(when + 1, pair) & _any(approached, group, count)
        missed = through | (entered & ~in_time)
        return when[missed], pair[missed]

    def _in_reach(self, paths: SweptCircles, filters: FilterTable | None) -> tuple[IntArray, IntArray]:
        """Return paths and segments, (K,) each, that can be in contact on a path that can skip a test."""
        middle = self.tail + 0.5 * self.along
        size = 0.5 * np.sqrt(dot(self.along, self.along)) + self.half
        move = paths.end - paths.start
        length2 = dot(move, move)
        mean = paths.start + 0.5 * move
        across, up = (mean[:, axis, None] - middle[:, axis] for axis in (0, 1))
        reach = (paths.radius + 0.5 * np.sqrt(length2))[:, None] + size
        is_near = across * across + up * up <= reach * reach * (1 + 1e-9)  # rounding must not hide a pair
        is_near &= length2[:, None] >= (JUMP * (paths.radius[:, None] + self.half)) ** 2
        if paths.on is not None:
            is_near &= (paths.on[:, None] & self.layers) != 0
        if filters is not None:
            is_near &= filters.share_categories_with_fixed(paths.body[:, None], -1 - self.number)
        i, s = np.nonzero(is_near)
        first = offset_from_segment(paths.start[i], self.tail[s], self.along[s])
        reach = paths.radius[i] + self.half[s] + np.sqrt(length2[i])
        close = dot(first, first) <= reach * reach
        return i[close], s[close]


def _any(condition: BoolArray, group: IntArray, count: int) -> BoolArray:
    """Return for which of `count` groups any condition holds."""
    return np.asarray(np.bincount(group[condition], minlength=count) > 0)


def _rows(pairs: list[tuple[float, float]]) -> FloatArray:
    return np.asarray(pairs, dtype=np.float64).reshape(-1, 2)
