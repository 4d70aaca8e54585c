"""Search: which variants are worth a run. It refines near the front, and stops branches that are outdone.

From each engine's own settings on, the variants one choice away are tried: of those trials that nothing outdoes on
the same engine, the one that matters most for what is asked. At last the smallest number of substeps and of iterations
that still meets the tolerance is closed in on.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import cycle
from time import perf_counter

from sandbox.measure.tradeoff.front import outdone
from sandbox.measure.tradeoff.judge import Judge
from sandbox.measure.tradeoff.trial import Trial, tried
from sandbox.measure.tradeoff.variant import Space, Variant

MARGIN = 0.7
"""A trial is outdone by one that takes no more than this share of its time and is at least as right; times of a single
run say no more."""
ENOUGH = 1e-6
"""Errors below this share of the tolerance are as good as none."""
SLOW = 0.2
"""The share of the patience that a single run may take."""

Told = Callable[[str], None]


@dataclass
class Search:
    """Trials so far, and who comes next."""

    space: Space
    judges: Sequence[Judge]
    metric: str
    tolerance: float
    """in the unit of the metric: errors near it matter most"""
    budget: float | None
    """s for the whole run, where a cost is asked for"""
    patience: float
    """s that the search may take"""
    most: int
    """trials"""
    told: Told
    trials: dict[Variant, Trial] = field(default_factory=dict)
    untried: int = 0
    """variants that would have taken too long"""

    def run(self) -> list[Trial]:
        """Try variants until none is worth it, or the patience is at its end; return all trials in order."""
        self._began = perf_counter()
        expanded: set[Variant] = set()
        for variant in self.space.starts():
            self._try(variant)
        aims = (
            [self._near_tolerance, self._near_budget, self._cheap]
            if self.budget
            else [self._near_tolerance, self._cheap]
        )
        turns = cycle([(engine, aim) for aim in aims for engine in self.space.engines])
        while self._goes_on():
            open_trials = [t for v, t in self.trials.items() if v not in expanded and self._promising(t)]
            if not open_trials:
                break
            engine, aim = next(turns)  # every engine gets its turn: who asks for one wants its curve
            own = [t for t in open_trials if t.variant.engine == engine]
            if not own:
                continue
            best = min(own, key=aim)
            expanded.add(best.variant)
            for variant in self.space.near(best.variant):
                if self._goes_on():
                    self._try(variant, best)
        self._close_in()
        return list(self.trials.values())

    def _goes_on(self) -> bool:
        return len(self.trials) < self.most and perf_counter() - self._began < self.patience

    def _try(self, variant: Variant, parent: Trial | None = None) -> Trial | None:
        """Try a variant that was not tried, unless by its parent's time it would take too long."""
        if variant in self.trials:
            return self.trials[variant]
        left = self.patience - (perf_counter() - self._began)
        if parent is not None:
            expected = parent.seconds * variant.work / parent.variant.work * len(self.judges)
            if expected > max(left, 0.0):
                self.untried += 1
                return None
        self.told(f"{len(self.trials) + 1} tried: {_called(variant)}")
        found = tried(variant, self.space, self.judges, max(SLOW * self.patience, 1.0))
        self.trials[variant] = found
        return found

    def _error(self, trial: Trial) -> float:
        return max(trial.error(self.metric), ENOUGH * self.tolerance)

    def _promising(self, trial: Trial) -> bool:
        """Tell whether to look around a trial: nothing on its engine outdoes it, or it failed at the very start."""
        if trial.status in ("refused", "stopped"):
            return False
        if math.isinf(trial.error(self.metric)):  # it says nothing of its neighbours but that coarser ones fail too
            return trial.variant in self.space.starts()
        same = (t for t in self.trials.values() if t.status == "ok" and t.variant.engine == trial.variant.engine)
        others = [(t.seconds, self._error(t)) for t in same]
        return not outdone(trial.seconds, self._error(trial), others, MARGIN)

    def _near_tolerance(self, trial: Trial) -> float:
        error = self._error(trial)
        return abs(math.log(error / self.tolerance)) if math.isfinite(error) else math.inf

    def _near_budget(self, trial: Trial) -> float:
        assert self.budget is not None
        return abs(math.log(max(trial.seconds, 1e-9) / self.budget))

    def _cheap(self, trial: Trial) -> float:
        return trial.seconds if math.isfinite(trial.error(self.metric)) else math.inf

    def _close_in(self) -> None:
        """Between a variant that misses the tolerance and one that meets it, halve the gap until it is closed."""
        for knob in ("substeps", "iterations"):
            for meeting in [t for t in self.trials.values() if t.error(self.metric) <= self.tolerance]:
                high = meeting.variant
                low = _with(high, knob, getattr(high, knob) // 2)
                if low not in self.trials or self.trials[low].error(self.metric) <= self.tolerance:
                    continue
                if not self._promising(meeting):
                    continue
                self._halve(knob, getattr(low, knob), getattr(high, knob), meeting)

    def _halve(self, knob: str, low: int, high: int, meeting: Trial) -> None:
        while high - low > max(1, high // 8) and self._goes_on():
            middle = _with(meeting.variant, knob, (low + high) // 2)
            if not self.space.sound(middle):
                return
            found = self._try(middle, meeting)
            if found is None:
                return
            if found.error(self.metric) <= self.tolerance:
                high = getattr(middle, knob)
            else:
                low = getattr(middle, knob)


def _with(variant: Variant, knob: str, value: int) -> Variant:
    return replace(variant, substeps=value) if knob == "substeps" else replace(variant, iterations=value)


def _called(variant: Variant) -> str:
    words = ", ".join(f"{key} {value}" for key, value in variant.words)
    steps = f"dt / {variant.finer}" if variant.finer != 1 else "dt"
    return f"{variant.engine}, {steps}, {variant.substeps} × {variant.iterations}{', ' if words else ''}{words}"
