"""Clipping: the two points of face against face, where they lie, and that they keep their names."""

import math

import numpy as np
import pytest
from shapely import LineString, Point

from sandbox.engines.reference.polygon import REFERENCE_FACE_BIAS, clip, closest_points
from tests.engines.reference.outlines import box, capsule, disc, met, met_plane, moved, pairs

ROUNDING = 1e-15
"""some ulps of numbers about 1"""


def test_a_box_square_on_another_touches_at_both_its_corners():
    rows = met(box(), box(0, 0.99), reach=0.1)
    expected = [[0, 1, -0.01, 0.5, 0.495, 0], [0, 1, -0.01, -0.5, 0.495, 1]]
    assert rows == pytest.approx(np.array(expected), abs=ROUNDING)


@pytest.mark.parametrize("gap", [-0.01, 0.0, 0.01])
def test_a_box_that_overhangs_touches_where_the_faces_overlap(gap):
    rows = met(box(), box(0.3, 1.0 + gap, 1.0, 1.0), reach=0.1)
    expected = [[0, 1, gap, 0.5, 0.5 + gap / 2, 0], [0, 1, gap, -0.2, 0.5 + gap / 2, 1]]
    assert rows == pytest.approx(np.array(expected), abs=ROUNDING)


def test_a_small_box_on_a_wide_one_touches_with_the_whole_of_its_face():
    rows = met(box(0, 0, 100, 1), box(7, 0.6, 0.2, 0.2), reach=0.1)
    assert rows[:, 3] == pytest.approx([7.1, 6.9], abs=1e-14)  # ulps of 7


def test_a_box_on_a_thick_wall_rests_at_its_radius():
    rows = met(box(0, 0.6), capsule(-2, 0, 2, 0, 0.1), reach=0.05)
    expected = [[0, -1, 0.0, -0.5, 0.1, 0], [0, -1, 0.0, 0.5, 0.1, 1]]
    assert rows == pytest.approx(np.array(expected), abs=ROUNDING)


def test_capsules_side_by_side_touch_at_both_ends_of_what_they_share():
    rows = met(capsule(0, 0, 2, 0, 0.3), capsule(1, 0.5, 3, 0.5, 0.3))
    expected = [[0, 1, -0.1, 2, 0.25, 0], [0, 1, -0.1, 1, 0.25, 1]]
    assert rows == pytest.approx(np.array(expected), abs=ROUNDING)


def test_points_lie_midway():
    """As deep in one piece as in the other, or as far from both, along the normal."""
    for p, q, size in pairs(21, 400):
        rows = met(p, q)
        for row in rows:
            normal, separation, point = row[:2], row[2], row[3:5]
            near = ((p[0] - point) @ normal).max() + p[1] + separation / 2
            far = ((q[0] - point) @ normal).min() - q[1] - separation / 2
            one, other = sorted((abs(near), abs(far)))
            assert one == pytest.approx(0.0, abs=1e-9 * size)  # SLACK; the reference face is the same at both points
            if separation == rows[:, 2].min():
                assert other == pytest.approx(
                    0.0, abs=REFERENCE_FACE_BIAS * size
                )  # by it a corner may be beside the face


def test_features_are_counted_along_the_normal_turned_left():
    for p, q, _ in pairs(23, 600):
        rows = met(p, q)
        if len(rows) == 2:
            nx, ny = rows[0, :2]
            assert rows[1, :2].tolist() == [nx, ny]
            assert rows[:, 5].tolist() == [0.0, 1.0]
            assert rows[0, 3:5] @ (-ny, nx) <= rows[1, 3:5] @ (-ny, nx) + 1e-9  # the incident face is not square to n


def test_features_do_not_swap_when_a_box_rocks():
    lower = box(0, 0, 2, 1)
    for angle in np.linspace(-0.01, 0.01, 41):
        for p, q, sign in ((lower, box(0.2, 0.995, 1, 1, angle), 1), (box(0.2, 0.995, 1, 1, angle), lower, -1)):
            rows = met(p, q, reach=0.1)
            right = rows[rows[:, 5] == (0.0 if sign > 0 else 1.0)]
            left = rows[rows[:, 5] == (1.0 if sign > 0 else 0.0)]
            assert right[0, 3] == pytest.approx(0.7, abs=0.01)  # half the height times the tilt
            assert left[0, 3] == pytest.approx(-0.3, abs=0.01)  # likewise


