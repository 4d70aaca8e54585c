"""Many steps of a world of balls in one compiled call.

`advance_balls` makes the steps that `step.step` defines, by the same kernels in the same order, for worlds that need
nothing between two substeps: balls under gravity and drag, discrete detection, impulses. It stops before a substep that
needs more memory or another path; the readable step then makes it. Tests compare the two, bit for bit.
"""

import math
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from sandbox.engines.common.base import FARTHEST, FASTEST
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.common.contact_log import ContactBatch, ContactLog
from sandbox.engines.common.frame_rows import FrameRows, is_due, no_rows, write_row
from sandbox.engines.common.kernel import OptionalKernel, bare_kernel
from sandbox.engines.reference.broad_phase import EXCEEDED, all_pairs, grid, near_segments
from sandbox.engines.reference.collision import CirclePipeline, empty_manifolds
from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.engines.reference.manifold import (
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
from sandbox.engines.reference.step import WorldState
from sandbox.engines.reference.velocity_solver import ImpulseSolver
from sandbox.scene.description.world import Settings

ROUNDING = 1e-12
"""Overlap as a fraction of the contact distance, and change of velocity as a fraction of the speed, that is rounding"""

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

CAPACITY = 1 << 15
"""Contacts in the log of a call"""

MAX_SUBSTEPS = 1 << 14
"""Substeps of a call"""

MAX_PATH = 1 << 17
"""Centres in the path of a call, for an observer"""


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
        path: (B + 1, N, 2) m, for the centres after each substep from row 1 on; (0, 0, 2) if nobody observes.
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


@bare_kernel
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


@bare_kernel
def sort_keys(keys: IntArray, count: int) -> None:
    """Sort the first keys of a buffer by insertion; those of the broad phases are nearly in order."""
    for k in range(1, count):
        key, target = keys[k], k
        while target > 0 and keys[target - 1] > key:
            keys[target] = keys[target - 1]
            target -= 1
        keys[target] = key


@bare_kernel
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


@bare_kernel
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


@bare_kernel
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


@bare_kernel
def copy_state(source: FloatArray, target: FloatArray) -> None:
    """Copy a state (2, N, 3)."""
    for order in range(2):
        for i in range(source.shape[1]):
            for axis in range(3):
                target[order, i, axis] = source[order, i, axis]


@bare_kernel
def is_within(x: FloatArray) -> bool:
    """Return whether all balls are finite and within the bounds of position and speed."""
    for i in range(x.shape[1]):
        # Comparisons with nan are false.
        is_valid = x[0, i, 0] ** 2 + x[0, i, 1] ** 2 <= FARTHEST * FARTHEST
        is_valid = is_valid and x[1, i, 0] ** 2 + x[1, i, 1] ** 2 <= FASTEST * FASTEST
        if not (is_valid and abs(x[0, i, 2]) + abs(x[1, i, 2]) < math.inf):
            return False
    return True


@bare_kernel
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
        overlap = -ROUNDING * (out.anchor[k, 0] + out.anchor[k, 1])
        if not (out.separation[k] < overlap or kick > ROUNDING * speed):
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


class BallSteps(NamedTuple):
    """Result of a call."""

    steps: int
    """whole steps"""
    substeps: int
    """substeps made of a step that is not complete"""
    frames: int
    """frames written"""
    code: int
    """`DONE`, `STOPPED` or `BEYOND`"""
    log: BallLog
    """valid until the next call"""
    path: FloatArray
    """(B + 1, N, 2)"""


class BallStepper:
    """Advances a world of balls by `advance_balls`, as long as its forces and solver stay the same."""

    def __init__(self, world: WorldState, store: BodyStore, settings: Settings) -> None:
        """Prepare the arrays of a world for which `is_suitable` is true."""
        pipeline, solver = world.pipeline, world.impulses
        assert isinstance(pipeline, CirclePipeline)
        assert settings.integrator and settings.broad_phase and settings.slop is not None and settings.bias is not None
        self._world, self._pipeline, self.forces = world, pipeline, world.forces
        self._substeps = settings.substeps
        h, forces, boxes = settings.h, world.forces, pipeline.segment_boxes
        self._numbers = BallConstants(
            h=h,
            dt=settings.dt,
            substeps=settings.substeps,
            iterations=settings.iterations,
            integrator=INTEGRATOR_CODES[settings.integrator],
            fraction=INTEGRATORS[settings.integrator].fraction,
            slop=settings.slop,
            correction=solver.correction_rate(h),
            linear_drag=forces.linear_drag,
            quadratic_drag=forces.quadratic_drag,
            wind_x=forces.wind[0],
            wind_y=forces.wind[1],
            broad_phase=BROAD_PHASE_CODES[settings.broad_phase] if store.contact_matrix.ball_ball else NO_PAIRS,
            max_tests=pipeline.max_pairs,
            max_contacts=solver.max_contacts,
            segment_width=boxes.max_width,
            plane_tests=pipeline.plane_tests,
        )
        fixtures, turning = store.fixtures, np.zeros(len(store.radius))
        if forces.constant.shape[1] == 3:
            turning = forces.constant[:, 2]
        self._store = store
        given: dict[str, Any] = {
            "constant": np.column_stack((forces.constant[:, :2], turning)),
            "mobile": np.broadcast_to(forces.mobile[:, 0], len(store.radius)),
            "radius": store.radius,
            "surface": store.surface,
            "mask": store.collision_mask,
            "moves": pipeline.moves,
            "can_touch": pipeline.can_touch,
            "inverse_mass": store.inverse_mass,
            "inverse_moment": store.inverse_moment,
            "friction": store.friction,
            "restitution": store.restitution.ravel(),
            "planes": fixtures.planes,
            "plane_collider": fixtures.plane_collider,
            "collider_surface": store.fixed_surface,
            "segments": fixtures.segments,
            "segment_joints": fixtures.joints,
            "segment_collider": fixtures.segment_collider,
            "segment_box": boxes.box,
            "segment_index": boxes.index,
        }
        # Copied, so that the kernel is compiled for one kind of arrays: not for read-only or strided ones too.
        self._arrays = BallColumns(**{name: np.array(array, order="C") for name, array in given.items()})
        self._log = BallLog(
            np.zeros(MAX_SUBSTEPS + self._substeps + 1, np.int64),
            np.empty(MAX_SUBSTEPS + self._substeps, np.bool_),
            np.empty((CAPACITY, 2), np.int64),
            np.empty((CAPACITY, 6)),
        )
        self._allocate(64)

    @staticmethod
    def is_suitable(world: WorldState, store: BodyStore, settings: Settings) -> bool:
        """Return whether a world needs nothing that `advance_balls` lacks."""
        solver = world.solver
        return (
            settings.detection == "discrete"
            and type(solver) is ImpulseSolver
            and solver.is_plain
            and isinstance(world.pipeline, CirclePipeline)
            and world.pipeline.filter is None
            and world.joints is None
            and not world.forces.forces
            and settings.broad_phase in BROAD_PHASE_CODES
            and settings.integrator in INTEGRATOR_CODES
            and not (world.records_work or world.records_joint_load)
            and len(store.radius) > 0
        )

    def _allocate(self, contacts: int) -> None:
        """Allocate memory for a number of contacts in a substep."""
        shape = (2, len(self._arrays.radius), 3)
        self._capacity = contacts
        self._scratch = BallScratch(
            placed=np.empty(shape),
            after=np.empty(shape),
            change=np.empty(shape[1:]),
            ball_keys=np.empty(4 * contacts, np.int64),
            segment_keys=np.empty(4 * contacts, np.int64),
            out=empty_manifolds(contacts),
            bounce=np.empty(contacts),
            impulse=np.empty((contacts, 2)),
            target=np.empty(contacts),
            total=np.empty(contacts),
        )

    @property
    def is_full(self) -> bool:
        """Whether there is memory for no more contacts, so that the readable step has to be used."""
        return self._capacity >= MAX_CAPACITY

    def max_steps(self, *, observed: bool) -> int:
        """Return the largest number of steps of a call, at least 1."""
        substeps = min(MAX_SUBSTEPS, MAX_PATH // len(self._arrays.radius)) if observed else MAX_SUBSTEPS
        return max(substeps // self._substeps, 1)

    def advance(self, begin: int, steps: int, frames: FrameRows, *, records: bool, observed: bool) -> BallSteps:
        """Make at most so many steps; the state of the world is that after them, and after the substeps beyond.

        Args:
            begin: number of steps made before.
            steps: largest number of steps, at most `max_steps`.
            frames: rows for the frames.
            records: whether to record contacts.
            observed: whether to record the path of the balls.
        """
        world, memory, pipeline, numbers = self._world, self._world.memory, self._pipeline, self._numbers
        known, substeps = len(memory.key), steps * numbers.substeps
        if known > self._capacity:
            self._allocate(2 * known)
        # The kernel computes angles even if nothing turns; they do not change then.
        turns, count, capacity = world.x.shape[2] == 3, world.x.shape[1], self._capacity
        x = np.empty((2, count, 3))
        x[:, :, : world.x.shape[2]] = world.x
        if not turns:
            x[0, :, 2], x[1, :, 2] = self._store.angle, 0.0
        key, impulse = np.empty(capacity, np.int64), np.empty((capacity, 2))
        key[:known], impulse[:known] = memory.key, memory.impulse
        order = pipeline.broad_phase_memory(x[0]) if numbers.broad_phase != NO_PAIRS else NO_ORDER
        counts = np.array([known, memory.has_pseudo_velocity, 0, 0, 0, 0], np.int64)
        state = BallState(x, key, impulse, memory.pseudo_velocity, order, counts)
        log = self._log if records else NO_LOG
        path = np.empty((substeps + 1, count, 2) if observed else (0, 0, 2))
        if observed:
            path[0] = x[0, :, :2]
        warm_start = min(numbers.h / memory.h, 1.0)
        made, rest, written, code = advance_balls(
            numbers, self._arrays, state, self._scratch, frames, path, log, begin, steps, warm_start
        )
        substeps = (made + (code == BEYOND)) * numbers.substeps + rest
        if substeps:
            world.x = x if turns else x[:, :, :2].copy()
            memory.key, memory.impulse = key[: counts[KEYS]].copy(), impulse[: counts[KEYS]].copy()
            memory.has_pseudo_velocity, memory.h = bool(counts[HAS_PSEUDO_VELOCITY]), numbers.h
            names = "broad_tests", "pair_tests", "contacts", "contact_iterations"
            for name, amount in zip(names, counts[BROAD_TESTS:].tolist(), strict=True):
                world.work[name] += amount
        if code == STOPPED and capacity < MAX_CAPACITY:
            self._allocate(4 * capacity)
        return BallSteps(made, rest, written, code, _first(log, substeps), path[: substeps + 1])


NO_LOG = BallLog(np.zeros(0, np.int64), np.empty(0, np.bool_), np.empty((0, 2), np.int64), np.empty((0, 6)))

MAX_CAPACITY = CAPACITY
"""Contacts of a substep beyond which the readable step is used; it costs little beside so many contacts"""

NO_ORDER: IntArray = np.empty(0, np.int64)


def _first(log: BallLog, substeps: int) -> BallLog:
    """Return the used rows of a log."""
    if not len(log.end):
        return log
    rows = int(log.end[substeps])
    return BallLog(log.end[: substeps + 1], log.same[:substeps], log.pair[:rows], log.vectors[:rows])


def record_contacts(
    target: ContactLog, log: BallLog, times: FloatArray, wants_pairs: bool
) -> list[tuple[int, IntArray]]:
    """Enter the contacts of many substeps into a contact log, as if each had been recorded after its substep.

    Args:
        target: the contact log.
        log: the contacts.
        times: (B,) s, end of each substep.
        wants_pairs: whether to return the pairs.

    Returns:
        The pairs (K, 2) of the substeps, with the number of the substep after the last that has them.
    """
    impulse, normal, point = (_complex(log.vectors[:, k : k + 2]) for k in (0, 2, 4))
    impulse = -(normal * impulse)
    a, b = np.ascontiguousarray(log.pair[:, 0]), np.ascontiguousarray(log.pair[:, 1])
    row: list[int] = log.end.tolist()
    begins = np.flatnonzero(~log.same).tolist()
    pairs = []

    def record(k: int) -> None:
        one = slice(row[k], row[k + 1])
        target.record(float(times[k]), ContactBatch(a[one], b[one], impulse[one], normal[one], point[one]))

    for begin, end in pairwise([*begins, len(log.same)]):
        record(begin)
        if target.has_distinct_rows and end > begin + 1:
            lasting = impulse[row[begin + 1] : row[end]]
            target.add_impulse_rows(lasting.reshape(end - begin - 1, -1))
        else:
            for k in range(begin + 1, end):
                record(k)
        if wants_pairs:
            pairs.append((end, target.pairs()))
    return pairs


def _complex(vectors: FloatArray) -> ComplexArray:
    """Return rows (K, 2) as complex numbers (K,)."""
    return np.asarray(vectors[:, 0] + 1j * vectors[:, 1])  # with the sign of zero that the readable step gets


class MemberStepper:
    """Runs one world of balls from many starts."""

    def __init__(self, store: BodyStore, settings: Settings) -> None:
        """Take over a body store, which no other simulation may use."""
        self._store, self._settings = store, settings
        self._world = WorldState(store, settings)
        self._stepper = BallStepper(self._world, store, settings)
        self._frames = no_rows()

    def run(
        self, position: FloatArray, velocity: FloatArray, angle: FloatArray, angular_velocity: FloatArray, *, steps: int
    ) -> bool:
        """Run the world from a start, (N, …) each, and write the end state in its place.

        Return false without writing if the compiled steps cannot make the run.
        """
        store = self._store
        state = store.position, store.velocity, store.angle, store.angular_velocity
        start = position, velocity, angle, angular_velocity
        for own, given in zip(state, start, strict=True):
            own[:] = given
        if not self._world.restart():
            self._world.rebuild()
            self._stepper = BallStepper(self._world, store, self._settings)
        stepper, made = self._stepper, 0
        while made < steps:
            count = min(steps - made, stepper.max_steps(observed=False))
            result = stepper.advance(made, count, self._frames, records=False, observed=False)
            made += result.steps
            if result.code == BEYOND or result.substeps or (result.code == STOPPED and stepper.is_full):
                return False
        self._world.write_state()
        for own, given in zip(state, start, strict=True):
            given[:] = own
        return True
