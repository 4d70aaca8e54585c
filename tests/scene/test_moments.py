"""Areas, centroids and second moments against closed forms, the parallel axis theorem and quadrature."""

import math
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from shapely.geometry import Polygon

from sandbox.scene.description.base import Point
from sandbox.scene.geometry.polygon import Moments, capsule_moments, disc_moments, polygon_moments

EXACT = 1e-12  # a handful of roundings of 1e-16 each, over sums of up to a few hundred terms


def rotated(points: Sequence[Point], angle: float, by: Point = (0.0, 0.0)) -> tuple[Point, ...]:
    c, s = math.cos(angle), math.sin(angle)
    return tuple((by[0] + c * x - s * y, by[1] + s * x + c * y) for x, y in points)


def radial(radii: Sequence[float]) -> tuple[Point, ...]:
    """A star-shaped outline about the origin with these radii."""
    step = 2 * math.pi / len(radii)
    return tuple((r * math.cos(step * i), r * math.sin(step * i)) for i, r in enumerate(radii))


stars = st.lists(st.floats(0.1, 1.0), min_size=3, max_size=40).map(radial)
angles = st.floats(-10.0, 10.0)


def assert_moments(got: Moments, expected: Moments, rel: float = EXACT) -> None:
    assert got.area == pytest.approx(expected.area, rel=rel)
    assert got.second == pytest.approx(expected.second, rel=rel)
    assert math.dist(got.centroid, expected.centroid) <= rel * math.sqrt(expected.area)


def test_disc_moments_are_the_closed_form() -> None:
    assert_moments(disc_moments((3.0, -4.0), 2.0), Moments(4 * math.pi, (3.0, -4.0), 8 * math.pi))


def test_annulus_sector_moments_approach_the_closed_form() -> None:
    inner, outer, half, n = 1.0, 2.0, 1.1, 20_000
    arc = [half * (2 * i / n - 1) for i in range(n + 1)]
    corners = [(outer * math.cos(t), outer * math.sin(t)) for t in arc]
    corners += [(inner * math.cos(t), inner * math.sin(t)) for t in reversed(arc)]
    area = half * (outer**2 - inner**2)
    x = 2 * math.sin(half) * (outer**3 - inner**3) / (3 * area)
    second = half * (outer**4 - inner**4) / 2 - area * x * x
    # chords of angle h omit h²/6 of a sector's area and h²/3 of its moment; the factor 4 allows for the subtraction
    assert_moments(polygon_moments(corners), Moments(area, (x, 0.0), second), rel=4 * (2 * half / n) ** 2)


@given(st.floats(0.0, 10.0) | st.just(0.0), st.floats(0.01, 10.0), angles)
def test_capsule_moments_agree_with_quadrature(length: float, radius: float, angle: float) -> None:
    a, b = rotated(((0.0, 0.0), (length, 0.0)), angle, by=(2.0, -1.0))

    def height(x: float) -> float:
        past = max(abs(x) - length / 2, 0.0)
        return math.sqrt(max(radius**2 - past**2, 0.0))

    def over_cap(power: int) -> float:
        # with x = L/2 + r·sin t, so that the integrand is smooth up to the end of the cap
        def slice_at(t: float) -> float:
            x, dx = length / 2 + radius * math.sin(t), radius * math.cos(t)
            y = height(x)
            return (2 * y if power == 0 else 2 * y * x * x + 2 * y**3 / 3) * dx

        return float(quad(slice_at, 0, math.pi / 2, epsabs=0, epsrel=1e-11)[0])

    area = 2 * radius * length + 2 * over_cap(0)
    second = 2 * radius * length**3 / 12 + 2 * radius**3 / 3 * length + 2 * over_cap(2)
    middle = (a[0] + b[0]) / 2, (a[1] + b[1]) / 2
    expected = Moments(area, middle, second)
    # height() cancels digits at the end of a cap, and `middle` those of a position 2 m off, 1 cm wide
    assert_moments(capsule_moments(a, b, radius), expected, rel=1e-9)


@given(stars)
def test_area_and_centroid_agree_with_shapely(points: tuple[Point, ...]) -> None:
    got, oracle = polygon_moments(points), Polygon(points)
    assert got.area == pytest.approx(oracle.area, rel=1e-11)  # shapely sums without compensation
    assert math.dist(got.centroid, (oracle.centroid.x, oracle.centroid.y)) < 1e-11  # of an extent of 2


@given(stars)
def test_second_moment_agrees_with_greens_theorem(points: tuple[Point, ...]) -> None:
    got = polygon_moments(points)
    cx, cy = got.centroid
    edges = list(zip(points, points[1:] + points[:1], strict=True))
    total = 0.0
    for (ax, ay), (bx, by) in edges:
        # ∮ x³/3 dy − y³/3 dx: a cubic along each edge, which Simpson's rule integrates exactly
        mx, my = (ax + bx) / 2 - cx, (ay + by) / 2 - cy
        cubes = [((ax - cx) ** 3, (ay - cy) ** 3, 1), (mx**3, my**3, 4), ((bx - cx) ** 3, (by - cy) ** 3, 1)]
        total += sum(weight * (x * (by - ay) - y * (bx - ax)) for x, y, weight in cubes) / 18
    assert got.second == pytest.approx(total, rel=1e-11)  # cancellation in the oracle


@given(stars, angles)
def test_moments_do_not_change_under_rotation(points: tuple[Point, ...], angle: float) -> None:
    before, after = polygon_moments(points), polygon_moments(rotated(points, angle))
    assert after.area == pytest.approx(before.area, rel=1e-11)  # rotation rounds every corner by 1e-16
    assert after.second == pytest.approx(before.second, rel=1e-11)
    assert math.dist(after.centroid, rotated([before.centroid], angle)[0]) < 1e-11


def test_moments_far_from_the_origin_keep_their_digits() -> None:
    # multiples of 2^-20, which a shift by 1e6 m does not round
    points = tuple((round(x * 2**20) / 2**20, round(y * 2**20) / 2**20) for x, y in radial([0.3, 1.0, 0.5, 0.9, 0.2]))
    near = polygon_moments(points)
    far = polygon_moments(tuple((x + 1e6, y - 1e6) for x, y in points))
    assert far.area == pytest.approx(near.area, rel=EXACT)
    assert far.second == pytest.approx(near.second, rel=EXACT)
    shifted = near.centroid[0] + 1e6, near.centroid[1] - 1e6
    assert far.centroid == pytest.approx(shifted, abs=2.4e-10)  # two units in the last place of 1e6


@pytest.mark.parametrize("points", [((0.0, 0.0), (0.0, 1.0), (1.0, 0.0)), ((0.0, 0.0), (1.0, 1.0), (2.0, 2.0))])
def test_polygon_moments_refuse_an_outline_without_area(points: tuple[Point, ...]) -> None:
    with pytest.raises(ValueError, match="enclose an area"):
        polygon_moments(points)
