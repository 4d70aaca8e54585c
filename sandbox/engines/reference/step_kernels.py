"""Compiled steps: what worlds of balls and worlds of convex pieces have in common.

`ball_kernels` and `piece_kernels` make the steps that `step.step` defines, by the same kernels in the same order, for
worlds that need nothing between two substeps: gravity, drag, damping and thrusts, discrete detection, contacts and
joints by impulses. They stop before a substep that needs more memory or another path; the readable step then makes it.
Tests compare the two, bit for bit. `compiled_stepper` prepares the arrays.
"""

import math
from typing import NamedTuple

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.base import FARTHEST, FASTEST
from sandbox.engines.common.frame_rows import FrameRows, is_due, write_row
from sandbox.engines.common.kernel import inline_kernel
from sandbox.engines.forces.air import Air, air_law
from sandbox.engines.forces.field import thrust_on_body
from sandbox.engines.forces.thrust import ThrustColumns
from sandbox.engines.reference.broad_phase import EXCEEDED, all_pairs, grid, near_segments
from sandbox.engines.reference.joint_data import JointData
from sandbox.engines.reference.joint_rows import VelocityConstraints, prepare, solve_joints_once, warm_start_joints
from sandbox.engines.reference.manifold import CONTACT_ROUNDING, Manifolds
from sandbox.engines.reference.sequential_impulses import (
    approach,
    match_impulses,
    rebound_speeds,
    solve_contacts_once,
    solve_overlaps,
    solve_velocities,
    warm_start_contacts,
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

KEYS, HAS_PSEUDO_VELOCITY, BROAD_TESTS, PAIR_TESTS, CONTACTS, CONTACT_ITERATIONS, JOINT_ITERATIONS = range(7)
"""Indices of `SolverState.counts`: number of warm-start impulses; 1 if a pseudo-velocity is not 0; work counters."""


class StepConstants(NamedTuple):
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
    bias: float
    """fraction of a joint's error that remains after one second"""
    correction: float
    """1/s, target separation rate for each metre of overlap beyond the slop, negative"""
    broad_phase: int
    """code of the broad phase; `NO_PAIRS` if bodies cannot touch each other"""
    max_tests: int
    """largest number of pairs that a broad phase may test"""
    max_contacts: int
    """largest number of contacts of a substep"""
    segment_width: float
    """m, largest width of a segment's box"""
    segment_top: float
    """m, highest top of a segment's box"""
    plane_tests: int
    """pairs of a ball, or piece, and a plane"""
    began: float
    """s, time of the scene at the start"""
    left: float
    """bounds of the scene, m; infinite without bounds"""
    bottom: float
    right: float
    top: float


class BodyColumns(NamedTuple):
    """Arrays of N bodies and S surfaces, and the forces on them, that do not change from step to step."""

    constant: FloatArray
    """(N, 3) acceleration, m/s² and rad/s²"""
    mobile: FloatArray
    """(N,) 1 for bodies that the air affects, 0 for others"""
    can_leave: BoolArray
    """(N,) bodies that are removed when they are out of bounds"""
    inverse_mass: FloatArray
    inverse_moment: FloatArray
    restitution: FloatArray
    """(S·S,)"""
    tangential: FloatArray
    """(S, S, 4), as in `BodyStore`"""
    air: Air
    thrusts: ThrustColumns


class CompiledJoints(NamedTuple):
    """Joints that are solved by impulses."""

    data: JointData
    rows: VelocityConstraints
    """changed by every substep"""
    h: FloatArray
    """(1,) s, substep in which their impulses were found"""


class WallColumns(NamedTuple):
    """Arrays of planes and segments, see `StaticColliders` and `SegmentBoxes`."""

    planes: FloatArray
    plane_collider: IntArray
    collider_surface: IntArray
    segments: FloatArray
    segment_joints: FloatArray
    segment_collider: IntArray
    segment_box: FloatArray
    segment_index: IntArray


class SolverState(NamedTuple):
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
    thrust_level: FloatArray
    """(T,) level of each thrust"""
    counts: IntArray
    """(7,)"""


class StepScratch(NamedTuple):
    """Memory of a substep."""

    placed: FloatArray
    """(2, N, 3) state at its end without contacts"""
    after: FloatArray
    """(2, N, 3) state at its end"""
    change: FloatArray
    """(N, 3)"""
    pose: FloatArray
    """(N, 3) poses at which joints are prepared"""
    pair_keys: IntArray
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


class StepLog(NamedTuple):
    """Contacts of the substeps of a call."""

    end: IntArray
    """(B + 1,) rows up to the end of each substep, from entry 1 on; (0,) if contacts are not recorded"""
    same: BoolArray
    """(B,) whether the pairs are those of the substep before"""
    pair: IntArray
    """(C, 2)"""
    vectors: FloatArray
    """(C, 6) impulse along the normal and to the left of it, N·s; normal; point, m"""


DONE, STOPPED, UNCHECKED = range(3)
"""Return codes of compiled steps: the steps were made, or the log is nearly full; a substep needs another path; a body
is not finite, too far away, or out of the bounds of the scene after the last step."""


@inline_kernel
def has_room(log: StepLog, substep: int, contacts: int) -> bool:
    """Return whether the log can hold so many contacts from a substep on; true if contacts are not recorded."""
    return len(log.end) == 0 or log.end[substep] + contacts <= len(log.pair)


@inline_kernel
def finish_substep(
    number: StepConstants,
    bodies: BodyColumns,
    joints: CompiledJoints,
    state: SolverState,
    scratch: StepScratch,
    path: FloatArray,
    log: StepLog,
    substep: int,
    size: int,
    tests: tuple[int, int],
    warm_start: float,
) -> None:
    """Solve the contacts of a substep, take its end as the present state, and record it.

    Args:
        number: numbers.
        bodies: constant arrays.
        joints: the joints.
        state: the state.
        scratch: with the contacts.
        path: as in `advance_balls`.
        log: likewise.
        substep: index in the call.
        size: number of contacts.
        tests: numbers of cheap and exact tests that found them.
        warm_start: factor of the warm-start impulses.
    """
    out = scratch.out
    state.counts[BROAD_TESTS] += tests[0]
    state.counts[PAIR_TESTS] += tests[1]
    state.counts[CONTACTS] += size
    # Written out, because a kernel that creates no arrays cannot return any.
    contacts = Manifolds(
        out.key[:size],
        out.first[:size],
        out.second[:size],
        out.normal[:size],
        out.separation[:size],
        out.point[:size],
        out.rn[:size],
        out.rt[:size],
        out.friction[:size],
        out.slip_target[:size],
        out.surface_pair[:size],
    )
    solve_constraints(number, bodies, joints, state, scratch, contacts, warm_start)
    correct_overlap(number, bodies, state, scratch, contacts)
    copy_state(scratch.after, state.x)
    if len(log.end) > 0:
        log_contacts(bodies, scratch, log, size, substep)
    if len(path) > 0:
        for i in range(len(bodies.mobile)):
            path[substep + 1, i, 0] = state.x[0, i, 0]
            path[substep + 1, i, 1] = state.x[0, i, 1]


@inline_kernel
def has_contacts(log: StepLog, substep: int, count: int) -> bool:
    """Return whether contacts were recorded in some substeps of the call."""
    return bool(log.end[substep + count] > log.end[substep])


@inline_kernel
def write_frame(
    number: StepConstants, state: SolverState, frames: FrameRows, written: int, step: int, steps_before: int
) -> int:
    """Write the frame after a step of a call, if it is due; return the number of frames written."""
    if not is_due(frames, step + 1):
        return written
    pose, rate = state.x[0], state.x[1]
    write_row(frames, written, (steps_before + step + 1) * number.dt, pose, rate, pose[:, 2], rate[:, 2])
    return written + 1


_air_law = inline_kernel(air_law)


@inline_kernel
def air_acts(air: Air) -> bool:
    """Return `Air.acts`, in a kernel."""
    damps = air.damping_rate > 0.0 or air.damps_bodies
    return air.linear_drag > 0.0 or air.quadratic_drag > 0.0 or damps or air.depends_on_spin


@inline_kernel
def acceleration(
    number: StepConstants,
    bodies: BodyColumns,
    level: FloatArray,
    i: int,
    time: float,
    angle: float,
    vx: float,
    vy: float,
    spin: float,
) -> tuple[float, float, float]:
    """Return the acceleration of a body by constant forces, air and thrusts, as `integrators.transition`.

    Args:
        number: numbers.
        bodies: constant arrays.
        level: (T,) of thrusts.
        i: index of the body.
        time: s, since the start of the run.
        angle: rad.
        vx: m/s.
        vy: m/s.
        spin: rad/s.
    """
    ax, ay, alpha = bodies.constant[i, 0], bodies.constant[i, 1], bodies.constant[i, 2]
    if bodies.mobile[i] != 0.0 and air_acts(bodies.air):
        wx, wy = vx - bodies.air.wind_x, vy - bodies.air.wind_y
        speed = math.sqrt(wx * wx + wy * wy)
        ax_air, ay_air, alpha_air = _air_law(bodies.air, i, wx, wy, speed, vx, vy, spin)
        ax, ay, alpha = ax + ax_air, ay + ay_air, alpha + alpha_air
    if len(bodies.thrusts.body) > 0:
        ax_thrust, ay_thrust, alpha_thrust = 0.0, 0.0, 0.0
        for k in range(len(bodies.thrusts.body)):
            if bodies.thrusts.body[k] == i:
                fx, fy, torque = thrust_on_body(bodies.thrusts, k, level[k], number.began + time, angle)
                ax_thrust += bodies.inverse_mass[i] * fx
                ay_thrust += bodies.inverse_mass[i] * fy
                alpha_thrust += bodies.inverse_moment[i] * torque
        ax, ay, alpha = ax + ax_thrust, ay + ay_thrust, alpha + alpha_thrust
    return ax, ay, alpha


@inline_kernel
def move_bodies(
    number: StepConstants, bodies: BodyColumns, state: SolverState, scratch: StepScratch, time: float
) -> None:
    """Write the motion over h from a time, s, without contacts into `placed`, with the last overlap corrected.

    The integrators are those of `integrators`, with the same operations in the same order.
    """
    h, method, x, placed, level = number.h, number.integrator, state.x, scratch.placed, state.thrust_level
    damped = air_acts(bodies.air)
    for i in range(len(bodies.mobile)):
        px, py, angle, vx, vy, spin = x[0, i, 0], x[0, i, 1], x[0, i, 2], x[1, i, 0], x[1, i, 1], x[1, i, 2]
        if method == LEAPFROG:
            px, py, angle = px + (0.5 * h) * vx, py + (0.5 * h) * vy, angle + (0.5 * h) * spin
            middle = time + 0.5 * h
            ax, ay, alpha = acceleration(number, bodies, level, i, middle, angle, vx, vy, spin)
            if damped:
                v2x, v2y, spin2 = vx + (0.5 * h) * ax, vy + (0.5 * h) * ay, spin + (0.5 * h) * alpha
                ax, ay, alpha = acceleration(number, bodies, level, i, middle, angle, v2x, v2y, spin2)
            vx, vy, spin = vx + h * ax, vy + h * ay, spin + h * alpha
            px, py, angle = px + (0.5 * h) * vx, py + (0.5 * h) * vy, angle + (0.5 * h) * spin
        else:
            ax, ay, alpha = acceleration(number, bodies, level, i, time, angle, vx, vy, spin)
            if method == EXPLICIT_EULER:
                px, py, angle = px + h * vx, py + h * vy, angle + h * spin
                vx, vy, spin = vx + h * ax, vy + h * ay, spin + h * alpha
            elif method == SEMI_IMPLICIT_EULER:
                vx, vy, spin = vx + h * ax, vy + h * ay, spin + h * alpha
                px, py, angle = px + h * vx, py + h * vy, angle + h * spin
            elif method == VELOCITY_VERLET:
                px, py = px + h * (vx + (0.5 * h) * ax), py + h * (vy + (0.5 * h) * ay)
                angle += h * (spin + (0.5 * h) * alpha)
                v2x, v2y, spin2 = vx + h * ax, vy + h * ay, spin + h * alpha
                bx, by, beta = acceleration(number, bodies, level, i, time + h, angle, v2x, v2y, spin2)
                vx, vy = vx + (0.5 * h) * (ax + bx), vy + (0.5 * h) * (ay + by)
                spin += (0.5 * h) * (alpha + beta)
            else:
                half = time + 0.5 * h
                v2x, v2y, spin2 = vx + h * (0.5 * ax), vy + h * (0.5 * ay), spin + h * (0.5 * alpha)
                bx, by, beta = acceleration(number, bodies, level, i, half, angle + h * (0.5 * spin), v2x, v2y, spin2)
                v3x, v3y, spin3 = vx + h * (0.5 * bx), vy + h * (0.5 * by), spin + h * (0.5 * beta)
                cx, cy, gamma = acceleration(number, bodies, level, i, half, angle + h * (0.5 * spin2), v3x, v3y, spin3)
                v4x, v4y, spin4 = vx + h * cx, vy + h * cy, spin + h * gamma
                dx, dy, delta = acceleration(number, bodies, level, i, time + h, angle + h * spin3, v4x, v4y, spin4)
                sixth, third = 1 / 6, 1 / 3
                px += h * (sixth * vx + third * v2x + third * v3x + sixth * v4x)
                py += h * (sixth * vy + third * v2y + third * v3y + sixth * v4y)
                angle += h * (sixth * spin + third * spin2 + third * spin3 + sixth * spin4)
                vx += h * (sixth * ax + third * bx + third * cx + sixth * dx)
                vy += h * (sixth * ay + third * by + third * cy + sixth * dy)
                spin += h * (sixth * alpha + third * beta + third * gamma + sixth * delta)
        placed[0, i, 0], placed[0, i, 1], placed[0, i, 2] = px, py, angle
        placed[1, i, 0], placed[1, i, 1], placed[1, i, 2] = vx, vy, spin
    if state.counts[HAS_PSEUDO_VELOCITY] != 0:
        for i in range(len(bodies.mobile)):
            for axis in range(3):
                placed[0, i, axis] += h * state.pseudo_velocity[i, axis]


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
def find_near_pairs(
    number: StepConstants,
    state: SolverState,
    middle: FloatArray,
    radius: FloatArray,
    mask: IntArray,
    moves: BoolArray,
    keys: IntArray,
) -> tuple[int, int]:
    """Write the sorted keys of pairs of discs that may touch; return their number and that of tests.

    The number is −1 if there are more than fit, or if the broad phase has to be prepared anew.
    """
    if number.broad_phase == NO_PAIRS:
        return 0, 0
    if number.broad_phase == ALL_PAIRS:
        found, tests = all_pairs(state.order, middle, radius, mask, moves, 0.0, number.max_tests, keys)
    else:
        found, tests = grid(state.order, middle, radius, mask, moves, 0.0, number.max_tests, keys)
    if tests == EXCEEDED or found > len(keys):
        return -1, 0
    sort_keys(keys, found)
    return found, tests


@inline_kernel
def find_near_segments(
    number: StepConstants,
    walls: WallColumns,
    middle: FloatArray,
    radius: FloatArray,
    can_touch: BoolArray,
    keys: IntArray,
) -> tuple[int, int]:
    """Write the sorted keys of discs and segments that may touch; return as `find_near_pairs` does."""
    if len(walls.segment_index) == 0:
        return 0, 0
    boxes = walls.segment_box, walls.segment_index, number.segment_width, number.segment_top
    found, tests = near_segments(middle, radius, can_touch, *boxes, 0.0, number.max_tests, keys)
    if tests == EXCEEDED or found > len(keys):
        return -1, 0
    sort_keys(keys, found)
    return found, tests


@inline_kernel
def solve_constraints(
    number: StepConstants,
    bodies: BodyColumns,
    joints: CompiledJoints,
    state: SolverState,
    scratch: StepScratch,
    contacts: Manifolds,
    warm_start: float,
) -> None:
    """Write the state at the end of a substep, with contacts and joints that act in it, as `ImpulseSolver.solve`."""
    placed, after, size, rows = scratch.placed, scratch.after, len(contacts.key), joints.rows
    copy_state(placed, after)
    if size == 0 and len(rows.kind) == 0:
        return
    bounce, impulse = scratch.bounce[:size], scratch.impulse[:size]
    start, velocity, inverse = state.x[1], after[1], (bodies.inverse_mass, bodies.inverse_moment)
    part = number.fraction * number.h
    if len(rows.kind) > 0:
        for i in range(len(bodies.mobile)):
            for axis in range(3):
                scratch.pose[i, axis] = placed[0, i, axis]
                if number.fraction != 0.0:
                    scratch.pose[i, axis] -= part * placed[1, i, axis]
        prepare(rows, joints.data, scratch.pose, number.h, joints.h[0], number.bias, *inverse)
        joints.h[0] = number.h
    rebound_speeds(contacts, start, start[:, 2], bodies.restitution, bounce)
    impulse[:] = 0.0
    known = state.counts[KEYS]
    match_impulses(contacts.key, state.key[:known], state.impulse[:known], impulse)
    for k in range(size):
        impulse[k, 0] *= warm_start
        impulse[k, 1] *= warm_start
    state.counts[CONTACT_ITERATIONS] += size * number.iterations
    if len(rows.kind) == 0:
        solve_velocities(contacts, bounce, velocity, velocity[:, 2], *inverse, impulse, number.iterations)
    else:  # as `solve_together` without stops
        state.counts[JOINT_ITERATIONS] += len(rows.kind) * number.iterations
        warm_start_contacts(contacts, velocity, velocity[:, 2], *inverse, impulse)
        warm_start_joints(rows, velocity, *inverse)
        for _ in range(number.iterations):
            solve_contacts_once(contacts, bounce, velocity, velocity[:, 2], *inverse, impulse)
            solve_joints_once(rows, velocity, *inverse)
    if number.fraction != 0.0:
        change = scratch.change
        for i in range(len(bodies.mobile)):
            for axis in range(3):
                change[i, axis] = after[1, i, axis] - placed[1, i, axis]
                after[0, i, axis] += part * change[i, axis]
        approach(contacts, change, change[:, 2], bounce)
        for k in range(size):
            contacts.separation[k] += part * bounce[k]


@inline_kernel
def correct_overlap(
    number: StepConstants, bodies: BodyColumns, state: SolverState, scratch: StepScratch, contacts: Manifolds
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
        inverse = bodies.inverse_mass, bodies.inverse_moment
        solve_overlaps(contacts, target, state.pseudo_velocity, *inverse, total, number.iterations)


@inline_kernel
def copy_state(source: FloatArray, target: FloatArray) -> None:
    """Copy a state (2, N, 3)."""
    for order in range(2):
        for i in range(source.shape[1]):
            for axis in range(3):
                target[order, i, axis] = source[order, i, axis]


@inline_kernel
def is_within(number: StepConstants, bodies: BodyColumns, x: FloatArray) -> bool:
    """Return whether all bodies are finite and within the bounds of position, speed and the scene."""
    for i in range(x.shape[1]):
        px, py = x[0, i, 0], x[0, i, 1]
        # Comparisons with nan are false.
        is_valid = px**2 + py**2 <= FARTHEST * FARTHEST
        is_valid = is_valid and x[1, i, 0] ** 2 + x[1, i, 1] ** 2 <= FASTEST * FASTEST
        if not (is_valid and abs(x[0, i, 2]) + abs(x[1, i, 2]) < math.inf):
            return False
        is_out = px < number.left or px > number.right or py < number.bottom or py > number.top
        if is_out and bodies.can_leave[i]:
            return False
    return True


@inline_kernel
def log_contacts(bodies: BodyColumns, scratch: StepScratch, log: StepLog, size: int, substep: int) -> None:
    """Write the contacts of a substep, without those that are rounding, as `ReferenceSimulation` logs them."""
    out, rates, inverse_mass, impulse = scratch.out, scratch.after[1], bodies.inverse_mass, scratch.impulse
    begin = log.end[substep]
    row = begin
    for k in range(size):
        first, second = out.first[k], out.second[k]
        other = second if second >= 0 else first
        speed = math.hypot(rates[first, 0], rates[first, 1]) + math.hypot(rates[other, 0], rates[other, 1])
        kick = math.hypot(impulse[k, 0], impulse[k, 1]) * max(inverse_mass[first], inverse_mass[other])
        overlap = -CONTACT_ROUNDING * (out.rn[k, 0] + out.rn[k, 1])
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
