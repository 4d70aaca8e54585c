"""Pareto fronts and recommendations: the cheapest setting within a tolerance, the most accurate one within a budget."""

import math
from itertools import pairwise

import numpy as np
import pymunk
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.engines.pymunk_adapter.colliders import new_space
from sandbox.engines.registry import ENGINES
from sandbox.measure.compare.metrics import METRICS
from sandbox.measure.fresh_starts import FreshStarts
from sandbox.measure.tradeoff.configuration import Evaluation
from sandbox.measure.tradeoff.objective import Objective, is_dominated, pareto
from sandbox.measure.tradeoff.recommendation import (
    label,
    nearest_to_budget,
    nearest_to_tolerance,
    pymunk_lines,
    recommend_cheapest,
    recommend_most_accurate,
)
from tests.measure.tradeoff.evaluations_by_hand import point_of
from tests.runs_by_hand import DROP, scene_of

OBJECTIVE = Objective(METRICS["max_position"], 0.01, 0.5, 60.0)
POINTS = [point_of(5.0, 0.02), point_of(10.0, 0.009), point_of(20.0, 0.001), point_of(40.0, 0.0001)]


def never(_: Evaluation) -> bool:
    raise AssertionError("an evaluation that is not within the tolerance is not tried from other starts")


def always(_: Evaluation) -> bool:
    return True


def unconfirmed(_: Evaluation) -> None:
    return None


def test_cheapest_within_the_tolerance_is_recommended() -> None:
    found = recommend_cheapest(POINTS, OBJECTIVE, always, unconfirmed)
    assert (found.point, found.confirmation) == (POINTS[1], None)
    assert recommend_cheapest(POINTS[:1], OBJECTIVE, never, unconfirmed) is None


def test_setting_that_fails_from_other_starts_is_skipped() -> None:
    tried: list[Evaluation] = []

    def holds(point: Evaluation) -> bool:
        tried.append(point)
        return point is POINTS[2]

    confirmation = FreshStarts.of([0.009] * 29 + [0.02], 0.01)
    found = recommend_cheapest(POINTS, OBJECTIVE, holds, lambda _: confirmation)
    assert (found.point, found.confirmation) == (POINTS[2], confirmation)
    assert tried == POINTS[1:3]
    assert found.sentence.endswith("held in 29 of 30 fresh starts (95 % interval 83 to 99 %)")


def test_nothing_is_recommended_if_all_fail_from_other_starts() -> None:
    assert recommend_cheapest(POINTS, OBJECTIVE, lambda _: False, unconfirmed) is None


def test_confirmation_has_quantiles_and_counts_failed_runs() -> None:
    found = FreshStarts.of([*np.arange(1.0, 20.0), math.inf], 10.0)
    assert (found.held.hits, found.held.trials) == (10, 20)
    assert (found.median_error, found.error_95) == (11.0, None)  # a run of 20 failed: the quantile is unknown
    assert FreshStarts.of(np.arange(1.0, 101.0).tolist(), 95.0).error_95 == 96.0  # 95 of 100 are below it
    assert FreshStarts.of(np.arange(1.0, 101.0).tolist(), 95.0).error_5 == 5.0  # 4 of 100 are below it
    assert FreshStarts.of([3.0, 1.0, 2.0], 1.0).error_5 == 1.0  # of few starts the smallest error, and the largest
    assert FreshStarts.of([3.0, 1.0, 2.0], 1.0).error_95 == 3.0
    assert FreshStarts.of([], 1.0).held.trials == 0


def test_times_within_the_noise_are_decided_by_counted_work() -> None:
    def picked(engines: str, *costs: float) -> float | None:
        numbers = zip(engines, costs, (3.0, 2.0, 1.0), strict=True)
        points = [point_of(cost, 0.0, engine, counted=counted) for engine, cost, counted in numbers]
        found = recommend_cheapest(points, OBJECTIVE, always, unconfirmed)
        return found.point.counted

    for engines in ("aaa", "abc"):
        assert picked(engines, 10.0, 10.0, 10.0) == 1.0
        assert picked(engines, 10.0, 11.0, 14.0) == picked(engines, 14.0, 11.0, 10.0) == 1.0
        assert picked(engines, 10.0, 14.0, 16.0) == 2.0  # the third is slower than noise explains
        assert picked(engines, 10.0, 16.0, 20.0) == 3.0


