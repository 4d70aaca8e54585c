"""Scores of forecasts, counted on made-up cells."""

import pytest

from sandbox.measure.extremes.outcome import Outcome, Sample, Verdict
from sandbox.measure.extremes.runner import PredictionScore, prediction_scores
from sandbox.measure.extremes.scenarios import AXES

pytestmark = pytest.mark.full  # long runs and sweeps


def cell(verdict: Verdict, predicted: tuple[str, ...] = (), rule: str | None = None, axis: str = "speed") -> Sample:
    return Sample(axis, 1.0, "pymunk", {}, "pymunk", Outcome(verdict, "", rule, predicted=predicted))


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
    (score,) = prediction_scores(cells, [AXES["speed"], AXES["friction"]])
    assert score == PredictionScore("tunnelling", 3, 2, 2, 5)
    assert score.precision == pytest.approx(3 / 5, rel=1e-15)  # one rounding
    assert score.recall == pytest.approx(3 / 5, rel=1e-15)  # as above


def test_shares_of_nothing_are_unknown() -> None:
    (score,) = prediction_scores([cell("exact")], [AXES["speed"]])
    assert score == PredictionScore("tunnelling", 0, 0, 0, 1)
    assert (score.precision, score.recall) == (None, None)
    assert prediction_scores([], []) == ()


def test_kinds_of_several_axes_are_one_score() -> None:
    axes = [AXES["stack"], AXES["tower_iterations"]]
    cells = [cell("failed", ("stack",), "stands", each.name) for each in axes]
    assert prediction_scores(cells, axes) == (PredictionScore("stack", 2, 0, 0, 0),)
