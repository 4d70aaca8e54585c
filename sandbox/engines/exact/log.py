"""Log: one row for each impact and each rest, with the impulse given to the fixed thing or to the higher ball."""

import numpy as np

from sandbox.engines.exact.arena import (
    FORCE,
    NOW,
    NX,
    NY,
    RADIUS,
    RECORDING,
    ROW,
    ROWS,
    SINCE,
    SUPPORT,
    THING,
    Arena,
    X,
    Y,
)
from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.trajectory import Contacts, FloatArray, IntArray

ROOM = 16
"""Rows that one event may need at most."""


@kernel
def open_row(arena: Arena, first: int, second: int, px: float, py: float, nx: float, ny: float) -> int:
    """Add a row without impulse and return its number, or −1 where nothing is logged.

    Args:
        arena: everything.
        first: the lower ball.
        second: the other ball, or −1 − k for the k-th fixed thing.
        px: where they touch, m.
        py: likewise.
        nx: normal from the first to the second.
        ny: likewise.
    """
    if arena.counts[RECORDING] == 0:
        return -1
    row: int = arena.counts[ROWS]
    log, pair = arena.log, arena.log_pair
    log[row, 0], log[row, 1], log[row, 2], log[row, 3], log[row, 4] = arena.world[NOW], px, py, nx, ny
    log[row, 5], log[row, 6] = 0.0, 0.0
    pair[row, 0], pair[row, 1] = first, second
    arena.counts[ROWS] = row + 1
    return row


@kernel
def open_rest(arena: Arena, i: int, which: int) -> None:
    """Give a ball's support a row; two supports that are sides of one thing share theirs."""
    f = arena.tags[i, SUPPORT + which]
    other = arena.tags[i, SUPPORT + 1 - which]
    if other >= 0 and arena.flat_tags[other, THING] == arena.flat_tags[f, THING]:
        arena.tags[i, ROW + which] = arena.tags[i, ROW + 1 - which]
        return
    nx, ny, r = arena.flats[f, NX], arena.flats[f, NY], arena.state[i, RADIUS]
    x, y = arena.state[i, X], arena.state[i, Y]
    arena.tags[i, ROW + which] = open_row(arena, i, -1 - arena.flat_tags[f, THING], x - r * nx, y - r * ny, -nx, -ny)


@kernel
def add_impulse(arena: Arena, row: int, jx: float, jy: float) -> None:
    """Add to what the first of a row has given to the second, N·s."""
    if row >= 0:
        arena.log[row, 5] += jx
        arena.log[row, 6] += jy


@kernel
def log_rest(state: FloatArray, tags: IntArray, log: FloatArray, i: int, t: float) -> None:
    """Add what a ball has given to its supports up to a time."""
    span = t - state[i, SINCE]
    state[i, SINCE] = t
    for which in range(2):
        row = tags[i, ROW + which]
        if row >= 0 and span > 0.0:
            log[row, 5] -= state[i, FORCE + 2 * which] * span
            log[row, 6] -= state[i, FORCE + 2 * which + 1] * span


@kernel
def log_rests(arena: Arena, t: float) -> None:
    """Do so for every ball."""
    for k in range(len(arena.movers)):
        log_rest(arena.state, arena.tags, arena.log, arena.movers[k], t)


def with_room(arena: Arena, rows: int) -> Arena:
    """Return the arena with a log that holds so many rows."""
    log, pair = np.empty((rows, 7)), np.empty((rows, 2), np.int64)
    held = int(arena.counts[ROWS])
    log[:held], pair[:held] = arena.log[:held], arena.log_pair[:held]
    return arena._replace(log=log, log_pair=pair)


def taken(arena: Arena) -> Contacts:
    """Return all rows, and keep those of the supports that still hold, without impulse."""
    rows = int(arena.counts[ROWS])
    log, pair = arena.log[:rows].copy(), arena.log_pair[:rows].copy()
    held = arena.tags[:, ROW : ROW + 2]
    lasting = np.unique(held[held >= 0])
    held[held >= 0] = np.searchsorted(lasting, held[held >= 0])
    kept = len(lasting)
    arena.log[:kept], arena.log_pair[:kept] = log[lasting], pair[lasting]
    arena.log[:kept, 5:] = 0.0
    arena.counts[ROWS] = kept
    return Contacts(log[:, 0].copy(), pair, log[:, 1:3].copy(), log[:, 3:5].copy(), log[:, 5:7].copy())
