"""Three-cushion and straight rail: caroms, turns, the opening shot, the last turn, touching balls."""

from dataclasses import replace

import pytest

from sandbox.games.billiards.rules.base import GameError, Situation
from sandbox.games.billiards.rules.carom import Carom
from sandbox.games.billiards.rules.registry import RULESETS
from tests.games.billiards.shot_by_hand import judge

THREE, STRAIGHT = (RULESETS[name] for name in ("three-cushion", "straight-rail"))
assert isinstance(THREE, Carom)
START = THREE.start(distance=2)
PLAY = replace(START, opening=False)
RAIL = "white at rail"
MADE = ("white hits red", RAIL, RAIL, RAIL, "white hits yellow")


@pytest.mark.parametrize("before", range(4))
def test_three_cushions_before_the_second_ball_in_any_order_score(before: int) -> None:
    lines = (*[RAIL] * before, "white hits red", *[RAIL] * (3 - before), "white hits yellow")
    verdict = judge(THREE, PLAY, *lines)
    assert verdict.continues
    assert verdict.points == (1, 0)
    assert verdict.state.turn == 0


MISSES = {
    "two cushions": ("white hits red", RAIL, RAIL, "white hits yellow", RAIL),
    "one ball": ("white hits red", RAIL, RAIL, RAIL, "white hits red"),
    "no ball": (RAIL, RAIL, RAIL),
    "cushions of another ball": ("white hits red", RAIL, RAIL, "red at rail", "white hits yellow"),
    "balls that meet without the cue ball": ("white hits red", RAIL, RAIL, RAIL, "red hits yellow"),
}


@pytest.mark.parametrize("kind", MISSES)
def test_miss_passes_the_turn_without_a_foul(kind: str) -> None:
    verdict = judge(THREE, PLAY, *MISSES[kind])
    assert not verdict.fouls
    assert verdict.points == (0, 0)
    assert (verdict.state.turn, verdict.state.innings) == (1, (1, 0))


def test_each_player_has_an_own_cue_ball() -> None:
    other = judge(THREE, PLAY).state
    assert (THREE.cue_ball(PLAY), THREE.cue_ball(other)) == ("white", "yellow")
    assert THREE.legal_targets(other) == {"white", "red"}
    scored = judge(THREE, other, "yellow hits red", *["yellow at rail"] * 3, "yellow hits white")
    assert scored.points == (0, 1)


def test_straight_rail_needs_no_cushion() -> None:
    state = replace(STRAIGHT.start(), opening=False)
    assert judge(STRAIGHT, state, "white hits red", "white hits yellow").continues
    assert not judge(STRAIGHT, state, "white hits red", "red hits yellow").continues


def test_opening_shot_must_touch_the_red_first() -> None:
    assert THREE.legal_targets(START) == {"red"}
    verdict = judge(THREE, START, "white hits yellow", RAIL, RAIL, RAIL, "white hits red")
    assert verdict.fouls == ("the opening shot must hit the red first",)
    assert (verdict.state.turn, verdict.state.scores) == (1, (0, 0))
    scored = judge(THREE, START, *MADE)
    assert scored.continues
    assert not scored.state.opening


def test_run_counts_the_points_of_a_turn() -> None:
    state = replace(PLAY, distance=9)
    state = judge(THREE, judge(THREE, state, *MADE).state, *MADE).state
    assert state.run == 2
    assert judge(THREE, state).state.run == 0


def test_first_player_at_the_distance_gives_the_second_a_last_turn() -> None:
    verdict = judge(THREE, replace(PLAY, scores=(1, 1)), *MADE)
    state = verdict.state
    assert not state.over
    assert verdict.rerack
    assert (state.turn, state.last, state.opening, state.innings) == (1, True, True, (1, 0))
    lost = judge(THREE, state).state
    assert (lost.over, lost.winner) == (True, 0)
    level = judge(THREE, state, "yellow hits red", *["yellow at rail"] * 3, "yellow hits white").state
    assert (level.over, level.winner, level.scores) == (True, None, (2, 2))


def test_second_player_at_the_distance_wins_at_once() -> None:
    state = replace(PLAY, turn=1, scores=(1, 1), innings=(1, 0))
    final = judge(THREE, state, "yellow hits red", *["yellow at rail"] * 3, "yellow hits white").state
    assert (final.over, final.winner) == (True, 1)


def test_single_player_ends_at_the_distance() -> None:
    state = replace(THREE.start(players=1, distance=1), opening=False)
    missed = judge(THREE, state).state
    assert (missed.turn, missed.innings) == (0, (1,))
    final = judge(THREE, missed, *MADE).state
    assert (final.over, final.winner, final.innings) == (True, 0, (2,))


def test_touching_balls_can_be_spotted_each_on_its_own_spot() -> None:
    state = THREE.settle(PLAY, Situation(touching=("red",))).state
    assert THREE.choices(state).decisions == ("play", "spot")
    spotted = THREE.decide(state, "spot")
    assert [(each.ball, each.spots) for each in spotted.respot] == [
        ("white", ("head", "centre")),
        ("red", ("foot", "centre")),
    ]
    assert not spotted.rerack
    assert spotted.state == PLAY
    assert THREE.decide(state, "play").state == PLAY


def test_spots_of_three_touching_balls_follow_the_cue_ball_of_the_player() -> None:
    state = THREE.settle(replace(PLAY, turn=1), Situation(touching=("white", "red"))).state
    spots = {each.ball: each.spots for each in THREE.decide(state, "spot").respot}
    assert spots == {"white": ("centre",), "yellow": ("head",), "red": ("foot",)}


def test_touching_balls_of_straight_rail_restart_with_an_opening_shot() -> None:
    state = STRAIGHT.settle(replace(STRAIGHT.start(), opening=False), Situation(touching=("red",))).state
    verdict = STRAIGHT.decide(state, "spot")
    assert verdict.rerack
    assert verdict.state.opening


def test_pocket_events_and_zero_distance_are_refused() -> None:
    with pytest.raises(GameError, match="pockets"):
        judge(THREE, PLAY, "red in left")
    with pytest.raises(GameError, match="distance"):
        THREE.start(distance=0)
