"""Shoot: whole shots, from the stroke until all rest, in one kernel call each, or many in one."""

import math

from sandbox.engines.exact.rolling.board import (
    ACCOUNTING,
    AWAKE,
    BOOKED,
    EVENTS,
    NOW,
    PHASE,
    ROWS,
    STEPS,
    TRACING,
    VX,
    WX,
    Board,
    X,
    Y,
)
from sandbox.engines.exact.rolling.book import arrive_all
from sandbox.engines.exact.rolling.motion import trace
from sandbox.engines.exact.rolling.play import CUT, DONE, PAUSED, play, set_out
from sandbox.engines.floor.phase import CAPTURED, RESTING
from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.trajectory import FloatArray, IntArray

UNSTRUCK = -1
"""In place of a ball's number: the balls go on as they stand."""


@kernel
def shoot(board: Board, state: FloatArray, tags: IntArray, ball: int, motion: FloatArray, until: float) -> int:
    """Play a shot; return why it stopped: `DONE` if all rest, `CUT` if not all do, else as `play` does.

    Args:
        board: to play on; whatever it held is gone.
        state: (N, 19) how all stand before it.
        tags: (N, 3) likewise.
        ball: who is struck, or `UNSTRUCK`.
        motion: (5,) that ball's velocity, m/s, and spin, rad/s, after the stroke.
        until: s, when to stop if not all rest before.
    """
    counts = board.counts
    for i in range(len(state)):
        for column in range(state.shape[1]):
            board.state[i, column] = state[i, column]
        for column in range(tags.shape[1]):
            board.tags[i, column] = tags[i, column]
    counts[ROWS], counts[STEPS], counts[EVENTS], counts[AWAKE] = 0, 0, 0, 0
    for i in range(len(state)):
        counts[AWAKE] += board.tags[i, PHASE] not in (RESTING, CAPTURED)
        if counts[ACCOUNTING] != 0:
            board.state[i, BOOKED] = 0.0
    if ball >= 0:
        for k in range(2):
            board.state[ball, VX + k] = motion[k]
        for k in range(3):
            board.state[ball, WX + k] = motion[2 + k]
    board.world[NOW] = 0.0
    set_out(board, 0.0)
    if counts[TRACING] != 0:
        for i in range(len(state)):
            trace(board, i)
    status = play(board, until)
    while status == PAUSED:
        status = play(board, until)
    if status == DONE and counts[AWAKE] != 0:
        arrive_all(board, until if until < math.inf else board.world[NOW])
        status = CUT
    return status


@kernel
def shoot_many(
    board: Board,
    state: FloatArray,
    tags: IntArray,
    balls: IntArray,
    motions: FloatArray,
    until: float,
    rest: FloatArray,
    pocket: IntArray,
    ends: FloatArray,
    events: IntArray,
    status: IntArray,
) -> None:
    """Play M shots from one state of N balls, each as `shoot` does.

    Args:
        board: to play on; nothing is logged.
        state: as in `shoot`.
        tags: as in `shoot`.
        balls: (M,)
        motions: (M, 5)
        until: as in `shoot`.
        rest: (M, N, 2) where the balls are in the end, m; written.
        pocket: (M, N) into which pocket each has fallen, −1 for none; written.
        ends: (M,) s, when the last event was; written.
        events: (M,) how many there were; written.
        status: (M,) why each stopped; written.
    """
    for m in range(len(balls)):
        status[m] = shoot(board, state, tags, balls[m], motions[m], until)
        ends[m], events[m] = board.world[NOW], board.counts[EVENTS]
        for i in range(len(state)):
            rest[m, i, 0], rest[m, i, 1] = board.state[i, X], board.state[i, Y]
            pocket[m, i] = -1
            if board.tags[i, PHASE] == CAPTURED:  # it lies at the centre, to the bit
                for k in range(len(board.pockets)):
                    if board.pockets[k, 0] == board.state[i, X] and board.pockets[k, 1] == board.state[i, Y]:
                        pocket[m, i] = k
