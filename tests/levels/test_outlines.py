"""Affine maps, curves as polygons, and merging of rectangles, against closed forms."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.levels.merging import TileRectangle, merge_rectangles
from sandbox.levels.outlines import (
    Affine,
    CircleShape,
    PolygonShape,
    RectangleShape,
    bezier_points,
    centroid,
    contains_point,
    ellipse_shape,
    outline_of,
    rectangle_shape,
    rotation,
    translation,
)
from sandbox.scene.geometry.polygon import signed_area

ROUNDING = 1e-12
"""Some roundings of numbers of order 1 to 100."""

sizes = st.floats(0.1, 10.0)
angles = st.floats(-3.0, 3.0)
offsets = st.floats(-50.0, 50.0)


@given(angle=angles, scale=sizes, dx=offsets, dy=offsets, mirror=st.booleans())
def test_circle_stays_a_circle_under_any_similarity(angle, scale, dx, dy, mirror):
    sign = -1.0 if mirror else 1.0
    transform = translation(dx, dy).after(rotation(angle)).after(Affine(scale, 0.0, 0.0, sign * scale))
    shape = ellipse_shape((3.0, 4.0), (2.0, 2.0), transform, 0.01)
    assert isinstance(shape, CircleShape)
    assert shape.radius == pytest.approx(2.0 * scale, rel=ROUNDING)
    assert shape.centre == pytest.approx(transform.apply(3.0, 4.0), abs=100 * ROUNDING)


@given(angle=angles, sx=sizes, sy=sizes, dx=offsets, dy=offsets)
def test_rectangle_that_is_scaled_along_its_sides_and_rotated_stays_one(angle, sx, sy, dx, dy):
    transform = translation(dx, dy).after(rotation(angle)).after(Affine(sx, 0.0, 0.0, -sy))
    shape = rectangle_shape((1.0, 2.0), (4.0, 3.0), transform)
    assert isinstance(shape, RectangleShape)
    assert shape.size == pytest.approx((4.0 * sx, 3.0 * sy), rel=ROUNDING)
    assert -0.5 * math.pi <= shape.angle <= 0.5 * math.pi
    expected = sorted(transform.apply(x, y) for x in (1.0, 5.0) for y in (2.0, 5.0))
    found = list(outline_of(shape, 0.01))
    for corner in expected:
        assert min(math.dist(corner, each) for each in found) < 1e-10  # rounding of numbers of order 100


def test_sheared_rectangle_is_a_polygon_of_the_same_area() -> None:
    shape = rectangle_shape((0.0, 0.0), (4.0, 3.0), Affine(1.0, 0.0, 0.5, 1.0))
    assert isinstance(shape, PolygonShape)
    assert abs(signed_area(shape.points)) == pytest.approx(12.0, rel=ROUNDING)


@pytest.mark.parametrize("tolerance", [0.1, 0.01, 1e-4])
@pytest.mark.parametrize("radii", [(3.0, 1.0), (1.0, 3.0), (0.02, 5.0)])
def test_ellipse_is_a_polygon_within_the_tolerance(radii: tuple[float, float], tolerance: float) -> None:
    shape = ellipse_shape((1.0, 2.0), radii, Affine(), tolerance)
    assert isinstance(shape, PolygonShape)
    area = math.pi * radii[0] * radii[1]
    missing = area - signed_area(shape.points)
    # Ramanujan
    perimeter = math.pi * (3 * sum(radii) - math.sqrt((3 * radii[0] + radii[1]) * (radii[0] + 3 * radii[1])))
    assert 0.0 < missing <= tolerance * perimeter
    xs, ys = zip(*shape.points, strict=True)
    assert (max(xs) - min(xs), max(ys) - min(ys)) == pytest.approx((2 * radii[0], 2 * radii[1]), rel=1e-12)


def test_number_of_corners_grows_with_the_square_root_of_the_accuracy() -> None:
    counts = []
    for tolerance in (1e-2, 1e-4):
        shape = ellipse_shape((0.0, 0.0), (2.0, 1.0), Affine(), tolerance)
        assert isinstance(shape, PolygonShape)
        counts.append(len(shape.points))
    assert counts[1] / counts[0] == pytest.approx(10.0, rel=0.15)  # whole multiples of four


def test_rounded_rectangle_has_the_area_of_its_sides_and_quarters() -> None:
    shape = rectangle_shape((0.0, 0.0), (10.0, 6.0), Affine(), 1e-4, (2.0, 1.0))
    assert isinstance(shape, PolygonShape)
    # tolerance × length
    assert signed_area(shape.points) == pytest.approx(60.0 - (4.0 - math.pi) * 2.0, abs=1e-4 * 40.0)


def test_rectangle_with_circular_corners_keeps_its_radius_and_outline() -> None:
    shape = rectangle_shape((0.0, 0.0), (10.0, 6.0), rotation(0.3).after(Affine(2.0, 0.0, 0.0, 2.0)), 1e-4, (1.0, 1.0))
    assert isinstance(shape, RectangleShape)
    assert (*shape.size, shape.radius) == pytest.approx((16.0, 8.0, 2.0), rel=1e-12)
    # tolerance × length
    assert signed_area(outline_of(shape, 1e-6)) == pytest.approx(240.0 - (4.0 - math.pi) * 4.0, abs=1e-6 * 64.0)


@pytest.mark.parametrize("radii", [(3.0, 3.0), (1.0, 0.5), (1.0, 1.0 + 1e-4)])
def test_rectangle_whose_corners_a_box_cannot_have_is_a_polygon(radii: tuple[float, float]) -> None:
    assert isinstance(rectangle_shape((0.0, 0.0), (10.0, 6.0), Affine(), 1e-4, radii), PolygonShape)


@given(st.lists(st.tuples(offsets, offsets), min_size=3, max_size=4), st.sampled_from([1.0, 0.1, 0.01]))
def test_bezier_curve_stays_within_the_tolerance_of_its_polyline(controls, tolerance):
    points = [controls[0], *bezier_points(controls, tolerance)]
    assert points[-1] == controls[-1]
    degree = len(controls) - 1
    for k in range(201):
        t = k / 200
        weights = [math.comb(degree, i) * t**i * (1 - t) ** (degree - i) for i in range(degree + 1)]
        x = sum(w * p[0] for w, p in zip(weights, controls, strict=True))
        y = sum(w * p[1] for w, p in zip(weights, controls, strict=True))
        index = min(int(t * (len(points) - 1)), len(points) - 2)
        fraction = t * (len(points) - 1) - index
        a, b = points[index], points[index + 1]
        near = a[0] + fraction * (b[0] - a[0]), a[1] + fraction * (b[1] - a[1])
        assert math.dist((x, y), near) <= tolerance + 1e-9  # rounding of numbers of order 100


def test_centroid_and_containment_of_a_concave_polygon() -> None:
    corner = ((0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0))
    assert centroid(corner) == pytest.approx((1.1, 1.1), rel=ROUNDING)  # (3·1.5 + 2·0.5) / 5
    assert contains_point(corner, (0.5, 2.5))
    assert not contains_point(corner, (2.0, 2.0))


cells = st.sets(st.tuples(st.integers(0, 7), st.integers(0, 7)), max_size=40)


@given(cells)
def test_merged_rectangles_cover_the_same_cells_once(cells: set[tuple[int, int]]) -> None:
    merged = merge_rectangles(TileRectangle(16.0 * x, 16.0 * y, 16.0, 16.0) for x, y in cells)
    covered = [
        (int(r.x / 16) + i, int(r.y / 16) + j)
        for r in merged
        for i in range(int(r.width / 16))
        for j in range(int(r.height / 16))
    ]
    assert len(covered) == len(set(covered))
    assert set(covered) == cells


def test_flat_floor_and_solid_block_become_one_rectangle() -> None:
    floor = [TileRectangle(10.0 * x, 50.0, 10.0, 10.0) for x in range(40)]
    assert merge_rectangles(floor) == [TileRectangle(0.0, 50.0, 400.0, 10.0)]
    block = [TileRectangle(10.0 * x, 10.0 * y, 10.0, 10.0) for x in range(5) for y in range(3)]
    assert merge_rectangles(block) == [TileRectangle(0.0, 0.0, 50.0, 30.0)]


def test_top_of_a_floor_with_a_pit_has_no_seam_but_the_pit() -> None:
    cells = {(x, 0) for x in range(10) if x not in (4, 5)} | {(x, 1) for x in range(10)}
    merged = merge_rectangles(TileRectangle(float(x), float(y), 1.0, 1.0) for x, y in cells)
    assert [(r.x, r.width) for r in merged if r.y == 0.0] == [(0.0, 4.0), (6.0, 4.0)]
