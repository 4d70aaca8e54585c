"""Judge: what a scene's runs are held against, worked out once for all of them."""

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.measure.compare.errors import Errors, errors
from sandbox.measure.compare.truth import Truth
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

SCREEN = 1280.0, 720.0
"""px of the window that a scene is thought to be shown in."""
MARGIN = 0.9
"""The share of the window that it fills."""
STILL = 0.01
"""The share of its half width by which a body may move in a whole second half and still lies still."""


@dataclass(frozen=True, eq=False)
class Judge:
    """A scene, the truth about it, and the scale at which it is looked at."""

    scene: Scene
    truth: Truth | None
    zoom: float
    """px/m"""
    doubt: str | None = None
    """why there is no truth, where that is known"""
    _last: list[tuple[Trajectory, Errors]] = field(default_factory=list, init=False, repr=False)

    @property
    def until(self) -> float:
        """Up to when positions are held against the truth, s."""
        return self.scene.world.duration if self.truth is None else self.truth.trusted_until

    @cached_property
    def moving(self) -> BoolArray:
        """Which bodies move, (N,)."""
        return ~self.scene.bodies.fixed

    @cached_property
    def down(self) -> FloatArray | None:
        """The direction of gravity, (2,); None without any."""
        strength = math.hypot(*self.scene.world.gravity)
        return np.asarray(self.scene.world.gravity) / strength if strength > 0.0 else None

    @cached_property
    def quiet(self) -> FloatArray:
        """The speed below which each body has settled, (N,) m/s.

        What falls by 1 % of its half width gets as fast; without gravity, a thousandth of the fastest start.
        """
        bodies, gravity = self.scene.bodies, math.hypot(*self.scene.world.gravity)
        if gravity > 0.0:
            return np.sqrt(2.0 * gravity * STILL * bodies.thin)
        return np.full(len(bodies), 1e-3 * float(np.hypot(*bodies.velocity.T).max(initial=0.0)))

    def errors(self, run: Trajectory) -> Errors:
        """Return the errors of a run against the truth; several metrics ask for those of the same run."""
        assert self.truth is not None
        for known, found in self._last:
            if known is run:
                return found
        self._last[:] = [(run, errors(run, self.truth.trajectory, self.moving))]
        return self._last[0][1]

    @cached_property
    def still(self) -> BoolArray:
        """Which bodies move, but in the truth lie still through its second half, (N,); none without a truth."""
        if self.truth is None or not len(self.truth.trajectory.time):
            return np.zeros(len(self.scene.bodies), dtype=np.bool_)
        away = strayed(self.truth.trajectory)
        return np.asarray(self.moving & (away <= STILL * self.scene.bodies.thin))

    @cached_property
    def standing(self) -> BoolArray:
        """Which of the bodies that lie still never leave the place where they start in the truth, (N,)."""
        if not self.still.any():
            return self.still
        assert self.truth is not None
        away = strayed(self.truth.trajectory, since=0.0)
        return np.asarray(self.still & (away <= STILL * self.scene.bodies.thin))


def strayed(run: Trajectory, since: float = 0.5) -> FloatArray:
    """Return how far each body gets, in the last part of a run, from where it was at that part's beginning, (N,) m.

    Args:
        run: which.
        since: where the part begins, as a fraction of the run's time; usually its second half.
    """
    half = run.position[run.time >= since * run.time[-1]]
    # A diverged state is infinitely far off.
    with np.errstate(over="ignore", invalid="ignore"):
        away = np.hypot(*np.moveaxis(half - half[0], 2, 0)).max(axis=0)
    return np.where(np.isnan(away), np.inf, away)


def zoom_of(scene: Scene, truth: Truth | None) -> float:
    """Return the zoom at which all places that bodies get to fill a window of 1280 × 720, px/m."""
    bodies = scene.bodies
    places = bodies.position[None] if truth is None else truth.trajectory.position
    reach = bodies.radius[:, None]
    with np.errstate(invalid="ignore"):
        low = np.nanmin(places - reach, axis=(0, 1), initial=np.inf)
        high = np.nanmax(places + reach, axis=(0, 1), initial=-np.inf)
    size = high - low
    if not (np.isfinite(size).all() and (size > 0.0).all()):
        return 100.0
    return float(min(MARGIN * SCREEN[0] / size[0], MARGIN * SCREEN[1] / size[1]))
