"""Placement and spotting of balls: legal positions, the nearest of them, and spots that are taken."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.games.billiards.placement import allowed, nearest, placement_refusal, spread
from sandbox.games.billiards.referee import respotted_position
from sandbox.games.billiards.rules.base import GameError, PlacementRegion, Respot
from sandbox.games.billiards.rules.snooker import respots
from sandbox.games.billiards.table_geometry import PlacedDisc, TableGeometry
from tests.games.billiards.tables_by_hand import table

POOL, SNOOKER = TableGeometry.of(table("9-ball")), TableGeometry.of(table("snooker"))
R = POOL.radius[0]
OTHERS: list[PlacedDisc] = [(0.6, 1.2, R), (0.6 + 2.0 * R + 0.01, 1.2, R), (0.2, 0.3, R)]


def test_refused_positions_have_a_reason() -> None:
    assert placement_refusal(POOL, "anywhere", (0.3, 2.0), R, OTHERS) is None
    assert placement_refusal(POOL, "anywhere", (0.6, 1.2 + 1.9 * R), R, OTHERS) == "another ball is there"
    assert placement_refusal(POOL, "anywhere", (0.5 * R, 1.0), R, []) == "the ball would be outside the cushions"
    assert placement_refusal(POOL, "anywhere", (-3.0, 1.0), R, []) == "the ball would be outside the cushions"
    assert placement_refusal(POOL, "anywhere", (math.nan, 1.0), R, []) == "the ball would be outside the cushions"
    assert (
        placement_refusal(POOL, "anywhere", (0.01, 0.01), R, []) == "the ball would be outside the cushions"
    )  # inside a pocket
    assert (
        placement_refusal(POOL, "behind the head string", (0.3, 0.7), R, [])
        == "the ball must be placed behind the head string"
    )
    assert (
        placement_refusal(POOL, "behind the head string", (0.3, 0.635), R, []) is None
    )  # on the head string, where racks place the cue ball


def test_d_is_a_half_disc_on_the_baulk_side() -> None:
    radius, (x, y) = SNOOKER.radius[0], SNOOKER.spots["brown"]
    for distance, sign, legal in ((0.28, -1.0, True), (0.30, -1.0, False), (0.1, 1.0, False), (0.0, 1.0, True)):
        refusal = placement_refusal(SNOOKER, "in the D", (x, y + sign * distance), radius, [])
        assert refusal == (None if legal else "the ball must be placed in the D")


def test_nearest_position_of_a_legal_position_is_itself() -> None:
    assert nearest(POOL, "anywhere", (0.3, 2.0), R, OTHERS) == (0.3, 2.0)


def test_nearest_position_beside_a_ball_keeps_a_small_gap() -> None:
    position = nearest(POOL, "anywhere", (0.6, 1.25), R, OTHERS)
    assert position is not None
    assert math.dist(position, (0.6, 1.2)) == pytest.approx(2.0 * R + 1e-5, abs=1e-9)  # 1e-5 m: gap between balls
    assert position[0] == pytest.approx(0.6, abs=1e-9)  # straight away from the ball


@pytest.mark.fail_slow(60)  # takes over half a second
@given(
    region=st.sampled_from(["anywhere", "behind the head string", "in the D"]),
    at=st.tuples(st.floats(-1.0, 2.5), st.floats(-1.0, 4.5)),
    seed=st.integers(0, 50),
)
def test_nearest_position_is_legal_and_no_grid_point_is_nearer(
    region: PlacementRegion, at: tuple[float, float], seed: int
) -> None:
    radius, random = SNOOKER.radius[0], np.random.default_rng(seed)
    (x0, y0), (x1, y1) = SNOOKER.area
    others = [
        (float(x), float(y), radius)
        for x, y in zip(random.uniform(x0, x1, 20), random.uniform(y0, 0.4 * y1, 20), strict=True)
    ]
    found = nearest(SNOOKER, region, at, radius, others)
    assert found is not None
    assert placement_refusal(SNOOKER, region, found, radius, others) is None
    grid = np.stack(np.meshgrid(np.linspace(x0, x1, 60), np.linspace(y0, y1, 120)), axis=-1).reshape(-1, 2)
    legal = grid[allowed(SNOOKER, region, grid, radius, others)]
    # 2 mm: positions around balls and along the D are tried 5° apart, and only some of them in narrow corners
    assert math.dist(found, at) <= np.hypot(*(legal - at).T).min(initial=math.inf) + 2e-3


def test_no_legal_position_gives_none() -> None:
    (x, y), radius = SNOOKER.spots["brown"], SNOOKER.radius[0]
    assert nearest(SNOOKER, "in the D", (x, y), radius, [(x, y, 1.0)]) is None
    assert spread(SNOOKER, "in the D", radius, [(x, y, 1.0)]) == []


FOOT = POOL.spots["foot"]
NINE = Respot("9", ("foot",))


def test_ball_is_placed_on_a_free_spot() -> None:
    assert respotted_position(POOL, NINE, R, [(0.2, 0.3, R)]) == FOOT


def test_ball_is_placed_behind_the_ball_on_the_spot() -> None:
    x, y = respotted_position(POOL, NINE, R, [(FOOT[0], FOOT[1] - R, R)])
    assert x == FOOT[0]
    assert y == pytest.approx(FOOT[1] + R + 1e-5, abs=1e-12)  # 2R behind that ball, plus the gap of 1e-5 m


def test_ball_is_placed_behind_a_row_whose_gaps_are_too_narrow() -> None:
    row = [(FOOT[0], FOOT[1] + k * 3.0 * R, R) for k in range(4)]
    _, y = respotted_position(POOL, NINE, R, row)
    assert y == pytest.approx(FOOT[1] + 11.0 * R + 1e-5, abs=1e-12)


def test_ball_is_placed_in_front_of_the_spot_when_the_line_behind_is_full() -> None:
    row = [(FOOT[0], FOOT[1] + k * 2.0 * R, R) for k in range(12)]
    _, y = respotted_position(POOL, NINE, R, row)
    assert y == pytest.approx(FOOT[1] - 2.0 * R - 1e-5, abs=1e-12)


def test_colour_takes_the_highest_free_spot_and_black_is_placed_behind_its_own() -> None:
    radius, spots = SNOOKER.radius[0], SNOOKER.spots
    taken = [(*spots["black"], radius), (*spots["blue"], radius)]
    (blue,) = respots(("blue",))
    assert respotted_position(SNOOKER, blue, radius, taken) == spots["pink"]
    all_taken = [(*spot, radius) for spot in spots.values()]
    (black,) = respots(("black",))
    x, y = respotted_position(SNOOKER, black, radius, all_taken)
    assert (x, y) == pytest.approx((spots["black"][0], spots["black"][1] + 2.0 * radius + 1e-5), abs=1e-12)


def test_table_without_the_spot_or_free_space_is_refused() -> None:
    with pytest.raises(GameError, match="no spot 'black'"):
        respotted_position(POOL, Respot("black", ("black",)), R, [])
    row = [(FOOT[0], y * R, R) for y in range(0, math.ceil(POOL.area[1][1] / R) + 1, 2)]
    with pytest.raises(GameError, match="no room"):
        respotted_position(POOL, NINE, R, row)
