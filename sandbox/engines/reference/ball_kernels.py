"""Compiled steps of a world of balls.

`advance_balls` makes the steps that `step.step` defines, by the same kernels in the same order, for worlds that need
nothing between two substeps: balls under gravity and drag, discrete detection, impulses. It stops before a substep that
needs more memory or another path; the readable step then makes it. Tests compare the two, bit for bit. `ball_stepper`
prepares the arrays.
"""

import math
from typing import NamedTuple

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.base import FARTHEST, FASTEST
from sandbox.engines.common.frame_rows import FrameRows, is_due, write_row
from sandbox.engines.common.kernel import OptionalKernel, bare_kernel, inline_kernel
from sandbox.engines.reference.broad_phase import EXCEEDED, all_pairs, grid, near_segments
from sandbox.engines.reference.manifold import (
    CONTACT_ROUNDING,
    Manifolds,
    find_ball_contacts,
    find_plane_contacts,
    find_segment_contacts,
)
from sandbox.engines.reference.sequential_impulses import (
    approach,
    match_impulses,
    rebound_speeds,
    solve_overlaps,
    solve_velocities,
)

EXPLICIT_EULER, SEMI_IMPLICIT_EULER, VELOCITY_VERLET, LEAPFROG, RK4 = range(5)
INTEGRATOR_CODES = {
    "explicit_euler": EXPLICIT_EULER,
    "semi_implicit_euler": SEMI_IMPLICIT_EULER,
    "velocity_verlet": VELOCITY_VERLET,
    "leapfrog": LEAPFROG,
    "rk4": RK4,
}

NO_PAIRS, ALL_PAIRS, GRID = range(3)
BROAD_PHASE_CODES = {"all_pairs": ALL_PAIRS, "grid": GRID}
"""The default broad phases. Each further one would take half a second longer to compile."""

KEYS, HAS_PSEUDO_VELOCITY, BROAD_TESTS, PAIR_TESTS, CONTACTS, CONTACT_ITERATIONS = range(6)
"""Indices of `BallState.counts`: number of warm-start impulses; 1 if a pseudo-velocity is not 0; work counters."""


class BallConstants(NamedTuple):
    """Numbers that do not change from step to step."""

    h: float
    """substep, s"""
    dt: float
    """step, s"""
    substeps: int
    iterations: int
    integrator: int
    """code of the integrator"""
    fraction: float
    """`Integrator.fraction`"""
    slop: float
    """m"""
    correction: float
    """1/s, target separation rate for each metre of overlap beyond the slop, negative"""
    linear_drag: float
    """1/s"""
    quadratic_drag: float
    """1/m"""
    wind_x: float
    """m/s"""
    wind_y: float
    broad_phase: int
    """code of the broad phase; `NO_PAIRS` if balls cannot touch each other"""
    max_tests: int
    """largest number of pairs that a broad phase may test"""
    max_contacts: int
    """largest number of contacts of a substep"""
    segment_width: float
    """m, largest width of a segment's box"""
    plane_tests: int
    """pairs of a ball and a plane"""


class BallColumns(NamedTuple):
    """Arrays that do not change from step to step, of N balls, S surfaces, P planes and G segments."""

    constant: FloatArray
    """(N, 3) acceleration, m/s²"""
    mobile: FloatArray
    """(N,) 1 for balls with drag, 0 for others"""
    radius: FloatArray
    surface: IntArray
    mask: IntArray
    moves: BoolArray
    can_touch: BoolArray
    inverse_mass: FloatArray
    inverse_moment: FloatArray
    friction: FloatArray
    """(S, S)"""
    restitution: FloatArray
    """(S·S,)"""
    planes: FloatArray
    plane_collider: IntArray
    collider_surface: IntArray
    segments: FloatArray
    segment_joints: FloatArray
    segment_collider: IntArray
    segment_box: FloatArray
    segment_index: IntArray


class BallState(NamedTuple):
    """State that the steps change."""

    x: FloatArray
    """(2, N, 3)"""
    key: IntArray
    """(C,) keys of the warm-start impulses; the first `KEYS` count"""
    impulse: FloatArray
    """(C, 2) N·s"""
    pseudo_velocity: FloatArray
    """(N, 3)"""
    order: IntArray
    """order of the broad phase"""
    counts: IntArray
    """(6,)"""


