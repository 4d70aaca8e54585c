"""Bulk reads from Munk2D: bodies, arbiters, and the indices of pymunk's bodies."""

from typing import Any

import numpy as np
import pymunk
from pymunk._chipmunk_cffi import lib
from pymunk.batch import ArbiterFields, BodyFields, Buffer, get_space_arbiters, get_space_bodies, set_space_bodies

from sandbox.arrays import ComplexArray, FloatArray, IntArray
from sandbox.engines.common.contact_log import NO_CONTACTS, ContactBatch
from sandbox.engines.pymunk_adapter.munk2d_memory import LIST_BODY, LIST_CONTACT, Listing

LARGEST_TABLE = 1 << 22
"""Slots; 32 MB. If addresses are more scattered than that, ids are searched instead."""

SLOTS_PER_ID = 4096
"""Likewise for each id: clearing a table takes 0.1 µs for each kB of it, and a few ids are found as fast by a search"""


class IdTable:
    """Maps ids to indices: by a table if the addresses lie close together, else by a search."""

    def __init__(self, indices: dict[int, int]) -> None:
        """Create the map from the index of each id."""
        pairs = np.array(sorted(indices.items()), dtype=np.int64).reshape(-1, 2)
        self._ids, self._indices = pairs[:, 0].copy(), pairs[:, 1].copy()
        self._base = int(self._ids[0]) if len(pairs) else 0
        slots = self._slots(self._ids)
        self._table: IntArray | None = None
        if len(pairs) and int(slots[-1]) < min(SLOTS_PER_ID * len(pairs), LARGEST_TABLE):
            self._table = np.zeros(int(slots[-1]) + 1, np.int64)
            self._table[slots] = self._indices

    def _slots(self, ids: IntArray) -> IntArray:
        """Return a slot for each id: objects lie at least 32 bytes apart, so no two share one."""
        return (ids - self._base) >> 4

    def indices(self, ids: IntArray) -> IntArray:
        """Return the index of each id (K,); every id must be known."""
        if self._table is not None:
            return self._table[self._slots(ids)]
        return self._indices[np.searchsorted(self._ids, ids)]


STATE = BodyFields.POSITION | BodyFields.ANGLE | BodyFields.VELOCITY | BodyFields.ANGULAR_VELOCITY
STATE_WIDTH = 6  # x, y, angle, vx, vy, ω, in the order of pymunk's flags
STATE_BY_ID = STATE | BodyFields.BODY_ID
"""Fields of bodies that may fall asleep, which changes the order in which Munk2D lists them."""

TOUCH = (
    ArbiterFields.BODY_A_ID
    | ArbiterFields.BODY_B_ID
    | ArbiterFields.TOTAL_IMPULSE
    | ArbiterFields.NORMAL
    | ArbiterFields.CONTACT_COUNT
    | ArbiterFields.POINT_A_1
    | ArbiterFields.POINT_B_1
)


PAIR_FIELDS = ArbiterFields.BODY_A_ID | ArbiterFields.BODY_B_ID | ArbiterFields.CONTACT_COUNT

SECOND = TOUCH | ArbiterFields.POINT_A_2 | ArbiterFields.POINT_B_2
"""Fields for polygons, which touch in up to two points."""

TOUCH_FLAGS, SECOND_FLAGS = TOUCH.value, SECOND.value

VECTORS, VECTORS_OF_TWO_POINTS = 4, 6
"""Vectors of a contact in a list: impulse, normal, and two for each point."""

NO_VECTORS: ComplexArray = np.empty(0, np.complex128)


