"""Paired samples: intervals, distances and tests against scipy and by hand."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from sandbox.arrays import FloatArray
from sandbox.measure.paired_samples import PairedDifference, adjusted_p_values, student_quantile

RANDOM = np.random.default_rng(3)


def p_value_by_hand(a: FloatArray, b: FloatArray) -> float:
    """Return the fraction of all exchanges whose smaller p-value of two tests is not above that of the samples."""
    distances, sums = [], []
    for exchanged in itertools.product((False, True), repeat=len(a)):
        first, second = np.where(exchanged, b, a), np.where(exchanged, a, b)
        distances.append(round(float(stats.ks_2samp(first, second, method="asymp").statistic), 9))
        sums.append(round(abs(float((first - second).sum())), 9))
    least = [
        min(sum(d >= own for d in distances), sum(s >= mean for s in sums))
        for own, mean in zip(distances, sums, strict=True)
    ]
    return sum(each <= least[0] for each in least) / len(least)


@pytest.mark.parametrize("freedom", [4, 5, 7, 12, 29, 100])
def test_student_quantile_is_that_of_scipy(freedom: int) -> None:
    # The next term of the expansion is below 0.4 % at 4 degrees of freedom and falls with its fourth power.
    assert student_quantile(freedom) == pytest.approx(stats.t.ppf(0.975, freedom), rel=4e-3 * (4 / freedom) ** 4 + 1e-9)


@given(st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=8, max_size=40))
def test_interval_and_distance_are_those_of_scipy(pairs: list[tuple[float, float]]) -> None:
    a, b = np.array(pairs).T
    found = PairedDifference.of(a, b)
    # The quantile is exact to 0.03 % from 7 degrees of freedom; rounding matters where all differences are equal.
    margin = {"rel": 1e-3, "abs": 1e-9}
    interval = stats.ttest_rel(a, b).confidence_interval(0.95) if (a - b).std() > 1e-6 else (found.low, found.high)
    half = 0.5 * (interval[1] - interval[0])
    assert found.difference == pytest.approx((a - b).mean(), abs=1e-12)
    assert 0.5 * (found.high - found.low) == pytest.approx(half, **margin)
    assert found.distance == pytest.approx(stats.wasserstein_distance(a, b), abs=1e-9)


@pytest.mark.fail_slow(60)  # scipy computes 256 distances one by one
@pytest.mark.parametrize("shift", [0.0, 0.4, 1.5])
def test_p_value_is_that_of_all_exchanges(shift: float) -> None:
    a, b = RANDOM.normal(size=8), RANDOM.normal(shift, size=8)
    assert PairedDifference.of(a, b).p_value == p_value_by_hand(a, b)


@pytest.mark.fail_slow(60)  # scipy computes 1024 distances one by one
def test_counts_with_ties_have_a_p_value_too() -> None:
    a, b = RANDOM.integers(3, size=10).astype(float), RANDOM.integers(3, size=10).astype(float)
    assert PairedDifference.of(a, b).p_value == p_value_by_hand(a, b)


def test_differences_below_the_resolution_do_not_count() -> None:
    a = RANDOM.normal(size=20)
    creeping = a * 0.0 + 1e-9
    assert PairedDifference.of(creeping, a * 0.0).p_value < 0.001
    assert PairedDifference.of(creeping, a * 0.0, 1e-6).p_value == 1.0


@pytest.mark.fail_slow(60)  # 300 tests of 4096 exchanges
def test_equal_distributions_are_found_different_in_no_more_than_the_stated_fraction() -> None:
    found = [PairedDifference.of(*RANDOM.exponential(size=(2, 30))).p_value for _ in range(300)]
    # An exchange test is exact: at most 5 % have p <= 0.05; 3 standard deviations of 300 trials are 3.8 %.
    assert np.mean(np.array(found) <= 0.05) < 0.088
    assert np.mean(np.array(found) <= 0.5) > 0.3  # nor is it far too cautious


def test_correlated_pairs_show_a_shift_that_their_spread_hides() -> None:
    a = RANDOM.normal(size=30)
    b = a + 0.1 + 0.01 * RANDOM.normal(size=30)
    found = PairedDifference.of(b, a)
    assert 0.09 < found.low < 0.1 < found.high < 0.11  # the standard error is 0.002, that of the means 0.18
    assert found.p_value < 0.001


def test_distributions_of_equal_mean_but_other_width_differ() -> None:
    a = RANDOM.normal(size=60)
    b = 4.0 * RANDOM.normal(size=60)
    assert PairedDifference.of(a - a.mean(), b - b.mean()).p_value < 0.05


def test_adjusted_p_values_are_those_of_holm() -> None:
    # The example of Holm's procedure: 3·0.01, max(0.03, 2·0.04), max(0.08, 1·0.03) in the order of the values.
    assert adjusted_p_values([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert adjusted_p_values([0.9, 0.8]) == [1.0, 1.0]
    assert adjusted_p_values([]) == []
