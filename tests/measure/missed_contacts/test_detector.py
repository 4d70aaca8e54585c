import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.missed_contacts import Audit
from sandbox.measure.missed_contacts.swept_geometry import CLEAR, DEEP, JUMP, TOLERANCE
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BACKING
from sandbox.scene.description.discs import Ball, Emitter
from sandbox.scene.description.fixed import Plane, Post, Wall

NOTHING = np.empty((0, 2), np.int64)
WALL = Wall(points=((0.0, -1.0), (0.0, 1.0)), thickness=0.02)


def ball(x, y=0.0, radius=0.1, **more):
    return Ball(position=(x, y), radius=radius, **more)


def pairs(*rows):
    return np.array(rows, dtype=np.int64).reshape(-1, 2)


def step(scene, ends, touching=NOTHING, before=None):
    """Return the missed pairs of a substep that moves the balls from their initial positions to `ends`."""
    audit, start = Audit(scene), scene.bodies.position
    if before is not None:
        audit(0.0, start, start, before)
    audit(1.0, start, np.array(ends, dtype=float), touching)
    return audit.pairs.tolist()


def overlaps(scene, position):
    """Return the overlapping pairs by plain arithmetic, as a discrete engine finds them."""
    radius, found = scene.bodies.radius, []
    for i in range(len(position)):
        others = range(i + 1, len(position))
        found += [(i, j) for j in others if math.dist(position[i], position[j]) < radius[i] + radius[j]]
        for k, thing in enumerate(scene.fixed):
            if isinstance(thing, Plane):
                overlapping = np.dot(position[i] - thing.point, thing.normal) < radius[i]
            elif isinstance(thing, Post):
                overlapping = math.dist(position[i], thing.position) < radius[i] + thing.radius
            else:
                ends = thing.points + thing.points[: thing.closed]
                overlapping = any(
                    distance_to_segment(position[i], a, b) < radius[i] + thing.thickness / 2 for a, b in pairwise(ends)
                )
            if overlapping:
                found.append((i, -1 - k))
    return pairs(*found)


def distance_to_segment(p, a, b):
    a, b = np.array(a), np.array(b)
    fraction = np.clip(np.dot(p - a, b - a) / np.dot(b - a, b - a), 0, 1)
    return np.linalg.norm(p - a - fraction * (b - a))


def fly(scene, velocity, steps):
    """Move the balls in straight lines, and audit an engine that detects overlaps after each substep."""
    audit, position = Audit(scene), scene.bodies.position
    for k in range(steps):
        after = position + velocity
        audit(float(k), position, after, overlaps(scene, after))
        position = after
    return audit


# ---- thin walls ----


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("ratio", [0.5, 0.99, 1.2, 2.0, 10.0, 100.0])
def test_wall_is_missed_with_the_probability_of_the_formula(ratio):
    # P(miss) = max(0, 1 − (r + w/2) / (v·h)) over all phases
    radius, count = 0.1, 400
    jump = ratio * (radius + 0.01)
    missed = 0
    for phase in (np.arange(count) + 0.5) / count:
        scene = Scene(balls=(ball(-0.11 - phase * jump - jump, radius=radius),), walls=(WALL,))
        missed += len(fly(scene, np.array([[jump, 0.0]]), 4).times)
    assert missed / count == pytest.approx(max(0.0, 1 - 1 / ratio), abs=2 / count)  # the resolution of the phases


@pytest.mark.parametrize("touching", [pairs((0, -1)), NOTHING])
def test_passed_wall_is_missed_once_even_if_detected_on_the_far_side(touching):
    audit = Audit(scene := Scene(balls=(ball(-0.2),), walls=(WALL,)))
    positions = [np.array([[x, 0.0]]) for x in (-0.2, 0.05, 0.08, 0.3, 0.6)]
    for k in range(4):
        audit(float(k), positions[k], positions[k + 1], touching if k < 2 else NOTHING)
    assert audit.pairs.tolist() == [[0, -1]]
    assert audit.times.tolist() == [0.0]
    assert len(overlaps(scene, positions[1]))


def test_wall_detected_in_time_is_not_missed():
    scene = Scene(balls=(ball(-0.2),), walls=(WALL,))
    assert step(scene, [(-0.05, 0.0)], pairs((0, -1))) == []
    assert step(scene, [(-0.05, 0.0)], NOTHING) == [[0, -1]]


