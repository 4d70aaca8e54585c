"""Test of the states of all bodies against the bounds within which they are valid."""

import math

from sandbox.arrays import FloatArray
from sandbox.engines.common.base import FARTHEST, FASTEST
from sandbox.engines.common.kernel import bare_kernel as kernel


@kernel
def first_beyond(
    position: FloatArray, velocity: FloatArray, angle: FloatArray, spin: FloatArray, roll: FloatArray
) -> int:
    """Return the index of the first of N bodies that is not finite or out of bounds; −1 if there is none.

    Args:
        position: (N, 2) m, at most `FARTHEST` from the origin.
        velocity: (N, 2) m/s, at most `FASTEST`.
        angle: (N,) rad.
        spin: (N,) rad/s.
        roll: (N, 2) rad/s, about x and y.
    """
    for i in range(len(position)):
        # Comparisons with nan are false, so a nan anywhere makes `is_valid` false.
        is_valid = position[i, 0] ** 2 + position[i, 1] ** 2 <= FARTHEST * FARTHEST
        is_valid = is_valid and velocity[i, 0] ** 2 + velocity[i, 1] ** 2 <= FASTEST * FASTEST
        if not (is_valid and abs(spin[i]) + abs(angle[i]) + abs(roll[i, 0]) + abs(roll[i, 1]) < math.inf):
            return i
    return -1
