"""Error budget: the parts of a position error that the model, the time step and the solver iterations cause.

Between a run and the truth lie two limits: the same step with very many iterations, and the finest step with very many
iterations. The largest distances between neighbours in this series are the parts of the solver, the time step and the
model. The total error is at most their sum; it is less if they cancel.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

from pydantic import ValidationError

from sandbox.engines.registry import ENGINES
from sandbox.jsonable import in_json
from sandbox.measure.metrics.trajectory_error import errors
from sandbox.measure.run.bounded_run import RunTimeoutError, bounded_run
from sandbox.measure.tradeoff.metrics import EvaluationContext
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Trajectory

ITERATION_FACTOR = 16
"""Factor of the iterations; the result approximates that of infinitely many."""
MAX_ITERATIONS = 10_000
"""Largest number of iterations that `[solver]` allows."""
MAX_SUBSTEP_FACTOR = 16
"""Factor of the substeps; the result approximates that of a step of 0. Smaller if the cost limit does not allow it."""
STILL_SHRINKING = 1.1
"""If halving the step lowers the error by more than this factor, the remaining error belongs to the time step."""


@dataclass(frozen=True)
class ErrorBudget:
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
    residual: float = field(metadata=in_json(key="left"))
    """error of the finest step: the part of the model and the rest of the part of the time step"""
    substep_factor: int = field(metadata=in_json(key="finest"))
    """substeps of the finest step in one substep of the setting"""


def error_budget(
    context: EvaluationContext, engine: str, settings: Settings, limit: float, deadline: float = math.inf
) -> ErrorBudget | None:
    """Split the position error of a setting into its parts; None without a truth or if no finer run is allowed.

    The part of the model is the error of the finest step, if the last halving of the step changed it by less than a
    tenth. An error that still shrinks belongs to the time step.

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
    residual = runs.distance(finest, truth)
    is_shrinking = runs.distance(before, truth) > STILL_SHRINKING * residual
    return ErrorBudget(
        engine=engine,
        settings=ENGINES[engine].resolve(context.scene, settings),
        total=runs.distance(coarse, truth),
        solver=runs.distance(coarse, converged),
        time_step=runs.distance(converged, finest),
        model=None if is_shrinking else residual,
        residual=residual,
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
            except ValidationError:
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
        found = errors(a, b, self.context.moving).until(self.context.until).max_position
        return 0.0 if found is None else found
