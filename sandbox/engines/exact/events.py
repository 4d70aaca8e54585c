"""Event loop: find the earliest event, check the event limits, process the event, predict again.

Each ball keeps its own earliest event. The event of two balls is stored with the ball that was predicted last; when the
motion of its partner has changed since (other `VERSION`), the stored time is a lower bound and is computed again when
it comes up (lazy invalidation, as in event-driven molecular dynamics: Lubachevsky, J. Comput. Phys. 94, 1991).
"""

import math

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.base import FARTHEST, FASTEST
from sandbox.engines.common.frame_rows import FrameRows, is_due, write_row
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.common.kernel import inline_kernel
from sandbox.engines.common.state_bounds import first_beyond
from sandbox.engines.exact.common import state as c
from sandbox.engines.exact.common.record import ROWS_PER_EVENT, account_hit, account_slip
from sandbox.engines.exact.common.requirements import TOUCH_OVERLAP
from sandbox.engines.exact.common.state import EventState, is_supported
from sandbox.engines.exact.impact import angle_at, hit_ball, hit_vertex, log_hit, move_to, position_at
from sandbox.engines.exact.prediction import predict_next_event
from sandbox.engines.exact.rest import (
    end_slip,
    hit_line,
    pass_line_end,
    recheck_supports,
    set_free_fall,
    update_supported_motion,
)

TOO_DENSE, TOO_FAST, MOVING_CORNER = 4, 5, 6
"""Further return codes of `advance`, after those of `state`: more events in one instant than the limit; two successive
batches of events at a rate above `MAX_BATCH_RATE`; a ball in a corner with a moving surface, which is not modelled."""

EVENTS_PER_CALL = 10_000
"""Events after which the kernel returns so that Python can handle signals: 1/3 s for 1,000 balls, compiled."""

INSTANT_DURATION = 1e-9
"""s: events closer together than this count as one instant."""

IN_INSTANT_PER_BALL = 10_000
"""Largest number of events in one instant, per ball."""

BATCHES_PER_BUDGET = 8
"""Number of batches into which the largest number of events in one second is divided."""

MAX_BATCH_RATE = 8.0
"""Largest event rate of two successive batches, relative to `MAX_EVENTS` per second. Of 234 random scenes of 2 to 120
balls, the 116 that finished reached at most 4.9, for a fifth of `MAX_EVENTS`."""


@kernel
def rebuild_all(data: EventState) -> None:
    """Update the motion of all balls and predict all events from `NOW` on."""
    for i in range(len(data.state)):
        if data.state[i, c.INVERSE_MASS] > 0.0:
            rebuild_ball(data, i)
    predict_all(data)


@inline_kernel
def advance_to(data: EventState, i: int, t: float, residual: float) -> None:
    """Advance a ball to a time, and add the work of its sliding until then to the ledger."""
    if data.counts[c.ACCOUNTING] != 0:
        account_slip(data, i, t, residual)
    move_to(data.state, data.tags, data.log, i, t, residual)


@kernel
def predict_all(data: EventState) -> None:
    """Predict the earliest event of every ball."""
    for k in range(len(data.moving_balls)):
        predict_next_event(data, data.moving_balls[k], data.world[c.NOW], data.world[c.NOW_RESIDUAL])


@kernel
def rebuild_from(data: EventState, t: float) -> None:
    """Continue all balls from a time, s, at which an action has changed gravity, surfaces or colliders."""
    data.world[c.NOW], data.world[c.NOW_RESIDUAL] = t, 0.0
    for i in range(len(data.state)):
        if data.state[i, c.INVERSE_MASS] > 0.0:
            advance_to(data, i, t, 0.0)
            recheck_supports(data, i)
    rebuild_all(data)


@inline_kernel
def rebuild_ball(data: EventState, i: int) -> None:
    """Recompute the accelerations of a ball after a change, and increment its `VERSION`."""
    if is_supported(data.tags, i):
        update_supported_motion(data, i)
    else:
        set_free_fall(data.state, data.world, i)
    data.tags[i, c.VERSION] += 1


@kernel
def earliest_event(moving_balls: IntArray, times: FloatArray) -> int:
    """Return the ball with the earliest event, the lowest index of several; −1 if no ball can move."""
    ball = -1
    if len(moving_balls) > 0:
        ball = moving_balls[0]
        earliest = times[ball]
        for k in range(1, len(moving_balls)):
            if times[moving_balls[k]] < earliest:
                ball = moving_balls[k]
                earliest = times[ball]
    return ball


