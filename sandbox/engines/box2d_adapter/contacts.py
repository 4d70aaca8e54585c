"""The pairs of objects that touch in a Box2D world, kept up to date by its events.

Box2D reports the pairs of shapes that begin and cease to touch, one Python object each. The arrays of all present pairs
are changed only where they differ, as in a pile thousands of pairs last while a few begin or end in a step.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, ComplexArray, IntArray
from sandbox.engines.common.contact_log import NO_CONTACTS, ContactBatch

FIRST = 32
"""Bits of a key below those of the first object"""
SECOND = (1 << FIRST) - 1


class PairArrays(NamedTuple):
    """K touching pairs, by ascending key."""

    key: IntArray
    """(K,) user data of both shapes: that of the first, shifted by `FIRST`, and of the second"""
    normal: ComplexArray
    """(K,) unit normal from the first to the second"""
    point: ComplexArray
    """(K,) m, first point of contact when the pair began to touch"""


class TouchingPairs:
    """The touching pairs of objects, each of one or several shapes.

    Objects are addressed by the user data of their shapes: body indices, shifted to start at `first`.
    """

    def __init__(self, first: int, scale: float) -> None:
        """Create without pairs.

        Args:
            first: user data of the body with index 0; static colliders have smaller ones.
            scale: Box2D's lengths in a metre.
        """
        self._first, self._scale = first, scale
        self._shapes: dict[int, int] = {}  # number of touching pairs of shapes, by key
        self._added: dict[int, tuple[complex, complex]] = {}  # normal and point, by key
        self._ended: set[int] = set()  # keys
        self._arrays = PairArrays(np.empty(0, np.int64), *(np.empty(0, np.complex128) for _ in range(2)))
        self._batch: ContactBatch | None = NO_CONTACTS

    def update(self, events: Any) -> None:
        """Update by the contact events of a step."""
        self._batch = None
        shapes = self._shapes
        for event in events.begin_events():
            key = (event.shape_a.user_data << FIRST) | event.shape_b.user_data
            known = shapes.get(key)
            if known is not None:
                shapes[key] = known + 1
                continue
            shapes[key] = 1
            manifold = event.manifold
            normal, point = manifold.normal, next(iter(manifold.points())).point
            self._added[key] = complex(normal.x, normal.y), complex(point.x, point.y) / self._scale
        for event in events.end_events():
            a, b = event.shape_a, event.shape_b
            if a is None or b is None:  # destroyed
                continue
            key = (a.user_data << FIRST) | b.user_data
            shapes[key] -= 1
            if not shapes[key]:
                self._end(key)

    def remove(self, indices: set[int]) -> None:
        """End the contacts of bodies or, with −1 − k, of static colliders. Their end events have no shapes."""
        numbers, self._batch = {index + self._first for index in indices}, None
        for key in [key for key in self._shapes if key >> FIRST in numbers or key & SECOND in numbers]:
            self._end(key)

    def _end(self, key: int) -> None:
        del self._shapes[key]
        if self._added.pop(key, None) is None:
            self._ended.add(key)

    def batch(self) -> ContactBatch:
        """Return the present contacts. Box2D does not report their impulses, which are nan."""
        if self._batch is None:
            self._apply_changes()
            key, normal, point = self._arrays
            unknown: ComplexArray = np.full(len(key), complex(math.nan, math.nan))
            a, b = (key >> FIRST) - self._first, (key & SECOND) - self._first
            self._batch = ContactBatch(a, b, unknown, normal, point)
        return self._batch

    def _apply_changes(self) -> None:
        """Change the arrays by the pairs that have begun and ended since the last call."""
        arrays = self._arrays
        if self._ended:
            kept: BoolArray = np.ones(len(arrays.key), np.bool_)
            kept[np.searchsorted(arrays.key, sorted(self._ended))] = False
            arrays = PairArrays(arrays.key[kept], arrays.normal[kept], arrays.point[kept])
        if self._added:
            added = sorted(self._added)
            places = np.searchsorted(arrays.key, added)
            normals, points = zip(*(self._added[key] for key in added), strict=True)
            arrays = PairArrays(
                np.insert(arrays.key, places, added),
                np.insert(arrays.normal, places, normals),
                np.insert(arrays.point, places, points),
            )
        self._arrays = arrays
        self._added, self._ended = {}, set()
