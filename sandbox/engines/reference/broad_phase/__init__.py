"""Broad phases: which pairs of balls are near enough to look at. BROAD_PHASES is the table of them.

Each is a kernel (order, position, radius, meets, moves, margin, keys) -> (found, tests). It writes the keys of
candidate pairs into `keys` (C,), each once, in any order, as far as there is room, and returns how many it found and
how many cheap tests that took. None loses a pair nearer than the margin, so after the narrow phase all agree.
`order` (N,) is a broad phase's own, from step to step.
"""

from collections.abc import Callable

from sandbox.engines.reference.broad_phase.all_pairs import all_pairs
from sandbox.engines.reference.broad_phase.circles import circles
from sandbox.engines.reference.broad_phase.grid import grid
from sandbox.engines.reference.broad_phase.sweep import sweep
from sandbox.trajectory import BoolArray, FloatArray, IntArray

BroadPhase = Callable[[IntArray, FloatArray, FloatArray, IntArray, BoolArray, float, IntArray], tuple[int, int]]

BROAD_PHASES: dict[str, BroadPhase] = {
    "all_pairs": all_pairs,
    "circles": circles,
    "sweep": sweep,
    "grid": grid,
}
