"""Convex pieces: separations against shapely and qhull, contacts against pymunk, symmetries, extremes."""

import math
import subprocess
import sys

import numpy as np
import pymunk
import pytest
import shapely
from scipy.spatial import ConvexHull

from sandbox.engines.reference import polygon as convex
from sandbox.engines.reference.manifold import circle_circle, circle_segment
from sandbox.engines.reference.polygon import PARALLEL, REFERENCE_FACE_BIAS
from tests.engines.reference.outlines import (
    any_outline,
    body_of,
    box,
    capsule,
    disc,
    laid_out,
    met,
    met_plane,
    moved,
    pairs,
    ring,
    separation_of,
)
from tests.engines.reference.pieces import ROOT
from tests.environment import with_root_on_path

PAIRS = 1000


def scaled(outline, scale):
    return outline[0] * scale, outline[1] * scale


def deepest(rows):
    return rows[rows[:, 2].argmin()]


def nearest_to(exact, p, q):
    """Return the separations that p, q and q, p are told, the one nearer to the exact first."""
    told = [deepest(rows)[2] for rows in (met(p, q), met(q, p))]
    return sorted(told, key=lambda one: abs(one - exact))


def test_separations_are_shapelys_distances_and_qhulls_least_penetrations():
    overlaps = 0
    for p, q, size in pairs(1, PAIRS):
        exact = separation_of(p, q)
        overlaps += exact < 0.0
        one, other = nearest_to(exact, p, q)
        assert one == pytest.approx(exact, abs=1e-9 * size)  # SLACK
        assert other == pytest.approx(
            exact, abs=REFERENCE_FACE_BIAS * size
        )  # the first piece's face is favoured in one order
    assert 0.3 * PAIRS < overlaps < 0.7 * PAIRS


def test_separations_hold_from_micrometres_to_a_thousand_kilometres():
    random = np.random.default_rng(2)
    for k in range(PAIRS):
        scales = 10.0 ** random.uniform(-6, 6, 2)
        if k % 2:
            scales[1] = scales[0]
        p, q = (scaled(any_outline(random), scale) for scale in scales)
        share = random.choice([0.0, random.random()])
        side = random.integers(len(p[0]))
        target = (1.0 - share) * p[0][side] + share * p[0][(side + 1) % len(p[0])]
        # Some corner of the second is near some place on the rim of the first.
        q = moved(q, *(target - q[0][0] + random.normal(0.0, 0.1 * scales.min(), 2)))
        exact = separation_of(p, q)
        one, other = nearest_to(exact, p, q)
        rounding = 1e-14 * scales.max()  # some ulps of the coordinates
        assert one == pytest.approx(exact, abs=1e-9 * scales.min() + rounding)  # SLACK
        assert other == pytest.approx(
            exact, abs=3 * REFERENCE_FACE_BIAS * scales.min() + rounding
        )  # faces are up to 3 long


def test_moved_along_the_normal_by_the_separation_pieces_just_touch():
    for p, q, size in pairs(3, PAIRS):
        nx, ny, separation = deepest(met(p, q))[:3]
        assert math.hypot(nx, ny) == pytest.approx(1.0, abs=1e-15)  # two divisions, a root
        touching = moved(q, -separation * nx, -separation * ny)
        assert separation_of(p, touching) == pytest.approx(0.0, abs=REFERENCE_FACE_BIAS * size)  # as above


def test_normals_of_what_is_apart_lie_along_the_shortest_line():
    count = 0
    for p, q, size in pairs(8, PAIRS):
        line = shapely.shortest_line(body_of(p), body_of(q))
        if line.length > 1e-3 * size:
            count += 1
            (ax, ay), (bx, by) = line.coords
            normal = (bx - ax) / line.length, (by - ay) / line.length
            assert deepest(met(p, q))[:2] == pytest.approx(normal, abs=PARALLEL)  # level faces may change roles
    assert count > 0.3 * PAIRS


@pytest.mark.parametrize("gap", [1e-6, 1e-5, 1e-4])
@pytest.mark.parametrize("angle", [0.02, 0.2, 0.7])
def test_a_corner_near_the_end_of_a_face_keeps_that_faces_normal(gap, angle):
    """Its own faces part the two almost as well, but do not look along the shortest line."""
    tilted = box(0, 0, 1, 1, angle)
    top = tilted[0][2]
    p = moved(tilted, *(-top))  # its corner at the origin
    q = box(0.5 - 1e-4, 0.5 + gap)
    for one, other, sign in ((p, q, 1), (q, p, -1)):
        row = deepest(met(one, other, reach=0.01))
        assert row[:3] == pytest.approx((0.0, sign, gap), abs=1e-15)  # rounding


