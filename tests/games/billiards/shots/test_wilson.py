"""Bounds of probabilities against a known table and against what defines them."""

import math

import pytest

from sandbox.games.billiards.shots.monte_carlo import Z_95, wilson


@pytest.mark.parametrize(
    ("hits", "trials", "low", "high"),
    # Newcombe 1998, Statistics in Medicine 17, 857, table I, method 3
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_bounds_are_those_of_the_table(hits: int, trials: int, low: float, high: float) -> None:
    assert wilson(hits, trials) == pytest.approx((low, high), abs=5e-5)  # four digits are printed


@pytest.mark.parametrize(("hits", "trials"), [(1, 3), (7, 10), (400, 10_000), (9_999, 10_000)])
def test_a_bound_is_as_many_deviations_from_the_share_as_it_says(hits: int, trials: int) -> None:
    for p in wilson(hits, trials):
        off = abs(hits / trials - p) / math.sqrt(p * (1.0 - p) / trials)
        assert off == pytest.approx(Z_95, rel=1e-9)  # rounding of a difference of near figures


def test_bounds_turn_round_with_hits_and_misses() -> None:
    low, high = wilson(3, 50)
    assert wilson(47, 50) == pytest.approx((1.0 - high, 1.0 - low), abs=1e-15)  # rounding


def test_ends_are_ends_and_of_nothing_nothing_is_known() -> None:
    assert wilson(0, 7)[0] == 0.0
    assert wilson(7, 7)[1] == 1.0
    assert wilson(0, 0) == (0.0, 1.0)


def test_what_is_no_count_is_refused() -> None:
    with pytest.raises(ValueError, match="8 of 7 is not a count"):
        wilson(8, 7)
