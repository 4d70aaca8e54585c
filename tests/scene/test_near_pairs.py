"""Near pairs against all pairs, in exact arithmetic."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.scene.geometry import neighbours as near
from sandbox.scene.geometry.neighbours import near_pairs

Places = list[tuple[float, float]]


def check(places: Places, reach: float) -> list[tuple[int, int]]:
    """Check the promise of `near_pairs`, and return what it yields."""
    found = [
        (int(min(i, j)), int(max(i, j)))
        for first, second in near_pairs(np.array(places, dtype=float).reshape(-1, 2), reach)
        for i, j in zip(first, second, strict=True)
    ]
    assert len(found) == len(set(found))
    assert all(0 <= i < j < len(places) for i, j in found)
    exact = [(Fraction(x), Fraction(y)) for x, y in places]
    within = {
        (i, j)
        for j in range(len(exact))
        for i in range(j)
        if (exact[i][0] - exact[j][0]) ** 2 + (exact[i][1] - exact[j][1]) ** 2 < Fraction(reach) ** 2
    }
    assert within <= set(found)
    return found


@st.composite
def clusters(draw: st.DrawFn) -> tuple[Places, float]:
    """Points within a few reaches of each other, anywhere."""
    reach = draw(st.floats(1e-9, 1e9) | st.sampled_from([1e-9, 1.0, 1e9]))
    x, y = draw(st.tuples(*[st.floats(-1e16, 1e16) | st.sampled_from([0.0, 1e16, -1e16, 2.0**52 * reach])] * 2))
    step = st.floats(-3, 3) | st.sampled_from([-1.0, 0.0, 0.999999999, 1.0, 2.0])
    places = draw(st.lists(st.tuples(step, step), max_size=25))
    return [
        (float(np.clip(x + a * reach, -1e16, 1e16)), float(np.clip(y + b * reach, -1e16, 1e16))) for a, b in places
    ], reach


@given(st.lists(st.tuples(*[st.floats(-1e16, 1e16)] * 2), max_size=25), st.floats(1e-9, 1e9))
def test_pairs_of_points_anywhere(places: Places, reach: float) -> None:
    check(places, reach)


@given(clusters())
def test_pairs_of_points_close_together(both: tuple[Places, float]) -> None:
    check(*both)


@given(st.lists(st.tuples(*[st.integers(-4, 4).map(float)] * 2), max_size=40), st.sampled_from([0.5, 1.0, 1.5, 3.0]))
def test_pairs_of_points_on_a_lattice(places: Places, reach: float) -> None:
    check(places, reach)


@pytest.mark.parametrize("reach", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("place", [0.0, 1e16, -1e16, 0.1])
def test_coincident_points_are_all_paired(place: float, reach: float) -> None:
    assert len(check([(place, place)] * 12, reach)) == 12 * 11 // 2


@pytest.mark.parametrize("power", range(45, 55))
def test_pairs_where_cells_are_as_fine_as_the_numbers_themselves(power: int) -> None:
    base = 2.0**power * 1e-9
    line = [base]
    while len(line) < 12:
        line.append(float(np.nextafter(line[-1], np.inf)))
    check([(x, 0.0) for x in line] + [(x, 0.9e-9) for x in line], 1e-9)


def test_points_far_apart_are_not_paired() -> None:
    assert check([(x * 1e3, y * 1e3) for x in range(9) for y in range(9)], 1.0) == []


def test_none_and_one_have_no_pairs() -> None:
    assert check([], 1.0) == []
    assert check([(1.0, 2.0)], 1.0) == []


def test_chunks_say_the_same_as_one(monkeypatch: pytest.MonkeyPatch) -> None:
    places = [(float(x), float(y)) for x, y in np.random.default_rng(5).uniform(0, 6, (120, 2))]
    whole = set(check(places, 1.0))
    monkeypatch.setattr(near, "CHUNK", 7)
    chunks = list(near_pairs(np.array(places), 1.0))
    assert max(len(i) for i, _ in chunks) <= 7 + 120  # one point's own candidates may come on top
    assert set(check(places, 1.0)) == whole
