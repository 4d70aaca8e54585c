"""ContactLedger: one row for each contact, from arbiters that pymunk shows anew after every substep."""

import numpy as np

from sandbox.engines.contract import Exhaustion
from sandbox.engines.native.memory import PartedMemory
from sandbox.engines.native.rows import RowTable
from sandbox.trajectory import BoolArray, Contacts, FloatArray, IntArray

MAX_ROWS = 20_000_000
"""Rows kept before a run is stopped: 1.6 GB."""


class ContactLedger:
    """Contacts since the last `take`. One that lasts is one row, its impulse summed."""

    def __init__(self, things: int, joints: bool, persistence: int) -> None:
        """Start empty.

        Args:
            things: how many fixed things there are.
            joints: whether a pair can show as several arbiters, as a ball in the corner of a polyline does.
            persistence: substeps for which pymunk remembers a parted contact.
        """
        self._things, self._joints = things, joints
        self._rows = RowTable()
        self._count = 0
        self._time: FloatArray = np.empty(256)
        self._pair: IntArray = np.empty((256, 2), np.int64)
        self._vectors: FloatArray = np.empty((256, 6))  # point, normal, impulse
        self._row: IntArray = np.empty(0, np.int64)  # of what touches now
        self._memory = PartedMemory(persistence)
        self._last = np.empty((0, 2)), np.empty((0, 2))  # impulses and normals, as pymunk reported them

    def record(
        self, time: float, a: IntArray, b: IntArray, impulse: FloatArray, normal: FloatArray, point: FloatArray
    ) -> None:
        """Enter what touches at a time.

        Args:
            time: s.
            a: (K,) one of each pair's bodies; fixed things are negative.
            b: (K,) the other.
            impulse: (K, 2) that `a` got in the last substep, N·s.
            normal: (K, 2) from `a` to `b`.
            point: (K, 2) m.
        """
        self._memory.forget_and_advance()
        if not len(a) and not len(self._row):
            return
        swapped = (a < 0) | ((b >= 0) & (b < a))
        first, second = np.where(swapped, b, a), np.where(swapped, a, b)
        # Fixed things, −1 − k, become 0 … F − 1, and bodies follow them: small whole numbers for the table.
        before = self._rows.key
        row, new, gone = self._rows.find(first, second + self._things)
        if gone.any():
            self._memory.part(before[gone], *(array[gone] for array in self._last))
        impulse, normal = impulse.copy(), normal.copy()
        self._last = impulse.copy(), normal
        if len(new):
            impulse[new] -= self._memory.excess(self._rows.key[new], normal[new])
            leader, group = new, np.arange(len(new))
            if self._joints:
                _, at, group = np.unique(self._rows.key[new], return_index=True, return_inverse=True)
                leader, group = new[at], group.reshape(-1)
            row[new] = self._count + group
            self._open(time, first[leader], second[leader], point[leader], normal[leader], swapped[leader])
        self._rows.keep(row)
        self._row = row
        given = np.where(swapped[:, None], impulse, -impulse)  # by the first to the second
        if self._joints:
            np.add.at(self._vectors[:, 4:6], row, given)
        else:
            self._vectors[row, 4:6] += given

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
        self._rows.keep(self._row)
        self._count = len(lasting)
        self._time[: self._count] = taken.time[lasting]
        self._pair[: self._count] = taken.pair[lasting]
        self._vectors[: self._count] = self._vectors[lasting]
        self._vectors[: self._count, 4:6] = 0.0
        return taken
