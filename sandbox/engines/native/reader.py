"""Reader: the state of a space in one call a frame, through pymunk.batch and one reused buffer."""

from typing import Any

import numpy as np
import pymunk
from pymunk._chipmunk_cffi import ffi, lib
from pymunk.batch import ArbiterFields, BodyFields, Buffer, get_space_arbiters, get_space_bodies, set_space_bodies

from sandbox.engines.native.ids import IdTable
from sandbox.engines.touching import NOTHING, ComplexArray, Touching
from sandbox.trajectory import FloatArray, IntArray

STATE = BodyFields.POSITION | BodyFields.ANGLE | BodyFields.VELOCITY | BodyFields.ANGULAR_VELOCITY
STATE_WIDTH = 6  # x, y, angle, vx, vy, ω: in the order of pymunk's flags

TOUCH = (
    ArbiterFields.BODY_A_ID
    | ArbiterFields.BODY_B_ID
    | ArbiterFields.TOTAL_IMPULSE
    | ArbiterFields.NORMAL
    | ArbiterFields.CONTACT_COUNT
    | ArbiterFields.POINT_A_1
    | ArbiterFields.POINT_B_1
)


WHO = ArbiterFields.BODY_A_ID | ArbiterFields.BODY_B_ID | ArbiterFields.CONTACT_COUNT

SECOND = TOUCH | ArbiterFields.POINT_A_2 | ArbiterFields.POINT_B_2
"""What polygons have: they touch in two points."""

TOUCH_FLAGS, SECOND_FLAGS = TOUCH.value, SECOND.value

WORD = ffi.sizeof("uintptr_t")
"""bytes, of a whole number in a buffer"""

LIST = ffi.addressof(lib, "pmSpaceArbiterIteratorFuncBatched")
"""What writes an arbiter into a listing; `get_space_arbiters` looks it up at each call, which takes as long as it."""


