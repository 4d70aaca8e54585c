"""Meeting: which pairs may touch at all, and the keys that number pairs."""

from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.engines.roster import ALL, FIXED
from sandbox.trajectory import IntArray

FIRST = 30
"""Bits below the first number in the key of a pair: a scene holds fewer bodies, and fewer segments, than 2³⁰."""
SECOND = (1 << FIRST) - 1
"""The bits of the second."""

ROUNDING = 1e-15
"""What two edges, x ± r, can be off by together, as a part of what is added up in them: four roundings, and a bit.
Boxes are widened by it, or far from the origin they would lose pairs whose centres are near enough."""


@kernel
def pair_key(i: int, j: int) -> int:
    """Return the key of a pair; keys ascend as pairs do."""
    return (i << FIRST) + j


@kernel
def listed(keys: IntArray, key: int) -> bool:
    """Tell whether a key is among keys (K,) that ascend."""
    low, high = 0, len(keys)
    while low < high:
        middle = (low + high) // 2
        if keys[middle] < key:
            low = middle + 1
        else:
            high = middle
    return low < len(keys) and keys[low] == key


@kernel
def may_meet(meets_a: int, moves_a: bool, meets_b: int, moves_b: bool) -> bool:
    """Tell whether two bodies can touch: both move and meet all, or one is fixed and the other meets what is fixed."""
    if moves_a and moves_b:
        return meets_a == ALL and meets_b == ALL
    if moves_a:
        return meets_a >= FIXED and meets_b == ALL
    return moves_b and meets_b >= FIXED and meets_a == ALL
