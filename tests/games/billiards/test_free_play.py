"""Free play: turns, the cue ball in hand, the end."""

from dataclasses import replace

import pytest

from sandbox.games.billiards.rules.base import GameError
from sandbox.games.billiards.rules.pool import FREE_PLAY_DECISIONS, FreePlay
from tests.games.billiards.shot_by_hand import judge

RULES = FreePlay()
START = RULES.start()


def test_pot_continues_and_no_pot_passes_the_turn() -> None:
    assert judge(RULES, START, "cue hits 3", "3 in left").state.turn == 0
    assert judge(RULES, START, "cue hits 3").state.turn == 1
    assert not judge(RULES, START).state.opening
    assert RULES.legal_targets(START) == set(START.table)


def test_potted_cue_ball_is_in_hand_and_passes_the_turn() -> None:
    verdict = judge(RULES, START, "cue hits 3", "3 in left", "cue in left")
    assert (verdict.state.turn, verdict.state.in_hand) == (1, "anywhere")
    assert verdict.points == (1, 0)
    assert not verdict.fouls


def test_ball_in_hand_and_rerack_are_always_available() -> None:
    state = judge(RULES, START, "cue hits 3", "3 in left").state
    taken = RULES.decide(state, "in hand").state
    assert (taken.in_hand, taken.decisions) == ("anywhere", FREE_PLAY_DECISIONS)
    reracked = RULES.decide(taken, "rerack")
    assert reracked.rerack
    assert reracked.state == START


def test_cleared_table_ends_with_the_higher_score_winning() -> None:
    state = replace(START, table=("3",), scores=(3, 3))
    over = judge(RULES, state, "cue hits 3", "3 in left").state
    assert (over.over, over.winner) == (True, 0)
    assert judge(RULES, replace(state, scores=(2, 3)), "cue hits 3", "3 in left").state.winner is None


def test_any_set_of_balls_can_be_played() -> None:
    state = RULES.start(balls=("yellow", "red"), cue="white")
    assert RULES.cue_ball(state) == "white"
    verdict = judge(RULES, state, "white hits red", "white at rail")
    assert RULES.decide(verdict.state, "rerack").state == replace(state, turn=1)
    with pytest.raises(GameError, match="'red'"):
        RULES.start(balls=("yellow", "red"), cue="red")


def test_table_without_object_balls_never_ends() -> None:
    state = RULES.start(players=1, balls=())
    assert not judge(RULES, state, "cue at rail").state.over
