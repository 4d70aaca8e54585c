"""Compiled steps of a world of balls."""

from typing import NamedTuple

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.frame_rows import FrameRows
from sandbox.engines.common.kernel import OptionalKernel, bare_kernel, inline_kernel
from sandbox.engines.reference.manifold import find_ball_contacts, find_plane_contacts, find_segment_contacts
from sandbox.engines.reference.polygon_contacts import drop_excluded
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


class BallColumns(NamedTuple):
    """Arrays of N balls that do not change from step to step."""

    radius: FloatArray
    surface: IntArray
    mask: IntArray
    moves: BoolArray
    can_touch: BoolArray
    owner: IntArray
    """(N,) index of each ball, the body that it belongs to"""
    excluded: IntArray
    """keys of pairs that joints exclude from collision"""
    group: IntArray


@bare_kernel
def advance_balls(
    number: StepConstants,
    bodies: BodyColumns,
    balls: BallColumns,
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
    """Make steps, and write the frames that are due.

    Args:
        number: numbers.
        bodies: constant arrays.
        balls: likewise.
        walls: likewise.
        joints: the joints.
        state: the state.
        scratch: memory.
        frames: rows for the frames.
        path: (B + 1, N, 2) m, for the centres after each substep from row 1 on; (0, 0, 2) without an observer.
        log: rows for the contacts.
        steps_before: number of steps made before.
        steps: largest number of steps.
        warm_start: factor of the warm-start impulses of the first substep.
        until_contact: whether the first step with contacts is the last one.

    Returns:
        Whole steps; substeps of the step that is not complete; frames; return code.
    """
    written, size = 0, 0
    for k in range(steps):
        first = k * number.substeps
        if k > 0 and not has_room(log, first, number.substeps * (2 * size + 64)):  # the first step always begins
            return k, 0, written, DONE
        for s in range(number.substeps):
            move_bodies(number, bodies, state, scratch, (steps_before + k) * number.dt + s * number.h)
            size, broad_tests, pair_tests = find_contacts(number, bodies, balls, walls, state, scratch)
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


BALL_KERNEL = OptionalKernel(advance_balls, compile_time=18.0)
"""Decides whether `advance_balls` is used; its time to compile was measured"""


@inline_kernel
def find_contacts(
    number: StepConstants,
    bodies: BodyColumns,
    balls: BallColumns,
    walls: WallColumns,
    state: SolverState,
    scratch: StepScratch,
) -> tuple[int, int, int]:
    """Write the contacts of `placed`; return their number and those of cheap and exact tests.

    The number is −1 if there are more than fit, or if the broad phase has to be prepared anew.
    """
    position, radius, size, out = scratch.placed[0], balls.radius, 0, scratch.out
    keys, wall_keys = scratch.pair_keys, scratch.segment_keys
    pairs, pair_tests = find_near_pairs(number, state, position, radius, balls.mask, balls.moves, keys)
    near, wall_tests = find_near_segments(number, walls, position, radius, balls.can_touch, wall_keys)
    if pairs < 0 or near < 0:
        return -1, 0, 0
    if pairs:
        if len(balls.excluded) or balls.group.any():
            pairs = drop_excluded(keys[:pairs], balls.owner, balls.excluded, balls.group)
        size = find_ball_contacts(keys[:pairs], position, radius, balls.surface, bodies.tangential, 0.0, out, size)
    if len(walls.planes) and number.plane_tests:
        size = find_plane_contacts(
            position,
            radius,
            balls.can_touch,
            balls.surface,
            walls.planes,
            walls.plane_collider,
            walls.collider_surface,
            bodies.tangential,
            0.0,
            out,
            size,
        )
    if near:
        size = find_segment_contacts(
            wall_keys[:near],
            position,
            radius,
            balls.surface,
            walls.segments,
            walls.segment_joints,
            walls.segment_collider,
            walls.collider_surface,
            bodies.tangential,
            0.0,
            out,
            size,
        )
    exact_tests = pairs + near + number.plane_tests
    return (-1 if size > min(len(out.key), number.max_contacts) else size), pair_tests + wall_tests, exact_tests