def test_nothing_is_written_beyond_the_reach():
    for p, q, _ in pairs(4, 600):
        rows = met(p, q)
        for reach in (*rows[:, 2], 0.0, 0.1):
            assert met(p, q, reach).tolist() == [row for row in rows.tolist() if row[2] < reach]


def test_swapping_the_pieces_turns_the_normal_round():
    same = 0
    for p, q, size in pairs(5, PAIRS):
        one, other = met(p, q), met(q, p)
        if len(one) != len(other) or abs(one[0, :2] + other[0, :2]).max() > 1e-12:
            # Two faces part them as well, but for the favour.
            assert deepest(one)[2] == pytest.approx(deepest(other)[2], abs=REFERENCE_FACE_BIAS * size)
            continue
        same += 1
        # Left of the normal is right of its opposite: what was the first point is the second.
        back = other[::-1] * (-1, -1, 1, 1, 1, 1)
        assert one[:, :5] == pytest.approx(back[:, :5], abs=1e-12 * size)  # rounding
        if len(one) == 2:
            assert one[:, 5].tolist() == other[:, 5].tolist() == [0.0, 1.0]
    assert same > 0.97 * PAIRS


def test_turned_and_shifted_together_pieces_touch_as_before():
    random = np.random.default_rng(6)
    alike = 0
    for p, q, size in pairs(6, PAIRS):
        angle, shift = random.uniform(0, 2 * math.pi), random.normal(0, 10, 2)
        one, other = met(p, q), met(moved(p, *shift, angle), moved(q, *shift, angle))
        assert deepest(one)[2] == pytest.approx(
            deepest(other)[2], abs=REFERENCE_FACE_BIAS * size
        )  # a tie may be decided otherwise
        turned = one.copy()
        turned[:, :2] = moved((one[:, :2], 0.0), 0.0, 0.0, angle)[0]
        turned[:, 3:5] = moved((one[:, 3:5], 0.0), *shift, angle)[0]
        alike += one.shape == other.shape and bool(
            abs(turned - other).max() < 1e-9
        )  # ulps of 10 m, made larger by tilt
    assert alike > 0.99 * PAIRS


def test_discs_are_met_as_the_table_of_discs_says():
    random = np.random.default_rng(7)
    for _ in range(300):
        x, y, a, b = *random.normal(0, 1, 2), *random.uniform(0.1, 1.0, 2)
        ends = random.normal(0, 1, 4)
        separation, *normal = circle_circle(0.0, 0.0, a, x, y, b)
        assert met(disc(0, 0, a), disc(x, y, b))[0, :3].tolist() == [*normal, separation]
        separation, *normal = circle_segment(x, y, a, *ends, b)
        assert met(disc(x, y, a), capsule(*ends, b))[0, :3].tolist() == [*normal, separation]


@pytest.mark.parametrize(
    ("x", "y", "normal", "separation"),
    [
        (0.2, 0.7, (0, -1), 0.1),  # over a face
        (0.5 + 0.3, 0.5 + 0.4, (-0.6, -0.8), 0.4),  # at a corner
        (0.1, 0.4, (0, -1), -0.2),  # inside: out through the nearest face
        (0.5, 0.1, (-1, 0), -0.1),  # on a face
        (0.5, 0.5, (-1, 0), -0.1),  # on a corner: the first of its two faces
    ],
)
def test_a_disc_meets_a_box_in_the_region_its_centre_is_in(x, y, normal, separation):
    row = met(disc(x, y, 0.1), box())[0]
    assert row[:3] == pytest.approx((*normal, separation), abs=1e-15)  # rounding of numbers under 1
    middle = 0.1 + 0.5 * separation
    assert row[3:5] == pytest.approx((x + normal[0] * middle, y + normal[1] * middle), abs=1e-15)  # likewise


