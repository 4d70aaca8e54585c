"""Work-precision diagram of a trade-off: error against cost."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogFormatter

from sandbox.columns import TRUTH
from sandbox.formatting import format_plural
from sandbox.measure.fresh_starts import MIN_QUANTILE_STARTS
from sandbox.measure.tradeoff.objective import pareto
from sandbox.report.colours import colour_of
from sandbox.report.style import FAINT, GRID, INK, add_legend, literal, shortened, write_figure

TradeoffMapping = Mapping[str, Any]
"""Document that `sandbox tradeoff --json` prints, or a part of it."""

CHOICES = ("integrator", "detection", "response", "joints", "iterations", "broad_phase", "half_kick")
"""Settings by which methods differ; along the curve of a method dt and substeps change."""
SMALLEST = 1e-16
"""Smaller errors are drawn at this value of the logarithmic axis."""


@dataclass(frozen=True)
class WorkPoint:
    """One configuration as the diagram needs it: a row of the document with its method. Unknown values are None."""

    index: int
    """position in the document"""
    engine: str
    method: str
    """settings other than the step that differ from the first row of its engine; empty if none does"""
    error: float | None
    cost: float | None
    """ms per simulated second"""
    row: TradeoffMapping
    floor: float = SMALLEST
    """error at which a smaller one, such as 0, is drawn"""

    @property
    def settings(self) -> Mapping[str, Any]:
        """Settings by name."""
        found: Mapping[str, Any] = self.row["settings"]
        return found

    @property
    def status(self) -> str:
        """`ok`, or the kind of failure of its run."""
        return str(self.row["status"])

    @property
    def substep(self) -> float:
        """Duration of a substep, s."""
        return float(self.settings["dt"]) / int(self.settings.get("substeps") or 1)

    @property
    def is_truth(self) -> bool:
        """Whether the error is 0 because the run is the truth itself."""
        return bool(self.row.get("is_truth"))  # documents of earlier versions lack it

    @property
    def is_timed(self) -> bool:
        """Whether its cost was timed in turns with others; otherwise it is an estimate from its counted work."""
        return bool(self.row.get("repeats"))

    @property
    def start_errors(self) -> tuple[float, float, float] | None:
        """Quantiles of the errors from fresh starts, 5, 50 and 95 %; None if they are unknown or infinite."""
        found = self.row.get("fresh_starts") or {}
        low, median, high = (found.get(key) for key in ("error_5", "median_error", "error_95"))
        return None if low is None or median is None or high is None else (low, median, high)

    @property
    def start_count(self) -> int:
        """Number of fresh starts from which its errors are known."""
        return int(((self.row.get("fresh_starts") or {}).get("held") or {}).get("trials") or 0)

    @property
    def is_drawable(self) -> bool:
        """Whether it has both an error and a cost."""
        return self.status == "ok" and self.error is not None and self.cost is not None and self.cost > 0.0

    @property
    def position(self) -> tuple[float, float]:
        """Cost and error as the axes show them, of a point that is drawable."""
        assert self.cost is not None
        assert self.error is not None
        return self.cost, self.shown_error

    @property
    def shown_error(self) -> float:
        """Error as a logarithmic axis can show it, of a point that has one."""
        assert self.error is not None
        return max(self.error, self.floor)


def work_points(document: TradeoffMapping) -> list[WorkPoint]:
    """Return the points of a document, each with its method."""
    first: dict[str, TradeoffMapping] = {}
    for row in document["points"]:
        first.setdefault(row["engine"], row["settings"])
    floor = _floor([*(row["error"] for row in document["points"]), document.get("tolerance")])
    return [
        WorkPoint(
            k,
            row["engine"],
            _method(row["settings"], first[row["engine"]]),
            row["error"],
            row["cost_ms_per_second"],
            row,
            floor,
        )
        for k, row in enumerate(document["points"])
    ]


def _floor(errors: Sequence[float | None]) -> float:
    """Return the error at which 0 is drawn: a power of ten below the smallest other error."""
    smallest = min((error for error in errors if error), default=1.0)
    return max(SMALLEST, 10.0 ** (math.floor(math.log10(smallest)) - 1))


def _method(settings: TradeoffMapping, first: TradeoffMapping) -> str:
    """Return the choices of settings that differ from those of the first row of the engine, as a text."""
    words = []
    for key in CHOICES:
        value = settings.get(key)
        if value is None or value is False or value == first.get(key):
            continue
        if key == "iterations":
            words.append(format_plural(value, "iteration"))
        else:
            words.append(key if value is True else str(value))
    return ", ".join(words).replace("_", " ")


def methods(points: Sequence[WorkPoint]) -> dict[tuple[str, str], list[WorkPoint]]:
    """Return the drawable points by engine and method, each by decreasing substep."""
    found: dict[tuple[str, str], list[WorkPoint]] = {}
    for point in points:
        if point.is_drawable:
            found.setdefault((point.engine, point.method), []).append(point)
    engines = sorted(found, key=itemgetter(0))
    return {key: sorted(found[key], key=lambda point: -point.substep) for key in engines}


def pareto_of(document: TradeoffMapping, points: Sequence[WorkPoint]) -> list[WorkPoint]:
    """Return the points of the Pareto front by increasing cost."""
    front = [point for row in document["pareto"] if (point := point_of(points, row)) is not None and point.is_drawable]
    return sorted(front, key=lambda point: (point.cost or 0.0, -(point.error or 0.0)))


def point_of(points: Sequence[WorkPoint], row: TradeoffMapping | None) -> WorkPoint | None:
    """Return the point that has the engine and settings of a row of the document."""
    if row is None:
        return None
    return next((p for p in points if p.engine == row["engine"] and p.settings == row["settings"]), None)


def budget_of(document: TradeoffMapping) -> float | None:
    """Return the budget, ms per simulated second; a document states it per frame."""
    budget = document.get("budget")
    return None if budget is None else float(budget) * float(document.get("fps") or 1.0)


def is_longer_than_frame(point: WorkPoint, document: TradeoffMapping) -> bool:
    """Return whether dt of a point is longer than a frame, so that the point is not recommended."""
    longest = document.get("max_dt")
    return longest is not None and float(point.settings["dt"]) > float(longest)


def frame_time(point: WorkPoint, document: TradeoffMapping) -> float | None:
    """Return the computing time of the most expensive frame of a point, ms; None if the cost is unknown.

    It is the median of the repeats; if dt is longer than a frame, it is the time of one step.
    """
    cost = point.row.get("cost_median_ms_per_second")
    fps = document.get("fps")
    if cost is None or not fps:
        return None
    return float(cost) * max(1.0 / float(fps), float(point.settings["dt"]))


def describe(point: WorkPoint, metric: str, unit: str) -> Iterator[str]:
    """Yield lines that describe a point: method, step, error, cost, failure."""
    yield f"{point.engine}{', ' if point.method else ''}{point.method}"
    yield f"dt {point.settings['dt']:.4g} s, {format_plural(point.settings.get('substeps', 1), 'substep')}"
    if point.error is not None:
        error = "0, the truth itself" if point.is_truth else f"{point.error:.3g} {unit}".rstrip()
        yield f"{metric.replace('_', ' ')} {error}"
    if point.cost is not None:
        yield f"{point.cost:.3g} ms per simulated second{'' if point.is_timed else ', not timed'}"
    if point.status != "ok":
        yield f"{point.status}: {point.row.get('reason') or 'no reason given'}"


MARKERS = "osD^vP*X<>"
"""One for each method of an engine."""
MAX_METHODS = 12
"""Up to this number of methods, the legend names each of them; otherwise engines only."""
FAILURE_DISTANCE = 2.2
"""Factor by which failures lie beyond all other points."""
FRONT: dict[str, Any] = {"color": INK, "lw": 3.0, "alpha": 0.85, "zorder": 1.5, "marker": "o", "ms": 11, "mfc": "none"}
"""A ring around each point, so that a front of one point is visible too."""
BOUND: dict[str, Any] = {"color": FAINT, "lw": 1.1, "ls": (0, (1.5, 2.5))}
MARGIN: dict[str, Any] = {**BOUND, "ls": (0, (5.0, 2.5))}
HOLLOW: dict[str, Any] = {"mfc": "white", "mew": 1.1, "ms": 5.5}
"""A point that was not timed."""
WHISKER: dict[str, Any] = {"lw": 1.6, "marker": "_", "ms": 7, "mew": 1.6, "zorder": 2.5}
"""Range of the errors of a point from fresh starts, below the point."""
LABEL_WIDTH, LABEL_HEIGHT = 0.1, 0.045
"""Space of the label of an order, as fractions of the panel."""
POINT = "point:"
"""Prefix of the gid of a point; its index follows."""


class MinorCosts(LogFormatter):
    """Labels of minor ticks as plain numbers, omitted where the axis spans so many decades that they would collide."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the label of a tick."""
        return f"{x:g}" if super().__call__(x, pos) else ""