def test_wall_in_contact_before_is_not_clear():
    scene = Scene(balls=(ball(-0.11),), walls=(WALL,))
    assert step(scene, [(0.3, 0.0)], before=pairs((0, -1))) == []
    assert step(scene, [(0.3, 0.0)], before=pairs((0, -2))) == [[0, -1]]


def test_wall_that_touches_initially_counts_as_clear():
    # 0.3 − 0.1·3 is not 0: the gap may be −5e-17
    wall = Wall(points=((0.3, -1.0), (0.3, 1.0)))
    assert step(Scene(balls=(ball(0.1 + 0.1 - 1e-16),), walls=(wall,)), [(0.9, 0.0)]) == [[0, -1]]


def test_wall_is_not_missed_by_a_ball_that_passes_its_end():
    scene = Scene(balls=(ball(-0.5, 1.12),), walls=(WALL,))
    assert step(scene, [(0.5, 1.12)]) == []


def test_grazed_end_of_a_wall_is_missed_like_a_post():
    assert step(Scene(balls=(ball(-0.5, 1.05),), walls=(WALL,)), [(0.5, 1.05)]) == [[0, -1]]
    past = [(0.03, 1.05)]  # still in contact, but past the centre of the end
    assert step(Scene(balls=(ball(-0.5, 1.05),), walls=(WALL,)), past, pairs((0, -1))) == [[0, -1]]
    short = [(-0.03, 1.05)]
    assert step(Scene(balls=(ball(-0.5, 1.05),), walls=(WALL,)), short, pairs((0, -1))) == []


def test_polyline_is_missed_once_for_any_number_of_segments():
    fence = Wall(points=((0.0, -1.0), (0.0, 0.01), (0.1, -1.0), (0.1, 1.0)))
    assert step(Scene(balls=(ball(-0.5),), walls=(fence,)), [(0.5, 0.0)]) == [[0, -1]]


def test_rolling_along_a_polyline_misses_none_of_its_joints():
    floor = Wall(points=tuple((x / 2, 0.0) for x in range(8)))
    scene = Scene(balls=(ball(0.3, 0.0995),), walls=(floor,))
    end = [(0.95, 0.0995)]
    assert step(scene, end, pairs((0, -1)), before=pairs((0, -1))) == []


def test_ball_resting_on_a_polyline_misses_its_passed_side():
    box = Wall(points=((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)), closed=True)
    scene = Scene(balls=(ball(1.0, 0.0995),), walls=(box,))
    assert step(scene, [(2.5, 0.0995)], before=pairs((0, -1))) == [[0, -1]]
    assert step(scene, [(1.5, 0.0995)], pairs((0, -1)), before=pairs((0, -1))) == []


def test_polyline_crossed_exactly_at_a_joint_is_missed():
    fence = Wall(points=((0.0, -1.0), (0.0, 0.0), (0.0, 1.0)))
    assert step(Scene(balls=(ball(-0.5),), walls=(fence,)), [(0.05, 0.0)], pairs((0, -1))) == [[0, -1]]


def test_many_walls_and_bodies_are_distinguished():
    walls = tuple(Wall(points=((float(x), -1.0), (float(x), 400.0))) for x in range(1, 60))
    balls = tuple(ball(0.5, 1.0 + y) for y in range(300))
    scene = Scene(balls=balls, walls=walls)
    ends = scene.bodies.position + np.column_stack((np.arange(300) % 7, np.zeros(300)))
    expected = [[i, -k] for i in range(300) for k in range(i % 7, 0, -1)]
    assert step(scene, ends) == expected


# ---- posts, fixed balls, planes ----


@pytest.mark.parametrize("as_ball", [True, False])
def test_post_and_fixed_ball_are_missed_equally(as_ball):
    shapes = {"balls": (ball(-1.0), ball(0.0, fixed=True))} if as_ball else {"balls": (ball(-1.0),)}
    scene = Scene(**shapes, posts=() if as_ball else (Post(position=(0.0, 0.0), radius=0.1),))
    rest = [(0.0, 0.0)] if as_ball else []
    other = 1 if as_ball else -1
    assert step(scene, [(1.0, 0.0), *rest]) == [[0, other]]
    assert step(scene, [(0.05, 0.0), *rest], pairs((0, other))) == [[0, other]]
    assert step(scene, [(-0.05, 0.0), *rest], pairs((0, other))) == []


