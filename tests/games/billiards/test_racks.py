"""Racks: legal set-ups, seeded gaps."""

import math
from itertools import chain, combinations, pairwise
from typing import Any

import pytest

from sandbox.games.billiards.tables import HAIR
from sandbox.scene.description.base import Point
from sandbox.scene.files.load import from_document

SOLIDS = {str(number) for number in range(1, 8)}
STRIPES = {str(number) for number in range(9, 16)}
RADIUS = 0.028575
FOOT = (0.635, 1.905)
ROUNDING = 1e-15  # m, of places up to 4 m from the origin, and a little more


def racked(game: str, table: str = "pool-9ft", seed: int = 0, **more: Any) -> dict[str, Point]:
    scene = from_document({"world": {"seed": seed}, "billiards": {"table": table, "game": game, **more}})
    return {str(ball.name): ball.position for ball in scene.balls}


def gaps(places: dict[str, Point], radius: float) -> list[float]:
    """Return what lies between every two balls, least first, m."""
    return sorted(math.dist(a, b) - 2.0 * radius for a, b in combinations(places.values(), 2))


def rows(places: dict[str, Point]) -> list[list[str]]:
    """Return the balls in rows along the table, each from left to right."""
    ordered = sorted(places, key=lambda name: places[name][1])
    found: list[list[str]] = [[ordered[0]]]
    for one, name in pairwise(ordered):
        if places[name][1] - places[one][1] > RADIUS:
            found.append([])
        found[-1].append(name)
    return [sorted(row, key=lambda name: places[name][0]) for row in found]


@pytest.mark.parametrize("seed", range(20))
def test_eight_ball_is_racked_as_its_rules_say(seed: int) -> None:
    cue, *laid = rows(racked("8-ball", seed=seed))
    assert cue == ["cue"]
    assert [len(row) for row in laid] == [1, 2, 3, 4, 5]
    assert laid[0] == ["1"]
    assert laid[2][1] == "8"
    ends = {laid[4][0], laid[4][4]}
    assert len(ends & SOLIDS) == len(ends & STRIPES) == 1
    assert sorted(chain(*laid), key=int) == [str(number) for number in range(1, 16)]


@pytest.mark.parametrize("seed", range(20))
def test_nine_ball_is_racked_as_its_rules_say(seed: int) -> None:
    _, *laid = rows(racked("9-ball", seed=seed))
    assert [len(row) for row in laid] == [1, 2, 3, 2, 1]
    assert laid[0] == ["1"]
    assert laid[2][1] == "9"
    assert sorted(chain(*laid)) == [str(number) for number in range(1, 10)]


def test_orders_of_a_rack_come_from_the_seed() -> None:
    orders = {tuple(chain(*rows(racked("8-ball", seed=seed)))) for seed in range(20)}
    assert len(orders) == 20
    corners = {rows(racked("8-ball", seed=seed))[5][0] in SOLIDS for seed in range(20)}
    assert corners == {True, False}


@pytest.mark.parametrize("game", ["8-ball", "9-ball", "snooker"])
def test_same_seed_racks_the_same_to_the_bit(game: str) -> None:
    table = "snooker-12ft" if game == "snooker" else "pool-9ft"
    one, again, other = (racked(game, table, seed) for seed in (3, 3, 4))
    assert one == again
    assert one != other


@pytest.mark.parametrize("game", ["8-ball", "9-ball"])
def test_frozen_rack_touches_and_lies_on_its_spot(game: str) -> None:
    places = racked(game, gap=0.0)
    del places["cue"]
    count = len(places)
    apart = gaps(places, RADIUS)
    contacts = 30 if count == 15 else 16  # three directions of a triangle of five rows; of a diamond of three
    assert apart[0] >= 0.0
    assert apart[contacts - 1] <= HAIR + ROUNDING
    assert apart[contacts] > RADIUS
    assert places["1"] == FOOT


@pytest.mark.parametrize("gap", [1e-4, 2e-3])
def test_neighbours_are_apart_by_chance_up_to_the_gap(gap: float) -> None:
    apart: list[float] = []
    for seed in range(30):
        places = racked("8-ball", seed=seed, gap=gap)
        del places["cue"]
        apart += gaps(places, RADIUS)[:30]
    assert min(apart) >= 0.0
    assert max(apart) <= gap + ROUNDING
    # 900 gaps, about a mean of half the gap with a deviation of 0.18 of it: four deviations of the mean
    assert sum(apart) / len(apart) == pytest.approx(0.5 * gap, abs=4 * 0.18 * gap / math.sqrt(900 / 2))


def test_snooker_is_set_up_as_its_rules_say() -> None:
    places, radius = racked("snooker", "snooker-12ft", gap=0.0), 0.02625
    assert len(places) == 22
    assert places["blue"] == (0.889, 1.7845)
    assert places["black"] == (0.889, 3.569 - 0.324)
    assert gaps(places, radius)[29] <= HAIR + ROUNDING
    # the first red as near the pink as it can be without touching, in line with it
    assert places["red-1"][0] == places["pink"][0]
    assert 0.0 < math.dist(places["red-1"], places["pink"]) - 2.0 * radius < 0.002
    assert all(places[f"red-{number}"][1] > places["pink"][1] for number in range(1, 16))
    # the cue ball lies in the D: behind the line, within 292 mm of the brown
    assert places["cue"][1] == 0.737
    assert math.dist(places["cue"], places["brown"]) < 0.292


@pytest.mark.parametrize("game", ["three-cushion", "straight-rail"])
def test_carom_opens_as_its_rules_say(game: str) -> None:
    places = racked(game, "carom-10ft")
    assert places["red"] == (0.71, 2.13)
    assert places["yellow"] == (0.71, 0.71)
    # UMB 23: beside the other's ball, 182.5 mm from its middle
    assert math.dist(places["white"], places["yellow"]) == pytest.approx(0.1825, abs=ROUNDING)
    assert places["white"][1] == 0.71
