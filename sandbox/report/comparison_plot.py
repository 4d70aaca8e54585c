"""Plots of a comparison: trajectories on top of each other, errors and energies against time."""

import math
from collections.abc import Iterator, Mapping
from itertools import chain, repeat
from pathlib import Path
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sandbox.arrays import FloatArray
from sandbox.columns import TRUTH
from sandbox.formatting import format_number
from sandbox.measure.compare import Comparison
from sandbox.measure.compare.result import set_text
from sandbox.measure.metrics.energy import energies
from sandbox.measure.metrics.trajectory_error import Errors, common_frames, errors
from sandbox.report.colours import COLOURS, colour_index
from sandbox.report.run_plot import MAX_BODIES, draw_fixed, draw_path, draw_truth, moving_axes
from sandbox.report.style import (
    BEYOND,
    CHART_POINTS,
    CLOSED,
    FAINT,
    INK,
    MAX_POINTS,
    SHADED,
    add_legend,
    chart_figure,
    draw,
    draw_closed,
    dress,
    finish_chart,
    literal,
    shortened,
    style_axes,
    write_figure,
)

FLOOR = 1e-16
"""Lower limit of a logarithmic axis; smaller values, such as 0, are drawn at its floor."""
WIDTHS = (4.6, 3.4, 2.4, 1.4)
"""Points: the line of each engine is narrower than the one below it, so that all are visible where they agree."""
LOG_WIDTH = 0.7
"""Ratio of these widths on a logarithmic axis."""
OPACITY = 0.9
PALE_OPACITY = 0.25
"""Opacities of curves up to `trusted_until` and beyond it."""
UNTRUSTED_BACKGROUND: dict[str, Any] = {"color": SHADED, "zorder": 0.1, "lw": 0}
"""Background of the time beyond `trusted_until`."""
TOLERANCE_LINE: dict[str, Any] = {"color": FAINT, "lw": 1.0, "ls": ":"}
"""Line of the tolerance."""
NOTE_CLASS = "css:note"
"""Class in pages of a text over curves, which gets an outline in the colour of the background."""
CHARACTERS_PER_INCH, HANDLE_WIDTH = 11.5, 7
"""Average characters of a legend per inch at its size of 10 points, and the width of a line beside its label"""
LEGEND_LAYOUT: dict[str, Any] = {"loc": "outside lower center"}
MAX_REACH = 2.0
"""Largest extent of the energy axis beyond the energies of the truth, for diverging engines, in ranges of the truth."""


class ChartDetail(NamedTuple):
    """Detail with which curves are drawn."""

    width: float
    """ratio of the line widths to `WIDTHS`"""
    max_points: int


FILE, CHART = ChartDetail(1.0, MAX_POINTS), ChartDetail(0.6, CHART_POINTS)
"""Detail of figures in files, and of the smaller charts of pages."""


def plot_comparison(comparison: Comparison, folder: str | Path) -> tuple[Path, ...]:
    """Write `trajectories.png`, `error.png` and `energy.png` into a folder, each to a temporary name first.

    Raises:
        OSError: a file cannot be written.
    """
    figures = {
        "trajectories": draw_trajectories(comparison),
        "error": draw_error(comparison),
        "energy": draw_energy(comparison),
    }
    return tuple(write_figure(figure, Path(folder) / f"{name}.png") for name, figure in figures.items())


def draw_trajectories(comparison: Comparison) -> Figure:
    """Return the paths of the first moving bodies, each engine in its colour, with the truth dashed on top.

    If the bodies move along one axis only, their position on it is drawn against time.
    """
    scene = comparison.scene
    numbers = np.flatnonzero(~scene.bodies.fixed)[:MAX_BODIES].tolist()
    axes = moving_axes(comparison.trajectories.values(), numbers)
    figure = Figure(figsize=(8.0, 6.0), facecolor="white")
    panel = figure.subplots()
    truth = comparison.best
    for (name, index), width in zip(_drawn_indices(comparison).items(), _widths(comparison), strict=False):
        run = comparison.trajectories[name]
        for number in numbers:
            draw_path(panel, run, number, axes, COLOURS[index], comparison.trusted_until)
            for line, opacity in zip(panel.lines[-2:], (OPACITY, PALE_OPACITY), strict=True):
                line.set(linewidth=width, alpha=opacity)
    if truth is not None:
        for number in numbers:
            draw_truth(panel, truth.trajectory, number, axes, truth.trusted_until)
    if len(axes) == 1:
        panel.set(xlabel="time, s", ylabel=f"position {'xy'[axes[0]]}, m")
        _shade(panel, comparison)
        dress(panel)
    else:
        panel.set(xlabel="position x, m", ylabel="position y, m")
        dress(panel)
        panel.set_aspect("equal", adjustable="datalim")
        draw_fixed(panel, scene)
    if len(numbers) > 1:
        for number in numbers:
            x, y = scene.bodies.position[number].tolist()
            label_position = (0.0, (x, y)[axes[0]]) if len(axes) == 1 else (x, y)
            text = panel.annotate(
                shortened(scene.bodies.names[number], 16),
                label_position,
                (4, 4),
                textcoords="offset points",
                fontsize=9,
            )
            literal(text)
    moving = int((~scene.bodies.fixed).sum())
    more = f"the first {len(numbers)} of {moving:,} bodies" if moving > len(numbers) else ""
    if comparison.trusted_until is not None and comparison.trusted_until < scene.world.duration:
        more = f"{more}; pale where the truth is not trusted".removeprefix("; ")
    _finish(figure, comparison, "trajectories", more)
    return figure


