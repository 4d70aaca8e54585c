"""near_pairs against all pairs in exact arithmetic."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.scene.geometry import neighbours as near
from sandbox.scene.geometry.neighbours import near_pairs

Points = list[tuple[float, float]]


def checked_pairs(points: Points, reach: float) -> list[tuple[int, int]]:
    """Check that `near_pairs` yields every pair within reach once, and return its pairs."""
    found = [
        (int(min(i, j)), int(max(i, j)))
        for first, second in near_pairs(np.array(points, dtype=float).reshape(-1, 2), reach)
        for i, j in zip(first, second, strict=True)
    ]
    assert len(found) == len(set(found))
    assert all(0 <= i < j < len(points) for i, j in found)
    exact = [(Fraction(x), Fraction(y)) for x, y in points]
    within = {
        (i, j)
        for j in range(len(exact))
        for i in range(j)
        if (exact[i][0] - exact[j][0]) ** 2 + (exact[i][1] - exact[j][1]) ** 2 < Fraction(reach) ** 2
    }
    assert within <= set(found)
    return found


@st.composite
def clusters(draw: st.DrawFn) -> tuple[Points, float]:
    """Points within a few times the reach of each other, around any centre, and some anywhere."""
    reach = draw(st.floats(1e-9, 1e9) | st.sampled_from([1e-9, 1.0, 1e9]))
    x, y = draw(st.tuples(*[st.floats(-1e16, 1e16) | st.sampled_from([0.0, 1e16, -1e16, 2.0**52 * reach])] * 2))
    step = st.floats(-3, 3) | st.sampled_from([-1.0, 0.0, 0.999999999, 1.0, 2.0])
    points = draw(st.lists(st.tuples(step, step), max_size=25))
    near = [(float(np.clip(x + a * reach, -1e16, 1e16)), float(np.clip(y + b * reach, -1e16, 1e16))) for a, b in points]
    return near + draw(st.lists(st.tuples(*[st.floats(-1e16, 1e16)] * 2), max_size=5)), reach


@given(clusters())
def test_near_pairs_of_clustered_points_include_all_within_reach(cluster: tuple[Points, float]) -> None:
    checked_pairs(*cluster)


@given(st.lists(st.tuples(*[st.integers(-4, 4).map(float)] * 2), max_size=40), st.sampled_from([0.5, 1.0, 1.5, 3.0]))
def test_near_pairs_on_a_lattice_include_all_within_reach(points: Points, reach: float) -> None:
    checked_pairs(points, reach)


@pytest.mark.parametrize(("coordinate", "reach"), [(0.0, 1.0), (1e16, 1e-9), (-1e16, 1e9), (0.1, 1e-9)])
def test_coincident_points_are_all_paired(coordinate: float, reach: float) -> None:
    assert len(checked_pairs([(coordinate, coordinate)] * 12, reach)) == 12 * 11 // 2


@pytest.mark.parametrize("power", (45, 49, 54))
def test_near_pairs_with_cells_as_small_as_the_float_spacing(power: int) -> None:
    base = 2.0**power * 1e-9
    line = [base]
    while len(line) < 12:
        line.append(float(np.nextafter(line[-1], np.inf)))
    checked_pairs([(x, 0.0) for x in line] + [(x, 0.9e-9) for x in line], 1e-9)


def test_points_far_apart_no_points_and_one_point_have_no_pairs() -> None:
    assert checked_pairs([(x * 1e3, y * 1e3) for x in range(9) for y in range(9)], 1.0) == []
    assert checked_pairs([], 1.0) == []
    assert checked_pairs([(1.0, 2.0)], 1.0) == []


def test_near_pairs_do_not_depend_on_the_chunk_size(monkeypatch: pytest.MonkeyPatch) -> None:
    points = [(float(x), float(y)) for x, y in np.random.default_rng(5).uniform(0, 6, (120, 2))]
    whole = set(checked_pairs(points, 1.0))
    monkeypatch.setattr(near, "CHUNK", 7)
    chunks = list(near_pairs(np.array(points), 1.0))
    assert max(len(i) for i, _ in chunks) <= 7 + 120  # the candidates of one point may exceed the chunk
    assert set(checked_pairs(points, 1.0)) == whole
