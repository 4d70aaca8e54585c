"""Scores of forecasts, counted on made-up cells."""

import pytest

from sandbox.measure.extremes.axes import AXES
from sandbox.measure.extremes.cell import Cell, Outcome, Word
from sandbox.measure.extremes.scoring import Score, scores


def cell(verdict: Word, predicted: tuple[str, ...] = (), rule: str | None = None, axis: str = "speed") -> Cell:
    return Cell(axis, 1.0, "pymunk", "pymunk", {}, Outcome(verdict, "", rule, predicted=predicted))


def test_warnings_are_held_against_what_came() -> None:
    cells = [
        *[cell("failed", ("tunnelling", "spring"), "through")] * 3,
        cell("exact", ("tunnelling",)),
        cell("failed", ("tunnelling",), "energy"),  # failed, but of something else
        *[cell("failed", ("stack",), "through")] * 2,  # warned of something else
        *[cell("degraded")] * 5,
        *[cell("refused", ("tunnelling",))] * 7,
        cell("failed", ("tunnelling",), "through", axis="friction"),  # an axis that is about no kind
    ]
    (score,) = scores(cells, [AXES["speed"], AXES["friction"]])
    assert score == Score("tunnelling", 3, 2, 2, 5)
    assert score.precision == pytest.approx(3 / 5, rel=1e-15)  # one rounding
    assert score.recall == pytest.approx(3 / 5, rel=1e-15)  # as above


def test_shares_of_nothing_are_unknown() -> None:
    (score,) = scores([cell("exact")], [AXES["speed"]])
    assert score == Score("tunnelling", 0, 0, 0, 1)
    assert (score.precision, score.recall) == (None, None)
    assert scores([], []) == ()


def test_kinds_of_several_axes_are_one_score() -> None:
    axes = [AXES["stack"], AXES["tower_iterations"]]
    cells = [cell("failed", ("stack",), "stands", each.name) for each in axes]
    assert scores(cells, axes) == (Score("stack", 2, 0, 0, 0),)
