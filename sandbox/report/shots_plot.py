"""Plots of shots: density of rest positions on the table, and outcome against the angle of aim."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.exact.tabletop.shots import ShotBatch
from sandbox.measure.shots.monte_carlo import Odds
from sandbox.measure.shots.study import ShotStudy
from sandbox.report.colours import COLOURS
from sandbox.report.style import FAINT, INK, literal, shortened, write_figure
from sandbox.scene.compile.scene import Scene

BINS = 90
"""Bins along the longer side of the heat maps."""

AIMS = 1501
"""Number of shots, evenly spread over the drawn angles."""

WIDTH = 4.0
"""Standard deviations of aim drawn on each side; more if the nearest requested window lies beyond."""

MIN_ANGLE = 1e-3
"""rad, drawn on each side at least."""

NOT_POCKETED_COLOUR = "#e9e9e9"
"""Colour of a ball that is not pocketed."""
COLOUR_MAP = "inferno_r"


def plot_shots(found: ShotStudy, folder: str | Path) -> tuple[Path, Path]:
    """Write `rests.png` and `aims.png` into a folder, each to a temporary name first.

    Raises:
        OSError: a file cannot be written.
    """
    target = Path(folder)
    rests = write_figure(draw_rests(found.odds), target / "rests.png")
    return rests, write_figure(draw_aims(found), target / "aims.png")


def draw_rests(odds: Odds) -> Figure:
    """Return heat maps of the rest positions of the struck ball and of all others: number of shots in each bin."""
    scene, struck = odds.shot.table.scene, odds.shot.ball_index(odds.shot.ball)
    stayed = odds.batch.pocket < 0
    positions, others = odds.batch.position, np.delete(np.arange(len(odds.nominal.names)), struck)
    sets = {odds.shot.ball: positions[stayed[:, struck], struck]}
    if len(others):
        sets["all others" if len(others) > 1 else odds.nominal.names[int(others[0])]] = positions[:, others][
            stayed[:, others]
        ]
    low, high = _bounds(scene, np.concatenate(list(sets.values())))
    size = high - low
    upright = size[1] >= size[0]
    scale = 7.0 / float(size.max())
    across = scale * float(size[0])
    shape = (across * len(sets) + 2.2, 8.2) if upright else (9.0, (scale * float(size[1]) + 0.6) * len(sets) + 1.2)
    figure = Figure(figsize=shape, facecolor="white", layout="constrained")
    panels = figure.subplots(*((1, len(sets)) if upright else (len(sets), 1)), squeeze=False).ravel()
    side = float(size.max()) / BINS
    edges = [np.linspace(low[k], high[k], max(2, math.ceil(size[k] / side)) + 1) for k in range(2)]
    counts = {name: np.histogram2d(points[:, 0], points[:, 1], bins=edges)[0].T for name, points in sets.items()}
    scale_of = LogNorm(1.0, max(2.0, *(float(each.max()) for each in counts.values())))
    for panel, (name, each) in zip(panels, counts.items(), strict=True):
        panel.pcolormesh(*edges, np.ma.masked_less(each, 1.0), cmap=COLOUR_MAP, norm=scale_of, rasterized=True)
        _draw_table(panel, scene)
        _mark(panel, odds, name, struck)
        panel.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", xlabel="x, m", ylabel="y, m")
        literal(panel.set_title(shortened(name), loc="left", size=11, color=INK))
    density = ScalarMappable(scale_of, COLOUR_MAP)
    bar = figure.colorbar(density, ax=list(panels), shrink=0.7)
    bar.ax.yaxis.set_major_formatter("{x:g}")
    about = f"rest positions of {odds.count:,} shots, in squares of {100.0 * side:.2g} cm"
    _head(figure, f"{_title(odds)}: {about}")
    return figure


def draw_aims(found: ShotStudy) -> Figure:
    """Return the rest position of the struck ball, and the pocket of each ball, against the aim."""
    odds, attempt = found.odds, found.shot
    nearest = [(each, each.nearest) for each in found.windows]
    half = max(
        MIN_ANGLE,
        WIDTH * odds.spread.aim,
        *(1.2 * max(abs(near.low - each.aim), abs(near.high - each.aim)) for each, near in nearest if near),
    )
    offsets = np.linspace(-half, half, AIMS)
    batch = attempt.simulate_batch([attempt.changed("aim", by) for by in offsets.tolist()])
    names, struck = attempt.table.names, attempt.ball_index(attempt.ball)
    shown = [k for k in range(len(names)) if k == struck or (batch.pocket[:, k] >= 0).any()]
    rows = 0.26 * len(shown)
    figure = Figure(figsize=(9.0, 3.6 + rows + 1.4), facecolor="white", layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3.6, rows + 0.2))
    _draw_rest_position(upper, 1e3 * offsets, batch, struck, attempt.ball)
    _draw_pockets(lower, 1e3 * offsets, batch.pocket[:, shown], [names[k] for k in shown])
    for panel in (upper, lower):
        panel.axvline(0.0, color=FAINT, lw=0.9, ls=(0, (2, 3)))
        panel.axvspan(-1e3 * odds.spread.aim, 1e3 * odds.spread.aim, color=FAINT, alpha=0.12, lw=0)
    lower.set_xlabel("aim error, mrad (positive: left); shaded: one standard deviation")
    pocketed = sorted(set(batch.pocket[batch.pocket >= 0].tolist()))
    keys = [Patch(color=_colour(hole), label=f"pocket {hole}") for hole in pocketed] + [
        Patch(color=NOT_POCKETED_COLOUR, label="stays")
    ]
    legend = figure.legend(handles=keys, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    for text, name in zip(legend.get_texts(), [*(attempt.pockets[hole] for hole in pocketed), "stays"], strict=True):
        text.set_text(shortened(name))
        literal(text)
    _head(figure, f"{_title(odds)}: outcome against aim")
    return figure


def _title(odds: Odds) -> str:
    return odds.shot.table.scene.title or odds.shot.name


def _head(figure: Figure, text: str) -> None:
    literal(figure.suptitle(shortened(text, 90), x=0.01, ha="left", size=13, weight="bold", color=INK))


def _bounds(scene: Scene, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the region to show: cushions and pockets, without them all rest positions."""
    fixed = [point for wall in scene.walls for point in wall.points]
    fixed += [post.position for post in scene.posts] + [pocket.position for pocket in scene.pockets]
    reach = max((pocket.radius for pocket in scene.pockets), default=0.0)
    points = np.asarray(fixed if scene.walls else [*fixed, *positions.tolist(), *scene.bodies.position.tolist()])
    margin = reach + 0.02 * float(np.ptp(points, axis=0).max()) + 1e-6
    return points.min(axis=0) - margin, points.max(axis=0) + margin


