"""9-ball: every foul, every ending, every change of turn."""

from dataclasses import replace

import pytest

from sandbox.games.billiards.rules.base import GameError
from sandbox.games.billiards.rules.pool import NineBall
from tests.games.billiards.shot_by_hand import fallen, played

RULES = NineBall()
START = RULES.start()
PLAY = replace(START, opening=False, in_hand=None)
SECOND = replace(PLAY, push_out=True)
DRY = ("cue hits 1", "1 at rail", "2 at rail", "3 at rail", "4 at rail")


def test_break_and_every_shot_have_the_lowest_on() -> None:
    assert RULES.legal_targets(START) == {"1"}
    assert RULES.legal_targets(replace(PLAY, table=("9", "4", "7"))) == {"4"}


def test_break_that_makes_a_ball_goes_on_and_may_push_out() -> None:
    verdict = played(RULES, START, "cue hits 1", "5 in left")
    assert verdict.continues
    assert verdict.points == (1, 0)
    assert not verdict.state.opening
    assert RULES.choices(verdict.state).push_out


def test_fair_break_without_a_ball_passes_and_the_other_may_push_out() -> None:
    verdict = played(RULES, START, *DRY)
    assert not verdict.fouls
    assert verdict.state.turn == 1
    assert RULES.choices(verdict.state).push_out


BREAK_FOULS = {
    "illegal break": DRY[:-1],
    "the 2 was hit first instead of the 1": ("cue hits 2", "5 in left"),
    "the cue ball hit no ball": ("cue at rail",),
    "scratch": (*DRY, "cue in left"),
}


@pytest.mark.parametrize("why", BREAK_FOULS)
def test_foul_on_the_break_is_in_hand_anywhere_without_push_out(why: str) -> None:
    verdict = played(RULES, START, *BREAK_FOULS[why])
    assert verdict.fouls == (why,)
    assert (verdict.state.turn, verdict.state.in_hand) == (1, "anywhere")
    assert not RULES.choices(verdict.state).push_out


def test_nine_on_the_break_wins() -> None:
    verdict = played(RULES, START, *DRY, "9 in left")
    assert (verdict.state.over, verdict.state.winner) == (True, 0)


def test_nine_by_way_of_the_lowest_wins() -> None:
    assert played(RULES, PLAY, "cue hits 1", "1 hits 9", "9 in left").state.winner == 0


def test_nine_on_a_foul_is_spotted() -> None:
    verdict = played(RULES, PLAY, "cue hits 9", "9 in left")
    assert verdict.fouls
    assert not verdict.state.over
    assert [(each.ball, each.spots[0]) for each in verdict.respot] == [("9", "foot")]
    assert "9" in verdict.state.table


def test_other_balls_stay_down_on_a_foul_and_count_for_nobody() -> None:
    verdict = played(RULES, PLAY, "cue hits 2", "2 in left")
    assert "2" not in verdict.state.table
    assert verdict.respot == ()
    assert verdict.state.scores == (0, 0)


FOULS = {
    "scratch": ("cue hits 1", "1 in left", "cue in left"),
    "the cue ball hit no ball": ("cue at rail",),
    "the 3 was hit first instead of the 1": ("cue hits 3", "cue hits 1", "1 in left"),
    "no rail after contact": ("cue hits 1",),
}


@pytest.mark.parametrize("why", FOULS)
def test_foul_gives_the_other_the_ball_anywhere(why: str) -> None:
    verdict = played(RULES, PLAY, *FOULS[why])
    assert verdict.fouls == (why,)
    assert (verdict.state.turn, verdict.state.in_hand) == (1, "anywhere")
    assert verdict.state.fouls == (1, 0)


def test_any_ball_made_fairly_goes_on_and_none_passes() -> None:
    assert played(RULES, PLAY, "cue hits 1", "6 in left").continues
    verdict = played(RULES, PLAY, "cue hits 1", "1 at rail")
    assert (verdict.state.turn, verdict.state.in_hand) == (1, None)


def test_push_out_needs_no_ball_and_no_rail_and_the_other_chooses() -> None:
    verdict = played(RULES, SECOND, push_out=True)
    assert not verdict.fouls
    assert (verdict.state.turn, verdict.state.decisions) == (1, ("play", "pass"))
    assert RULES.decide(verdict.state, "play").state.turn == 1
    assert RULES.decide(verdict.state, "pass").state.turn == 0
    assert not RULES.choices(verdict.state).push_out


def test_push_out_that_makes_balls_does_not_go_on_and_spots_the_nine() -> None:
    verdict = played(RULES, SECOND, "cue hits 5", "5 in left", "9 in left", push_out=True)
    assert not verdict.continues
    assert not verdict.state.over
    assert verdict.state.turn == 1
    assert verdict.state.scores == (0, 0)
    assert "5" not in verdict.state.table
    assert [each.ball for each in verdict.respot] == ["9"]


def test_push_out_into_a_pocket_is_foul() -> None:
    verdict = played(RULES, SECOND, "cue in left", push_out=True)
    assert verdict.fouls == ("scratch",)
    assert verdict.state.decisions == ()


def test_push_out_is_to_be_had_on_the_second_shot_alone() -> None:
    for state in (START, PLAY):
        with pytest.raises(GameError, match="push-out"):
            played(RULES, state, push_out=True)
    assert not RULES.choices(played(RULES, SECOND, "cue hits 1", "1 in left").state).push_out


def test_third_foul_in_a_row_loses_and_the_second_is_warned_of() -> None:
    state = PLAY
    for row in (1, 2):
        verdict = played(RULES, state)
        assert any("one more loses" in line for line in verdict.messages) == (row == 2)
        state = played(RULES, verdict.state, "cue hits 1", "1 at rail").state
    verdict = played(RULES, state)
    assert (verdict.state.over, verdict.state.winner) == (True, 1)


def test_fair_shot_clears_ones_own_fouls_alone() -> None:
    state = replace(PLAY, fouls=(2, 2))
    assert played(RULES, state, "cue hits 1", "1 at rail").state.fouls == (0, 2)


def test_third_foul_of_one_who_plays_alone_loses() -> None:
    state = replace(RULES.start(players=1), opening=False, fouls=(2,))
    verdict = played(RULES, state)
    assert (verdict.state.over, verdict.state.winner) == (True, None)
    assert played(RULES, replace(state, push_out=True), push_out=True).state.decisions == ()


def test_frame_in_order_is_won() -> None:
    state = played(RULES, START, "cue hits 1", *fallen("12345678")).state
    assert state.scores == (8, 0)
    assert played(RULES, state, "cue hits 9", "9 in left").state.winner == 0
