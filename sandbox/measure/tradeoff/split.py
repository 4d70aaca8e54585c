"""Split: an error taken apart into what the model, the time step and the solver's iterations each cause.

Three limits are measured on the way from a setting to the truth: the same step with very many iterations, the finest
step with very many iterations, and the truth. The largest distances between neighbours on that way are the solver's,
the time step's and the model's parts; the whole is at most their sum, and may be less where they cancel.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from sandbox.engines.registry import ENGINES
from sandbox.measure.bounded_run import TookTooLongError, bounded_run
from sandbox.measure.compare.errors import errors
from sandbox.measure.finite import finite
from sandbox.measure.tradeoff.judge import Judge
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Trajectory

MANY_ITERATIONS = 16
"""How many times the iterations stand for infinitely many."""
FINEST = 16
"""How many times the substeps stand for a step of 0, if the limit allows; else as many as it does."""


@dataclass(frozen=True)
class Split:
    """Parts of the position error of a setting: largest distances, m, between its run, the limits and the truth."""

    engine: str
    settings: Settings
    total: float
    """distance from the truth"""
    solver: float
    """distance from the run with the same step and many iterations"""
    time_step: float
    """distance of that run from the finest step"""
    model: float | None
    """distance of the finest step from the truth; None if it still decreases with the step"""
    left: float
    """error of the finest step: the part of the model and the rest of the part of the time step"""
    finest: int
    """substeps of the finest step in one substep of the setting"""

    def document(self) -> dict[str, Any]:
        """Return the split as a JSON object."""
        figures = ("total", "solver", "time_step", "model", "left")
        own = {"engine": self.engine, "settings": self.settings.model_dump(mode="json")}
        return {**own, **{key: finite(getattr(self, key)) for key in figures}, "finest": self.finest}


def split(judge: Judge, engine: str, asked: Settings, limit: float, deadline: float = math.inf) -> Split | None:
    """Take the position error of an engine's settings apart; None where no truth is, or no finer run is allowed.

    The model's part is what is left at the finest step, if halving the step changed it by less than a tenth; a part
    that still shrinks belongs to the time step.

    Args:
        judge: gives scene and truth.
        engine: its name.
        asked: settings, choices left to the engine still open.
        limit: counted cost that all runs together may have, s.
        deadline: by the clock of `working`, s.
    """
    if judge.truth is None:
        return None
    runs = _Runs(judge, engine, limit, deadline)
    own = runs.of(asked)
    if own is None:
        return None
    many = asked.replace(iterations=min(asked.iterations * MANY_ITERATIONS, 10_000))
    converged = runs.of(many)
    if converged is None:
        return None
    finest, times, before = converged, 1, None
    for factor, run in runs.finer(many):
        before, finest, times = finest, run, factor
    if before is None:
        return None
    left = runs.apart(finest, judge.truth.trajectory)
    still = runs.apart(before, judge.truth.trajectory) > 1.1 * left
    return Split(
        engine,
        ENGINES[engine].resolve(judge.scene, asked),
        total=runs.apart(own, judge.truth.trajectory),
        solver=runs.apart(own, converged),
        time_step=runs.apart(converged, finest),
        model=None if still else left,
        left=left,
        finest=times,
    )


@dataclass
class _Runs:
    judge: Judge
    engine: str
    left: float
    """counted cost that further runs may have, s"""
    deadline: float

    def of(self, settings: Settings) -> Trajectory | None:
        """Return a run that got to its end, or None."""
        if self.left <= 0.0:
            return None
        try:
            scene, end = self.judge.scene, self.deadline
            found, counted = bounded_run(scene, self.engine, settings, self.left, end, audit=False)
        except TookTooLongError:
            self.left = 0.0
            return None
        self.left -= counted
        return found if found.status == "ok" else None

    def finer(self, settings: Settings) -> Iterator[tuple[int, Trajectory]]:
        """Yield runs of ever more substeps, 2, 4, 8 …, as long as they are allowed."""
        factor = 2
        while factor <= FINEST:
            try:
                finer = settings.replace(substeps=settings.substeps * factor)
            except ValidationError:
                return
            if ENGINES[self.engine].missing(self.judge.scene, finer):
                return
            found = self.of(finer)
            if found is None:
                return
            yield factor, found
            factor *= 2

    def apart(self, a: Trajectory, b: Trajectory) -> float:
        """Return the largest distance of any body in the two runs, m, as far as the truth is trusted."""
        found = errors(a, b, self.judge.moving).until(self.judge.until).max_position
        return 0.0 if found is None else found