def test_setting_with_fewer_changes_is_preferred_at_equal_time_and_work() -> None:
    plain = point_of(10.4, 0.001, counted=10.4, substeps=2)
    points = [point_of(10.0, 0.002, counted=10.0, substeps=2, half_kick=True), plain]
    found = recommend_cheapest(points, OBJECTIVE, always, unconfirmed)
    assert found.point is plain


def test_cost_measured_with_recording_is_not_compared() -> None:
    found = recommend_cheapest([point_of(1.0, 0.0, repeats=0), point_of(9.0, 0.0)], OBJECTIVE, always, unconfirmed)
    assert found.point.cost == 9.0


def test_nearest_to_tolerance_is_most_accurate_and_to_budget_cheapest() -> None:
    objective = OBJECTIVE._replace(tolerance=1e-9, budget=1e-9)
    near, cheap = nearest_to_tolerance(POINTS, objective), nearest_to_budget(POINTS, objective)
    assert (near.point, cheap.point) == (POINTS[3], POINTS[0])
    assert "ms per frame" in cheap.sentence
    assert nearest_to_tolerance([point_of(1.0, None)], objective) is None
    assert nearest_to_budget([], objective) is None


def test_pymunk_lines_configure_a_space_as_the_engine_does() -> None:
    scene = scene_of(DROP)
    resolved = ENGINES["pymunk"].resolve(scene, scene.solver.replace(substeps=3, iterations=7, half_kick=True))
    ours, own = new_space(scene, resolved), pymunk.Space()
    own.gravity = scene.world.gravity
    body = pymunk.Body(1.0, 1.0)
    own.add(body)
    steps: list[float] = []
    step = own.step
    own.step = lambda h: (steps.append(h), step(h))  # type: ignore[method-assign, assignment]
    exec("\n".join(pymunk_lines(resolved)), {"space": own, "pymunk": pymunk})
    for name in ("iterations", "collision_slop", "collision_bias", "collision_persistence"):
        # pymunk rounds its default of collision_bias to 32 bits, and the lines leave defaults out
        assert getattr(own, name) == pytest.approx(getattr(ours, name), rel=1e-5)
    assert steps == [resolved.h] * 3
    h, g = resolved.h, scene.world.gravity[1]
    # With half_kick, positions of free flight are exact to rounding.
    assert body.position.y == pytest.approx(0.5 * g * (3 * h) ** 2, rel=1e-12)
    assert pymunk_lines(resolved.replace(substeps=1, half_kick=False))[-2:] == [
        "dt = 0.02",
        "space.step(dt)  # every frame",
    ]


def test_point_without_finite_error_is_not_recommended() -> None:
    useless = [point_of(1.0, None), point_of(1.0, math.nan), point_of(1.0, math.inf)]
    assert not any(point.is_usable for point in useless)
    assert recommend_cheapest(useless, OBJECTIVE, always, unconfirmed) is None
    assert recommend_most_accurate(useless, OBJECTIVE, lambda _: True, unconfirmed) is None


def test_most_accurate_within_the_budget_is_recommended() -> None:
    # 0.5 ms per frame, 60 a second: 30 ms per simulated second
    found = recommend_most_accurate(POINTS, OBJECTIVE, lambda _: True, unconfirmed)
    assert found.point == POINTS[2]
    assert recommend_most_accurate(POINTS, OBJECTIVE._replace(budget=0.01), lambda _: True, unconfirmed) is None
    assert recommend_most_accurate(POINTS, OBJECTIVE._replace(budget=None), lambda _: True, unconfirmed) is None


def test_cheapest_of_equally_accurate_points_is_recommended() -> None:
    found = recommend_most_accurate([point_of(9.0, 0.0), point_of(3.0, 0.0)], OBJECTIVE, lambda _: True, unconfirmed)
    assert found.point.cost == 3.0


