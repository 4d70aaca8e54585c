"""Error budget: the parts of a position error that smaller time steps and more solver iterations remove.

Between a run and the truth lie two others: the same step with very many iterations, and a far finer step with very many
iterations. The largest distances between neighbours in this series are the part of the solver, the part of the time
step, and the remaining error. The sum of the three is an upper bound of the total error.

The remaining error is not attributed to the engine's model: with collisions, errors do not fall steadily with the step.
An error that is the same from 16 to 512 substeps can be a tenth of that with 1000, where a contact is found that was
missed before. The error with half the finest substeps is stated too, which shows how it changes.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

from sandbox.engines.registry import ENGINES
from sandbox.jsonable import in_json
from sandbox.measure.compare.metrics import EvaluationContext
from sandbox.measure.metrics.trajectory_error import errors
from sandbox.measure.run.bounded_run import RunTimeoutError, bounded_run
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import SettingsError
from sandbox.trajectory import Trajectory

ITERATION_FACTOR = 16
"""Factor of the iterations; the result approximates that of infinitely many."""
MAX_ITERATIONS = 10_000
"""Largest number of iterations that `[solver]` allows."""
MAX_SUBSTEP_FACTOR = 16
"""Factor of the substeps; the result approximates that of a step of 0. Smaller if the cost limit does not allow it."""


@dataclass(frozen=True)
class ErrorBudget:
    """Parts of the position error of a setting: largest distances, m, between its run, finer ones and the truth."""

    engine: str
    settings: Settings
    total: float
    """distance from the truth"""
    solver: float
    """distance from the run with the same step and many iterations"""
    time_step: float
    """distance of that run from the finest step"""
    residual: float = field(metadata=in_json(key="left"))
    """distance of the finest step from the truth"""
    residual_before: float = field(metadata=in_json(key="left_before"))
    """distance of the next coarser step, with half the substeps of the finest, from the truth"""
    substep_factor: int = field(metadata=in_json(key="finest"))
    """substeps of the finest step in one substep of the setting"""


def error_budget(
    context: EvaluationContext, engine: str, settings: Settings, limit: float, deadline: float = math.inf
) -> ErrorBudget | None:
    """Split the position error of a setting into its parts; None without a truth or if no finer run is allowed.

    Args:
        context: scene and truth.
        engine: name of the engine.
        settings: the setting; choices left to the engine are None.
        limit: counted cost of all runs together, s.
        deadline: time of `clock_without_compilation` after which a run is stopped, s.
    """
    if context.truth is None:
        return None
    runs = _LimitedRuns(context, engine, limit, deadline)
    coarse = runs.run(settings)
    if coarse is None:
        return None
    iterated = settings.replace(iterations=min(settings.iterations * ITERATION_FACTOR, MAX_ITERATIONS))
    converged = runs.run(iterated)
    if converged is None:
        return None
    finest, factor, before = converged, 1, None
    for next_factor, run in runs.refine(iterated):
        before, finest, factor = finest, run, next_factor
    if before is None:
        return None
    truth = context.truth.trajectory
    return ErrorBudget(
        engine=engine,
        settings=ENGINES[engine].resolve(context.scene, settings),
        total=runs.distance(coarse, truth),
        solver=runs.distance(coarse, converged),
        time_step=runs.distance(converged, finest),
        residual=runs.distance(finest, truth),
        residual_before=runs.distance(before, truth),
        substep_factor=factor,
    )


@dataclass
class _LimitedRuns:
    """Runs of one engine that share a limit of counted cost."""

    context: EvaluationContext
    engine: str
    remaining: float
    """counted cost that further runs may have, s"""
    deadline: float

    def run(self, settings: Settings) -> Trajectory | None:
        """Return a run that reached its end, or None."""
        if self.remaining <= 0.0:
            return None
        scene = self.context.scene
        try:
            found, counted = bounded_run(scene, self.engine, settings, self.remaining, self.deadline, audit=False)
        except RunTimeoutError:
            self.remaining = 0.0
            return None
        self.remaining -= counted
        return found if found.status == "ok" else None

    def refine(self, settings: Settings) -> Iterator[tuple[int, Trajectory]]:
        """Yield runs with 2, 4, 8 … times the substeps, with the factor, as long as the limit allows."""
        factor = 2
        while factor <= MAX_SUBSTEP_FACTOR:
            try:
                finer = settings.replace(substeps=settings.substeps * factor)
            except SettingsError:
                return
            if ENGINES[self.engine].missing(self.context.scene, finer):
                return
            found = self.run(finer)
            if found is None:
                return
            yield factor, found
            factor *= 2

    def distance(self, a: Trajectory, b: Trajectory) -> float:
        """Return the largest distance of any body between two runs, m, up to the time to which the truth is trusted."""
        found = errors(a, b, self.context.moving).largest("position", self.context.until)
        return 0.0 if found is None else found
