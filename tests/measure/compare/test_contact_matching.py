"""Matching of contacts: which belong together, are missed, or are phantoms."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.compare.contact_matching import match_contacts, match_times
from tests.runs_by_hand import run_of, scene_of

SCENE = scene_of()
DT, TOLERANCE = 0.01, 1e-3
times = st.lists(st.integers(0, 60).map(lambda n: n / 4.0), max_size=6).map(sorted)


def cost(truth: list[float], run: list[float], pairs: list[tuple[int, int]], gap: float) -> float:
    distance = sum(abs(run[j] - truth[i]) for i, j in pairs)
    return distance + gap * (len(truth) + len(run) - 2 * len(pairs))


@given(truth=times, run=times)
def test_matching_has_the_lowest_cost_of_all_ordered_matchings(truth: list[float], run: list[float]) -> None:
    gap = 2.0
    found = match_times(truth, run, gap)
    assert all(a[0] < b[0] and a[1] < b[1] for a, b in pairwise(found))
    matchings = (
        list(zip(left, right, strict=True))
        for size in range(min(len(truth), len(run)) + 1)
        for left in combinations(range(len(truth)), size)
        for right in combinations(range(len(run)), size)
    )
    # Quarters are exact, and so are their sums.
    assert cost(truth, run, found, gap) == min(cost(truth, run, pairs, gap) for pairs in matchings)


def test_late_contacts_match_in_order() -> None:
    assert match_times([1.0, 2.0, 3.0], [1.1, 2.1, 3.1], 0.5) == [(0, 0), (1, 1), (2, 2)]
    assert match_times([1.0, 2.0, 3.0], [2.1, 3.1], 0.5) == [(1, 0), (2, 1)]
    assert match_times([1.0], [2.0], 0.5) == []  # exactly the cost of two unmatched ones
    assert match_times([], [1.0], 0.5) == match_times([1.0], [], 0.5) == []


def test_ten_thousand_contacts_are_matched_without_quadratic_cost() -> None:
    truth = np.arange(10_000) * 1.0
    assert match_times(truth.tolist(), (truth + 0.25).tolist(), 1.0) == [(n, n) for n in range(10_000)]


def test_event_has_differences_of_time_position_and_impulse() -> None:
    truth = run_of(SCENE, contacts=[(0.5, (0, -1), -3.0)])
    run = run_of(SCENE, contacts=[(0.52, (0, -1), -2.5)])
    (event,) = match_contacts(run, truth, SCENE, DT, TOLERANCE, 2.0)
    assert (event.kind, event.between, event.time, event.engine_time) == ("matched", ("a", "ground"), 0.5, 0.52)
    assert event.delta_time == pytest.approx(0.02, rel=1e-12)  # rounding of 0.52 − 0.5
    assert (event.delta_position, event.delta_impulse, event.lasting) == (0.0, 0.5, False)


def test_missing_and_extra_contacts_are_named() -> None:
    truth = run_of(SCENE, contacts=[(0.5, (0, -1), -1.0), (0.7, (0, 1), 1.0), (0.9, (1, 2), 1.0)])
    run = run_of(SCENE, contacts=[(0.5, (0, -1), -1.0), (0.9, (1, 2), 1.0), (1.4, (1, -1), -1.0)])
    events = match_contacts(run, truth, SCENE, DT, TOLERANCE, 2.0)
    assert [(e.kind, e.between, e.time, e.engine_time) for e in events] == [
        ("matched", ("a", "ground"), 0.5, 0.5),
        ("missed", ("a", "b"), 0.7, None),
        ("matched", ("b", "still"), 0.9, 0.9),
        ("phantom", ("b", "ground"), None, 1.4),
    ]


@pytest.mark.parametrize(
    ("pair", "steps", "kinds"),
    [((0, -1), 9, ["matched"]), ((0, -1), 11, ["missed", "phantom"]), ((1, -1), 0, ["missed", "phantom"])],
)
def test_contact_of_another_pair_or_delayed_too_long_is_missed_and_phantom(pair, steps, kinds):
    truth = run_of(SCENE, contacts=[(0.5, (0, -1), -1.0)])
    run = run_of(SCENE, contacts=[(0.5 + steps * DT, pair, -1.0)])
    assert [e.kind for e in match_contacts(run, truth, SCENE, DT, TOLERANCE, 2.0)] == kinds


def test_contacts_beyond_the_end_do_not_count() -> None:
    truth = run_of(SCENE, contacts=[(0.5, (0, -1), -1.0), (1.5, (0, -1), -1.0)])
    run = run_of(SCENE, contacts=[(1.2, (0, 1), 1.0)])
    assert [(e.kind, e.when) for e in match_contacts(run, truth, SCENE, DT, TOLERANCE, 1.0)] == [("missed", 0.5)]


def test_unmatched_contact_just_before_the_end_is_not_judged() -> None:
    truth = run_of(SCENE, contacts=[(1.985, (0, -1), -1.0)])
    assert match_contacts(run_of(SCENE), truth, SCENE, DT, TOLERANCE, 2.0) == ()


def test_rapid_bounces_are_merged_into_one_lasting_contact() -> None:
    """Ten impacts 3 steps apart, and six at other times: one contact each, of the same total impulse."""
    truth = run_of(SCENE, contacts=[(0.5 + 0.03 * n, (0, -1), -0.1) for n in range(10)])
    run = run_of(SCENE, contacts=[(0.51 + 0.035 * n, (0, -1), -0.2) for n in range(6)])
    (event,) = match_contacts(run, truth, SCENE, DT, TOLERANCE, 2.0)
    assert (event.kind, event.lasting) == ("matched", True)
    assert event.delta_impulse == pytest.approx(0.2, rel=1e-12)  # 6 · 0.2 − 10 · 0.1, sixteen roundings


def test_resting_ball_has_one_contact_for_any_number_of_rows() -> None:
    """The ball lies on the ground throughout: rows half a second apart are one contact."""
    position = run_of(SCENE).position.copy()
    position[:, 0, 1] = 0.5
    truth = run_of(SCENE, position, contacts=[(0.0, (0, -1), -9.0)])
    run = run_of(SCENE, position, contacts=[(0.0, (0, -1), -4.0), (0.5, (0, -1), -3.0), (1.0, (0, -1), -2.0)])
    (event,) = match_contacts(run, truth, SCENE, DT, TOLERANCE, 2.0)
    assert (event.kind, event.lasting, event.delta_impulse) == ("matched", True, 0.0)


def test_rest_beginning_at_a_different_time_is_no_miss() -> None:
    position = run_of(SCENE).position.copy()
    position[:, 0, 1] = 0.5
    truth = run_of(SCENE, position, contacts=[(0.2, (0, -1), -9.0)])
    run = run_of(SCENE, position, contacts=[(0.6, (0, -1), -9.0)])
    assert match_contacts(run, truth, SCENE, DT, TOLERANCE, 2.0) == ()


def test_unmatched_contacts_after_divergence_are_not_judged() -> None:
    """Body a has an error of 0.1 m from 0.8 s on, and b has none. Frames are 0.1 s apart."""
    position = run_of(SCENE).position.copy()
    position[8:, 0, 0] += 0.1
    truth = run_of(
        SCENE, contacts=[(0.5, (0, -1), -1.0), (0.79, (0, 1), 1.0), (1.2, (0, -1), -1.0), (1.5, (1, 2), 1.0)]
    )
    run = run_of(SCENE, position, contacts=[(0.5, (0, -1), -1.0), (1.31, (0, -1), -1.0), (1.7, (0, 1), 1.0)])
    assert [(e.kind, e.when) for e in match_contacts(run, truth, SCENE, DT, TOLERANCE, 2.0)] == [
        ("matched", 0.5),
        ("missed", 0.79),
        ("after_divergence", 1.2),
        ("after_divergence", 1.31),
        ("missed", 1.5),
        ("after_divergence", 1.7),
    ]


def test_missed_contact_that_caused_the_divergence_is_judged() -> None:
    position = run_of(SCENE).position.copy()
    position[6:, 0, 0] += 0.1
    truth = run_of(SCENE, contacts=[(0.55, (0, -1), -1.0)])
    assert [e.kind for e in match_contacts(run_of(SCENE, position), truth, SCENE, DT, TOLERANCE, 2.0)] == ["missed"]
