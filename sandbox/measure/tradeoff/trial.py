"""Trial: one variant, run for its error and its counted cost. Its time here is measured apart (`cost.py`)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sandbox.engines.registry import ENGINES
from sandbox.measure.bounded_run import TookTooLongError, bounded_run, counted_cost
from sandbox.measure.recorder import TooLargeError
from sandbox.measure.tradeoff.judge import Judge
from sandbox.measure.tradeoff.metrics import METRICS, measured
from sandbox.measure.tradeoff.variant import Space, Variant
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Trial:
    """What came of a variant."""

    variant: Variant
    settings: Settings
    """as the engine filled them in"""
    status: str
    reason: str | None
    metrics: Mapping[str, float | None]
    cost: float
    """counted, s; over several seeds the largest. Of a run that was given up, what it was allowed"""
    spent: float
    """counted, s, over all seeds, without a run that was made already"""
    seconds: float
    """of the run that was recorded, on this machine"""
    work: Mapping[str, int]

    def error(self, metric: str) -> float:
        """Return its error, infinite where it has none."""
        found = self.metrics.get(metric)
        return math.inf if self.status != "ok" or found is None or math.isnan(found) else found


def tried(
    variant: Variant,
    space: Space,
    judges: Sequence[Judge],
    limit: float,
    deadline: float = math.inf,
    known: Trajectory | None = None,
) -> Trial:
    """Run a variant once for every judge, each of another seed, and keep the worst of every metric.

    Args:
        variant: what to run.
        space: it is of this.
        judges: of the same scene with other seeds.
        limit: counted cost that one run may have, s.
        deadline: by the clock of `working`, s.
        known: this very run of the first judge's scene, where it was made already.
    """
    asked = space.settings(variant)
    filled = ENGINES[variant.engine].resolve(space.scene, asked)
    nothing: dict[str, float | None] = dict.fromkeys(METRICS)
    worst, cost, spent, seconds, work = nothing, 0.0, 0.0, 0.0, {}
    for k, judge in enumerate(judges):
        try:
            if k == 0 and known is not None:
                run = known
                counted = counted_cost(judge.scene, variant.engine, filled, run.info["steps"], run.info["work"])
            else:
                run, counted = bounded_run(judge.scene, variant.engine, asked, limit, deadline)
        except TookTooLongError as error:
            return Trial(variant, filled, "stopped", str(error), nothing, limit, spent + limit, seconds, {})
        except TooLargeError as error:
            return Trial(variant, filled, "failed", str(error), nothing, 0.0, spent, seconds, {})
        seconds, cost = max(seconds, float(run.info["seconds"])), max(cost, counted)
        spent += 0.0 if run is known else counted
        work = dict(run.info["work"])
        if run.status != "ok":
            return Trial(variant, filled, run.status, run.reason, nothing, cost, spent, seconds, work)
        worst = {name: _worse(worst[name], found) for name, found in measured(run, judge).items()}
    return Trial(variant, filled, "ok", None, worst, cost, spent, seconds, work)


def _worse(a: float | None, b: float | None) -> float | None:
    if a is None or b is None:
        return a if b is None else b
    return math.nan if math.isnan(a) or math.isnan(b) else max(a, b)
