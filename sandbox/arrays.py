"""Types of numpy arrays, one definition for the package. Shapes are given where they are used, as in (N, 2)."""

import hashlib
from collections.abc import Iterable
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
ComplexArray = npt.NDArray[np.complex128]
"""2-vectors as complex numbers"""

Number = TypeVar("Number", float, FloatArray)
"""A number, or an array of them"""


def state_hash(time: float, arrays: Iterable[npt.NDArray[Any]]) -> str:
    """Return the SHA-256 hash of a time, s, and of the exact contents of arrays."""
    digest = hashlib.sha256(np.float64(time).tobytes())
    for array in arrays:
        digest.update(array.tobytes())
    return digest.hexdigest()
