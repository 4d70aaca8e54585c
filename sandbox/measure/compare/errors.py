"""Errors: distance of a run from the truth, frame by frame."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.measure.compare.runs import common_frames, there
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

CHUNK = 2_000_000
"""Frames × bodies worked on at once."""
TOLERANCE = 0.01
"""Default tolerance as a fraction of the smallest radius, or half width, of the moving bodies."""


class Score(NamedTuple):
    """Errors over all moving bodies and all frames up to a time; None if there are no such frames or bodies."""

    max_position: float | None
    """m, largest position error"""
    rms_position: float | None
    """m, root mean square over frames and bodies"""
    max_velocity: float | None
    """m/s, largest velocity error"""
    rms_velocity: float | None
    """m/s, root mean square over frames and bodies"""


@dataclass(frozen=True, eq=False)
class Errors:
    """Distances between a run and the truth at the K frames that they share, over the bodies both still have."""

    time: FloatArray
    """(K,) s"""
    position: FloatArray
    """(K,) the largest, m; inf where the run is no longer finite"""
    velocity: FloatArray
    """(K,) the largest, m/s"""
    squares: FloatArray
    """(2, K) sums of the squares of both over the bodies"""
    count: FloatArray
    """(K,) bodies compared"""

    def until(self, end: float) -> Score:
        """Score the frames up to a time, s, itself included."""
        kept = self.time <= end
        count = float(self.count[kept].sum())
        if count == 0.0:
            return Score(None, None, None, None)
        position, velocity = np.sqrt(self.squares[:, kept].sum(axis=1) / count).tolist()
        return Score(float(self.position[kept].max()), position, float(self.velocity[kept].max()), velocity)

    def first_above(self, tolerance: float, end: float) -> float | None:
        """Return the time of the first frame, up to `end`, whose position error exceeds a tolerance."""
        above = (self.position > tolerance) & (self.time <= end)
        return float(self.time[above.argmax()]) if above.any() else None


def divergence_times(run: Trajectory, truth: Trajectory, tolerance: float) -> FloatArray:
    """Return the time of the first common frame in which each body is off by more than a tolerance, (N,) s; else inf.

    A body that only one of the two still has counts as off.
    """
    mine, its = common_frames(run, truth)
    found = np.full(len(run.names), np.inf)
    step = max(1, CHUNK // max(1, len(found)))
    for begin in range(0, len(mine), step):
        rows = slice(begin, begin + step)
        with np.errstate(over="ignore", invalid="ignore"):
            away = np.hypot(*np.moveaxis(run.position[mine[rows]] - truth.position[its[rows]], 2, 0))
        off = ~(away <= tolerance) | (there(run, mine[rows]) != there(truth, its[rows]))
        first = np.where(off.any(axis=0), run.time[mine[rows]][off.argmax(axis=0)], np.inf)
        found = np.minimum(found, first)
    return found


def errors(run: Trajectory, truth: Trajectory, moving: BoolArray) -> Errors:
    """Return the errors of a run against the truth.

    Args:
        run: of the same scene.
        truth: its frames may lie elsewhere; only common ones are compared.
        moving: (N,) the bodies that count.
    """
    mine, its = common_frames(run, truth)
    size = len(mine)
    largest, squares, count = np.zeros((2, size)), np.zeros((2, size)), np.zeros(size)
    numbers = np.flatnonzero(moving)
    step = max(1, CHUNK // max(1, len(numbers)))
    for begin in range(0, size if len(numbers) else 0, step):
        rows = slice(begin, begin + step)
        both = (there(run, mine[rows]) & there(truth, its[rows]))[:, numbers]
        count[rows] = both.sum(axis=1)
        for k, name in enumerate(("position", "velocity")):
            found, right = getattr(run, name)[mine[rows]], getattr(truth, name)[its[rows]]
            # A diverged state has no finite distance: that is its error, not a fault.
            with np.errstate(over="ignore", invalid="ignore"):
                away = np.hypot(*np.moveaxis(found[:, numbers] - right[:, numbers], 2, 0))
                away = np.where(both, np.where(np.isnan(away), np.inf, away), 0.0)
                largest[k, rows], squares[k, rows] = away.max(axis=1), np.square(away).sum(axis=1)
    return Errors(run.time[mine], largest[0], largest[1], squares, count)


def usual_tolerance(scene: Scene) -> float:
    """Return 1 % of the smallest radius, or half width, of the bodies that move, m; where none does, 1 mm."""
    bodies = scene.bodies
    thin = bodies.thin[~bodies.fixed]
    return TOLERANCE * float(thin.min()) if len(thin) else 1e-3
