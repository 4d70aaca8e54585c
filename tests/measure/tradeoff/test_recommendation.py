"""Picking: the cheapest that keeps its word, the best that the budget buys."""

import math
from random import Random

import pymunk
import pytest

from sandbox.engines.pymunk_adapter.colliders import new_space
from sandbox.engines.registry import ENGINES
from sandbox.measure.tradeoff.configuration import Evaluation
from sandbox.measure.tradeoff.metrics import METRICS
from sandbox.measure.tradeoff.objective import Objective
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

AIM = Objective(METRICS["max_position"], 0.01, 0.5, 60.0)
POINTS = [point_of(5.0, 0.02), point_of(10.0, 0.009), point_of(20.0, 0.001), point_of(40.0, 0.0001)]


def never(_: Evaluation) -> float:
    raise AssertionError("nothing is random: nothing is run again")


def test_cheapest_within_the_tolerance_is_taken() -> None:
    found = recommend_cheapest(POINTS, AIM, (), never)
    assert found is not None
    assert (found.point, found.fresh_seeds, found.fresh_error) == (POINTS[1], (), None)


def test_pick_that_fails_on_fresh_seeds_gives_way_to_the_next() -> None:
    asked: list[Evaluation] = []

    def again(point: Evaluation) -> float:
        asked.append(point)
        return {10.0: 0.011, 20.0: 0.009}[point.cost or 0.0]

    found = recommend_cheapest(POINTS, AIM, (4, 5, 6), again)
    assert found is not None
    assert (found.point, found.fresh_seeds, found.fresh_error) == (POINTS[2], (4, 5, 6), 0.009)
    assert asked == POINTS[1:3]
    assert "9 mm with other seeds" in found.sentence


@pytest.mark.parametrize("fresh", [math.inf, math.nan, 0.02])
def test_none_is_picked_where_all_fail_on_fresh_seeds(fresh: float) -> None:
    assert recommend_cheapest(POINTS, AIM, (1,), lambda _: fresh) is None


def test_times_within_the_noise_are_decided_by_counted_work() -> None:
    def picked(engines: str, *costs: float) -> float | None:
        figures = zip(engines, costs, (3.0, 2.0, 1.0), strict=True)
        points = [point_of(cost, 0.0, engine, counted=counted) for engine, cost, counted in figures]
        found = recommend_cheapest(points, AIM, (), never)
        assert found is not None
        return found.point.counted

    for engines in ("aaa", "abc"):
        assert picked(engines, 10.0, 10.0, 10.0) == 1.0
        assert picked(engines, 10.0, 11.0, 14.0) == picked(engines, 14.0, 11.0, 10.0) == 1.0
    assert picked("abc", 10.0, 14.0, 16.0) == 2.0  # of another engine, the third takes more than noise explains
    assert picked("abc", 10.0, 16.0, 20.0) == 3.0
    assert picked("aaa", 10.0, 16.0, 39.0) == 1.0  # of one engine, the counters tell
    assert picked("aaa", 10.0, 16.0, 41.0) == 2.0  # unless they are far off


def test_of_settings_alike_in_time_and_work_the_one_that_changes_less_is_taken() -> None:
    plain = point_of(10.4, 0.001, counted=10.4, substeps=2)
    points = [point_of(10.0, 0.002, counted=10.0, substeps=2, half_kick=True), plain]
    found = recommend_cheapest(points, AIM, (), never)
    assert found is not None
    assert found.point is plain


def test_noise_of_the_clock_does_not_change_the_answer() -> None:
    noise = Random(1)
    for _ in range(200):
        points = [point_of(c * noise.uniform(1.0, 1.2), e, counted=c) for c, e in ((10.0, 0.009), (20.0, 0.001))]
        points.append(point_of(11.0 * noise.uniform(1.0, 1.2), 0.002, counted=11.0))
        found = recommend_cheapest(points, AIM, (), never)
        assert found is not None
        assert found.point.counted == 10.0


def test_a_time_with_frames_kept_is_no_match_for_one_without() -> None:
    found = recommend_cheapest([point_of(1.0, 0.0, repeats=0), point_of(9.0, 0.0)], AIM, (), never)
    assert found is not None
    assert found.point.cost == 9.0


def test_nearest_is_the_most_accurate_and_of_the_budget_the_cheapest() -> None:
    aim = AIM._replace(tolerance=1e-9, budget=1e-9)
    near, cheap = nearest_to_tolerance(POINTS, aim), nearest_to_budget(POINTS, aim)
    assert near is not None
    assert cheap is not None
    assert (near.point, cheap.point) == (POINTS[3], POINTS[0])
    assert "ms per frame" in cheap.sentence
    assert nearest_to_tolerance([point_of(1.0, None)], aim) is None
    assert nearest_to_budget([], aim) is None


