"""The Pareto front: no member is dominated, and every other point is."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.tradeoff.objective import is_dominated, pareto

NUMBERS = st.one_of(st.sampled_from([0.0, 1.0, 2.0, 3.0]), st.floats(0.0, 1e6))
"""A few values, so that ties are common, and a wide range."""
POINTS = st.lists(st.tuples(NUMBERS, NUMBERS), max_size=30)
Pair = tuple[float, float]


def cost(point: Pair) -> float:
    return point[0]


def error(point: Pair) -> float:
    return point[1]


def dominates(a: Pair, b: Pair) -> bool:
    """Return whether a is no worse than b in both coordinates, and better in one."""
    return a[0] <= b[0] and a[1] <= b[1] and a != b


@given(POINTS)
def test_members_of_the_front_are_not_dominated(points: list[Pair]) -> None:
    for member in pareto(points, cost, error):
        assert not any(dominates(other, member) for other in points)


@given(POINTS)
def test_points_outside_the_front_are_dominated(points: list[Pair]) -> None:
    front = pareto(points, cost, error)
    for point in points:
        assert point in front or any(dominates(member, point) for member in front)


@given(POINTS)
def test_front_is_sorted_by_cost_with_decreasing_error(points: list[Pair]) -> None:
    front = pareto(points, cost, error)
    for before, after in pairwise(front):
        assert before[0] < after[0]
        assert before[1] > after[1]


def test_first_of_equals_is_kept() -> None:
    equals = [("a", 1.0, 2.0), ("b", 1.0, 2.0), ("c", 1.0, 3.0)]
    assert pareto(equals, lambda each: each[1], lambda each: each[2]) == equals[:1]


def test_front_of_no_points_is_empty() -> None:
    assert pareto([], cost, error) == []


def test_dominance_needs_the_cost_margin_and_no_larger_error() -> None:
    assert is_dominated(10.0, 1.0, [(6.9, 1.0)], 0.7)
    assert not is_dominated(10.0, 1.0, [(7.1, 1.0)], 0.7)  # cheaper, but by less than the margin
    assert not is_dominated(10.0, 1.0, [(1.0, 1.1)], 0.7)  # cheaper, but less accurate


def test_no_point_dominates_itself() -> None:
    assert not is_dominated(0.0, 0.0, [(0.0, 0.0)], 0.7)
    assert not is_dominated(1.0, 0.0, [(1.0, 0.0)], 0.7)
