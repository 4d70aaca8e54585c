"""Panels: how curves, axes, legends and texts look in every plot."""

import math
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import NullLocator

from sandbox.arrays import BoolArray, FloatArray

MOST_POINTS = 4000
"""Points to a curve; longer ones keep the extremes of every stretch."""
INK, FAINT = "#222222", "#8a8a8a"
WIDE, SHEER = 3.4, 0.55
"""Width in points and opacity of what was computed."""
CLOSED: dict[str, Any] = {"color": "black", "lw": 1.0, "ls": (0, (4, 3))}

STILL = 1e-6
"""Motion below this share of the scale is rounding, not worth an axis."""
RUNAWAY = 1e5
"""A value this many times the usual one turns its axis logarithmic."""
BEYOND = 1e150
"""What is larger cannot be drawn."""

FALLBACK_FONTS = ("Noto Sans CJK JP", "Hiragino Sans", "Microsoft YaHei", "Segoe UI Emoji", "Noto Sans Arabic")
"""For names beyond what the font that comes with matplotlib can write."""


def draw(panel: Axes, time: FloatArray, values: FloatArray, colour: str) -> None:
    """Draw what was computed: a wide, sheer line, so that a closed form shows on top of it."""
    panel.plot(*_thinned(time, values), color=colour, lw=WIDE, alpha=SHEER, solid_joinstyle="round")


def draw_closed(panel: Axes, time: FloatArray, values: FloatArray, valid: BoolArray) -> None:
    """Draw a closed form where it is valid: a thin, dashed black line."""
    panel.plot(*_thinned(time, np.where(valid, values, np.nan)), **CLOSED)


def _thinned(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Keep of a long curve the lowest and highest point of each stretch, and leave out what cannot be drawn."""
    values = np.where(np.abs(values) < BEYOND, values, np.nan)
    if len(time) <= MOST_POINTS:
        return time, values
    kept = []
    for begin, end in pairwise(np.linspace(0, len(time), MOST_POINTS // 2 + 1).astype(int).tolist()):
        kept += sorted((begin + int(values[begin:end].argmin()), begin + int(values[begin:end].argmax())))
    kept = [0, *kept, len(time) - 1]
    return time[kept], values[kept]


def key(colour: str) -> Line2D:
    """Return what stands in a legend for a line drawn by `draw`."""
    return Line2D([], [], color=colour, lw=WIDE, alpha=SHEER)


def dress(panel: Axes) -> None:
    """Finish a panel once all is drawn: frame, grid, fonts, and a scale that suits its values.

    A runaway makes the scale logarithmic on both sides of 0; rounding noise is not blown up to full height.
    """
    panel.spines[["top", "right"]].set_visible(False)
    panel.grid(color="#e4e4e4", lw=0.6)
    panel.set_axisbelow(True)
    panel.tick_params(labelsize=10, colors=INK)
    for label in (panel.xaxis.label, panel.yaxis.label):
        label.set(fontsize=11, color=INK)
    panel.margins(x=0.01)

    drawn = np.concatenate([[0.0], *(np.asarray(line.get_ydata(), dtype=np.float64) for line in panel.lines)])
    drawn = drawn[np.isfinite(drawn)]
    usual = max(float(np.quantile(np.abs(drawn), 0.1)), 1.0)
    if np.abs(drawn).max() > RUNAWAY * usual:
        _make_logarithmic(panel, drawn, math.ceil(math.log10(usual)))
        return
    panel.ticklabel_format(axis="y", useOffset=False)
    low, high = panel.get_ylim()
    short = STILL * max(abs(low), abs(high), 1.0) - (high - low)
    if short > 0:
        panel.set_ylim(low - short / 2, high + short / 2)


def _make_logarithmic(panel: Axes, drawn: FloatArray, linear: int) -> None:
    """Make a scale logarithmic beyond ±10**linear, with a few ticks that do not crowd about 0."""
    top = math.ceil(math.log10(np.abs(drawn).max()))
    powers = [10.0**power for power in range(top, linear + 1, -math.ceil((top - linear) / 3))]
    panel.set_yscale("symlog", linthresh=10.0**linear)
    panel.set_yticks([*(-power for power in powers), 0.0, *reversed(powers)])
    panel.yaxis.set_minor_locator(NullLocator())
    low, high = float(drawn.min()), float(drawn.max())
    panel.set_ylim(min(10.0 * low, -(10.0**linear)), max(10.0 * high, 10.0**linear))
    panel.set_ylabel(f"{panel.get_ylabel()} (log)")


def add_legend(owner: Axes | Figure, entries: list[tuple[str, Line2D]], most: int = 40, **layout: Any) -> None:
    """Add a legend of labels with at most `most` characters.

    Its texts are set afterwards, as matplotlib drops labels that start with an underscore.
    """
    handles = [key for _, key in entries]
    legend = owner.legend(handles, ["name"] * len(handles), frameon=False, fontsize=10, **layout)
    for text, (label, _) in zip(legend.get_texts(), entries, strict=True):
        text.set_text(shortened(label, most))
        literal(text)


def shortened(text: str, most: int = 40) -> str:
    """Return a text as one printable line of at most `most` characters."""
    text = "".join(c if c.isprintable() else " " for c in text)
    return text if len(text) <= most else f"{text[: most - 1]}…"


def literal(text: Text) -> None:
    """Show a text as it is: `$x$` is a name here, not mathematics."""
    text.set_parse_math(False)
    text.set_usetex(False)
    text.set_fontfamily(_fonts())


@cache
def _fonts() -> list[str]:
    installed = set(fontManager.get_font_names())
    return ["DejaVu Sans", *(font for font in FALLBACK_FONTS if font in installed)]
