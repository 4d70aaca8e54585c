"""Tradeoff: what came of weighing a scene's settings, as a frozen value and as a JSON document."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sandbox.measure.compare.truth import Truth
from sandbox.measure.finite import finite
from sandbox.measure.tradeoff.figure import figure
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
    metric: Metric
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
    seeds: tuple[int, ...]
    """that errors are the worst of"""
    untried: int
    """variants left out, as they would have taken too long"""
    machine: Mapping[str, Any]
    versions: Mapping[str, str]
    interrupted: bool = False
    """by the user: what was tried till then is here, with the times of the runs that were scored"""

    @property
    def truth(self) -> str | None:
        """`closed_form`, `exact` or `refined`; None where nobody knows."""
        return None if self.best is None else self.best.kind

    @property
    def floors(self) -> dict[str, float]:
        """The error of each engine that no setting of its step and its iterations removes, m, where there is one."""
        return {each.engine: each.model for each in self.splits if each.model is not None and math.isfinite(each.model)}

    def answers(self) -> list[str]:
        """Return the sentences that people come for."""
        ran = [point for point in self.points if point.status == "ok"]
        if ran and all(point.error is None for point in ran):
            return [f"{self.metric.name} says nothing of this scene; another --metric would"]
        unit = self.metric.unit
        wanted = f"with {self.metric.name} within {figure(self.tolerance, unit)}"
        lines = [
            f"cheapest setting {wanted}: {self.within_tolerance.sentence}"
            if self.within_tolerance is not None
            else f"cheapest setting {wanted}: none of the {len(self.points)} that were tried"
        ]
        if self.budget is not None:
            most = f"within {self.budget:g} ms a frame, at {self.fps:g} frames a second"
            lines.append(
                f"best setting {most}: {self.within_budget.sentence}"
                if self.within_budget is not None
                else f"best setting {most}: none of the {len(self.points)} that were tried"
            )
        return lines

    def document(self, scene: str | None = None) -> dict[str, Any]:
        """Return the trade-off as one JSON document.

        Args:
            scene: what the scene is called in it, such as its path; else its title.
        """
        return {
            "scene": self.scene.title if scene is None else scene,
            "title": self.scene.title,
            "truth": self.truth,
            "truth_about": None if self.best is None else self.best.about,
            "trusted_until": None if self.best is None else self.best.trusted_until,
            "duration": self.scene.world.duration,
            "metric": self.metric.name,
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
            "within_tolerance": None if self.within_tolerance is None else self.within_tolerance.document(),
            "within_budget": None if self.within_budget is None else self.within_budget.document(),
            "answers": self.answers(),
            "untried": self.untried,
            "interrupted": self.interrupted,
            "machine": dict(self.machine),
            "versions": dict(self.versions),
        }
