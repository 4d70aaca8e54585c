"""All pairs: no test at all; everything that may meet is handed on. O(N²)."""

from sandbox.engines.kernel import kernel
from sandbox.engines.reference.meeting import may_meet, pair_key
from sandbox.trajectory import BoolArray, FloatArray, IntArray


@kernel
def all_pairs(
    order: IntArray,  # noqa: ARG001, all broad phases are called alike
    position: FloatArray,
    radius: FloatArray,  # noqa: ARG001
    meets: IntArray,
    moves: BoolArray,
    margin: float,  # noqa: ARG001
    keys: IntArray,
) -> tuple[int, int]:
    """Hand on every pair that may meet."""
    found = 0
    for i in range(len(position)):
        for j in range(i + 1, len(position)):
            if may_meet(meets[i], moves[i], meets[j], moves[j]):
                if found < len(keys):
                    keys[found] = pair_key(i, j)
                found += 1
    return found, 0
