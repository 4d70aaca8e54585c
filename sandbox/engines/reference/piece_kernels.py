"""Compiled steps of a world of convex pieces."""

from typing import NamedTuple

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.frame_rows import FrameRows
from sandbox.engines.common.kernel import OptionalKernel, bare_kernel, inline_kernel
from sandbox.engines.reference.polygon_contacts import (
    ConvexHulls,
    NarrowPhaseInput,
    drop_excluded,
    find_body_contacts,
    find_fixed_segment_contacts,
    find_half_plane_contacts,
    transform_pieces,
)
from sandbox.engines.reference.step_kernels import (
    DONE,
    STOPPED,
    UNCHECKED,
    BodyColumns,
    CompiledJoints,
    SolverState,
    StepConstants,
    StepLog,
    StepScratch,
    WallColumns,
    find_near_pairs,
    find_near_segments,
    finish_substep,
    has_contacts,
    has_room,
    is_within,
    move_bodies,
    write_frame,
)


class PieceColumns(NamedTuple):
    """Arrays of S pieces of bodies and G segments, see `WorldPieces`. Only `corner` and `middle` change."""

    corner: FloatArray
    first: IntArray
    radius: FloatArray
    body: IntArray
    surface: IntArray
    local: FloatArray
    local_middle: FloatArray
    middle: FloatArray
    bounding_radius: FloatArray
    mask: IntArray
    moves: BoolArray
    can_touch: BoolArray
    excluded: IntArray
    group: IntArray
    points: FloatArray
    """(2, 6) memory of the narrow phase"""


@bare_kernel
def advance_pieces(
    number: StepConstants,
    bodies: BodyColumns,
    pieces: PieceColumns,
    walls: WallColumns,
    joints: CompiledJoints,
    state: SolverState,
    scratch: StepScratch,
    frames: FrameRows,
    path: FloatArray,
    log: StepLog,
    steps_before: int,
    steps: int,
    warm_start: float,
    until_contact: bool,
) -> tuple[int, int, int, int]:
    """Make steps, and write the frames that are due, as `advance_balls`."""
    written, size = 0, 0
    for k in range(steps):
        first = k * number.substeps
        if k > 0 and not has_room(log, first, number.substeps * (2 * size + 64)):  # the first step always begins
            return k, 0, written, DONE
        for s in range(number.substeps):
            move_bodies(number, bodies, state, scratch, (steps_before + k) * number.dt + s * number.h)
            size, broad_tests, pair_tests = find_contacts(number, bodies, pieces, walls, state, scratch)
            if size < 0 or not has_room(log, first + s, size):
                return k, s, written, STOPPED
            tests = broad_tests, pair_tests
            finish_substep(number, bodies, joints, state, scratch, path, log, first + s, size, tests, warm_start)
            warm_start = 1.0
        if not is_within(number, bodies, state.x):
            return k, 0, written, UNCHECKED
        written = write_frame(number, state, frames, written, k, steps_before)
        if until_contact and has_contacts(log, first, number.substeps):
            return k + 1, 0, written, DONE
    return steps, 0, written, DONE


PIECE_KERNEL = OptionalKernel(advance_pieces, compile_time=23.0)
"""Decides whether `advance_pieces` is used; its time to compile was measured"""


@inline_kernel
def find_contacts(
    number: StepConstants,
    bodies: BodyColumns,
    pieces: PieceColumns,
    walls: WallColumns,
    state: SolverState,
    scratch: StepScratch,
) -> tuple[int, int, int]:
    """Write the contacts of `placed`, as `ConvexPipeline`; return their number and those of cheap and exact tests.

    The number is −1 if there are more than fit, or if the broad phase has to be prepared anew.
    """
    position, size, out = scratch.placed[0], 0, scratch.out
    transform_pieces(
        pieces.body,
        pieces.first,
        pieces.local,
        pieces.local_middle,
        position,
        position[:, 2],
        pieces.corner,
        pieces.middle,
    )
    hulls = ConvexHulls(pieces.corner, pieces.first, pieces.radius, pieces.body, pieces.surface)
    query = NarrowPhaseInput(bodies.tangential, 0.0, pieces.points)
    middle, radius, keys, wall_keys = pieces.middle, pieces.bounding_radius, scratch.pair_keys, scratch.segment_keys
    pairs, pair_tests = find_near_pairs(number, state, middle, radius, pieces.mask, pieces.moves, keys)
    near, wall_tests = find_near_segments(number, walls, middle, radius, pieces.can_touch, wall_keys)
    if pairs < 0 or near < 0:
        return -1, 0, 0
    if pairs:
        pairs = drop_excluded(keys[:pairs], pieces.body, pieces.excluded, pieces.group)
        size = find_body_contacts(keys[:pairs], hulls, position, query, out, size)
    if len(walls.planes) and number.plane_tests:
        planes = walls.planes, walls.plane_collider, walls.collider_surface
        size = find_half_plane_contacts(hulls, pieces.can_touch, position, *planes, query, out, size)
    if near:
        joined = walls.segment_joints, walls.segment_collider, walls.collider_surface
        size = find_fixed_segment_contacts(wall_keys[:near], hulls, position, *joined, query, out, size)
    exact_tests = pairs + near + number.plane_tests
    return (-1 if size > min(len(out.key), number.max_contacts) else size), pair_tests + wall_tests, exact_tests
