"""Boundaries are found on functions whose boundary is known, monotone ones and others."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.extremes.boundary import Bracket, find_boundary, halfway
from sandbox.measure.extremes.experiment import Scale


def found(edge: float, levels: tuple[float, ...], scale: Scale = "log", falling: bool = False) -> tuple[Bracket, int]:
    asked = 0

    def passes(level: float) -> bool:
        nonlocal asked
        asked += 1
        return level >= edge if falling else level <= edge

    known = {level: passes(level) for level in levels}
    asked = 0
    return find_boundary(known, passes, scale), asked


@given(st.floats(1.0, 9.9e5))
def test_edge_is_found_within_a_hundredth_by_halving_the_logarithm(edge: float) -> None:
    result, asked = found(edge, (1.0, 1e2, 1e4, 1e6))
    assert result.limit is not None and result.first_failure is not None
    assert result.limit <= edge < result.first_failure <= result.limit / (1.0 - 0.01)  # the tolerance it is given
    assert result.monotone
    assert asked <= 12  # log2(ln(100)/0.01) = 8.8 halvings, and two looks beside


@given(st.floats(0.01, 0.99))
def test_edge_of_a_falling_axis_is_found_likewise(edge: float) -> None:
    result, _ = found(edge, (1.0, 0.1, 0.01 / 2), falling=True)
    assert result.limit is not None and result.first_failure is not None
    assert result.first_failure < edge <= result.limit <= result.first_failure / (1.0 - 0.01)  # as above
    assert result.monotone


@given(st.integers(5, 99))
def test_whole_numbers_are_told_from_their_neighbours(edge: int) -> None:
    result, _ = found(edge, (5, 20, 100), "whole")
    assert result.limit == edge
    assert result.first_failure == edge + 1 or edge == 100


def test_axis_that_never_fails_has_its_last_level_and_one_that_always_does_has_none() -> None:
    assert found(1e9, (1.0, 10.0))[0] == Bracket(10.0, None, True)
    assert found(0.5, (1.0, 10.0))[0] == Bracket(None, 1.0, True)
    assert find_boundary({}, None, "log") == Bracket(None, None, True)


def test_without_a_way_to_look_the_boundary_is_between_levels() -> None:
    assert find_boundary({1.0: True, 2.0: False, 3.0: False}, None, "log") == Bracket(1.0, 2.0, True)
    assert find_boundary({1.0: True, 2.0: False, 3.0: True}, None, "log") == Bracket(1.0, 2.0, False)


@pytest.mark.parametrize(
    ("passes", "limit"),
    [
        (lambda x: x < 2.0 or 50.0 < x < 200.0, 2.0),  # passes again at a level
        (lambda x: x < 2.0 or 2.1 < x < 2.3, 2.0),  # passes again right behind, where no level is
        (lambda x: x < 1.75 or 1.82 < x < 2.0, 2.0),  # has failed right before
    ],
)
def test_failing_that_is_not_monotone_is_noticed(passes: object, limit: float) -> None:
    assert callable(passes)
    result = find_boundary({x: passes(x) for x in (1.0, 4.0, 100.0)}, passes, "log")
    assert not result.monotone
    assert result.limit is not None
    assert result.limit == pytest.approx(limit, rel=0.15)  # one of the edges there are


@given(st.floats(1e-6, 1e6), st.floats(1e-6, 1e6))
def test_half_the_way_is_between(a: float, b: float) -> None:
    scales: tuple[Scale, ...] = ("log", "linear")
    for scale in scales:
        assert min(a, b) * (1.0 - 1e-12) <= halfway(a, b, scale) <= max(a, b) * (1.0 + 1e-12)  # a rounding or two


def test_half_the_way_from_nothing_is_half_and_between_neighbours_is_none() -> None:
    assert halfway(0.0, 1.0, "log") == 0.5
    assert halfway(4, 5, "whole") == 4
    assert halfway(0, 2, "whole") == 1
