"""Event loop on a surface, and prediction of the next event of each ball.

Prediction has two parts. The own event of a ball is the end of its phase or a collision with a line, a vertex or a
pocket. The times of impact of all pairs are kept in a matrix; an event updates the rows of its balls in O(N).
"""

import math

from sandbox.arrays import FloatArray
from sandbox.engines.common.body_store import ALL, NOTHING
from sandbox.engines.common.frame_rows import FrameRows, is_due, write_row
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.common.kernel import inline_kernel
from sandbox.engines.common.state_bounds import first_beyond
from sandbox.engines.exact.common.roots import LONGEST_SPAN, MAX_OVERLAP, first_touch, gap_zero_time, return_time
from sandbox.engines.exact.common.state import BEYOND, DONE, FULL, PAUSED, TOO_MANY
from sandbox.engines.exact.tabletop import state as c
from sandbox.engines.exact.tabletop.impact import (
    advance_to,
    capture,
    end_phase,
    evaluate,
    hit_ball,
    hit_line,
    hit_vertex,
    log_event,
    record_path,
    start_phase,
)
from sandbox.engines.exact.tabletop.state import TabletopState
from sandbox.engines.tabletop.motion import CAPTURED, GLIDING, ROLLING, SLIDING

SLACK = 1e-9
"""Fraction of lengths by which the box of a path is enlarged; rounding errors are smaller"""


@kernel
def is_translating(data: TabletopState, i: int) -> bool:
    """Return whether the centre of a ball is in motion."""
    return bool(data.tags[i, c.PHASE] in (ROLLING, SLIDING, GLIDING))


@kernel
def is_over_line(line: FloatArray, x: float, y: float) -> bool:
    """Return whether the projection of a point on a line lies between the ends of the line."""
    foot = (x - line[c.PX]) * line[c.UX] + (y - line[c.PY]) * line[c.UY]
    return bool(0.0 <= foot <= line[c.LENGTH] or line[c.LENGTH] == math.inf)


@kernel
def displacement_range(v: float, a: float, span: float) -> tuple[float, float]:
    """Return bounds of v t + a t²/2 for t from 0 to a span: its least and greatest value, or ±∞ for very long spans."""
    if span >= LONGEST_SPAN:
        return -math.inf, math.inf
    end = (v + 0.5 * a * span) * span
    low, high = min(end, 0.0), max(end, 0.0)
    if v * a < 0.0 and abs(v) < abs(a) * span:
        apex = -0.5 * v * v / a
        low, high = min(low, apex), max(high, apex)
    return low, high


@kernel
def path_box(
    x: float, y: float, vx: float, vy: float, ax: float, ay: float, span: float
) -> tuple[float, float, float, float]:
    """Return the left, bottom, right and top bounds of a path from (x, y) within a span, s, enlarged by rounding."""
    left, right = displacement_range(vx, ax, span)
    bottom, top = displacement_range(vy, ay, span)
    slack = MAX_OVERLAP + SLACK * (abs(x) + abs(y) + right - left + top - bottom)
    return x + left - slack, y + bottom - slack, x + right + slack, y + top + slack


