"""Chart of the errors of the settings of a game over time, for a page."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from sandbox.arrays import FloatArray
from sandbox.formatting import format_number
from sandbox.report.colours import COLOURS
from sandbox.report.comparison_plot import NOTE_CLASS, OPACITY, TOLERANCE_LINE
from sandbox.report.style import BEYOND, CHART_POINTS, FAINT, chart_figure, draw, finish_chart, style_axes

LOGARITHMIC = 10.0
"""Ratio of the largest error to the tolerance from which on the axis is logarithmic"""
FLOOR = 1e-3
"""Lower limit of a logarithmic axis, relative to the tolerance; smaller errors are drawn there"""
HEADROOM = 1.1
"""Ratio of the top of a linear axis to the largest value"""
LINE_WIDTH = 1.8
"""points"""


def game_error_chart(curves: Mapping[int, tuple[FloatArray, FloatArray]], tolerance: float, duration: float) -> Figure:
    """Return the largest error of any body against time.

    Args:
        curves: times (F,), s, and errors (F,), px, by the number of the run; it is also the index of its colour.
        tolerance: accepted error, px.
        duration: of the session, s.
    """
    figure, panel = chart_figure()
    largest = max((float(np.nanmax(errors, initial=0.0)) for _, errors in curves.values()), default=0.0)
    is_logarithmic = largest > LOGARITHMIC * tolerance
    floor = FLOOR * tolerance if is_logarithmic else 0.0
    for number, (times, errors) in curves.items():
        style: dict[str, Any] = {"lw": LINE_WIDTH, "alpha": OPACITY, "gid": f"css:line e{number} run{number}"}
        draw(panel, times, np.clip(errors, floor, BEYOND), COLOURS[number], CHART_POINTS, **style)
    panel.axhline(tolerance, **TOLERANCE_LINE)
    layout: dict[str, Any] = {"xytext": (4, 3), "textcoords": "offset points", "fontsize": 8}
    panel.annotate(f"tolerance {format_number(tolerance)} px", (0.0, tolerance), color=FAINT, gid=NOTE_CLASS, **layout)
    style_axes(panel)
    if is_logarithmic:
        panel.set_yscale("log")
        panel.set_ylim(floor, 2.0 * largest)
    else:
        panel.set_ylim(0.0, HEADROOM * max(largest, tolerance))
    finish_chart(panel, "largest error of a body, px", duration)
    return figure