def draw_error(comparison: Comparison) -> Figure:
    """Return the largest position and velocity error of any body against time, on logarithmic axes."""
    figure = Figure(figsize=(8.0, 7.0), facecolor="white")
    panels = figure.subplots(2, 1, sharex=True)
    found = _errors(comparison)
    for panel, quantity, unit in zip(panels, ("position", "velocity"), ("m", "m/s"), strict=True):
        curves = {name: (each.time, each.by_quantity[quantity].largest) for name, each in found.items()}
        floor = _draw_log(panel, comparison, curves, comparison.tolerance if quantity == "position" else None)
        panel.set_ylabel(f"largest {quantity} error, {unit}\n(0 drawn at {floor:.0e})")
    panels[1].set_xlabel("time, s")
    for panel in panels:
        _shade(panel, comparison)
    extra = [(f"tolerance {comparison.tolerance:.2g} m", Line2D([], [], **TOLERANCE_LINE))]
    _finish(figure, comparison, "error against the truth", "", extra, truth=False)
    return figure


def error_chart(comparison: Comparison) -> Figure:
    """Return the largest position error of any body against time, as a chart for a page."""
    figure, panel = chart_figure()
    curves = {name: (each.time, each.position) for name, each in _errors(comparison).items()}
    _draw_log(panel, comparison, curves, comparison.tolerance, CHART)
    text = f"tolerance {format_number(comparison.tolerance, 2)} m"
    layout: dict[str, Any] = {"xytext": (4, 3), "textcoords": "offset points", "fontsize": 8}
    panel.annotate(text, (0.0, comparison.tolerance), color=FAINT, gid=NOTE_CLASS, **layout)
    _shade(panel, comparison)
    _label_trust(panel, comparison)
    finish_chart(panel, "largest position error, m", comparison.scene.world.duration)
    return figure


def _errors(comparison: Comparison) -> dict[str, Errors]:
    """Return the errors over time of each run that has a truth."""
    moving = ~comparison.scene.bodies.fixed
    truths = {name: comparison.truth_of(name) for name in comparison.trajectories}
    return {
        name: errors(comparison.trajectories[name], truth.trajectory, moving)
        for name, truth in truths.items()
        if truth is not None
    }


def draw_energy(comparison: Comparison) -> Figure:
    """Return the total energy against time, and below it the difference from the truth, on a logarithmic axis.

    If the truth is not trusted to the end, the difference is that from the start.
    """
    figure = Figure(figsize=(8.0, 7.0), facecolor="white")
    upper, lower = figure.subplots(2, 1, sharex=True)
    scene, truth = comparison.scene, comparison.best
    is_complete = truth is not None and truth.trusted_until == scene.world.duration
    _draw_total_energy(upper, comparison)
    upper.set_ylabel("total energy, J")
    curves = {}
    for name, run in comparison.trajectories.items():
        total = energies(run, scene).total
        frames, difference = np.arange(len(total)), total - total[0]
        row_truth = comparison.truth_of(name)
        if is_complete and row_truth is not None:
            frames, own_frames = common_frames(run, row_truth.trajectory)
            difference = total[frames] - energies(row_truth.trajectory, scene).total[own_frames]
        curves[name] = run.time[frames], np.abs(difference)
    floor = _draw_log(lower, comparison, curves)
    reference = "the truth" if is_complete else "the start"
    lower.set_ylabel(f"energy, difference from {reference}, J\n(0 drawn at {floor:.0e})")
    lower.set_xlabel("time, s")
    _shade(lower, comparison)
    _finish(figure, comparison, "energy")
    return figure


