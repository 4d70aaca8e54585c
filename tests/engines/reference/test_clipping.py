"""Clipping: positions and feature ids of the two contact points of face against face."""

import math

import numpy as np
import pytest
from shapely import LineString, Point

from sandbox.engines.reference.polygon import REFERENCE_FACE_BIAS, clip, closest_points
from tests.engines.reference.outlines import box, capsule, collide, collide_plane, disc, moved, random_pairs

ROUNDING = 1e-15
"""A few ulps of numbers near 1."""


def test_aligned_boxes_touch_at_both_corners():
    rows = collide(box(), box(0, 0.99), reach=0.1)
    expected = [[0, 1, -0.01, 0.5, 0.495, 0], [0, 1, -0.01, -0.5, 0.495, 1]]
    assert rows == pytest.approx(np.array(expected), abs=ROUNDING)


@pytest.mark.parametrize("gap", [-0.01, 0.0, 0.01])
def test_overhanging_box_touches_where_the_faces_overlap(gap):
    rows = collide(box(), box(0.3, 1.0 + gap, 1.0, 1.0), reach=0.1)
    expected = [[0, 1, gap, 0.5, 0.5 + gap / 2, 0], [0, 1, gap, -0.2, 0.5 + gap / 2, 1]]
    assert rows == pytest.approx(np.array(expected), abs=ROUNDING)


def test_small_box_on_a_wide_box_touches_with_its_whole_face():
    rows = collide(box(0, 0, 100, 1), box(7, 0.6, 0.2, 0.2), reach=0.1)
    assert rows[:, 3] == pytest.approx([7.1, 6.9], abs=1e-14)  # ulps of 7


def test_box_touches_a_thick_wall_at_the_wall_radius():
    rows = collide(box(0, 0.6), capsule(-2, 0, 2, 0, 0.1), reach=0.05)
    expected = [[0, -1, 0.0, -0.5, 0.1, 0], [0, -1, 0.0, 0.5, 0.1, 1]]
    assert rows == pytest.approx(np.array(expected), abs=ROUNDING)


def test_parallel_capsules_touch_at_both_ends_of_their_overlap():
    rows = collide(capsule(0, 0, 2, 0, 0.3), capsule(1, 0.5, 3, 0.5, 0.3))
    expected = [[0, 1, -0.1, 2, 0.25, 0], [0, 1, -0.1, 1, 0.25, 1]]
    assert rows == pytest.approx(np.array(expected), abs=ROUNDING)


def test_contact_points_lie_midway_between_the_surfaces():
    """Each point has the same depth in both pieces, or the same distance from both, along the normal."""
    for p, q, size in random_pairs(21, 400):
        rows = collide(p, q)
        for row in rows:
            normal, separation, point = row[:2], row[2], row[3:5]
            near = ((p[0] - point) @ normal).max() + p[1] + separation / 2
            far = ((q[0] - point) @ normal).min() - q[1] - separation / 2
            one, other = sorted((abs(near), abs(far)))
            assert one == pytest.approx(0.0, abs=1e-9 * size)  # SLACK; the reference face is the same at both points
            if separation == rows[:, 2].min():
                # within the bias a corner may lie beside the face
                assert other == pytest.approx(0.0, abs=REFERENCE_FACE_BIAS * size)


def test_feature_ids_ascend_to_the_left_of_the_normal():
    for p, q, _ in random_pairs(23, 600):
        rows = collide(p, q)
        if len(rows) == 2:
            nx, ny = rows[0, :2]
            assert rows[1, :2].tolist() == [nx, ny]
            assert rows[:, 5].tolist() == [0.0, 1.0]
            assert rows[0, 3:5] @ (-ny, nx) <= rows[1, 3:5] @ (-ny, nx) + 1e-9  # the incident face is not square to n


def test_features_do_not_swap_when_a_box_rocks():
    lower = box(0, 0, 2, 1)
    for angle in np.linspace(-0.01, 0.01, 41):
        for p, q, sign in ((lower, box(0.2, 0.995, 1, 1, angle), 1), (box(0.2, 0.995, 1, 1, angle), lower, -1)):
            rows = collide(p, q, reach=0.1)
            right = rows[rows[:, 5] == (0.0 if sign > 0 else 1.0)]
            left = rows[rows[:, 5] == (1.0 if sign > 0 else 0.0)]
            assert right[0, 3] == pytest.approx(0.7, abs=0.01)  # half the height times the tilt
            assert left[0, 3] == pytest.approx(-0.3, abs=0.01)  # likewise