def _draw_table(panel: Axes, scene: Scene) -> None:
    line: dict[str, Any] = {"color": INK, "lw": 1.2, "solid_capstyle": "round"}
    for wall in scene.walls:
        points = [*wall.points, wall.points[0]] if wall.closed else wall.points
        panel.plot(*zip(*points, strict=True), **line)
    for post in scene.posts:
        panel.add_patch(Circle(post.position, post.radius, fill=False, ec=INK, lw=1.2))
    for pocket in scene.pockets:
        panel.add_patch(Circle(pocket.position, pocket.radius, fc="#d8d8d8", ec=FAINT, lw=0.8, zorder=0.5))


def _mark(panel: Axes, odds: Odds, name: str, struck: int) -> None:
    """Mark the start positions of balls, and their rest positions after the intended stroke."""
    marked = [struck] if name == odds.shot.ball else [k for k in range(len(odds.nominal.names)) if k != struck]
    bodies = odds.shot.table.scene.bodies
    starts = odds.shot.table.position
    for k in marked:
        at = float(starts[k, 0]), float(starts[k, 1])
        panel.add_patch(Circle(at, float(bodies.radius[k]), fill=False, ec=FAINT, lw=0.9, ls=":"))
        if odds.nominal.names[k] not in odds.nominal.pocketed:
            panel.plot(*odds.nominal.position[k], "+", color="#0072B2", ms=9, mew=1.6)


def _draw_rest_position(panel: Axes, offsets: FloatArray, batch: ShotBatch, struck: int, ball: str) -> None:
    stays = batch.pocket[:, struck] < 0
    for k, axis in enumerate("xy"):
        panel.plot(offsets[stays], batch.position[stays, struck, k], ".", ms=2.4, color=COLOURS[k], label=axis)
    literal(panel.set_ylabel(shortened(f"rest position of {ball}, m", 34)))
    panel.legend(frameon=True, framealpha=0.9, edgecolor="none", markerscale=4, loc="upper right", fontsize=9)
    panel.spines[["top", "right"]].set_visible(False)
    panel.grid(color="#e4e4e4", lw=0.6)


def _draw_pockets(panel: Axes, offsets: FloatArray, pocket: IntArray, names: Sequence[str]) -> None:
    last_pocket = max(int(pocket.max()), 0)
    colours = ListedColormap([NOT_POCKETED_COLOUR, *(_colour(hole) for hole in range(last_pocket + 1))])
    step = 0.5 * float(offsets[1] - offsets[0])
    extent = (float(offsets[0]) - step, float(offsets[-1]) + step, len(names) - 0.5, -0.5)
    panel.imshow(
        pocket.T, cmap=colours, vmin=-1.5, vmax=last_pocket + 0.5, extent=extent, aspect="auto", interpolation="nearest"
    )
    panel.set_yticks(range(len(names)), names, size=9)
    for text in panel.get_yticklabels():
        literal(text)
    panel.tick_params(axis="y", length=0)
    for k in range(1, len(names)):
        panel.axhline(k - 0.5, color="white", lw=1.5)
    panel.spines[:].set_visible(False)


def _colour(hole: int) -> str:
    return COLOURS[hole % len(COLOURS)]
