"""Work–precision: error against cost as a picture, with the Pareto front, floors, and failures at the edges."""

from operator import itemgetter
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogFormatter

from sandbox.measure.tradeoff.front import pareto
from sandbox.report.colours import colour_of
from sandbox.report.figure_file import write_figure
from sandbox.report.panels import FAINT, INK, add_legend, literal, shortened
from sandbox.report.work_points import (
    Document,
    WorkPoint,
    budget_of,
    costs_of,
    errors_of,
    floors_of,
    methods,
    pareto_of,
    shown_error,
    work_points,
)

MARKS = "osD^vP*X<>"
"""One a method of an engine."""
MOST_METHODS = 12
"""From here on the legend names engines only."""
EDGE = 2.2
"""Failures lie beyond all other points by this factor."""
FRONT: dict[str, Any] = {"color": INK, "lw": 3.0, "alpha": 0.85, "zorder": 1.5, "marker": "o", "ms": 11, "mfc": "none"}
"""A ring around each point, so that a front of one point is seen too."""
BOUND: dict[str, Any] = {"color": FAINT, "lw": 1.1, "ls": (0, (1.5, 2.5))}
FLOOR: dict[str, Any] = {"lw": 1.3, "ls": (0, (6, 4))}


class MinorCosts(LogFormatter):
    """Labels of minor ticks as plain numbers, left out where the axis spans so many decades that they would collide."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the label of a tick."""
        return f"{x:g}" if super().__call__(x, pos) else ""


def plot_tradeoff(document: Document, path: str | Path) -> Path:
    """Draw a trade-off's document into a file, `.png`, `.svg` or `.pdf`; written to a temporary name first.

    Raises:
        OSError: the file cannot be written.
        KeyError: the suffix is none of those.
    """
    return write_figure(draw_tradeoff(document), Path(path))


def draw_tradeoff(document: Document) -> Figure:
    """Return error against milliseconds per simulated second, log–log: a line through the best settings of each method.

    The Pareto front of all methods is bold.
    A dashed line is the error that an engine cannot go below however small its step. Failures are crosses: at the top
    where only their error is unknown, at the right where their cost is.
    """
    points = work_points(document)
    figure = Figure(figsize=(9.0, 6.4), facecolor="white", layout="constrained")
    panel = figure.subplots()
    panel.set(xscale="log", yscale="log", xlabel="ms per simulated second")
    panel.xaxis.set_major_formatter("{x:g}")  # costs span a few decades: 20 reads better than 2 × 10¹
    panel.xaxis.set_minor_formatter(MinorCosts())
    name, unit = document["metric"].replace("_", " "), document.get("unit") or ""
    panel.set_ylabel(f"{name}, {unit}" if unit else name)
    entries: list[tuple[str, Line2D]] = []
    marks: dict[str, int] = {}
    for (engine, method), mine in methods(points).items():
        mark = MARKS[marks.setdefault(engine, 0) % len(MARKS)]
        marks[engine] += 1
        colour = colour_of(engine)
        x, y = zip(*(point.place for point in mine), strict=True)
        best = pareto((point.place for point in mine), itemgetter(0), itemgetter(1))
        panel.plot(*zip(*best, strict=True), color=colour, lw=0.9, alpha=0.45)
        panel.plot(x, y, color=colour, lw=0, marker=mark, ms=6.5, mec="white", mew=0.6, zorder=3)
        label = f"{engine}: {method}" if method else engine
        entries.append((label, Line2D([], [], color=colour, marker=mark, lw=0.9, ms=6.5)))
    if len(entries) > MOST_METHODS:  # a legend of all would leave the plot no room
        entries = [
            (f"{engine}: {count} methods", Line2D([], [], color=colour_of(engine), marker="o", lw=0.9, ms=6.5))
            for engine, count in marks.items()
        ]
    front = pareto_of(document, points)
    if front:
        panel.plot(*zip(*(point.place for point in front), strict=True), **FRONT)
        entries.append(("Pareto front", Line2D([], [], **FRONT)))
    for engine, floor in floors_of(document).items():
        panel.axhline(shown_error(floor), color=colour_of(engine), **FLOOR)
        entries.append((f"{engine}: error limit at any step", Line2D([], [], color=colour_of(engine), **FLOOR)))
    tolerance, budget = document.get("tolerance"), budget_of(document)
    if tolerance:
        panel.axhline(tolerance, **BOUND)
        entries.append((f"tolerance {tolerance:.3g} {unit}", Line2D([], [], **BOUND)))
    if budget:
        panel.axvline(budget, **BOUND)
        entries.append((f"budget {budget:.3g} ms per s", Line2D([], [], **BOUND)))
    _draw_failures(figure, document, points, entries)
    panel.grid(color="#e4e4e4", lw=0.6)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)
    heading = shortened(document.get("title") or "untitled scene", 60)
    literal(figure.suptitle(heading, x=0.01, ha="left", fontsize=16, weight="bold", color=INK))
    if entries:
        add_legend(figure, entries, most=56, loc="outside lower center", ncols=2)
    return figure


def _draw_failures(
    figure: Figure, document: Document, points: list[WorkPoint], entries: list[tuple[str, Line2D]]
) -> None:
    """Draw failures as crosses beyond the others."""
    panel = figure.axes[0]
    costs, errors = costs_of(document, points) or [1.0], errors_of(document, points) or [1.0]
    right, top = EDGE * max(costs), EDGE * max(errors)
    failed = [point for point in points if not point.whole]
    for point in failed:
        x = right if point.cost is None or not point.cost > 0.0 else point.cost
        y = top if point.error is None or point.status != "ok" else shown_error(point.error)
        panel.plot([x], [y], color=colour_of(point.engine), marker="x", ms=7.5, mew=1.8, lw=0, clip_on=False, zorder=4)
    if failed:
        entries.append((f"failed ({len(failed)})", Line2D([], [], color=INK, marker="x", lw=0, ms=7.5, mew=1.8)))
