"""Convex pieces: separations against shapely and qhull, contacts against pymunk, symmetries, extreme inputs."""

import math
import subprocess
import sys

import numpy as np
import pymunk
import pytest
import shapely
from scipy.spatial import ConvexHull

from sandbox.engines.reference import polygon as convex
from sandbox.engines.reference.polygon import PARALLEL, REFERENCE_FACE_BIAS
from tests.engines.builders import ROOT
from tests.engines.reference.outlines import (
    box,
    capsule,
    collide,
    collide_plane,
    disc,
    hull_of,
    moved,
    pack_outlines,
    random_outline,
    random_pairs,
    ring,
    separation_of,
)
from tests.environment import with_root_on_path

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of polygons

PAIRS = 1000


def scaled(outline, scale):
    return outline[0] * scale, outline[1] * scale


def deepest(rows):
    return rows[rows[:, 2].argmin()]


def separations_by_error(exact, p, q):
    """Return the separations computed for (p, q) and (q, p), the more accurate one first."""
    found = [deepest(rows)[2] for rows in (collide(p, q), collide(q, p))]
    return sorted(found, key=lambda separation: abs(separation - exact))


def test_separations_match_shapely_distances_and_qhull_penetrations():
    overlaps = 0
    for p, q, size in random_pairs(1, PAIRS):
        exact = separation_of(p, q)
        overlaps += exact < 0.0
        one, other = separations_by_error(exact, p, q)
        assert one == pytest.approx(exact, abs=1e-9 * size)  # SLACK
        # the bias favours the first piece's face in one of the orders
        assert other == pytest.approx(exact, abs=REFERENCE_FACE_BIAS * size)
    assert 0.3 * PAIRS < overlaps < 0.7 * PAIRS


def test_separations_are_accurate_from_micrometres_to_a_thousand_kilometres():
    random = np.random.default_rng(2)
    for k in range(PAIRS):
        scales = 10.0 ** random.uniform(-6, 6, 2)
        if k % 2:
            scales[1] = scales[0]
        p, q = (scaled(random_outline(random), scale) for scale in scales)
        fraction = random.choice([0.0, random.random()])
        side = random.integers(len(p[0]))
        target = (1.0 - fraction) * p[0][side] + fraction * p[0][(side + 1) % len(p[0])]
        # Place a corner of the second near a point on the rim of the first.
        q = moved(q, *(target - q[0][0] + random.normal(0.0, 0.1 * scales.min(), 2)))
        exact = separation_of(p, q)
        one, other = separations_by_error(exact, p, q)
        rounding = 1e-14 * scales.max()  # some ulps of the coordinates
        assert one == pytest.approx(exact, abs=1e-9 * scales.min() + rounding)  # SLACK
        # faces are up to 3 long
        assert other == pytest.approx(exact, abs=3 * REFERENCE_FACE_BIAS * scales.min() + rounding)


def test_pieces_moved_by_the_separation_along_the_normal_just_touch():
    for p, q, size in random_pairs(3, PAIRS):
        nx, ny, separation = deepest(collide(p, q))[:3]
        assert math.hypot(nx, ny) == pytest.approx(1.0, abs=1e-15)  # two divisions, a root
        touching = moved(q, -separation * nx, -separation * ny)
        assert separation_of(p, touching) == pytest.approx(0.0, abs=REFERENCE_FACE_BIAS * size)  # as above


def test_normals_of_separated_pieces_lie_along_the_shortest_line():
    count = 0
    for p, q, size in random_pairs(8, PAIRS):
        line = shapely.shortest_line(hull_of(p), hull_of(q))
        if line.length > 1e-3 * size:
            count += 1
            (ax, ay), (bx, by) = line.coords
            normal = (bx - ax) / line.length, (by - ay) / line.length
            assert deepest(collide(p, q))[:2] == pytest.approx(normal, abs=PARALLEL)  # parallel faces may swap roles
    assert count > 0.3 * PAIRS