def test_plane_is_missed_only_below_its_backing_or_undetected():
    scene = Scene(planes=(Plane(point=(0.0, 0.0), normal=(0.0, 3.0)),), balls=(ball(0.0, 5.0),))
    detected = pairs((0, -1))
    assert step(scene, [(0.0, -BACKING + 1)], detected) == []
    assert step(scene, [(0.0, -BACKING - 1)], detected) == [[0, -1]]
    assert step(scene, [(0.0, -3 * BACKING)]) == [[0, -1]]
    assert step(scene, [(0.0, 0.1 * (1 - 2 * TOLERANCE))]) == [[0, -1]]
    assert step(scene, [(0.0, 0.1)]) == []


def test_plane_is_missed_once_per_passage():
    audit = Audit(Scene(planes=(Plane(point=(0.0, 0.0), normal=(0.0, 1.0)),), balls=(ball(0.0, 5.0),)))
    for k in range(5):
        audit(float(k), np.array([[0.0, 5.0 - 800 * k]]), np.array([[0.0, 5.0 - 800 * (k + 1)]]), NOTHING)
    assert audit.times.tolist() == [0.0]


def test_fixed_shapes_are_indexed_in_scene_order():
    scene = Scene(
        planes=(Plane(point=(0.0, -9e3), normal=(0.0, 1.0)), Plane(point=(2.0, 0.0), normal=(-1.0, 0.0))),
        walls=(Wall(points=((0.9, 5.0), (0.9, 6.0))), Wall(points=((1.0, -1.0), (1.0, 1.0)))),
        posts=(Post(position=(0.5, 0.0), radius=0.1),),
        balls=(ball(0.0),),
    )
    assert step(scene, [(1100.0, 0.0)]) == [[0, -5], [0, -4], [0, -2]]


# ---- balls ----


def test_balls_that_fly_through_each_other_are_missed_once():
    scene = Scene(balls=(ball(-1.0), ball(1.0)))
    audit = fly(scene, np.array([[0.29, 0.0], [-0.29, 0.0]]), 9)
    assert audit.pairs.tolist() == [[0, 1]]


@pytest.mark.parametrize(("depth", "count"), [(-1e-9, 0), (0.5 * TOLERANCE, 0), (2 * TOLERANCE, 1), (0.5, 1)])
def test_balls_that_graze_are_missed_when_deeper_than_the_tolerance(depth, count):
    offset = 0.2 * (1 - depth)
    assert len(step(Scene(balls=(ball(-1.0), ball(0.0, offset))), [(1.0, 0.0), (0.0, offset)])) == count


def test_balls_are_missed_only_if_detected_late():
    scene = Scene(balls=(ball(-1.0), ball(0.0, 0.15)))
    detected = pairs((0, 1))
    assert step(scene, [(-0.01, 0.0), (0.0, 0.15)], detected) == []
    assert step(scene, [(0.01, 0.0), (0.0, 0.15)], detected) == [[0, 1]]
    assert step(scene, [(-0.01, 0.0), (0.0, 0.15)], pairs((0, -1))) == [[0, 1]]


def test_balls_in_contact_before_are_not_clear():
    scene = Scene(balls=(ball(0.0), ball(0.2)))
    assert step(scene, [(1.0, 0.0), (0.2, 0.0)], before=pairs((0, 1))) == []
    assert step(scene, [(1.0, 0.0), (0.2, 0.0)]) == [[0, 1]]


def test_balls_with_equal_velocity_miss_no_contacts():
    scene = Scene(balls=(ball(0.0), ball(0.201), ball(0.402)))
    assert step(scene, scene.bodies.position + np.array([1e6, 3e5])) == []


def test_slow_bounces_miss_no_contacts():
    # A ball that bounces between planes by discrete detection, at 0.3 radii a substep
    scene = Scene(
        planes=(Plane(point=(0.0, 0.0), normal=(0.0, 1.0)), Plane(point=(0.0, 1.0), normal=(0.0, -1.0))),
        balls=(ball(0.0, 0.5),),
    )
    audit, position, velocity, contacts = Audit(scene), np.array([[0.0, 0.5]]), np.array([[0.01, 0.03]]), 0
    for k in range(500):
        after = position + velocity
        found = overlaps(scene, after)
        contacts += len(found)
        audit(float(k), position, after, found)
        for _, index in found:
            velocity[0, 1] = abs(velocity[0, 1]) * (1 if index == -1 else -1)
        position = after
    assert contacts > 10
    assert len(audit.times) == 0


FLAGS = ["all", "fixed", "none"]


