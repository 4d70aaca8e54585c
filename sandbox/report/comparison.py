"""Plots of a comparison: trajectories over each other, errors and energies against time."""

import math
from collections.abc import Iterator
from itertools import chain, repeat
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sandbox.arrays import FloatArray
from sandbox.measure.compare import Comparison
from sandbox.measure.compare.errors import Errors, errors
from sandbox.measure.compare.runs import common_frames
from sandbox.measure.energy import energies
from sandbox.report.colours import COLOURS, colour_of
from sandbox.report.figure_file import write_figure
from sandbox.report.panels import (
    BEYOND,
    CLOSED,
    FAINT,
    INK,
    add_legend,
    draw,
    draw_closed,
    dress,
    literal,
    shortened,
)
from sandbox.report.paths import draw_fixed, draw_path, draw_truth, moving_axes
from sandbox.report.plots import MOST_BODIES

FLOOR = 1e-16
"""The lowest that a logarithmic axis reaches; what is smaller, such as 0, is drawn at its floor."""
WIDTHS = (7.0, 4.4, 2.6, 1.6)
"""Points: each engine's line is narrower than that of the one before, so that all show where they agree."""
THINNER = 0.7
"""of these widths, for lines on a logarithmic axis"""
OPAQUE = 0.9
PALE = 0.25
"""Opacity beyond `trusted_until`."""
DISTRUSTED: dict[str, Any] = {"color": "#efefef", "zorder": 0.1, "lw": 0}
"""The time beyond `trusted_until`."""
LEGEND: dict[str, Any] = {"loc": "outside lower center"}


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
    """Return the paths of the first bodies that move, each engine's in its colour, the truth dashed over them.

    Where something moves along one axis only, that is drawn against time.
    """
    scene = comparison.scene
    numbers = np.flatnonzero(~scene.bodies.fixed)[:MOST_BODIES].tolist()
    axes = moving_axes(comparison.trajectories.values(), numbers)
    figure = Figure(figsize=(8.0, 6.0), facecolor="white")
    panel = figure.subplots()
    truth = comparison.best
    for (name, colour), width in zip(_colours(comparison).items(), _widths(comparison), strict=False):
        run = comparison.trajectories[name]
        for number in numbers:
            draw_path(panel, run, number, axes, colour, comparison.trusted_until)
            for line, opacity in zip(panel.lines[-2:], (OPAQUE, PALE), strict=True):
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
            place = (0.0, (x, y)[axes[0]]) if len(axes) == 1 else (x, y)
            text = panel.annotate(
                shortened(scene.bodies.names[number], 16), place, (4, 4), textcoords="offset points", fontsize=9
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
    found: dict[str, Errors] = {}
    moving = ~comparison.scene.bodies.fixed
    for name, run in comparison.trajectories.items():
        truth = comparison.truth_of(name)
        if truth is not None:
            found[name] = errors(run, truth.trajectory, moving)
    for panel, what, unit in zip(panels, ("position", "velocity"), ("m", "m/s"), strict=True):
        curves = {name: (each.time, getattr(each, what)) for name, each in found.items()}
        _draw_log(panel, comparison, curves, f"largest {what} error, {unit}")
    panels[0].axhline(comparison.tolerance, color=FAINT, lw=1.0, ls=":")
    panels[1].set_xlabel("time, s")
    for panel in panels:
        _shade(panel, comparison)
    extra = [(f"tolerance {comparison.tolerance:.2g} m", Line2D([], [], color=FAINT, lw=1.0, ls=":"))]
    _finish(figure, comparison, "error against the truth", "", extra, truth=False)
    return figure


def draw_energy(comparison: Comparison) -> Figure:
    """Return the total energy against time, and below its difference from the truth's, on a logarithmic axis.

    Where the truth is not trusted to the end, the difference is that from the start.
    """
    figure = Figure(figsize=(8.0, 7.0), facecolor="white")
    upper, lower = figure.subplots(2, 1, sharex=True)
    scene, truth = comparison.scene, comparison.best
    right = None if truth is None else energies(truth.trajectory, scene).total
    whole = truth is not None and truth.trusted_until == scene.world.duration
    against = "the truth" if whole else "the start"
    upper.set_ylabel("total energy, J")
    lower.set_xlabel("time, s")
    curves = {}
    for (name, colour), width in zip(_colours(comparison).items(), _widths(comparison), strict=False):
        run = comparison.trajectories[name]
        total = energies(run, scene).total
        draw(upper, run.time, total, colour)
        upper.lines[-1].set(linewidth=width, alpha=OPAQUE)
        mine, away = np.arange(len(total)), total - total[0]
        own = comparison.truth_of(name)
        if whole and own is not None:
            its_energy = right if own is truth and right is not None else energies(own.trajectory, scene).total
            mine, its = common_frames(run, own.trajectory)
            away = total[mine] - its_energy[its]
        curves[name] = run.time[mine], np.abs(away)
    _draw_log(lower, comparison, curves, f"energy, difference from {against}, J")
    if truth is not None and right is not None:
        draw_closed(upper, truth.trajectory.time, right, truth.trajectory.time <= truth.trusted_until)
    for panel in (upper, lower):
        _shade(panel, comparison)
    dress(upper)
    _finish(figure, comparison, "energy")
    return figure


def _colours(comparison: Comparison) -> dict[str, str]:
    """Return a colour for each row that has a run: its engine's, or of a sweep its own."""
    swept = any(row.set for row in comparison.rows)
    names = enumerate(comparison.trajectories)
    return {name: COLOURS[k % len(COLOURS)] if swept else colour_of(name) for k, name in names}


def _widths(comparison: Comparison) -> Iterator[float]:
    """Return a width for each engine that has a run; few need no wide ones."""
    few = max(0, len(WIDTHS) - 1 - len(comparison.trajectories))
    return chain(WIDTHS[few:], repeat(WIDTHS[-1]))


def _draw_log(
    panel: Axes, comparison: Comparison, curves: dict[str, tuple[FloatArray, FloatArray]], label: str
) -> None:
    """Draw values ≥ 0 of each engine on a logarithmic axis, whose floor is a power of ten below the smallest."""
    positive = [values[(values > 0.0) & (values < BEYOND)] for _, values in curves.values()]
    least = min((float(values.min()) for values in positive if len(values)), default=FLOOR)
    floor = max(FLOOR, 10.0 ** (math.floor(math.log10(least)) - 1))
    panel.set_ylabel(f"{label}\n(0 drawn at {floor:.0e})")
    for (name, colour), width in zip(_colours(comparison).items(), _widths(comparison), strict=False):
        if name in curves:
            time, values = curves[name]
            draw(panel, time, np.where(np.isfinite(values), np.maximum(values, floor), np.nan), colour)
            panel.lines[-1].set(linewidth=THINNER * width, alpha=OPAQUE)
    _dress_log(panel)


def _shade(panel: Axes, comparison: Comparison) -> None:
    """Mark where the truth ends, and shade what lies beyond."""
    until = comparison.trusted_until
    if until is not None and until < comparison.scene.world.duration:
        panel.axvspan(until, comparison.scene.world.duration, **DISTRUSTED)
        panel.axvline(until, color=INK, lw=1.0)


def _dress_log(panel: Axes) -> None:
    """Finish a panel whose values span many powers of ten."""
    panel.spines[["top", "right"]].set_visible(False)
    panel.grid(color="#e4e4e4", lw=0.6)
    panel.set_axisbelow(True)
    panel.tick_params(labelsize=10, colors=INK)
    for label in (panel.xaxis.label, panel.yaxis.label):
        label.set(fontsize=11, color=INK)
    panel.set_yscale("log")
    panel.margins(x=0.01)
    low, high = panel.get_ylim()
    panel.set_ylim(low, max(high, 1e3 * low))


def _finish(
    figure: Figure,
    comparison: Comparison,
    what: str,
    more: str = "",
    extra: list[tuple[str, Line2D]] | None = None,
    truth: bool = True,
) -> None:
    """Add legend, title, and the sentence that says what the truth is."""
    entries = [
        (name, Line2D([], [], color=colour, lw=3.4, alpha=OPAQUE)) for name, colour in _colours(comparison).items()
    ]
    best, duration = comparison.best, comparison.scene.world.duration
    if truth and best is not None:
        entries.append((f"truth: {best.kind.replace('_', ' ')}", Line2D([], [], **CLOSED)))
    entries += extra or []
    if best is not None and best.trusted_until < duration and "time, s" in (p.get_xlabel() for p in figure.axes):
        entries.append((f"trusted until {best.trusted_until:.3g} s", Line2D([], [], color=INK, lw=1.0)))
    add_legend(figure, entries, ncols=min(len(entries), 4), **LEGEND)
    figure.align_ylabels()

    lines = wrap(comparison.sentence(), 105)[:3]
    if more:
        lines.append(more)
    tall = figure.get_figheight()
    place: dict[str, Any] = {"x": 0.1 / figure.get_figwidth(), "va": "top", "color": INK}
    title = shortened(f"{comparison.scene.title or 'untitled scene'}: {what}", 60)
    literal(figure.text(y=1 - 0.10 / tall, s=title, fontsize=16, weight="bold", **place))
    literal(figure.text(y=1 - 0.44 / tall, s="\n".join(lines), fontsize=9.5, linespacing=1.4, **place))
    figure.set_layout_engine("constrained", rect=(0.0, 0.0, 1.0, 1 - (0.5 + 0.19 * len(lines)) / tall))
