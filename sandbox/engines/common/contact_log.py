"""Contact log: contacts of each substep, merged into one row per contact.

A fixed-step engine finds its contacts again after every substep; `ContactLog` merges those that last. Vectors are
complex numbers, x + iy, until they are returned.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sandbox.arrays import ComplexArray, FloatArray, IntArray
from sandbox.engines.contract import Exhaustion
from sandbox.resource_limits import CONTACTS
from sandbox.trajectory import Contacts

LARGEST_SQUARE = 4096
"""Largest number of bodies and static colliders for which a square table is used: at most 64 MB, of which the system
allocates only pages that are used."""


class PairIndex:
    """Maps the pairs of a substep to the rows that they had in the substep before.

    A pair that was absent in the substep before counts as new, even if it had a row earlier. With few bodies a square
    table gives each row in one access; with more, the sorted keys are searched.
    """

    def __init__(self) -> None:
        self._row: IntArray = np.empty(0, np.int64)
        self.key: IntArray = np.empty(0, np.int64)
        self._table = np.zeros((0, 0), np.int32)  # position in `key`; never cleared

    def find(self, first: IntArray, second: IntArray) -> tuple[IntArray, IntArray]:
        """Look up the pairs of a new substep.

        Args:
            first: (K,) small non-negative integers.
            second: (K,) likewise.

        Returns:
            The row of each pair (K,), undefined for new pairs; the positions (M,) of the new pairs.
        """
        key = (first << 32) | second
        row, new = np.empty(len(key), np.int64), np.arange(len(key))
        if len(key) and len(self.key):
            position = self._positions(first, second, key)
            known = self.key[position] == key
            row, new = self._row[position], np.flatnonzero(~known)
        if len(key) and self._fits(first, second):
            self._table[first, second] = np.arange(len(key))
        self.key = key
        return row, new

    def keep(self, row: IntArray) -> None:
        """Set the row of each pair of the last `find`."""
        self._row = row

    def _positions(self, first: IntArray, second: IntArray, key: IntArray) -> IntArray:
        """Return the position of each pair in the substep before; arbitrary for pairs that were absent."""
        last = len(self.key) - 1
        if self._fits(first, second):
            return np.minimum(self._table[first, second], last)
        order = np.argsort(self.key)
        return order[np.minimum(np.searchsorted(self.key, key, sorter=order), last)]

    def _fits(self, first: IntArray, second: IntArray) -> bool:
        """Return whether the square table can be used. It is enlarged to hold the pairs."""
        highest = max(int(first.max()), int(second.max()))
        if highest >= LARGEST_SQUARE:
            return False
        old_size = len(self._table)
        if highest >= old_size:
            size = min(max(2 * old_size, highest + 1), LARGEST_SQUARE)
            table = np.zeros((size, size), np.int32)
            table[:old_size, :old_size] = self._table
            self._table = table
        return True


class ContactBatch(NamedTuple):
    """K contacts at the end of a substep. Vectors are complex numbers, x + iy, so that one access reads a vector."""

    a: IntArray
    """(K,) index of one body of each pair"""
    b: IntArray
    """(K,) index of the other"""
    impulse: ComplexArray
    """(K,) impulse on a, N·s"""
    normal: ComplexArray
    """(K,) unit normal from a to b"""
    point: ComplexArray
    """(K,) contact point, m, midway in the overlap"""


def join_batches(first: ContactBatch, second: ContactBatch) -> ContactBatch:
    """Return the contacts of two batches as one."""
    return ContactBatch(*(np.concatenate(arrays) for arrays in zip(first, second, strict=True)))


NO_CONTACTS = ContactBatch(
    np.empty(0, np.int64), np.empty(0, np.int64), *(np.empty(0, np.complex128) for _ in range(3))
)


NOTHING_LOGGED = Contacts.none()


class ContactLog:
    """Contacts since the last `take`. A lasting contact is one row with the sum of its impulses."""

    def __init__(self, colliders: int, can_repeat_pairs: bool) -> None:
        """Create an empty log.

        Args:
            colliders: number of static colliders.
            can_repeat_pairs: whether a pair can have several contacts at once, as in the corner of a polyline.
        """
        self._collider_count, self._max_rows = colliders, CONTACTS.value
        self.can_repeat_pairs = can_repeat_pairs
        """whether a pair can have several contacts at once; may change when bodies with several shapes join"""
        self._rows = PairIndex()
        self._count = 0
        self._time: FloatArray = np.empty(256)
        self._pair: IntArray = np.empty((256, 2), np.int64)
        self._geometry: ComplexArray = np.empty((256, 2), np.complex128)  # contact point, normal
        self._impulse: ComplexArray = np.empty(256, np.complex128)
        self._row: IntArray = np.empty(0, np.int64)  # row of each present contact
        self._sign: npt.NDArray[np.floating[Any]] = np.empty(0)  # sign of the impulse of each present contact
        self._unflushed: ComplexArray | None = None  # impulses of the present contacts that are not yet in their rows
        self._order: IntArray | None = None  # order in which the present contacts are entered
        self.has_distinct_rows = False
        """Each present contact has a row of its own. While the same contacts last, `add_impulses` may be called. If two
        share a row, the order of summation affects the last digit, so they cannot be summed beside the rows."""

    def record(self, time: float, batch: ContactBatch) -> None:
        """Add the contacts at a time, s."""
        self._flush()
        self._order, self.has_distinct_rows = None, True
        if self.can_repeat_pairs and len(batch.a) > 1:
            self._order = _order(batch)
            k = self._order
            batch = ContactBatch(batch.a[k], batch.b[k], batch.impulse[k], batch.normal[k], batch.point[k])
        if not len(batch.a) and not len(self._row):
            return
        swapped = (batch.a < 0) | ((batch.b >= 0) & (batch.b < batch.a))
        first, second = np.where(swapped, batch.b, batch.a), np.where(swapped, batch.a, batch.b)
        # Static colliders, −1 − k, become 0 … F − 1, and bodies follow them: small integers for the table.
        row, new = self._rows.find(first + self._collider_count, second + self._collider_count)
        sign = swapped * 2.0 - 1.0
        signed_impulse = batch.impulse * sign  # impulse of the first on the second
        if len(new):
            # An engine may list contacts by memory address: unsorted, two runs would differ.
            new = new[np.argsort(self._rows.key[new], kind="stable")]
            leader, group = new, np.arange(len(new))
            if self.can_repeat_pairs:
                _, first_index, group = np.unique(self._rows.key[new], return_index=True, return_inverse=True)
                leader, group = new[first_index], group.reshape(-1)
            row[new] = self._count + group
            rows = self._new_rows(len(leader))
            self._time[rows] = time
            self._pair[rows, 0], self._pair[rows, 1] = first[leader], second[leader]
            self._geometry[rows, 0], self._geometry[rows, 1] = batch.point[leader], -sign[leader] * batch.normal[leader]
        self._rows.keep(row)
        self._row, self._sign = row, sign
        self.has_distinct_rows = not self.can_repeat_pairs or len(row) < 2 or len(np.unique(row)) == len(row)
        self._enter(signed_impulse)

    def add_impulses(self, impulse: ComplexArray) -> None:
        """Add impulses (K,), N·s, of the same contacts as in the last `record`, in the same order."""
        if not len(impulse):
            return
        signed_impulse = (impulse if self._order is None else impulse[self._order]) * self._sign
        if not self.has_distinct_rows:
            self._flush()
            self._enter(signed_impulse)
        elif self._unflushed is None:  # from now on summed beside the rows, so that the rows are looked up only once
            self._unflushed = self._impulse[self._row] + signed_impulse
        else:
            self._unflushed += signed_impulse

    def add_impulse_rows(self, impulses: ComplexArray) -> None:
        """Add impulses (S, K), N·s, of S substeps, each as `add_impulses` does. Each contact must have its own row."""
        if not impulses.size:
            return
        signed_impulses = (impulses if self._order is None else impulses[:, self._order]) * self._sign
        first = self._impulse[self._row] if self._unflushed is None else self._unflushed
        # Accumulated and not reduced: a reduction may sum in another order.
        self._unflushed = np.add.accumulate(np.vstack((first, signed_impulses)), axis=0)[-1].copy()

    def add_batches(self, batch: ContactBatch, substeps: int) -> None:
        """Add the contacts of several substeps with the pairs of the last `record`, each as `record` does.

        For pairs that have several contacts at once.

        Args:
            batch: (S·K,) contacts, K of each substep.
            substeps: S.
        """
        self._flush()
        count = len(batch.a) // substeps
        substep = np.repeat(np.arange(substeps), count)
        order = np.lexsort((batch.point.imag, batch.point.real, batch.b, batch.a, substep))
        signed_impulse = batch.impulse[order] * np.tile(self._sign, substeps)
        np.add.at(self._impulse, np.tile(self._row, substeps), signed_impulse)
        self._order = order[-count:] - (substeps - 1) * count

    @property
    def is_open(self) -> bool:
        """Whether there were contacts at the last record."""
        return len(self._row) > 0

    def can_hold(self, contacts: int) -> bool:
        """Return whether so many more contacts can be recorded with certainty."""
        return self._count + contacts <= self._max_rows

    def _flush(self) -> None:
        """Write impulses summed beside the rows into the rows."""
        if self._unflushed is not None:
            self._impulse[self._row], self._unflushed = self._unflushed, None

    def _enter(self, impulse: ComplexArray) -> None:
        if self.can_repeat_pairs and not self.has_distinct_rows:
            np.add.at(self._impulse, self._row, impulse)
        else:
            self._impulse[self._row] += impulse

    def _new_rows(self, count: int) -> slice:
        """Return a number of new rows with impulse 0."""
        end = self._count + count
        if end > self._max_rows:
            raise Exhaustion(too_many_contacts(end))
        if end > len(self._time):
            size = max(2 * len(self._time), end)
            self._time, self._impulse = np.resize(self._time, size), np.resize(self._impulse, size)
            self._pair, self._geometry = np.resize(self._pair, (size, 2)), np.resize(self._geometry, (size, 2))
        rows = slice(self._count, end)
        self._impulse[rows] = 0.0
        self._count = end
        return rows

    def pairs(self) -> IntArray:
        """Return the pairs (K, 2) of the last record."""
        return self._pair[self._row]

    def take(self) -> Contacts:
        """Return the contacts that were open since the last call, and remove those that have ended."""
        self._flush()
        n = self._count
        if not n:
            return NOTHING_LOGGED
        vectors = (self._geometry[:n, 0], self._geometry[:n, 1], self._impulse[:n])
        taken = Contacts(self._time[:n].copy(), self._pair[:n].copy(), *(_to_rows(vector) for vector in vectors))
        open_rows = self._row if len(self._row) < 2 else np.unique(self._row)
        self._row = np.searchsorted(open_rows, self._row)
        self._rows.keep(self._row)
        self._count = count = len(open_rows)
        self._time[:count], self._pair[:count] = taken.time[open_rows], taken.pair[open_rows]
        self._geometry[:count] = self._geometry[open_rows]
        self._impulse[:count] = 0.0
        return taken


def too_many_contacts(rows: int) -> str:
    """Return the message that a run has more contacts than can be recorded."""
    return f"a run with {rows:,} contacts is too long to record; {CONTACTS.remedy(2 * rows)}"


def _order(batch: ContactBatch) -> IntArray:
    """Return the order of contacts by pair, then by point. It decides which contact opens a row, deterministically."""
    return np.lexsort((batch.point.imag, batch.point.real, batch.b, batch.a))


def _to_rows(vector: ComplexArray) -> FloatArray:
    """Return complex numbers (K,) as rows (K, 2)."""
    return np.array(vector, np.complex128, order="C").view(np.float64).reshape(-1, 2)