def test_single_remaining_point_keeps_its_feature():
    for angle, feature, x in ((-0.2, 0.0, 0.5), (0.2, 1.0, -0.5)):
        top = box(0, 0, 1, 1, angle)
        lift = 0.5 - 0.005 - top[0][:, 1].min()
        for rows in (
            collide(box(0, 0, 4, 1), moved(top, 0, lift), reach=0.01),
            collide(box(0, 0, 4, 1), moved(box(), 0, 0.995), reach=0.01)[[int(feature)]],
        ):
            assert rows[:, 5].tolist() == [feature]
            assert rows[0, 3] == pytest.approx(x, abs=0.12)  # the corner moves by 0.1 as the box tilts
        # On a plane the normal points down, which swaps left and right.
        rows = collide_plane(moved(top, 0, lift), (0.0, 0.5), (0.0, 1.0), 0.01)
        assert rows[:, 5].tolist() == [1.0 - feature]


def test_first_piece_keeps_the_reference_face_within_the_bias():
    """The second box overhangs by 1 m: when tilted, its corner sinks and its own face separates the pair better."""
    for height in (0.999, 1.001):  # in overlap and apart
        for angle in (-3e-4, -1e-5, 0.0, 1e-5, 3e-4):  # rad; the corner sinks by less than the bias
            rows = collide(box(), box(0, height, 3, 1, angle), reach=0.01)
            assert rows[:, :2].tolist() == [[0.0, 1.0], [0.0, 1.0]]
        for angle in (-6e-3, 6e-3):
            rows = collide(box(), box(0, height, 3, 1, angle), reach=0.01)
            assert rows[0, :2] == pytest.approx((-math.sin(angle), math.cos(angle)), abs=ROUNDING)


def test_collinear_and_repeated_corners_change_nothing():
    corners = [(-1, -1), (0.3, -1), (0.3, -1), (1, -1), (1, 0.2), (1, 1), (-0.5, 1), (0 - 0.6, 1), (-1, 1), (-1, 0)]
    many = (np.array(corners, dtype=float), 0.0)
    plain = box(0, 0, 2, 2)
    for x, y in ((0.0, 1.99), (0.4, 2.01), (1.99, 0.3), (-1.2, -1.9), (2.3, 2.4)):
        for other in (box(x, y, 2, 2), disc(x, y, 1.0), capsule(x - 1, y, x + 1, y, 0.5)):
            assert collide(many, other) == pytest.approx(collide(plain, other), abs=ROUNDING)
    assert collide_plane(many, (0, -1), (0, 1), 1.0) == pytest.approx(
        collide_plane(plain, (0, -1), (0, 1), 1.0), abs=ROUNDING
    )


def test_clip_keeps_the_part_above_the_face():
    corner = np.array([(0.0, 0.0), (2.0, 0.0), (3.0, -1.0), (1.0, -3.0), (5.0, 0.0), (6.0, 0.0)])
    over, *points = clip(corner, 0, 1, 2, 3, 0.0)
    # The face runs along x with its outside below; the other face spans 1 m to 3 m and is cut at 2 m.
    assert over
    assert points == [1.0, -3.0, 3.0, 2.0, -2.0, 2.0]
    assert not clip(corner, 0, 1, 4, 5, 0.0)[0]


def test_nearest_points_of_two_faces_match_shapely():
    random = np.random.default_rng(24)
    for _ in range(400):
        corner = random.normal(0, 1, (4, 2))
        one, other = LineString(corner[:2]), LineString(corner[2:])
        if one.crosses(other):
            continue
        distance, ax, ay, bx, by = closest_points(corner, 0, 1, 2, 3)
        assert distance == pytest.approx(one.distance(other), abs=1e-14)  # a few ulps of some metres
        assert math.dist((ax, ay), (bx, by)) == pytest.approx(distance, abs=1e-14)  # likewise
        assert one.distance(Point(ax, ay)) < 1e-14  # likewise
        assert other.distance(Point(bx, by)) < 1e-14  # likewise