def test_step_longer_than_a_frame_has_to_fit_into_one() -> None:
    """20 ms per second in steps of 0.1 s is 2 ms in the frame that contains the step."""
    found = recommend_most_accurate(
        [point_of(20.0, 0.0, dt=0.1), point_of(20.0, 0.5, dt=0.01)], OBJECTIVE, lambda _: True, unconfirmed
    )
    assert found.point.settings.dt == 0.01


def test_step_longer_than_max_dt_is_not_recommended() -> None:
    points = [point_of(1.0, 0.0, dt=0.04), point_of(9.0, 0.0, dt=0.02)]
    for pick in (
        recommend_cheapest(points, OBJECTIVE._replace(max_dt=0.02), always, unconfirmed),
        recommend_most_accurate(points, OBJECTIVE._replace(max_dt=0.02), lambda _: True, unconfirmed),
    ):
        assert pick.point.settings.dt == 0.02


def test_sentence_states_settings_error_and_cost() -> None:
    found = recommend_cheapest([point_of(12.0, 0.00031, dt=0.01, substeps=4)], OBJECTIVE, always, unconfirmed)
    assert found.sentence == (
        "pymunk with dt = 0.01, substeps = 4: max_position 310 µm, 12 ms per simulated second (1.2 % of real time), "
        "0.2 ms per frame of the budget of 0.5 ms"
    )
    coarse = recommend_cheapest([point_of(12.0, 0.0, dt=0.1)], OBJECTIVE, always, unconfirmed)
    assert "longer than a frame" in coarse.sentence


def test_missed_contacts_are_stated_as_a_ratio() -> None:
    objective = Objective(METRICS["passes"], 0.5, None, 60.0)
    found = recommend_cheapest([point_of(1.0, 0.125)], objective, always, unconfirmed)
    assert "1 in 8 contacts missed" in found.sentence
    whole = recommend_cheapest([point_of(1.0, 0.0)], objective, always, unconfirmed)
    assert "1 in" not in whole.sentence


def test_label_names_set_and_omitted_settings() -> None:
    assert label(point_of(1.0, 0.0)) == "pymunk with the settings of the scene"
    assert label(point_of(1.0, 0.0, dt=0.001, half_kick=True)) == "pymunk with dt = 0.001, half_kick = true"
    assert label(point_of(1.0, 0.0, substeps=2, integrator=None)) == "pymunk with substeps = 2 without integrator"


NUMBERS = st.one_of(st.sampled_from([0.0, 1.0, 2.0, 3.0]), st.floats(0.0, 1e6))
"""A few values, so that ties are common, and a wide range."""
CLOUD = st.lists(st.tuples(NUMBERS, NUMBERS), max_size=30)
Pair = tuple[float, float]


def cost(point: Pair) -> float:
    return point[0]


def error(point: Pair) -> float:
    return point[1]


def dominates(a: Pair, b: Pair) -> bool:
    """Return whether a is no worse than b in both coordinates, and better in one."""
    return a[0] <= b[0] and a[1] <= b[1] and a != b


@given(CLOUD)
def test_front_has_the_points_that_none_dominates_by_cost(points: list[Pair]) -> None:
    front = pareto(points, cost, error)
    for point in points:
        assert any(dominates(other, point) for other in points) == (point not in front)
    for before, after in pairwise(front):
        assert before[0] < after[0]
        assert before[1] > after[1]


def test_first_of_equals_is_kept() -> None:
    equals = [("a", 1.0, 2.0), ("b", 1.0, 2.0), ("c", 1.0, 3.0)]
    assert pareto(equals, lambda each: each[1], lambda each: each[2]) == equals[:1]


def test_dominance_needs_the_cost_margin_and_no_larger_error() -> None:
    assert is_dominated(10.0, 1.0, [(6.9, 1.0)], 0.7)
    assert not is_dominated(10.0, 1.0, [(7.1, 1.0)], 0.7)  # cheaper, but by less than the margin
    assert not is_dominated(10.0, 1.0, [(1.0, 1.1)], 0.7)  # cheaper, but less accurate
    assert not is_dominated(0.0, 0.0, [(0.0, 0.0)], 0.7) and not is_dominated(1.0, 0.0, [(1.0, 0.0)], 0.7)  # itself
