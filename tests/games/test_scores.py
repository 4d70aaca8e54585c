"""Statistics of scores, against numpy, and histogram bins of round widths that contain every score."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sandbox.games.scores import MAX_BINS, QUANTILES, Scores

SCORES = st.lists(st.one_of(st.integers(-1000, 10_000_000), st.floats(-1e6, 1e6)), min_size=1, max_size=60)


@given(scores=SCORES)
def test_statistics_are_those_of_the_sample(scores: list[float]) -> None:
    found = Scores.of(scores)
    assert found.count == len(scores) == sum(found.counts)
    assert found.mean == pytest.approx(np.mean(scores), rel=1e-12, abs=1e-9)  # rounding
    assert found.quantiles[0] == min(scores)
    assert found.quantiles[-1] == max(scores)
    assert list(found.quantiles) == sorted(found.quantiles)
    assert found.quantiles[QUANTILES.index(0.5)] == pytest.approx(np.median(scores), rel=1e-12, abs=1e-9)


@given(scores=SCORES)
@example(scores=[11.0, -5e-324])  # divided by the bin width it is -0
def test_bins_contain_all_scores_and_have_round_widths(scores: list[float]) -> None:
    found = Scores.of(scores)
    assert len(found.edges) == len(found.counts) + 1
    assert len(found.counts) <= MAX_BINS + 2  # the lowest and the highest score may each need one more bin
    assert found.edges[0] <= min(scores)
    assert max(scores) <= found.edges[-1] * (1.0 + 1e-12) + 1e-9  # rounding of an edge
    width = found.edges[1] - found.edges[0]
    assert f"{width:.0e}"[0] in "125"


@given(st.lists(st.integers(-40, 40), min_size=1, max_size=30))
def test_bins_of_integer_scores_have_integer_edges(scores: list[int]) -> None:
    assert all(edge == round(edge) for edge in Scores.of(scores).edges)


@pytest.mark.parametrize(("score", "edge"), [(0.3, 3), (0.6, 6), (0.7, 7)])
def test_bins_include_their_lower_edges(score: float, edge: int) -> None:
    found = Scores.of([score, 0.05, 1.0])
    k = found.edges.index(edge / 10)  # in floating point 3 × 0.1 is more than 0.3
    assert found.counts[k] == 1


def test_one_score_gives_one_bin() -> None:
    found = Scores.of([7])
    assert (found.deviation, found.counts) == (0.0, (1,))
    assert found.edges[0] <= 7 < found.edges[1]


def test_empty_sample_is_refused() -> None:
    with pytest.raises(ValueError, match="no game"):
        Scores.of([])
