"""Convex decomposition: parts are convex, counter-clockwise, inside the outline, disjoint, and cover it."""

import math
from collections.abc import Sequence
from itertools import combinations

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from shapely.geometry import Polygon, box
from shapely.ops import unary_union

from sandbox.scene.description.base import Point
from sandbox.scene.geometry.polygon import (
    OutlineError,
    anticlockwise,
    is_convex,
    orient2d,
    outline_fault,
    signed_area,
    straightness_tolerance,
)
from sandbox.scene.geometry.triangulation import convex_parts, triangles

L = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0))
U = ((0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (2.0, 2.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0))
T = ((0.0, 2.0), (1.0, 2.0), (1.0, 0.0), (2.0, 0.0), (2.0, 2.0), (3.0, 2.0), (3.0, 3.0), (0.0, 3.0))


# A simple outline on which convex_decomposition of pymunk 7.3.1 recurses until the stack is full, at any tolerance.
RECURSING = ((4.0, 5.0), (3.0, 3.0), (2.0, 5.0), (2.0, 3.0), (3.0, 0.0), (4.0, 4.0), (3.0, 2.0))


def moved(points: Sequence[Point], angle: float, by: Point = (0.0, 0.0)) -> tuple[Point, ...]:
    c, s = math.cos(angle), math.sin(angle)
    return tuple((by[0] + c * x - s * y, by[1] + s * x + c * y) for x, y in points)


def comb(teeth: int) -> tuple[Point, ...]:
    points = [(0.0, 0.0), (2.0 * teeth - 1, 0.0)]
    for i in reversed(range(teeth)):
        points += [(2.0 * i + 1, 9.0), (2.0 * i, 9.0)]
        points += [(2.0 * i, 1.0), (2.0 * i - 1, 1.0)] if i else []
    return tuple(points)


def star(tips: int) -> tuple[Point, ...]:
    step = math.pi / tips
    return tuple(
        ((1 - 0.6 * (i % 2)) * math.cos(step * i), (1 - 0.6 * (i % 2)) * math.sin(step * i)) for i in range(2 * tips)
    )


def gear(teeth: int) -> tuple[Point, ...]:
    profile = ((0.0, 0.8), (0.25, 0.8), (0.35, 1.0), (0.75, 1.0), (0.85, 0.8))
    polar = [(2 * math.pi * (i + fraction) / teeth, r) for i in range(teeth) for fraction, r in profile]
    return tuple((r * math.cos(t), r * math.sin(t)) for t, r in polar)


def spiral(n: int, turns: float = 3.0) -> tuple[Point, ...]:
    angles = [2 * math.pi * turns * i / (n - 1) for i in range(n)]
    outer, inner = ([((r + t) * math.cos(t), (r + t) * math.sin(t)) for t in angles] for r in (3, 1))
    return anticlockwise(outer + inner[::-1])


def assert_parts(points: tuple[Point, ...]) -> tuple[tuple[Point, ...], ...]:
    """Decompose an outline, check the parts against shapely, and return them."""
    assert outline_fault(points) is None
    parts = convex_parts(points)
    whole = Polygon(points)
    for part in parts:
        assert signed_area(part) > 0.0
        assert is_convex(part, straightness_tolerance(points))
        assert set(part) <= set(points)
    area = signed_area(points)
    assert math.fsum(map(signed_area, parts)) == pytest.approx(area, rel=1e-9)  # documented for convex_parts
    cut = [Polygon(part) for part in parts]
    for part in cut:
        assert part.difference(whole).area < 1e-9 * area  # shapely rounds the corners of intersections
    for first, second in combinations(cut[:12], 2):
        assert first.intersection(second).area < 1e-9 * area  # same reason
    reflex_corners = sum(
        orient2d(*corner) < 0 for corner in zip((*points[-1:], *points), points, (*points[1:], points[0]), strict=False)
    )
    assert len(parts) <= 2 * reflex_corners + 1  # Hertel and Mehlhorn's bound
    return parts


def test_convex_outline_is_returned_unchanged() -> None:
    square = ((0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    assert convex_parts(square) == (square,)


@pytest.mark.parametrize(("points", "count"), [(L, 2), (U, 3), (T, 2), (comb(40), 41)])
def test_known_shapes_are_cut_into_the_fewest_parts(points: tuple[Point, ...], count: int) -> None:
    assert len(assert_parts(points)) == count


@pytest.mark.parametrize("angle", [0.0, 0.1])
@pytest.mark.parametrize("points", [L, U, T, comb(5), star(50), gear(12), spiral(100), anticlockwise(RECURSING)])
def test_known_shapes_are_covered_at_any_angle(points: tuple[Point, ...], angle: float) -> None:
    assert_parts(moved(points, angle))


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("points", [comb(250), star(500), gear(200), spiral(500)])
def test_outlines_of_a_thousand_corners_are_covered(points: tuple[Point, ...]) -> None:
    assert_parts(points)


def test_corners_on_straight_edges_of_a_concave_outline_are_left_out() -> None:
    halved = tuple(
        p for a, b in zip(L, L[1:] + L[:1], strict=True) for p in (a, ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2))
    )
    for angle in (0.0, 0.7):
        parts = assert_parts(moved(halved, angle))
        assert {p for part in parts for p in part} == set(moved(L, angle))


@pytest.mark.parametrize("scale", [1e-6, 1e9])
def test_parts_do_not_depend_on_scale(scale: float) -> None:
    parts = convex_parts(tuple((scale * x, scale * y) for x, y in gear(7)))
    assert [len(part) for part in parts] == [len(part) for part in convex_parts(gear(7))]


def test_outline_far_from_the_origin_is_covered() -> None:
    for angle in (0.0, 0.3):
        assert len(convex_parts(moved(U, angle, by=(1e6, -1e6)))) == 3


@given(st.sets(st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=3), st.sampled_from([0.0, 0.4, 1.1]))
def test_random_polyominoes_are_covered(cells: set[tuple[int, int]], angle: float) -> None:
    union = unary_union([box(x, y, x + 1, y + 1) for x, y in cells])
    pieces = [union] if isinstance(union, Polygon) else list(union.geoms)
    for piece in pieces:  # holes are ignored; an outline that touches itself is a fault
        points = anticlockwise([(x, y) for x, y in piece.exterior.coords[:-1]])
        if outline_fault(points) is None:
            assert_parts(moved(points, angle))


coordinates = st.integers(0, 1000).map(lambda i: i / 1000) | st.integers(0, 6).map(lambda i: i / 6)


@given(st.lists(st.tuples(coordinates, coordinates), min_size=5, max_size=16, unique=True))
def test_random_simple_outlines_are_covered(points: list[Point]) -> None:
    simple = untangled(points)
    assume(simple is not None and outline_fault(simple) is None)
    assert simple is not None
    assert_parts(simple)


def untangled(points: list[Point]) -> tuple[Point, ...] | None:
    """Uncross edges until none cross; each swap shortens the perimeter, so the loop ends."""
    points = list(points)
    for _ in range(400):
        n = len(points)
        for i, j in combinations(range(n), 2):
            a, b, c, d = points[i], points[i + 1], points[j], points[(j + 1) % n]
            if j - i > 1 and orient2d(a, b, c) * orient2d(a, b, d) < 0 and orient2d(c, d, a) * orient2d(c, d, b) < 0:
                points[i + 1 : j + 1] = points[i + 1 : j + 1][::-1]
                break
        else:
            return anticlockwise(points)
    return None


def test_outline_with_a_waist_narrower_than_the_tolerance_is_refused() -> None:
    hourglass = ((0.0, 0.0), (2.0, 0.0), (1.0 + 1e-10, 1.0), (2.0, 2.0), (0.0, 2.0), (1.0 - 1e-10, 1.0))
    assert outline_fault(hourglass) is None
    with pytest.raises(OutlineError, match=r"too narrow .* split it by hand"):
        convex_parts(hourglass)


def area_of(points: tuple[Point, ...], cut: list[tuple[int, int, int]]) -> float:
    areas = [signed_area([points[i] for i in triangle]) for triangle in cut]
    assert min(areas) > 0.0
    return math.fsum(areas)


def test_triangle_is_not_divided() -> None:
    assert triangles(((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))) == [(2, 0, 1)]


def test_collinear_corners_make_no_triangle_without_area() -> None:
    outline = ((0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0), (0.0, 3.0), (0.0, 2.0), (0.0, 1.0))
    cut = triangles(outline)
    assert len(cut) == 5
    assert area_of(outline, cut) == 4.5


def test_diagonal_through_a_corner_is_not_used() -> None:
    arrow = ((0.0, 0.0), (2.0, -2.0), (4.0, 0.0), (2.0, 0.0), (2.0, 3.0), (1.9, 0.5))
    cut = triangles(arrow)
    assert len(cut) == 4
    assert area_of(arrow, cut) == pytest.approx(signed_area(arrow), rel=1e-15)  # sums of a few exact terms


def test_rectangle_is_cut_into_triangles_with_short_edges() -> None:
    box = ((0.0, 0.0), (4.0, 0.0), (8.0, 0.0), (8.0, 1.0), (4.0, 1.0), (0.0, 1.0))
    longest = max(max(math.dist(box[a], box[b]) for a, b in ((i, j), (j, k), (k, i))) for i, j, k in triangles(box))
    assert longest == math.hypot(4.0, 1.0)


def test_clockwise_outline_is_refused() -> None:
    with pytest.raises(OutlineError, match="cannot be triangulated"):
        triangles(((0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)))