@pytest.mark.parametrize("gap", [1e-6, 1e-5, 1e-4])
@pytest.mark.parametrize("angle", [0.02, 0.2, 0.7])
def test_corner_near_the_end_of_a_face_keeps_the_normal_of_the_face(gap, angle):
    """Its own faces separate the pair almost as well, but their normals are not along the shortest line."""
    tilted = box(0, 0, 1, 1, angle)
    top = tilted[0][2]
    p = moved(tilted, *(-top))  # its corner at the origin
    q = box(0.5 - 1e-4, 0.5 + gap)
    for one, other, sign in ((p, q, 1), (q, p, -1)):
        row = deepest(collide(one, other, reach=0.01))
        assert row[:3] == pytest.approx((0.0, sign, gap), abs=1e-15)  # rounding


def test_no_contact_is_written_beyond_the_reach():
    for p, q, _ in random_pairs(4, 600):
        rows = collide(p, q)
        for reach in (*rows[:, 2], 0.0, 0.1):
            assert collide(p, q, reach).tolist() == [row for row in rows.tolist() if row[2] < reach]


def test_swapping_the_pieces_reverses_the_normal():
    symmetric = 0
    for p, q, size in random_pairs(5, PAIRS):
        one, other = collide(p, q), collide(q, p)
        if len(one) != len(other) or abs(one[0, :2] + other[0, :2]).max() > 1e-12:
            # Two faces separate the pair equally well within the bias.
            assert deepest(one)[2] == pytest.approx(deepest(other)[2], abs=REFERENCE_FACE_BIAS * size)
            continue
        symmetric += 1
        # Left of the normal is right of its opposite, so the two points swap.
        back = other[::-1] * (-1, -1, 1, 1, 1, 1)
        assert one[:, :5] == pytest.approx(back[:, :5], abs=1e-12 * size)  # rounding
        if len(one) == 2:
            assert one[:, 5].tolist() == other[:, 5].tolist() == [0.0, 1.0]
    assert symmetric > 0.97 * PAIRS


def test_contacts_are_invariant_under_rotation_and_translation():
    random = np.random.default_rng(6)
    alike = 0
    for p, q, size in random_pairs(6, PAIRS):
        angle, shift = random.uniform(0, 2 * math.pi), random.normal(0, 10, 2)
        one, other = collide(p, q), collide(moved(p, *shift, angle), moved(q, *shift, angle))
        # a tie may resolve differently
        assert deepest(one)[2] == pytest.approx(deepest(other)[2], abs=REFERENCE_FACE_BIAS * size)
        turned = one.copy()
        turned[:, :2] = moved((one[:, :2], 0.0), 0.0, 0.0, angle)[0]
        turned[:, 3:5] = moved((one[:, 3:5], 0.0), *shift, angle)[0]
        # ulps of 10 m, amplified by the tilt
        alike += one.shape == other.shape and bool(abs(turned - other).max() < 1e-9)
    assert alike > 0.99 * PAIRS


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
def test_disc_against_box_uses_the_region_of_the_disc_centre(x, y, normal, separation):
    row = collide(disc(x, y, 0.1), box())[0]
    assert row[:3] == pytest.approx((*normal, separation), abs=1e-15)  # rounding of numbers under 1
    middle = 0.1 + 0.5 * separation
    assert row[3:5] == pytest.approx((x + normal[0] * middle, y + normal[1] * middle), abs=1e-15)  # likewise


def test_only_the_necessary_separation_tests_run(monkeypatch):
    """A disc tests the faces of the polygon, two discs test none, and a separating first axis ends the search."""
    functions = {}
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
        functions[name] = getattr(getattr(convex, name), "py_func", getattr(convex, name))
        monkeypatch.setattr(convex, name, functions[name])
    calls = []

    def counted(name, function):
        return lambda *arguments: calls.append(name) or function(*arguments)

    for name in ("widest_gap", "clip", "closest_points"):
        monkeypatch.setattr(convex, name, counted(name, getattr(convex, name)))

    def calls_for(p, q):
        calls.clear()
        functions["collide_pieces"](*pack_outlines(p, q), 0, 1, 0.01, np.zeros((2, 6)))
        return calls

    ball, bar = disc(0, 0, 1), capsule(0.5, 0, 1, 1, 0.1)
    assert calls_for(ball, ball) == calls_for(ball, bar) == calls_for(bar, ball) == []
    assert calls_for(ball, box()) == calls_for(box(), ball) == ["widest_gap"]
    assert calls_for(box(), box(2, 0)) == ["widest_gap"]
    assert calls_for(box(), box(0.9, 0)) == ["widest_gap", "widest_gap", "clip"]
    assert calls_for(box(), box(1.005, 0)) == ["widest_gap", "widest_gap", "clip", "closest_points"]


