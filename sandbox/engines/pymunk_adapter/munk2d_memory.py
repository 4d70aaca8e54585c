"""Memory of Munk2D: lists of bodies and contacts, and the contact points of an arbiter.

pymunk's public calls return the impulse of a pair of shapes, which does not determine the angular impulse of polygons
that touch in two points. The layouts are those that pymunk itself declares, and that were checked against Munk2D's
headers when pymunk was compiled; a field that is renamed raises an error at import.
"""

from typing import Any

import numpy as np
import numpy.typing as npt
from pymunk._chipmunk_cffi import ffi, lib
from pymunk.batch import ArbiterFields, BodyFields, Buffer

WORD = ffi.sizeof("uintptr_t")
"""bytes of an integer in a buffer"""

LIST_BODY = ffi.addressof(lib, "pmSpaceBodyGetIteratorFuncBatched")
"""Function that writes the state of a body into a buffer."""

LIST_CONTACT = ffi.addressof(lib, "pmSpaceArbiterIteratorFuncBatched")
"""Function that writes an arbiter into a buffer. `get_space_arbiters` looks it up at each call, which takes as long as
the call itself."""


class Listing:
    """A buffer into which Munk2D lists bodies or contacts.

    The memory of a buffer moves when it grows, and each new buffer leaks: keep one of each kind, and copy its contents.
    """

    def __init__(self, fields: BodyFields | ArbiterFields) -> None:
        """Create an empty buffer for some fields."""
        self.buffer = Buffer()
        self.integers, self._numbers = self.buffer._int_arr, self.buffer._float_arr
        self.data = ffi.new("pmBatchedData *")
        """the struct that Munk2D's functions take"""
        self.data.intArray, self.data.floatArray, self.data.fields = self.integers, self._numbers, fields.value

    def clear(self) -> None:
        """Remove the contents."""
        self.integers.num = self._numbers.num = 0

    def words(self) -> bytes:
        """Return a copy of the integers."""
        return ffi.buffer(self.integers.arr, self.integers.num * WORD)[:] if self.integers.num else b""

    def numbers(self, dtype: npt.DTypeLike = np.float64) -> npt.NDArray[Any]:
        """Return the numbers, valid until the next list."""
        return np.frombuffer(self.buffer.float_buf(), dtype) if self._numbers.num else np.empty(0, dtype)


CONTACT_POINT = np.dtype(
    {
        "names": [name for name, _ in ffi.typeof("struct cpContact").fields],
        "formats": [
            {"double": "f8", "struct cpVect": "2f8", "uintptr_t": "u8"}[field.type.cname]
            for _, field in ffi.typeof("struct cpContact").fields
        ],
        "offsets": [field.offset for _, field in ffi.typeof("struct cpContact").fields],
        "itemsize": ffi.sizeof("struct cpContact"),
    }
)
"""A contact point: r1, r2 (m, from each centre to the point), jnAcc, jtAcc (N·s, impulses along the normal and to its
left), and what the solver keeps."""


def points_of(arbiter: Any) -> npt.NDArray[Any]:
    """Return a copy of the contact points of a `cpArbiter`, (C,) of `CONTACT_POINT`."""
    return np.frombuffer(ffi.buffer(arbiter.contacts, CONTACT_POINT.itemsize * arbiter.count)[:], CONTACT_POINT).copy()


def address_of(arbiter: Any) -> int:
    """Return the address of a `cpArbiter`."""
    return int(ffi.cast("uintptr_t", arbiter))
