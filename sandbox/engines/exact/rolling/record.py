"""Record: what the kernels have written down, as values."""

from collections.abc import Sequence

import numpy as np

from sandbox.engines.exact.rolling.board import (
    ALONG_X,
    AT_X,
    BALL,
    BY,
    EVENT_TIME,
    EVENT_WIDTH,
    EVENTS,
    GAVE_X,
    KNOB,
    LINE,
    NOW,
    PHASE_ENDS,
    ROWS,
    STEPS,
    THING,
    WHAT,
    WHO,
    WITH,
    Board,
)
from sandbox.trajectory import Contacts


def with_room(board: Board, rows: int) -> Board:
    """Return the board with a log that holds so many rows."""
    log, what = np.empty((rows, EVENT_WIDTH)), np.empty((rows, 3), np.int64)
    held = int(board.counts[ROWS])
    log[:held], what[:held] = board.log[:held], board.log_what[:held]
    return board._replace(log=log, log_what=what)


def with_paths(board: Board, rows: int) -> Board:
    """Return the board with room for so many motions."""
    path, what = np.empty((rows, BY + 1)), np.empty((rows, 2), np.int64)
    held = int(board.counts[STEPS])
    path[:held], what[:held] = board.path[:held], board.path_what[:held]
    return board._replace(path=path, path_what=what)


def taken(board: Board) -> Contacts:
    """Return the contacts that are logged, and forget them."""
    rows = int(board.counts[ROWS])
    board.counts[ROWS] = 0
    touched = np.flatnonzero(board.log_what[:rows, 0] > PHASE_ENDS)
    log = board.log[touched]
    return Contacts(
        log[:, EVENT_TIME].copy(),
        board.log_what[touched, 1:].copy(),
        log[:, AT_X : AT_X + 2].copy(),
        log[:, ALONG_X : ALONG_X + 2].copy(),
        log[:, GAVE_X : GAVE_X + 2].copy(),
    )


def too_many(board: Board, names: Sequence[str], fixed_names: Sequence[str]) -> str:
    """Say when there were too many events, how many, and whose the last was."""
    counts = board.counts
    kind, partner = int(counts[WHAT]), int(counts[WITH])
    who = repr(names[counts[WHO]])
    if kind == BALL:
        who += f" and {names[partner]!r}"
    elif kind in (LINE, KNOB):
        thing = (board.line_tags if kind == LINE else board.knob_tags)[partner, THING]
        who += f" and {fixed_names[thing]!r}"
    return (
        f"at {float(board.world[NOW]):.9g} s: {int(counts[EVENTS]):,} events, more than may be, last of {who}; "
        "engines that step could go on: pymunk"
    )
