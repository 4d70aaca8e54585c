"""Style of plots: colours of the engines, panels and legends, atomic writing of figure files."""

import math
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any
from warnings import catch_warnings, filterwarnings

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import NullLocator

from sandbox.arrays import BoolArray, FloatArray
from sandbox.atomic_write import atomic_write

FORMATS: dict[str, dict[str, None]] = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
"""Suffixes that can be written, each with the metadata to omit so that the same run writes the same file."""


def write_figure(figure: Figure, path: Path) -> Path:
    """Write a figure by its path's suffix, one of `FORMATS`, and return the path.

    Raises:
        OSError: the file cannot be written.
    """
    suffix = path.suffix.lower()
    with atomic_write(path) as temporary, temporary.open("xb") as stream, catch_warnings():
        ignore_missing_glyphs()
        figure.savefig(stream, format=suffix[1:], dpi=150, metadata=FORMATS[suffix])
    return path


def ignore_missing_glyphs() -> None:
    """Ignore warnings about characters that no font has, within `catch_warnings`; they show as boxes."""
    filterwarnings("ignore", message="Glyph .* missing from")
    filterwarnings("ignore", message="Matplotlib currently does not support .* natively")


MAX_POINTS = 4000
"""Points of a drawn curve; of a longer one the lowest and highest point of each interval are kept."""
CHART_POINTS = 600
"""The same for a chart of a page, about two points a pixel: more would only make the page larger."""
INK, FAINT, GRID, SHADED = "#222222", "#8a8a8a", "#e4e4e4", "#efefef"
WIDTH, OPACITY = 3.4, 0.55
"""Line width in points and opacity of computed values."""
CLOSED: dict[str, Any] = {"color": "black", "lw": 1.0, "ls": (0, (4, 3))}
"""Line of an analytic solution, or of the truth."""

STILL = 1e-6
"""Relative motion below it is rounding: an axis along which nothing moves more is omitted."""
RUNAWAY = 1e5
"""Ratio of the largest to the typical value from which an axis becomes logarithmic."""
BEYOND = 1e150
"""Larger values are not drawn: matplotlib squares them, which overflows."""

FALLBACK_FONTS = ("Noto Sans CJK JP", "Hiragino Sans", "Microsoft YaHei", "Segoe UI Emoji", "Noto Sans Arabic")
"""Fonts for characters that the font shipped with matplotlib lacks."""


def draw(
    panel: Axes, time: FloatArray, values: FloatArray, colour: str, max_points: int = MAX_POINTS, **style: Any
) -> None:
    """Draw computed values: a wide, translucent line, so that an analytic solution is visible on top of it.

    Args:
        panel: panel to draw into.
        time: (K,), s.
        values: (K,).
        colour: colour of the line.
        max_points: largest number of points of the line.
        style: properties of the line, in place of the default ones.
    """
    defaults = {"color": colour, "lw": WIDTH, "alpha": OPACITY, "solid_joinstyle": "round"}
    panel.plot(*_decimated(time, values, max_points), **{**defaults, **style})


def draw_closed(
    panel: Axes, time: FloatArray, values: FloatArray, valid: BoolArray, max_points: int = MAX_POINTS
) -> None:
    """Draw an analytic solution where it is valid: a thin, dashed black line."""
    panel.plot(*_decimated(time, np.where(valid, values, np.nan), max_points), **CLOSED)


