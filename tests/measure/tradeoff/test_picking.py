"""Picking: the cheapest that keeps its word, the best that the budget buys."""

import math

import pytest
from trials_by_hand import point_of

from sandbox.measure.tradeoff.aim import Aim
from sandbox.measure.tradeoff.metrics import METRICS
from sandbox.measure.tradeoff.picking import called, cheapest, closest
from sandbox.measure.tradeoff.point import Point

AIM = Aim(METRICS["max_position"], 0.01, 0.5, 60.0)
POINTS = [point_of(5.0, 0.02), point_of(10.0, 0.009), point_of(20.0, 0.001), point_of(40.0, 0.0001)]


def never(_: Point) -> float:
    raise AssertionError("nothing is random: nothing is run again")


def test_cheapest_within_the_tolerance_is_taken() -> None:
    found = cheapest(POINTS, AIM, (), never)
    assert found is not None
    assert (found.point, found.fresh_seeds, found.fresh_error) == (POINTS[1], (), None)


def test_pick_that_fails_on_fresh_seeds_gives_way_to_the_next() -> None:
    asked: list[Point] = []

    def again(point: Point) -> float:
        asked.append(point)
        return {10.0: 0.011, 20.0: 0.009}[point.cost or 0.0]

    found = cheapest(POINTS, AIM, (4, 5, 6), again)
    assert found is not None
    assert (found.point, found.fresh_seeds, found.fresh_error) == (POINTS[2], (4, 5, 6), 0.009)
    assert asked == POINTS[1:3]
    assert "9 mm on fresh seeds" in found.sentence


@pytest.mark.parametrize("fresh", [math.inf, math.nan, 0.02])
def test_none_is_picked_where_all_fail_on_fresh_seeds(fresh: float) -> None:
    assert cheapest(POINTS, AIM, (1,), lambda _: fresh) is None


def test_what_has_no_figures_is_not_picked() -> None:
    useless = [point_of(1.0, None), point_of(1.0, math.nan), point_of(1.0, math.inf)]
    assert not any(point.usable for point in useless)
    assert cheapest(useless, AIM, (), never) is None
    assert closest(useless, AIM, (), never) is None


def test_best_within_the_budget_is_the_most_right() -> None:
    found = closest(POINTS, AIM, (), never)  # 0.5 ms a frame, 60 a second: 30 ms per simulated second
    assert found is not None
    assert found.point == POINTS[2]
    assert closest(POINTS, AIM._replace(budget=0.01), (), never) is None
    assert closest(POINTS, AIM._replace(budget=None), (), never) is None


def test_cheapest_of_those_equally_right_is_best() -> None:
    found = closest([point_of(9.0, 0.0), point_of(3.0, 0.0)], AIM, (), never)
    assert found is not None
    assert found.point.cost == 3.0


def test_step_longer_than_a_frame_has_to_fit_into_one() -> None:
    """20 ms a second in steps of 0.1 s is 2 ms in the frame that the step falls into."""
    found = closest([point_of(20.0, 0.0, dt=0.1), point_of(20.0, 0.5, dt=0.01)], AIM, (), never)
    assert found is not None
    assert found.point.settings.dt == 0.01


def test_step_longer_than_is_wanted_is_not_recommended() -> None:
    points = [point_of(1.0, 0.0, dt=0.04), point_of(9.0, 0.0, dt=0.02)]
    for pick in (
        cheapest(points, AIM._replace(step=0.02), (), never),
        closest(points, AIM._replace(step=0.02), (), never),
    ):
        assert pick is not None
        assert pick.point.settings.dt == 0.02


def test_sentence_says_what_it_is_and_what_it_takes() -> None:
    found = cheapest([point_of(12.0, 0.00031, dt=0.01, substeps=4)], AIM, (), never)
    assert found is not None
    assert found.sentence == (
        "pymunk with dt = 0.01, substeps = 4: max_position 310 µm, 12 ms a simulated second (1.2 % of real time)"
    )
    coarse = cheapest([point_of(12.0, 0.0, dt=0.1)], AIM, (), never)
    assert coarse is not None
    assert "longer than a frame" in coarse.sentence


def test_bullets_are_counted() -> None:
    aim = Aim(METRICS["passes"], 0.5, None, 60.0)
    found = cheapest([point_of(1.0, 0.125)], aim, (), never)
    assert found is not None
    assert "1 in 8 passes unseen" in found.sentence
    whole = cheapest([point_of(1.0, 0.0)], aim, (), never)
    assert whole is not None
    assert "1 in" not in whole.sentence


def test_name_tells_what_is_set_and_what_is_left_open() -> None:
    assert called(point_of(1.0, 0.0)) == "pymunk as the scene has it"
    assert called(point_of(1.0, 0.0, dt=0.001, half_kick=True)) == "pymunk with dt = 0.001, half_kick = true"
    assert called(point_of(1.0, 0.0, substeps=2, integrator=None)) == "pymunk with substeps = 2 without integrator"
