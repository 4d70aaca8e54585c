"""Paired samples: intervals, distances and tests against scipy and by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from sandbox.arrays import FloatArray
from sandbox.measure.paired_samples import PairedDifference, adjusted_p_values, student_quantile

RANDOM = np.random.default_rng(3)


def ks(a: FloatArray, b: FloatArray) -> float:
    return float(stats.ks_2samp(a, b, method="asymp").statistic)


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


@pytest.mark.fail_slow(60)  # scipy tries 2048 exchanges one by one
@pytest.mark.parametrize("shift", [0.0, 0.4, 1.5])
@pytest.mark.parametrize("count", [8, 11])
def test_p_value_is_that_of_all_exchanges(shift: float, count: int) -> None:
    a, b = RANDOM.normal(size=count), RANDOM.normal(shift, size=count)
    # scipy exchanges the pairs too, and doubles nothing for a one-sided statistic; both enumerate all 2^n exchanges.
    known = stats.permutation_test((a, b), ks, permutation_type="samples", n_resamples=np.inf, alternative="greater")
    assert PairedDifference.of(a, b).p_value == pytest.approx(known.pvalue, abs=1e-12)


@pytest.mark.fail_slow(60)  # scipy tries 1024 exchanges one by one
def test_counts_with_ties_have_a_p_value_too() -> None:
    a, b = RANDOM.integers(3, size=10).astype(float), RANDOM.integers(3, size=10).astype(float)
    known = stats.permutation_test((a, b), ks, permutation_type="samples", n_resamples=np.inf, alternative="greater")
    assert PairedDifference.of(a, b).p_value == pytest.approx(known.pvalue, abs=1e-12)


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


def test_adjusted_p_values_are_those_of_holm() -> None:
    # The example of Holm's procedure: 3·0.01, max(0.03, 2·0.04), max(0.08, 1·0.03) in the order of the values.
    assert adjusted_p_values([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert adjusted_p_values([0.9, 0.8]) == [1.0, 1.0]
    assert adjusted_p_values([]) == []
