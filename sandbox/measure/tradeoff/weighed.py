"""Tradeoff: what came of weighing a scene's settings, as a frozen value and as a JSON document."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sandbox.measure.compare.truth import Truth
from sandbox.measure.finite import finite
from sandbox.measure.tradeoff.figure import figure
from sandbox.measure.tradeoff.front import pareto
from sandbox.measure.tradeoff.metrics import Metric
from sandbox.measure.tradeoff.point import Point
from sandbox.measure.tradeoff.proposals import Proposal
from sandbox.measure.tradeoff.split import Split
from sandbox.scene.model import Scene


@dataclass(frozen=True)
class Pick:
    """A point that answers a question, and how it stood up to seeds that it was not chosen by."""

    point: Point
    sentence: str
    fresh_seeds: tuple[int, ...]
    """on which it was run again; none where nothing in the scene is random"""
    fresh_error: float | None
    """the worst of these runs"""

    def document(self) -> dict[str, Any]:
        """Return it as a JSON object: the point, and what else there is."""
        more = {
            "sentence": self.sentence,
            "fresh_seeds": list(self.fresh_seeds),
            "fresh_error": finite(self.fresh_error),
        }
        return {**self.point.document(), **more}


@dataclass(frozen=True, eq=False)
class Tradeoff:
    """Error against cost, over engines and settings."""

    scene: Scene
    best: Truth | None
    doubt: str | None
    """why there is no truth"""
    metric: Metric
    metric_reason: str
    """why it is this one, as a clause"""
    zoom: float
    """px/m"""
    points: tuple[Point, ...]
    pareto: tuple[Point, ...]
    """those that nothing beats in both, cheapest first"""
    splits: tuple[Split, ...]
    proposals: tuple[Proposal, ...]
    tolerance: float
    """in the metric's unit"""
    budget: float | None
    """ms a frame"""
    fps: float
    """frames per second of the budget"""
    within_tolerance: Pick | None
    """the cheapest within the tolerance"""
    within_budget: Pick | None
    """the best within the budget"""
    cheapest_by_engine: Mapping[str, Pick | None]
    """the cheapest within the tolerance of each engine by itself"""
    nearest_to_tolerance: Pick | None
    """what comes nearest where nothing is within the tolerance"""
    nearest_to_budget: Pick | None
    """likewise of the budget"""
    seeds: tuple[int, ...]
    """that errors are the worst of"""
    untried: int
    """variants left out, as they would have cost too much"""
    effort: float
    """counted work that the search was allowed"""
    spent: float
    """counted work that it did"""
    out_of_time: bool
    """whether the time limit ended it: another run may try more"""
    machine: Mapping[str, Any]
    versions: Mapping[str, str]
    interrupted: bool = False
    """by the user: what was tried till then is here, with the times of the runs that were scored"""

    @property
    def truth(self) -> str | None:
        """`closed_form`, `exact` or `refined`; None where there is none."""
        return None if self.best is None else self.best.kind

    @property
    def floors(self) -> dict[str, float]:
        """The error of each engine that no setting of its step and its iterations removes, m, where there is one."""
        return {each.engine: each.model for each in self.splits if each.model is not None and math.isfinite(each.model)}

    @property
    def error_about(self) -> str:
        """What errors are counted in, and why, in one sentence."""
        return f"errors are {self.metric.name} ({self.metric.about}), because {self.metric_reason}"

    def fronts(self) -> dict[str, list[Point]]:
        """Return the Pareto front of each engine by itself, cheapest first."""
        names = dict.fromkeys(point.engine for point in self.points)
        return {name: front_of([p for p in self.points if p.engine == name]) for name in names}

    def answers(self) -> list[str]:
        """Return the sentences that people come for."""
        ran = [point for point in self.points if point.status == "ok"]
        if ran and all(point.error is None for point in ran):
            return [f"{self.metric.name} says nothing of this scene; choose another --metric"]
        unit = self.metric.unit
        wanted = f"cheapest setting with {self.metric.name} within {figure(self.tolerance, unit)}"
        lines = [f"{wanted}: {self._answer(self.within_tolerance, self.nearest_to_tolerance)}"]
        if self.budget is not None:
            most = f"most accurate setting within {self.budget:g} ms a frame, at {self.fps:g} frames a second"
            lines.append(f"{most}: {self._answer(self.within_budget, self.nearest_to_budget)}")
        overall = None if self.within_tolerance is None else self.within_tolerance.point
        others = {name: pick for name, pick in self.cheapest_by_engine.items() if pick and pick.point is not overall}
        return lines + [f"cheapest of {name} within it: {pick.sentence}" for name, pick in others.items()]

    def _answer(self, found: Pick | None, nearest: Pick | None) -> str:
        if found is not None:
            return found.sentence
        none = f"none of the {len(self.points)} that were tried"
        return none if nearest is None else f"{none}; the nearest is {nearest.sentence}"

    def document(self, scene: str | None = None) -> dict[str, Any]:
        """Return the trade-off as one JSON document.

        Args:
            scene: what the scene is called in it, such as its path; else its title.
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


def front_of(points: Sequence[Point]) -> list[Point]:
    """Return the points that no other is both cheaper and more accurate than, cheapest first.

    The time of a run whose frames were kept and audited says nothing beside one that was timed apart.
    """
    usable = [point for point in points if point.usable]
    timed = [point for point in usable if point.repeats]
    return pareto(timed or usable, lambda each: each.cost or 0.0, lambda each: each.error or 0.0)
