"""Sweep: boxes sorted along x; only those whose x ranges overlap are tested in y (Baraff 1992, sort and sweep).

O(N log N + pairs that overlap in x). Suits scenes that are wide, and balls of very different sizes.
"""

from sandbox.engines.kernel import kernel
from sandbox.engines.reference.meeting import ROUNDING, may_meet, pair_key
from sandbox.trajectory import BoolArray, FloatArray, IntArray


@kernel
def sweep(
    order: IntArray,
    position: FloatArray,
    radius: FloatArray,
    meets: IntArray,
    moves: BoolArray,
    margin: float,
    keys: IntArray,
) -> tuple[int, int]:
    """Hand on the pairs whose axis-aligned boxes, widened by the margin, overlap.

    `order` (N,) was the order from left to right a step ago; it is brought up to date. Little changes in a step, so
    that insertion is nearly linear.
    """
    for k in range(1, len(order)):
        moving, place = order[k], k
        left = position[moving, 0] - radius[moving]
        while place > 0 and position[order[place - 1], 0] - radius[order[place - 1]] > left:
            order[place] = order[place - 1]
            place -= 1
        order[place] = moving

    found, tests = 0, 0
    for k in range(len(order)):
        i = order[k]
        reach = radius[i] + margin
        right = position[i, 0] + reach + ROUNDING * (abs(position[i, 0]) + reach)
        for next_k in range(k + 1, len(order)):
            j = order[next_k]
            if position[j, 0] - radius[j] > right:
                break
            if may_meet(meets[i], moves[i], meets[j], moves[j]):
                tests += 1
                if abs(position[j, 1] - position[i, 1]) <= radius[i] + radius[j] + margin:
                    if found < len(keys):
                        keys[found] = pair_key(min(i, j), max(i, j))
                    found += 1
    return found, tests
