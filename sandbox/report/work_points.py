"""Work points: the points of a trade-off's document, grouped into methods, for plots of error against cost."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

Document = Mapping[str, Any]
"""What `sandbox tradeoff --json` prints."""

CHOICES = ("integrator", "detection", "response", "joints", "iterations", "broad_phase", "half_kick")
"""Settings by which methods differ; along one method's curve dt and substeps change."""
SPLIT = "max_position"
"""The metric that floors are of."""
SMALLEST = 1e-16
"""Errors below it, such as 0, are drawn there."""


@dataclass(frozen=True)
class WorkPoint:
    """One setting of one engine. What is unknown is None."""

    number: int
    """its place in the document"""
    engine: str
    method: str
    """what it chooses otherwise than the first of its engine, besides the step; empty where nothing"""
    step: float
    """dt / substeps, s"""
    settings: Mapping[str, Any]
    status: str
    reason: str | None
    error: float | None
    cost: float | None
    """ms per simulated second"""
    document: Document

    @property
    def whole(self) -> bool:
        """Whether it has a place among the axes."""
        return self.status == "ok" and self.error is not None and self.cost is not None and self.cost > 0.0

    @property
    def place(self) -> tuple[float, float]:
        """Cost and error as axes show them, of one that is whole."""
        assert self.cost is not None
        assert self.error is not None
        return self.cost, shown_error(self.error)


def work_points(document: Document) -> list[WorkPoint]:
    """Return the points of a document, each with its method: the choices that differ from its engine's first point."""
    first: dict[str, Document] = {}
    for row in document["points"]:
        first.setdefault(row["engine"], row["settings"])
    return [_point(k, row, first[row["engine"]]) for k, row in enumerate(document["points"])]


def methods(points: Sequence[WorkPoint]) -> dict[tuple[str, str], list[WorkPoint]]:
    """Return the points that have a place among the axes by engine and method, each by falling step."""
    found: dict[tuple[str, str], list[WorkPoint]] = {}
    for point in points:
        if point.whole:
            found.setdefault((point.engine, point.method), []).append(point)
    return {key: sorted(found[key], key=lambda point: -point.step) for key in sorted(found, key=lambda each: each[0])}


def pareto_of(document: Document, points: Sequence[WorkPoint]) -> list[WorkPoint]:
    """Return the points of the Pareto front by rising cost."""
    front = [point for row in document["pareto"] if (point := same(points, row)) is not None and point.whole]
    return sorted(front, key=lambda point: (point.cost or 0.0, -(point.error or 0.0)))


def same(points: Sequence[WorkPoint], row: Document | None) -> WorkPoint | None:
    """Return which point a row of the document repeats."""
    if row is None:
        return None
    return next((p for p in points if p.engine == row["engine"] and p.settings == row["settings"]), None)


def shown_error(error: float) -> float:
    """Return an error as a logarithmic axis can show it."""
    return max(error, SMALLEST)


def errors_of(document: Document, points: Sequence[WorkPoint]) -> list[float]:
    """Return every positive error that a plot holds: of points, floors and the tolerance."""
    values = [point.error for point in points if point.whole]
    values += list(floors_of(document).values())
    values.append(document.get("tolerance"))
    return [shown_error(value) for value in values if value is not None and math.isfinite(value)]


def costs_of(document: Document, points: Sequence[WorkPoint]) -> list[float]:
    """Return every positive cost that a plot holds: of points and the budget."""
    values = [*(point.cost for point in points), budget_of(document)]
    return [value for value in values if value is not None and 0.0 < value < math.inf]


def floors_of(document: Document) -> dict[str, float]:
    """Return the error of each engine that no step removes; they are of positions, and drawn where these are."""
    if document["metric"] != SPLIT:
        return {}
    return {engine: float(floor) for engine, floor in (document.get("floors") or {}).items() if floor is not None}


def budget_of(document: Document) -> float | None:
    """Return the budget, ms per simulated second; a document has it a frame."""
    budget = document.get("budget")
    return None if budget is None else float(budget) * float(document.get("fps") or 1.0)


def is_longer_than_frame(point: WorkPoint, document: Document) -> bool:
    """Tell whether a point's dt is longer than a frame, so that it is not recommended."""
    longest = document.get("max_dt")
    return longest is not None and float(point.settings.get("dt", point.step)) > float(longest)


def frame_time(point: WorkPoint, document: Document) -> float | None:
    """Return the computing time of a point's most expensive frame, ms; None where the cost is unknown.

    It is the median of the repeats; if dt is longer than a frame, it is the time of one step.
    """
    cost = point.document.get("cost_median_ms_per_second")
    fps = document.get("fps")
    if cost is None or not fps:
        return None
    return float(cost) * max(1.0 / float(fps), float(point.settings.get("dt", point.step)))


def told(point: WorkPoint, metric: str, unit: str) -> Iterator[str]:
    """Yield lines that say what a point is."""
    yield f"{point.engine}{', ' if point.method else ''}{point.method}"
    substeps = point.settings.get("substeps", 1)
    noun = "substep" if substeps == 1 else "substeps"
    yield f"dt {point.settings.get('dt', point.step):.4g} s, {substeps} {noun}"
    if point.error is not None:
        yield f"{metric.replace('_', ' ')} {point.error:.3g} {unit}".rstrip()
    if point.cost is not None:
        yield f"{point.cost:.3g} ms per simulated second"
    if point.status != "ok":
        yield f"{point.status}: {point.reason or 'no reason given'}"


def _point(number: int, row: Document, plain: Document) -> WorkPoint:
    settings = row["settings"]
    words = []
    for key in CHOICES:
        value = settings.get(key)
        if value is None or value is False or value == plain.get(key):
            continue
        if key == "iterations":
            words.append(f"{value} iteration{'' if value == 1 else 's'}")
        else:
            words.append(key if value is True else str(value))
    return WorkPoint(
        number=number,
        engine=row["engine"],
        method=", ".join(words).replace("_", " "),
        step=float(settings["dt"]) / int(settings.get("substeps") or 1),
        settings=settings,
        status=row["status"],
        reason=row.get("reason"),
        error=row["error"],
        cost=row["cost_ms_per_second"],
        document=row,
    )
