"""Results of a trade-off, whose fields are those of its JSON document."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, ClassVar, NamedTuple

from sandbox.echo import short_repr
from sandbox.formatting import format_plural, format_quantity
from sandbox.jsonable import in_json, to_json
from sandbox.measure.compare.end_statistics import MIN_END_STARTS
from sandbox.measure.compare.ground_truth import Truth
from sandbox.measure.compare.metrics import Metric
from sandbox.measure.compare.result import StudyAgainstTruth
from sandbox.measure.fresh_starts import FreshStarts
from sandbox.measure.preflight.diagnostic import Diagnostic
from sandbox.measure.tradeoff.configuration import Configuration, Evaluation
from sandbox.measure.tradeoff.convergence import ConvergenceOrder, convergence_orders
from sandbox.measure.tradeoff.error_budget import ErrorBudget
from sandbox.measure.tradeoff.objective import REQUESTED, less_margin, pareto
from sandbox.measure.tradeoff.search import Limit
from sandbox.measure.tradeoff.simplify import Simplification
from sandbox.measure.tradeoff.timing import CostRatio
from sandbox.scene.compile.scene import Scene

LIMITS: Mapping[Limit | None, str] = {
    "points": "The largest number of settings (--points)",
    "effort": "The effort (--effort)",
    "time": "The time limit",
}
"""Limits of a search in sentences."""

MAX_SHOWN = 4
"""Answers in the representation of a trade-off."""
MAX_FRONT = 8
"""Points of the front of one engine that are shown, and run from other starts"""


@dataclass(frozen=True)
class Recommendation:
    """Recommended setting, with its errors over perturbed starts."""

    point: Evaluation = field(metadata=in_json(inline=True))
    """the setting, with error and cost"""
    sentence: str
    """description of the setting, its error and its cost"""
    confirmation: FreshStarts | None
    """errors over fresh starts; None if no other starts were asked for, or the setting is not recommended"""
    warnings: tuple[Diagnostic, ...] = ()
    """problems that formulas predict for the setting (those of `sandbox check --no-trial`). The measured runs may not
    show them: a body can tunnel at a slightly different speed"""
    cost_ratio: CostRatio | None = None
    """cost relative to the cheapest setting of all engines within the tolerance; None if it is that setting, or if they
    were not timed in the same turns"""


class Conclusion(NamedTuple):
    """Answer of a trade-off to a question, as a sentence."""

    text: str
    key: str | None = None
    """key in the document of the recommendation that it describes, such as `cheapest_by_engine.pymunk`"""


@dataclass(frozen=True, eq=False)
class Tradeoff(StudyAgainstTruth):
    """Error and cost of engines and settings for one scene."""

    scene: Scene = field(metadata=in_json(omit=True))
    """the scene"""
    best: Truth | None = field(metadata=in_json(omit=True))
    """truth that errors are measured against; None if there is none"""
    doubt: str | None = field(metadata=in_json(omit=True))
    """reason why there is no truth"""
    metric: Metric = field(metadata=in_json(omit=True))
    """metric of the error: name, unit and description"""
    metric_reason: str
    """reason for the choice of the metric, as a clause"""
    zoom: float
    """px/m, scale of errors in pixels"""
    points: tuple[Evaluation, ...]
    """all settings that were tried"""
    pareto: tuple[Evaluation, ...]
    """points of the Pareto front, cheapest first: no other point is both cheaper and more accurate"""
    splits: tuple[ErrorBudget, ...] = field(metadata=in_json(key="split"))
    """position error of each engine: the parts of solver iterations and time step, and the remaining error"""
    proposals: tuple[Simplification, ...]
    """cheaper models of the scene whose error is within the tolerance"""
    tolerance: float
    """largest accepted error, in the unit of the metric"""
    margin: float
    """fraction of the tolerance that a recommended setting leaves unused"""
    budget: float | None
    """ms, computing time per frame; None if not given"""
    fps: float
    """frames per second of the budget"""
    within_tolerance: Recommendation | None
    """cheapest setting within the tolerance"""
    within_budget: Recommendation | None
    """most accurate setting within the budget"""
    cheapest_by_engine: Mapping[str, Recommendation | None]
    """cheapest setting within the tolerance for each engine"""
    rejected: Recommendation | None
    """cheapest setting within the tolerance, if it is not recommended because of its `objections`"""
    nearest_to_tolerance: Recommendation | None
    """setting with the smallest error, if no setting is within the tolerance"""
    nearest_to_budget: Recommendation | None
    """setting with the smallest frame time, if no setting is within the budget"""
    starts: int
    """number of perturbed starts with which settings are confirmed, if the effort allows; 1: none"""
    spread: float
    """largest change of a start, as a fraction (`Starts`)"""
    end_starts: int
    """number of perturbed starts whose ends are compared with those of the truth's method; 0: none"""
    differing_ends: int
    """settings within the tolerance that are not recommended because their ends differ"""
    searched_starts: tuple[int, ...]
    """numbers of the starts over which errors are the largest: 0, that of the scene, and those from which the settings
    found before failed"""
    untried: int
    """number of configurations left out because of their cost"""
    effort: float
    """counted work that the search was allowed"""
    spent: float
    """counted work that the search used"""
    limit: Limit | None
    """limit that ended the search; None if no further setting was worth a run"""
    out_of_time: bool
    """whether the time limit ended the search; another run may then try more settings"""
    machine: Mapping[str, Any]
    """description of the machine"""
    versions: Mapping[str, str]
    """versions of Python and of the packages used"""
    max_dt: float = math.inf
    """s, longest dt of a recommended setting: a frame, or the dt of the scene if that is longer"""
    interrupted: bool = False
    """whether Ctrl-C ended the search; the points are those tried before, with the times of their recorded runs"""

    json_head: ClassVar = (
        ("scene", "title"),
        "title",
        "truth",
        "truth_about",
        "trusted_until",
        "duration",
        ("metric", "metric_name"),
        "metric_about",
        "unit",
    )
    json_properties: ClassVar = ("max_error", "orders", ("answers", "sentences"), ("answered_by", "answer_keys"))

    def __repr__(self) -> str:
        """Return the number of points, and the settings within the tolerance and the budget."""
        engines = ", ".join(dict.fromkeys(point.engine for point in self.points))
        head = f"<Tradeoff {short_repr(self.scene.title)}: {len(self.points):,} settings of {engines or 'no engine'}"
        lines = [f"{head}, {len(self.pareto):,} on the Pareto front; error: {self.metric.name}"]
        return "\n  ".join([*lines, *self.sentences[:MAX_SHOWN]]) + ">"

    @property
    def metric_name(self) -> str:
        """Name of the metric."""
        return self.metric.name

    @property
    def metric_about(self) -> str:
        """Description of the metric."""
        return self.metric.about

    @property
    def unit(self) -> str:
        """Unit of the errors; empty for counts and fractions."""
        return self.metric.unit

    @property
    def max_error(self) -> float:
        """Largest error of a recommended setting, in the unit of the metric: the tolerance less the margin."""
        return less_margin(self.tolerance, self.margin)

    @property
    def orders(self) -> list[ConvergenceOrder]:
        """Order of convergence of each method whose errors fall steadily with the substep, over three or more."""
        return convergence_orders(self.points, self.tolerance)

    @property
    def error_about(self) -> str:
        """Metric of the error and the reason for it, as one sentence."""
        return f"error metric: {self.metric.name} ({self.metric.about}), because {self.metric_reason}"

    def fronts(self) -> dict[str, list[Evaluation]]:
        """Return the Pareto front of each engine, cheapest first."""
        names = dict.fromkeys(point.engine for point in self.points)
        return {name: front_of([p for p in self.points if p.engine == name]) for name in names}

    def answers(self) -> list[Conclusion]:
        """Return the answers, each with the key of the recommendation in the document that it describes."""
        successful = [point for point in self.points if point.status == "ok"]
        if successful and all(point.error is None for point in successful):
            return [Conclusion(f"{self.metric.name} cannot be measured in this scene; choose another --metric")]
        question = f"cheapest setting with {self.metric.name} within {self._limit_text()}"
        found = [self._answer(question, "within_tolerance", "nearest_to_tolerance")]
        if self.budget is not None:
            question = f"most accurate setting within {self.budget:g} ms per frame at {self.fps:g} fps"
            found.append(self._answer(question, "within_budget", "nearest_to_budget"))
        overall = None if self.within_tolerance is None else self.within_tolerance.point
        for name, each in self.cheapest_by_engine.items():
            if each and each.point is not overall:
                text = f"cheapest setting of {name} within {self._limit_name}: {each.sentence}"
                found.append(Conclusion(text, f"cheapest_by_engine.{name}"))
        if self.rejected is not None:
            reasons = "; ".join(self.rejected.point.objections)
            text = f"within {self._limit_name}, but not recommended: {self.rejected.sentence}. Because: {reasons}"
            found.append(Conclusion(text, "rejected"))
        return found

    def _limit_text(self) -> str:
        """Return the largest error of a recommended setting: `10 mm`, or `8 mm (10 mm less a margin of 20 %)`."""
        tolerance, largest = (format_quantity(each, self.metric.unit) for each in (self.tolerance, self.max_error))
        return f"{largest} ({tolerance} less a margin of {100.0 * self.margin:.3g} %)" if self.margin else tolerance

    @property
    def _limit_name(self) -> str:
        return "the tolerance less the margin" if self.margin else "the tolerance"

    @property
    def margin_about(self) -> str | None:
        """Effect of the margin, as one sentence; None without one."""
        return f"tolerance: recommended settings keep to {self._limit_text()}" if self.margin else None

    @property
    def ends_about(self) -> str | None:
        """How the time after that for which the truth is trusted is judged, as one sentence; None if there is none.

        An invariant that was requested counts alone.
        """
        is_requested = self.metric_reason == REQUESTED and not self.metric.is_difference
        if self.best is None or self.best.trusted_until >= self.duration or is_requested:
            return None
        after = f"after {self.best.trusted_until:.3g} s no truth of positions is known"
        if not self.end_starts:
            is_few = self.starts < MIN_END_STARTS
            cause = f"that takes {MIN_END_STARTS} starts" if is_few else "runs of the truth's method exceed the effort"
            return f"{after}, and ends of runs were not compared: {cause}"
        passed = f"; those of {format_plural(self.differing_ends, 'setting')} within the tolerance differ"
        return (
            f"{after}: the ends of runs are compared with those of the truth's method "
            f"({self.best.trajectory.info['engine']}) over up to {self.end_starts} perturbed starts, as effort allows"
            f"{passed if self.differing_ends else ''}"
        )

    @property
    def sentences(self) -> list[str]:
        """The answers as sentences."""
        return [each.text for each in self.answers()]

    @property
    def answer_keys(self) -> list[str | None]:
        """The key in the document of the recommendation that each answer describes."""
        return [each.key for each in self.answers()]

    def _answer(self, question: str, found_key: str, nearest_key: str) -> Conclusion:
        """Return the answer to a question: the recommendation with one key, or without it the nearest setting."""
        found: Recommendation | None = getattr(self, found_key)
        nearest: Recommendation | None = getattr(self, nearest_key)
        if found is not None:
            return Conclusion(f"{question}: {found.sentence}", found_key)
        sentences = [f"none of the {len(self.points)} settings tried"]
        if nearest is not None:
            sentences[0] += f"; the nearest is {nearest.sentence}"
            if nearest.point.objections and self.rejected is None:
                sentences.append(f"It has objections: {'; '.join(nearest.point.objections)}")
        if self.limit in LIMITS and not self.interrupted:
            sentences.append(
                f"{LIMITS[self.limit]} ended the search, after {self.spent:.2g} of an effort of {self.effort:g}"
            )
        text = ". ".join([*sentences, *self._unsteady(nearest)])
        return Conclusion(f"{question}: {text}", None if nearest is None else nearest_key)

    def _unsteady(self, nearest: Recommendation | None) -> Iterator[str]:
        """Yield a sentence if the errors of a method do not fall steadily with the step."""
        if nearest is None:
            return
        chosen = nearest.point.configuration
        series = sorted(
            (each for each in self.points if each.status == "ok" and each.error and _has_method(each, chosen)),
            key=lambda each: each.configuration.refinement * each.configuration.substeps,
        )
        rises = [(a, b) for a, b in pairwise(series) if (b.error or 0.0) > (a.error or 0.0)]
        if rises:
            a, b = max(rises, key=lambda pair: (pair[1].error or 0.0) / (pair[0].error or 1.0))
            errors = [format_quantity(each.error or 0.0, self.metric.unit) for each in (a, b)]
            steps = [f"{each.settings.dt / each.settings.substeps:.3g} s" for each in (a, b)]
            yield (
                f"Its errors do not fall steadily with the step: {errors[0]} with substeps of {steps[0]}, {errors[1]} "
                f"with {steps[1]}"
            )

    def document(self, scene: str | None = None) -> dict[str, Any]:
        """Return the trade-off as one JSON document.

        Args:
            scene: name of the scene in the document, such as its path; default: its title.
        """
        found: dict[str, Any] = to_json(self)
        return found if scene is None else {**found, "scene": scene}


def _has_method(point: Evaluation, other: Configuration) -> bool:
    """Return whether a point differs from a configuration only in its step."""
    own = point.configuration
    return (own.engine, own.iterations, own.options) == (other.engine, other.iterations, other.options)


def shown_of(front: Sequence[Evaluation]) -> list[Evaluation]:
    """Return the points of a front that are shown: at most `MAX_FRONT`, evenly spaced, with its ends."""
    if len(front) <= MAX_FRONT:
        return list(front)
    return [front[round(k * (len(front) - 1) / (MAX_FRONT - 1))] for k in range(MAX_FRONT)]


def front_of(points: Sequence[Evaluation]) -> list[Evaluation]:
    """Return the Pareto front, cheapest first.

    If some points were timed separately, only these are used: the costs of the others are estimates.
    """
    usable = [point for point in points if point.is_usable]
    timed = [point for point in usable if point.repeats]
    return pareto(timed or usable, lambda each: each.cost or 0.0, lambda each: each.error or 0.0)
