"""Free play: turns, the cue ball in hand, the end."""

from dataclasses import replace

import pytest

from sandbox.games.billiards.rules.base import GameError
from sandbox.games.billiards.rules.pool import ALWAYS, FreePlay
from tests.games.billiards.shot_by_hand import played

RULES = FreePlay()
START = RULES.start()


def test_ball_goes_on_and_none_passes() -> None:
    assert played(RULES, START, "cue hits 3", "3 in left").state.turn == 0
    assert played(RULES, START, "cue hits 3").state.turn == 1
    assert not played(RULES, START).state.opening
    assert RULES.legal_targets(START) == set(START.table)


def test_cue_ball_that_fell_is_in_hand_and_passes() -> None:
    verdict = played(RULES, START, "cue hits 3", "3 in left", "cue in left")
    assert (verdict.state.turn, verdict.state.in_hand) == (1, "anywhere")
    assert verdict.points == (1, 0)
    assert not verdict.fouls


def test_cue_ball_may_be_taken_in_hand_and_balls_racked_at_any_time() -> None:
    state = played(RULES, START, "cue hits 3", "3 in left").state
    taken = RULES.decide(state, "in hand").state
    assert (taken.in_hand, taken.decisions) == ("anywhere", ALWAYS)
    anew = RULES.decide(taken, "rerack")
    assert anew.rerack
    assert anew.state == START


def test_clear_table_ends_for_who_made_most() -> None:
    state = replace(START, table=("3",), scores=(3, 3))
    over = played(RULES, state, "cue hits 3", "3 in left").state
    assert (over.over, over.winner) == (True, 0)
    assert played(RULES, replace(state, scores=(2, 3)), "cue hits 3", "3 in left").state.winner is None


def test_any_table_will_do() -> None:
    state = RULES.start(balls=("yellow", "red"), cue="white")
    assert RULES.cue_ball(state) == "white"
    verdict = played(RULES, state, "white hits red", "white at rail")
    assert RULES.decide(verdict.state, "rerack").state == replace(state, turn=1)
    with pytest.raises(GameError, match="'red'"):
        RULES.start(balls=("yellow", "red"), cue="red")


def test_table_without_other_balls_goes_on_for_ever() -> None:
    state = RULES.start(players=1, balls=())
    assert not played(RULES, state, "cue at rail").state.over