@inline_kernel
def find_own_event(data: TabletopState, i: int, now: float) -> None:
    """Find the next event of a ball without another ball; its row must be at `now`."""
    state = data.state
    data.counts[c.PREDICTIONS] += 1
    earliest, kind, partner = state[i, c.PHASE_END], c.PHASE_CHANGE, 0
    if earliest == math.inf:
        kind = c.NONE
    if is_translating(data, i) and data.tags[i, c.COLLISION_MASK] != NOTHING:
        x, y, vx, vy, ax, ay = (
            state[i, c.X],
            state[i, c.Y],
            state[i, c.VX],
            state[i, c.VY],
            state[i, c.AX],
            state[i, c.AY],
        )
        radius = state[i, c.RADIUS]
        data.counts[c.PAIR_TESTS] += len(data.lines) + len(data.vertices) + len(data.pockets)
        # Only what the path up to the earliest event comes near has to be examined.
        left, bottom, right, top = path_box(x, y, vx, vy, ax, ay, earliest - now)
        for k in range(len(data.lines)):
            line = data.lines[k]
            if (
                line[c.LEFT] > right + radius
                or line[c.RIGHT] < left - radius
                or line[c.BOTTOM] > top + radius
                or line[c.TOP] < bottom - radius
            ):
                continue
            nx, ny = line[c.NX], line[c.NY]
            gap = (x - line[c.PX]) * nx + (y - line[c.PY]) * ny - radius
            rate, half = vx * nx + vy * ny, 0.5 * (ax * nx + ay * ny)
            if rate >= 0.0 and half >= 0.0:
                continue
            # At large coordinates and speeds, rounding lets a ball in contact overlap by more than MAX_OVERLAP.
            overlaps = -radius < gap < -MAX_OVERLAP and is_over_line(line, x, y)
            dt = return_time(rate, half) if overlaps else gap_zero_time(gap, rate, half)
            if now + dt < earliest:
                px, py = x + (vx + 0.5 * ax * dt) * dt, y + (vy + 0.5 * ay * dt) * dt
                if is_over_line(line, px, py):
                    earliest, kind, partner = now + dt, c.LINE, k
                    left, bottom, right, top = path_box(x, y, vx, vy, ax, ay, dt)
        for k in range(len(data.vertices)):
            vertex = data.vertices[k]
            px, py, radius_sum = vertex[c.CENTRE_X], vertex[c.CENTRE_Y], radius + vertex[c.CIRCLE_RADIUS]
            if px - radius_sum > right or px + radius_sum < left or py - radius_sum > top or py + radius_sum < bottom:
                continue
            dx, dy = x - px, y - py
            dt = first_touch(dx, dy, vx, vy, ax, ay, radius_sum, earliest - now)
            if now + dt < earliest:
                earliest, kind, partner = now + dt, c.VERTEX, k
        for k in range(len(data.pockets)):
            pocket = data.pockets[k]
            px, py, rim = pocket[c.CENTRE_X], pocket[c.CENTRE_Y], pocket[c.CIRCLE_RADIUS]
            if px - rim > right or px + rim < left or py - rim > top or py + rim < bottom:
                continue
            dx, dy = x - px, y - py
            dt = first_touch(dx, dy, vx, vy, ax, ay, rim, earliest - now)
            if now + dt < earliest:
                earliest, kind, partner = now + dt, c.POCKET, k
    data.own_time[i], data.own_event[i, 0], data.own_event[i, 1] = earliest, kind, partner


@inline_kernel
def pair_time_of(data: TabletopState, i: int, k: int, now: float) -> float:
    """Return the time of impact of two balls, s, or infinity if another event of either is earlier.

    The row of the first ball must be at `now`.
    """
    state, tags = data.state, data.tags
    if (
        not (is_translating(data, i) or is_translating(data, k))
        or tags[i, c.PHASE] == CAPTURED
        or tags[k, c.PHASE] == CAPTURED
    ):
        return math.inf
    mask_i, mask_k = tags[i, c.COLLISION_MASK], tags[k, c.COLLISION_MASK]
    if not (mask_i == ALL and mask_k == ALL):
        one_is_fixed = (mask_k == ALL and state[k, c.INVERSE_MASS] == 0.0) or (
            mask_i == ALL and state[i, c.INVERSE_MASS] == 0.0
        )
        if mask_i == NOTHING or mask_k == NOTHING or not one_is_fixed:
            return math.inf
    dt = now - state[k, c.T]
    ax, ay = state[k, c.AX], state[k, c.AY]
    x, y = state[k, c.X] + (state[k, c.VX] + 0.5 * ax * dt) * dt, state[k, c.Y] + (state[k, c.VY] + 0.5 * ay * dt) * dt
    vx, vy = state[k, c.VX] + ax * dt, state[k, c.VY] + ay * dt
    limit = min(data.own_time[i], data.own_time[k]) - now
    time_to_impact = first_touch(
        x - state[i, c.X], y - state[i, c.Y], vx - state[i, c.VX], vy - state[i, c.VY],
        ax - state[i, c.AX], ay - state[i, c.AY],
        state[i, c.RADIUS] + state[k, c.RADIUS], limit,
    )  # fmt: skip
    return now + time_to_impact


