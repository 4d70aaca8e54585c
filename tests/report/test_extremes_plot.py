"""Heat maps of extremes: every sample has its cell, colour and mark."""

from pathlib import Path

import pytest

from sandbox.measure.extremes.boundary import Boundary
from sandbox.measure.extremes.outcome import VERDICTS, Outcome, Sample
from sandbox.measure.extremes.runner import Extremes, ExtremesPlan
from sandbox.measure.extremes.scenarios import AXES, PAIRS
from sandbox.report.extremes_plot import COLOURS, MARKS, draw_axes, draw_pairs, level_text, plot_extremes


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
