"""Touching: what an engine finds in contact at one moment."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sandbox.trajectory import IntArray

ComplexArray = npt.NDArray[np.complex128]


class Touching(NamedTuple):
    """What touches at the end of a substep, K contacts. Vectors are complex numbers, x + iy: one look each."""

    a: IntArray
    """(K,) one body of each pair, by number"""
    b: IntArray
    """(K,) the other"""
    impulse: ComplexArray
    """(K,) on a, N·s"""
    normal: ComplexArray
    """(K,) from a to b"""
    point: ComplexArray
    """(K,) midway in the overlap, m"""


def joined(some: Touching, more: Touching) -> Touching:
    """Return the contacts of both."""
    return Touching(*(np.concatenate(both) for both in zip(some, more, strict=True)))


NOTHING = Touching(np.empty(0, np.int64), np.empty(0, np.int64), *(np.empty(0, np.complex128) for _ in range(3)))
