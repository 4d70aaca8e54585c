"""Wilson bounds of probabilities, against a published table, their definition and scipy."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from sandbox.measure.proportion import Z_95, wilson_interval


@pytest.mark.parametrize(
    ("hits", "trials", "low", "high"),
    # Newcombe 1998, Statistics in Medicine 17, 857, table I, method 3
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_bounds_are_those_of_the_published_table(hits: int, trials: int, low: float, high: float) -> None:
    assert wilson_interval(hits, trials) == pytest.approx((low, high), abs=5e-5)  # four digits are printed


@pytest.mark.parametrize(("hits", "trials"), [(1, 3), (7, 10), (400, 10_000), (9_999, 10_000)])
def test_each_bound_is_the_stated_number_of_deviations_from_the_fraction(hits: int, trials: int) -> None:
    for p in wilson_interval(hits, trials):
        off = abs(hits / trials - p) / math.sqrt(p * (1.0 - p) / trials)
        assert off == pytest.approx(Z_95, rel=1e-9)  # rounding of a difference of close numbers


def test_bounds_of_hits_and_misses_are_complementary() -> None:
    low, high = wilson_interval(3, 50)
    assert wilson_interval(47, 50) == pytest.approx((1.0 - high, 1.0 - low), abs=1e-15)  # rounding


def test_bounds_without_hits_without_misses_and_without_trials() -> None:
    assert wilson_interval(0, 7)[0] == 0.0
    assert wilson_interval(7, 7)[1] == 1.0
    assert wilson_interval(0, 0) == (0.0, 1.0)


def test_more_hits_than_trials_are_refused() -> None:
    with pytest.raises(ValueError, match="8 of 7 is not a count"):
        wilson_interval(8, 7)


@given(st.integers(1, 500).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_bounds_are_those_of_scipy(case: tuple[int, int]) -> None:
    expected = binomtest(*case).proportion_ci(0.95, "wilson")
    # 1e-12: rounding of a few operations
    assert wilson_interval(*case) == pytest.approx((expected.low, expected.high), abs=1e-12)
