"""Orientation, convexity and faults of outlines, compared with closed forms, exact fractions and shapely."""

import math
from collections.abc import Sequence
from fractions import Fraction

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from shapely.geometry import Polygon

from sandbox.scene.description.base import Point
from sandbox.scene.geometry.polygon import anticlockwise, extent_of, is_convex, orient2d, outline_fault, signed_area

L = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0))
SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))

grid = st.integers(0, 4).map(float)
grid_points = st.lists(st.tuples(grid, grid), min_size=3, max_size=9).map(tuple)
close = st.integers(-4, 4).map(lambda ulps: 0.5 + ulps * 2.0**-53)


def moved(points: Sequence[Point], angle: float = 0.0, by: Point = (0.0, 0.0)) -> tuple[Point, ...]:
    c, s = math.cos(angle), math.sin(angle)
    return tuple((by[0] + c * x - s * y, by[1] + s * x + c * y) for x, y in points)


def test_area_of_an_outline_has_the_sign_of_its_orientation() -> None:
    assert signed_area(L) == 3.0
    assert signed_area(L[::-1]) == -3.0
    assert signed_area(moved(L, by=(1e6, -1e6))) == signed_area(moved(L, by=(1e15, 1e15))) == 3.0
    assert extent_of(((1.0, 1.0), (4.0, 2.0), (2.0, 3.0))) == 3.0


def test_anticlockwise_reverses_an_outline_and_keeps_its_first_corner() -> None:
    clockwise = (L[0], *L[:0:-1])
    assert anticlockwise(L) == L
    assert anticlockwise(clockwise) == L


@given(st.tuples(close, close), st.sampled_from([(12.0, 12.0), (24.0, 24.0), (0.5, 0.5)]))
def test_orientation_has_the_exact_sign_despite_rounding(a: Point, b: Point) -> None:
    c = (24.0, 24.0)
    ax, ay, bx, by = map(Fraction, (*a, *b))
    exact = (ax - 24) * (by - 24) - (ay - 24) * (bx - 24)
    assert (orient2d(a, b, c) > 0, orient2d(a, b, c) < 0) == (exact > 0, exact < 0)


def test_orientation_has_a_sign_when_its_products_underflow() -> None:
    assert orient2d((0.0, 0.0), (1e-200, 0.0), (0.0, 1e-200)) > 0.0
    assert orient2d((0.0, 0.0), (0.0, 1e-200), (1e-200, 0.0)) < 0.0


@pytest.mark.parametrize("n", [3, 4, 7, 1000])
def test_regular_polygon_is_convex(n: int) -> None:
    assert is_convex(tuple((math.cos(2 * math.pi * i / n), math.sin(2 * math.pi * i / n)) for i in range(n)))


def test_outline_with_a_reflex_corner_is_not_convex() -> None:
    assert not is_convex(L)
    assert not is_convex(((0.0, 0.0), (1.0, 1e-6), (2.0, 0.0), (1.0, 1.0)))


@given(st.floats(-10, 10), st.sampled_from([(0.0, 0.0), (1e6, -1e6), (1e12, 1e12)]))
def test_corners_on_straight_edges_stay_straight_when_moved(angle: float, by: Point) -> None:
    thirds = [i / 3 for i in range(3)]
    square = [(t, 0.0) for t in thirds] + [(1.0, t) for t in thirds]
    square += [(1 - t, 1.0) for t in thirds] + [(0.0, 1 - t) for t in thirds]
    assert is_convex(moved(square, angle, by))


@pytest.mark.parametrize(
    "points", [L[::-1], moved(L, 0.3, (1e6, 1e6)), ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (1.0, 2.0**-52), (0.0, 2.0))]
)
def test_valid_outline_has_no_fault(points: tuple[Point, ...]) -> None:
    assert outline_fault(points) is None


@pytest.mark.parametrize(
    ("points", "corner", "words"),
    [
        (((0.0, 0.0), (1.0, 0.0), (1.0, 1e-10), (0.0, 1.0)), 2, "points[1] and points[2] are 1e-10 m apart"),
        ((*SQUARE, SQUARE[0]), 0, "points[4] and points[0] are 0 m apart"),
        # neighbours of a large outline must be farther apart
        (((0.0, 0.0), (1e6, 0.0), (1e6, 1e-5), (0.0, 1e6)), 2, "at least 0.001 m"),
        (
            ((0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)),
            2,
            "the edge from points[2] to points[3] meets the edge from",
        ),
        (((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (1.0, 0.0), (0.0, 2.0)), 3, "meets the edge from points[0]"),
        (((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (1.0, -(2.0**-52)), (0.0, 2.0)), 3, "meets the edge from points[0]"),
        (((0.0, 0.0), (1.0, 0.0), (3.0, 0.0), (1.5, 0.0), (1.0, 1.0)), 2, "straight back at points[2]"),
        (((0.0, 0.0), (1.0, 1.0), (2.0, 2.0)), 0, "straight back"),
        (((0.0, 0.0), (1.0, 0.0), (0.5, 1e-13)), None, "5e-14 m²"),
    ],
)
def test_fault_of_an_outline_has_its_corner(points: tuple[Point, ...], corner: int | None, words: str) -> None:
    fault = outline_fault(points)
    assert fault[0] == corner
    assert words in fault[1]


@given(grid_points)
def test_outline_has_a_fault_exactly_if_shapely_finds_it_invalid(points: tuple[Point, ...]) -> None:
    repeats = any(a == b for a, b in zip(points, points[1:] + points[:1], strict=True))
    valid = not repeats and bool(Polygon(points).is_valid)
    assert (outline_fault(points) is None) == valid


@given(grid_points, st.integers(0, 8), st.booleans())
def test_fault_does_not_depend_on_first_corner_or_orientation(points, start, backwards):
    start %= len(points)
    other = points[start:] + points[:start]
    other = other[::-1] if backwards else other
    assert (outline_fault(points) is None) == (outline_fault(other) is None)


@given(st.lists(st.floats(0.1, 1.0), min_size=3, max_size=40), st.integers(0, 39), st.integers(0, 39))
def test_swapped_corners_of_a_star_are_a_fault_if_shapely_finds_one(radii: list[float], i: int, j: int) -> None:
    n = len(radii)
    i, j = i % n, j % n
    assume(i != j)
    points = [(r * math.cos(2 * math.pi * k / n), r * math.sin(2 * math.pi * k / n)) for k, r in enumerate(radii)]
    assert outline_fault(points) is None
    points[i], points[j] = points[j], points[i]
    assert (outline_fault(points) is None) == bool(Polygon(points).is_valid)