@pytest.mark.parametrize("one", FLAGS)
@pytest.mark.parametrize("other", FLAGS)
@pytest.mark.parametrize("fixed", [False, True])
def test_only_pairs_that_can_collide_are_missed(one, other, fixed):
    balls = (ball(-1.0, collides=one), ball(0.0, collides=other, fixed=fixed))
    can_collide = (other == "all" and one != "none") if fixed else (one == other == "all")
    scene = Scene(balls=balls, posts=(Post(position=(0.5, 0.0), radius=0.1),))
    expected = [[0, -1]] * (one != "none") + [[0, 1]] * can_collide
    assert step(scene, [(1.0, 0.0), (0.0, 0.0)]) == expected


def test_two_fixed_balls_are_not_missed():
    scene = Scene(balls=(ball(0.0, fixed=True), ball(1.0, fixed=True), ball(9.0)))
    assert step(scene, [(2.0, 0.0), (1.0, 0.0), (9.0, 0.0)]) == []


def test_indices_are_correct_behind_particles_without_collisions():
    spark = Emitter(position=(0.0, 0.0), count=3, velocity_min=(0.0, 0.0), velocity_max=(1.0, 1.0))
    sparks = tuple(ball(0.0, collides="none") for _ in range(5))
    scene = Scene(balls=(*sparks, ball(-1.0), ball(0.0)), walls=(WALL,), emitters=(spark,))
    ends = scene.bodies.position + 50.0
    ends[5:7] = (1.0, 0.0), (0.0, 0.0)
    assert step(scene, ends) == [[5, -1], [5, 6]]


# ---- retired and added bodies, rejected arguments ----


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e200])
def test_non_finite_bodies_miss_nothing_and_affect_no_others(value):
    scene = Scene(balls=(ball(-1.0), ball(0.0), ball(-1.0, 0.5)), walls=(WALL,))
    invalid = [(value, value), (0.0, 0.0), (1.0, 0.5)]
    assert step(scene, invalid) == [[2, -1]]
    audit = Audit(scene)
    audit(0.0, scene.bodies.position, np.array(invalid), NOTHING)
    audit(1.0, np.array(invalid), np.array(invalid), NOTHING)
    audit(2.0, np.array(invalid), scene.bodies.position, NOTHING)
    assert audit.pairs.tolist() == [[2, -1], [2, -1]]


def test_miss_of_a_bullet_counts_although_it_vanishes_afterwards():
    scene = Scene(balls=(ball(-1.0), ball(0.0)))
    audit, start = Audit(scene), scene.bodies.position
    after = np.array([(500.0, 0.0), (0.0, 0.0)])
    audit(0.0, start, after, NOTHING)
    after = after.copy()
    after[0] = np.nan
    audit(1.0, after, after, NOTHING)
    assert audit.pairs.tolist() == [[0, 1]]


def test_spawned_bodies_are_audited():
    scene = Scene(balls=(ball(-1.0),))
    audit = Audit(scene)
    audit(0.0, np.array([[-1.0, 0.0]]), np.array([[-1.0, 0.0]]), NOTHING)
    bodies = scene.bodies.joined_by(ball(0.0, radius=0.3), "new")
    with pytest.raises(ValueError, match="2 bodies, where the audit knows of 1"):
        audit(1.0, bodies.position, bodies.position, NOTHING)
    audit.joined(bodies)
    audit(1.0, bodies.position, np.array([[1.0, 0.0], [0.0, 0.0]]), NOTHING)
    assert audit.missed()[0].tolist() == [1.0]
    assert audit.missed()[1].tolist() == [[0, 1]]


def test_spawned_body_does_not_clear_the_contacts_of_others():
    scene = Scene(balls=(ball(0.0), ball(0.2)))
    audit = Audit(scene)
    audit(0.0, scene.bodies.position, scene.bodies.position, pairs((0, 1)))
    bodies = scene.bodies.joined_by(ball(9.0), "new")
    audit.joined(bodies)
    audit(1.0, bodies.position, np.array([(1.0, 0.0), (0.2, 0.0), (9.0, 0.0)]), NOTHING)
    assert len(audit.times) == 0


def test_scene_without_bodies_can_be_audited():
    audit = Audit(Scene(walls=(WALL,)))
    audit(0.0, np.empty((0, 2)), np.empty((0, 2)), NOTHING)
    assert audit.times.shape == (0,)
    assert audit.pairs.shape == (0, 2)


