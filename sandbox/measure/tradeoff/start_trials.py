"""Trials of settings from perturbed starts: whether a setting holds, and how often.

The starts 1 to `count` decide on a setting, those up to 2·`count` confirm it, and are those of the errors of other
settings too. Each is judged against its own truth.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

from sandbox.engines.common.compile_clock import clock_without_compilation
from sandbox.measure.compare.end_statistics import MIN_END_STARTS, EndEnsemble, EndStatistics
from sandbox.measure.compare.ground_truth import Truth, find_truth, truth_cost
from sandbox.measure.compare.metrics import EvaluationContext, default_zoom
from sandbox.measure.fresh_starts import FreshStarts
from sandbox.measure.run.bounded_run import RunTimeoutError, bounded_run
from sandbox.measure.run.recorder import TooLargeError
from sandbox.measure.starts import Starts, allowed_failures
from sandbox.measure.tradeoff.configuration import Configuration, Evaluation, SearchSpace
from sandbox.measure.tradeoff.objective import AUDIT_METRICS, Objective
from sandbox.measure.tradeoff.search import RUN_FRACTION
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings

STARTS_FRACTION = 0.3
"""Fraction of the effort for the starts that decide on one setting, and for those that confirm it."""
FRONT_FRACTION = 0.5
"""Fraction of the effort for the starts from which the shown points of the fronts are run, all together."""
ENDS_FRACTION = 1.0
"""Fraction of the effort for the runs of the truth's method whose ends decide, and for those whose ends are shown"""
SETTINGS_ENDS_FRACTION = 0.5
"""Fraction of the effort for the runs of the settings that are compared with either"""
MIN_STARTS = 3
"""Fewer starts say too little: where the effort does not allow more, a setting is not tried from any other."""


def affordable_starts(count: int, effort: float, cost: float) -> int:
    """Return how many of some starts `STARTS_FRACTION` of an effort allows; 0 if it allows fewer than `MIN_STARTS`.

    Args:
        count: number of starts asked for.
        effort: counted work, s.
        cost: counted work of one start, s.
    """
    affordable = math.floor(STARTS_FRACTION * effort / cost) if cost > 0.0 else count
    return min(count, affordable) if affordable >= min(MIN_STARTS, count) else 0


def context_of(
    scene: Scene, base: Settings, truth_tolerance: float, zoom: float | None, known: Truth | str | None = None
) -> EvaluationContext:
    """Return the context of a start of a scene.

    Args:
        scene: scene with the start.
        base: settings of the study.
        truth_tolerance: m, error that the truth may have.
        zoom: px/m; None: the motion fills a window.
        known: its truth, or the reason why there is none, if known.
    """
    result = find_truth(scene, base, truth_tolerance) if known is None else known
    truth, doubt = (result, None) if isinstance(result, Truth) else (None, result)
    return EvaluationContext(scene, truth, default_zoom(scene, truth) if zoom is None else zoom, doubt)