class SpaceReader:
    """Reads bodies and arbiters of one space.

    pymunk lists bodies in its own order, which changes when a body is removed, so rows are identified by body id. A
    body that falls asleep or wakes changes the order too: with `can_sleep`, each list is brought into the order in
    which ids were read.
    """

    def __init__(self, space: pymunk.Space, can_sleep: bool = False) -> None:
        self._space, self._can_sleep = space, can_sleep
        self._ids: IntArray = np.empty(0, np.int64)  # of all bodies, in the order of rows
        self._rank = self._ids  # rank of each of these ids
        self._reordered: tuple[bytes, IntArray] = b"", self._ids  # ids of a list in another order, and its sorted rows
        self._bodies, self._contacts = Listing(STATE_BY_ID if can_sleep else STATE), Listing(TOUCH)
        self._pairs, self._forces = Buffer(), Buffer()
        self.numbers: FloatArray = np.empty(0)
        """all numbers of the last list of bodies, (6·B,) in the order of rows; valid until the next list"""
        self._vectors = NO_VECTORS  # of the present list of contacts
        self._index_of = IdTable({})
        self._moving: IntArray = np.empty(0, np.int64)
        self._id_words, self._width = b"", VECTORS  # ids of the present list, and number of vectors of a contact
        self._touching_rows: IntArray = np.empty(0, np.int64)
        self._first_vectors = self._touching_rows  # first vector of each
        self._is_order_stale, self._moving_come_first, self._body_count = True, True, 0
        self._rows: IntArray = np.empty(0, np.int64)
        self._indices: IntArray = np.empty(0, np.int64)
        self.records: dict[Any, int] = {}
        """index of the body of each `cpBody` that moves; bodies that have left may still be listed"""
        self.slots: slice | IntArray = self._indices
        """positions of the rows of `state` in scene order; a slice where possible, which is faster"""

    def assign(self, moving: dict[int, int], static: dict[int, int]) -> None:
        """Set the body index of each id: of moving bodies, and of static ones."""
        self._index_of = IdTable(moving | static)
        self._moving = np.array(sorted(moving), dtype=np.int64)
        self._is_order_stale = True

    def state(self) -> tuple[IntArray, FloatArray]:
        """Return the indices (R,) of the moving bodies, and their states (R, 6): x, y, angle, vx, vy, ω.

        Both are valid until the next call.
        """
        if self._is_order_stale:
            self._read_order()
        self._bodies.clear()
        lib.cpSpaceEachBody(self._space._space, LIST_BODY, self._bodies.data)
        self.numbers = self._bodies.numbers()
        table = self.numbers.reshape(-1, STATE_WIDTH)
        if self._can_sleep and (order := self.order_of(self._bodies.words())) is not None:
            table = table[order]
            self.numbers = table.reshape(-1)
        return self._indices, table[: len(self._rows)] if self._moving_come_first else table[self._rows]

    def indices(self, ids: IntArray) -> IntArray:
        """Return the body indices of ids."""
        return self._index_of.indices(ids)

    def invalidate_order(self) -> None:
        """Record that bodies were added or removed, which changes the order of rows."""
        self._is_order_stale = True

    def order_of(self, id_words: bytes) -> IntArray | None:
        """Return the rows of a list of all bodies in the order of `state`; None if they are in that order.

        Args:
            id_words: ids of the list.
        """
        if id_words == self._ids.tobytes():
            return None
        if id_words != self._reordered[0]:
            ids = np.frombuffer(id_words, np.int64)
            self._reordered = id_words, np.argsort(ids)[self._rank]
        return self._reordered[1]

    def _read_order(self) -> None:
        """Read the order of the rows by their ids. It holds until bodies are added or removed."""
        self._bodies.clear()
        get_space_bodies(self._space, BodyFields.BODY_ID, self._bodies.buffer)
        self._ids = ids = np.frombuffer(self._bodies.words(), np.int64)
        self._rank = np.argsort(np.argsort(ids))
        self._rows = np.flatnonzero(np.isin(ids, self._moving))
        self._indices = self._index_of.indices(ids[self._rows])
        self._moving_come_first = np.array_equal(self._rows, np.arange(len(self._rows)))  # static bodies come last
        self._body_count = len(ids)
        first = int(self._indices[0]) if len(self._indices) else 0
        consecutive = np.array_equal(self._indices, np.arange(first, first + len(self._indices)))
        self.slots = slice(first, first + len(self._indices)) if consecutive else self._indices
        self._is_order_stale = False

    def set_forces(self, force: FloatArray) -> None:
        """Set the force, N, on each body of the last `state`, in its order, for the next step only."""
        self._outgoing = np.zeros((self._body_count, 2))  # kept alive: pymunk holds a bare pointer into it
        self._outgoing[self._rows] = force
        self._forces.set_float_buf(self._outgoing.reshape(-1))
        set_space_bodies(self._space, BodyFields.FORCE, self._forces)

    def set_velocities(self, velocity: FloatArray) -> None:
        """Set the velocities of all moving bodies to those of (N, 2), m/s, in scene order."""
        if self._is_order_stale:
            self._read_order()
        self._outgoing = np.zeros((self._body_count, 2))  # kept alive, as in `set_forces`; static bodies do not move
        self._outgoing[self._rows] = velocity[self._indices]
        self._forces.set_float_buf(self._outgoing.reshape(-1))
        set_space_bodies(self._space, BodyFields.VELOCITY, self._forces)

    def pairs(self) -> IntArray:
        """Return the indices (K, 2) of bodies in contact. A pair is listed once for each two shapes that touch."""
        self._pairs.clear()
        get_space_arbiters(self._space, PAIR_FIELDS, self._pairs)
        words = np.frombuffer(self._pairs.int_buf(), np.int64).reshape(-1, 3)
        if not len(words):
            return np.empty((0, 2), np.int64)
        touching = words[words[:, 2] > 0]
        return np.column_stack([self._index_of.indices(touching[:, k]) for k in (0, 1)])

    def read_contacts(self, polygons: bool = False) -> bool:
        """Read the present contacts, with `polygons` up to two points each. Return whether they are the previous ones.

        If the same ids are listed in the same order as at the last call, the contacts are the same, and only their
        impulses are new.
        """
        contacts = self._contacts
        contacts.clear()
        contacts.data.fields = SECOND_FLAGS if polygons else TOUCH_FLAGS
        lib.cpSpaceEachCachedArbiter(self._space._space, LIST_CONTACT, contacts.data)
        return self.use_list(contacts.words(), contacts.numbers(np.complex128), polygons)

    def use_list(self, words: bytes, vectors: ComplexArray, polygons: bool) -> bool:
        """Take a list of contacts as the present one; return as `read_contacts` does.

        Args:
            words: two ids and the number of points of each contact.
            vectors: of all contacts. They must stay as they are until the next list.
            polygons: whether contacts have up to two points.
        """
        self._vectors = vectors
        width = VECTORS_OF_TWO_POINTS if polygons else VECTORS
        same = words == self._id_words and width == self._width
        if not same:
            self._id_words, self._width = words, width
            # An ended contact stays cached for a while, with no points.
            self._touching_rows = np.flatnonzero(np.frombuffer(words, np.int64)[2::3])
            self._first_vectors = self._touching_rows * self._width
        return same

    @property
    def body_count(self) -> int:
        """Number of bodies in the space."""
        if self._is_order_stale:
            self._read_order()
        return self._body_count

    @property
    def moving_indices(self) -> IntArray:
        """Indices of the moving bodies, in the order of the rows of `state`."""
        return self._indices

    @property
    def moving_rows(self) -> slice | IntArray:
        """Rows of the moving bodies in a list of all bodies."""
        return slice(0, len(self._rows)) if self._moving_come_first else self._rows

    @property
    def id_words(self) -> bytes:
        """The ids of the present list."""
        return self._id_words

    def impulses(self) -> ComplexArray:
        """Return the impulses (K,), N·s, of the present contacts, on the first body of each."""
        if not len(self._touching_rows):
            return NO_CONTACTS.impulse
        return self._vectors.take(self._first_vectors)

    def impulse_columns(self) -> IntArray:
        """Return the positions (K,) of the impulses of the present contacts among the vectors of the list."""
        return self._first_vectors

    def touching(self) -> ContactBatch:
        """Return the present contacts as new arrays."""
        rows = self._touching_rows
        if not len(rows):
            return NO_CONTACTS
        words = np.frombuffer(self._id_words, np.int64).reshape(-1, 3)
        a, b = (self._index_of.indices(words[:, k].take(rows)) for k in (0, 1))
        vectors = self._vectors.reshape(-1, self._width).take(rows, axis=0)
        point = (vectors[:, 2] + vectors[:, 3]) * 0.5
        if self._width > 4:
            twice = words[:, 2].take(rows) > 1
            point = np.where(twice, 0.5 * (point + (vectors[:, 4] + vectors[:, 5]) * 0.5), point)
        return ContactBatch(a, b, vectors[:, 0], vectors[:, 1], point)