class BallScratch(NamedTuple):
    """Memory of a substep."""

    placed: FloatArray
    """(2, N, 3) state at its end without contacts"""
    after: FloatArray
    """(2, N, 3) state at its end"""
    change: FloatArray
    """(N, 3)"""
    ball_keys: IntArray
    segment_keys: IntArray
    out: Manifolds
    bounce: FloatArray
    """(C,)"""
    impulse: FloatArray
    """(C, 2)"""
    target: FloatArray
    """(C,)"""
    total: FloatArray
    """(C,)"""


class BallLog(NamedTuple):
    """Contacts of the substeps of a call."""

    end: IntArray
    """(B + 1,) rows up to the end of each substep, from entry 1 on; (0,) if contacts are not recorded"""
    same: BoolArray
    """(B,) whether the pairs are those of the substep before"""
    pair: IntArray
    """(C, 2)"""
    vectors: FloatArray
    """(C, 6) impulse along the normal and to the left of it, N·s; normal; point, m"""


DONE, STOPPED, BEYOND = range(3)
"""Return codes of `advance_balls`: the steps were made, or the log is nearly full; a substep needs another path; a ball
is not finite or out of bounds after the last step."""


@bare_kernel
def advance_balls(
    number: BallConstants,
    arrays: BallColumns,
    state: BallState,
    scratch: BallScratch,
    frames: FrameRows,
    path: FloatArray,
    log: BallLog,
    steps_before: int,
    steps: int,
    warm_start: float,
) -> tuple[int, int, int, int]:
    """Make steps, and write the frames that are due.

    Args:
        number: numbers.
        arrays: constant arrays.
        state: the state.
        scratch: memory.
        frames: rows for the frames.
        path: (B + 1, N, 2) m, for the centres after each substep from row 1 on; (0, 0, 2) without an observer.
        log: rows for the contacts.
        steps_before: number of steps made before.
        steps: largest number of steps.
        warm_start: factor of the warm-start impulses of the first substep.

    Returns:
        Whole steps; substeps of the step that is not complete; frames; return code.
    """
    written, last_size, out = 0, 0, scratch.out
    records, observes = len(log.end) > 0, len(path) > 0
    for k in range(steps):
        begin = k * number.substeps
        if records and log.end[begin] + number.substeps * (2 * last_size + 64) > len(log.pair):
            return k, 0, written, DONE
        for s in range(number.substeps):
            move_balls(number, arrays, state, scratch)
            size, broad_tests, pair_tests = find_contacts(number, arrays, state, scratch)
            if size < 0 or (records and log.end[begin + s] + size > len(log.pair)):
                return k, s, written, STOPPED
            state.counts[BROAD_TESTS] += broad_tests
            state.counts[PAIR_TESTS] += pair_tests
            state.counts[CONTACTS] += size
            # Written out, because a kernel that creates no arrays cannot return any.
            contacts = Manifolds(
                out.key[:size],
                out.first[:size],
                out.second[:size],
                out.normal[:size],
                out.separation[:size],
                out.point[:size],
                out.anchor[:size],
                out.offset[:size],
                out.friction[:size],
                out.surface_pair[:size],
            )
            solve_contacts(number, arrays, state, scratch, contacts, warm_start)
            correct_overlap(number, arrays, state, scratch, contacts)
            copy_state(scratch.after, state.x)
            warm_start = 1.0
            if records:
                last_size = size
                log_contacts(arrays, scratch, log, size, begin + s)
            if observes:
                for i in range(len(arrays.radius)):
                    path[begin + s + 1, i, 0] = state.x[0, i, 0]
                    path[begin + s + 1, i, 1] = state.x[0, i, 1]
        if not is_within(state.x):
            return k, 0, written, BEYOND
        if is_due(frames, k + 1):
            pose, rate = state.x[0], state.x[1]
            write_row(frames, written, (steps_before + k + 1) * number.dt, pose, rate, pose[:, 2], rate[:, 2])
            written += 1
    return steps, 0, written, DONE


KERNEL = OptionalKernel(advance_balls, compile_time=10.0)
"""Decides whether `advance_balls` is used; its time to compile was measured"""


@bare_kernel
def acceleration(
    ax: float, ay: float, vx: float, vy: float, linear: float, quadratic: float, wind_x: float, wind_y: float
) -> tuple[float, float]:
    """Return the acceleration of a ball with drag at a velocity, as `integrators.transition`; (ax, ay) without drag."""
    if linear > 0.0 or quadratic > 0.0:
        wx, wy = vx - wind_x, vy - wind_y
        rate = linear + quadratic * math.sqrt(wx * wx + wy * wy)
        return ax - rate * wx, ay - rate * wy
    return ax, ay


