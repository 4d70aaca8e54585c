"""Packing: places of many bodies over many frames as whole numbers of 16 bits, for a script to unpack.

A coordinate is rounded to 1/65534 of the box that is kept, an angle to 1/65536 of a turn. What is stored is how each
number differs from where the last two point, low bytes apart from high ones: smooth motion leaves little to tell.
"""

import base64
import math
import zlib
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sandbox.arrays import BoolArray, FloatArray

ABSENT = 65535
"""As x: the body is not there, or outside the box."""
LEVELS = 65534
Words = npt.NDArray[np.uint16]


@dataclass(frozen=True)
class Crate:
    """The square that is kept, m."""

    x: float
    y: float
    """its lower left corner"""
    side: float

    @property
    def step(self) -> float:
        """To which coordinates are rounded, m: nothing is off by more than half of it."""
        return self.side / LEVELS


def rounded(position: FloatArray, there: BoolArray, crate: Crate) -> Words:
    """Return places (F, N, 2), m, as numbers of steps from the corner; `ABSENT` in x where nothing is to be seen.

    Args:
        position: m; nan where a body is not there.
        there: (F, N) false where it is not there although it has a place.
        crate: what is kept.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        steps = np.rint((position - (crate.x, crate.y)) / crate.step)
        seen = there & ((steps >= 0.0) & (steps <= LEVELS)).all(axis=2)  # false of nan, too
    words = np.where(seen[..., None], steps, 0.0).astype(np.uint16)
    words[..., 0][~seen] = ABSENT
    return words


def turned(angle: FloatArray) -> Words:
    """Return angles, rad, as parts of 65536 of a turn; what is not finite as 0."""
    with np.errstate(invalid="ignore"):
        parts = np.rint(np.mod(angle, 2.0 * math.pi) * (65536.0 / (2.0 * math.pi)))
    return np.asarray(np.where(np.isfinite(parts), parts, 0.0).astype(np.int64) & 0xFFFF, dtype=np.uint16)


def packed(words: Words) -> str:
    """Return numbers (F, …), one row a frame, as text: second differences, deflated, in base 64."""
    signed = words.astype(np.int64)
    signed[1:] -= words[:-1].astype(np.int64)
    second = signed.copy()
    second[2:] -= signed[1:-1]
    second[1:2] = signed[1:2]
    flat = (second & 0xFFFF).astype("<u2").reshape(-1)
    planes = np.concatenate(((flat & 0xFF).astype(np.uint8), (flat >> 8).astype(np.uint8)))
    return base64.b64encode(zlib.compress(planes.tobytes(), 9)).decode("ascii")


def unpacked(text: str, shape: tuple[int, ...]) -> Words:
    """Return what `packed` was given; `replay.js` does the same.

    Raises:
        ValueError: the text holds another count of numbers.
    """
    planes = np.frombuffer(zlib.decompress(base64.b64decode(text)), np.uint8).astype(np.uint16)
    half = len(planes) // 2
    if len(planes) % 2 or half != math.prod(shape):
        raise ValueError(f"{half} numbers, not {shape}")
    words = (planes[:half] | planes[half:] << 8).reshape(shape)
    if len(words) > 1:
        words[1:] = np.cumsum(words[1:], axis=0, dtype=np.uint16)
    return np.cumsum(words, axis=0, dtype=np.uint16)