def plot_tradeoff(document: TradeoffMapping, path: str | Path) -> Path:
    """Draw the diagram of a document into a file, `.png`, `.svg` or `.pdf`; written to a temporary name first.

    Raises:
        OSError: the file cannot be written.
        KeyError: the suffix is not one of these.
    """
    return write_figure(draw_tradeoff(document), Path(path))


def draw_tradeoff(document: TradeoffMapping, with_title: bool = True) -> Figure:
    """Return error against milliseconds per simulated second, log–log: a line through the best settings of each method.

    The Pareto front of all methods is bold. Settings that were not timed are hollow. A dashed line is the error limit
    of an engine, however small its step. Failures are crosses: at the top where only their error is unknown, at the
    right where their cost is.

    Args:
        document: document that `sandbox tradeoff --json` prints.
        with_title: with the title of the scene above the diagram.
    """
    points = work_points(document)
    figure = Figure(figsize=(9.0, 6.4), facecolor="white", layout="constrained")
    panel = figure.subplots()
    panel.set(xscale="log", yscale="log", xlabel="ms per simulated second")
    panel.xaxis.set_major_formatter("{x:g}")  # costs span a few decades: 20 reads better than 2 × 10¹
    panel.xaxis.set_minor_formatter(MinorCosts())
    name, unit = document["metric"].replace("_", " "), document.get("unit") or ""
    panel.set_ylabel(f"{name}, {unit}" if unit else name)
    entries = _draw_methods(panel, points)
    front = pareto_of(document, points)
    if front:
        panel.plot(*zip(*(point.position for point in front), strict=True), **FRONT)
        entries.append(("Pareto front", Line2D([], [], **FRONT)))
    timed = {point.is_timed for point in points if point.is_drawable}
    if False in timed:
        cost = "cost estimated from counted work" if True in timed else "time of the recorded run"
        entries.append((f"not timed: {cost}", Line2D([], [], color=INK, marker="o", lw=0, **HOLLOW)))
    _label_truth(panel, points)
    entries += _draw_start_errors(panel, points)
    entries += _draw_bounds(panel, document)
    _draw_failures(panel, points, document, entries)
    panel.autoscale_view()  # labels keep clear of each other on the panel as it will be
    _label_orders(panel, document, points)
    panel.grid(color=GRID, lw=0.6)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)
    if with_title:
        heading = shortened(document.get("title") or "untitled scene", 60)
        literal(figure.suptitle(heading, x=0.01, ha="left", fontsize=16, weight="bold", color=INK))
    if entries:
        add_legend(figure, entries, max_length=56, loc="outside lower center", ncols=2)
    return figure