def test_engine_may_reuse_its_arrays():
    scene = Scene(balls=(ball(-1.0), ball(0.0)))
    start, end, touching = scene.bodies.position.copy(), np.array([[1.0, 0.0], [0.0, 0.0]]), pairs((0, 1))
    audit = Audit(scene)
    audit(0.0, start, end, touching)
    start[:] = end[:] = touching[:] = 0
    assert audit.pairs.tolist() == [[0, 1]]


# ---- the audit against all pairs, one by one ----


def by_definition(scene, start, end, before, after):
    """Return the missed pairs of balls and posts by the definition, pair by pair."""
    radius, found = scene.bodies.radius, []
    n, posts = len(start), scene.posts
    known, detected = {tuple(p) for p in before.tolist()}, {tuple(p) for p in after.tolist()}
    for i in range(n):
        others = [(j, start[j], end[j], radius[j]) for j in range(i + 1, n)]
        others += [(-1 - k, np.array(p.position), np.array(p.position), p.radius) for k, p in enumerate(posts)]
        for index, here, there, size in others:
            gap, move, contact = here - start[i], there - here - end[i] + start[i], radius[i] + size
            length = np.hypot(*move)
            if length < JUMP * contact or np.hypot(*gap) < CLEAR * contact or (i, index) in known:
                continue
            fraction = min(max(-(gap @ move) / length**2, 0), 1)
            late = (gap + move) @ move >= 0
            if np.hypot(*(gap + fraction * move)) < DEEP * contact and (late or (i, index) not in detected):
                found.append([i, index])
    return sorted(found)


@pytest.mark.fail_slow(60)  # takes over half a second
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.003, 0.03, 0.3, 3.0]), st.integers(2, 30))
def test_gas_is_audited_by_the_definition(seed, speed, count):
    rng = np.random.default_rng(seed)
    balls = tuple(ball(x, y, radius=0.02 + 0.1 * r) for x, y, r in rng.random((count, 3)).tolist())
    posts = tuple(Post(position=(x, y), radius=0.05) for x, y in rng.random((3, 2)).tolist())
    scene = Scene(balls=balls, posts=posts)
    audit, expected, before = Audit(scene), [], NOTHING
    position, velocity = scene.bodies.position, rng.normal(size=(count, 2)) * speed
    for k in range(20):
        after = position + velocity
        found = overlaps(scene, after)
        found = found[rng.random(len(found)) < 0.8]  # an engine that overlooks some contacts
        audit(float(k), position, after, found)
        expected += [[k, *pair] for pair in by_definition(scene, position, after, before, found)]
        position, before = after, found
        velocity[rng.random(count) < 0.2] *= -1
    times, missed = audit.missed()
    assert np.column_stack((times, missed)).tolist() == expected


@given(st.integers(0, 2**32 - 1))
def test_order_of_bodies_does_not_matter(seed):
    rng = np.random.default_rng(seed)
    balls = tuple(ball(x, y, radius=0.05) for x, y in rng.random((25, 2)).tolist())
    move = rng.normal(size=(25, 2)) * 0.3
    order = rng.permutation(25)
    one = Scene(balls=balls, walls=(WALL,))
    other = Scene(balls=tuple(balls[k] for k in order), walls=(WALL,))
    expected = step(one, one.bodies.position + move)
    indices = np.append(order, -1)  # the wall keeps −1
    swapped = [
        sorted(indices[pair].tolist(), key=lambda k: (k < 0, k))
        for pair in step(other, other.bodies.position + move[order])
    ]
    assert sorted(swapped) == expected


def test_reading_results_in_between_changes_nothing():
    scene = Scene(balls=tuple(ball(x / 4, (x * 7 % 5) / 4) for x in range(20)), walls=(WALL,))
    velocity = np.random.default_rng(1).normal(size=(20, 2)) * 0.2
    one, other, position = Audit(scene), Audit(scene), scene.bodies.position
    for k in range(50):
        after = position + velocity
        one(float(k), position, after, found := overlaps(scene, after))
        other(float(k), position, after, found)
        other.missed()
        position = after
    assert len(one.times) > 3
    assert one.pairs.tolist() == other.pairs.tolist()
    assert one.times.tolist() == other.times.tolist()


def test_bullet_over_a_million_metres_misses_only_balls_on_its_line():
    columns = np.arange(1000.0)
    balls = (ball(-5.0), *(ball(x, 0.0 if x % 3 == 0 else 0.3) for x in columns.tolist()))
    scene = Scene(balls=balls)
    ends = scene.bodies.position.copy()
    ends[0, 0] = 1e6
    assert step(scene, ends) == [[0, 1 + k] for k in range(0, 1000, 3)]
