"""Points: the impulses of a substep, contact point by contact point.

pymunk's public calls tell the impulse of a pair of shapes, which does not say what turned polygons that touch in two
points. Munk2D's own record of a contact, which pymunk reads to pickle a space, does: its accumulated impulses, and
the arms that they acted on.
"""

from typing import Any, NamedTuple

import numpy as np
import pymunk
from pymunk.arbiter import Arbiter, ffi

from sandbox.engines.native.memory import RememberedImpulses
from sandbox.trajectory import FloatArray, IntArray

APART = 2
"""cpArbiterState from which on shapes do not touch: ignored, cached, invalidated."""

WIDTH = 12
"""Words of `cpContact`: two arms, two masses, bounce, impulses along the normal and to its left, three more, hash."""


class Points(NamedTuple):
    """P contact points of a substep."""

    a: IntArray
    """(P,) one body, by number; −1 for what never moves"""
    b: IntArray
    """(P,) the other"""
    arm_a: FloatArray
    """(P, 2) m, from the centre of a to the point"""
    arm_b: FloatArray
    """(P, 2) likewise of b"""
    normal: FloatArray
    """(P, 2) from a to b"""
    along: FloatArray
    """(P,) impulse on b along the normal, N·s"""
    across: FloatArray
    """(P,) impulse on b to the normal's left, N·s"""


class PointReader:
    """Reads the contact points of one space after each substep."""

    def __init__(self, space: pymunk.Space, remembered: RememberedImpulses) -> None:
        self._space = space
        self._remembered = remembered
        self._number: dict[Any, int] = {}
        remembered.points = {}

    def assign(self, moving: dict[int, pymunk.Body]) -> None:
        """Say which number each moving body has; all others never move."""
        self._number = {body._body: number for number, body in moving.items()}

    def read(self) -> Points:
        """Return the points of the last substep, with the impulses that were applied in it."""
        begun, number = self._remembered.points, self._number
        assert begun is not None
        first: list[int] = []
        second: list[int] = []
        normal: list[tuple[float, float]] = []
        records: list[FloatArray] = []
        for arbiter in self._space._get_arbiters():
            if arbiter.state >= APART:
                continue
            record = _record(arbiter)
            if begun and int(ffi.cast("uintptr_t", arbiter)) in begun:
                record[:, 7:9] -= begun[int(ffi.cast("uintptr_t", arbiter))]  # applied before they parted
            records.append(record)
            a, b = number.get(arbiter.body_a, -1), number.get(arbiter.body_b, -1)
            n = arbiter.n.x, arbiter.n.y
            for _ in range(len(record)):
                first.append(a)
                second.append(b)
                normal.append(n)
        begun.clear()
        table = np.concatenate(records) if records else np.empty((0, WIDTH))
        return Points(
            np.asarray(first, np.int64),
            np.asarray(second, np.int64),
            table[:, 0:2],
            table[:, 2:4],
            np.asarray(normal).reshape(-1, 2),
            table[:, 7],
            table[:, 8],
        )


def impulses_of(arbiter: Arbiter) -> tuple[int, FloatArray]:
    """Return where an arbiter lies, and the impulses (C, 2) that its contacts now have, N·s."""
    pointer = arbiter._arbiter
    return int(ffi.cast("uintptr_t", pointer)), _record(pointer)[:, 7:9]


def _record(pointer: Any) -> FloatArray:
    size = 8 * WIDTH * pointer.count
    return np.frombuffer(ffi.buffer(pointer.contacts, size)[:]).reshape(-1, WIDTH).copy()
