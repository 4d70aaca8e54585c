"""Flight: substeps of free flight for arrays of bodies, each operation as Munk2D performs it, in its order.

Compiled, a frame's substeps of a body are done while its state is in registers; both ways round alike, bit for bit.
"""

import numpy as np

from sandbox.engines.kernel import bare_kernel
from sandbox.scene.near import FloatArray, IntArray
from sandbox.scene.part import Point

TILE = 256
"""Numbers worked on at once: few enough for the nearest cache, and a kick for each of them is stated."""


def tile_of(vector: Point | FloatArray) -> FloatArray:
    """Return a vector (2,), repeated for as many bodies as a tile holds, (TILE,)."""
    return np.tile(np.asarray(vector, dtype=np.float64), TILE // 2)


@bare_kernel
def fall(position: FloatArray, velocity: FloatArray, runs: IntArray, h: float, kick: FloatArray, substeps: int) -> None:
    """Advance bodies under one kick for all: positions by the old velocity, then velocities.

    Numbers are taken as they lie, x and y in turn, so that several are done at once; four substeps at a time.

    Args:
        position: (2N,) m.
        velocity: (2N,) m/s.
        runs: (K, 2) first number and the one after the last of those that fly.
        h: substep, s.
        kick: (TILE,) m/s, as `tile_of` makes it.
        substeps: how many.
    """
    for k in range(len(runs)):
        end = 2 * runs[k, 1]
        for first in range(2 * runs[k, 0], end, TILE):
            # Slices: of what is counted from their own beginning, the compiler knows that it is within.
            x, v = position[first : min(first + TILE, end)], velocity[first : min(first + TILE, end)]
            for _ in range(substeps // 4):
                for i in range(len(x)):
                    place, speed, more = x[i], v[i], kick[i]
                    place += speed * h
                    speed += more
                    place += speed * h
                    speed += more
                    place += speed * h
                    speed += more
                    x[i] = place + speed * h
                    v[i] = speed + more
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
    share: float,
    substeps: int,
) -> None:
    """Advance bodies under gravity and linear drag, as `drag.acceleration` has it.

    Args:
        position: (2N,) m.
        velocity: (2N,) m/s.
        runs: as of `fall`.
        h: substep, s.
        mass: (2N,) kg, each twice.
        gravity: (TILE,) m/s².
        wind: (TILE,) m/s.
        rate: of drag, 1/s.
        share: of its first acceleration that a substep's mean is.
        substeps: how many.
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
                    force = m[i] * ((gravity[i] - rate * (speed - wind[i])) * share)
                    v[i] = speed + force * (1.0 / m[i]) * h


@bare_kernel
def turn(angle: FloatArray, spin: FloatArray, runs: IntArray, h: float, substeps: int) -> None:
    """Turn bodies (N,), rad, by their spins, rad/s."""
    for k in range(len(runs)):
        for i in range(runs[k, 0], runs[k, 1]):
            a, w = angle[i], spin[i]
            for _ in range(substeps):
                a += w * h
            angle[i] = a


@bare_kernel
def calm(values: FloatArray, runs: IntArray, limit: float) -> bool:
    """Tell whether all pairs of numbers (2N,) of those that fly are within ± a limit, and so no nan."""
    wild = 0
    for k in range(len(runs)):
        some = values[2 * runs[k, 0] : 2 * runs[k, 1]]
        for i in range(len(some)):
            wild += 0 if abs(some[i]) <= limit else 1  # no way out on the way: so several are looked at at once
    return wild == 0


def runs_of(numbers: IntArray) -> IntArray:
    """Return where consecutive ones of sorted numbers (M,) begin, and the number after each last, (K, 2)."""
    if not len(numbers):
        return np.empty((0, 2), np.int64)
    breaks = np.flatnonzero(np.diff(numbers) != 1) + 1
    first = numbers[np.concatenate(([0], breaks))]
    last = numbers[np.concatenate((breaks - 1, [len(numbers) - 1]))]
    return np.column_stack((first, last + 1))