def test_the_tests_taken_are_those_that_fit(monkeypatch):
    """A disc takes the faces of the polygon, two discs none, and a first axis that parts two boxes is the last."""
    plain = {}
    for name in (
        "collide_pieces",
        "collide_disc",
        "disc_polygon",
        "collide_faces",
        "select_faces",
        "widest_gap",
        "clip",
        "write_point",
    ):
        plain[name] = getattr(getattr(convex, name), "py_func", getattr(convex, name))
        monkeypatch.setattr(convex, name, plain[name])
    calls = []

    def counted(name, function):
        return lambda *arguments: calls.append(name) or function(*arguments)

    for name in ("widest_gap", "clip", "closest_points"):
        monkeypatch.setattr(convex, name, counted(name, getattr(convex, name)))

    def taken(p, q):
        calls.clear()
        plain["collide_pieces"](*laid_out(p, q), 0, 1, 0.01, np.zeros((2, 6)))
        return calls

    ball, bar = disc(0, 0, 1), capsule(0.5, 0, 1, 1, 0.1)
    assert taken(ball, ball) == taken(ball, bar) == taken(bar, ball) == []
    assert taken(ball, box()) == taken(box(), ball) == ["widest_gap"]
    assert taken(box(), box(2, 0)) == ["widest_gap"]
    assert taken(box(), box(0.9, 0)) == ["widest_gap", "widest_gap", "clip"]
    assert taken(box(), box(1.005, 0)) == ["widest_gap", "widest_gap", "clip", "closest_points"]


def test_a_corner_beside_the_end_of_a_wall_meets_its_round_end():
    rows = met(box(1.5 + 0.03, 0.5 + 0.04), capsule(0, 0, 1, 0, 0.02), reach=0.1)
    assert rows == pytest.approx(np.array([[-0.6, -0.8, 0.03, 1.021, 0.028, 0.0]]), abs=1e-15)  # rounding


def test_capsules_in_line_meet_with_their_ends():
    rows = met(capsule(0, 0, 1, 0, 0.2), capsule(1.3, 0, 2, 0, 0.2))
    assert rows == pytest.approx(np.array([[1, 0, -0.1, 1.15, 0, 0]]), abs=1e-15)  # rounding


def test_capsules_that_cross_part_across_the_nearer_way():
    rows = met(capsule(-1, 0, 1, 0, 0.1), capsule(0.2, -0.3, 0.2, 2, 0.1))
    assert deepest(rows)[:3] == pytest.approx((0, 1, -0.5), abs=1e-15)  # 0.3 and both radii


def test_a_box_on_a_plane_touches_at_its_two_lower_corners():
    rows = met_plane(box(2.0, 0.49), (0.0, 0.0), (0.0, 1.0), 0.1)
    assert rows[:, 5].tolist() == [0.0, 1.0]
    depth = 0.5 - 0.49
    expected = [[0, -1, -depth, 1.5, -depth / 2, 0], [0, -1, -depth, 2.5, -depth / 2, 1]]
    assert rows == pytest.approx(np.array(expected), abs=1e-16)  # an ulp of 0.5 twice


@pytest.mark.parametrize("seed", range(3))
def test_pieces_meet_planes_at_their_lowest_corners(seed):
    random = np.random.default_rng(seed)
    for _ in range(300):
        p, angle = any_outline(random), random.uniform(0, 2 * math.pi)
        normal, point = (math.cos(angle), math.sin(angle)), random.normal(0, 1, 2)
        height = (p[0] - point) @ normal - p[1]
        rows = met_plane(p, tuple(point), normal, math.inf)
        assert len(rows) == min(2, len(p[0]))
        assert rows[:, 2].min() == pytest.approx(height.min(), abs=1e-14)  # some ulps of some metres
        assert rows[:, :2].tolist() == [[-normal[0], -normal[1]]] * len(rows)
        # The points are midway: as deep in the solid as they are high over the piece's own rim.
        assert (rows[:, 3:5] - point) @ normal == pytest.approx(rows[:, 2] / 2, abs=1e-14)  # likewise
        along = rows[:, 3:5] @ (normal[1], -normal[0])
        assert along.tolist() == sorted(along)
        assert len(met_plane(p, tuple(point), normal, rows[:, 2].min())) == 0


def pymunk_meets(p, q):
    """Return pymunk's normal from p to q, and its least separation."""
    shapes = []
    for corners, radius in (p, q):
        shape = pymunk.Poly(pymunk.Body(1, 1), corners.tolist(), radius=radius)
        shape.cache_bb()
        shapes.append(shape)
    contacts = shapes[0].shapes_collide(shapes[1])
    return contacts.normal, min(point.distance for point in contacts.points)