@inline_kernel
def move_balls(number: BallConstants, arrays: BallColumns, state: BallState, scratch: BallScratch) -> None:
    """Write the motion over h without contacts into `placed`, with the overlap of the last substep corrected.

    The integrators are those of `integrators`, with the same operations in the same order.
    """
    h, method, x, placed = number.h, number.integrator, state.x, scratch.placed
    damped = number.linear_drag > 0.0 or number.quadratic_drag > 0.0
    wind_x, wind_y = number.wind_x, number.wind_y
    for i in range(len(arrays.radius)):
        px, py, vx, vy = x[0, i, 0], x[0, i, 1], x[1, i, 0], x[1, i, 1]
        gx, gy, linear, quadratic = arrays.constant[i, 0], arrays.constant[i, 1], 0.0, 0.0
        if arrays.mobile[i] != 0.0:
            linear, quadratic = number.linear_drag, number.quadratic_drag
        ax, ay = acceleration(gx, gy, vx, vy, linear, quadratic, wind_x, wind_y)
        if method == EXPLICIT_EULER:
            px, py, vx, vy = px + h * vx, py + h * vy, vx + h * ax, vy + h * ay
        elif method == SEMI_IMPLICIT_EULER:
            vx, vy = vx + h * ax, vy + h * ay
            px, py = px + h * vx, py + h * vy
        elif method == VELOCITY_VERLET:
            px, py = px + h * (vx + (0.5 * h) * ax), py + h * (vy + (0.5 * h) * ay)
            bx, by = acceleration(gx, gy, vx + h * ax, vy + h * ay, linear, quadratic, wind_x, wind_y)
            vx, vy = vx + (0.5 * h) * (ax + bx), vy + (0.5 * h) * (ay + by)
        elif method == LEAPFROG:
            px, py = px + (0.5 * h) * vx, py + (0.5 * h) * vy
            if damped:
                ax, ay = acceleration(
                    gx, gy, vx + (0.5 * h) * ax, vy + (0.5 * h) * ay, linear, quadratic, wind_x, wind_y
                )
            vx, vy = vx + h * ax, vy + h * ay
            px, py = px + (0.5 * h) * vx, py + (0.5 * h) * vy
        else:
            v2x, v2y = vx + h * (0.5 * ax), vy + h * (0.5 * ay)
            bx, by = acceleration(gx, gy, v2x, v2y, linear, quadratic, wind_x, wind_y)
            v3x, v3y = vx + h * (0.5 * bx), vy + h * (0.5 * by)
            cx, cy = acceleration(gx, gy, v3x, v3y, linear, quadratic, wind_x, wind_y)
            v4x, v4y = vx + h * cx, vy + h * cy
            dx, dy = acceleration(gx, gy, v4x, v4y, linear, quadratic, wind_x, wind_y)
            sixth, third = 1 / 6, 1 / 3
            px += h * (sixth * vx + third * v2x + third * v3x + sixth * v4x)
            py += h * (sixth * vy + third * v2y + third * v3y + sixth * v4y)
            vx += h * (sixth * ax + third * bx + third * cx + sixth * dx)
            vy += h * (sixth * ay + third * by + third * cy + sixth * dy)
        placed[0, i, 0], placed[0, i, 1], placed[1, i, 0], placed[1, i, 1] = px, py, vx, vy
        placed[0, i, 2], placed[1, i, 2] = turned(method, x[0, i, 2], x[1, i, 2], arrays.constant[i, 2], h)
    if state.counts[HAS_PSEUDO_VELOCITY] != 0:
        for i in range(len(arrays.radius)):
            for axis in range(3):
                placed[0, i, axis] += h * state.pseudo_velocity[i, axis]


