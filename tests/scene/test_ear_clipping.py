"""Ear clipping: triangulation of simple outlines."""

import math

import pytest

from sandbox.scene.description.base import Point
from sandbox.scene.geometry.polygon import OutlineError, signed_area
from sandbox.scene.geometry.triangulation import triangles


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
