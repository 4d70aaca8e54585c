"""Touches: contact rows gathered into what a fixed step can tell apart.

A ball that comes to rest bounces ever lower and faster, and no two engines count the last bounces alike. So rows
of one pair that follow each other closely are one touch, which lasts.
"""

from dataclasses import dataclass

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.measure.collisions import together
from sandbox.measure.compare.gaps import gap
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

CLOSE = 4.0
"""Rows of one pair that follow within so many steps are one touch."""

Pair = tuple[int, int]


@dataclass(frozen=True)
class Touch:
    """One contact of a pair, or several that follow each other closely."""

    start: float
    """s"""
    end: float
    """s, when last seen to touch; `start` where it was but an impact"""
    point: tuple[float, float]
    """of the first touch, m"""
    impulse: tuple[float, float]
    """by the first of the pair on the second, summed, N·s"""


def touches(run: Trajectory, scene: Scene, dt: float, reach: float, until: float) -> dict[Pair, list[Touch]]:
    """Return the touches of each pair in the order of time.

    A row joins the one before it where it follows within `CLOSE` steps, or where in every frame between them the
    two stay within reach: their gap is at most that.

    Args:
        run: whose contacts.
        scene: its scene.
        dt: the step that the runs have in common, s.
        reach: m.
        until: only rows that begin up to then count, s.
    """
    order = np.lexsort((run.contact_time, run.contact_pair[:, 1], run.contact_pair[:, 0]))
    order = order[run.contact_time[order] <= until]
    pairs = run.contact_pair[order]
    cuts = np.flatnonzero((np.diff(pairs, axis=0) != 0).any(axis=1)) + 1
    found: dict[Pair, list[Touch]] = {}
    for rows in np.split(order, cuts) if len(order) else []:
        pair = (int(run.contact_pair[rows[0], 0]), int(run.contact_pair[rows[0], 1]))
        time = run.contact_time[rows]
        ends = _ends(run, scene, pair, time, reach)
        found[pair] = _gathered(time, ends, run.contact_point[rows], run.contact_impulse[rows], CLOSE * dt)
    return found


def _ends(run: Trajectory, scene: Scene, pair: Pair, time: FloatArray, reach: float) -> FloatArray:
    """Return until when the two stay within reach after each of the times: the last frame before they part."""
    apart = ~(gap(scene, scene.bodies, run.position, run.angle, pair) <= reach) | ~together(run, scene, pair)
    # For every frame the number of the next one apart, the frame itself included.
    number = np.where(apart, np.arange(len(apart)), len(apart))
    following = np.minimum.accumulate(number[::-1])[::-1]
    first = np.searchsorted(run.time, time, side="left")
    parted = np.append(following, len(apart))[first]
    return np.asarray(np.maximum(time, run.time[(parted - 1).clip(0)]))


def _gathered(
    time: FloatArray, ends: FloatArray, points: FloatArray, impulses: FloatArray, close: float
) -> list[Touch]:
    touching: list[Touch] = []
    groups = np.flatnonzero(time[1:] > np.maximum(np.maximum.accumulate(ends)[:-1], time[:-1] + close)) + 1
    for rows in np.split(np.arange(len(time)), groups):
        x, y = points[rows[0]].tolist()
        jx, jy = impulses[rows].sum(axis=0).tolist()
        end = float(max(ends[rows].max(), time[rows[-1]]))
        touching.append(Touch(float(time[rows[0]]), end, (x, y), (jx, jy)))
    return touching
