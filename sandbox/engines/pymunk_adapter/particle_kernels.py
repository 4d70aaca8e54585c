"""Kernels that advance many particles by all substeps of a frame; they are imported when a scene has many."""

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.kernel import bare_kernel
from sandbox.scene.description.base import Point

TILE = 256
"""Number of coordinates processed at once: they fit into the L1 cache, and the kick is stored for each of them."""


def tile_of(vector: Point | FloatArray) -> FloatArray:
    """Return a vector (2,), repeated to fill a tile, (TILE,)."""
    return np.tile(np.asarray(vector, dtype=np.float64), TILE // 2)


@bare_kernel
def fall(position: FloatArray, velocity: FloatArray, runs: IntArray, h: float, kick: FloatArray, substeps: int) -> None:
    """Advance bodies under the same kick for all: positions by the old velocity, then velocities.

    Coordinates are processed in memory order, x and y in turn, so that the loop is vectorised; four substeps at a time.

    Args:
        position: (2N,) m.
        velocity: (2N,) m/s.
        runs: (K, 2) first index, and the index after the last, of runs of particles.
        h: substep, s.
        kick: (TILE,) m/s, as from `tile_of`.
        substeps: number of substeps.
    """
    for k in range(len(runs)):
        end = 2 * runs[k, 1]
        for first in range(2 * runs[k, 0], end, TILE):
            # Slices: indexed from 0 to their length, the compiler can omit bounds and wrap-around handling.
            x, v = position[first : min(first + TILE, end)], velocity[first : min(first + TILE, end)]
            for _ in range(substeps // 4):
                for i in range(len(x)):
                    coordinate, speed, kick_value = x[i], v[i], kick[i]
                    coordinate += speed * h
                    speed += kick_value
                    coordinate += speed * h
                    speed += kick_value
                    coordinate += speed * h
                    speed += kick_value
                    x[i] = coordinate + speed * h
                    v[i] = speed + kick_value
            for _ in range(substeps % 4):
                for i in range(len(x)):
                    speed = v[i]
                    x[i] += speed * h
                    v[i] = speed + kick[i]


@bare_kernel
def drift(
    position: FloatArray,
    velocity: FloatArray,
    runs: IntArray,
    h: float,
    mass: FloatArray,
    gravity: FloatArray,
    wind: FloatArray,
    rate: float,
    fraction: float,
    substeps: int,
) -> None:
    """Advance bodies under gravity and linear drag, as `air.mean_acceleration` does.

    Args:
        position: (2N,) m.
        velocity: (2N,) m/s.
        runs: as of `fall`.
        h: substep, s.
        mass: (2N,) kg, each twice.
        gravity: (TILE,) m/s².
        wind: (TILE,) m/s.
        rate: of drag, 1/s.
        fraction: mean acceleration of a substep as a fraction of its first.
        substeps: number of substeps.
    """
    for k in range(len(runs)):
        end = 2 * runs[k, 1]
        for first in range(2 * runs[k, 0], end, TILE):
            last = min(first + TILE, end)
            x, v, m = position[first:last], velocity[first:last], mass[first:last]
            for _ in range(substeps):
                for i in range(len(x)):
                    speed = v[i]
                    x[i] += speed * h
                    force = m[i] * ((gravity[i] - rate * (speed - wind[i])) * fraction)
                    v[i] = speed + force * (1.0 / m[i]) * h


@bare_kernel
def turn(angle: FloatArray, spin: FloatArray, runs: IntArray, h: float, substeps: int) -> None:
    """Advance the angles of bodies (N,), rad, by their spins, rad/s."""
    for k in range(len(runs)):
        for i in range(runs[k, 0], runs[k, 1]):
            a, w = angle[i], spin[i]
            for _ in range(substeps):
                a += w * h
            angle[i] = a


@bare_kernel
def all_within(values: FloatArray, runs: IntArray, limit: float) -> bool:
    """Return whether the coordinates (2N,) of all particles are within ± a limit, and not nan."""
    out_of_range = 0
    for k in range(len(runs)):
        coordinates = values[2 * runs[k, 0] : 2 * runs[k, 1]]
        for i in range(len(coordinates)):
            out_of_range += 0 if abs(coordinates[i]) <= limit else 1  # no early exit, so that the loop is vectorised
    return out_of_range == 0
