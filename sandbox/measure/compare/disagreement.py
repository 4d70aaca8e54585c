"""Disagreement: whether two engines, or an engine and the truth, part where it cannot be blamed on chaos."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sandbox.measure.bounded_run import bounded_run, working
from sandbox.measure.compare.errors import errors
from sandbox.measure.compare.horizon import agree_until, perturb
from sandbox.measure.compare.runs import common_frames, there
from sandbox.measure.compare.truth import truth_of
from sandbox.scene.compile.setup import Setup
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory


class Parting(NamedTuple):
    """The first frame at which two runs differ by more than the tolerance."""

    time: float
    """s"""
    body: str | None
    """the one that is farthest off, by name; None where a run has ended before"""
    distance: float
    """m; inf where a run is no longer finite"""
    bodies: frozenset[str] = frozenset()
    """all that are farther off than the tolerance then"""


class Disagreement:
    """What is asked of every scene that may be smaller: do they still part?

    Of one engine, from the truth, up to its `trusted_until`. Of two, from each other, up to when a perturbation of
    all bodies by 1e-12 m moves anything by more than the tolerance in either: both is a run's `first_divergence`, as
    `compare` has it. A run that is refused or fails parts from nothing.
    """

    def __init__(self, engines: Sequence[str], tolerance: float) -> None:
        """Ask about one engine, or two.

        Args:
            engines: their names.
            tolerance: of positions, m.

        Raises:
            ValueError: there are none, or more than two.
        """
        if not 1 <= len(engines) <= 2:
            raise ValueError(
                f"a disagreement is between one engine and the truth, or between two engines, not {len(engines)}"
            )
        self.engines, self.tolerance = tuple(engines), tolerance

    def __str__(self) -> str:
        """Name who disagrees."""
        return " and ".join((*self.engines, "the truth")[:2])

    def of(self, scene: Scene, patience: float = math.inf) -> Parting | None:
        """Return where they part in a scene, or None.

        Args:
            scene: what to run, with its own settings.
            patience: s that the engines' runs may take altogether; a truth that is sought has limits of its own.

        Raises:
            TookTooLongError: it took longer.
            TooLargeError: the frames would not fit into memory.
        """
        deadline = working() + patience

        def ran(which: Setup, engine: str) -> Trajectory:
            return bounded_run(which, engine, which.scene.solver, math.inf, deadline, audit=False)[0]

        if len(self.engines) == 1:
            truth = truth_of(scene, scene.solver, self.tolerance)
            if truth is None:
                return None
            return self._parting(scene, ran(Setup.of(scene), self.engines[0]), truth.trajectory, truth.trusted_until)
        one, other = (ran(Setup.of(scene), engine) for engine in self.engines)
        parting = self._parting(scene, one, other, scene.world.duration)
        moved = perturb(scene) if parting is not None else None
        if parting is None or moved is None:
            return parting
        for engine, run in zip(self.engines, (one, other), strict=True):
            again = ran(moved, engine)
            if run.status == again.status == "ok" and agree_until(run, again, scene, self.tolerance) < parting.time:
                return None
        return parting

    def _parting(self, scene: Scene, one: Trajectory, other: Trajectory, until: float) -> Parting | None:
        """Return where two runs part up to a time, s."""
        if {one.status, other.status} - {"ok", "diverged"}:
            return None
        moving = ~scene.bodies.fixed
        first = errors(one, other, moving).first_above(self.tolerance, until)
        if first is None:  # all frames that both have agree: but one may have no more
            early = min((run for run in (one, other) if run.status == "diverged"), key=_end, default=None)
            if early is None or _end(early) > until or one.status == other.status:
                return None
            return Parting(_end(early), None, math.inf)
        mine, its = common_frames(one, other)
        at = int(np.flatnonzero(one.time[mine] == first)[0])
        both = (there(one, mine[at : at + 1]) & there(other, its[at : at + 1]))[0] & moving
        with np.errstate(over="ignore", invalid="ignore"):
            away = np.hypot(*(one.position[mine[at]] - other.position[its[at]]).T)
        away = np.where(both, np.where(np.isnan(away), np.inf, away), -1.0)
        worst = int(away.argmax())
        off = frozenset(map(str, one.names[away > self.tolerance]))
        return Parting(first, str(one.names[worst]), float(away[worst]), off)


def _end(run: Trajectory) -> float:
    return float(run.time[-1])