@kernel
def check_limits(counts: IntArray, world: FloatArray, balls: int, t: float) -> int:
    """Count an event; return `DONE`, or the code of the limit that is exceeded."""
    counts[c.EVENTS] += 1
    if t > world[c.SECOND_START] + 1.0:
        world[c.SECOND_START], counts[c.IN_SECOND] = t, 0
    if t > world[c.INSTANT_START] + INSTANT_DURATION:
        world[c.INSTANT_START], counts[c.IN_INSTANT] = t, 0
    counts[c.IN_SECOND] += 1
    counts[c.IN_INSTANT] += 1
    counts[c.IN_BATCH] += 1
    if counts[c.IN_INSTANT] > IN_INSTANT_PER_BALL * (balls + 1):
        return TOO_DENSE
    if counts[c.IN_SECOND] > counts[c.MAX_EVENTS]:
        return c.TOO_MANY
    if counts[c.IN_BATCH] * BATCHES_PER_BUDGET >= counts[c.MAX_EVENTS]:
        span = t - world[c.PREVIOUS_BATCH]
        world[c.PREVIOUS_BATCH], world[c.BATCH_START], counts[c.IN_BATCH] = world[c.BATCH_START], t, 0
        if span * MAX_BATCH_RATE * BATCHES_PER_BUDGET < 2.0:
            return TOO_FAST
    return c.DONE


@inline_kernel
def process_event(data: EventState, i: int, kind: int, partner: int, t: float, residual: float) -> None:
    """Process the event of a ball and predict the next events of the balls involved.

    Other balls that were predicted to collide with them keep their stored times as lower bounds.
    """
    state, tags = data.state, data.tags
    advance_to(data, i, t, residual)
    both = kind == c.BALL and state[partner, c.INVERSE_MASS] > 0.0
    if kind == c.BALL:
        advance_to(data, partner, t, residual)
        jx, jy, nx, ny = hit_ball(state, tags, data.surfaces, data.world[c.MICRO_BOUNCE], i, partner)
        if data.counts[c.RECORDING] != 0:
            log_hit(data, i, partner, jx, jy, nx, ny)
        if data.counts[c.ACCOUNTING] != 0:
            account_hit(data, i, partner, jx, jy, nx, ny)
    elif kind == c.LINE:
        hit_line(data, i, partner)
    elif kind == c.VERTEX:
        hit_vertex(data, i, partner)
    elif kind == c.LINE_END:
        pass_line_end(data, i)
    else:
        end_slip(data, i)
    if kind in (c.BALL, c.VERTEX) and is_supported(tags, i):
        recheck_supports(data, i)
    if both and is_supported(tags, partner):
        recheck_supports(data, partner)
    rebuild_ball(data, i)
    if both:
        rebuild_ball(data, partner)
        predict_next_event(data, partner, t, residual)
    predict_next_event(data, i, t, residual)


@kernel
def advance(data: EventState, until: float) -> int:
    """Process all events up to a time, s; return why it stopped."""
    state, tags, times = data.state, data.tags, data.next_time
    moving_balls, counts, world = data.moving_balls, data.counts, data.world
    for _ in range(EVENTS_PER_CALL):
        if counts[c.IN_MOVING_CORNER] != 0:
            return MOVING_CORNER
        i = earliest_event(moving_balls, times)
        if i < 0 or times[i] > until:
            return c.DONE
        if counts[c.RECORDING] != 0 and counts[c.LOG_ROWS] + ROWS_PER_EVENT > len(data.log):
            return c.FULL
        t, residual = times[i], state[i, c.NEXT_RESIDUAL]
        kind, partner = tags[i, c.NEXT_KIND], tags[i, c.NEXT_PARTNER]
        if kind == c.BALL and tags[i, c.PARTNER_VERSION] != tags[partner, c.VERSION]:
            predict_next_event(data, i, t, residual)
            continue
        world[c.NOW], world[c.NOW_RESIDUAL] = t, residual
        counts[c.EVENT_BODY], counts[c.EVENT_KIND], counts[c.EVENT_PARTNER] = i, kind, partner
        status = check_limits(counts, world, len(moving_balls), t)
        if status != c.DONE:
            return status
        process_event(data, i, kind, partner, t, residual)
    return c.PAUSED


@kernel
def evaluate(
    data: EventState, t: float, position: FloatArray, velocity: FloatArray, angle: FloatArray, spin: FloatArray
) -> None:
    """Write the motion of every ball at a time into the given arrays; the state is not changed."""
    state = data.state
    for i in range(len(state)):
        if state[i, c.INVERSE_MASS] > 0.0:
            position[i, 0], position[i, 1], velocity[i, 0], velocity[i, 1] = position_at(state, i, t, 0.0)
            angle[i], spin[i] = angle_at(state, i, t, 0.0)


