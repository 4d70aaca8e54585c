"""The front: no member is beaten, whoever is left out is."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.tradeoff.objective import is_dominated, pareto

FIGURES = st.one_of(st.sampled_from([0.0, 1.0, 2.0, 3.0]), st.floats(0.0, 1e6))
"""Few values, so that ties are common, and many."""
POINTS = st.lists(st.tuples(FIGURES, FIGURES), max_size=30)
Pair = tuple[float, float]


def cost(point: Pair) -> float:
    return point[0]


def error(point: Pair) -> float:
    return point[1]


def beats(a: Pair, b: Pair) -> bool:
    """Tell whether a is no worse than b in both, and better in one."""
    return a[0] <= b[0] and a[1] <= b[1] and a != b


@given(POINTS)
def test_members_are_not_beaten(points: list[Pair]) -> None:
    for member in pareto(points, cost, error):
        assert not any(beats(other, member) for other in points)


@given(POINTS)
def test_whoever_is_left_out_is_beaten_or_equalled(points: list[Pair]) -> None:
    front = pareto(points, cost, error)
    for point in points:
        assert point in front or any(beats(member, point) for member in front)


@given(POINTS)
def test_cheapest_is_first_and_each_next_is_dearer_and_more_right(points: list[Pair]) -> None:
    front = pareto(points, cost, error)
    for before, after in pairwise(front):
        assert before[0] < after[0]
        assert before[1] > after[1]


def test_first_of_equals_is_kept() -> None:
    equals = [("a", 1.0, 2.0), ("b", 1.0, 2.0), ("c", 1.0, 3.0)]
    assert pareto(equals, lambda each: each[1], lambda each: each[2]) == equals[:1]


def test_nothing_has_no_front() -> None:
    assert pareto([], cost, error) == []


def test_outdone_needs_the_margin_in_cost_and_no_more_error() -> None:
    assert is_dominated(10.0, 1.0, [(6.9, 1.0)], 0.7)
    assert not is_dominated(10.0, 1.0, [(7.1, 1.0)], 0.7)  # cheaper, but by less
    assert not is_dominated(10.0, 1.0, [(1.0, 1.1)], 0.7)  # cheaper, but less right


def test_nothing_outdoes_itself() -> None:
    assert not is_dominated(0.0, 0.0, [(0.0, 0.0)], 0.7)
    assert not is_dominated(1.0, 0.0, [(1.0, 0.0)], 0.7)
