"""Scores of predictions, counted on synthetic samples."""

import pytest

from sandbox.measure.extremes.outcome import Outcome, Sample, Verdict
from sandbox.measure.extremes.runner import PredictionScore, prediction_scores
from sandbox.measure.extremes.scenarios import AXES

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps


def sample(verdict: Verdict, predicted: tuple[str, ...] = (), rule: str | None = None, axis: str = "speed") -> Sample:
    return Sample(axis, 1.0, "pymunk", {}, "pymunk", Outcome(verdict, "", rule, predicted=predicted))


def test_warnings_are_scored_by_the_failures_that_occurred() -> None:
    samples = [
        *[sample("failed", ("tunnelling", "spring"), "through")] * 3,
        sample("exact", ("tunnelling",)),
        sample("failed", ("tunnelling",), "energy"),  # failed for a different reason
        *[sample("failed", ("stack",), "through")] * 2,  # a different warning
        *[sample("degraded")] * 5,
        *[sample("refused", ("tunnelling",))] * 7,
        sample("failed", ("tunnelling",), "through", axis="friction"),  # an axis without a kind of warning
    ]
    (score,) = prediction_scores(samples, [AXES["speed"], AXES["friction"]])
    assert score == PredictionScore("tunnelling", 3, 2, 2, 5)
    assert score.precision == pytest.approx(3 / 5, rel=1e-15)  # one rounding
    assert score.recall == pytest.approx(3 / 5, rel=1e-15)  # as above


def test_precision_and_recall_are_none_without_predictions() -> None:
    (score,) = prediction_scores([sample("exact")], [AXES["speed"]])
    assert score == PredictionScore("tunnelling", 0, 0, 0, 1)
    assert (score.precision, score.recall) == (None, None)
    assert prediction_scores([], []) == ()


def test_axes_of_one_kind_have_a_common_score() -> None:
    axes = [AXES["stack"], AXES["tower_iterations"]]
    samples = [sample("failed", ("stack",), "stands", each.name) for each in axes]
    assert prediction_scores(samples, axes) == (PredictionScore("stack", 2, 0, 0, 0),)