@bare_kernel
def turned(method: int, angle: float, spin: float, alpha: float, h: float) -> tuple[float, float]:
    """Return the angle and spin after h under a constant angular acceleration, by an integrator."""
    if method == EXPLICIT_EULER:
        return angle + h * spin, spin + h * alpha
    if method == SEMI_IMPLICIT_EULER:
        spin += h * alpha
        return angle + h * spin, spin
    if method == VELOCITY_VERLET:
        return angle + h * (spin + (0.5 * h) * alpha), spin + (0.5 * h) * (alpha + alpha)
    if method == LEAPFROG:
        angle += (0.5 * h) * spin
        spin += h * alpha
        return angle + (0.5 * h) * spin, spin
    second, third_spin, last = spin + h * (0.5 * alpha), spin + h * (0.5 * alpha), spin + h * alpha
    sixth, third = 1 / 6, 1 / 3
    angle += h * (sixth * spin + third * second + third * third_spin + sixth * last)
    return angle, spin + h * (sixth * alpha + third * alpha + third * alpha + sixth * alpha)


@inline_kernel
def sort_keys(keys: IntArray, count: int) -> None:
    """Sort the first keys of a buffer by insertion; those of the broad phases are nearly in order."""
    for k in range(1, count):
        key, target = keys[k], k
        while target > 0 and keys[target - 1] > key:
            keys[target] = keys[target - 1]
            target -= 1
        keys[target] = key


@inline_kernel
def find_contacts(
    number: BallConstants, arrays: BallColumns, state: BallState, scratch: BallScratch
) -> tuple[int, int, int]:
    """Write the contacts of `placed`; return their number and those of cheap and exact tests.

    The number is −1 if there are more than fit, or if the broad phase has to be prepared anew.
    """
    position, radius, out = scratch.placed[0], arrays.radius, scratch.out
    size, broad_tests, pair_tests = 0, 0, number.plane_tests
    if number.broad_phase != NO_PAIRS:
        keys, given = scratch.ball_keys, (position, radius, arrays.mask, arrays.moves)
        if number.broad_phase == ALL_PAIRS:
            found, tests = all_pairs(state.order, *given, 0.0, number.max_tests, keys)
        else:
            found, tests = grid(state.order, *given, 0.0, number.max_tests, keys)
        if tests == EXCEEDED or found > len(keys):
            return -1, 0, 0
        broad_tests += tests
        pair_tests += found
        if found:
            sort_keys(keys, found)
            size = find_ball_contacts(keys[:found], position, radius, arrays.surface, arrays.friction, 0.0, out, size)
    if len(arrays.planes) and number.plane_tests:
        size = find_plane_contacts(
            position,
            radius,
            arrays.can_touch,
            arrays.surface,
            arrays.planes,
            arrays.plane_collider,
            arrays.collider_surface,
            arrays.friction,
            0.0,
            out,
            size,
        )
    if len(arrays.segment_index):
        keys = scratch.segment_keys
        found, tests = near_segments(
            position,
            radius,
            arrays.can_touch,
            arrays.segment_box,
            arrays.segment_index,
            number.segment_width,
            0.0,
            number.max_tests,
            keys,
        )
        if tests == EXCEEDED or found > len(keys):
            return -1, 0, 0
        broad_tests += tests
        pair_tests += found
        if found:
            sort_keys(keys, found)
            size = find_segment_contacts(
                keys[:found],
                position,
                radius,
                arrays.surface,
                arrays.segments,
                arrays.segment_joints,
                arrays.segment_collider,
                arrays.collider_surface,
                arrays.friction,
                0.0,
                out,
                size,
            )
    return (-1 if size > len(out.key) or size > number.max_contacts else size), broad_tests, pair_tests


@inline_kernel
def solve_contacts(
    number: BallConstants,
    arrays: BallColumns,
    state: BallState,
    scratch: BallScratch,
    contacts: Manifolds,
    warm_start: float,
) -> None:
    """Write the state at the end of a substep, with contacts that act through it, as `ImpulseSolver.solve`."""
    placed, after, size = scratch.placed, scratch.after, len(contacts.key)
    copy_state(placed, after)
    if size == 0:
        return
    bounce, impulse = scratch.bounce[:size], scratch.impulse[:size]
    start, velocity = state.x[1], after[1]
    rebound_speeds(contacts, start, start[:, 2], arrays.restitution, bounce)
    impulse[:] = 0.0
    known = state.counts[KEYS]
    match_impulses(contacts.key, state.key[:known], state.impulse[:known], impulse)
    for k in range(size):
        impulse[k, 0] *= warm_start
        impulse[k, 1] *= warm_start
    inverse = arrays.inverse_mass, arrays.inverse_moment
    solve_velocities(contacts, bounce, velocity, velocity[:, 2], *inverse, impulse, number.iterations)
    state.counts[CONTACT_ITERATIONS] += size * number.iterations
    if number.fraction != 0.0:
        change, part = scratch.change, number.fraction * number.h
        for i in range(len(arrays.radius)):
            for axis in range(3):
                change[i, axis] = after[1, i, axis] - placed[1, i, axis]
                after[0, i, axis] += part * change[i, axis]
        approach(contacts, change, change[:, 2], bounce)
        for k in range(size):
            contacts.separation[k] += part * bounce[k]


