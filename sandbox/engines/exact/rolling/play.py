"""Play: event after event up to a time, all in one kernel call."""

import math

from sandbox.engines.exact.rolling.board import (
    AWAKE,
    BALL,
    EVENT_TIME,
    EVENTS,
    KNOB,
    KX,
    KY,
    LIGHTNESS,
    LIMIT,
    LINE,
    MEETS,
    NOW,
    PHASE,
    PHASE_ENDS,
    POCKET,
    REACH,
    RECORDING,
    ROWS,
    SOLID,
    STEPS,
    TRACING,
    WHAT,
    WHO,
    WITH,
    Board,
    X,
    Y,
)
from sandbox.engines.exact.rolling.book import arrive
from sandbox.engines.exact.rolling.hit import capture, hit_ball, hit_knob, hit_line, log
from sandbox.engines.exact.rolling.motion import end_phase, set_off, trace
from sandbox.engines.exact.rolling.seek import alone, seek, seek_all
from sandbox.engines.floor.phase import CAPTURED
from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.engines.roster import NOTHING

DONE, PAUSED, FULL, TOO_MANY, CUT = range(5)
"""What `play` returns: up to the time, or all at rest; after `PAUSE` events; a log is full; too many events. A whole
shot that is stopped by the time is cut."""

PAUSE = 20_000
"""Events after which a kernel lets Python see to signals: some hundredths of a second, compiled."""


@kernel
def set_out(board: Board, t: float) -> None:
    """Let every ball go on from a time, by the velocity and spin that it has then, and look ahead.

    Who stands in a pocket is captured at once; who lies in one and was put elsewhere in it slides back.
    """
    state, tags = board.state, board.tags
    for i in range(len(state)):
        if state[i, LIGHTNESS] == 0.0:
            continue
        inside = -1
        for k in range(len(board.pockets)):
            hole = board.pockets[k]
            dx, dy = state[i, X] - hole[KX], state[i, Y] - hole[KY]
            if (inside < 0 or (dx == 0.0 and dy == 0.0)) and dx * dx + dy * dy < hole[REACH] * hole[REACH]:
                inside = k
        if inside < 0 or tags[i, MEETS] == NOTHING:
            set_off(board, i)
        elif tags[i, PHASE] != CAPTURED:
            capture(board, i, inside, board.counts[SOLID])
            if board.counts[RECORDING] != 0:
                board.log[board.counts[ROWS] - 1, EVENT_TIME] = t
        else:
            state[i, X], state[i, Y] = board.pockets[inside, KX], board.pockets[inside, KY]
    seek_all(board, t)


@kernel
def happen(board: Board, i: int, kind: int, partner: int, t: float) -> None:
    """Let a ball's event happen, and look ahead for those whom it concerns."""
    row, recording = board.counts[ROWS], board.counts[RECORDING] != 0
    arrive(board, i, t)
    if kind == BALL:
        arrive(board, partner, t)
        hit_ball(board, i, partner)
    elif kind == LINE:
        hit_line(board, i, partner)
    elif kind == KNOB:
        hit_knob(board, i, partner)
    elif kind == POCKET:
        capture(board, i, partner, board.counts[SOLID])
    else:
        end_phase(board, i)
        if recording:
            log(board, PHASE_ENDS, i, board.tags[i, PHASE], board.state[i, X], board.state[i, Y], 0.0, 0.0, 0.0, 0.0)
    if recording:
        board.log[row, EVENT_TIME] = t
    if board.counts[TRACING] != 0:
        trace(board, i)
        if kind == BALL:
            trace(board, partner)
    alone(board, i, t)
    if kind == BALL:
        alone(board, partner, t)
        seek(board, partner, t)
    seek(board, i, t)


@kernel
def play(board: Board, until: float) -> int:
    """Let all events up to a time happen; return why it stopped."""
    counts, alone_time, pair_best = board.counts, board.alone_time, board.pair_best
    for _ in range(PAUSE):
        t, i, with_another = math.inf, -1, False
        for k in range(len(alone_time)):
            if alone_time[k] < t:
                t, i, with_another = alone_time[k], k, False
            if pair_best[k] < t:
                t, i, with_another = pair_best[k], k, True
        if i < 0 or t > until or counts[AWAKE] == 0:
            return DONE
        if (counts[RECORDING] != 0 and counts[ROWS] >= len(board.log)) or (
            counts[TRACING] != 0 and counts[STEPS] + 2 > len(board.path)
        ):
            return FULL
        if counts[EVENTS] >= counts[LIMIT]:
            return TOO_MANY
        kind, partner = board.alone_what[i, 0], board.alone_what[i, 1]
        if with_another:
            kind, partner = BALL, board.pair_who[i]
        counts[WHO], counts[WHAT], counts[WITH] = i, kind, partner
        counts[EVENTS] += 1
        board.world[NOW] = t
        happen(board, i, kind, partner, t)
    return PAUSED
