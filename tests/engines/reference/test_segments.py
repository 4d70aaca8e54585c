"""Segments: the broad phase of walls and posts loses no pair and tests few."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.engines.reference.broad_phase import SegmentBoxes, pair_key
from sandbox.engines.reference.collision import CirclePipeline
from sandbox.engines.reference.manifold import circle_segment
from tests.engines.builders import ball, body_store_of, scene_of

corner = st.tuples(st.integers(-40, 40), st.integers(-40, 40)).map(lambda c: [c[0] / 4, c[1] / 4])


@st.composite
def wall_scenes(draw):
    walls = [
        {
            "points": draw(st.lists(corner, min_size=2, max_size=5, unique_by=tuple)),
            "thickness": draw(st.sampled_from([0.0, 0.1, 2.0])),
            "closed": False,
        }
        for _ in range(draw(st.integers(0, 4)))
    ]
    posts = [
        {"position": draw(corner), "radius": draw(st.sampled_from([1e-3, 0.3, 5.0]))}
        for _ in range(draw(st.integers(0, 4)))
    ]
    balls = [
        ball(
            *draw(corner),
            radius=draw(st.sampled_from([1e-3, 0.25, 1.0, 8.0])),
            collides=draw(st.sampled_from(COLLIDES)),
        )
        for _ in range(draw(st.integers(1, 5)))
    ]
    return scene_of(*balls, wall=walls, post=posts)


COLLIDES = ["all", "fixed", "none"]


@given(wall_scenes(), st.floats(0, 4))
def test_no_pair_nearer_than_the_margin_is_lost(scene, margin):
    store = body_store_of(scene)
    near = {
        pair_key(i, s)
        for i, (x, y) in enumerate(store.position)
        for s, (ax, ay, bx, by, half) in enumerate(store.static_colliders.segments)
        if store.collision_mask[i]
        and circle_segment(x, y, store.radius[i], ax, ay, bx, by, half)[0] < margin * (1 - 1e-12)
    }
    keys = CirclePipeline(store, "grid").candidates(store.position, margin).segments.tolist()
    assert keys == sorted(set(keys))
    assert near <= set(keys)


@given(wall_scenes())
def test_contacts_are_the_overlapping_pairs(scene):
    store = body_store_of(scene)
    contacts = CirclePipeline(store, "grid").overlaps(store.position)
    walls = contacts.second < 0
    expected = {
        (i, -1 - int(store.static_colliders.segment_collider[s]))
        for i, (x, y) in enumerate(store.position)
        for s, (ax, ay, bx, by, half) in enumerate(store.static_colliders.segments)
        if store.collision_mask[i] and circle_segment(x, y, store.radius[i], ax, ay, bx, by, half)[0] < 0
    }
    # A segment end is skipped where the next segment of the wall is nearer; the wall itself is never lost.
    assert set(zip(contacts.first[walls].tolist(), contacts.second[walls].tolist(), strict=True)) == expected
    assert (contacts.separation < 0).all()


@pytest.mark.fail_slow(60)  # takes over half a second
def test_walls_far_from_the_origin_are_not_lost_to_rounding():
    random = np.random.default_rng(3)
    count = 0
    while count < 200:
        x, r, half = 1e9 + random.uniform(0, 1e3), random.uniform(0.1, 1), random.uniform(0.1, 1)
        wall_x = x + r + half
        if not wall_x - x < r + half:
            continue
        count += 1
        wall = {"points": [[wall_x, -1.0], [wall_x, 1.0]], "thickness": 2 * half}
        store = body_store_of(scene_of(ball(x, 0, radius=r), wall=[wall]))
        assert CirclePipeline(store, "grid").overlaps(store.position).size == 1


def test_long_row_of_posts_is_not_tested_as_a_whole():
    posts = [{"position": [3.0 * k, 0.0], "radius": 0.5} for k in range(1000)]
    store = body_store_of(scene_of(ball(1500, 0.2), post=posts))
    finder = CirclePipeline(store, "grid")
    assert finder.overlaps(store.position).size == 1
    assert finder.work["broad_tests"] <= 3


def test_segment_boxes_are_sorted_and_keep_their_segment_index():
    scene = scene_of(ball(9, 9), wall=[{"points": [[3, 0], [1, 2]], "thickness": 0.5}], post=[
        {"position": [0, 0], "radius": 2.0}
    ])  # fmt: skip
    boxes = SegmentBoxes(body_store_of(scene).static_colliders)
    assert boxes.box.tolist() == [[-2.0, -2.0, 2.0, 2.0], [0.75, -0.25, 3.25, 2.25]]
    assert boxes.index.tolist() == [1, 0]
    assert (len(boxes), boxes.max_width) == (2, 4.0)
    assert math.isclose(boxes.max_width, (boxes.box[:, 2] - boxes.box[:, 0]).max())
