"""Batches of substeps: Munk2D lists bodies and contacts after each into memory, and Python reads them all at once.

Reading a space takes longer than a substep of a few bodies. A loop of three calls of Munk2D a substep, whose results
are read as arrays afterwards, takes a tenth of the time of reading after each.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pymunk
from pymunk._chipmunk_cffi import ffi, lib

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.pymunk_adapter.contacts import ContactLists, WarmStart, WarmStarts
from sandbox.engines.pymunk_adapter.munk2d_memory import LIST_BODY, LIST_CONTACT, WORD, Listing
from sandbox.engines.pymunk_adapter.reader import (
    SECOND_FLAGS,
    STATE,
    STATE_BY_ID,
    STATE_WIDTH,
    TOUCH,
    TOUCH_FLAGS,
    VECTORS,
    VECTORS_OF_TWO_POINTS,
)
from sandbox.scene.description.base import Point
from sandbox.scene.description.world import Settings

OrderOf = Callable[[bytes], IntArray | None]
"""Returns the rows of a list of bodies, given by its ids, in the order of the reader; None if they are in it."""

MAX_ROWS = 4096
"""Largest number of lists of bodies in a batch."""

MAX_VALUES = 1 << 17
"""Numbers in the lists of bodies of a batch: 1 MB."""

MAX_WORDS = 3 << 16
"""Integers in the lists of contacts, three a contact, after which a batch ends."""

MAX_CONTACTS = (MAX_WORDS // 3) * 2
"""Upper bound of the contacts in a batch, while a substep has no more than half of them."""


FEW_BODIES = 8
"""Number of moving bodies up to which plain numbers are compared faster than arrays."""

StateCheck = Callable[[FloatArray], bool]
"""Returns whether a state (6·R,) has to be checked: a body may have diverged or left `world.bounds`.

With more than `FEW_BODIES` moving bodies it is called while numpy's warnings are switched off."""

ignoring_overflow = partial(np.errstate, over="ignore", invalid="ignore")
"""Context in which numpy does not warn about states that are not valid."""


def state_check(
    bodies: int,
    moving: slice | IntArray,
    within: Callable[[FloatArray], BoolArray],
    bound: float,
    bounds: tuple[Point, Point] | None,
) -> StateCheck:
    """Return a check that decides most states by a few comparisons, or by the product of one vector with itself.

    Args:
        bodies: number of bodies in the space, R.
        moving: rows of the moving bodies.
        within: exact test of states (M, 6) of moving bodies, (M,) or (M, 4).
        bound: states whose vector is shorter than this are within.
        bounds: of the scene, m; None without any.
    """
    needs_check = _vector_check(bodies, moving, within, bound, bounds)
    begins = [STATE_WIDTH * row for row in np.arange(bodies)[moving].tolist()]
    if len(begins) > FEW_BODIES:
        return needs_check
    end = max(begins, default=0) + STATE_WIDTH
    (left, bottom), (right, top) = bounds or ((-math.inf, -math.inf), (math.inf, math.inf))

    def needs_check_of_few(state: FloatArray) -> bool:
        values = state[:end].tolist()
        for k in begins:
            x, y, angle, vx, vy, spin = values[k : k + STATE_WIDTH]
            size = abs(x) + abs(y) + abs(angle) + abs(vx) + abs(vy) + abs(spin)
            if not (left <= x <= right and bottom <= y <= top and size < bound):  # nan: not within
                with ignoring_overflow():
                    return needs_check(state)
        return False

    return needs_check_of_few


def _vector_check(
    bodies: int,
    moving: slice | IntArray,
    within: Callable[[FloatArray], BoolArray],
    bound: float,
    bounds: tuple[Point, Point] | None,
) -> StateCheck:
    """Return a check by the product of one vector with itself; the arguments are those of `state_check`."""

    def is_within(state: FloatArray) -> bool:
        return bool(within(state.reshape(-1, STATE_WIDTH)[moving]).all())

    if bounds is None:
        square = bound * bound if bound > 0.0 else -1.0
        return lambda state: not state.dot(state) <= square and not is_within(state)  # nan: not within
    low, high = np.asarray(bounds)
    # An ellipsoid within all bounds, of the states of all moving bodies.
    centre, scale = np.zeros((2, bodies, STATE_WIDTH))
    is_inside = bound > float(np.hypot(*np.maximum(np.abs(low), np.abs(high))))
    centre[moving, 0:2] = 0.5 * (low + high)
    # slightly larger scale: rounding must not accept a state outside
    scale[moving] = (*(2.0 * (1.0 + 1e-9) / (high - low)), *([1.0 / bound] * 4)) if is_inside else math.inf
    centre, scale = centre.reshape(-1), scale.reshape(-1)

    def needs_check(state: FloatArray) -> bool:
        offset = (state - centre) * scale
        if offset.dot(offset) <= 1.0:
            return False
        position = state.reshape(-1, STATE_WIDTH)[moving, 0:2]
        return not ((position >= low).all() and (position <= high).all() and is_within(state))

    return needs_check


