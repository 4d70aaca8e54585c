"""Bounding circles: a pair is handed on when the circles around the two overlap. O(N²), a cheap test each."""

from sandbox.engines.kernel import kernel
from sandbox.engines.reference.meeting import may_meet, pair_key
from sandbox.trajectory import BoolArray, FloatArray, IntArray


@kernel
def circles(
    order: IntArray,  # noqa: ARG001, all broad phases are called alike
    position: FloatArray,
    radius: FloatArray,
    meets: IntArray,
    moves: BoolArray,
    margin: float,
    keys: IntArray,
) -> tuple[int, int]:
    """Hand on the pairs whose bounding circles, widened by the margin, overlap."""
    found, tests = 0, 0
    for i in range(len(position)):
        for j in range(i + 1, len(position)):
            if may_meet(meets[i], moves[i], meets[j], moves[j]):
                tests += 1
                x, y = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
                reach = radius[i] + radius[j] + margin
                if x * x + y * y <= reach * reach:
                    if found < len(keys):
                        keys[found] = pair_key(i, j)
                    found += 1
    return found, tests