class Reader:
    """Reads bodies and arbiters of one space.

    pymunk lists bodies in an order of its own, which changes when one is removed: rows are told by their id.
    A buffer's memory moves when it grows and each new one leaks, hence one of each kind, and only copies leave.
    """

    def __init__(self, space: pymunk.Space) -> None:
        self._space = space
        self._bodies, self._arbiters, self._forces = Buffer(), Buffer(), Buffer()
        self._listing = _listing(self._arbiters)
        self.keep_last = False
        """whether the vectors of the look before are asked for; set once, after a look"""
        self._last: tuple[Buffer, Any, IntArray] | None = None  # the listing before: buffer, listing, rows
        self._number_of = IdTable({})
        self._moving: IntArray = np.empty(0, np.int64)
        self._words, self._width = b"", 4  # who touched at the last look, and how many vectors a contact has
        self._live: IntArray = np.empty(0, np.int64)
        self._firsts = self._live  # where the vectors of each of these begin
        self._moved, self._first, self._all = True, True, 0
        self._rows: IntArray = np.empty(0, np.int64)
        self._numbers: IntArray = np.empty(0, np.int64)
        self.records: dict[Any, int] = {}
        """Which number each moving body's own record (`cpBody`) stands for; those that left may still be there"""
        self.slots: slice | IntArray = self._numbers
        """Where in scene order the rows of `state` belong; a slice where that is possible, which is faster."""

    def assign(self, moving: dict[int, int], still: dict[int, int]) -> None:
        """Say which number each body's id stands for: of those that move, and of the static ones."""
        self._number_of = IdTable(moving | still)
        self._moving = np.array(sorted(moving), dtype=np.int64)
        self._moved = True

    def state(self) -> tuple[IntArray, FloatArray]:
        """Return the numbers (R,) of the moving bodies, and their states (R, 6): x, y, angle, vx, vy, ω.

        Both are valid until the next call.
        """
        if self._moved:
            self._read_order()
        self._bodies.clear()
        get_space_bodies(self._space, STATE, self._bodies)
        table = np.frombuffer(self._bodies.float_buf()).reshape(-1, STATE_WIDTH)
        return self._numbers, table[: len(self._rows)] if self._first else table[self._rows]

    def numbers(self, ids: IntArray) -> IntArray:
        """Return the numbers that ids of bodies stand for."""
        return self._number_of.numbers(ids)

    def members_changed(self) -> None:
        """Note that bodies came or went, which moves rows."""
        self._moved = True

    def _read_order(self) -> None:
        """Find out by their ids which row is which body. The order holds until bodies come or go."""
        self._bodies.clear()
        get_space_bodies(self._space, BodyFields.BODY_ID, self._bodies)
        ids = np.frombuffer(self._bodies.int_buf(), np.int64)
        self._rows = np.flatnonzero(np.isin(ids, self._moving))
        self._numbers = self._number_of.numbers(ids[self._rows])
        self._first = np.array_equal(self._rows, np.arange(len(self._rows)))  # static bodies come last
        self._all = len(ids)
        first = int(self._numbers[0]) if len(self._numbers) else 0
        consecutive = np.array_equal(self._numbers, np.arange(first, first + len(self._numbers)))
        self.slots = slice(first, first + len(self._numbers)) if consecutive else self._numbers
        self._moved = False

    def push(self, force: FloatArray) -> None:
        """Set the force, N, on each body that the last `state` listed, in its order, for the next step only."""
        self._outgoing = np.zeros((self._all, 2))  # kept alive: pymunk holds a bare pointer into it
        self._outgoing[self._rows] = force
        self._forces.set_float_buf(self._outgoing.reshape(-1))
        set_space_bodies(self._space, BodyFields.FORCE, self._forces)

    def drive(self, velocity: FloatArray) -> None:
        """Set the velocities of all bodies that move to theirs of (N, 2), m/s, in scene order."""
        if self._moved:
            self._read_order()
        self._outgoing = np.zeros((self._all, 2))  # kept alive, as in `push`; static bodies go nowhere
        self._outgoing[self._rows] = velocity[self._numbers]
        self._forces.set_float_buf(self._outgoing.reshape(-1))
        set_space_bodies(self._space, BodyFields.VELOCITY, self._forces)

    def pairs(self) -> IntArray:
        """Return the numbers (K, 2) of who is in contact; a pair is listed as often as its shapes touch."""
        self._arbiters.clear()
        get_space_arbiters(self._space, WHO, self._arbiters)
        words = np.frombuffer(self._arbiters.int_buf(), np.int64).reshape(-1, 3)
        if not len(words):
            return np.empty((0, 2), np.int64)
        live = words[words[:, 2] > 0]
        return np.column_stack([self._number_of.numbers(live[:, k]) for k in (0, 1)])

    def look(self, polygons: bool = False) -> bool:
        """See what touches now; with polygons, which may touch in two points. Tell whether it is who touched before.

        Those who touch, listed in the same order as at the last look, are the same contacts: then their impulses are
        all that is new.
        """
        if self.keep_last:
            self._turn_over()
        self._arbiters.clear()
        self._listing.fields = SECOND_FLAGS if polygons else TOUCH_FLAGS
        lib.cpSpaceEachCachedArbiter(self._space._space, LIST, self._listing)
        self._width = 6 if polygons else 4
        found = self._arbiters._int_arr  # what `int_buf` would be made of
        words = ffi.buffer(found.arr, found.num * WORD)[:] if found.num else b""
        same = words == self._words
        if not same:
            self._words = words
            # A parted contact is remembered for a while, with no points.
            self._live = np.flatnonzero(np.frombuffer(words, np.int64)[2::3])
            self._firsts = self._live * self._width
        return same

    def _turn_over(self) -> None:
        """Let the present listing be the last, and go on with the buffers of the one before."""
        spare = Buffer() if self._last is None else self._last[0]
        listing = _listing(spare) if self._last is None else self._last[1]
        self._last = self._arbiters, self._listing, self._firsts
        self._arbiters, self._listing = spare, listing

    def last_vectors(self, rows: IntArray) -> tuple[ComplexArray, ComplexArray]:
        """Return impulses, N·s, and normals (K,) of some of those that touched at the look before."""
        assert self._last is not None
        arbiters, _, firsts = self._last
        vectors = np.frombuffer(arbiters.float_buf(), np.complex128)
        return vectors[firsts[rows]], vectors[firsts[rows] + 1]

    def cached(self) -> IntArray:
        """Return the numbers (C, 2) of those who do not touch at the last look, and are remembered."""
        words = np.frombuffer(self._words, np.int64).reshape(-1, 3)
        gone = words[words[:, 2] == 0]
        return np.column_stack([self._number_of.numbers(gone[:, k]) for k in (0, 1)])

    def impulses(self) -> ComplexArray:
        """Return the impulses (K,) N·s of what touched at the last look, on the first of each."""
        if not len(self._live):
            return NOTHING.impulse
        vectors = np.frombuffer(self._arbiters.float_buf(), np.complex128)
        return vectors.take(self._firsts)

    def touching(self) -> Touching:
        """Return what touched at the last look, as arrays of their own."""
        live = self._live
        if not len(live):
            return NOTHING
        words = np.frombuffer(self._words, np.int64).reshape(-1, 3)
        a, b = (self._number_of.numbers(words[:, k].take(live)) for k in (0, 1))
        vectors = np.frombuffer(self._arbiters.float_buf(), np.complex128).reshape(-1, self._width).take(live, axis=0)
        point = (vectors[:, 2] + vectors[:, 3]) * 0.5
        if self._width > 4:
            twice = words[:, 2].take(live) > 1
            point = np.where(twice, 0.5 * (point + (vectors[:, 4] + vectors[:, 5]) * 0.5), point)
        return Touching(a, b, vectors[:, 0], vectors[:, 1], point)


def _listing(arbiters: Buffer) -> Any:
    """Return what a listing of arbiters is written by, as `get_space_arbiters` makes one at each call."""
    listing = ffi.new("pmBatchedData *")
    listing.floatArray, listing.intArray = arbiters._float_arr, arbiters._int_arr
    return listing
