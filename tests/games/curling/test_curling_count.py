"""Score of an end, and stones out of play, by the positions of the stones."""

import math

import pytest

from sandbox.games.curling.rules import CurlingScore
from sandbox.games.curling.sheet import (
    BACK,
    HOG,
    LENGTH,
    RELEASE,
    RINGS,
    STONE,
    STONES,
    TEES,
    WIDTH,
    end_score,
    in_free_guard_zone,
    in_house,
    is_hogged,
    is_out_of_play,
    parked_position,
    removed_position,
    stone_name,
)
from sandbox.scene.description.base import Point

RED, YELLOW = 0, 1
FOOT = 0.3048


def test_sheet_has_the_dimensions_of_the_rules() -> None:
    # in feet, the original unit of the sheet; the rules state millimetres
    lengths = [LENGTH, HOG, BACK, TEES, TEES - 2 * HOG, *RINGS]
    assert lengths == pytest.approx([feet * FOOT for feet in (150, 21, 6, 114, 72, 6, 4, 2, 0.5)], abs=1e-3)
    assert math.tau * STONE == pytest.approx(0.9144, rel=1e-15)


def test_parked_and_removed_stones_do_not_overlap_and_are_off_the_sheet() -> None:
    positions = [
        position_of(team, k)
        for position_of in (parked_position, removed_position)
        for team in (RED, YELLOW)
        for k in range(STONES)
    ]
    for n, position in enumerate(positions):
        assert abs(position[1]) - STONE > WIDTH / 2
        assert all(math.dist(position, other) > 2 * STONE for other in positions[:n])
    assert stone_name(YELLOW, 7) == "yellow-8"
    assert pytest.approx(HOG - TEES) == RELEASE + STONE  # the front of the stone is at the nearer hog line


@pytest.mark.parametrize(
    ("stones", "team", "points"),
    [
        ([], None, 0),
        ([(RED, (0.0, 0.0))], RED, 1),
        ([(RED, (0.0, 0.5)), (YELLOW, (0.3, 0.0))], YELLOW, 1),
        ([(RED, (0.0, 0.5)), (YELLOW, (0.3, 0.0)), (YELLOW, (0.0, -0.4))], YELLOW, 2),
        ([(RED, (0.0, 0.5)), (YELLOW, (0.3, 0.0)), (YELLOW, (0.0, -0.6))], YELLOW, 1),
        ([(RED, (0.0, 1.9)), (RED, (0.0, -1.9)), (RED, (1.0, 1.0))], RED, 3),  # the rim of a stone is enough
        ([(RED, (0.0, 2.0))], None, 0),
        ([(RED, (-3.0, 0.0)), (YELLOW, (0.0, 1.0))], YELLOW, 1),  # a guard does not score
        ([(RED, (0.5, 0.0)), (YELLOW, (0.0, 0.5))], None, 0),  # equal distances: a blank end
        ([(RED, (0.1 * k, 0.0)) for k in range(8)], RED, 8),
        ([(RED, (0.1 * k, 0.0)) for k in range(8)] + [(YELLOW, (0.0, 0.35))], RED, 4),
    ],
)
def test_score_of_an_end(stones: list[tuple[int, Point]], team: int | None, points: int) -> None:
    assert end_score(stones) == (team, points)
    assert end_score(stones[::-1]) == (team, points)
    swapped = [(1 - owner, position) for owner, position in stones]
    assert end_score(swapped) == (None if team is None else 1 - team, points)


def test_stones_out_of_play_and_hogged_stones() -> None:
    eps = 1e-9
    assert is_out_of_play((0.0, WIDTH / 2 - STONE))  # the side line is touched
    assert not is_out_of_play((0.0, -WIDTH / 2 + STONE + eps))
    assert is_out_of_play((BACK + STONE + eps, 0.0))  # wholly past the back line
    assert not is_out_of_play((BACK + STONE - eps, 0.0))
    assert is_hogged((-HOG + STONE - eps, 0.0))  # not wholly past the hog line
    assert not is_hogged((-HOG + STONE + eps, 0.0))


@pytest.mark.parametrize(
    ("position", "guard"),
    [
        ((-3.0, 0.0), True),
        ((-6.4, 0.0), False),  # not past the hog line
        ((-1.9, 0.0), False),  # it touches the house
        ((-2.0, 0.0), True),
        ((-0.16, 2.2), True),  # beside the house
        ((-0.1, 2.2), False),  # on the tee line
        ((1.0, 2.2), False),
    ],
)
def test_the_free_guard_zone_lies_before_the_tee_line_and_outside_the_house(position: Point, guard: bool) -> None:
    assert in_free_guard_zone(position) is guard
    assert not (in_free_guard_zone(position) and in_house(position))


def test_turns_alternate_and_the_hammer_passes_to_the_team_that_did_not_score() -> None:
    score = CurlingScore(ends=2)
    teams = []
    for _ in range(16):
        teams.append(score.team)
        score = score.after_stone()
    assert teams == [RED, YELLOW] * 8  # the hammer is yellow's
    assert score.full
    assert score.after_end(None, 0).hammer == YELLOW
    won = score.after_end(YELLOW, 2)
    assert (won.points, won.hammer, won.team, won.game_over) == ((0, 2), RED, YELLOW, None)
    assert won.after_end(RED, 2).game_over is None  # even: another end
    assert won.after_end(RED, 3).game_over == "red wins 3 : 2"
