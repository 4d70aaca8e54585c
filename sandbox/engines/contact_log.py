"""ContactLog: one row for each contact, from what a fixed-step engine finds anew after every substep.

Vectors are complex numbers, x + iy, until they leave.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from sandbox.engines.contract import Exhaustion
from sandbox.engines.rows import RowTable
from sandbox.engines.touching import ComplexArray, Touching
from sandbox.trajectory import Contacts, FloatArray, IntArray

MAX_ROWS = 20_000_000
"""Rows kept before a run is stopped: 1.4 GB."""


class ContactLog:
    """Contacts since the last `take`. One that lasts is one row, its impulse summed."""

    def __init__(self, things: int, joints: bool) -> None:
        """Start empty.

        Args:
            things: how many fixed things there are.
            joints: whether a pair can show several times at once, as a ball in the corner of a polyline does.
        """
        self._things = things
        self.joints = joints
        """may change, as bodies of several pieces come"""
        self._rows = RowTable()
        self._count = 0
        self._time: FloatArray = np.empty(256)
        self._pair: IntArray = np.empty((256, 2), np.int64)
        self._place: ComplexArray = np.empty((256, 2), np.complex128)  # point, normal
        self._impulse: ComplexArray = np.empty(256, np.complex128)
        self._row: IntArray = np.empty(0, np.int64)  # of what touches now
        self._sign: npt.NDArray[np.floating[Any]] = np.empty(0)  # likewise, of the impulses that go on
        self._given: ComplexArray | None = None  # likewise, the impulses so far, where they are not in their rows
        self._order: IntArray | None = None  # likewise, in which they are entered
        self.steady = False
        """Each of what touches has a row of its own: while it is the same that touch, `go_on` will do. Of two that
        share a row the order in which they are summed tells in the last digit."""

    def record(self, time: float, now: Touching) -> None:
        """Enter what touches at a time, s."""
        self._settle()
        self._order, self.steady = None, True
        if self.joints and len(now.a) > 1:
            self._order = _order(now)
            k = self._order
            now = Touching(now.a[k], now.b[k], now.impulse[k], now.normal[k], now.point[k])
        if not len(now.a) and not len(self._row):
            return
        swapped = (now.a < 0) | ((now.b >= 0) & (now.b < now.a))
        first, second = np.where(swapped, now.b, now.a), np.where(swapped, now.a, now.b)
        # Fixed things, −1 − k, become 0 … F − 1, and bodies follow them: small whole numbers for the table.
        row, new = self._rows.find(first + self._things, second + self._things)
        sign = swapped * 2.0 - 1.0
        given = now.impulse * sign  # by the first to the second
        if len(new):
            # An engine may list contacts by addresses: without an order of our own, no two runs would agree.
            new = new[np.argsort(self._rows.key[new], kind="stable")]
            leader, group = new, np.arange(len(new))
            if self.joints:
                _, at, group = np.unique(self._rows.key[new], return_index=True, return_inverse=True)
                leader, group = new[at], group.reshape(-1)
            row[new] = self._count + group
            rows = self._opened(len(leader))
            self._time[rows] = time
            self._pair[rows, 0], self._pair[rows, 1] = first[leader], second[leader]
            self._place[rows, 0], self._place[rows, 1] = now.point[leader], -sign[leader] * now.normal[leader]
        self._rows.keep(row)
        self._row, self._sign = row, sign
        self.steady = not self.joints or len(row) < 2 or len(np.unique(row)) == len(row)
        self._enter(given)

    def go_on(self, impulse: ComplexArray) -> None:
        """Enter that the same touch as when last recorded, with these impulses, (K,) N·s, in the order of then."""
        if not len(impulse):
            return
        given = (impulse if self._order is None else impulse[self._order]) * self._sign
        if not self.steady:
            self._settle()
            self._enter(given)
        elif self._given is None:  # from now on beside the rows, which are found only once
            self._given = self._impulse[self._row] + given
        else:
            self._given += given

    def _settle(self) -> None:
        """Write what was given into its rows."""
        if self._given is not None:
            self._impulse[self._row], self._given = self._given, None

    def _enter(self, given: ComplexArray) -> None:
        if self.joints and not self.steady:
            np.add.at(self._impulse, self._row, given)
        else:
            self._impulse[self._row] += given

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
        self._settle()
        n = self._count
        if not n:
            return Contacts.none()
        vectors = (self._place[:n, 0], self._place[:n, 1], self._impulse[:n])
        taken = Contacts(self._time[:n].copy(), self._pair[:n].copy(), *(_plain(vector) for vector in vectors))
        lasting = self._row if len(self._row) < 2 else np.unique(self._row)
        self._row = np.searchsorted(lasting, self._row)
        self._rows.keep(self._row)
        self._count = count = len(lasting)
        self._time[:count], self._pair[:count] = taken.time[lasting], taken.pair[lasting]
        self._place[:count] = self._place[lasting]
        self._impulse[:count] = 0.0
        return taken


def _order(now: Touching) -> IntArray:
    """Return the order of contacts by pair, and of one pair by place: which one opens a row must not be chance."""
    return np.lexsort((now.point.imag, now.point.real, now.b, now.a))


def _plain(vector: ComplexArray) -> FloatArray:
    """Return complex numbers (K,) as rows (K, 2)."""
    return np.array(vector, np.complex128, order="C").view(np.float64).reshape(-1, 2)