@inline_kernel
def find_earliest_pair(data: TabletopState, i: int) -> None:
    """Find the earliest time of impact in a ball's row of the matrix."""
    times = data.pair_time[i]
    earliest, partner = math.inf, 0
    for k in range(len(times)):
        if times[k] < earliest:
            earliest, partner = times[k], k
    data.pair_best[i], data.pair_partner[i] = earliest, partner


@inline_kernel
def find_pair_times(data: TabletopState, i: int, now: float) -> None:
    """Compute the times of impact of a ball with all others; its own event must be known."""
    times, earliest, partner = data.pair_time, data.pair_best, data.pair_partner
    data.counts[c.PAIR_TESTS] += len(times) - 1
    for k in range(len(times)):
        if k == i:
            continue
        t = pair_time_of(data, i, k, now)
        times[i, k] = times[k, i] = t
        if t < earliest[k]:
            earliest[k], partner[k] = t, i
        elif partner[k] == i:
            find_earliest_pair(data, k)
    find_earliest_pair(data, i)


@kernel
def find_all_events(data: TabletopState, now: float) -> None:
    """Predict the events of all balls, whose rows must be at `now`."""
    for i in range(len(data.state)):
        find_own_event(data, i, now)
    for i in range(len(data.state)):
        data.pair_best[i] = math.inf
        for k in range(len(data.state)):
            data.pair_time[i, k] = math.inf
    for i in range(len(data.state)):
        for k in range(i + 1, len(data.state)):
            t = pair_time_of(data, i, k, now)
            data.pair_time[i, k] = data.pair_time[k, i] = t
    for i in range(len(data.state)):
        find_earliest_pair(data, i)


EVENTS_PER_CALL = 20_000
"""Events after which the kernel returns so that Python can handle signals: some 1/100 s, compiled."""


@kernel
def rebuild_all(data: TabletopState, t: float) -> None:
    """Start all balls from a time, s, with their present velocity and spin, and predict all events.

    A ball inside a pocket is captured at once; a captured ball that was moved within its pocket returns to the centre.
    """
    state, tags = data.state, data.tags
    for i in range(len(state)):
        if state[i, c.INVERSE_MASS] == 0.0:
            continue
        pocket_index = -1
        for k in range(len(data.pockets)):
            pocket = data.pockets[k]
            dx, dy, radius = (
                state[i, c.X] - pocket[c.CENTRE_X],
                state[i, c.Y] - pocket[c.CENTRE_Y],
                pocket[c.CIRCLE_RADIUS],
            )
            if (pocket_index < 0 or (dx == 0.0 and dy == 0.0)) and dx * dx + dy * dy < radius * radius:
                pocket_index = k
        if pocket_index < 0 or tags[i, c.COLLISION_MASK] == NOTHING:
            start_phase(data, i)
        elif tags[i, c.PHASE] != CAPTURED:
            capture(data, i, pocket_index, data.counts[c.COLLIDERS])
            if data.counts[c.RECORDING] != 0:
                data.log[data.counts[c.LOG_ROWS] - 1, c.EVENT_TIME] = t
        else:
            state[i, c.X], state[i, c.Y] = (
                data.pockets[pocket_index, c.CENTRE_X],
                data.pockets[pocket_index, c.CENTRE_Y],
            )
    find_all_events(data, t)