def test_a_point_that_is_left_alone_keeps_its_feature():
    for angle, feature, x in ((-0.2, 0.0, 0.5), (0.2, 1.0, -0.5)):
        top = box(0, 0, 1, 1, angle)
        lift = 0.5 - 0.005 - top[0][:, 1].min()
        for rows in (
            met(box(0, 0, 4, 1), moved(top, 0, lift), reach=0.01),
            met(box(0, 0, 4, 1), moved(box(), 0, 0.995), reach=0.01)[[int(feature)]],
        ):
            assert rows[:, 5].tolist() == [feature]
            assert rows[0, 3] == pytest.approx(x, abs=0.12)  # the corner moves by 0.1 as the box tilts
        # On a plane normals point down, so that left is right.
        rows = met_plane(moved(top, 0, lift), (0.0, 0.5), (0.0, 1.0), 0.01)
        assert rows[:, 5].tolist() == [1.0 - feature]


def test_the_first_keeps_the_reference_face_where_the_second_parts_them_little_better():
    """The second overhangs by 1 m: tilted, its corner sinks below the first's face, and its own face parts them."""
    for height in (0.999, 1.001):  # in overlap and apart
        for angle in (-3e-4, -1e-5, 0.0, 1e-5, 3e-4):  # rad; sinks by less than the favour
            rows = met(box(), box(0, height, 3, 1, angle), reach=0.01)
            assert rows[:, :2].tolist() == [[0.0, 1.0], [0.0, 1.0]]
        for angle in (-6e-3, 6e-3):
            rows = met(box(), box(0, height, 3, 1, angle), reach=0.01)
            assert rows[0, :2] == pytest.approx((-math.sin(angle), math.cos(angle)), abs=ROUNDING)


def test_corners_in_the_middle_of_a_face_change_nothing():
    corners = [(-1, -1), (0.3, -1), (0.3, -1), (1, -1), (1, 0.2), (1, 1), (-0.5, 1), (0 - 0.6, 1), (-1, 1), (-1, 0)]
    many = (np.array(corners, dtype=float), 0.0)
    plain = box(0, 0, 2, 2)
    for x, y in ((0.0, 1.99), (0.4, 2.01), (1.99, 0.3), (-1.2, -1.9), (2.3, 2.4)):
        for other in (box(x, y, 2, 2), disc(x, y, 1.0), capsule(x - 1, y, x + 1, y, 0.5)):
            assert met(many, other) == pytest.approx(met(plain, other), abs=ROUNDING)
    assert met_plane(many, (0, -1), (0, 1), 1.0) == pytest.approx(met_plane(plain, (0, -1), (0, 1), 1.0), abs=ROUNDING)


def test_clipping_keeps_what_lies_over_the_face():
    corner = np.array([(0.0, 0.0), (2.0, 0.0), (3.0, -1.0), (1.0, -3.0), (5.0, 0.0), (6.0, 0.0)])
    over, *points = clip(corner, 0, 1, 2, 3, 0.0)
    # The face runs along x, its outside below; the other from 1 m to 3 m, cut at 2 m.
    assert over
    assert points == [1.0, -3.0, 3.0, 2.0, -2.0, 2.0]
    assert not clip(corner, 0, 1, 4, 5, 0.0)[0]


def test_the_nearest_points_of_two_faces_are_those_of_shapely():
    random = np.random.default_rng(24)
    for _ in range(400):
        corner = random.normal(0, 1, (4, 2))
        one, other = LineString(corner[:2]), LineString(corner[2:])
        if one.crosses(other):
            continue
        distance, ax, ay, bx, by = closest_points(corner, 0, 1, 2, 3)
        assert distance == pytest.approx(one.distance(other), abs=1e-14)  # some ulps of some metres
        assert math.dist((ax, ay), (bx, by)) == pytest.approx(distance, abs=1e-14)  # likewise
        assert one.distance(Point(ax, ay)) < 1e-14  # likewise
        assert other.distance(Point(bx, by)) < 1e-14  # likewise
