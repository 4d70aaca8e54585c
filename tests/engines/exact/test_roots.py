"""Quartics: first downward zero crossings against mpmath's roots."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.engines.exact.common.roots import (
    curved_entry,
    first_downward_root,
    first_touch,
    polynomial,
    quadratic_roots,
)
from sandbox.engines.exact.tabletop.events import path_box

small = st.floats(-10, 10).map(lambda x: round(x, 3))


def first_downward_root_by_mpmath(coefficients, until):
    """Return the first simple real root in (0, until] at which the polynomial falls, in 40 digits."""
    while coefficients and coefficients[-1] == 0:
        coefficients = coefficients[:-1]
    if len(coefficients) < 2:
        return math.inf
    with mpmath.workdps(40):
        terms = [mpmath.mpf(c) for c in coefficients]
        derivative = [k * c for k, c in enumerate(terms)][1:]
        real = []
        for start in np.roots(coefficients[::-1]).tolist():
            root = mpmath.mpc(start)
            for _ in range(8):  # Newton, from 1e-8 or better
                slope = sum(c * root**k for k, c in enumerate(derivative))
                root -= sum(c * root**k for k, c in enumerate(terms)) / slope if slope else 0
            if abs(root.imag) < mpmath.mpf(10) ** -15:
                real.append(root.real)
        real.sort()
        for root in real:
            slope = sum(k * mpmath.mpf(c) * root ** (k - 1) for k, c in enumerate(coefficients) if k)
            if 0 < root <= until and slope < 0:
                return float(root)
    return math.inf


@given(st.lists(small, min_size=5, max_size=5))
def test_first_downward_root_matches_40_digits(coefficients):
    coefficients[0] = abs(coefficients[0]) + 0.5
    found = first_downward_root(*coefficients, 50.0)
    expected = first_downward_root_by_mpmath(coefficients, 50.0)
    if found == expected == math.inf:
        return
    if math.isfinite(found) and math.isfinite(expected):
        slope = (polynomial(*coefficients, found + 1e-6) - polynomial(*coefficients, found - 1e-6)) / 2e-6
        scale = sum(abs(c) * found**k for k, c in enumerate(coefficients))
        # The error of a root is the rounding of the polynomial divided by its slope.
        assert abs(found - expected) <= 1e-14 * scale / max(abs(slope), 1e-12) + 1e-12 * found + 1e-7 * (
            abs(slope) < 1e-3
        )
    else:  # only a double root (a touch) may be found by one and not by the other
        t = min(found, expected)
        scale = sum(abs(c) * t**k for k, c in enumerate(coefficients))
        assert abs(polynomial(*coefficients, t)) <= 1e-12 * scale


@given(small, small, small)
def test_quadratic_roots_are_roots(a, b, c):
    for t in quadratic_roots(a, b, c):
        if math.isfinite(t):
            # rounding of three terms
            assert abs(a * t * t + b * t + c) <= 1e-13 * (abs(a * t * t) + abs(b * t) + abs(c))


@given(st.floats(-3, 3), st.floats(1.5, 6), st.floats(-5, 5), st.floats(-5, 5))
def test_ball_thrown_at_a_post_hits_it_where_its_parabola_does(x, y, vx, vy):
    found = curved_entry(-x, -y, -vx, -vy, 0.0, 9.81, 0.5, False, math.inf)
    gaps = [math.hypot(x + vx * t, y + vy * t - 4.905 * t * t) - 0.5 for t in (k * 1e-3 for k in range(4000))]
    inside = [k for k, gap in enumerate(gaps) if gap < -1e-9]
    if found == math.inf:
        assert not inside
        return
    assert abs(math.hypot(x + vx * found, y + vy * found - 4.905 * found**2) - 0.5) < 1e-12  # coordinates of about 10 m
    assert not inside or inside[0] * 1e-3 >= found - 1e-9  # it is the first


def test_touching_circles_are_judged_by_their_relative_motion():
    assert curved_entry(1.0, 0.0, -1.0, 0.0, 0.0, -1.0, 1.0, False, math.inf) == 0.0
    assert curved_entry(0.0, -1.0, 0.0, 0.0, 0.0, 9.81, 1.0, False, math.inf) == 0.0  # pressed together
    returning = curved_entry(0.0, -1.0, 0.0, -2.0, 0.0, 9.81, 1.0, True, math.inf)
    assert returning == pytest.approx(4 / 9.81, rel=1e-13)  # thrown up from the top of a post, and down again


def test_touch_of_a_distant_pair_is_as_accurate_as_its_coordinates():
    found = curved_entry(1e5, 0.3, -1e3, 0.0, -1.0, 0.0, 0.5, False, math.inf)
    gap = math.hypot(1e5 - (1e3 + 0.5 * found) * found, 0.3) - 0.5
    assert abs(gap) <= 1e-10  # rounding of 1e5 m is 1.5e-11 m; the squared distance loses 1e-6 m


def test_acceleration_with_a_square_of_zero_leaves_the_path_straight():
    assert curved_entry(3.0, 0.0, -1.0, 0.0, 0.0, 5e-207, 1.0, False, math.inf) == 2.0


def test_polynomial_that_is_zero_never_falls():
    assert first_downward_root(0.0, 0.0, 0.0, 0.0, 0.0, 1.0) == math.inf


@given(
    st.floats(0.6, 8),
    st.floats(0, 2 * math.pi),
    st.tuples(small, small, small, small),
    st.floats(0.05, 0.5),
    st.floats(0.01, 5),
)
def test_touch_within_a_limit_is_found_and_no_other(distance, direction, motion, radius, limit):
    """The quick tests of `first_touch`, which exclude most pairs, never exclude a touch within the limit."""
    dx, dy = distance * math.cos(direction), distance * math.sin(direction)
    vx, vy, ax, ay = motion
    coefficients = [
        dx * dx + dy * dy - radius * radius,
        2.0 * (dx * vx + dy * vy),
        vx * vx + vy * vy + dx * ax + dy * ay,
        vx * ax + vy * ay,
        0.25 * (ax * ax + ay * ay),
    ]
    expected = first_downward_root_by_mpmath(coefficients, math.inf)
    found = first_touch(dx, dy, vx, vy, ax, ay, radius, limit)
    if found < math.inf:
        x, y = dx + (vx + 0.5 * ax * found) * found, dy + (vy + 0.5 * ay * found) * found
        assert found <= limit
        assert abs(math.hypot(x, y) - radius) <= 1e-9  # it is a touch
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-6)  # a grazing one is badly conditioned
    elif expected <= limit * (1.0 - 1e-9):
        # Only a graze, whose closest distance is the radius up to rounding, may be found by one and not by the other.
        times = np.linspace(0.0, limit, 20_001)
        x, y = dx + (vx + 0.5 * ax * times) * times, dy + (vy + 0.5 * ay * times) * times
        assert np.hypot(x, y).min() >= radius * (1.0 - 1e-6)


@given(st.tuples(small, small, small, small, small, small), st.one_of(st.floats(0, 20), st.just(math.inf)))
def test_box_of_a_path_contains_it(motion, span):
    x, y, vx, vy, ax, ay = motion
    left, bottom, right, top = path_box(x, y, vx, vy, ax, ay, span)
    for t in np.linspace(0.0, min(span, 100.0), 101):
        assert left <= x + (vx + 0.5 * ax * t) * t <= right
        assert bottom <= y + (vy + 0.5 * ay * t) * t <= top
    if math.isfinite(span):
        times = np.linspace(0.0, span, 2001)
        # No larger than needed: the samples miss an apex by a·dt²/8.
        assert right - left <= np.ptp(x + (vx + 0.5 * ax * times) * times) + abs(ax) * (span / 2000) ** 2 + 1e-5