def test_corner_beside_the_end_of_a_wall_touches_the_round_end():
    rows = collide(box(1.5 + 0.03, 0.5 + 0.04), capsule(0, 0, 1, 0, 0.02), reach=0.1)
    assert rows == pytest.approx(np.array([[-0.6, -0.8, 0.03, 1.021, 0.028, 0.0]]), abs=1e-15)  # rounding


def test_collinear_capsules_touch_at_their_ends():
    rows = collide(capsule(0, 0, 1, 0, 0.2), capsule(1.3, 0, 2, 0, 0.2))
    assert rows == pytest.approx(np.array([[1, 0, -0.1, 1.15, 0, 0]]), abs=1e-15)  # rounding


def test_crossing_capsules_separate_in_the_direction_of_least_depth():
    rows = collide(capsule(-1, 0, 1, 0, 0.1), capsule(0.2, -0.3, 0.2, 2, 0.1))
    assert deepest(rows)[:3] == pytest.approx((0, 1, -0.5), abs=1e-15)  # 0.3 and both radii


def test_a_box_on_a_plane_touches_at_its_two_lower_corners():
    rows = collide_plane(box(2.0, 0.49), (0.0, 0.0), (0.0, 1.0), 0.1)
    assert rows[:, 5].tolist() == [0.0, 1.0]
    depth = 0.5 - 0.49
    expected = [[0, -1, -depth, 1.5, -depth / 2, 0], [0, -1, -depth, 2.5, -depth / 2, 1]]
    assert rows == pytest.approx(np.array(expected), abs=1e-16)  # an ulp of 0.5 twice


@pytest.mark.parametrize("seed", range(3))
def test_pieces_touch_planes_at_their_lowest_corners(seed):
    random = np.random.default_rng(seed)
    for _ in range(300):
        p, angle = random_outline(random), random.uniform(0, 2 * math.pi)
        normal, point = (math.cos(angle), math.sin(angle)), random.normal(0, 1, 2)
        height = (p[0] - point) @ normal - p[1]
        rows = collide_plane(p, tuple(point), normal, math.inf)
        assert len(rows) == min(2, len(p[0]))
        assert rows[:, 2].min() == pytest.approx(height.min(), abs=1e-14)  # some ulps of some metres
        assert rows[:, :2].tolist() == [[-normal[0], -normal[1]]] * len(rows)
        # The points lie midway between the plane and the rim of the piece.
        assert (rows[:, 3:5] - point) @ normal == pytest.approx(rows[:, 2] / 2, abs=1e-14)  # likewise
        along = rows[:, 3:5] @ (normal[1], -normal[0])
        assert along.tolist() == sorted(along)
        assert len(collide_plane(p, tuple(point), normal, rows[:, 2].min())) == 0


def pymunk_contact(p, q):
    """Return pymunk's normal from p to q and its least separation."""
    shapes = []
    for corners, radius in (p, q):
        shape = pymunk.Poly(pymunk.Body(1, 1), corners.tolist(), radius=radius)
        shape.cache_bb()
        shapes.append(shape)
    contacts = shapes[0].shapes_collide(shapes[1])
    return contacts.normal, min(point.distance for point in contacts.points)