@inline_kernel
def process_event(data: TabletopState, i: int, kind: int, partner: int, t: float) -> None:
    """Process the event of a ball and predict the next events of the balls involved."""
    row, recording = data.counts[c.LOG_ROWS], data.counts[c.RECORDING] != 0
    advance_to(data, i, t)
    if kind == c.BALL:
        advance_to(data, partner, t)
        hit_ball(data, i, partner)
    elif kind == c.LINE:
        hit_line(data, i, partner)
    elif kind == c.VERTEX:
        hit_vertex(data, i, partner)
    elif kind == c.POCKET:
        capture(data, i, partner, data.counts[c.COLLIDERS])
    else:
        end_phase(data, i)
        if recording:
            log_event(
                data,
                c.PHASE_CHANGE,
                i,
                data.tags[i, c.PHASE],
                data.state[i, c.X],
                data.state[i, c.Y],
                0.0,
                0.0,
                0.0,
                0.0,
            )
    if recording:
        data.log[row, c.EVENT_TIME] = t
    if data.counts[c.RECORDING_PATHS] != 0:
        record_path(data, i)
        if kind == c.BALL:
            record_path(data, partner)
    find_own_event(data, i, t)
    if kind == c.BALL:
        find_own_event(data, partner, t)
        find_pair_times(data, partner, t)
    find_pair_times(data, i, t)


@kernel
def advance(data: TabletopState, until: float) -> int:
    """Process all events up to a time, s; return why it stopped."""
    counts, own_time, pair_best = data.counts, data.own_time, data.pair_best
    for _ in range(EVENTS_PER_CALL):
        t, i, with_another = math.inf, -1, False
        for k in range(len(own_time)):
            if own_time[k] < t:
                t, i, with_another = own_time[k], k, False
            if pair_best[k] < t:
                t, i, with_another = pair_best[k], k, True
        if i < 0 or t > until or counts[c.MOVING] == 0:
            return DONE
        if (counts[c.RECORDING] != 0 and counts[c.LOG_ROWS] >= len(data.log)) or (
            counts[c.RECORDING_PATHS] != 0 and counts[c.PATH_ROWS] + 2 > len(data.path)
        ):
            return FULL
        if counts[c.EVENTS] >= counts[c.MAX_EVENTS]:
            return TOO_MANY
        kind, partner = data.own_event[i, 0], data.own_event[i, 1]
        if with_another:
            kind, partner = c.BALL, data.pair_partner[i]
        counts[c.EVENT_BODY], counts[c.EVENT_KIND], counts[c.EVENT_PARTNER] = i, kind, partner
        counts[c.EVENTS] += 1
        data.world[c.NOW] = t
        process_event(data, i, kind, partner, t)
    return PAUSED


@kernel
def advance_frames(
    data: TabletopState,
    rows: FrameRows,
    dt: float,
    steps_before: int,
    steps: int,
    events_per_second: int,
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
        events_per_second: events that each simulated second adds to the limit.
        position: (N, 2), set to the present state, as the following ones.
        velocity: (N, 2).
        roll: (N, 2).
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
        data.counts[c.MAX_EVENTS] = events_per_second * (1 + int(until))
        status = advance(data, until)
        if status != DONE:
            return k, written, status, tests
        evaluate(data, until, position, velocity, roll, angle, spin)
        if first_beyond(position, velocity, angle, spin, roll) >= 0:
            return k, written, BEYOND, tests
        if is_due(rows, k + 1):
            write_row(rows, written, until, position, velocity, angle, spin)
            for i in range(len(angle)):
                rows.spin[written, i, 0], rows.spin[written, i, 1] = roll[i, 0], roll[i, 1]
                rows.spin[written, i, 2] = spin[i]
            written += 1
        if data.counts[c.PREDICTIONS] > last_prediction:  # so that Python can handle signals
            return k + 1, written, DONE, tests
    return steps, written, DONE, tests
