"""Rows of a frame table as arrays, into which compiled steps write their frames."""

from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.common.kernel import bare_kernel
from sandbox.frame_table import FrameTable

NO_SPIN: FloatArray = np.empty((0, 0, 3))


class FrameRows(NamedTuple):
    """The rows of a frame table from the first that is not written yet."""

    every: int
    """number of steps between two frames"""
    phase: int
    """steps since the last frame that was due"""
    time: FloatArray
    """(T,) s"""
    position: FloatArray
    """(T, N, 2) m"""
    velocity: FloatArray
    """(T, N, 2) m/s"""
    angle: FloatArray
    """(T, N) rad"""
    angular_velocity: FloatArray
    """(T, N) rad/s"""
    spin: FloatArray
    """(T, N, 3) rad/s; (0, 0, 3) without a surface"""


def free_rows(frames: FrameTable, has_spin: bool = False) -> FrameRows:
    """Return the rows of a table that are not written yet; with `has_spin` also those of spins."""
    free = slice(frames.count, None)
    return FrameRows(
        frames.every,
        frames.steps % frames.every,
        frames.time[free],
        frames.position[free],
        frames.velocity[free],
        frames.angle[free],
        frames.angular_velocity[free],
        frames.spin_rows()[free] if has_spin else NO_SPIN,
    )


def no_rows() -> FrameRows:
    """Return rows for steps of which no frame is due."""
    vectors, numbers = np.empty((0, 0, 2)), np.empty((0, 0))
    return FrameRows(1 << 62, 0, np.empty(0), vectors, vectors, numbers, numbers, NO_SPIN)


@bare_kernel
def is_due(rows: FrameRows, k: int) -> bool:
    """Return whether the frame after the k-th of these steps, counted from 1, is recorded."""
    return (rows.phase + k) % rows.every == 0


@bare_kernel
def write_row(
    rows: FrameRows,
    row: int,
    time: float,
    position: FloatArray,
    velocity: FloatArray,
    angle: FloatArray,
    angular_velocity: FloatArray,
) -> None:
    """Write a state into a row: positions and velocities (N, ≥ 2), angles and angular velocities (N,)."""
    rows.time[row] = time
    for i in range(len(angle)):
        rows.position[row, i, 0], rows.position[row, i, 1] = position[i, 0], position[i, 1]
        rows.velocity[row, i, 0], rows.velocity[row, i, 1] = velocity[i, 0], velocity[i, 1]
        rows.angle[row, i], rows.angular_velocity[row, i] = angle[i], angular_velocity[i]
