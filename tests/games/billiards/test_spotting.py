"""Spotting of balls: on the spot, behind it, or in front of it."""

import math

import pytest

from sandbox.games.billiards.referee import respotted_position
from sandbox.games.billiards.rules.base import GameError, Respot
from sandbox.games.billiards.rules.snooker import respots
from sandbox.games.billiards.table_geometry import TableGeometry
from tests.games.billiards.tables_by_hand import table

POOL, SNOOKER = TableGeometry.of(table("9-ball")), TableGeometry.of(table("snooker"))
R = POOL.radius[0]
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