def test_lines_for_pymunk_give_a_space_what_the_engine_gives_its_own() -> None:
    scene = scene_of(DROP)
    filled = ENGINES["pymunk"].resolve(scene, scene.solver.replace(substeps=3, iterations=7, half_kick=True))
    ours, own = new_space(scene, filled), pymunk.Space()
    own.gravity = scene.world.gravity
    body = pymunk.Body(1.0, 1.0)
    own.add(body)
    steps: list[float] = []
    step = own.step
    own.step = lambda h: (steps.append(h), step(h))  # type: ignore[method-assign, assignment]
    exec("\n".join(pymunk_lines(filled)), {"space": own, "body": body})
    for name in ("iterations", "collision_slop", "collision_bias", "collision_persistence"):
        assert getattr(own, name) == getattr(ours, name)
    assert steps == [filled.h] * 3
    h, g = filled.h, scene.world.gravity[1]
    # Half a step ahead, positions of free flight are exact but for rounding.
    assert body.position.y == pytest.approx(0.5 * g * (3 * h) ** 2, rel=1e-12)
    assert pymunk_lines(filled.replace(substeps=1, half_kick=False))[-1] == "space.step(0.02)"


def test_what_has_no_figures_is_not_picked() -> None:
    useless = [point_of(1.0, None), point_of(1.0, math.nan), point_of(1.0, math.inf)]
    assert not any(point.is_usable for point in useless)
    assert recommend_cheapest(useless, AIM, (), never) is None
    assert recommend_most_accurate(useless, AIM, (), never) is None


def test_best_within_the_budget_is_the_most_right() -> None:
    found = recommend_most_accurate(POINTS, AIM, (), never)  # 0.5 ms per frame, 60 a second: 30 ms per simulated second
    assert found is not None
    assert found.point == POINTS[2]
    assert recommend_most_accurate(POINTS, AIM._replace(budget=0.01), (), never) is None
    assert recommend_most_accurate(POINTS, AIM._replace(budget=None), (), never) is None


def test_cheapest_of_those_equally_right_is_best() -> None:
    found = recommend_most_accurate([point_of(9.0, 0.0), point_of(3.0, 0.0)], AIM, (), never)
    assert found is not None
    assert found.point.cost == 3.0


def test_step_longer_than_a_frame_has_to_fit_into_one() -> None:
    """20 ms a second in steps of 0.1 s is 2 ms in the frame that the step falls into."""
    found = recommend_most_accurate([point_of(20.0, 0.0, dt=0.1), point_of(20.0, 0.5, dt=0.01)], AIM, (), never)
    assert found is not None
    assert found.point.settings.dt == 0.01


def test_step_longer_than_is_wanted_is_not_recommended() -> None:
    points = [point_of(1.0, 0.0, dt=0.04), point_of(9.0, 0.0, dt=0.02)]
    for pick in (
        recommend_cheapest(points, AIM._replace(max_dt=0.02), (), never),
        recommend_most_accurate(points, AIM._replace(max_dt=0.02), (), never),
    ):
        assert pick is not None
        assert pick.point.settings.dt == 0.02


def test_sentence_says_what_it_is_and_what_it_takes() -> None:
    found = recommend_cheapest([point_of(12.0, 0.00031, dt=0.01, substeps=4)], AIM, (), never)
    assert found is not None
    assert found.sentence == (
        "pymunk with dt = 0.01, substeps = 4: max_position 310 µm, 12 ms per simulated second (1.2 % of real time), "
        "0.2 ms per frame of the budget of 0.5 ms"
    )
    coarse = recommend_cheapest([point_of(12.0, 0.0, dt=0.1)], AIM, (), never)
    assert coarse is not None
    assert "longer than a frame" in coarse.sentence


def test_bullets_are_counted() -> None:
    aim = Objective(METRICS["passes"], 0.5, None, 60.0)
    found = recommend_cheapest([point_of(1.0, 0.125)], aim, (), never)
    assert found is not None
    assert "1 in 8 contacts missed" in found.sentence
    whole = recommend_cheapest([point_of(1.0, 0.0)], aim, (), never)
    assert whole is not None
    assert "1 in" not in whole.sentence


def test_name_tells_what_is_set_and_what_is_left_open() -> None:
    assert label(point_of(1.0, 0.0)) == "pymunk with the settings of the scene"
    assert label(point_of(1.0, 0.0, dt=0.001, half_kick=True)) == "pymunk with dt = 0.001, half_kick = true"
    assert label(point_of(1.0, 0.0, substeps=2, integrator=None)) == "pymunk with substeps = 2 without integrator"
