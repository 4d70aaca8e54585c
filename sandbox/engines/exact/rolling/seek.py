"""Seek: each ball's next event, alone and with every other, kept until something touches it."""

import math

from sandbox.engines.exact.rolling.approach import DEPTH, fall, first_touch, leave
from sandbox.engines.exact.rolling.board import (
    AX,
    AY,
    END,
    KNOB,
    KX,
    KY,
    LENGTH,
    LIGHTNESS,
    LINE,
    MEETS,
    NONE,
    NX,
    NY,
    PAIR_TESTS,
    PHASE,
    PHASE_ENDS,
    POCKET,
    PREDICTIONS,
    PX,
    PY,
    RADIUS,
    REACH,
    UX,
    UY,
    VX,
    VY,
    Board,
    T,
    X,
    Y,
)
from sandbox.engines.floor.phase import CAPTURED, GLIDING, ROLLING, SLIDING
from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.engines.roster import ALL, NOTHING
from sandbox.trajectory import FloatArray


@kernel
def moves(board: Board, i: int) -> bool:
    """Tell whether a ball's centre goes anywhere."""
    return bool(board.tags[i, PHASE] in (ROLLING, SLIDING, GLIDING))


@kernel
def faces(line: FloatArray, x: float, y: float) -> bool:
    """Tell whether a point lies over a line, not beside its ends."""
    along = (x - line[PX]) * line[UX] + (y - line[PY]) * line[UY]
    return bool(0.0 <= along <= line[LENGTH] or line[LENGTH] == math.inf)


@kernel
def alone(board: Board, i: int, now: float) -> None:
    """Find what a ball, brought to a time, meets next without another ball: the end of its phase, or what is fixed."""
    state = board.state
    board.counts[PREDICTIONS] += 1
    best, kind, who = state[i, END], PHASE_ENDS, 0
    if best == math.inf:
        kind = NONE
    if moves(board, i) and board.tags[i, MEETS] != NOTHING:
        x, y, vx, vy, ax, ay = state[i, X], state[i, Y], state[i, VX], state[i, VY], state[i, AX], state[i, AY]
        radius = state[i, RADIUS]
        board.counts[PAIR_TESTS] += len(board.lines) + len(board.knobs) + len(board.pockets)
        for k in range(len(board.lines)):
            line = board.lines[k]
            nx, ny = line[NX], line[NY]
            gap = (x - line[PX]) * nx + (y - line[PY]) * ny - radius
            rate, half = vx * nx + vy * ny, 0.5 * (ax * nx + ay * ny)
            if rate >= 0.0 and half >= 0.0:
                continue
            # Far from the origin, and at great speeds, rounding lets who touches sink in by more than DEPTH.
            sunk = -radius < gap < -DEPTH and faces(line, x, y)
            dt = leave(rate, half) if sunk else fall(gap, rate, half)
            if now + dt < best:
                px, py = x + (vx + 0.5 * ax * dt) * dt, y + (vy + 0.5 * ay * dt) * dt
                if faces(line, px, py):
                    best, kind, who = now + dt, LINE, k
        for k in range(len(board.knobs)):
            knob = board.knobs[k]
            dt = first_touch(x - knob[KX], y - knob[KY], vx, vy, ax, ay, radius + knob[REACH], best - now)
            if now + dt < best:
                best, kind, who = now + dt, KNOB, k
        for k in range(len(board.pockets)):
            hole = board.pockets[k]
            dt = first_touch(x - hole[KX], y - hole[KY], vx, vy, ax, ay, hole[REACH], best - now)
            if now + dt < best:
                best, kind, who = now + dt, POCKET, k
    board.alone_time[i], board.alone_what[i, 0], board.alone_what[i, 1] = best, kind, who


@kernel
def meeting(board: Board, i: int, k: int, now: float) -> float:
    """Return when a ball, brought to a time, meets another, s; infinity where something of either comes before."""
    state, tags = board.state, board.tags
    if not (moves(board, i) or moves(board, k)) or tags[i, PHASE] == CAPTURED or tags[k, PHASE] == CAPTURED:
        return math.inf
    mine, theirs = tags[i, MEETS], tags[k, MEETS]
    if not (mine == ALL and theirs == ALL):
        fixed = (theirs == ALL and state[k, LIGHTNESS] == 0.0) or (mine == ALL and state[i, LIGHTNESS] == 0.0)
        if mine == NOTHING or theirs == NOTHING or not fixed:
            return math.inf
    dt = now - state[k, T]
    ax, ay = state[k, AX], state[k, AY]
    x, y = state[k, X] + (state[k, VX] + 0.5 * ax * dt) * dt, state[k, Y] + (state[k, VY] + 0.5 * ay * dt) * dt
    vx, vy = state[k, VX] + ax * dt, state[k, VY] + ay * dt
    limit = min(board.alone_time[i], board.alone_time[k]) - now
    found = first_touch(
        x - state[i, X], y - state[i, Y], vx - state[i, VX], vy - state[i, VY], ax - state[i, AX], ay - state[i, AY],
        state[i, RADIUS] + state[k, RADIUS], limit,
    )  # fmt: skip
    return now + found


@kernel
def look_up(board: Board, i: int) -> None:
    """Find the earliest of a ball's meetings."""
    times = board.pair_time[i]
    best, who = math.inf, 0
    for k in range(len(times)):
        if times[k] < best:
            best, who = times[k], k
    board.pair_best[i], board.pair_who[i] = best, who


@kernel
def seek(board: Board, i: int, now: float) -> None:
    """Find a ball's meetings with every other anew; its own next event is known."""
    times, best, who = board.pair_time, board.pair_best, board.pair_who
    board.counts[PAIR_TESTS] += len(times) - 1
    for k in range(len(times)):
        if k == i:
            continue
        t = meeting(board, i, k, now)
        times[i, k] = times[k, i] = t
        if t < best[k]:
            best[k], who[k] = t, i
        elif who[k] == i:
            look_up(board, k)
    look_up(board, i)


@kernel
def seek_all(board: Board, now: float) -> None:
    """Find everything anew. Those that a ball's row is not brought to the time of are brought by `bring` before."""
    for i in range(len(board.state)):
        alone(board, i, now)
    for i in range(len(board.state)):
        board.pair_best[i] = math.inf
        for k in range(len(board.state)):
            board.pair_time[i, k] = math.inf
    for i in range(len(board.state)):
        for k in range(i + 1, len(board.state)):
            t = meeting(board, i, k, now)
            board.pair_time[i, k] = board.pair_time[k, i] = t
    for i in range(len(board.state)):
        look_up(board, i)