def energy_chart(comparison: Comparison) -> Figure:
    """Return the total energy of each engine against time, as a chart for a page."""
    figure, panel = chart_figure()
    _draw_total_energy(panel, comparison, CHART)
    _label_trust(panel, comparison)
    finish_chart(panel, "total energy, J", comparison.scene.world.duration)
    return figure


def _draw_total_energy(panel: Axes, comparison: Comparison, detail: ChartDetail = FILE) -> None:
    """Draw the total energy of each engine and of the truth, on an axis that holds the truth."""
    scene, truth = comparison.scene, comparison.best
    totals = {name: energies(run, scene).total for name, run in comparison.trajectories.items()}
    for k, ((name, index), width) in enumerate(
        zip(_drawn_indices(comparison).items(), _widths(comparison, detail.width), strict=False)
    ):
        run, style = comparison.trajectories[name], {"lw": width, "alpha": OPACITY, "gid": _line_class(index, k)}
        draw(panel, run.time, totals[name], COLOURS[index], detail.max_points, **style)
    true_energy = None
    if truth is not None:
        run = truth.trajectory
        true_energy, is_trusted = energies(run, scene).total, run.time <= truth.trusted_until
        draw_closed(panel, run.time, true_energy, is_trusted, detail.max_points)
        panel.lines[-1].set_gid("css:line truth")
        true_energy = true_energy[is_trusted]
    limits = _energy_limits(totals, true_energy)
    dress(panel, limits)
    _shade(panel, comparison)
    beyond = [max(abs(values[np.isfinite(values)]), default=0.0) for values in totals.values()]
    if limits is not None and max(beyond, default=0.0) > max(map(abs, limits)):
        note = f"cut off: up to {max(beyond):.3g} J"
        layout: dict[str, Any] = {
            "xycoords": "axes fraction",
            "ha": "right",
            "va": "top",
            "fontsize": 8,
            "color": FAINT,
        }
        panel.annotate(note, (0.995, 0.985), gid=NOTE_CLASS, **layout)


def _energy_limits(totals: Mapping[str, FloatArray], true_energy: FloatArray | None) -> tuple[float, float] | None:
    """Return the lowest and highest energy to show, J: those of the truth, and of engines as far as `MAX_REACH` allows.

    Without a truth the energies at the start take its place. None without finite energies.
    """
    finite = [values[np.abs(values) < BEYOND] for values in totals.values()]
    known = [values for values in finite if len(values)]
    true_energy = None if true_energy is None else true_energy[np.abs(true_energy) < BEYOND]
    if true_energy is None or not len(true_energy):
        true_energy = np.asarray([values[0] for values in known])
    if not len(true_energy):
        return None
    low, high = float(true_energy.min()), float(true_energy.max())
    reach = MAX_REACH * max(high - low, 0.1 * max(abs(low), abs(high)))
    if low == high == 0.0:
        reach = math.inf  # there is no scale of the energies
    lows = [max(float(values.min()), low - reach) for values in known]
    highs = [min(float(values.max()), high + reach) for values in known]
    return min([low, *lows]), max([high, *highs])


def colour_indices(comparison: Comparison) -> dict[str, int]:
    """Return the index in `COLOURS` of each row, by its name; in a sweep the index of the row, else of its engine."""
    is_swept = any(row.set for row in comparison.rows)
    return {
        row.name: k % len(COLOURS) if is_swept else colour_index(row.engine) for k, row in enumerate(comparison.rows)
    }


def _drawn_indices(comparison: Comparison) -> dict[str, int]:
    """Return the index in `COLOURS` of each row that has a run, in the order in which runs are drawn."""
    indices = colour_indices(comparison)
    return {name: indices[name] for name in comparison.trajectories}


def _line_class(colour: int, run: int) -> str:
    """Return the class in a page of the curve of a run: more than six runs share colours, but not numbers."""
    return f"css:line e{colour} run{run}"


def _labels(comparison: Comparison) -> dict[str, str]:
    """Return the label of each row by its name: without the engine if all rows have the same one.

    A run that is the truth itself, whose errors are 0, is marked.
    """
    has_engines = len({row.engine for row in comparison.rows}) > 1
    names = {row.name: row.name if has_engines or not row.set else set_text(row.set) for row in comparison.rows}
    return {row.name: f"{names[row.name]} ({TRUTH})" if row.is_truth else names[row.name] for row in comparison.rows}


def _widths(comparison: Comparison, scale: float = 1.0) -> Iterator[float]:
    """Return a line width for each engine that has a run, scaled; with few engines the widest one is not used."""
    unused = max(0, len(WIDTHS) - 1 - len(comparison.trajectories))
    return (scale * width for width in chain(WIDTHS[unused:], repeat(WIDTHS[-1])))


