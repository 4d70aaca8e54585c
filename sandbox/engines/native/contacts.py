"""ContactLedger: one row for each contact, from arbiters that pymunk shows anew after every substep."""

from collections.abc import Callable

import numpy as np

from sandbox.engines.contract import Exhaustion
from sandbox.trajectory import BoolArray, Contacts, FloatArray, IntArray

MAX_ROWS = 20_000_000
"""Rows kept before a run is stopped: 1.6 GB."""

Places = Callable[[], tuple[FloatArray, FloatArray]]


class ContactLedger:
    """Contacts since the last `take`. One that lasts is one row, its impulse summed."""

    def __init__(self) -> None:
        self._count = 0
        self._time: FloatArray = np.empty(256)
        self._pair: IntArray = np.empty((256, 2), np.int64)
        self._vectors: FloatArray = np.empty((256, 6))  # point, normal, impulse
        self._key: IntArray = np.empty(0, np.int64)
        self._row: IntArray = np.empty(0, np.int64)
        self._shared = False  # whether two arbiters belong to one row

    def record(self, time: float, a: IntArray, b: IntArray, on_a: FloatArray, places: Places) -> None:
        """Enter what touches at a time.

        Args:
            time: s.
            a: (K,) one of each pair's bodies; fixed things are negative.
            b: (K,) the other.
            on_a: (K, 2) impulse that `a` got in the last substep, N·s.
            places: returns normals (a to b) and points, (K, 2) each; asked only if a contact is new.
        """
        swapped = (a < 0) | ((b >= 0) & (b < a))
        first, second = np.where(swapped, b, a), np.where(swapped, a, b)
        impulse = np.where(swapped[:, None], on_a, -on_a)  # given by the first to the second
        key = (first << 32) + second
        if np.array_equal(key, self._key):  # a settled scene: the same contacts in the same order
            self._add(self._row, impulse)
            return

        row = self._known_rows(key)
        new = np.flatnonzero(row < 0)
        if len(new):
            # A polyline's joint shows as two arbiters of one pair: one contact.
            _, leader, group = np.unique(key[new], return_index=True, return_inverse=True)
            rank = np.argsort(np.argsort(leader))  # rows in the order in which pymunk shows them
            row[new] = self._count + rank[group.reshape(-1)]
            opening = new[np.sort(leader)]
            normal, point = places()
            self._open(time, first[opening], second[opening], point[opening], normal[opening], swapped[opening])
        self._key, self._row = key, row
        self._shared = len(np.unique(row)) < len(row)
        self._add(row, impulse)

    def _add(self, row: IntArray, impulse: FloatArray) -> None:
        if self._shared:
            np.add.at(self._vectors[:, 4:6], row, impulse)
        else:
            self._vectors[row, 4:6] += impulse

    def _known_rows(self, key: IntArray) -> IntArray:
        """Return the row of each contact that was there a substep ago, −1 for the others."""
        if not len(self._key):
            return np.full(len(key), -1, np.int64)
        order = np.argsort(self._key)
        at = np.minimum(np.searchsorted(self._key, key, sorter=order), len(order) - 1)
        found = order[at]
        return np.where(self._key[found] == key, self._row[found], -1)

    def _open(
        self,
        time: float,
        first: IntArray,
        second: IntArray,
        point: FloatArray,
        normal: FloatArray,
        swapped: BoolArray,
    ) -> None:
        end = self._count + len(first)
        if end > MAX_ROWS:
            raise Exhaustion(f"more than {MAX_ROWS:,} contacts in one run")
        if end > len(self._time):
            size = max(2 * len(self._time), end)
            self._time = np.resize(self._time, size)
            self._pair = np.resize(self._pair, (size, 2))
            self._vectors = np.resize(self._vectors, (size, 6))
        rows = slice(self._count, end)
        self._time[rows] = time
        self._pair[rows] = np.column_stack((first, second))
        self._vectors[rows, 0:2] = point
        self._vectors[rows, 2:4] = np.where(swapped[:, None], -normal, normal)
        self._vectors[rows, 4:6] = 0.0
        self._count = end

    def pairs(self) -> IntArray:
        """Return the pairs (K, 2) that touched when last recorded."""
        return self._pair[self._row]

    def take(self) -> Contacts:
        """Return the contacts that were open since the last call, and forget those that have ended."""
        n = self._count
        point, normal, impulse = (self._vectors[:n, k : k + 2].copy() for k in (0, 2, 4))
        taken = Contacts(self._time[:n].copy(), self._pair[:n].copy(), point, normal, impulse)
        lasting = np.unique(self._row)
        self._row = np.searchsorted(lasting, self._row)
        self._count = len(lasting)
        self._time[: self._count] = taken.time[lasting]
        self._pair[: self._count] = taken.pair[lasting]
        self._vectors[: self._count] = self._vectors[lasting]
        self._vectors[: self._count, 4:6] = 0.0
        return taken