def _decimated(time: FloatArray, values: FloatArray, max_points: int) -> tuple[FloatArray, FloatArray]:
    """Keep the lowest and highest point of each interval of a long curve; values that cannot be drawn become nan."""
    values = np.where(np.abs(values) < BEYOND, values, np.nan)
    if len(time) <= max_points:
        return time, values
    kept = []
    for begin, end in pairwise(np.linspace(0, len(time), max_points // 2 + 1).astype(int).tolist()):
        kept += sorted((begin + int(values[begin:end].argmin()), begin + int(values[begin:end].argmax())))
    kept = [0, *kept, len(time) - 1]
    return time[kept], values[kept]


def key(colour: str) -> Line2D:
    """Return the legend entry of a line drawn by `draw`."""
    return Line2D([], [], color=colour, lw=WIDTH, alpha=OPACITY)


def style_axes(panel: Axes) -> None:
    """Set frame, grid and fonts of a panel."""
    panel.spines[["top", "right"]].set_visible(False)
    panel.grid(color=GRID, lw=0.6)
    panel.set_axisbelow(True)
    panel.tick_params(labelsize=10, colors=INK)
    for label in (panel.xaxis.label, panel.yaxis.label):
        label.set(fontsize=11, color=INK)
    panel.margins(x=0.01)


def dress(panel: Axes, limits: tuple[float, float] | None = None) -> None:
    """Finish a panel after all curves are drawn: frame, grid, fonts, and a scale that fits the values.

    Args:
        panel: the panel. A value far beyond the typical one makes its scale logarithmic on both sides of 0; rounding
            errors are not magnified to full height.
        limits: lowest and highest value to show on a linear scale; default: those of the drawn values.
    """
    style_axes(panel)
    if limits is None:
        drawn = np.concatenate([[0.0], *(np.asarray(line.get_ydata(), dtype=np.float64) for line in panel.lines)])
        drawn = drawn[np.isfinite(drawn)]
        typical = max(float(np.quantile(np.abs(drawn), 0.1)), 1.0)
        if np.abs(drawn).max() > RUNAWAY * typical:
            _make_logarithmic(panel, drawn, math.ceil(math.log10(typical)))
            return
    panel.ticklabel_format(axis="y", useOffset=False)
    low, high = limits or panel.get_ylim()
    size = max(abs(low), abs(high), 1.0)
    if limits:
        is_constant = high - low < STILL * size
        # 5 % is what matplotlib leaves free by default, and around a constant value.
        margin = 0.05 * ((max(abs(low), abs(high)) or 1.0) if is_constant else high - low)
        panel.set_ylim(low - margin, high + margin)
    elif high - low < STILL * size:
        missing = STILL * size - (high - low)
        panel.set_ylim(low - missing / 2, high + missing / 2)


def _make_logarithmic(panel: Axes, drawn: FloatArray, linear: int) -> None:
    """Make a scale logarithmic beyond ±10**linear, with a few ticks that do not collide around 0."""
    top = math.ceil(math.log10(np.abs(drawn).max()))
    powers = [10.0**power for power in range(top, linear + 1, -math.ceil((top - linear) / 3))]
    panel.set_yscale("symlog", linthresh=10.0**linear)
    panel.set_yticks([*(-power for power in powers), 0.0, *reversed(powers)])
    panel.yaxis.set_minor_locator(NullLocator())
    low, high = float(drawn.min()), float(drawn.max())
    panel.set_ylim(min(10.0 * low, -(10.0**linear)), max(10.0 * high, 10.0**linear))
    panel.set_ylabel(f"{panel.get_ylabel()} (log)")


CHART_SIZE = (5.8, 2.7)
"""Width and height of a chart for a page, inches."""
CHART_MARGINS = {"left": 0.72, "right": 0.14, "top": 0.36, "bottom": 0.5}
"""Space around its axes, inches: the same in all charts, so that their time axes are aligned."""


def chart_figure() -> tuple[Figure, Axes]:
    """Return an empty chart for a page: one panel, without title and legend."""
    width, height = CHART_SIZE
    figure = Figure(figsize=CHART_SIZE)
    figure.subplots_adjust(
        left=CHART_MARGINS["left"] / width,
        right=1.0 - CHART_MARGINS["right"] / width,
        top=1.0 - CHART_MARGINS["top"] / height,
        bottom=CHART_MARGINS["bottom"] / height,
    )
    return figure, figure.subplots()


def finish_chart(panel: Axes, label: str, duration: float) -> None:
    """Finish a chart of a page whose curves are drawn.

    Args:
        panel: its axes, which then span the whole duration.
        label: quantity and unit, written above the axis, where it can be read without tilting the head.
        duration: s.
    """
    panel.set_xlim(0.0, duration)
    left = -CHART_MARGINS["left"] / (CHART_SIZE[0] - CHART_MARGINS["left"] - CHART_MARGINS["right"])
    panel.set_title(label, loc="left", x=left, pad=9, fontsize=10, weight="bold", color=INK)
    panel.set_xlabel("time, s", loc="right", fontsize=9)
    panel.tick_params(labelsize=9)
    panel.spines[["left", "bottom"]].set_color(FAINT)


def add_legend(owner: Axes | Figure, entries: list[tuple[str, Line2D]], max_length: int = 40, **layout: Any) -> None:
    """Add a legend of labels with at most `max_length` characters.

    Its texts are set afterwards, as matplotlib drops labels that start with an underscore.
    """
    handles = [key for _, key in entries]
    legend = owner.legend(handles, ["name"] * len(handles), frameon=False, fontsize=10, **layout)
    for text, (label, _) in zip(legend.get_texts(), entries, strict=True):
        text.set_text(shortened(label, max_length))
        literal(text)


def shortened(text: str, max_length: int = 40) -> str:
    """Return a text as one printable line of at most `max_length` characters."""
    text = "".join(c if c.isprintable() else " " for c in text)
    return text if len(text) <= max_length else f"{text[: max_length - 1]}…"


def literal(text: Text) -> None:
    """Disable mathematics in a text: `$x$` is a name here."""
    text.set_parse_math(False)
    text.set_usetex(False)
    text.set_fontfamily(_fonts())


@cache
def _fonts() -> list[str]:
    installed = set(fontManager.get_font_names())
    return ["DejaVu Sans", *(font for font in FALLBACK_FONTS if font in installed)]
