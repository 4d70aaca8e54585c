"""Search for configurations on the Pareto front: which ones are worth a run, and in which order.

The search is bounded and steered by counted cost (`run.bounded_run`), so that the same configurations are evaluated in
the same order on every machine, unless a time limit ends it. Its phases are:

1. the scene's own settings of each engine, with the substeps doubled until the tolerance is met, so that there is an
   answer;
2. combinations of options that suit the scene (`SearchSpace.presets`); of an engine without an answer, all methods
   tried so far with ever more substeps;
3. neighbours of evaluations that no other evaluation of the same engine dominates, in the order of their importance
   for tolerance and budget;
4. of the cheapest evaluation of each engine that meets the tolerance, fewer iterations for more substeps;
5. bisection for the smallest number of substeps and of iterations that meets it.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import cycle
from typing import Literal

from sandbox.engines.common.compile_clock import clock_without_compilation
from sandbox.measure.compare.metrics import EvaluationContext
from sandbox.measure.tradeoff.configuration import Configuration, Evaluation, SearchSpace, evaluate
from sandbox.measure.tradeoff.objective import is_dominated
from sandbox.progress import Progress, ProgressCallback
from sandbox.trajectory import Trajectory

Limit = Literal["points", "effort", "time"]
"""Limit that can end a search: the number of settings, the counted cost, or the time."""

DOMINANCE_MARGIN = 0.7
"""An evaluation is dominated by one that has less than this fraction of its counted cost and is at least as accurate:
counted costs are no more accurate than that."""
NEGLIGIBLE = 1e-6
"""Errors below this fraction of the tolerance count as equal; if the tolerance is 0, below this error."""
RUN_FRACTION = 0.2
"""Fraction of the effort that the run of one configuration may take, for each seed."""
MAX_USEFUL_RATIO = 0.8
"""Halving the substep is useless if more than this fraction of the error remains."""
MAX_USELESS = 2
"""Useless halvings after which the doubling of substeps ends."""
MAX_FIRST_FACTOR = 16
"""Largest factor of the substeps in the first phase: beyond it, another option may be cheaper."""
EXPLORE_FRACTION = 0.8
"""Fraction of evaluations and effort for the first three phases; the rest is for the bisection."""
REFINE_FRACTION = 0.5
"""Fraction of evaluations and effort up to which the methods of an engine without an answer are refined."""
MIN_IMPROVEMENT = 0.95
"""An evaluation with more than this fraction of the error of a cheaper one is not explored further."""

MIN_RUN_COST = 30.0
"""Counted cost, s, that a run with an engine's own settings may always have, however small the effort."""