def _draw_methods(panel: Axes, points: Sequence[WorkPoint]) -> list[tuple[str, Line2D]]:
    """Draw each method's points, and a line through the best of them; return the entries of the legend."""
    entries: list[tuple[str, Line2D]] = []
    counts: dict[str, int] = {}
    for (engine, method), method_points in methods(points).items():
        marker = MARKERS[counts.setdefault(engine, 0) % len(MARKERS)]
        counts[engine] += 1
        colour = colour_of(engine)
        best = pareto((point.position for point in method_points), itemgetter(0), itemgetter(1))
        panel.plot(*zip(*best, strict=True), color=colour, lw=0.9, alpha=0.45)
        style: dict[str, Any] = {"color": colour, "lw": 0, "marker": marker, "ms": 6.5, "mec": "white", "mew": 0.6}
        hollow = style | HOLLOW | {"mec": colour}
        for point in method_points:  # each is a separate line, so that a page can refer to it
            x, y = point.position
            panel.plot([x], [y], **(style if point.is_timed else hollow), zorder=3, gid=f"{POINT}{point.index}")
        label = f"{engine}: {method}" if method else engine
        entries.append((label, Line2D([], [], color=colour, marker=marker, lw=0.9, ms=6.5)))
    if len(entries) <= MAX_METHODS:
        return entries
    return [  # a legend of all methods would take the space of the plot
        (
            f"{engine}: {format_plural(count, 'method')}",
            Line2D([], [], color=colour_of(engine), marker="o", lw=0.9, ms=6.5),
        )
        for engine, count in counts.items()
    ]


def _label_truth(panel: Axes, points: Sequence[WorkPoint]) -> None:
    """Label the points whose error is 0 because their run is the truth, once for each engine, at the dearest."""
    own = {point.engine: point for point in sorted(points, key=lambda each: each.cost or 0.0) if point.is_truth}
    layout: dict[str, Any] = {"textcoords": "offset points", "va": "center", "fontsize": 10, "color": INK}
    for point in own.values():
        if point.is_drawable:
            panel.annotate(TRUTH, point.position, (9, 0), **layout)


