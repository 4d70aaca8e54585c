"""Trial: one variant, run for its error. What it costs is measured apart (`cost.py`)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sandbox.engines.registry import ENGINES
from sandbox.measure.compare.patience import TookTooLongError, patient_run
from sandbox.measure.recorder import TooLargeError
from sandbox.measure.tradeoff.judge import Judge
from sandbox.measure.tradeoff.metrics import METRICS, measured
from sandbox.measure.tradeoff.variant import Space, Variant
from sandbox.scene.settings import Settings


@dataclass(frozen=True, eq=False)
class Trial:
    """What came of a variant."""

    variant: Variant
    settings: Settings
    """as the engine filled them in"""
    status: str
    reason: str | None
    metrics: Mapping[str, float | None]
    seconds: float
    """of the run that was recorded: good enough to steer by"""
    work: Mapping[str, int]

    def error(self, metric: str) -> float:
        """Return its error, infinite where it has none."""
        found = self.metrics.get(metric)
        return math.inf if self.status != "ok" or found is None or math.isnan(found) else found


def tried(variant: Variant, space: Space, judges: Sequence[Judge], patience: float) -> Trial:
    """Run a variant once for every judge, each of another seed, and keep the worst of every metric.

    Args:
        variant: what to run.
        space: it is of this.
        judges: of the same scene with other seeds.
        patience: s that one run may take.
    """
    asked = space.settings(variant)
    filled = ENGINES[variant.engine].resolve(space.scene, asked)
    worst: dict[str, float | None] = dict.fromkeys(METRICS)
    seconds, work = 0.0, {}
    for judge in judges:
        try:
            run = patient_run(judge.scene, variant.engine, asked, patience, audit=True)
        except TookTooLongError as error:
            return Trial(variant, filled, "stopped", str(error), worst, patience, {})
        except TooLargeError as error:
            return Trial(variant, filled, "failed", str(error), worst, 0.0, {})
        seconds = max(seconds, float(run.info["seconds"]))
        work = dict(run.info["work"])
        if run.status != "ok":
            return Trial(variant, filled, run.status, run.reason, worst, seconds, work)
        worst = {name: _worse(worst[name], found) for name, found in measured(run, judge).items()}
    return Trial(variant, filled, "ok", None, worst, seconds, work)


def _worse(a: float | None, b: float | None) -> float | None:
    if a is None or b is None:
        return a if b is None else b
    return max(a, b)
