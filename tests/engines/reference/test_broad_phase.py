"""Broad phases: all find the same contacts and lose no pair that is nearer than the margin."""

import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sandbox.engines.reference.broad_phase import BROAD_PHASES, FIRST, SECOND, can_collide, cell_of, pair_key
from sandbox.engines.reference.collision import CirclePipeline
from tests.engines.builders import ball, body_store_of, scene_of, shipped, simulation_of, small_pile
from tests.engines.stepping import advance

COLLIDES = st.sampled_from(["all", "fixed", "none"])


@st.composite
def crowds(draw):
    """Draw balls near each other, of very different sizes, at some offset; some coincide, some are fixed."""
    offset = draw(st.sampled_from([0.0, 1e3, 1e6, 1e9, -1e9]))
    offsets = st.one_of(st.integers(-6, 6).map(float), st.floats(-6, 6), st.sampled_from([0.1, 0.3, 0.7]))
    balls = []
    for _ in range(draw(st.integers(1, 12))):
        x, y = offset + draw(offsets), offset + draw(offsets)
        radius = draw(st.sampled_from([1e-6, 0.1, 0.35, 0.5, 1.0, 1 / 3, 10.0, 1e4]))
        more = {"radius": radius, "collides": draw(COLLIDES)}
        if draw(st.booleans()):
            more["fixed"] = True
        balls.append(ball(x, y, **more))
    return balls


def expected_to_collide(one, other):
    """Return whether two balls collide by the rule of `collides`, from the scene document."""
    modes = [each["collides"] for each in (one, other)]
    fixed = [bool(each.get("fixed")) for each in (one, other)]
    if "none" in modes or all(fixed):
        return False
    if any(fixed):
        return modes[fixed.index(True)] == "all"
    return modes == ["all", "all"]


def contact_columns(finder, position, margin=0.0):
    contacts = finder.manifolds(position, finder.candidates(position, margin), margin)
    return [column.tolist() for column in contacts]


@pytest.mark.fail_slow(60)  # takes over half a second
@given(crowds())
def test_all_broad_phases_find_the_same_manifolds(balls):
    store = body_store_of(scene_of(*balls))
    results = [contact_columns(CirclePipeline(store, name), store.position) for name in BROAD_PHASES]
    assert all(result == results[0] for result in results)
    overlapping = [
        pair_key(i, j)
        for (i, a), (j, b) in combinations(enumerate(balls), 2)
        if expected_to_collide(a, b) and math.dist(a["position"], b["position"]) < a["radius"] + b["radius"]
    ]
    assert results[0][0] == overlapping


@given(crowds(), st.floats(0, 5))
def test_no_broad_phase_loses_a_pair_nearer_than_the_margin(balls, margin):
    store = body_store_of(scene_of(*balls))
    near = {
        pair_key(i, j)
        for (i, a), (j, b) in combinations(enumerate(balls), 2)
        if expected_to_collide(a, b)
        and math.dist(a["position"], b["position"]) < a["radius"] + b["radius"] + margin * (1 - 1e-12)
    }
    for name in BROAD_PHASES:
        keys = CirclePipeline(store, name).candidates(store.position, margin).balls.tolist()
        assert keys == sorted(set(keys))
        assert near <= set(keys)


@given(crowds(), st.randoms(use_true_random=False))
def test_sweep_order_kept_between_steps_does_not_change_the_result(balls, random):
    store = body_store_of(scene_of(*balls))
    reused = CirclePipeline(store, "sweep")
    for _ in range(3):
        moved = store.position + np.array([[random.uniform(-3, 3), random.uniform(-3, 3)] for _ in balls])
        assert contact_columns(reused, moved) == contact_columns(CirclePipeline(store, "all_pairs"), moved)


def touching_within_rounding(count):
    """Yield centres about 1e9 m out, and radii, that overlap by less than the spacing of the coordinates."""
    random = np.random.default_rng(7)
    while count:
        x, a, b = 1e9 + random.uniform(0, 1e3), random.uniform(0.1, 1), random.uniform(0.1, 1)
        other = x + a + b
        if other - x < a + b:
            yield x, a, other, b
            count -= 1


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("name", BROAD_PHASES)
def test_overlaps_below_rounding_far_from_the_origin_are_found(name):
    for x, a, other, b in touching_within_rounding(300):
        balls = [ball(x, 0.0, radius=a), ball(other, 0.0, radius=b)]
        store = body_store_of(scene_of(*balls))
        assert contact_columns(CirclePipeline(store, name), store.position)[0] == [pair_key(0, 1)]


@pytest.mark.parametrize("name", BROAD_PHASES)
def test_touching_balls_are_found_where_cell_indices_are_rounded(name):
    # Cells 2.02 m wide around index 2⁵²: indices are rounded, twice as coarsely on the upper side.
    wide = 2.02
    start = 2.0**52 * wide
    for k in range(-40, 40):
        x = start + 2.0 * k
        store = body_store_of(scene_of(ball(x, 0.0, radius=wide / 2), ball(x + 2.0, 0.0, radius=wide / 2)))
        assert contact_columns(CirclePipeline(store, name), store.position)[0] == [pair_key(0, 1)]