def _label_orders(panel: Axes, document: TradeoffMapping, points: Sequence[WorkPoint]) -> None:
    """Label the lines of methods whose errors fall steadily with their order, where there is space.

    Methods with the most substeps come first.
    """
    placed: list[tuple[float, float]] = []
    for each in sorted(document.get("orders") or [], key=lambda found: -len(found["points"])):
        series = sorted((points[k] for k in each["points"] if points[k].is_drawable), key=lambda point: -point.substep)
        if len(series) < 2:
            continue
        x, y = (math.sqrt(a * b) for a, b in zip(*(point.position for point in series[-2:]), strict=True))
        left, bottom = panel.transAxes.inverted().transform(panel.transData.transform((x, y)))
        if any(abs(left - a) < LABEL_WIDTH and abs(bottom - b) < LABEL_HEIGHT for a, b in placed):
            continue
        placed.append((left, bottom))
        layout: dict[str, Any] = {"xytext": (-4, -4), "textcoords": "offset points", "ha": "right", "va": "top"}
        panel.annotate(f"order {each['order']:.1f}", (x, y), color=colour_of(each["engine"]), fontsize=9, **layout)


def _draw_start_errors(panel: Axes, points: Sequence[WorkPoint]) -> list[tuple[str, Line2D]]:
    """Draw the range of the errors from fresh starts of each point that has some; return the entry of the legend."""
    drawn = [point for point in points if point.is_drawable and not point.is_truth]
    ranges = [(point, each) for point in drawn if (each := point.start_errors) is not None]
    for point, (low, median, high) in ranges:
        x, colour = point.position[0], colour_of(point.engine)
        ends = [max(each, point.floor) for each in (low, high)]
        panel.plot([x, x], ends, color=colour, **WHISKER)
        panel.plot([x], [max(median, point.floor)], color=colour, **{**WHISKER, "ms": 5, "marker": "D", "mfc": "white"})
    if not ranges:
        return []
    are_quantiles = all(point.start_count >= MIN_QUANTILE_STARTS for point, _ in ranges)
    ends_text = "5 to 95 %" if are_quantiles else f"5 to 95 %, of fewer than {MIN_QUANTILE_STARTS} all"
    return [(f"fresh starts: {ends_text}, median", Line2D([], [], color=INK, **WHISKER))]


def _draw_bounds(panel: Axes, document: TradeoffMapping) -> list[tuple[str, Line2D]]:
    """Draw tolerance and budget; return the entries of the legend."""
    entries = []
    tolerance, budget = document.get("tolerance"), budget_of(document)
    if tolerance:
        panel.axhline(tolerance, **BOUND)
        entries.append((f"tolerance {tolerance:.3g} {document.get('unit') or ''}", Line2D([], [], **BOUND)))
    if tolerance and document.get("margin"):
        panel.axhline(document["max_error"], **MARGIN)
        entries.append((f"less a margin of {100.0 * document['margin']:.3g} %", Line2D([], [], **MARGIN)))
    if budget:
        panel.axvline(budget, **BOUND)
        entries.append((f"budget {budget:.3g} ms per s", Line2D([], [], **BOUND)))
    return entries


def _draw_failures(
    panel: Axes, points: Sequence[WorkPoint], document: TradeoffMapping, entries: list[tuple[str, Line2D]]
) -> None:
    """Draw failures as crosses beyond the other points, and add them to the legend."""
    failed = [point for point in points if not point.is_drawable]
    if not failed:
        return
    costs = [point.cost for point in points if point.cost is not None]
    errors = [point.position[1] for point in points if point.is_drawable]
    right = FAILURE_DISTANCE * (max((*costs, budget_of(document) or 0.0)) or 1.0)
    top = FAILURE_DISTANCE * (max((*errors, document.get("tolerance") or 0.0)) or 1.0)
    for point in failed:
        x = right if point.cost is None or not point.cost > 0.0 else point.cost
        y = top if point.error is None or point.status != "ok" else point.shown_error
        style: dict[str, Any] = {"marker": "x", "ms": 7.5, "mew": 1.8, "lw": 0, "clip_on": False, "zorder": 4}
        panel.plot([x], [y], color=colour_of(point.engine), **style, gid=f"{POINT}{point.index}")
    entries.append((f"failed ({len(failed)})", Line2D([], [], color=INK, marker="x", lw=0, ms=7.5, mew=1.8)))
