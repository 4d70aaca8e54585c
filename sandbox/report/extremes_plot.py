"""Heat maps of extremes: verdicts by setup and level of each axis; pairs of axes as matrices."""

import math
from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from sandbox.measure.extremes import Extremes, Sample
from sandbox.measure.extremes.boundary import Boundary
from sandbox.measure.extremes.experiment import Axis, AxisPair
from sandbox.measure.extremes.outcome import MEANINGS, VERDICTS, Verdict, survived_tenths
from sandbox.report.style import write_figure

COLOURS: dict[Verdict, str] = {"exact": "#0072b2", "degraded": "#8cc6ec", "refused": "#dcdcdc", "failed": "#d55e00"}
"""Palette of Okabe and Ito (2008), distinguishable with every common colour blindness; the mark repeats the verdict."""
MARKS: dict[Verdict, str] = {"exact": "E", "degraded": "d", "refused": "–", "failed": "×"}
INKS: dict[Verdict, str] = {"exact": "white", "degraded": "#222222", "refused": "#777777", "failed": "white"}
NOT_RUN = "#ffffff"
PARTLY_SURVIVED = "#f6d2b4"
"""Colour that a failed level approaches as more of its starts survive."""
TITLE = "Limits of each engine and setting, with the counted cost relative to pymunk; *: levels pass and fail in turn"
ROW_HEIGHT = 0.24
"""Height of a row, inches."""


def plot_extremes(result: Extremes, folder: str | Path) -> tuple[Path, ...]:
    """Write `extremes.png`, and `pairs.png` if there are pairs, into a folder, each to a temporary name first.

    Raises:
        OSError: a file cannot be written.
    """
    figures = {"extremes": draw_axes(result)} if result.cells else {}
    if result.pairs:
        figures["pairs"] = draw_pairs(result)
    return tuple(write_figure(figure, Path(folder) / f"{name}.png") for name, figure in figures.items())


def draw_axes(result: Extremes) -> Figure:
    """Return a panel for each axis, in two columns; each row is a setup, with its cost and boundary at the end.

    A star marks boundaries beyond which levels pass, or before which they fail.
    """
    axes = [axis for axis in result.plan.axes if any(cell.axis == axis.name for cell in result.cells)]
    left, right = _halved(axes, [len(result.plan.setups(axis)) + 4.2 for axis in axes])
    height = max(_height(result, side) for side in (left, right)) + 0.9
    figure = Figure(figsize=(17.0, height), facecolor="white")
    figure.suptitle(TITLE, x=0.01, y=1.0 - 0.12 / height, ha="left", va="top", size=14)
    for k, side in enumerate((left, right)):
        top = 1.0 - 0.85 / height
        for axis in side:
            rows = len(result.plan.setups(axis))
            panel_height = rows * ROW_HEIGHT / height
            panel = figure.add_axes((0.11 + 0.5 * k, top - 0.3 / height - panel_height, 0.26, panel_height))
            _draw_axis(panel, result, axis)
            top -= (rows * ROW_HEIGHT + 1.0) / height
    _legend(figure, 1.0 - 0.42 / height)
    return figure


def draw_pairs(result: Extremes) -> Figure:
    """Return a matrix for each pair and setup, a row of matrices for each pair."""
    pairs = [pair for pair in result.plan.pairs if any(cell.axis == pair.name for cell in result.pairs)]
    columns = max(len(result.plan.setups(pair)) for pair in pairs)
    heights = [len(pair.first.levels) * ROW_HEIGHT + 0.95 for pair in pairs]
    height, width = sum(heights) + 0.9, 1.4 + columns * 2.5
    figure = Figure(figsize=(width, height), facecolor="white")
    figure.suptitle("Two axes combined", x=0.01, y=1.0 - 0.12 / height, ha="left", va="top", size=14)
    top = height - 0.85
    for pair, row_height in zip(pairs, heights, strict=True):
        figure.text(0.1 / width, top / height, pair.name, size=10, weight="bold", va="top")
        for k, setup in enumerate(result.plan.setups(pair)):
            origin = 1.3 + k * 2.5, top - 0.45 - len(pair.first.levels) * ROW_HEIGHT
            size = 2.1, len(pair.first.levels) * ROW_HEIGHT
            panel = figure.add_axes((origin[0] / width, origin[1] / height, size[0] / width, size[1] / height))
            _draw_pair(panel, [c for c in result.pairs if (c.axis, c.setup) == (pair.name, setup.name)], pair)
            panel.set_title(setup.name, size=8, pad=3)
            if k == 0:
                panel.set_ylabel(pair.first.parameter.replace("_", " "), size=8)
                panel.set_yticks(range(len(pair.first.levels)), [level_text(x) for x in pair.first.levels], size=7)
        top -= row_height
    _legend(figure, 1.0 - 0.42 / height)
    return figure


def level_text(level: float) -> str:
    """Return a level as text, with as few digits as suffice: 1/240 rather than 0.00416667."""
    if 0.0 < level < 0.09 and not math.isclose(level, float(f"{level:.3g}"), rel_tol=1e-9):
        return f"1/{1.0 / level:.4g}"
    return f"{level:.4g}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")


def _height(result: Extremes, axes: Sequence[Axis]) -> float:
    return sum(len(result.plan.setups(axis)) * ROW_HEIGHT + 1.0 for axis in axes)