@inline_kernel
def correct_overlap(
    number: BallConstants, arrays: BallColumns, state: BallState, scratch: BallScratch, contacts: Manifolds
) -> None:
    """Find the velocities that correct overlap in the next substep, as `ImpulseSolver.correct`; store impulses."""
    if state.counts[HAS_PSEUDO_VELOCITY] != 0:
        state.counts[HAS_PSEUDO_VELOCITY] = 0
        state.pseudo_velocity[:] = 0.0
    state.counts[KEYS] = size = len(contacts.key)
    if size == 0:
        return
    target, total, overlaps = scratch.target[:size], scratch.total[:size], False
    for k in range(size):
        state.key[k] = contacts.key[k]
        state.impulse[k, 0], state.impulse[k, 1] = scratch.impulse[k, 0], scratch.impulse[k, 1]
        target[k] = number.correction * min(contacts.separation[k] + number.slop, 0.0)
        total[k] = 0.0
        overlaps = overlaps or target[k] != 0.0
    if overlaps:
        state.counts[HAS_PSEUDO_VELOCITY] = 1
        state.counts[CONTACT_ITERATIONS] += size * number.iterations
        inverse = arrays.inverse_mass, arrays.inverse_moment
        solve_overlaps(contacts, target, state.pseudo_velocity, *inverse, total, number.iterations)


@inline_kernel
def copy_state(source: FloatArray, target: FloatArray) -> None:
    """Copy a state (2, N, 3)."""
    for order in range(2):
        for i in range(source.shape[1]):
            for axis in range(3):
                target[order, i, axis] = source[order, i, axis]


@inline_kernel
def is_within(x: FloatArray) -> bool:
    """Return whether all balls are finite and within the bounds of position and speed."""
    for i in range(x.shape[1]):
        # Comparisons with nan are false.
        is_valid = x[0, i, 0] ** 2 + x[0, i, 1] ** 2 <= FARTHEST * FARTHEST
        is_valid = is_valid and x[1, i, 0] ** 2 + x[1, i, 1] ** 2 <= FASTEST * FASTEST
        if not (is_valid and abs(x[0, i, 2]) + abs(x[1, i, 2]) < math.inf):
            return False
    return True


@inline_kernel
def log_contacts(arrays: BallColumns, scratch: BallScratch, log: BallLog, size: int, substep: int) -> None:
    """Write the contacts of a substep, without those that are rounding, as `ReferenceSimulation` logs them."""
    out, rates, inverse_mass, impulse = scratch.out, scratch.after[1], arrays.inverse_mass, scratch.impulse
    begin = log.end[substep]
    row = begin
    for k in range(size):
        first, second = out.first[k], out.second[k]
        other = second if second >= 0 else first
        speed = math.hypot(rates[first, 0], rates[first, 1]) + math.hypot(rates[other, 0], rates[other, 1])
        kick = math.hypot(impulse[k, 0], impulse[k, 1]) * max(inverse_mass[first], inverse_mass[other])
        overlap = -CONTACT_ROUNDING * (out.anchor[k, 0] + out.anchor[k, 1])
        if not (out.separation[k] < overlap or kick > CONTACT_ROUNDING * speed):
            continue
        log.pair[row, 0], log.pair[row, 1] = first, second
        log.vectors[row, 0], log.vectors[row, 1] = impulse[k, 0], impulse[k, 1]
        log.vectors[row, 2], log.vectors[row, 3] = out.normal[k, 0], out.normal[k, 1]
        log.vectors[row, 4], log.vectors[row, 5] = out.point[k, 0], out.point[k, 1]
        row += 1
    log.end[substep + 1] = row
    previous = log.end[max(substep - 1, 0)]
    same = substep > 0 and row - begin == begin - previous
    if same:
        for k in range(row - begin):
            same = same and log.pair[begin + k, 0] == log.pair[previous + k, 0]
            same = same and log.pair[begin + k, 1] == log.pair[previous + k, 1]
    log.same[substep] = same
