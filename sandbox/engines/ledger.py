"""ContactLedger: one row for each contact, from what a fixed-step engine finds anew after every substep.

Vectors are complex numbers, x + iy, until they leave.
"""

from typing import Protocol

import numpy as np

from sandbox.engines.contract import Exhaustion
from sandbox.engines.rows import RowTable
from sandbox.engines.touching import ComplexArray, Touching
from sandbox.trajectory import Contacts, FloatArray, IntArray

MAX_ROWS = 20_000_000
"""Rows kept before a run is stopped: 1.4 GB."""


class ImpulseMemory(Protocol):
    """What an engine remembers of contacts that have parted, and reports again when they touch once more."""

    def forget_and_advance(self) -> None:
        """Go on to the next substep."""

    def part(self, key: IntArray, impulse: ComplexArray, normal: ComplexArray) -> None:
        """Remember (K,) pairs that touched in the last substep, and do not now."""

    def excess(self, key: IntArray, normal: ComplexArray) -> ComplexArray:
        """Return what is reported too much (K,), on the first of pairs that have just met, N·s."""


class ContactLedger:
    """Contacts since the last `take`. One that lasts is one row, its impulse summed."""

    def __init__(self, things: int, joints: bool, memory: ImpulseMemory | None = None) -> None:
        """Start empty.

        Args:
            things: how many fixed things there are.
            joints: whether a pair can show several times at once, as a ball in the corner of a polyline does.
            memory: what the engine still remembers of parted contacts, where it does.
        """
        self._things, self._joints = things, joints
        self._rows = RowTable()
        self._memory = memory
        self._count = 0
        self._time: FloatArray = np.empty(256)
        self._pair: IntArray = np.empty((256, 2), np.int64)
        self._place: ComplexArray = np.empty((256, 2), np.complex128)  # point, normal
        self._impulse: ComplexArray = np.empty(256, np.complex128)
        self._row: IntArray = np.empty(0, np.int64)  # of what touches now
        self._reported: tuple[ComplexArray, ComplexArray] = (self._impulse[:0], self._impulse[:0])

    def record(self, time: float, now: Touching) -> None:
        """Enter what touches at a time, s."""
        if self._joints and len(now.a) > 1:
            now = _ordered(now)
        if self._memory is not None:
            self._memory.forget_and_advance()
        if not len(now.a) and not len(self._row):
            return
        swapped = (now.a < 0) | ((now.b >= 0) & (now.b < now.a))
        first, second = np.where(swapped, now.b, now.a), np.where(swapped, now.a, now.b)
        before = self._rows.key
        # Fixed things, −1 − k, become 0 … F − 1, and bodies follow them: small whole numbers for the table.
        row, new, gone = self._rows.find(first + self._things, second + self._things)
        if self._memory is not None and gone.any():
            self._memory.part(before[gone], *(each[gone] for each in self._reported))
        self._reported = now.impulse, now.normal

        sign = swapped * 2.0 - 1.0
        given = now.impulse * sign  # by the first to the second
        if len(new):
            # An engine may list contacts by addresses: without an order of our own, no two runs would agree.
            new = new[np.argsort(self._rows.key[new], kind="stable")]
            if self._memory is not None:
                given[new] -= sign[new] * self._memory.excess(self._rows.key[new], now.normal[new])
            leader, group = new, np.arange(len(new))
            if self._joints:
                _, at, group = np.unique(self._rows.key[new], return_index=True, return_inverse=True)
                leader, group = new[at], group.reshape(-1)
            row[new] = self._count + group
            rows = self._opened(len(leader))
            self._time[rows] = time
            self._pair[rows, 0], self._pair[rows, 1] = first[leader], second[leader]
            self._place[rows, 0], self._place[rows, 1] = now.point[leader], -sign[leader] * now.normal[leader]
        self._rows.keep(row)
        self._row = row
        if self._joints:
            np.add.at(self._impulse, row, given)
        else:
            self._impulse[row] += given

    def _opened(self, more: int) -> slice:
        """Return so many new rows, their impulse 0."""
        end = self._count + more
        if end > MAX_ROWS:
            raise Exhaustion(f"more than {MAX_ROWS:,} contacts in one run")
        if end > len(self._time):
            size = max(2 * len(self._time), end)
            self._time, self._impulse = np.resize(self._time, size), np.resize(self._impulse, size)
            self._pair, self._place = np.resize(self._pair, (size, 2)), np.resize(self._place, (size, 2))
        rows = slice(self._count, end)
        self._impulse[rows] = 0.0
        self._count = end
        return rows

    def pairs(self) -> IntArray:
        """Return the pairs (K, 2) that touched when last recorded."""
        return self._pair[self._row]

    def take(self) -> Contacts:
        """Return the contacts that were open since the last call, and forget those that have ended."""
        n = self._count
        vectors = (self._place[:n, 0], self._place[:n, 1], self._impulse[:n])
        taken = Contacts(self._time[:n].copy(), self._pair[:n].copy(), *(_plain(vector) for vector in vectors))
        lasting = np.unique(self._row)
        self._row = np.searchsorted(lasting, self._row)
        self._rows.keep(self._row)
        self._count = count = len(lasting)
        self._time[:count], self._pair[:count] = taken.time[lasting], taken.pair[lasting]
        self._place[:count] = self._place[lasting]
        self._impulse[:count] = 0.0
        return taken


def _ordered(now: Touching) -> Touching:
    """Return contacts by pair, and those of one pair by place: which one opens a row must not be chance."""
    order = np.lexsort((now.point.imag, now.point.real, now.b, now.a))
    return Touching(now.a[order], now.b[order], now.impulse[order], now.normal[order], now.point[order])


def _plain(vector: ComplexArray) -> FloatArray:
    """Return complex numbers (K,) as rows (K, 2)."""
    return np.array(vector, np.complex128, order="C").view(np.float64).reshape(-1, 2)