def _draw_log(
    panel: Axes,
    comparison: Comparison,
    curves: Mapping[str, tuple[FloatArray, FloatArray]],
    bound: float | None = None,
    detail: ChartDetail = FILE,
) -> float:
    """Draw values ≥ 0 of each engine on a logarithmic axis.

    Args:
        panel: panel to draw into.
        comparison: comparison of the engines.
        curves: times (K,), s, and values (K,) by the name of the row.
        bound: value of a dotted line, which the axis includes.
        detail: detail of the curves.

    Returns:
        The floor of the axis, at which 0 is drawn: a power of ten below the smallest positive value.
    """
    positive = [values[(values > 0.0) & (values < BEYOND)] for _, values in curves.values()]
    smallest = min((float(values.min()) for values in positive if len(values)), default=FLOOR)
    floor = max(FLOOR, 10.0 ** (math.floor(math.log10(smallest)) - 1))
    widths = _widths(comparison, LOG_WIDTH * detail.width)
    for k, ((name, index), width) in enumerate(zip(_drawn_indices(comparison).items(), widths, strict=False)):
        if name in curves:
            time, values = curves[name]
            shown = np.where(np.isfinite(values), np.maximum(values, floor), np.nan)
            style: dict[str, Any] = {"lw": width, "alpha": OPACITY, "gid": _line_class(index, k)}
            draw(panel, time, shown, COLOURS[index], detail.max_points, **style)
    if bound is not None:
        panel.axhline(bound, **TOLERANCE_LINE)
    style_axes(panel)
    panel.set_yscale("log")
    low, high = panel.get_ylim()
    panel.set_ylim(low, max(high, 1e3 * low))
    return floor


def _label_trust(panel: Axes, comparison: Comparison) -> None:
    """Label the end of the trusted time."""
    until, duration = comparison.trusted_until, comparison.scene.world.duration
    if until is None or until >= duration:
        return
    is_late = until > 0.6 * duration  # then there is more space on its left
    layout: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "textcoords": "offset points", "fontsize": 8}
    layout |= {
        "xytext": (-4 if is_late else 4, 4),
        "ha": "right" if is_late else "left",
        "color": FAINT,
        "gid": NOTE_CLASS,
    }
    panel.annotate("trusted until here" if is_late else "truth no longer trusted", (until, 0.0), **layout)


def _shade(panel: Axes, comparison: Comparison) -> None:
    """Mark the end of the trusted time, and shade the time beyond it."""
    until = comparison.trusted_until
    if until is not None and until < comparison.scene.world.duration:
        panel.axvspan(until, comparison.scene.world.duration, **UNTRUSTED_BACKGROUND)
        panel.axvline(until, color=INK, lw=1.0)


def _finish(
    figure: Figure,
    comparison: Comparison,
    subject: str,
    more: str = "",
    extra: list[tuple[str, Line2D]] | None = None,
    truth: bool = True,
) -> None:
    """Add legend, title, and the sentence about the truth."""
    labels = _labels(comparison)
    entries = [
        (labels[name], Line2D([], [], color=COLOURS[index], lw=3.4, alpha=OPACITY))
        for name, index in _drawn_indices(comparison).items()
    ]
    best, duration = comparison.best, comparison.scene.world.duration
    if truth and best is not None:
        entries.append((f"truth: {best.kind.replace('_', ' ')}", Line2D([], [], **CLOSED)))
    entries += extra or []
    if best is not None and best.trusted_until < duration and "time, s" in (p.get_xlabel() for p in figure.axes):
        entries.append((f"trusted until {best.trusted_until:.3g} s", Line2D([], [], color=INK, lw=1.0)))
    width = max((len(shortened(label)) for label, _ in entries), default=0) + HANDLE_WIDTH
    columns = max(min(len(entries), 4, int(figure.get_figwidth() * CHARACTERS_PER_INCH) // width), 1)
    add_legend(figure, entries, ncols=columns, **LEGEND_LAYOUT)
    figure.align_ylabels()

    lines = wrap(comparison.sentence(), 105)[:3]
    if more:
        lines.append(more)
    height = figure.get_figheight()
    layout: dict[str, Any] = {"x": 0.1 / figure.get_figwidth(), "va": "top", "color": INK}
    title = shortened(f"{comparison.scene.title or 'untitled scene'}: {subject}", 60)
    literal(figure.text(y=1 - 0.10 / height, s=title, fontsize=16, weight="bold", **layout))
    literal(figure.text(y=1 - 0.44 / height, s="\n".join(lines), fontsize=9.5, linespacing=1.4, **layout))
    figure.set_layout_engine("constrained", rect=(0.0, 0.0, 1.0, 1 - (0.5 + 0.19 * len(lines)) / height))