def test_overlapping_polygons_meet_as_in_pymunk():
    random = np.random.default_rng(9)
    compared = 0
    while compared < 300:
        p, q = any_outline(random), moved(any_outline(random), *random.normal(0.0, 1.0, 2))
        if min(len(p[0]), len(q[0])) < 3 or separation_of(p, q) > -0.01:
            continue
        difference = (q[0][None] - p[0][:, None]).reshape(-1, 2)
        # One axis must be clearly the best: pymunk tells ties otherwise.
        heights = np.unique(ConvexHull(difference).equations[:, 2].round(9))[::-1]
        if heights[0] > 0.0 or heights[0] - heights[1] < 0.05:
            continue
        normal, depth = pymunk_meets(p, q)
        rows = met(p, q, reach=0.0)
        assert deepest(rows)[:2] == pytest.approx(tuple(normal), abs=1e-9)  # both are a face's own normal
        assert deepest(rows)[2] == pytest.approx(depth, abs=1e-9)  # likewise
        compared += 1


DEGENERATE = [
    disc(0, 0, 0.5),
    disc(0, 0, 0.0),
    capsule(0, 0, 0, 0, 0.5),  # of no length
    capsule(-1, 0, 1, 0, 0.0),
    capsule(-1, 0, 3, 0, 0.1),  # in line with the former
    capsule(0, -1, 0, 1, 0.1),
    box(),
    box(0, 0, 2, 1e-9),  # a sliver
    box(0, 0, 2, 1e-9, 1e-9),
    (np.array([(-1.0, 0.0), (0.0, 0.0), (1.0, 0.0)]), 0.0),  # of no area
    (np.zeros((4, 2)), 0.1),
    (np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]), 0.0),  # one corner twice
    ring(1000),
    ring(999, 0.5),
]


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("offset", [(0.0, 0.0), (1e-17, 0.0), (0.5, 0.0), (0.0, 0.5), (2.0, 2.0), (3.0, 0.0)])
def test_no_degenerate_pair_gives_what_is_not_a_number(scale, offset):
    for p in DEGENERATE:
        for q in DEGENERATE:
            rows = met(scaled(p, scale), scaled(moved(q, *offset), scale))
            assert 1 <= len(rows) <= 2
            assert np.isfinite(rows).all()
            assert np.hypot(rows[:, 0], rows[:, 1]) == pytest.approx(1.0, abs=1e-15)  # rounding
        rows = met_plane(scaled(p, scale), (0.0, 0.0), (0.6, 0.8), math.inf)
        assert 1 <= len(rows) <= 2
        assert np.isfinite(rows).all()


def test_pieces_that_coincide_part_through_the_nearest_face():
    assert met(box(0, 0, 1, 2), box(0, 0, 1, 2))[:, 2].tolist() == [-1.0, -1.0]
    assert met(disc(1, 1, 1), disc(1, 1, 1))[0, :3].tolist() == [1.0, 0.0, -2.0]


def test_rings_of_a_thousand_corners_are_nearly_discs():
    rows = met(ring(1000), moved(ring(1000), 1.2, 1.6))
    sagitta = 1.0 - math.cos(math.pi / 1000)
    assert deepest(rows)[2] == pytest.approx(0.0, abs=2 * sagitta + 1e-12)  # discs of radius 1 would just touch
    assert deepest(rows)[:2] == pytest.approx((0.6, 0.8), abs=math.pi / 1000)  # half the angle of a side


HASH = """
import hashlib
import numpy as np
from tests.engines.reference.outlines import any_outline, met, met_plane, moved

random = np.random.default_rng(11)
digest = hashlib.sha256()
for _ in range(200):
    p, q = any_outline(random), moved(any_outline(random), *random.normal(0.0, 1.0, 2))
    digest.update(met(p, q).tobytes() + met_plane(p, (0.0, 0.0), (0.6, 0.8), 0.5).tobytes())
print(digest.hexdigest())
"""


def test_compiled_or_not_the_answers_are_the_same_to_the_bit():
    told = set()
    for disabled in ("0", "1"):
        environment = with_root_on_path(NUMBA_DISABLE_JIT=disabled)
        run = subprocess.run(
            [sys.executable, "-c", HASH], env=environment, cwd=ROOT, capture_output=True, text=True, check=True
        )
        told.add(run.stdout)
    assert len(told) == 1
