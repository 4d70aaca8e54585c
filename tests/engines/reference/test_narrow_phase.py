"""Narrow phase: the tutorial's cases; separations and normals against 50-digit arithmetic and against sampling."""

import doctest
import math

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sandbox.engines.reference import manifold as narrow_phase
from sandbox.engines.reference.collision import CirclePipeline
from sandbox.engines.reference.manifold import circle_circle, circle_half_plane, circle_segment
from tests.engines.builders import ball, body_store_of, scene_of

mpmath.mp.dps = 50

coordinates = st.floats(-100, 100)
radii = st.floats(1e-3, 10)

TUTORIAL = {2.0: False, 1.001: False, 1.0: False, 0.999: True, 0.009: True, 0.0: True, -1.0: True}


def test_docstring_examples_hold():
    # Compiled functions carry the docstring of the original, but doctest does not look into them.
    finder, runner = doctest.DocTestFinder(), doctest.DocTestRunner()
    plain = getattr(circle_half_plane, "py_func", circle_half_plane)
    for test in finder.find(plain, "circle_half_plane", globs=vars(narrow_phase)):
        runner.run(test)
    assert runner.summarize(verbose=False) == (0, 2)


@pytest.mark.parametrize("height", TUTORIAL)
def test_circle_and_half_plane_touch_as_the_tutorial_states(height):
    assert (circle_half_plane(0.0, height, 1.0, 0.0, 0.0, 0.0, 1.0)[0] < 0.0) is TUTORIAL[height]


@pytest.mark.parametrize("height", TUTORIAL)
def test_scene_has_contacts_as_the_tutorial_states(height):
    scene = scene_of(ball(0, height, radius=1), plane=[{"point": [0, 0], "normal": [0, 1]}])
    store = body_store_of(scene)
    contacts = CirclePipeline(store, "all_pairs").overlaps(store.position)
    assert (contacts.size == 1) is TUTORIAL[height]


def nearest(x, y, ax, ay, bx, by):
    """Return the nearest point of a segment, in 50 digits."""
    x, y, ax, ay, bx, by = map(mpmath.mpf, (x, y, ax, ay, bx, by))
    length2 = (bx - ax) ** 2 + (by - ay) ** 2
    fraction = mpmath.mpf(0)
    if length2:
        fraction = min(max(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length2, mpmath.mpf(0)), mpmath.mpf(1))
    return ax + fraction * (bx - ax), ay + fraction * (by - ay)


@given(coordinates, coordinates, radii, coordinates, coordinates, radii)
def test_circle_circle_matches_exact_arithmetic(ax, ay, a, bx, by, b):
    separation, nx, ny = circle_circle(ax, ay, a, bx, by, b)
    dx, dy = mpmath.mpf(bx) - mpmath.mpf(ax), mpmath.mpf(by) - mpmath.mpf(ay)
    distance = mpmath.hypot(dx, dy)
    assert separation == pytest.approx(float(distance - a - b), abs=1e-13)  # a few ulps of 280 m
    assume(distance > 1e-6)
    assert nx == pytest.approx(float(dx / distance), abs=1e-15)  # two roundings of a number up to 1
    assert ny == pytest.approx(float(dy / distance), abs=1e-15)  # likewise


@given(coordinates, coordinates, radii, coordinates, coordinates, st.floats(0, 2 * math.pi))
def test_circle_half_plane_matches_exact_arithmetic(x, y, radius, px, py, angle):
    nx, ny = math.cos(angle), math.sin(angle)
    separation, out_x, out_y = circle_half_plane(x, y, radius, px, py, nx, ny)
    exact = (mpmath.mpf(x) - px) * nx + (mpmath.mpf(y) - py) * ny - radius
    assert separation == pytest.approx(float(exact), abs=1e-13)  # a few ulps of 280 m
    assert (out_x, out_y) == (-nx, -ny)


