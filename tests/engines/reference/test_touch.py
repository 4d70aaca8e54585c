"""Touch: the first moment of contact on a straight way, judged in exact arithmetic and by a fine search."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sandbox.engines.reference.collision import CirclePipeline
from sandbox.engines.reference.manifold import KIND, circle_segment
from sandbox.engines.reference.time_of_impact import NEVER, touch_circle, touch_line, touch_segment
from tests.engines.reference.pieces import FLOOR, ball, roster_of, scene_of

pytestmark = pytest.mark.full  # property tests with many examples


def figures(most):
    """Draw doubles up to a figure, of which those whose squares would vanish are 0."""
    return st.floats(-most, most).map(lambda value: value if abs(value) > 1e-100 else 0.0)


places, ways = figures(10), figures(30)


def whole(*values):
    """Return doubles as whole numbers of one common unit."""
    ratios = [value.as_integer_ratio() for value in values]
    unit = max(denominator for _, denominator in ratios)
    return [numerator * (unit // denominator) for numerator, denominator in ratios]


def meets_exactly(x, y, mx, my, distance):
    """Tell, in whole numbers, whether a way comes as near as a distance to the origin before its end."""
    x, y, mx, my, distance = whole(x, y, mx, my, distance)
    along, length2 = x * mx + y * my, mx * mx + my * my
    if along >= 0:
        return False
    if -along >= length2:  # its nearest point lies beyond its end
        return (x + mx) ** 2 + (y + my) ** 2 <= distance**2
    return (x * my - y * mx) ** 2 <= distance**2 * length2


def test_grazing_circles_are_neither_missed_nor_invented():
    """20,000 ways that pass a circle at its radius but for 1e-12 … 1e-3 of it."""
    random = np.random.default_rng(20)
    hits = 0
    for _ in range(20_000):
        radius, far, angle = random.uniform(0.1, 10), 10 ** random.uniform(0.1, 1.5), random.uniform(0, 2 * math.pi)
        miss = radius * (1 + random.choice((-1, 1)) * 10 ** random.uniform(-12, -3))
        long = radius * far
        x, y = -long * math.cos(angle) - miss * math.sin(angle), -long * math.sin(angle) + miss * math.cos(angle)
        mx, my = 2 * long * math.cos(angle), 2 * long * math.sin(angle)
        exact = meets_exactly(x, y, mx, my, radius)
        assert (touch_circle(x, y, mx, my, radius) != NEVER) == exact
        hits += exact
    assert 8_000 < hits < 12_000


@given(places, places, ways, ways, st.floats(0.1, 3))
def test_the_share_is_where_the_distance_is_reached(x, y, mx, my, distance):
    share = touch_circle(x, y, mx, my, distance)
    exact = meets_exactly(x, y, mx, my, distance)
    begins_inside = Fraction(x) ** 2 + Fraction(y) ** 2 <= Fraction(distance) ** 2
    if share == NEVER:
        speed = math.hypot(mx, my)
        # in the last rounding of a graze, or of the end of the way, either answer is right
        assert (
            not exact
            or abs(abs(x * my - y * mx) - speed * distance) < 1e-12 * speed * 20
            or (abs(math.hypot(x + mx, y + my) - distance) < 1e-12)
        )
        return
    assert 0.0 <= share <= 1.0
    assert x * mx + y * my < 0.0
    if begins_inside or share == 0.0:
        assert math.hypot(x, y) <= distance * (1 + 1e-15)  # a rounding of the square
        assert share == 0.0
        return
    # in a graze the share is only good to the root of rounding, the distance is not
    assert math.hypot(x + share * mx, y + share * my) == pytest.approx(distance, abs=1e-11)
    earlier = np.linspace(0, share, 200)[:-1]
    assert np.hypot(x + earlier * mx, y + earlier * my).min() >= distance - 1e-11  # as above: nowhere before


@given(places, places, ways, ways, st.floats(0.1, 3))
def test_who_moves_away_or_along_never_touches(x, y, mx, my, distance):
    assume(Fraction(x) * Fraction(mx) + Fraction(y) * Fraction(my) >= 0)
    assume(abs(x * mx + y * my) > 1e-12 or x * mx + y * my == 0.0)
    assert touch_circle(x, y, mx, my, distance) == NEVER


@pytest.mark.parametrize(
    ("gap", "approach", "share"),
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
def test_lines_are_reached_by_simple_division(gap, approach, share):
    assert touch_line(gap, approach) == share


def gap_to(x, y, ax, ay, bx, by):
    return circle_segment(x, y, 0.0, ax, ay, bx, by, 0.0)[0]


def searched(x, y, mx, my, segment, distance):
    """Return the first share at which a way is nearer than a distance, by sampling and bisection, and the least gap.

    The distance to a convex thing is a convex function along a line, so that one golden section finds its minimum.
    """

    def far(share):
        return gap_to(x + share * mx, y + share * my, *segment) - distance

    low, high = 0.0, 1.0
    for _ in range(200):
        one, two = low + 0.382 * (high - low), low + 0.618 * (high - low)
        low, high = (low, two) if far(one) <= far(two) else (one, high)
    nearest = min((0.0, low, 1.0), key=far)
    if far(nearest) > 0.0:
        return NEVER, far(nearest)
    low, high = 0.0, nearest
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if far(middle) <= 0.0 else (middle, high)
    return high, far(nearest)


near = st.floats(-3, 3)


@given(near, near, st.floats(-9, 9), st.floats(-9, 9), near, near, near, near, st.floats(0.05, 1))
def test_segments_are_touched_where_a_search_finds_it(x, y, mx, my, ax, ay, bx, by, distance):
    begin = gap_to(x, y, ax, ay, bx, by) - distance
    assume(begin > 1e-9)
    share = touch_segment(x, y, mx, my, ax, ay, bx, by, distance)
    expected, nearest = searched(x, y, mx, my, (ax, ay, bx, by), distance)
    if abs(nearest) < 1e-9:  # a graze, or the end of the way, within what the search can tell
        return
    if expected == NEVER:
        assert share == NEVER
        return
    reached = gap_to(x + share * mx, y + share * my, ax, ay, bx, by)
    assert reached == pytest.approx(distance, abs=1e-9)  # in near grazes the share is worse, the gap is not
    assert share == pytest.approx(expected, abs=1e-4)  # the root of what the search can tell


@given(near, near, st.floats(-9, 9), st.floats(-9, 9), st.floats(-2, 2), st.floats(-2, 2), st.floats(-2, 2), near)
def test_who_is_in_a_segment_touches_at_once_or_moves_away(x, y, mx, my, ax, ay, bx, by):
    distance = 1.5
    gap, nx, ny = circle_segment(x, y, 0.0, ax, ay, bx, by, 0.0)
    assume(1e-6 < gap < distance - 1e-9)
    closing = mx * nx + my * ny
    assume(abs(closing) > 1e-6)
    assert touch_segment(x, y, mx, my, ax, ay, bx, by, distance) == (0.0 if closing > 0.0 else NEVER)


def test_who_leaves_a_wall_near_its_end_does_not_touch_the_end():
    # On the wall from (0, 0) to (1, 0), near its right end, going right and up: away, though towards the end's centre.
    assert touch_segment(0.95, 0.08, 1.0, 0.1, 0.0, 0.0, 1.0, 0.0, 0.1) == NEVER


@pytest.mark.parametrize(
    ("start", "way", "share"),
    [
        ((0.5, 2.0), (0.0, -4.0), 0.25),  # the side, from above: 2 → 1
        ((0.5, -2.0), (0.0, 4.0), 0.25),  # and from below
        ((-3.0, 0.0), (4.0, 0.0), 0.5),  # the round end: −3 → −1
        ((5.0, 0.0), (-4.0, 0.0), 0.75),  # the other: 5 → 2
        ((-3.0, 1.0), (9.0, 0.0), NEVER),  # along, grazing nothing: exactly at the distance, and not nearer
        ((0.5, 2.0), (0.0, 4.0), NEVER),  # away
        ((0.5, 2.0), (0.0, 0.0), NEVER),  # not moving
    ],
)
def test_a_wall_from_0_to_1_is_reached_at_its_sides_and_its_ends(start, way, share):
    found = touch_segment(*start, *way, 0.0, 0.0, 1.0, 0.0, 1.0)
    if start[1] == 1.0:  # touching exactly, moving along: the end's circle is met where its top is
        assert found == NEVER or start[0] + found * way[0] == pytest.approx(0.0, abs=1e-7)  # the root of rounding
    else:
        assert found == share


@given(places, places, ways, ways, places, places, st.floats(0.1, 3))
def test_a_segment_of_no_length_is_touched_as_a_circle(x, y, mx, my, ax, ay, distance):
    one = touch_segment(x, y, mx, my, ax, ay, ax, ay, distance)
    assert one == touch_circle(x - ax, y - ay, mx, my, distance)


def finder(*balls, **document):
    store = roster_of(scene_of(*balls, **document))
    return CirclePipeline(store, "grid"), store.position


def test_the_first_of_several_is_found_and_told_by_its_key():
    wall = {"points": [[0, -3], [4, -3]]}
    search, start = finder(ball(0, 2), ball(2, 2), plane=[FLOOR | {"point": [0, -5]}], wall=[wall])
    none = np.empty(0, np.int64)
    down = np.array([[0.0, -10.0], [0.0, -8.0]])
    share, key = search.first_touch(start, start + down, none)
    assert (share, key >> KIND) == (0.45, 2)  # 4.5 m of 10 to the wall
    share, key = search.first_touch(start, start + down, np.array([key]))
    assert (share, key >> KIND) == (0.5625, 2)  # the other ball, 4.5 of 8
    share, key = search.first_touch(start, start + np.array([[2.0, 0.0], [0.0, 0.0]]), none)
    assert (share, key >> KIND) == (0.5, 0)
    assert search.first_touch(start, start, none)[1] == -1


def test_relative_motion_decides_between_balls():
    search, start = finder(ball(0, 0), ball(3, 0))
    none = np.empty(0, np.int64)
    share, _ = search.first_touch(start, start + np.array([[100.0, 0.0], [99.0, 0.0]]), none)
    assert share == NEVER  # 1 m nearer of a gap of 2
    share, _ = search.first_touch(start, start + np.array([[100.0, 0.0], [96.0, 0.0]]), none)
    assert share == pytest.approx(0.5, rel=1e-14)  # of differences of 100 m