class Batch(NamedTuple):
    """Substeps that have been made, with the states that were listed."""

    steps: int
    """number of whole steps"""
    states: FloatArray
    """(S, R, 6) x, y, angle, vx, vy, ω of the moving bodies, in the order of the reader; valid until the next batch"""
    contacts: ContactLists | None
    """contacts of every substep; None unless they were listed. Valid until the next batch"""
    needs_check: bool
    """whether the state after the last step has to be checked: a body may be out of bounds"""


class BatchReader:
    """Makes many substeps of a space, and lists its bodies and contacts."""

    def __init__(self, space: pymunk.Space, settings: Settings, order_of: OrderOf | None = None) -> None:
        """Create a reader.

        Args:
            space: the space.
            settings: its steps.
            order_of: `SpaceReader.order_of` if bodies may fall asleep, else None.
        """
        self._space, self._settings, self._order_of = space, settings, order_of
        self._bodies, self._contacts = Listing(STATE if order_of is None else STATE_BY_ID), Listing(TOUCH)
        self._states: FloatArray = np.empty(0)  # memory of the list of bodies, which never grows

    def max_rows(self, bodies: int) -> int:
        """Return how many lists of a number of bodies fit into a batch, at least 1."""
        return max(min(MAX_ROWS, MAX_VALUES // (STATE_WIDTH * bodies)), 1)

    def step(
        self,
        first: int,
        steps: int,
        bodies: int,
        moving: slice | Any,
        *,
        lists_substeps: bool,
        polygons: bool,
        until_contact: bool,
        warm_starts: WarmStarts | None,
        forces: Sequence[Callable[[float], None]],
        needs_check: StateCheck,
    ) -> Batch:
        """Make at most so many steps, until one whose state has to be checked.

        Args:
            first: number of steps made before.
            steps: largest number of steps; their lists must fit, see `max_rows`.
            bodies: number of bodies in the space.
            moving: rows of the moving bodies in a list.
            lists_substeps: whether bodies are listed after every substep, not only after every step.
            polygons: whether contacts have up to two points.
            until_contact: whether the batch ends after a step for which contacts were listed, open ones or ended ones
                that Munk2D still keeps.
            warm_starts: impulses with which contacts begin; contacts are listed, after every substep, if it is given.
            forces: functions that set forces before each substep, given its start, s.
            needs_check: returns whether the batch ends with the present state, given the list of it (6·bodies,).
        """
        h, dt, substeps, width = self._settings.h, self._settings.dt, self._settings.substeps, STATE_WIDTH * bodies
        rows = self._prepare(steps * (substeps if lists_substeps else 1), width)
        contacts = self._contacts
        contacts.clear()
        contacts.data.fields = SECOND_FLAGS if polygons else TOUCH_FLAGS
        words, ends, found = contacts.integers, list[int](), dict[int, WarmStart]()
        each_body, each_contact, step = lib.cpSpaceEachBody, lib.cpSpaceEachCachedArbiter, lib.cpSpaceStep
        space, body_list, contact_list = self._space._space, self._bodies.data, contacts.data
        row = made = substep = 0
        is_checked = False
        with ignoring_overflow():
            while made < steps and not is_checked:
                time = (first + made) * dt
                for k in range(substeps):
                    for set_forces in forces:
                        set_forces(time + k * h)
                    if substep:
                        step(space, h)
                    else:  # checks bodies that are new
                        self._space.step(h)
                    if lists_substeps or k == substeps - 1:
                        each_body(space, LIST_BODY, body_list)
                        if self._order_of is not None:
                            self._put_in_order(rows[row], self._order_of)
                        row += 1
                    if warm_starts is not None:
                        each_contact(space, LIST_CONTACT, contact_list)
                        ends.append(words.num)
                        if warm_starts.began.num and (warm_start := warm_starts.take()) is not None:
                            found[substep] = warm_start
                    substep += 1
                made += 1
                is_checked = needs_check(rows[row - 1])
                if words.num > (0 if until_contact else MAX_WORDS):
                    break
        lists = None
        if warm_starts is not None:
            width = VECTORS_OF_TWO_POINTS if polygons else VECTORS
            memory = ffi.buffer(words.arr, words.num * WORD) if words.num else b""
            lists = ContactLists(memory, ends, contacts.numbers(np.complex128), width, found)
        return Batch(made, rows[:row].reshape(row, bodies, STATE_WIDTH)[:, moving], lists, is_checked)

    def _put_in_order(self, row: FloatArray, order_of: OrderOf) -> None:
        """Bring the last list of bodies, (6·R,), into the order of the reader, and drop its ids."""
        order = order_of(self._bodies.words())
        if order is not None:
            row[:] = row.reshape(-1, STATE_WIDTH)[order].reshape(-1)
        self._bodies.integers.num = 0

    def _prepare(self, rows: int, width: int) -> FloatArray:
        """Return memory for lists of bodies, (rows, width), into which they will be written."""
        size = (rows + 1) * width  # one row more than needed: a full array would grow
        if len(self._states) < size:
            self._states = np.empty(size)
            self._bodies.buffer.set_float_buf(self._states)
        self._bodies.clear()
        return self._states[: rows * width].reshape(rows, width)
