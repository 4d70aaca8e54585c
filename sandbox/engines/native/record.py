"""Record: what Munk2D keeps of the contact of two shapes, which pymunk itself reads to pickle a space.

pymunk's public calls tell the impulse of a pair of shapes, which does not say what turned polygons that touch in two
points.
"""

from typing import Any

import numpy as np
from pymunk import Arbiter
from pymunk._chipmunk_cffi import ffi

from sandbox.trajectory import FloatArray

WIDTH = 12
"""Words of a point (`cpContact`): two arms, two masses, bounce, impulses along the normal and to its left, three more,
hash."""

ARMS, IMPULSES = slice(0, 4), slice(7, 9)


def points_of(arbiter: Any) -> FloatArray:
    """Return the points of a `cpArbiter`, (C, 12)."""
    size = 8 * WIDTH * arbiter.count
    return np.frombuffer(ffi.buffer(arbiter.contacts, size)[:]).reshape(-1, WIDTH).copy()


def address_of(arbiter: Any) -> int:
    """Return where a `cpArbiter` lies."""
    return int(ffi.cast("uintptr_t", arbiter))


def impulses_of(arbiter: Arbiter) -> tuple[int, FloatArray]:
    """Return where an arbiter lies, and the impulses (C, 2) that its points now have, N·s."""
    return address_of(arbiter._arbiter), points_of(arbiter._arbiter)[:, IMPULSES]
