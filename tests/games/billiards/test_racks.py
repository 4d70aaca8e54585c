"""Racks: legal arrangements, seeded gaps."""

import math
from itertools import chain, combinations, pairwise
from typing import Any

import pytest

from sandbox.games.billiards.tables import RACK_GAP
from sandbox.scene.description.base import Point
from sandbox.scene.files.load import from_document

SOLIDS = {str(number) for number in range(1, 8)}
STRIPES = {str(number) for number in range(9, 16)}
RADIUS = 0.028575
FOOT = (0.635, 1.905)
ROUNDING = 1e-15  # m, of positions up to 4 m from the origin, with a margin


def racked(game: str, table: str = "pool-9ft", seed: int = 0, **more: Any) -> dict[str, Point]:
    scene = from_document({"world": {"seed": seed}, "billiards": {"table": table, "game": game, **more}})
    return {str(ball.name): ball.position for ball in scene.balls}


def gaps(positions: dict[str, Point], radius: float) -> list[float]:
    """Return the gaps between all pairs of balls, m, in ascending order."""
    return sorted(math.dist(a, b) - 2.0 * radius for a, b in combinations(positions.values(), 2))


def rows(positions: dict[str, Point]) -> list[list[str]]:
    """Return the rows of balls in order along the table, each row from left to right."""
    ordered = sorted(positions, key=lambda name: positions[name][1])
    found: list[list[str]] = [[ordered[0]]]
    for one, name in pairwise(ordered):
        if positions[name][1] - positions[one][1] > RADIUS:
            found.append([])
        found[-1].append(name)
    return [sorted(row, key=lambda name: positions[name][0]) for row in found]


@pytest.mark.parametrize("seed", range(20))
def test_eight_ball_rack_follows_the_rules(seed: int) -> None:
    cue, *rack = rows(racked("8-ball", seed=seed))
    assert cue == ["cue"]
    assert [len(row) for row in rack] == [1, 2, 3, 4, 5]
    assert rack[0] == ["1"]
    assert rack[2][1] == "8"
    ends = {rack[4][0], rack[4][4]}
    assert len(ends & SOLIDS) == len(ends & STRIPES) == 1
    assert sorted(chain(*rack), key=int) == [str(number) for number in range(1, 16)]


@pytest.mark.parametrize("seed", range(20))
def test_nine_ball_rack_follows_the_rules(seed: int) -> None:
    _, *rack = rows(racked("9-ball", seed=seed))
    assert [len(row) for row in rack] == [1, 2, 3, 2, 1]
    assert rack[0] == ["1"]
    assert rack[2][1] == "9"
    assert sorted(chain(*rack)) == [str(number) for number in range(1, 10)]


def test_order_of_a_rack_depends_on_the_seed() -> None:
    orders = {tuple(chain(*rows(racked("8-ball", seed=seed)))) for seed in range(20)}
    assert len(orders) == 20
    corners = {rows(racked("8-ball", seed=seed))[5][0] in SOLIDS for seed in range(20)}
    assert corners == {True, False}


@pytest.mark.parametrize("game", ["8-ball", "9-ball", "snooker"])
def test_same_seed_gives_bit_identical_racks(game: str) -> None:
    table = "snooker-12ft" if game == "snooker" else "pool-9ft"
    one, again, other = (racked(game, table, seed) for seed in (3, 3, 4))
    assert one == again
    assert one != other


@pytest.mark.parametrize("game", ["8-ball", "9-ball"])
def test_rack_without_gap_touches_and_has_its_first_ball_on_the_spot(game: str) -> None:
    positions = racked(game, gap=0.0)
    del positions["cue"]
    count = len(positions)
    distances = gaps(positions, RADIUS)
    contacts = 30 if count == 15 else 16  # along the three directions of a triangle of five rows; of a diamond of three
    assert distances[0] >= 0.0
    assert distances[contacts - 1] <= RACK_GAP + ROUNDING
    assert distances[contacts] > RADIUS
    assert positions["1"] == FOOT


@pytest.mark.parametrize("gap", [1e-4, 2e-3])
def test_gaps_of_neighbours_are_random_up_to_the_stated_gap(gap: float) -> None:
    distances: list[float] = []
    for seed in range(30):
        positions = racked("8-ball", seed=seed, gap=gap)
        del positions["cue"]
        distances += gaps(positions, RADIUS)[:30]
    assert min(distances) >= 0.0
    assert max(distances) <= gap + ROUNDING
    # 900 gaps with a mean of half the gap and a standard deviation of 0.18 of it: four standard errors
    assert sum(distances) / len(distances) == pytest.approx(0.5 * gap, abs=4 * 0.18 * gap / math.sqrt(900 / 2))


def test_snooker_rack_follows_the_rules() -> None:
    positions, radius = racked("snooker", "snooker-12ft", gap=0.0), 0.02625
    assert len(positions) == 22
    assert positions["blue"] == (0.889, 1.7845)
    assert positions["black"] == (0.889, 3.569 - 0.324)
    assert gaps(positions, radius)[29] <= RACK_GAP + ROUNDING
    # the first red is in line with the pink, as near as possible without touching
    assert positions["red-1"][0] == positions["pink"][0]
    assert 0.0 < math.dist(positions["red-1"], positions["pink"]) - 2.0 * radius < 0.002
    assert all(positions[f"red-{number}"][1] > positions["pink"][1] for number in range(1, 16))
    # the cue ball lies in the D: behind the line, within 292 mm of the brown
    assert positions["cue"][1] == 0.737
    assert math.dist(positions["cue"], positions["brown"]) < 0.292


@pytest.mark.parametrize("game", ["three-cushion", "straight-rail"])
def test_carom_opening_position_follows_the_rules(game: str) -> None:
    positions = racked(game, "carom-10ft")
    assert positions["red"] == (0.71, 2.13)
    assert positions["yellow"] == (0.71, 0.71)
    # UMB 23: beside the opponent's ball, 182.5 mm between the centres
    assert math.dist(positions["white"], positions["yellow"]) == pytest.approx(0.1825, abs=ROUNDING)
    assert positions["white"][1] == 0.71
