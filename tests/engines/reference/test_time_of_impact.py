"""Time of impact on straight paths, against exact arithmetic and a numerical search."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sandbox.engines.reference.collision import CirclePipeline
from sandbox.engines.reference.manifold import KIND, circle_segment
from sandbox.engines.reference.time_of_impact import NEVER, touch_circle, touch_line, touch_segment
from tests.engines.builders import FLOOR, ball, body_store_of, scene_of

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples


def doubles(bound):
    """Draw doubles within ±bound; values whose squares would underflow become 0."""
    return st.floats(-bound, bound).map(lambda value: value if abs(value) > 1e-100 else 0.0)


coordinates, displacements = doubles(10), doubles(30)


def integers(*values):
    """Return doubles as integer multiples of a common unit."""
    ratios = [value.as_integer_ratio() for value in values]
    unit = max(denominator for _, denominator in ratios)
    return [numerator * (unit // denominator) for numerator, denominator in ratios]


def touches_exactly(x, y, mx, my, distance):
    """Return, by integer arithmetic, whether a path comes within a distance of the origin."""
    x, y, mx, my, distance = integers(x, y, mx, my, distance)
    along, length2 = x * mx + y * my, mx * mx + my * my
    if along >= 0:
        return False
    if -along >= length2:  # its nearest point is beyond its end
        return (x + mx) ** 2 + (y + my) ** 2 <= distance**2
    return (x * my - y * mx) ** 2 <= distance**2 * length2


def test_grazing_circles_are_classified_exactly():
    """20,000 paths pass a circle at its radius ± 1e-12 … 1e-3 of it."""
    random = np.random.default_rng(20)
    hits = 0
    for _ in range(20_000):
        radius, ratio, angle = random.uniform(0.1, 10), 10 ** random.uniform(0.1, 1.5), random.uniform(0, 2 * math.pi)
        miss = radius * (1 + random.choice((-1, 1)) * 10 ** random.uniform(-12, -3))
        half_length = radius * ratio
        x, y = (
            -half_length * math.cos(angle) - miss * math.sin(angle),
            -half_length * math.sin(angle) + miss * math.cos(angle),
        )
        mx, my = 2 * half_length * math.cos(angle), 2 * half_length * math.sin(angle)
        exact = touches_exactly(x, y, mx, my, radius)
        assert (touch_circle(x, y, mx, my, radius) != NEVER) == exact
        hits += exact
    assert 8_000 < hits < 12_000


@given(coordinates, coordinates, displacements, displacements, st.floats(0.1, 3))
def test_fraction_is_where_the_distance_is_first_reached(x, y, mx, my, distance):
    fraction = touch_circle(x, y, mx, my, distance)
    exact = touches_exactly(x, y, mx, my, distance)
    begins_inside = Fraction(x) ** 2 + Fraction(y) ** 2 <= Fraction(distance) ** 2
    if fraction == NEVER:
        speed = math.hypot(mx, my)
        # within rounding of a graze or of the end of the path, either answer is correct
        assert (
            not exact
            or abs(abs(x * my - y * mx) - speed * distance) < 1e-12 * speed * 20
            or (abs(math.hypot(x + mx, y + my) - distance) < 1e-12)
        )
        return
    assert 0.0 <= fraction <= 1.0
    assert x * mx + y * my < 0.0
    if begins_inside or fraction == 0.0:
        assert math.hypot(x, y) <= distance * (1 + 1e-15)  # a rounding of the square
        assert fraction == 0.0
        return
    # at a graze the fraction is accurate to the square root of rounding only, the distance to rounding
    assert math.hypot(x + fraction * mx, y + fraction * my) == pytest.approx(distance, abs=1e-11)
    earlier = np.linspace(0, fraction, 200)[:-1]
    assert np.hypot(x + earlier * mx, y + earlier * my).min() >= distance - 1e-11  # as above: not reached earlier


@given(coordinates, coordinates, displacements, displacements, st.floats(0.1, 3))
def test_separating_or_tangential_motion_never_touches(x, y, mx, my, distance):
    assume(Fraction(x) * Fraction(mx) + Fraction(y) * Fraction(my) >= 0)
    assume(abs(x * mx + y * my) > 1e-12 or x * mx + y * my == 0.0)
    assert touch_circle(x, y, mx, my, distance) == NEVER


@pytest.mark.parametrize(
    ("gap", "approach", "fraction"),
    [
        (1.0, 2.0, 0.5),
        (2.0, 2.0, 1.0),
        (2.0, 1.9, NEVER),
        (1.0, 0.0, NEVER),
        (1.0, -1.0, NEVER),
        (0.0, 1.0, 0.0),
        (0.0, 0.0, NEVER),
        (-0.5, 1.0, 0.0),
        (-0.5, 0.0, NEVER),
        (-0.5, -1.0, NEVER),
    ],
)
def test_line_is_reached_at_gap_over_approach(gap, approach, fraction):
    assert touch_line(gap, approach) == fraction


def gap_to(x, y, ax, ay, bx, by):
    return circle_segment(x, y, 0.0, ax, ay, bx, by, 0.0)[0]


def search_first_touch(x, y, mx, my, segment, distance):
    """Return the first fraction of a path within a distance of a segment, by search and bisection, and the least gap.

    The distance to a convex shape is a convex function along a line, so a golden-section search finds its minimum.
    """

    def gap(fraction):
        return gap_to(x + fraction * mx, y + fraction * my, *segment) - distance

    low, high = 0.0, 1.0
    for _ in range(200):
        one, two = low + 0.382 * (high - low), low + 0.618 * (high - low)
        low, high = (low, two) if gap(one) <= gap(two) else (one, high)
    nearest = min((0.0, low, 1.0), key=gap)
    if gap(nearest) > 0.0:
        return NEVER, gap(nearest)
    low, high = 0.0, nearest
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if gap(middle) <= 0.0 else (middle, high)
    return high, gap(nearest)


near = st.floats(-3, 3)


@given(near, near, st.floats(-9, 9), st.floats(-9, 9), near, near, near, near, st.floats(0.05, 1))
def test_segment_is_touched_where_a_search_finds_it(x, y, mx, my, ax, ay, bx, by, distance):
    begin = gap_to(x, y, ax, ay, bx, by) - distance
    assume(begin > 1e-9)
    fraction = touch_segment(x, y, mx, my, ax, ay, bx, by, distance)
    expected, nearest = search_first_touch(x, y, mx, my, (ax, ay, bx, by), distance)
    if abs(nearest) < 1e-9:  # a graze or the end of the path, within the accuracy of the search
        return
    if expected == NEVER:
        assert fraction == NEVER
        return
    reached = gap_to(x + fraction * mx, y + fraction * my, ax, ay, bx, by)
    assert reached == pytest.approx(distance, abs=1e-9)  # near a graze the fraction is less accurate, the gap is not
    assert fraction == pytest.approx(expected, abs=1e-4)  # the square root of the accuracy of the search


@given(near, near, st.floats(-9, 9), st.floats(-9, 9), st.floats(-2, 2), st.floats(-2, 2), st.floats(-2, 2), near)
def test_circle_that_overlaps_a_segment_touches_at_once_unless_it_separates(x, y, mx, my, ax, ay, bx, by):
    distance = 1.5
    gap, nx, ny = circle_segment(x, y, 0.0, ax, ay, bx, by, 0.0)
    assume(1e-6 < gap < distance - 1e-9)
    closing = mx * nx + my * ny
    assume(abs(closing) > 1e-6)
    assert touch_segment(x, y, mx, my, ax, ay, bx, by, distance) == (0.0 if closing > 0.0 else NEVER)


def test_circle_that_leaves_a_wall_near_its_end_does_not_touch_the_end():
    # On the wall from (0, 0) to (1, 0), near its right end, moving right and up: it separates but nears the end centre.
    assert touch_segment(0.95, 0.08, 1.0, 0.1, 0.0, 0.0, 1.0, 0.0, 0.1) == NEVER


@pytest.mark.parametrize(
    ("start", "way", "fraction"),
    [
        ((0.5, 2.0), (0.0, -4.0), 0.25),  # the side, from above: 2 → 1
        ((0.5, -2.0), (0.0, 4.0), 0.25),  # and from below
        ((-3.0, 0.0), (4.0, 0.0), 0.5),  # the round end: −3 → −1
        ((5.0, 0.0), (-4.0, 0.0), 0.75),  # the other end: 5 → 2
        ((-3.0, 1.0), (9.0, 0.0), NEVER),  # parallel, exactly at the distance and never nearer
        ((0.5, 2.0), (0.0, 4.0), NEVER),  # away
        ((0.5, 2.0), (0.0, 0.0), NEVER),  # not moving
    ],
)
def test_wall_is_reached_at_its_sides_and_its_ends(start, way, fraction):
    found = touch_segment(*start, *way, 0.0, 0.0, 1.0, 0.0, 1.0)
    if start[1] == 1.0:  # exactly at the distance and moving parallel: it may touch the top of the end's circle
        # the square root of rounding
        assert found == NEVER or start[0] + found * way[0] == pytest.approx(0.0, abs=1e-7)
    else:
        assert found == fraction


@given(coordinates, coordinates, displacements, displacements, coordinates, coordinates, st.floats(0.1, 3))
def test_segment_of_zero_length_is_touched_as_a_circle(x, y, mx, my, ax, ay, distance):
    one = touch_segment(x, y, mx, my, ax, ay, ax, ay, distance)
    assert one == touch_circle(x - ax, y - ay, mx, my, distance)


def pipeline_of(*balls, **document):
    store = body_store_of(scene_of(*balls, **document))
    return CirclePipeline(store, "grid"), store.position


def test_first_touch_of_several_is_identified_by_its_key():
    wall = {"points": [[0, -3], [4, -3]]}
    pipeline, start = pipeline_of(ball(0, 2), ball(2, 2), plane=[FLOOR | {"point": [0, -5]}], wall=[wall])
    ignored = np.empty(0, np.int64)
    down = np.array([[0.0, -10.0], [0.0, -8.0]])
    fraction, key = pipeline.first_touch(start, start + down, ignored)
    assert (fraction, key >> KIND) == (0.45, 2)  # 4.5 m of 10 to the wall
    fraction, key = pipeline.first_touch(start, start + down, np.array([key]))
    assert (fraction, key >> KIND) == (0.5625, 2)  # the other ball, 4.5 of 8
    fraction, key = pipeline.first_touch(start, start + np.array([[2.0, 0.0], [0.0, 0.0]]), ignored)
    assert (fraction, key >> KIND) == (0.5, 0)
    assert pipeline.first_touch(start, start, ignored)[1] == -1


def test_first_touch_of_balls_depends_on_relative_motion():
    pipeline, start = pipeline_of(ball(0, 0), ball(3, 0))
    ignored = np.empty(0, np.int64)
    fraction, _ = pipeline.first_touch(start, start + np.array([[100.0, 0.0], [99.0, 0.0]]), ignored)
    assert fraction == NEVER  # closes 1 m of a gap of 2 m
    fraction, _ = pipeline.first_touch(start, start + np.array([[100.0, 0.0], [96.0, 0.0]]), ignored)
    assert fraction == pytest.approx(0.5, rel=1e-14)  # rounding of differences of 100 m
