"""Error of a run against another one, in the frames that both have."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.scene.compile.scene import Scene
from sandbox.trajectory import Trajectory

SAME_TIME = 1e-6
"""Frames closer than this fraction of the shortest interval have the same time: k·dt is rounded."""


def common_frames(a: Trajectory, b: Trajectory) -> tuple[IntArray, IntArray]:
    """Return the indices of the frames with equal times in two runs, (K,) each."""
    if not len(a.time) or not len(b.time):
        return np.empty(0, np.int64), np.empty(0, np.int64)
    after = np.searchsorted(b.time, a.time).clip(1, max(len(b.time) - 1, 1))
    before = after - 1
    after = after.clip(0, len(b.time) - 1)
    nearest = np.where(np.abs(b.time[before] - a.time) <= np.abs(b.time[after] - a.time), before, after)
    slack = SAME_TIME * min(float(np.min(np.diff(each.time), initial=np.inf)) for each in (a, b))
    same = np.abs(b.time[nearest] - a.time) <= slack
    return np.flatnonzero(same), nearest[same]


CHUNK = 2_000_000
"""Frames × bodies processed at once."""
TOLERANCE = 0.01
"""Default tolerance as a fraction of the smallest radius, or half width, of the moving bodies."""
QUANTITIES = "position", "velocity", "angle"
"""Arrays of a run that are compared. Angles count whole turns: a wheel that has turned once more is off by 2π."""


class Deviation(NamedTuple):
    """Deviations of one quantity of the bodies from the truth, in K frames."""

    largest: FloatArray
    """(K,) largest over the bodies; inf if the run is no longer finite"""
    squares: FloatArray
    """(K,) sum of the squares over the bodies"""


@dataclass(frozen=True, eq=False)
class Errors:
    """Deviations of a run from the truth in their K common frames, over the bodies that are present in both."""

    time: FloatArray
    """(K,) s"""
    by_quantity: Mapping[str, Deviation]
    """deviations by the name of an array of `Trajectory`, those of `QUANTITIES`"""
    count: FloatArray
    """(K,) number of compared bodies"""
    body: IntArray
    """(K,) index of the body with the largest distance"""

    @property
    def position(self) -> FloatArray:
        """(K,) m, largest distance; inf if the run is no longer finite."""
        return self.by_quantity["position"].largest

    def largest(self, quantity: str, end: float) -> float | None:
        """Return the largest deviation in the frames up to a time, s, inclusive; None without a frame or body."""
        kept = self.time <= end
        return float(self.by_quantity[quantity].largest[kept].max()) if self.count[kept].any() else None

    def root_mean_square(self, quantity: str, end: float) -> float | None:
        """Return the root mean square over frames and bodies, likewise."""
        kept = self.time <= end
        count = float(self.count[kept].sum())
        return math.sqrt(float(self.by_quantity[quantity].squares[kept].sum()) / count) if count else None

    def first_above(self, tolerance: float, end: float) -> float | None:
        """Return the time of the first frame up to `end`, s, whose position error exceeds a tolerance, m; or None."""
        above = (self.position > tolerance) & (self.time <= end)
        return float(self.time[above.argmax()]) if above.any() else None


def divergence_times(run: Trajectory, truth: Trajectory, tolerance: float) -> FloatArray:
    """Return the time of the first common frame in which each body has an error above a tolerance, (N,) s; else inf.

    A body that is present in only one of the two has an infinite error.
    """
    frames, truth_frames = common_frames(run, truth)
    found = np.full(len(run.names), np.inf)
    step = max(1, CHUNK // max(1, len(found)))
    for begin in range(0, len(frames), step):
        rows = slice(begin, begin + step)
        with np.errstate(over="ignore", invalid="ignore"):
            away = np.hypot(*np.moveaxis(run.position[frames[rows]] - truth.position[truth_frames[rows]], 2, 0))
        is_off = ~(away <= tolerance) | (run.present(frames[rows]) != truth.present(truth_frames[rows]))
        first = np.where(is_off.any(axis=0), run.time[frames[rows]][is_off.argmax(axis=0)], np.inf)
        found = np.minimum(found, first)
    return found


def errors(run: Trajectory, truth: Trajectory, moving: BoolArray, until: FloatArray | None = None) -> Errors:
    """Return the errors of a run against the truth.

    Args:
        run: the run.
        truth: the truth; only frames with equal times are compared.
        moving: bodies that count, (N,).
        until: (N,) s, time up to which each body counts; default: to the end.
    """
    frames, truth_frames = common_frames(run, truth)
    size = len(frames)
    found = {name: Deviation(np.zeros(size), np.zeros(size)) for name in QUANTITIES}
    numbers, body, count = np.flatnonzero(moving), np.zeros(size, np.int64), np.zeros(size)
    step = max(1, CHUNK // max(1, len(numbers)))
    for begin in range(0, size if len(numbers) else 0, step):
        rows = slice(begin, begin + step)
        both = (run.present(frames[rows]) & truth.present(truth_frames[rows]))[:, numbers]
        if until is not None:
            both &= run.time[frames[rows], None] <= until[numbers]
        count[rows] = both.sum(axis=1)
        for name, deviation in found.items():
            actual, expected = getattr(run, name)[frames[rows]], getattr(truth, name)[truth_frames[rows]]
            # The distances of a diverged state are infinite.
            with np.errstate(over="ignore", invalid="ignore"):
                away = np.abs(actual[:, numbers] - expected[:, numbers])
                away = np.hypot(away[..., 0], away[..., 1]) if away.ndim == 3 else away
                away = np.where(both, np.where(np.isnan(away), np.inf, away), 0.0)
                deviation.largest[rows], deviation.squares[rows] = away.max(axis=1), np.square(away).sum(axis=1)
            if name == "position":
                body[rows] = numbers[away.argmax(axis=1)]
    return Errors(run.time[frames], found, count, body)


def default_tolerance(scene: Scene) -> float:
    """Return 1 % of the smallest radius or half width of the moving bodies, m; 1 mm if no body moves."""
    bodies = scene.bodies
    thin = bodies.thin[~bodies.fixed]
    return TOLERANCE * float(thin.min()) if len(thin) else 1e-3