def _halved(axes: Sequence[Axis], sizes: Sequence[float]) -> tuple[list[Axis], list[Axis]]:
    """Split axes, in their order, into two columns of similar height."""
    total, so_far, left = sum(sizes), 0.0, []
    for axis, size in zip(axes, sizes, strict=True):
        if so_far + 0.5 * size > 0.5 * total:
            break
        left.append(axis)
        so_far += size
    return left, list(axes[len(left) :])


def _draw_axis(panel: Axes, result: Extremes, axis: Axis) -> None:
    levels, setups = result.plan.levels(axis), result.plan.setups(axis)
    cell_of = {(setup.name, level): (row, k) for row, setup in enumerate(setups) for k, level in enumerate(levels)}
    cells = {cell_of[c.setup, _single(c)]: c for c in result.cells if c.axis == axis.name}
    _draw_cells(panel, cells, len(setups), len(levels))
    unit = f", {axis.unit}" if axis.unit else ""
    panel.set_title(f"{axis.name.replace('_', ' ')}{unit}", loc="left", size=10, weight="bold", pad=18)
    panel.text(0.0, 1.0, axis.about, transform=panel.transAxes, size=7.5, color="#555555", va="bottom")
    panel.set_yticks(range(len(setups)), [setup.name for setup in setups], size=8)
    panel.set_xticks(range(len(levels)), [level_text(level) for level in levels], size=8)
    limits = {limit.setup: limit for limit in result.limits if limit.axis == axis.name}
    for row, setup in enumerate(setups):
        if setup.name in limits:
            text = _bound(limits[setup.name])
            panel.text(len(levels) - 0.4, row, text, size=8, va="center", color="#333333", clip_on=False)


def _bound(limit: Boundary) -> str:
    if limit.refused:
        return ""
    if limit.first_failure is None:
        return f"{_cost(limit)}no failure"
    if limit.limit is None:
        return f"{_cost(limit)}all fail"
    star = "" if limit.monotone else " *"
    between = ""
    if limit.bounds not in (None, (limit.limit, limit.first_failure)):
        between = " ({}–{})".format(*("…" if level is None else _rounded(level) for level in limit.bounds))
    return f"{_cost(limit)}to {_rounded(limit.limit)}{between}{star}: {limit.rule}"


def _cost(limit: Boundary) -> str:
    return "" if limit.cost_ratio is None else f"×{limit.cost_ratio:.3g}  "


def _rounded(level: float) -> str:
    return level_text(float(f"{level:.3g}"))


def _single(cell: Sample) -> float:
    assert not isinstance(cell.level, tuple)
    return cell.level


def _draw_pair(panel: Axes, cells: Sequence[Sample], pair: AxisPair) -> None:
    cell_of = {
        (a, b): (row, column) for row, a in enumerate(pair.first.levels) for column, b in enumerate(pair.second.levels)
    }
    known = {cell_of[c.level]: c for c in cells if isinstance(c.level, tuple)}
    _draw_cells(panel, known, len(pair.first.levels), len(pair.second.levels))
    panel.set_xticks(range(len(pair.second.levels)), [level_text(x) for x in pair.second.levels], size=7)
    panel.set_xlabel(pair.second.parameter.replace("_", " "), size=8, labelpad=1)
    panel.set_yticks([])


def _draw_cells(panel: Axes, cells: dict[tuple[int, int], Sample], rows: int, columns: int) -> None:
    """Colour and mark the cells; cells that were not run are white."""
    colours = [[to_rgb(NOT_RUN)] * columns for _ in range(rows)]
    for (row, column), cell in cells.items():
        mark, ink, colours[row][column] = MARKS[cell.verdict], INKS[cell.verdict], to_rgb(COLOURS[cell.verdict])
        tenths = survived_tenths(cell)
        if tenths is not None and cell.survived is not None:
            mark, fraction = str(tenths), cell.survived.probability
            ink = INKS["failed" if fraction < 0.3 else "degraded"]
            pair = zip(to_rgb(COLOURS["failed"]), to_rgb(PARTLY_SURVIVED), strict=True)
            red, green, blue = ((1.0 - fraction) * a + fraction * b for a, b in pair)
            colours[row][column] = red, green, blue
        panel.text(column, row, mark, ha="center", va="center", size=8, color=ink)
    panel.imshow(colours, aspect="auto")
    panel.set_xticks([k - 0.5 for k in range(1, columns)], minor=True)
    panel.set_yticks([k - 0.5 for k in range(1, rows)], minor=True)
    panel.grid(which="minor", color="white", lw=1.5)
    panel.tick_params(which="both", length=0)
    for side in panel.spines.values():
        side.set_visible(False)


def _legend(figure: Figure, top: float) -> None:
    patches = [Patch(color=COLOURS[word], label=f"{MARKS[word]}  {word}: {MEANINGS[word]}") for word in VERDICTS]
    patches.append(Patch(color=PARTLY_SURVIVED, label="0–9  failed: tenths that survived"))
    figure.legend(
        handles=patches,
        loc="upper left",
        bbox_to_anchor=(0.005, top),
        ncols=len(patches),
        columnspacing=1.2,
        handlelength=1.4,
        frameon=False,
        fontsize=8.5,
    )