@pytest.mark.parametrize("name", BROAD_PHASES)
@pytest.mark.parametrize("balls", [[], [ball(0, 0)], [ball(0, 0), ball(0, 0)], [ball(0, 0, collides="none")] * 3])
def test_empty_and_smallest_scenes(name, balls):
    balls = [{**each, "name": f"b{k}"} for k, each in enumerate(balls)]
    if not balls:  # a scene without any object is invalid
        document = {"plane": [{"point": [0, 0], "normal": [0, 1]}]}
        finder = CirclePipeline(body_store_of(scene_of(**document)), name)
        assert contact_columns(finder, np.empty((0, 2)))[0] == []
        return
    store = body_store_of(scene_of(*balls))
    expected = [pair_key(0, 1)] if len(balls) == 2 else []
    assert contact_columns(CirclePipeline(store, name), store.position)[0] == expected


@pytest.mark.parametrize("name", BROAD_PHASES)
def test_coincident_centres_have_pymunks_normal(name):
    store = body_store_of(scene_of(ball(3, 4), ball(3, 4)))
    contacts = CirclePipeline(store, name).overlaps(store.position)
    assert (contacts.separation.tolist(), contacts.normal.tolist()) == ([-1.0], [[1.0, 0.0]])


@pytest.mark.parametrize("name", BROAD_PHASES)
def test_pairs_beyond_the_initial_capacity_are_kept(name):
    balls = [ball(0.001 * k, 0.0, name=f"b{k}") for k in range(40)]
    store = body_store_of(scene_of(*balls))
    assert len(CirclePipeline(store, name).overlaps(store.position).key) == 40 * 39 // 2


@pytest.mark.parametrize("name", BROAD_PHASES)
def test_nan_position_collides_with_nothing_and_hides_no_other_pair(name):
    store = body_store_of(scene_of(ball(0, 0), ball(0.5, 0), ball(0.2, 0.2)))
    position = store.position.copy()
    position[2] = np.nan
    keys = contact_columns(CirclePipeline(store, name), position)[0]
    assert set(keys) <= {pair_key(0, 1)}
    assert name == "sweep" or keys == [pair_key(0, 1)]


def test_circles_tests_every_collidable_pair_and_the_others_far_fewer():
    wide = [ball(3.0 * k, 0.1 * (k % 7), name=f"b{k}") for k in range(400)]
    store = body_store_of(
        scene_of(*wide, ball(0, 50, fixed=True), ball(9, 50, fixed=True), ball(4, 50, collides="fixed"))
    )
    tests = {}
    for name in BROAD_PHASES:
        finder = CirclePipeline(store, name)
        finder.overlaps(store.position)
        tests[name] = finder.work["broad_tests"]
    assert tests["circles"] >= 400 * 399 // 2  # each pair of moving balls
    assert max(tests["grid"], tests["sweep"]) < tests["circles"] / 50  # at most the neighbours of each


def test_one_huge_ball_defeats_the_grid_but_not_the_sweep():
    small = [ball(3.0 * k, 0.0, name=f"b{k}") for k in range(200)]
    store = body_store_of(scene_of(*small, ball(300, -1e4 - 1, radius=1e4)))
    tests = {}
    for name in ("grid", "sweep"):
        finder = CirclePipeline(store, name)
        finder.overlaps(store.position)
        tests[name] = finder.work["broad_tests"]
    assert tests["grid"] >= 200 * 199 // 2  # all are in one cell or in neighbouring cells
    assert tests["sweep"] < tests["grid"] / 20


def mixed_sizes():
    """Return balls of five sizes that fall on a hill."""
    radii = [0.02, 0.3, 0.05, 1.0, 0.1]
    balls = [ball(1.1 * (k % 6), 1.2 + 1.3 * (k // 6), radius=radii[k % 5] / 2, name=f"b{k}") for k in range(30)]
    hill = ball(3, -3, radius=3.0, fixed=True, name="hill")
    return scene_of(*balls, hill, world={"gravity": [0.0, -9.81]}, solver={"dt": 0.005})


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(
    ("scene", "steps", "settings"),
    [
        (shipped("benchmark/gas"), 120, {"dt": 0.01}),
        (small_pile(), 80, {}),
        *((small_pile(18), 40, {"detection": detection}) for detection in ("bisect", "swept", "shrink")),
        (small_pile(), 20, {"response": "penalty", "substeps": 20}),
        (mixed_sizes(), 200, {}),
    ],
)
def test_scene_runs_identically_on_all_broad_phases(scene, steps, settings):
    runs = [advance(simulation_of(scene, broad_phase=name, **settings), steps) for name in BROAD_PHASES]
    assert runs[0].work["contacts"] > 0
    assert len({run.state_hash() for run in runs}) == 1


def test_pair_keys_hold_both_indices_and_sort_like_pairs():
    pairs = [(0, 0), (0, 1), (0, SECOND), (1, 0), (5, 7), (SECOND, SECOND)]
    keys = [pair_key(i, j) for i, j in pairs]
    assert keys == sorted(keys)
    assert [(key >> FIRST, key & SECOND) for key in keys] == pairs


@given(st.integers(0, 2), st.booleans(), st.integers(0, 2), st.booleans())
def test_can_collide_is_symmetric_and_false_for_two_static_bodies(a, a_moves, b, b_moves):
    assert can_collide(a, a_moves, b, b_moves) == can_collide(b, b_moves, a, a_moves)
    assume(not (a_moves or b_moves))
    assert not can_collide(a, a_moves, b, b_moves)


def test_cell_indices_ascend_with_x_up_to_huge_coordinates():
    assert [cell_of(x, 0.5) for x in (-1.0, -0.1, 0.0, 0.49, 0.5)] == [-2, -1, 0, 0, 1]
    assert cell_of(-1e300, 1e-9) < cell_of(1e300, 1e-9)
    assert cell_of(math.nan, 1.0) == 0