def test_overlapping_polygons_match_pymunk():
    random = np.random.default_rng(9)
    compared = 0
    while compared < 300:
        p, q = random_outline(random), moved(random_outline(random), *random.normal(0.0, 1.0, 2))
        if min(len(p[0]), len(q[0])) < 3 or separation_of(p, q) > -0.01:
            continue
        difference = (q[0][None] - p[0][:, None]).reshape(-1, 2)
        # One axis must be clearly the best: pymunk breaks ties differently.
        heights = np.unique(ConvexHull(difference).equations[:, 2].round(9))[::-1]
        if heights[0] > 0.0 or heights[0] - heights[1] < 0.05:
            continue
        normal, depth = pymunk_contact(p, q)
        rows = collide(p, q, reach=0.0)
        assert deepest(rows)[:2] == pytest.approx(tuple(normal), abs=1e-9)  # both are a face's own normal
        assert deepest(rows)[2] == pytest.approx(depth, abs=1e-9)  # likewise
        compared += 1


DEGENERATE = [
    disc(0, 0, 0.5),
    disc(0, 0, 0.0),
    capsule(0, 0, 0, 0, 0.5),  # zero length
    capsule(-1, 0, 1, 0, 0.0),
    capsule(-1, 0, 3, 0, 0.1),  # collinear with the previous one
    capsule(0, -1, 0, 1, 0.1),
    box(),
    box(0, 0, 2, 1e-9),  # a sliver
    box(0, 0, 2, 1e-9, 1e-9),
    (np.array([(-1.0, 0.0), (0.0, 0.0), (1.0, 0.0)]), 0.0),  # zero area
    (np.zeros((4, 2)), 0.1),
    (np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]), 0.0),  # a repeated corner
    ring(1000),
    ring(999, 0.5),
]


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("offset", [(0.0, 0.0), (1e-17, 0.0), (0.5, 0.0), (0.0, 0.5), (2.0, 2.0), (3.0, 0.0)])
def test_degenerate_pairs_give_finite_contacts(scale, offset):
    for p in DEGENERATE:
        for q in DEGENERATE:
            rows = collide(scaled(p, scale), scaled(moved(q, *offset), scale))
            assert 1 <= len(rows) <= 2
            assert np.isfinite(rows).all()
            assert np.hypot(rows[:, 0], rows[:, 1]) == pytest.approx(1.0, abs=1e-15)  # rounding
        rows = collide_plane(scaled(p, scale), (0.0, 0.0), (0.6, 0.8), math.inf)
        assert 1 <= len(rows) <= 2
        assert np.isfinite(rows).all()


def test_coincident_pieces_separate_through_the_nearest_face():
    assert collide(box(0, 0, 1, 2), box(0, 0, 1, 2))[:, 2].tolist() == [-1.0, -1.0]
    assert collide(disc(1, 1, 1), disc(1, 1, 1))[0, :3].tolist() == [1.0, 0.0, -2.0]


def test_polygons_of_a_thousand_corners_behave_nearly_as_discs():
    rows = collide(ring(1000), moved(ring(1000), 1.2, 1.6))
    sagitta = 1.0 - math.cos(math.pi / 1000)
    assert deepest(rows)[2] == pytest.approx(0.0, abs=2 * sagitta + 1e-12)  # discs of radius 1 would just touch
    assert deepest(rows)[:2] == pytest.approx((0.6, 0.8), abs=math.pi / 1000)  # half the angle of a side


HASH = """
import hashlib
import numpy as np
from tests.engines.reference.outlines import collide, collide_plane, moved, random_outline

random = np.random.default_rng(11)
digest = hashlib.sha256()
for _ in range(200):
    p, q = random_outline(random), moved(random_outline(random), *random.normal(0.0, 1.0, 2))
    digest.update(collide(p, q).tobytes() + collide_plane(p, (0.0, 0.0), (0.6, 0.8), 0.5).tobytes())
print(digest.hexdigest())
"""


def test_results_are_bit_identical_with_and_without_compiled_kernels():
    digests = set()
    for disabled in ("0", "1"):
        environment = with_root_on_path(NUMBA_DISABLE_JIT=disabled)
        run = subprocess.run(
            [sys.executable, "-c", HASH], env=environment, cwd=ROOT, capture_output=True, text=True, check=True
        )
        digests.add(run.stdout)
    assert len(digests) == 1
