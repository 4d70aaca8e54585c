"""Tradeoff: errors and costs of the settings of a scene, as a frozen value and as a JSON document."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sandbox.echo import short_repr
from sandbox.html_repr import HtmlRepr
from sandbox.measure.compare.truth import Truth
from sandbox.measure.finite import finite
from sandbox.measure.forecast.warning import Warning
from sandbox.measure.tradeoff.figure import figure
from sandbox.measure.tradeoff.front import pareto
from sandbox.measure.tradeoff.metrics import Metric
from sandbox.measure.tradeoff.point import Point
from sandbox.measure.tradeoff.proposals import Proposal
from sandbox.measure.tradeoff.split import Split
from sandbox.scene.scene import Scene

MAX_SHOWN = 4
"""Answers in the representation of a trade-off."""


@dataclass(frozen=True)
class Pick:
    """Recommended point, with its error for seeds that were not used to choose it."""

    point: Point
    """the setting, with error and cost"""
    sentence: str
    """description of the setting, its error and its cost"""
    fresh_seeds: tuple[int, ...]
    """seeds of the additional runs; empty if the scene has no randomness"""
    fresh_error: float | None
    """largest error of the additional runs, in the unit of the metric"""
    warnings: tuple[Warning, ...] = ()
    """problems that formulas predict for the setting (those of `sandbox check --no-trial`). The measured runs may not
    show them: a body can tunnel at a slightly different speed"""

    def document(self) -> dict[str, Any]:
        """Return the pick as a JSON object: the fields of the point, and its own."""
        more = {
            "sentence": self.sentence,
            "fresh_seeds": list(self.fresh_seeds),
            "fresh_error": finite(self.fresh_error),
            "warnings": [_warning_document(each) for each in self.warnings],
        }
        return {**self.point.document(), **more}


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
    points: tuple[Point, ...]
    """all settings that were tried"""
    pareto: tuple[Point, ...]
    """points of the Pareto front, cheapest first: no other point is both cheaper and more accurate"""
    splits: tuple[Split, ...]
    """position error of each engine, split into the parts of solver iterations, time step and model"""
    proposals: tuple[Proposal, ...]
    """cheaper models of the scene whose error is within the tolerance"""
    tolerance: float
    """largest accepted error, in the unit of the metric"""
    budget: float | None
    """ms, computing time per frame; None if not given"""
    fps: float
    """frames per second of the budget"""
    within_tolerance: Pick | None
    """cheapest setting within the tolerance"""
    within_budget: Pick | None
    """most accurate setting within the budget"""
    cheapest_by_engine: Mapping[str, Pick | None]
    """cheapest setting within the tolerance for each engine"""
    nearest_to_tolerance: Pick | None
    """setting with the smallest error, if no setting is within the tolerance"""
    nearest_to_budget: Pick | None
    """setting with the smallest frame time, if no setting is within the budget"""
    seeds: tuple[int, ...]
    """seeds over which errors are the largest"""
    untried: int
    """number of variants left out because of their cost"""
    effort: float
    """counted work that the search was allowed"""
    spent: float
    """counted work that the search used"""
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
    def floors(self) -> dict[str, float]:
        """Error of each engine that remains with a small step and many iterations, m.

        Engines without such an error are left out.
        """
        return {each.engine: each.model for each in self.splits if each.model is not None and math.isfinite(each.model)}

    @property
    def error_about(self) -> str:
        """Metric of the error and the reason for it, as one sentence."""
        return f"error metric: {self.metric.name} ({self.metric.about}), because {self.metric_reason}"

    def fronts(self) -> dict[str, list[Point]]:
        """Return the Pareto front of each engine, cheapest first."""
        names = dict.fromkeys(point.engine for point in self.points)
        return {name: front_of([p for p in self.points if p.engine == name]) for name in names}

    def answers(self) -> list[str]:
        """Return the recommended settings as sentences."""
        ran = [point for point in self.points if point.status == "ok"]
        if ran and all(point.error is None for point in ran):
            return [f"{self.metric.name} cannot be measured in this scene; choose another --metric"]
        unit = self.metric.unit
        wanted = f"cheapest setting with {self.metric.name} within {figure(self.tolerance, unit)}"
        lines = [f"{wanted}: {self._answer(self.within_tolerance, self.nearest_to_tolerance)}"]
        if self.budget is not None:
            most = f"most accurate setting within {self.budget:g} ms per frame at {self.fps:g} fps"
            lines.append(f"{most}: {self._answer(self.within_budget, self.nearest_to_budget)}")
        overall = None if self.within_tolerance is None else self.within_tolerance.point
        others = {name: pick for name, pick in self.cheapest_by_engine.items() if pick and pick.point is not overall}
        return lines + [
            f"cheapest setting of {name} within the tolerance: {pick.sentence}" for name, pick in others.items()
        ]

    def _answer(self, found: Pick | None, nearest: Pick | None) -> str:
        if found is not None:
            return found.sentence
        none = f"none of the {len(self.points)} settings tried"
        return none if nearest is None else f"{none}; the nearest is {nearest.sentence}"

    def document(self, scene: str | None = None) -> dict[str, Any]:
        """Return the trade-off as one JSON document.

        Args:
            scene: name of the scene in the document, such as its path; default: its title.
        """
        return {
            "scene": self.scene.title if scene is None else scene,
            "title": self.scene.title,
            "truth": self.truth,
            "truth_about": self.doubt if self.best is None else self.best.about,
            "trusted_until": None if self.best is None else self.best.trusted_until,
            "duration": self.scene.world.duration,
            "metric": self.metric.name,
            "metric_reason": self.metric_reason,
            "metric_about": self.metric.about,
            "unit": self.metric.unit,
            "zoom": self.zoom,
            "seeds": list(self.seeds),
            "points": [point.document() for point in self.points],
            "pareto": [point.document() for point in self.pareto],
            "floors": self.floors,
            "split": [each.document() for each in self.splits],
            "proposals": [each.document() for each in self.proposals],
            "tolerance": self.tolerance,
            "budget": self.budget,
            "fps": self.fps,
            "max_dt": finite(self.max_dt),
            **{name: None if pick is None else pick.document() for name, pick in self._picks().items()},
            "cheapest_by_engine": {
                name: None if pick is None else pick.document() for name, pick in self.cheapest_by_engine.items()
            },
            "answers": self.answers(),
            "untried": self.untried,
            "effort": self.effort,
            "spent": self.spent,
            "out_of_time": self.out_of_time,
            "interrupted": self.interrupted,
            "machine": dict(self.machine),
            "versions": dict(self.versions),
        }

    def _picks(self) -> dict[str, Pick | None]:
        names = ("within_tolerance", "within_budget", "nearest_to_tolerance", "nearest_to_budget")
        return {name: getattr(self, name) for name in names}


def _warning_document(warning: Warning) -> dict[str, Any]:
    figures = {key: finite(value) if isinstance(value, float) else value for key, value in warning.figures.items()}
    return {"kind": warning.kind, "message": warning.message, **figures}


def front_of(points: Sequence[Point]) -> list[Point]:
    """Return the Pareto front of points, cheapest first.

    If some points were timed separately, only these are used: the time of the others includes recording and audit.
    """
    usable = [point for point in points if point.usable]
    timed = [point for point in usable if point.repeats]
    return pareto(timed or usable, lambda each: each.cost or 0.0, lambda each: each.error or 0.0)
