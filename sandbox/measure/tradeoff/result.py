"""Results of a trade-off as frozen values and as a JSON document."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from sandbox.echo import short_repr
from sandbox.formatting import format_quantity
from sandbox.html_repr import HtmlRepr
from sandbox.jsonable import in_json, to_json
from sandbox.measure.compare.ground_truth import Truth
from sandbox.measure.compare.metrics import Metric
from sandbox.measure.preflight.diagnostic import Diagnostic
from sandbox.measure.tradeoff.configuration import Configuration, Evaluation
from sandbox.measure.tradeoff.error_budget import ErrorBudget
from sandbox.measure.tradeoff.objective import pareto
from sandbox.measure.tradeoff.search import Limit
from sandbox.measure.tradeoff.simplify import Simplification
from sandbox.scene.compile.scene import Scene

LIMITS: Mapping[Limit | None, str] = {
    "points": "The largest number of settings (--points)",
    "effort": "The effort (--effort)",
    "time": "The time limit",
}
"""Limits of a search in sentences."""

MAX_SHOWN = 4
"""Answers in the representation of a trade-off."""


@dataclass(frozen=True)
class Recommendation:
    """Recommended setting, with its error for seeds that were not used to choose it."""

    point: Evaluation = field(metadata=in_json(inline=True))
    """the setting, with error and cost"""
    sentence: str
    """description of the setting, its error and its cost"""
    fresh_seeds: tuple[int, ...]
    """seeds of the additional runs; empty if the scene has no randomness"""
    fresh_error: float | None
    """largest error of the additional runs, in the unit of the metric"""
    warnings: tuple[Diagnostic, ...] = ()
    """problems that formulas predict for the setting (those of `sandbox check --no-trial`). The measured runs may not
    show them: a body can tunnel at a slightly different speed"""


@dataclass(frozen=True, eq=False)
class Tradeoff(HtmlRepr):
    """Error and cost of engines and settings for one scene."""

    scene: Scene
    """the scene"""
    best: Truth | None
    """truth that errors are measured against; None if there is none"""
    doubt: str | None
    """reason why there is no truth"""
    metric: Metric
    """metric of the error: name, unit and description"""
    metric_reason: str
    """reason for the choice of the metric, as a clause"""
    zoom: float
    """px/m, scale of errors in pixels"""
    points: tuple[Evaluation, ...]
    """all settings that were tried"""
    pareto: tuple[Evaluation, ...]
    """points of the Pareto front, cheapest first: no other point is both cheaper and more accurate"""
    splits: tuple[ErrorBudget, ...]
    """position error of each engine: the parts of solver iterations and time step, and the remaining error"""
    proposals: tuple[Simplification, ...]
    """cheaper models of the scene whose error is within the tolerance"""
    tolerance: float
    """largest accepted error, in the unit of the metric"""
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
    seeds: tuple[int, ...]
    """seeds over which errors are the largest"""
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

    def __repr__(self) -> str:
        """Return the number of points, and the settings within the tolerance and the budget."""
        engines = ", ".join(dict.fromkeys(point.engine for point in self.points))
        head = f"<Tradeoff {short_repr(self.scene.title)}: {len(self.points):,} settings of {engines or 'no engine'}"
        lines = [f"{head}, {len(self.pareto):,} on the Pareto front; error: {self.metric.name}"]
        return "\n  ".join([*lines, *self.answers()[:MAX_SHOWN]]) + ">"

    @property
    def truth(self) -> str | None:
        """Kind of the truth: `closed_form`, `exact` or `refined`; None if there is none."""
        return None if self.best is None else self.best.kind

    @property
    def error_about(self) -> str:
        """Metric of the error and the reason for it, as one sentence."""
        return f"error metric: {self.metric.name} ({self.metric.about}), because {self.metric_reason}"

    def fronts(self) -> dict[str, list[Evaluation]]:
        """Return the Pareto front of each engine, cheapest first."""
        names = dict.fromkeys(point.engine for point in self.points)
        return {name: front_of([p for p in self.points if p.engine == name]) for name in names}

    def answers(self) -> list[str]:
        """Return the recommended settings as sentences."""
        successful = [point for point in self.points if point.status == "ok"]
        if successful and all(point.error is None for point in successful):
            return [f"{self.metric.name} cannot be measured in this scene; choose another --metric"]
        tolerance = format_quantity(self.tolerance, self.metric.unit)
        question = f"cheapest setting with {self.metric.name} within {tolerance}"
        lines = [f"{question}: {self._answer(self.within_tolerance, self.nearest_to_tolerance)}"]
        if self.budget is not None:
            question = f"most accurate setting within {self.budget:g} ms per frame at {self.fps:g} fps"
            lines.append(f"{question}: {self._answer(self.within_budget, self.nearest_to_budget)}")
        overall = None if self.within_tolerance is None else self.within_tolerance.point
        others = {name: each for name, each in self.cheapest_by_engine.items() if each and each.point is not overall}
        lines += [f"cheapest setting of {name} within the tolerance: {each.sentence}" for name, each in others.items()]
        if self.rejected is not None:
            reasons = "; ".join(self.rejected.point.objections)
            lines.append(f"within the tolerance, but not recommended: {self.rejected.sentence}. Because: {reasons}")
        return lines

    def _answer(self, found: Recommendation | None, nearest: Recommendation | None) -> str:
        if found is not None:
            return found.sentence
        sentences = [f"none of the {len(self.points)} settings tried"]
        if nearest is not None:
            sentences[0] += f"; the nearest is {nearest.sentence}"
            if nearest.point.objections and self.rejected is None:
                sentences.append(f"It has objections: {'; '.join(nearest.point.objections)}")
        if self.limit in LIMITS and not self.interrupted:
            sentences.append(
                f"{LIMITS[self.limit]} ended the search, after {self.spent:.2g} of an effort of {self.effort:g}"
            )
        return ". ".join([*sentences, *self._unsteady(nearest)])

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
        found: dict[str, Any] = to_json(
            TradeoffDocument(
                scene=self.scene.title if scene is None else scene,
                title=self.scene.title,
                truth=self.truth,
                truth_about=self.doubt if self.best is None else self.best.about,
                trusted_until=None if self.best is None else self.best.trusted_until,
                duration=self.scene.world.duration,
                metric=self.metric.name,
                metric_reason=self.metric_reason,
                metric_about=self.metric.about,
                unit=self.metric.unit,
                zoom=self.zoom,
                seeds=self.seeds,
                points=self.points,
                pareto=self.pareto,
                split=self.splits,
                proposals=self.proposals,
                tolerance=self.tolerance,
                budget=self.budget,
                fps=self.fps,
                max_dt=self.max_dt,
                within_tolerance=self.within_tolerance,
                within_budget=self.within_budget,
                nearest_to_tolerance=self.nearest_to_tolerance,
                nearest_to_budget=self.nearest_to_budget,
                cheapest_by_engine=self.cheapest_by_engine,
                rejected=self.rejected,
                answers=self.answers(),
                untried=self.untried,
                effort=self.effort,
                spent=self.spent,
                limit=self.limit,
                out_of_time=self.out_of_time,
                interrupted=self.interrupted,
                machine=self.machine,
                versions=self.versions,
            )
        )
        return found


@dataclass(frozen=True)
class TradeoffDocument:
    """JSON document of a trade-off; the fields are those of `Tradeoff`."""

    scene: str
    title: str
    truth: str | None
    truth_about: str | None
    trusted_until: float | None
    duration: float
    metric: str
    metric_reason: str
    metric_about: str
    unit: str
    zoom: float
    seeds: Sequence[int]
    points: Sequence[Evaluation]
    pareto: Sequence[Evaluation]
    split: Sequence[ErrorBudget]
    proposals: Sequence[Simplification]
    tolerance: float
    budget: float | None
    fps: float
    max_dt: float
    within_tolerance: Recommendation | None
    within_budget: Recommendation | None
    nearest_to_tolerance: Recommendation | None
    nearest_to_budget: Recommendation | None
    cheapest_by_engine: Mapping[str, Recommendation | None]
    rejected: Recommendation | None
    answers: Sequence[str]
    untried: int
    effort: float
    spent: float
    limit: Limit | None
    out_of_time: bool
    interrupted: bool
    machine: Mapping[str, Any]
    versions: Mapping[str, str]


def _has_method(point: Evaluation, other: Configuration) -> bool:
    """Return whether a point differs from a configuration only in its step."""
    own = point.configuration
    return (own.engine, own.iterations, own.options) == (other.engine, other.iterations, other.options)


def front_of(points: Sequence[Evaluation]) -> list[Evaluation]:
    """Return the Pareto front, cheapest first.

    If some points were timed separately, only these are used: the time of the others includes recording and audit.
    """
    usable = [point for point in points if point.is_usable]
    timed = [point for point in usable if point.repeats]
    return pareto(timed or usable, lambda each: each.cost or 0.0, lambda each: each.error or 0.0)
