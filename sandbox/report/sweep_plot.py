"""Plots of a sweep: a quantity over one swept key as lines with quantile bands, or over two keys as a heat map."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.text import Text

from sandbox.arrays import FloatArray
from sandbox.report.colours import COLOURS, colour_of
from sandbox.report.style import INK, literal, style_axes, write_figure

BAND_OPACITY = 0.18
BAR_SHIFT = 0.12
"""Distance between the bars of two lines at one text, in distances of texts"""
MAX_WRITTEN = 200
"""Cells of a heat map whose values are written into them"""
HEAT = LinearSegmentedColormap.from_list("heat", ["#f4f7fb", "#9ec7e6", "#2b7bba", "#08306b"])
"""Light to dark, so that it reads in grey too"""


@dataclass(frozen=True)
class SweepSeries:
    """One line: quantiles of a quantity at each value of a key."""

    name: str
    """of the engine; empty if there is only one line"""
    values: FloatArray
    """(K,) values of the key, ascending"""
    low: FloatArray
    """(K,) lower quantile"""
    median: FloatArray
    """(K,)"""
    high: FloatArray
    """(K,) upper quantile"""


def plot_lines(
    series: Sequence[SweepSeries],
    key: str,
    quantity: str,
    path: Path,
    *,
    band: str = "",
    categories: Sequence[str] = (),
) -> Path:
    """Draw the median of a quantity over a key, with a band or bars between two quantiles, and write the figure.

    Args:
        series: the lines.
        key: label of the horizontal axis.
        quantity: label of the vertical axis.
        path: file, ending in .png, .svg or .pdf.
        band: what the band shows, for the caption.
        categories: texts of the values, if these are their indices.

    Raises:
        OSError: the file cannot be written.
    """
    figure = Figure(figsize=(7.2, 4.4), layout="constrained")
    panel = figure.add_subplot()
    for k, each in enumerate(series):
        colour = colour_of(each.name) if each.name else COLOURS[k % len(COLOURS)]
        if categories:
            spread = np.stack([each.median - each.low, each.high - each.median])
            style: dict[str, Any] = {"fmt": "o", "ms": 6.0, "capsize": 5.0, "elinewidth": 1.6}
            shift = BAR_SHIFT * (k - (len(series) - 1) / 2.0)
            panel.errorbar(each.values + shift, each.median, spread, color=colour, label=each.name, **style)
            continue
        panel.fill_between(each.values, each.low, each.high, color=colour, alpha=BAND_OPACITY, lw=0.0)
        panel.plot(each.values, each.median, color=colour, lw=2.0, marker="o", ms=4.5, label=each.name)
    if not categories and is_spaced_by_factors(np.unique(np.concatenate([each.values for each in series]))):
        panel.set_xscale("log")
    _label(panel, key, quantity)
    if categories:
        panel.set_xticks(range(len(categories)), list(categories))
        panel.set_xlim(-0.5, len(categories) - 0.5)
    if band:
        panel.set_title(band, fontsize=9.5, color=INK, loc="left")
    if len(series) > 1:
        panel.legend(frameon=False, fontsize=10)
    _make_literal(figure)
    return write_figure(figure, path)


def plot_heat_map(
    columns: Sequence[str], rows: Sequence[str], cells: FloatArray, labels: tuple[str, str, str], path: Path
) -> Path:
    """Draw a quantity over two keys as a heat map, and write the figure.

    Args:
        columns: texts of the values of the horizontal key.
        rows: texts of the values of the vertical key, from the bottom.
        cells: (rows, columns) values; nan leaves a cell empty.
        labels: of the horizontal key, the vertical key and the quantity.
        path: file, ending in .png, .svg or .pdf.

    Raises:
        OSError: the file cannot be written.
    """
    width, height = (min(max(4.0, 1.8 + 0.62 * len(columns)), 14.0), min(max(3.2, 1.2 + 0.42 * len(rows)), 12.0))
    figure = Figure(figsize=(width, height), layout="constrained")
    panel = figure.add_subplot()
    image = panel.imshow(cells, origin="lower", aspect="auto", cmap=HEAT)
    if cells.size <= MAX_WRITTEN:
        _write_values(panel, cells)
    for axis, texts in ((panel.xaxis, columns), (panel.yaxis, rows)):
        step = max(1, math.ceil(len(texts) / 20))
        axis.set_ticks(range(0, len(texts), step), list(texts[::step]))
    _label(panel, labels[0], labels[1])
    panel.grid(visible=False)
    panel.spines[:].set_visible(False)
    panel.tick_params(length=0)
    bar = figure.colorbar(image, ax=panel, label=labels[2])
    bar.outline.set_visible(False)
    _make_literal(figure)
    return write_figure(figure, path)


def is_spaced_by_factors(values: FloatArray) -> bool:
    """Return whether positive values have even factors between them rather than even differences."""
    if len(values) < 3 or values[0] <= 0.0 or values[-1] / values[0] < 8.0:
        return False
    steps, factors = np.diff(values), np.diff(np.log(values))
    return bool(factors.std() / factors.mean() < steps.std() / steps.mean())


def _write_values(panel: Axes, cells: FloatArray) -> None:
    """Write the value of each cell into it, in a colour that stands out."""
    known = cells[np.isfinite(cells)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    for (row, column), value in np.ndenumerate(cells):
        if math.isfinite(value):
            is_dark = high > low and (value - low) / (high - low) > 0.55
            text = f"{value:.3g}"
            panel.text(column, row, text, ha="center", va="center", fontsize=8, color="white" if is_dark else INK)


def _label(panel: Axes, horizontal: str, vertical: str) -> None:
    panel.set_xlabel(horizontal)
    panel.set_ylabel(vertical)
    style_axes(panel)


def _make_literal(figure: Figure) -> None:
    """Show all texts as they are: names may contain signs of mathematical text."""
    for text in figure.findobj(Text):
        literal(text)
