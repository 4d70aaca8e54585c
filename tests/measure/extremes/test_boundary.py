"""Search for boundaries on functions with known boundaries, monotone and not."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.extremes.boundary import Bracket, find_boundary, halfway
from sandbox.measure.extremes.experiment import Scale


def search_boundary(
    edge: float, levels: tuple[float, ...], scale: Scale = "log", falling: bool = False
) -> tuple[Bracket, int]:
    calls = 0

    def passes(level: float) -> bool:
        nonlocal calls
        calls += 1
        return level >= edge if falling else level <= edge

    known = {level: passes(level) for level in levels}
    calls = 0
    return find_boundary(known, passes, scale), calls


@given(st.floats(1.0, 9.9e5))
def test_boundary_is_found_within_1_percent_by_bisecting_the_logarithm(edge: float) -> None:
    result, calls = search_boundary(edge, (1.0, 1e2, 1e4, 1e6))
    assert result.limit is not None and result.first_failure is not None
    assert result.limit <= edge < result.first_failure <= result.limit / (1.0 - 0.01)  # the tolerance it is given
    assert result.monotone
    assert calls <= 12  # log2(ln(100)/0.01) = 8.8 bisections, and two calls beside the boundary


@given(st.floats(0.01, 0.99))
def test_boundary_of_a_decreasing_axis_is_found_within_1_percent(edge: float) -> None:
    result, _ = search_boundary(edge, (1.0, 0.1, 0.01 / 2), falling=True)
    assert result.limit is not None and result.first_failure is not None
    assert result.first_failure < edge <= result.limit <= result.first_failure / (1.0 - 0.01)  # as above
    assert result.monotone


@given(st.integers(5, 99))
def test_boundary_of_whole_numbers_is_exact(edge: int) -> None:
    result, _ = search_boundary(edge, (5, 20, 100), "whole")
    assert result.limit == edge
    assert result.first_failure == edge + 1 or edge == 100


def test_axis_without_a_passed_or_failed_level_has_an_open_boundary() -> None:
    assert search_boundary(1e9, (1.0, 10.0))[0] == Bracket(10.0, None, True)
    assert search_boundary(0.5, (1.0, 10.0))[0] == Bracket(None, 1.0, True)
    assert find_boundary({}, None, "log") == Bracket(None, None, True)


def test_boundary_without_bisection_is_between_levels() -> None:
    assert find_boundary({1.0: True, 2.0: False, 3.0: False}, None, "log") == Bracket(1.0, 2.0, True)
    assert find_boundary({1.0: True, 2.0: False, 3.0: True}, None, "log") == Bracket(1.0, 2.0, False)


@pytest.mark.parametrize(
    ("passes", "limit"),
    [
        (lambda x: x < 2.0 or 50.0 < x < 200.0, 2.0),  # passes again at a level
        (lambda x: x < 2.0 or 2.1 < x < 2.3, 2.0),  # passes again right beyond, between two levels
        (lambda x: x < 1.75 or 1.82 < x < 2.0, 2.0),  # fails just before
    ],
)
def test_failure_that_is_not_monotone_is_detected(passes: object, limit: float) -> None:
    assert callable(passes)
    result = find_boundary({x: passes(x) for x in (1.0, 4.0, 100.0)}, passes, "log")
    assert not result.monotone
    assert result.limit is not None
    assert result.limit == pytest.approx(limit, rel=0.15)  # one of the boundaries


@given(st.floats(1e-6, 1e6), st.floats(1e-6, 1e6))
def test_halfway_is_between_its_arguments(a: float, b: float) -> None:
    scales: tuple[Scale, ...] = ("log", "linear")
    for scale in scales:
        assert min(a, b) * (1.0 - 1e-12) <= halfway(a, b, scale) <= max(a, b) * (1.0 + 1e-12)  # a rounding or two


def test_halfway_from_zero_and_between_whole_numbers() -> None:
    assert halfway(0.0, 1.0, "log") == 0.5
    assert halfway(4, 5, "whole") == 4
    assert halfway(0, 2, "whole") == 1