@given(coordinates, coordinates, radii, coordinates, coordinates, coordinates, coordinates, st.floats(0, 1))
def test_circle_segment_matches_exact_arithmetic(x, y, radius, ax, ay, bx, by, half):
    separation, nx, ny = circle_segment(x, y, radius, ax, ay, bx, by, half)
    px, py = nearest(x, y, ax, ay, bx, by)
    distance = mpmath.hypot(px - x, py - y)
    # a few ulps of 280 m and of the fraction
    assert separation == pytest.approx(float(distance - radius - half), abs=1e-12)
    assume(distance > 1e-3)
    # the nearest point is known to some 1e-13 m
    assert nx == pytest.approx(float((px - x) / distance), abs=1e-9)
    assert ny == pytest.approx(float((py - y) / distance), abs=1e-9)  # likewise


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-2, 2), st.floats(-2, 2), st.floats(-2, 2), st.floats(-2, 2))
def test_no_sampled_point_of_a_segment_is_nearer_than_the_separation(x, y, ax, ay, bx, by):
    px, py = nearest(x, y, ax, ay, bx, by)
    lengths = math.dist((ax, ay), (bx, by)), mpmath.hypot(px - x, py - y)
    assume(all(length == 0.0 or length > 1e-150 for length in lengths))  # below this, squares lose digits
    separation, nx, ny = circle_segment(x, y, 0.5, ax, ay, bx, by, 0.1)
    fractions = np.linspace(0, 1, 2001)
    sampled = np.hypot(ax + fractions * (bx - ax) - x, ay + fractions * (by - ay) - y).min()
    assert separation + 0.6 <= sampled + 1e-14  # rounding of numbers of some metres
    assert separation + 0.6 >= sampled - math.dist((ax, ay), (bx, by)) / 4000 - 1e-14  # half a sample's spacing
    assert math.hypot(nx, ny) == pytest.approx(1.0, abs=1e-15)  # a reciprocal and two products


@given(coordinates, coordinates, radii, coordinates, coordinates, radii)
def test_swapping_circles_reverses_the_normal(ax, ay, a, bx, by, b):
    assume(math.dist((ax, ay), (bx, by)) > 1e-150)  # below this, squares underflow and the centres count as coincident
    one, other = circle_circle(ax, ay, a, bx, by, b), circle_circle(bx, by, b, ax, ay, a)
    assert one == (other[0], -other[1], -other[2])


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-2, 2), st.floats(-2, 2), st.floats(-2, 2), st.floats(-2, 2))
def test_swapping_the_ends_of_a_segment_changes_nothing(x, y, ax, ay, bx, by):
    one, other = (circle_segment(x, y, 0.5, ax, ay, bx, by, 0.1), circle_segment(x, y, 0.5, bx, by, ax, ay, 0.1))
    assert one[0] == pytest.approx(other[0], abs=1e-14)  # the fraction is measured from the other end
    assume(one[0] + 0.6 > 1e-3)
    assert one[1:] == pytest.approx(other[1:], abs=1e-11)  # 1e-14 m of 1e-3 m


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-2, 2), st.floats(-2, 2), radii)
def test_segment_of_zero_length_is_a_circle(x, y, ax, ay, half):
    assume(math.dist((x, y), (ax, ay)) > 1e-150)  # as above
    assert circle_segment(x, y, 0.5, ax, ay, ax, ay, half) == circle_circle(x, y, 0.5, ax, ay, half)


def test_coincident_centres_separate_along_x():
    assert circle_circle(2.0, 3.0, 0.5, 2.0, 3.0, 0.25) == (-0.75, 1.0, 0.0)
    assert circle_segment(2.0, 3.0, 0.5, 2.0, 3.0, 2.0, 3.0, 0.25) == (-0.75, 1.0, 0.0)


def test_circle_centred_on_a_segment_separates_to_its_left():
    # From (0, 0) to (2, 0) left is up; the normal points from the circle to the segment: down.
    assert circle_segment(1.0, 0.0, 0.5, 0.0, 0.0, 2.0, 0.0, 0.1) == (-0.6, 0.0, -1.0)
    assert circle_segment(1.0, 0.0, 0.5, 2.0, 0.0, 0.0, 0.0, 0.1) == (-0.6, 0.0, 1.0)


@given(coordinates, coordinates, st.floats(0.1, 2), st.floats(0, 2 * math.pi), st.floats(0.5, 0.99))
def test_contact_points_lie_midway_in_the_overlap(x, y, radius, angle, near):
    """A ball overlaps another ball or a post: the contact point has the same depth in both."""
    other = radius / 2
    distance = near * (radius + other)
    bx, by = x + distance * math.cos(angle), y + distance * math.sin(angle)
    for document in (
        {"ball": [ball(x, y, radius=radius, name="a"), ball(bx, by, radius=other, name="b")]},
        {"ball": [ball(x, y, radius=radius)], "post": [{"position": [bx, by], "radius": other}]},
    ):
        store = body_store_of(scene_of(*document.pop("ball"), **document))
        contacts = CirclePipeline(store, "all_pairs").overlaps(store.position)
        px, py = contacts.point[0]
        depth_a, depth_b = radius - math.dist((px, py), (x, y)), other - math.dist((px, py), (bx, by))
        assert depth_a == pytest.approx(depth_b, abs=1e-12)  # ulps of 140 m
        assert contacts.rn[0].tolist() == [radius, other]