@dataclass
class StartTrials:
    """Errors of settings from other starts than that of the scene, computed when needed."""

    space: SearchSpace
    context: EvaluationContext
    """of the start in the scene"""
    objective: Objective
    starts: Starts
    count: int
    """number of starts that decide on a setting, and of those that confirm it; 1: none"""
    truth_tolerance: float
    """m, error that a truth may have"""
    effort: float
    deadline: float
    """time of `clock_without_compilation` after which no setting is tried, s"""
    ends: EndEnsemble | None = None
    """ends of a scene whose truth is not trusted to its end; None if they are not compared"""
    _ends: dict[tuple[Configuration, bool], EndStatistics | None] = field(default_factory=dict)
    """statistics of the ends of configurations, over the starts that decide or over fresh ones"""
    _ends_spent: dict[bool, float] = field(default_factory=lambda: {False: 0.0, True: 0.0})
    """s, counted work of the runs of these configurations, over the starts that decide and over fresh ones"""
    _contexts: dict[int, EvaluationContext] = field(default_factory=dict)
    """by the numbers of the starts"""
    _errors: dict[tuple[Configuration, int], float] = field(default_factory=dict)
    """errors of configurations, by the numbers of the starts"""

    def holds(self, point: Evaluation) -> bool:
        """Return whether a configuration is within the tolerance in 95 % of the starts that decide, and ends alike.

        Its ends do not differ from the truth's, if they are compared and the effort allows it.
        """
        return self._is_within_tolerance(point) and self.ends_like_the_truth(point)

    def ends_like_the_truth(self, point: Evaluation) -> bool:
        """Return whether no difference of the ends is known, over the starts that decide."""
        ends = self.end_statistics(point, fresh=False)
        return ends is None or ends.is_alike

    @property
    def differing_ends(self) -> int:
        """Number of configurations whose ends differ over the starts that decide."""
        return sum(found is not None and not found.is_alike for (_, fresh), found in self._ends.items() if not fresh)

    def end_statistics(self, point: Evaluation, fresh: bool) -> EndStatistics | None:
        """Return the statistics of the ends of a configuration; None if they are not compared, or take too much effort.

        Args:
            point: the configuration.
            fresh: from starts that do not decide.
        """
        key = point.configuration, fresh
        if self.ends is not None and key not in self._ends:
            first, cost = self.count if fresh else 0, point.counted_seconds
            left = SETTINGS_ENDS_FRACTION * self.effort - self._ends_spent[fresh]
            count = min(self.ends.count, math.floor(left / cost)) if cost > 0.0 else self.ends.count
            if count < MIN_END_STARTS or clock_without_compilation() >= self.deadline:
                return None
            numbers = range(first + 1, first + 1 + count)
            found = self.ends.compare(point.engine, point.asked, numbers, cost, stops_early=not fresh)
            self._ends_spent[fresh] += 0.0 if found is None else found.starts * cost
            self._ends[key] = found
        return self._ends.get(key)

    def _is_within_tolerance(self, point: Evaluation) -> bool:
        """Return whether a configuration is within the tolerance in 95 % of the starts that decide.

        It stops at the first start that makes that impossible.
        """
        count = self._affordable(point)
        failures = allowed_failures(count)
        for number in range(1, count + 1):
            failures -= self._error(point, number) > self.objective.max_error
            if failures < 0:
                return False
        return True

    def confirmation(self, point: Evaluation) -> FreshStarts | None:
        """Return the errors of a configuration from starts that do not decide; None without other starts."""
        if self.count < 2:
            return None
        numbers = range(self.count + 1, self.count + 1 + self._affordable(point))
        return FreshStarts.of([self._error(point, number) for number in numbers], self.objective.max_error)

    def errors_of_front(self, points: Sequence[Evaluation]) -> dict[Configuration, FreshStarts]:
        """Return the errors of points over starts that do not decide; without those that the effort does not allow.

        Each point gets an equal part of the effort that is left, the cheapest first, so that the dearest get what the
        others do not need. The truth of a start counts for all of them.
        """
        found: dict[Configuration, FreshStarts] = {}
        remaining = FRONT_FRACTION * self.effort
        by_cost = sorted(points, key=lambda each: each.counted_seconds) if self.count > 1 else []
        for others, point in zip(reversed(range(len(by_cost))), by_cost, strict=True):
            allowed, numbers = remaining / (others + 1), list[int]()
            for number in range(self.count + 1, 2 * self.count + 1):
                run = 0.0 if (point.configuration, number) in self._errors else point.counted_seconds
                truth = 0.0 if number in self._contexts else self._truth_cost
                allowed -= run + truth / (others + 1)
                if allowed < 0.0:
                    break
                numbers.append(number)
                remaining -= run + truth
            if len(numbers) >= min(MIN_STARTS, self.count) and clock_without_compilation() < self.deadline:
                errors = [self._error(point, number) for number in numbers]
                found[point.configuration] = FreshStarts.of(errors, self.objective.max_error)
        return found

    def counterexample(self, evaluations: Sequence[Evaluation]) -> int | None:
        """Return a start from which a setting fails, if an engine has settings within the tolerance but none holds."""
        for engine in self.space.engines:
            own = [each for each in evaluations if each.engine == engine and each.meets(self.objective.max_error)]
            own.sort(key=lambda each: each.counted_seconds)
            if own and not any(map(self._is_within_tolerance, own)):
                tried = {n: error for (setting, n), error in self._errors.items() if setting == own[0].configuration}
                return next(n for n, error in tried.items() if error > self.objective.max_error)
        return None

    def context_at(self, number: int) -> EvaluationContext:
        """Return the context of a start, by its number."""
        if number not in self._contexts:
            zoom, no_truth = self.context.zoom, self.context.truth is None
            doubt = (self.context.doubt or "no truth is known") if no_truth else None
            start = self.starts.start(number)
            self._contexts[number] = context_of(start, self.space.base, self.truth_tolerance, zoom, doubt)
        return self._contexts[number]

    def _affordable(self, point: Evaluation) -> int:
        """Return the number of starts from which a configuration is run, or 0: counted work decides, not the clock."""
        if self.count < 2 or clock_without_compilation() >= self.deadline:
            return 0
        return affordable_starts(self.count, self.effort, point.counted_seconds + self._truth_cost)

    @cached_property
    def _truth_cost(self) -> float:
        """Counted cost of the truth of a start, s, from that of the scene."""
        return 0.0 if self.context.truth is None else truth_cost(self.space.scene, self.context.truth)

    def _error(self, point: Evaluation, number: int) -> float:
        """Return the error of a configuration from another start; infinite if its run fails."""
        key = point.configuration, number
        if key not in self._errors:
            self._errors[key] = self._measured_error(point, self.context_at(number))
        return self._errors[key]

    def _measured_error(self, point: Evaluation, context: EvaluationContext) -> float:
        """Run a configuration and return its error. Other metrics are not measured, which takes longer than the run."""
        metric, limit = self.objective.metric, max(RUN_FRACTION * self.effort, 2.0 * point.counted_seconds)
        try:
            run, _ = bounded_run(context.scene, point.engine, point.asked, limit, audit=metric.name in AUDIT_METRICS)
        except (RunTimeoutError, TooLargeError):
            return math.inf
        error = metric.measure(run, context) if run.status == "ok" else None
        return math.inf if error is None or math.isnan(error) else error