@kernel
def advance_frames(
    data: EventState,
    rows: FrameRows,
    dt: float,
    steps_before: int,
    steps: int,
    position: FloatArray,
    velocity: FloatArray,
    roll: FloatArray,
    angle: FloatArray,
    spin: FloatArray,
) -> tuple[int, int, int, int]:
    """Make steps, and write the frames that are due.

    Args:
        data: state arrays.
        rows: of the frames.
        dt: step, s.
        steps_before: number of steps made before.
        steps: largest number of steps.
        position: (N, 2), set to the present state, as the following ones.
        velocity: (N, 2).
        roll: (N, 2), always 0.
        angle: (N,).
        spin: (N,).

    Returns:
        Number of whole steps; number of frames; `DONE`, `BEYOND` with the state of the step after them, or another
        return code of `advance`; `PAIR_TESTS` at the start of a step that is not complete.
    """
    written, tests = 0, 0
    last_prediction = data.counts[c.PREDICTIONS] + EVENTS_PER_CALL
    for k in range(steps):
        until = (steps_before + k + 1.0) * dt
        tests = data.counts[c.PAIR_TESTS]
        status = advance(data, until)
        if status != c.DONE:
            return k, written, status, tests
        evaluate(data, until, position, velocity, angle, spin)
        if first_beyond(position, velocity, angle, spin, roll) >= 0:
            return k, written, c.BEYOND, tests
        if is_due(rows, k + 1):
            write_row(rows, written, until, position, velocity, angle, spin)
            written += 1
        if data.counts[c.PREDICTIONS] > last_prediction:  # so that Python can handle signals
            return k + 1, written, c.DONE, tests
    return steps, written, c.DONE, tests


@kernel
def may_overlap(data: EventState) -> bool:
    """Return whether a ball overlaps another object by more than `TOUCH_OVERLAP`; the exact test has a larger limit."""
    state, lines, vertices = data.state, data.lines, data.vertices
    for k in range(len(data.moving_balls)):
        i = data.moving_balls[k]
        x, y, radius = state[i, c.X], state[i, c.Y], state[i, c.RADIUS] - TOUCH_OVERLAP
        for m in range(len(data.targets)):
            j = data.targets[m]
            dx, dy, reach = state[j, c.X] - x, state[j, c.Y] - y, radius + state[j, c.RADIUS]
            if j != i and dx * dx + dy * dy < reach * reach:
                return True
        for f in range(len(lines)):
            dx, dy = x - lines[f, c.PX], y - lines[f, c.PY]
            foot = dx * lines[f, c.UX] + dy * lines[f, c.UY]
            height = dx * lines[f, c.NX] + dy * lines[f, c.NY]
            if lines[f, c.LENGTH] == math.inf:
                if height < radius:
                    return True
            elif 0.0 <= foot <= lines[f, c.LENGTH] and abs(height + lines[f, c.HALF_THICKNESS]) < (
                radius + lines[f, c.HALF_THICKNESS]
            ):
                return True
        for m in range(len(vertices)):
            dx, dy = x - vertices[m, c.CENTRE_X], y - vertices[m, c.CENTRE_Y]
            reach = radius + vertices[m, c.CIRCLE_RADIUS]
            if vertices[m, c.SOLID] != 0.0 and dx * dx + dy * dy < reach * reach:
                return True
    return False


@kernel
def run_start(
    data: EventState, until: float, position: FloatArray, velocity: FloatArray, angle: FloatArray, spin: FloatArray
) -> bool:
    """Run all balls from a start at time 0; write the state at a time, s, into the arrays of the start.

    Return false without writing, if balls may overlap at the start, or the run may have failed.
    """
    state = data.state
    for i in range(len(state)):
        state[i, c.X], state[i, c.Y], state[i, c.VX], state[i, c.VY] = (
            position[i, 0],
            position[i, 1],
            velocity[i, 0],
            velocity[i, 1],
        )
        state[i, c.ANGLE], state[i, c.SPIN] = angle[i], spin[i]
    if may_overlap(data):
        return False
    rebuild_all(data)
    status = c.PAUSED
    while status == c.PAUSED:
        status = advance(data, until)
    if status != c.DONE:
        return False
    for i in range(len(state)):
        x, y, vx, vy = position_at(state, i, until, 0.0)
        # Comparisons with nan are false.
        if not (x * x + y * y <= FARTHEST * FARTHEST and vx * vx + vy * vy <= FASTEST * FASTEST):
            return False
    evaluate(data, until, position, velocity, angle, spin)
    return True


@kernel
def run_starts(
    data: EventState,
    start: EventState,
    until: float,
    position: FloatArray,
    velocity: FloatArray,
    angle: FloatArray,
    spin: FloatArray,
    is_done: BoolArray,
) -> None:
    """Run all balls from each of M starts, as `run_start`.

    Args:
        data: state arrays, which are changed.
        start: state arrays before anything was predicted.
        until: end of the runs, s.
        position: (M, N, 2) m, replaced by the state at the end, as the following ones.
        velocity: (M, N, 2) m/s.
        angle: (M, N) rad.
        spin: (M, N) rad/s.
        is_done: (M,) set to the result of each run.
    """
    for m in range(len(is_done)):
        for i in range(len(start.state)):
            for column in range(c.STATE_COLUMNS):
                data.state[i, column] = start.state[i, column]
            for column in range(c.TAG_COLUMNS):
                data.tags[i, column] = start.tags[i, column]
            data.next_time[i] = start.next_time[i]
        for k in range(len(start.world)):
            data.world[k], data.counts[k] = start.world[k], start.counts[k]
        is_done[m] = run_start(data, until, position[m], velocity[m], angle[m], spin[m])
