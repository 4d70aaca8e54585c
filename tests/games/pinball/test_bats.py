"""Outlines of flippers, against hulls of discs made by shapely and against their closed-form area."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import Point, Polygon, unary_union

from sandbox.games.pinball.build import bat
from sandbox.scene.geometry.polygon import is_convex, signed_area

sizes = st.tuples(st.floats(0.03, 0.1), st.floats(0.006, 0.015), st.floats(0.003, 0.015))


def area_of(length: float, base: float, tip: float) -> float:
    """Return the area of the hull of two discs, m².

    It is the sum of two sectors, and of two right trapezoids between the line of centres and a tangent.
    """
    angle = math.acos((base - tip) / length)
    tangent = math.sqrt(length**2 - (base - tip) ** 2)
    return (math.pi - angle) * base**2 + angle * tip**2 + (base + tip) * tangent


@given(sizes)
def test_flipper_outline_is_the_hull_of_its_discs(size: tuple[float, float, float]) -> None:
    length, base, tip = size
    outline = bat(length, base, tip, tolerance=1e-6)
    hull = unary_union([Point(0, 0).buffer(base, 256), Point(length, 0).buffer(tip, 256)]).convex_hull
    off = Polygon(outline).symmetric_difference(hull).area
    assert off < 4e-6 * hull.length  # the tolerance along the outline, and the same again for shapely's discs


@given(sizes)
def test_area_converges_to_the_closed_form_from_below(size: tuple[float, float, float]) -> None:
    exact = area_of(*size)
    rough, fine = (signed_area(bat(*size, tolerance=tolerance)) for tolerance in (5e-5, 5e-7))
    assert rough < exact
    # the area of the omitted segments is proportional to the tolerance
    assert exact - fine < 0.02 * (exact - rough) + 1e-15


@given(sizes)
def test_flipper_outline_is_convex_anticlockwise_and_symmetric(size: tuple[float, float, float]) -> None:
    outline = bat(*size)
    assert is_convex(outline)
    assert signed_area(outline) > 0.0
    flipped = sorted((x, -y) for x, y in outline)
    # by distance: rounding may exchange corners of equal x
    assert all(min(math.dist(a, b) for b in outline) < 1e-12 for a in flipped)


def test_flipper_outline_has_the_extent_of_its_discs() -> None:
    outline = bat(0.0702, 0.0116, 0.007)
    assert max(x for x, _ in outline) == pytest.approx(0.0772, abs=5e-5)  # the tolerance
    assert max(y for _, y in outline) == pytest.approx(0.0116, abs=5e-5)