@dataclass
class SettingsSearch:
    """Evaluations so far, and the choice of the next one."""

    space: SearchSpace
    contexts: Sequence[EvaluationContext]
    metric: str
    """name of the metric of the error"""
    tolerance: float
    """in the unit of the metric"""
    budget: float | None
    """s for the whole run; None if there is no budget"""
    effort: float
    """counted cost of all evaluations together, s; the own settings of every engine are evaluated in any case"""
    max_evaluations: int
    on_progress: ProgressCallback
    deadline: float = math.inf
    """time of `clock_without_compilation`, s"""
    known: Mapping[str, Trajectory] = field(default_factory=dict)
    """runs with an engine's own settings that exist already, by engine"""
    evaluations: dict[Configuration, Evaluation] = field(default_factory=dict)
    skipped: set[Configuration] = field(default_factory=set)
    """configurations left out because of their cost"""
    interrupted: bool = False
    """whether Ctrl-C ended the search"""
    spent: float = 0.0
    """counted cost of all evaluations, s"""
    limit: Limit | None = None
    """limit that ended the search; None if no further configuration was worth a run"""

    def run(self) -> list[Evaluation]:
        """Search until no configuration is worth a run or the effort is spent; return all evaluations in order."""
        try:
            self._search()
        except KeyboardInterrupt:
            self.interrupted = True
        return list(self.evaluations.values())

    def _search(self) -> None:
        configurations = self.space.starts()[: self.max_evaluations]
        starts = [self._evaluate(each) for each in configurations if clock_without_compilation() < self.deadline]
        for start in starts:
            self._refine_to_tolerance(start)
        by_engine = {start.engine: start for start in starts if start is not None and start.status != "stopped"}
        for configuration in self.space.presets():
            if configuration.engine in by_engine and self._may_continue(EXPLORE_FRACTION):
                self._evaluate(configuration, by_engine[configuration.engine])
        if self.tolerance > 0.0:
            self._refine_unanswered()
        self._explore()
        self._trade_iterations()
        self._bisect_all()

    def _refine_to_tolerance(self, evaluation: Evaluation | None) -> None:
        """Double the substeps until the tolerance is met, or until doubling is useless several times.

        The first useless doublings do not end it: a contact missed with 2 and with 4 substeps can be found with 8. If
        the tolerance is 0, only the effort ends it.
        """
        useless = 0
        while evaluation is not None and not evaluation.meets(self.tolerance) and evaluation.engine != "exact":
            configuration = evaluation.configuration
            finer = replace(configuration, substeps=2 * configuration.substeps)
            if evaluation.status in ("refused", "stopped") or not self.space.is_valid(finer):
                return
            if not self._may_continue():
                return
            if (
                self.tolerance > 0.0
                and finer.substeps > MAX_FIRST_FACTOR * self.space.own_settings(finer.engine).substeps
            ):
                return
            found = self._evaluate(finer, evaluation)
            before = evaluation.ranking_error
            if found is not None and math.isfinite(before) and found.ranking_error > MAX_USEFUL_RATIO * before:
                useless += 1
                if useless > MAX_USELESS and self.tolerance > 0.0:
                    return
            evaluation = found

    def _refine_unanswered(self) -> None:
        """Double the substeps of all methods tried, the cheapest first, of engines that do not meet the tolerance yet.

        It does not end if errors grow: where bodies collide, they do not fall steadily with the step.
        """
        while self._may_continue(REFINE_FRACTION):
            answered = {each.engine for each in self.evaluations.values() if each.meets(self.tolerance)} | {"exact"}
            finer = {
                replace(each.configuration, substeps=2 * each.configuration.substeps): each
                for each in self.evaluations.values()
                if each.engine not in answered and each.status == "ok" and math.isfinite(each.ranking_error)
            }
            untried = [each for each in finer if each not in self.evaluations and each not in self.skipped]
            untried = [each for each in untried if self.space.is_valid(each)]
            if not untried:
                return
            cheapest = min(untried, key=lambda each: finer[each].counted_seconds)
            self._evaluate(cheapest, finer[cheapest])

    def _explore(self) -> None:
        """Evaluate the neighbours of promising evaluations, the engine with the least cost so far first."""
        expanded: set[Configuration] = set()
        goals = (
            [self._tolerance_distance, self._budget_distance, self._usable_cost]
            if self.budget
            else [self._tolerance_distance, self._usable_cost]
        )
        turns: Mapping[str, cycle[Callable[[Evaluation], float]]]
        turns = {engine: cycle(goals) for engine in self.space.engines}
        while self.limit is None:
            promising = [e for c, e in self.evaluations.items() if c not in expanded and self._is_promising(e)]
            if not promising:
                break
            # A slow engine does not use up the effort of the others.
            engine = min({each.engine for each in promising}, key=self._spent_on)
            best = min((each for each in promising if each.engine == engine), key=next(turns[engine]))
            expanded.add(best.configuration)
            for neighbour in self.space.neighbours(best.configuration):
                is_faster = neighbour.work < best.configuration.work
                self.limit = self._exceeded(EXPLORE_FRACTION)
                if self.limit is None and (best.status != "stopped" or is_faster):
                    self._evaluate(neighbour, best)

    def _may_continue(self, fraction: float = 1.0) -> bool:
        """Return whether a fraction of the evaluations and of the effort is not used up."""
        return self._exceeded(fraction) is None

    def _exceeded(self, fraction: float) -> Limit | None:
        """Return the limit of which a fraction is used up, or the limit of time; None if there is none."""
        if len(self.evaluations) >= fraction * self.max_evaluations:
            return "points"
        if self._remaining <= (1.0 - fraction) * self.effort:
            return "effort"
        return "time" if clock_without_compilation() >= self.deadline else None

    def _spent_on(self, engine: str) -> tuple[float, int]:
        """Return the cost of an engine's evaluations so far, and its index, which decides between equals."""
        spent = sum(each.spent_seconds for each in self.evaluations.values() if each.engine == engine)
        return spent, self.space.engines.index(engine)

    @property
    def _remaining(self) -> float:
        return self.effort - self.spent

    def _evaluate(self, configuration: Configuration, parent: Evaluation | None = None) -> Evaluation | None:
        """Evaluate a configuration, unless the counted cost of its parent predicts that it would cost too much."""
        if configuration in self.evaluations:
            return self.evaluations[configuration]
        limit, known = max(self.effort, MIN_RUN_COST), self.known.get(configuration.engine)
        if parent is not None:
            limit, known = min(RUN_FRACTION * self.effort, max(self._remaining, 0.0) / len(self.contexts)), None
            if parent.counted_seconds * configuration.work / parent.configuration.work > limit:
                self.skipped.add(configuration)
                return None
        self.on_progress(Progress(f"{len(self.evaluations) + 1} tried: {_describe(configuration)}"))
        found = evaluate(
            configuration, self.space, self.contexts, self.metric, self.tolerance, limit, self.deadline, known
        )
        if found.status == "stopped" and clock_without_compilation() >= self.deadline:
            self.skipped.add(configuration)
            return None
        self.evaluations[configuration] = found
        self.spent += found.spent_seconds
        return found

    def _positive_error(self, evaluation: Evaluation) -> float:
        """Return an error that is never 0, for logarithms."""
        return max(evaluation.ranking_error, NEGLIGIBLE * (self.tolerance or 1.0))

    def _is_promising(self, evaluation: Evaluation) -> bool:
        """Return whether to explore the neighbours: no evaluation of the engine dominates it, or all have failed."""
        if evaluation.status == "refused":
            return False
        same_engine = [each for each in self.evaluations.values() if each.engine == evaluation.engine]
        successful = [each for each in same_engine if math.isfinite(each.ranking_error)]
        work = evaluation.configuration.work
        if evaluation.status == "stopped":  # less work may reach the end
            return not successful and work <= min(each.configuration.work for each in same_engine)
        if math.isinf(evaluation.ranking_error):  # a finer step may succeed
            if evaluation.status == "ok" and evaluation.metrics.get(self.metric) is None:
                return not successful and evaluation is same_engine[0]
            return not successful and work >= max(each.configuration.work for each in same_engine)
        others = [
            (each.counted_seconds, MIN_IMPROVEMENT * self._positive_error(each))
            for each in successful
            if evaluation.objections or not each.objections
        ]
        return not is_dominated(evaluation.counted_seconds, self._positive_error(evaluation), others, DOMINANCE_MARGIN)

    def _tolerance_distance(self, evaluation: Evaluation) -> float:
        error, wanted = self._positive_error(evaluation), self.tolerance or NEGLIGIBLE
        return abs(math.log(error / wanted)) if math.isfinite(error) else math.inf

    def _budget_distance(self, evaluation: Evaluation) -> float:
        assert self.budget is not None
        return abs(math.log(max(evaluation.counted_seconds, 1e-9) / self.budget))  # 1 ns: a cost of 0 has no logarithm

    def _usable_cost(self, evaluation: Evaluation) -> float:
        return evaluation.counted_seconds if math.isfinite(evaluation.ranking_error) else math.inf

    def _bisect_all(self) -> None:
        """Find the fewest substeps and iterations of each evaluation that meets the tolerance and is not dominated."""
        for setting in ("substeps", "iterations"):
            stepped = [each for each in self.evaluations.values() if each.engine != "exact"]
            accepted = [each for each in stepped if each.meets(self.tolerance)]
            for each in accepted:
                is_used = setting == "substeps" or self.space.uses_iterations(each.engine)
                if is_used and self._is_promising(each):
                    self._halve(setting, each)

    def _trade_iterations(self) -> None:
        """Halve the iterations of the cheapest evaluation of each engine, and find the substeps that this needs.

        Bisection of one number after the other ends at the first corner: 5 substeps of 20 iterations, where 8 of 5
        would do.
        """
        for engine in self.space.engines:
            if engine == "exact" or not self.space.uses_iterations(engine):
                continue
            traded: set[Configuration] = set()
            while self._may_continue():
                met = [e for e in self.evaluations.values() if e.engine == engine and e.meets(self.tolerance)]
                best = min(met, key=lambda each: each.counted_seconds, default=None)
                if best is None or best.configuration in traded or best.configuration.iterations < 2:
                    break
                traded.add(best.configuration)
                fewer = _with(best.configuration, "iterations", best.configuration.iterations // 2)
                finer = _with(fewer, "substeps", 2 * fewer.substeps)
                if not self.space.is_valid(finer):
                    break
                found = self._evaluate(fewer, best)
                if found is not None and not found.meets(self.tolerance):
                    found = self._evaluate(finer, best)
                    if found is not None and found.meets(self.tolerance):
                        self._bisect("substeps", fewer.substeps, finer.substeps, found)

    def _halve(self, setting: str, accepted: Evaluation) -> None:
        """Halve a setting as long as the tolerance is met, then bisect between the last two values."""
        while self._may_continue():
            value = getattr(accepted.configuration, setting)
            halved = _with(accepted.configuration, setting, value // 2)
            found = self._evaluate(halved, accepted) if self.space.is_valid(halved) else None
            if found is None:
                return
            if not found.meets(self.tolerance):
                self._bisect(setting, value // 2, value, accepted)
                return
            accepted = found

    def _bisect(self, setting: str, low: int, high: int, accepted: Evaluation) -> None:
        """Bisect between a value that misses the tolerance and one that meets it, to 1/8 of the latter."""
        while high - low > max(1, high // 8) and self._may_continue():
            middle = _with(accepted.configuration, setting, (low + high) // 2)
            if not self.space.is_valid(middle):
                return
            found = self._evaluate(middle, accepted)
            if found is None:
                return
            if found.meets(self.tolerance):
                high = getattr(middle, setting)
            else:
                low = getattr(middle, setting)


def _with(configuration: Configuration, setting: str, value: int) -> Configuration:
    if setting == "substeps":
        return replace(configuration, substeps=value)
    return replace(configuration, iterations=value)


def _describe(configuration: Configuration) -> str:
    options = "".join(f", {key} {value}" for key, value in configuration.options)
    steps = f"dt / {configuration.refinement}" if configuration.refinement != 1 else "dt"
    return f"{configuration.engine}, {steps}, {configuration.substeps} × {configuration.iterations}{options}"
