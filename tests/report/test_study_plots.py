"""Plots of studies: heat maps of extremes, and the lines, front and limits of a trade-off."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from sandbox.measure.extremes.boundary import Boundary
from sandbox.measure.extremes.outcome import VERDICTS, Outcome, Sample
from sandbox.measure.extremes.runner import Extremes, ExtremesPlan
from sandbox.measure.extremes.scenarios import AXES, PAIRS
from sandbox.measure.proportion import Proportion
from sandbox.report.extremes_plot import COLOURS, MARKS, draw_axes, draw_pairs, level_text, plot_extremes
from sandbox.report.tradeoff_plot import draw_tradeoff, plot_tradeoff

pytestmark = pytest.mark.fail_slow(60)  # draws many pictures


def synthetic_extremes() -> Extremes:
    axis, pair = AXES["restitution"], PAIRS[0]
    plan = ExtremesPlan((axis,), (pair,), ("pymunk", "exact"))
    cells = tuple(
        Sample(axis.name, level, setup.engine, {}, setup.name, Outcome(VERDICTS[k % 4], ""))
        for setup in plan.setups(axis)
        for k, level in enumerate(axis.levels)
    )
    both = tuple(
        Sample(pair.name, level, setup.engine, {}, setup.name, Outcome(VERDICTS[k % 4], ""))
        for setup in plan.setups(pair)
        for k, level in enumerate(pair.levels)
    )
    limits = (Boundary(axis.name, "pymunk", {}, "pymunk", 0.5, 0.75, "", "energy"),)
    return Extremes(plan, cells, (), limits, both, 1.0)


def test_axes_have_a_mark_per_cell_and_the_boundary_beside() -> None:
    result = synthetic_extremes()
    (panel,) = draw_axes(result).axes
    texts = [text.get_text() for text in panel.texts]
    assert [texts.count(MARKS[word]) for word in VERDICTS] == [
        sum(cell.verdict == word for cell in result.cells) for word in VERDICTS
    ]
    assert "to 0.5: energy" in texts
    assert [label.get_text() for label in panel.get_yticklabels()] == ["pymunk", "pymunk, 4 substeps", "exact"]


def test_failed_level_with_survivors_has_their_tenths_and_a_lighter_colour() -> None:
    result = synthetic_extremes()
    failed = [k for k, cell in enumerate(result.cells) if cell.verdict == "failed"]
    cells, hits = list(result.cells), (0, 7, 14)
    for k, survivors in zip(failed, hits, strict=False):
        cells[k] = replace(cells[k], survived=Proportion(survivors, 20))
    (panel,) = draw_axes(replace(result, cells=tuple(cells))).axes
    pixels = np.asarray(panel.images[0].get_array())
    found = {(round(text.get_position()[1]), round(text.get_position()[0])): text.get_text() for text in panel.texts}
    colours = []
    for k, mark in zip(failed, (MARKS["failed"], "3", "7"), strict=False):
        row, column = divmod(k, 7)  # levels of restitution
        assert found[row, column] == mark
        colours.append(float(pixels[row, column].sum()))
    assert colours == sorted(set(colours))


def test_boundary_has_its_bounds_and_cost_beside() -> None:
    result = synthetic_extremes()
    limit = replace(result.limits[0], bounds=(0.25, 0.9), cost_ratio=2.5)
    (panel,) = draw_axes(replace(result, limits=(limit,))).axes
    assert "×2.5  to 0.5 (0.25–0.9): energy" in [text.get_text() for text in panel.texts]


def test_pairs_have_a_matrix_per_setup() -> None:
    figure = draw_pairs(synthetic_extremes())
    assert len(figure.axes) == 3
    assert [axes.get_title() for axes in figure.axes] == ["pymunk", "pymunk, 4 substeps", "exact"]


def test_pictures_are_written(tmp_path: Path) -> None:
    names = [path.name for path in plot_extremes(synthetic_extremes(), tmp_path)]
    assert names == ["extremes.png", "pairs.png"]
    assert all((tmp_path / name).stat().st_size > 5_000 for name in names)


def test_verdicts_differ_in_colour_and_mark() -> None:
    assert len(set(COLOURS.values())) == len(set(MARKS.values())) == len(VERDICTS)


@pytest.mark.parametrize(
    ("level", "text"),
    [(1 / 240, "1/240"), (0.001, "0.001"), (1e-5, "1e-5"), (1e6, "1e6"), (0.9999, "0.9999"), (20, "20"), (0.0, "0")],
)
def test_levels_are_short(level: float, text: str) -> None:
    assert level_text(level) == text


def point(engine: str, dt: float, error: float | None, cost: float | None, status: str = "ok") -> dict[str, Any]:
    return {
        "engine": engine,
        "settings": {"dt": dt, "substeps": 1},
        "error": error,
        "is_truth": engine == "exact",
        "cost_ms_per_second": cost,
        "repeats": 3,
        "status": status,
        "reason": None if status == "ok" else "it ran away",
    }


@pytest.fixture
def document() -> dict[str, Any]:
    points = [point("pymunk", 0.01, 0.1, 2.0), point("pymunk", 0.001, 0.01, 20.0), point("exact", 0.01, 0.0, 30.0)]
    failed = point("pymunk", 0.1, None, 0.5, "diverged")
    request = {"metric": "max_position", "unit": "m", "tolerance": 0.02, "budget": 0.5, "fps": 60.0}
    return {"title": "$x$ <b>", "points": [*points, failed], "pareto": points, **request}


def test_lines_are_methods_front_and_bounds(document: dict[str, Any]) -> None:
    (panel,) = draw_tradeoff(document).axes
    assert (panel.get_xscale(), panel.get_yscale()) == ("log", "log")
    fronts = [line for line in panel.lines if line.get_linewidth() == 3.0]
    assert [list(map(float, front.get_xdata())) for front in fronts] == [[2.0, 20.0, 30.0]]
    assert list(map(float, fronts[0].get_ydata())) == [0.1, 0.01, 0.001]  # 0 is drawn a decade below the smallest
    horizontal = [float(line.get_ydata()[0]) for line in panel.lines if list(line.get_xdata()) == [0, 1]]
    assert horizontal == [0.02]
    vertical = [float(line.get_xdata()[0]) for line in panel.lines if list(line.get_ydata()) == [0, 1]]
    assert vertical == [30.0]  # 0.5 ms per frame at 60 frames per second


def test_point_that_is_the_truth_is_labelled(document: dict[str, Any]) -> None:
    (panel,) = draw_tradeoff(document).axes
    assert [(text.get_text(), text.xy) for text in panel.texts] == [("truth", (30.0, 0.001))]


def test_errors_from_fresh_starts_are_a_range(document: dict[str, Any]) -> None:
    document["points"][1]["fresh_starts"] = {"error_5": 0.005, "median_error": 0.02, "error_95": 0.03}
    document["points"][0]["fresh_starts"] = {"error_5": 0.1, "median_error": 0.2, "error_95": None}  # runs failed
    (panel,) = draw_tradeoff(document).axes
    ranges = [line.get_xydata().tolist() for line in panel.lines if line.get_marker() == "_"]
    assert ranges == [[[20.0, 0.005], [20.0, 0.03]]]


def legend_of(figure: Figure) -> list[str]:
    """Return the texts of the legends of a figure and of its panels."""
    own = [found for panel in figure.axes if (found := panel.get_legend()) is not None]
    return [each.get_text() for legend in (*figure.legends, *own) for each in legend.get_texts()]


def test_settings_that_were_not_timed_are_hollow(document: dict[str, Any]) -> None:
    timed = draw_tradeoff(document)
    assert not any(text.startswith("not timed") for text in legend_of(timed))
    document["points"][1]["repeats"] = 0
    figure = draw_tradeoff(document)
    (panel,) = figure.axes
    drawn = {float(line.get_xdata()[0]): line for line in panel.lines if (line.get_gid() or "").startswith("point:")}
    hollow = {cost for cost, line in drawn.items() if line.get_markerfacecolor() == "white"}
    assert hollow == {20.0}
    assert "not timed: cost estimated from counted work" in legend_of(figure)


@pytest.mark.parametrize(("count", "text"), [(20, "5 to 95 %, median"), (7, "5 to 95 %, of fewer than 20 all, median")])
def test_legend_says_whether_ranges_are_quantiles(document: dict[str, Any], count: int, text: str) -> None:
    """Of 7 starts, the 5 and 95 % quantiles are the smallest and the largest error."""
    errors = {"error_5": 0.005, "median_error": 0.02, "error_95": 0.03}
    document["points"][1]["fresh_starts"] = {"held": {"trials": count}, **errors}
    assert f"fresh starts: {text}" in legend_of(draw_tradeoff(document))


def test_order_is_a_label_between_the_finest_points(document: dict[str, Any]) -> None:
    found = {"engine": "pymunk", "order": 1.04, "points": [0, 1]}
    document["orders"] = [found, found]  # a second one at the same place is left out
    (panel,) = draw_tradeoff(document).axes
    (label,) = [text for text in panel.texts if text.get_text() == "order 1.0"]
    assert label.xy == pytest.approx((40.0**0.5, 0.001**0.5), rel=1e-12)  # middle on logarithmic axes; rounding


def test_failure_is_a_cross_above_all_points_at_its_cost(document: dict[str, Any]) -> None:
    (panel,) = draw_tradeoff(document).axes
    ((x, y),) = [line.get_xydata()[0] for line in panel.lines if line.get_marker() == "x"]
    assert x == 0.5
    assert y > 0.1


@pytest.mark.parametrize("suffix", [".png", ".svg"])
def test_file_is_written(document: dict[str, Any], suffix: str, tmp_path: Path) -> None:
    path = plot_tradeoff(document, tmp_path / f"plot{suffix}")
    assert [each.name for each in tmp_path.iterdir()] == [path.name]
    assert path.stat().st_size > 1000
