"""Study of the trade-off of a scene: engines and settings are tried, timed and scored against the best known truth.

Which settings are tried, in which order, and their errors depend on the scene and on the counted work that is allowed,
never on the clock, unless there is a time limit. Times are of this machine; if two are within the noise, counted
work decides which is cheaper.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Unpack

from sandbox.engines.common.compile_clock import clock_without_compilation
from sandbox.engines.registry import ENGINES, engine_named
from sandbox.measure.compare.end_statistics import end_ensemble
from sandbox.measure.compare.ground_truth import Truth
from sandbox.measure.compare.metrics import EvaluationContext
from sandbox.measure.metrics.trajectory_error import default_tolerance
from sandbox.measure.preflight.checks import warnings
from sandbox.measure.preflight.diagnostic import ROUNDING, Diagnostic
from sandbox.measure.preflight.tunnelling import largest_safe_dt
from sandbox.measure.run.recorder import require_memory
from sandbox.measure.starts import DEFAULT_SPREAD, DEFAULT_STARTS, Starts
from sandbox.measure.tradeoff.configuration import (
    Evaluation,
    SearchSpace,
    refused_evaluation,
    with_estimated_costs,
)
from sandbox.measure.tradeoff.error_budget import ErrorBudget, error_budget
from sandbox.measure.tradeoff.objective import (
    AUDIT_METRICS,
    Objective,
    check_objective,
    complete_objective,
    is_dominated,
    less_margin,
    metric_named,
)
from sandbox.measure.tradeoff.recommendation import (
    FRAME_TOLERANCE,
    cheapest_rejected,
    label,
    nearest_to_budget,
    nearest_to_tolerance,
    recommend_cheapest,
    recommend_most_accurate,
)
from sandbox.measure.tradeoff.result import Recommendation, Tradeoff, front_of, shown_of
from sandbox.measure.tradeoff.search import RUN_FRACTION, SettingsSearch
from sandbox.measure.tradeoff.simplify import ReplacedSetting, Simplification, model_simplifications
from sandbox.measure.tradeoff.start_trials import ENDS_FRACTION, StartTrials, context_of
from sandbox.measure.tradeoff.timing import CostRatio, TimedRun, Timing, time_in_turns
from sandbox.progress import Progress, ProgressCallback, ignore_progress
from sandbox.provenance import machine, versions
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings, SettingsChanges
from sandbox.scene.errors import SettingsError
from sandbox.scene.files.load import as_scene
from sandbox.schedule import with_whole_steps
from sandbox.trajectory import Trajectory

DEFAULT_EFFORT = 10.0
"""Default counted work of the search, about seconds; truth and timing are additional."""
DEFAULT_REPEATS = 5
MAX_POINTS = 120
TIMED_MARGIN = 0.5
"""A setting is not timed separately if another one of its engine is as accurate at less than this fraction of its
counted cost."""
TIMING_FRACTION = 0.5
"""Fraction of the effort for separate timings."""
MIN_REPEATS = 2
"""Repeats that are made even if the timing exceeds its part of the effort, unless fewer were asked for."""
MAX_COUNTEREXAMPLES = 2
"""Times that the search is repeated with another start from which the settings found so far fail."""


def tradeoff(
    scene: Scene | str | Path,
    engines: Sequence[str] | None = None,
    *,
    metric: str | None = None,
    tolerance: float | None = None,
    margin: float = 0.0,
    budget: float | None = None,
    fps: float = 60.0,
    starts: int = DEFAULT_STARTS,
    spread: float = DEFAULT_SPREAD,
    zoom: float | None = None,
    effort: float = DEFAULT_EFFORT,
    time_limit: float | None = None,
    repeats: int = DEFAULT_REPEATS,
    most: int = MAX_POINTS,
    truth: Truth | str | None = None,
    runs: Mapping[str, Trajectory] = MappingProxyType({}),
    has_fixed_dt: bool = False,
    is_explained: bool = True,
    on_progress: ProgressCallback | None = None,
    **settings: Unpack[SettingsChanges],
) -> Tradeoff:
    """Measure the error and the cost of engines and settings for a scene, and find the Pareto front.

    The error is measured against the best known truth, the cost in computing time per simulated second. The settings
    that are tried depend on the scene and on `effort`, not on the speed of the machine, unless `time_limit` is given.

    Args:
        scene: the scene, or its name or path, as `load` takes it.
        engines: names of the engines, or one name; default: all. An engine that cannot run the scene gets a
            point with the reason.
        metric: metric of the error (`metrics.METRICS`); default: the largest distance from the truth if the truth is
            trusted to the end, otherwise an invariant of the scene. If the truth is not trusted to the end, a
            recommended setting also has ends that do not differ from those of the truth's method over the starts
            (`EndStatistics`), as far as `effort` allows, unless an invariant was requested.
        tolerance: largest accepted error, in the unit of the metric; default: 1 % of the smallest radius, 1 px, 1 %, or
            no missed contact.
        margin: fraction of the tolerance that a recommended setting has to leave unused: with 0.2 its error is at most
            0.8 times the tolerance.
        budget: computing time per frame, ms, for which the most accurate setting is sought.
        fps: frames per second of the budget. A recommended setting has at least this step rate, or the step rate of the
            scene if that is lower.
        starts: number of perturbed starts (`Starts`) from which a setting has to be within the tolerance in 95 % of the
            cases to be recommended; as many others then confirm it. There are fewer if their runs would take too large
            a part of `effort`. 1: only the start in the scene counts.
        spread: largest change of a start, as a fraction: 0.01 moves bodies by up to 1 % of the smallest half width.
        zoom: px/m, for errors in pixels; default: the motion fills a window of 1280 × 720.
        effort: counted work of the search, about seconds of computing. The same settings are tried on every machine.
            The default settings of each engine are tried even with a small effort.
        time_limit: time after which no more settings are tried, s; the tried settings then depend on the machine.
        repeats: number of timings of settings near the front.
        most: largest number of settings that are tried.
        truth: truth of this scene and its frames, as accurate as the tolerance requires, or the reason why there is
            none, if already known.
        runs: runs of this scene with its own settings by engine, if already made.
        has_fixed_dt: try no other dt than that of the scene, or of `settings`; substeps divide it.
        is_explained: split the errors into their sources and try simpler models too.
        on_progress: progress callback; its message describes each stage.
        settings: changes to the scene's `[solver]`, such as `dt=0.001`.

    Raises:
        UnknownEngineError: no engine has one of the names.
        UnknownMetricError: no metric has that name.
        TooLargeError: the frames would not fit into memory.
        ValueError: an argument is out of range.
        SettingsError: a setting is invalid.

    Example:
        >>> found = sandbox.tradeoff("ball", ("pymunk",), tolerance=0.01, effort=0.3, repeats=1)
        >>> best = found.within_tolerance
        >>> best.point.error <= 0.01
        True
    """
    scene, on_progress = as_scene(scene), on_progress or ignore_progress
    engines = [engines] if isinstance(engines, str) else engines
    names = tuple(dict.fromkeys(ENGINES if engines is None else engines))
    for name in names:
        engine_named(name)
    _check_arguments(starts, zoom, effort, time_limit, repeats, most)
    check_objective(metric, tolerance, budget, fps, margin)
    base = scene.solver.replace(**settings) if settings else scene.solver
    scene = with_whole_steps(scene, base.dt)
    require_memory(scene, base, 4 * len(scene.bodies))
    deadline = math.inf if time_limit is None else clock_without_compilation() + time_limit

    on_progress(Progress("the truth"))
    drawn = Starts(scene, spread, max(base.dt, 1.0 / fps))
    max_error = None if tolerance is None else less_margin(tolerance, margin)
    truth_tolerance = _truth_tolerance(scene, metric, max_error, zoom)
    context = context_of(scene, base, truth_tolerance, zoom, truth)
    zoom = context.zoom  # without a given one, that of the motion, for which a truth is needed
    finer = _truth_tolerance(scene, metric, max_error, zoom)
    if finer < truth_tolerance:
        truth_tolerance = finer
        context = context_of(scene, base, finer, zoom)
    objective = complete_objective(context, metric, tolerance, budget, fps, margin)
    objective = objective._replace(max_dt=max(base.dt, FRAME_TOLERANCE / fps))
    able = tuple(name for name in names if not _refusal(scene, name, base))
    space = SearchSpace(scene, base, able, 1.0 / fps, has_fixed_dt)
    count = starts if drawn.can_vary else 1
    ends = None
    if metric is None or metric_named(metric).is_difference:  # these say nothing of the time after the horizon
        # In pixels or metres, the tolerance of the errors is that of the ends too.
        scale = {"m": 1.0, "px": context.zoom}.get(objective.metric.unit)
        length = default_tolerance(scene) if scale is None else objective.tolerance / scale
        ends = end_ensemble(context, drawn, base, count, ENDS_FRACTION * effort, length)
    study = _Study(
        space=space,
        context=context,
        objective=objective,
        trials=StartTrials(space, context, objective, drawn, count, truth_tolerance, effort, deadline, ends),
        effort=effort,
        deadline=deadline,
        on_progress=on_progress,
        refused=tuple(_refused(scene, names, base)),
        is_explained=is_explained,
    )
    return study.run(runs, repeats, most)


def _check_arguments(
    starts: int, zoom: float | None, effort: float, time_limit: float | None, repeats: int, most: int
) -> None:
    for name, count in (("starts", starts), ("repeats", repeats), ("most", most)):
        if count < 1:
            raise ValueError(f"{name} is {count}; it must be at least 1")
    for name, value in (("zoom", zoom), ("effort", effort), ("time limit", time_limit)):
        if value is not None and not 0.0 < value < math.inf:
            raise ValueError(f"{name} is {value:g}; it must be positive and finite")


def _truth_tolerance(scene: Scene, metric: str | None, tolerance: float | None, zoom: float | None) -> float:
    """Return the error that a truth may have, m; `zoom` in px/m, None if it is not known yet."""
    scale = {"m": 1.0, "px": zoom}.get("m" if metric is None else metric_named(metric).unit)
    if not tolerance or scale is None:
        return default_tolerance(scene)
    return min(default_tolerance(scene), tolerance / scale)


def _refusal(scene: Scene, engine: str, base: Settings) -> str | None:
    """Return the reason why an engine cannot run a scene with any settings; None if it can."""
    if not ENGINES[engine].missing(scene, base):
        return None
    missing = ENGINES[engine].missing(scene, base.common())
    return "; ".join(missing) if missing else None


def _refused(scene: Scene, names: Sequence[str], base: Settings) -> list[Evaluation]:
    reasons = ((name, _refusal(scene, name, base)) for name in names)
    return [refused_evaluation(name, base, reason) for name, reason in reasons if reason is not None]


@dataclass
class _Study:
    """A trade-off in progress."""

    space: SearchSpace
    context: EvaluationContext
    """of the start in the scene"""
    objective: Objective
    trials: StartTrials
    """of settings from other starts"""
    effort: float
    deadline: float
    on_progress: ProgressCallback
    refused: tuple[Evaluation, ...]
    """evaluations of the engines that cannot run the scene"""
    is_explained: bool = True
    """whether to split the errors into their sources, and to try simpler models"""
    counterexamples: list[int] = field(default_factory=list)
    """numbers of other starts from which the search runs settings too"""

    def run(self, runs: Mapping[str, Trajectory], repeats: int, most: int) -> Tradeoff:
        """Search, time and recommend; after Ctrl-C, with the finished evaluations and their times."""
        search, evaluations = self._search(self._reusable(runs), most)
        try:
            for _ in range(MAX_COUNTEREXAMPLES):
                self.on_progress(Progress("trying settings from other starts"))
                found = None if search.interrupted else self.trials.counterexample(evaluations)
                if found is None:
                    break
                self.counterexamples.append(found)
                search, evaluations = self._search({}, most)
            if not search.interrupted:
                return self._result(search, evaluations, repeats)
        except KeyboardInterrupt:
            self.on_progress(Progress("interrupted"))
        self.trials.count = 1
        return self._result(search, evaluations, 0)

    def _search(self, known: Mapping[str, Trajectory], most: int) -> tuple[SettingsSearch, list[Evaluation]]:
        """Search with the start in the scene and the counterexamples; return the search and its evaluations."""
        budget, duration = self.objective.seconds_budget, self.space.scene.world.duration
        search = SettingsSearch(
            space=self.space,
            contexts=self._search_contexts,
            metric=self.objective.metric.name,
            tolerance=self.objective.max_error,
            budget=None if budget is None else budget * duration,
            effort=self.effort,
            max_evaluations=most,
            on_progress=self.on_progress,
            deadline=self.deadline,
            known=known,
        )
        return search, search.run()

    @property
    def _search_contexts(self) -> list[EvaluationContext]:
        return [self.context, *(self.trials.context_at(number) for number in self.counterexamples)]

    def _reusable(self, runs: Mapping[str, Trajectory]) -> dict[str, Trajectory]:
        """Return the given runs with the own settings of an engine, if they have the data that the metric needs."""
        found: dict[str, Trajectory] = {}
        for name in self.space.engines:
            run = runs.get(name)
            if run is None or (self.objective.metric.name in AUDIT_METRICS and not run.info["audited"]):
                continue
            resolved = ENGINES[name].resolve(self.space.scene, self.space.own_settings(name)).model_dump(mode="json")
            if run.info["settings"] == resolved and run.info["seed"] == self.space.scene.world.seed:
                found[name] = run
        return found

    def _result(self, search: SettingsSearch, evaluations: Sequence[Evaluation], repeats: int) -> Tradeoff:
        """Time the evaluations and recommend; with 0 repeats, use the times of the scored runs."""
        self.on_progress(Progress("timing"))
        points = [*self._timed(evaluations, repeats), *self.refused]
        self.on_progress(Progress("checking the recommended setting from other starts"))
        within_tolerance = recommend_cheapest(points, self.objective, self.trials.holds, self.trials.confirmation)
        within_budget = recommend_most_accurate(
            points, self.objective, self.trials.ends_like_the_truth, self.trials.confirmation
        )
        splits: list[ErrorBudget] = []
        proposals: list[Simplification] = []
        if repeats and self.is_explained and clock_without_compilation() < self.deadline:
            self.on_progress(Progress("splitting the error into its sources, and trying simpler models"))
            splits = self._error_budgets()
            proposals = self._simplifications(within_tolerance)
        by_engine = {name: [p for p in points if p.engine == name] for name in self.space.engines}
        cheapest = {
            name: recommend_cheapest(own, self.objective, self.trials.holds, self.trials.confirmation)
            for name, own in by_engine.items()
        }
        near_tolerance = None if within_tolerance else nearest_to_tolerance(points, self.objective)
        has_answer = within_budget or self.objective.budget is None
        near_budget = None if has_answer else nearest_to_budget(points, self.objective)
        rejected = cheapest_rejected(points, self.objective, within_tolerance)
        picks = [within_tolerance, within_budget, *cheapest.values()]
        if repeats and self.is_explained and clock_without_compilation() < self.deadline:
            self.on_progress(Progress("running the settings of the table from other starts"))
            points = self._with_fresh_starts(points, list(filter(None, picks)))
        if repeats and self.trials.ends is not None:
            self.on_progress(Progress("comparing the ends of runs from other starts"))
            points = self._with_end_statistics(points, list(filter(None, picks)))
        context = self.context
        return Tradeoff(
            scene=self.space.scene,
            best=context.truth,
            doubt=context.doubt,
            metric=self.objective.metric,
            metric_reason=self.objective.reason,
            zoom=context.zoom,
            points=tuple(points),
            pareto=tuple(front_of(points)),
            splits=tuple(splits),
            proposals=tuple(proposals),
            tolerance=self.objective.tolerance,
            margin=self.objective.margin,
            budget=self.objective.budget,
            fps=self.objective.fps,
            within_tolerance=self._completed(within_tolerance, points),
            within_budget=self._completed(within_budget, points, within_tolerance),
            cheapest_by_engine={
                name: self._completed(each, points, within_tolerance) for name, each in cheapest.items()
            },
            rejected=self._completed(rejected, points),
            nearest_to_tolerance=self._completed(near_tolerance, points),
            nearest_to_budget=self._completed(near_budget, points),
            starts=self.trials.count,
            spread=self.trials.starts.spread,
            end_starts=0 if self.trials.ends is None else self.trials.ends.count,
            differing_ends=self.trials.differing_ends,
            searched_starts=(0, *self.counterexamples),
            untried=len(search.skipped - set(search.evaluations)),
            effort=self.effort,
            spent=search.spent,
            limit=search.limit,
            out_of_time=clock_without_compilation() >= self.deadline,
            machine=machine(),
            versions=versions(),
            max_dt=self.objective.max_dt,
            interrupted=not repeats,
        )

    def _timed(self, evaluations: Sequence[Evaluation], repeats: int) -> list[Evaluation]:
        """Return the evaluations with costs: those near the front of their engine are timed in turns.

        The costs of the others are estimated. The scene's own settings are always timed.
        """
        duration = self.space.scene.world.duration
        timings = {
            each.configuration: Timing.of([each.seconds], duration)._replace(repeats=0)
            for each in evaluations
            if each.status == "ok"
        }
        near_front = self._near_front(evaluations)
        if repeats and near_front:
            once = sum(each.counted_seconds for each in near_front)
            affordable = int(TIMING_FRACTION * self.effort / once) if once else repeats
            runs = [TimedRun(self.space.scene, each.engine, each.asked) for each in near_front]
            found = time_in_turns(runs, min(repeats, max(MIN_REPEATS, affordable)))
            for each, timing in zip(near_front, found, strict=True):
                if timing is None:
                    timings.pop(each.configuration, None)
                else:
                    timings[each.configuration] = timing
        return with_estimated_costs([each.with_timing(timings.get(each.configuration)) for each in evaluations])

    def _near_front(self, evaluations: Sequence[Evaluation]) -> list[Evaluation]:
        """Return the successful evaluations that are near the front of their engine, or have the scene's settings."""
        near_front: list[Evaluation] = []
        for engine in self.space.engines:
            successful = [each for each in evaluations if each.status == "ok" and each.engine == engine]
            costs = [(each.counted_seconds, each.ranking_error) for each in successful]
            faultless = [(each.counted_seconds, each.ranking_error) for each in successful if not each.objections]
            for each in successful:
                others = costs if each.objections else faultless
                if each.is_own or not is_dominated(each.counted_seconds, each.ranking_error, others, TIMED_MARGIN):
                    near_front.append(each)
        return near_front

    def _error_budgets(self) -> list[ErrorBudget]:
        """Return the error budgets of the engines with a time step, with their own settings."""
        limit = RUN_FRACTION * self.effort
        found = (
            error_budget(self.context, name, self.space.own_settings(name), limit, self.deadline)
            for name in self.space.engines
            if name != "exact"
        )
        return [each for each in found if each is not None]

    def _simplifications(self, chosen: Recommendation | None) -> list[Simplification]:
        """Return cheaper models than a recommended setting; without one, than the first engine's own settings."""
        if not self.space.engines:
            return []
        engine = self.space.engines[0] if chosen is None else chosen.point.engine
        replaced = ReplacedSetting(
            engine=engine,
            settings=self.space.own_settings(engine) if chosen is None else chosen.point.asked,
            metric=self.objective.metric,
            tolerance=self.objective.max_error,
            limit=RUN_FRACTION * self.effort,
            deadline=self.deadline,
        )
        return model_simplifications(self._search_contexts, replaced)

    def _with_fresh_starts(self, points: Sequence[Evaluation], picks: Sequence[Recommendation]) -> list[Evaluation]:
        """Return the points, those that the table shows with their errors from fresh starts."""
        by_engine = [[p for p in points if p.engine == name] for name in self.space.engines]
        shown = [point for own in by_engine for point in shown_of(front_of(own))]
        shown += [p for p in points if p.is_own and p.status == "ok"] + [pick.point for pick in picks]
        found = self.trials.errors_of_front(list({each.configuration: each for each in shown}.values()))
        found |= {p.point.configuration: p.confirmation for p in picks if p.confirmation and p.confirmation.held.trials}
        return [replace(each, fresh_starts=found.get(each.configuration)) for each in points]

    def _with_end_statistics(self, points: Sequence[Evaluation], picks: Sequence[Recommendation]) -> list[Evaluation]:
        """Return the points, the recommended ones and, if explained, the scene's own with statistics of the end."""
        chosen = {pick.point.configuration for pick in picks}
        return [
            replace(each, end_statistics=self.trials.end_statistics(each, fresh=True))
            if each.status == "ok" and ((each.is_own and self.is_explained) or each.configuration in chosen)
            else each
            for each in points
        ]

    def _completed(
        self, chosen: Recommendation | None, points: Sequence[Evaluation], cheapest: Recommendation | None = None
    ) -> Recommendation | None:
        """Return a recommendation with the diagnostics of its setting, and its cost relative to the cheapest one.

        Args:
            chosen: the recommendation.
            points: all points of the result, of which it gets its own.
            cheapest: cheapest setting of all engines; None: no relative cost.
        """
        if chosen is None:
            return None
        found = setting_warnings(self.space.scene, chosen.point.engine, chosen.point.asked)
        point = next(each for each in points if each.configuration == chosen.point.configuration)
        sentence = chosen.sentence
        if point.end_statistics is not None:
            sentence += f"; {point.end_statistics}"
        elif self.trials.ends is not None and chosen.confirmation is not None:  # not of the nearest setting
            sentence += "; its ends were not compared, because that exceeds the effort"
        completed = replace(chosen, sentence=sentence, point=point, warnings=tuple(found))
        if cheapest is None or cheapest.point.configuration == point.configuration:
            return completed
        ratio = CostRatio.of(point.turns, cheapest.point.turns)
        if ratio is None:
            return completed
        sentence = f"{completed.sentence}; {ratio} times the cost of {label(cheapest.point)}"
        return replace(completed, sentence=sentence, cost_ratio=ratio)


def setting_warnings(scene: Scene, engine: str, settings: Settings) -> list[Diagnostic]:
    """Return the diagnostics of a setting, without a trial run.

    Those of tunnelling also state the number of substeps from which on no body can tunnel at the dt of the setting.
    """
    found = warnings(scene, settings, engine)
    limits = [float(each.details["safe_dt"]) for each in found if each.kind == "tunnelling"]
    if not limits:
        return found
    safe = largest_safe_dt(scene, settings, engine)
    # It is unknown if an unbounded cause accelerates bodies; then the speeds in the diagnostics decide.
    effect = "prevents tunnelling at these speeds" if safe is None else "prevents tunnelling"
    safe = min(limits) if safe is None else safe
    ratio = settings.substeps * settings.dt / safe if safe > 0.0 else math.inf
    try:
        needed = settings.replace(substeps=math.ceil(ratio * (1.0 - ROUNDING))).substeps
    except (OverflowError, SettingsError):  # more than a setting may have
        return found
    remedy = f"; at dt = {settings.dt:.4g} s, substeps >= {needed} {effect}"
    return [
        replace(each, remedy=each.remedy + remedy, details={**each.details, "safe_substeps": needed})
        if each.kind == "tunnelling"
        else each
        for each in found
    ]
