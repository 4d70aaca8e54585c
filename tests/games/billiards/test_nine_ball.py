"""9-ball: every foul, every ending, every change of turn."""

from dataclasses import replace

import pytest

from sandbox.games.billiards.rules.base import GameError
from sandbox.games.billiards.rules.pool import NineBall
from tests.games.billiards.shot_by_hand import judge, potted_lines

RULES = NineBall()
START = RULES.start()
PLAY = replace(START, opening=False, in_hand=None)
SECOND = replace(PLAY, push_out=True)
DRY = ("cue hits 1", "1 at rail", "2 at rail", "3 at rail", "4 at rail")


def test_lowest_ball_is_on_at_the_break_and_after() -> None:
    assert RULES.legal_targets(START) == {"1"}
    assert RULES.legal_targets(replace(PLAY, table=("9", "4", "7"))) == {"4"}


def test_break_that_pots_a_ball_continues_with_a_push_out_option() -> None:
    verdict = judge(RULES, START, "cue hits 1", "5 in left")
    assert verdict.continues
    assert verdict.points == (1, 0)
    assert not verdict.state.opening
    assert RULES.choices(verdict.state).push_out


def test_fair_break_without_a_pot_passes_with_a_push_out_option() -> None:
    verdict = judge(RULES, START, *DRY)
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
def test_foul_on_the_break_gives_ball_in_hand_anywhere_without_push_out(why: str) -> None:
    verdict = judge(RULES, START, *BREAK_FOULS[why])
    assert verdict.fouls == (why,)
    assert (verdict.state.turn, verdict.state.in_hand) == (1, "anywhere")
    assert not RULES.choices(verdict.state).push_out


def test_nine_on_the_break_wins() -> None:
    verdict = judge(RULES, START, *DRY, "9 in left")
    assert (verdict.state.over, verdict.state.winner) == (True, 0)


def test_nine_potted_by_a_combination_wins() -> None:
    assert judge(RULES, PLAY, "cue hits 1", "1 hits 9", "9 in left").state.winner == 0


def test_nine_on_a_foul_is_spotted() -> None:
    verdict = judge(RULES, PLAY, "cue hits 9", "9 in left")
    assert verdict.fouls
    assert not verdict.state.over
    assert [(each.ball, each.spots[0]) for each in verdict.respot] == [("9", "foot")]
    assert "9" in verdict.state.table


def test_other_balls_stay_down_on_a_foul_and_do_not_score() -> None:
    verdict = judge(RULES, PLAY, "cue hits 2", "2 in left")
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
def test_foul_gives_the_opponent_ball_in_hand_anywhere(why: str) -> None:
    verdict = judge(RULES, PLAY, *FOULS[why])
    assert verdict.fouls == (why,)
    assert (verdict.state.turn, verdict.state.in_hand) == (1, "anywhere")
    assert verdict.state.fouls == (1, 0)


def test_any_fair_pot_continues_and_no_pot_passes_the_turn() -> None:
    assert judge(RULES, PLAY, "cue hits 1", "6 in left").continues
    verdict = judge(RULES, PLAY, "cue hits 1", "1 at rail")
    assert (verdict.state.turn, verdict.state.in_hand) == (1, None)


def test_push_out_needs_no_hit_and_no_rail_and_the_opponent_chooses() -> None:
    verdict = judge(RULES, SECOND, push_out=True)
    assert not verdict.fouls
    assert (verdict.state.turn, verdict.state.decisions) == (1, ("play", "pass"))
    assert RULES.decide(verdict.state, "play").state.turn == 1
    assert RULES.decide(verdict.state, "pass").state.turn == 0
    assert not RULES.choices(verdict.state).push_out


def test_push_out_that_pots_balls_passes_the_turn_and_spots_the_nine() -> None:
    verdict = judge(RULES, SECOND, "cue hits 5", "5 in left", "9 in left", push_out=True)
    assert not verdict.continues
    assert not verdict.state.over
    assert verdict.state.turn == 1
    assert verdict.state.scores == (0, 0)
    assert "5" not in verdict.state.table
    assert [each.ball for each in verdict.respot] == ["9"]


def test_push_out_that_scratches_is_a_foul() -> None:
    verdict = judge(RULES, SECOND, "cue in left", push_out=True)
    assert verdict.fouls == ("scratch",)
    assert verdict.state.decisions == ()


def test_push_out_is_offered_on_the_second_shot_only() -> None:
    for state in (START, PLAY):
        with pytest.raises(GameError, match="push-out"):
            judge(RULES, state, push_out=True)
    assert not RULES.choices(judge(RULES, SECOND, "cue hits 1", "1 in left").state).push_out


def test_third_consecutive_foul_loses_after_a_warning_at_the_second() -> None:
    state = PLAY
    for row in (1, 2):
        verdict = judge(RULES, state)
        assert any("one more loses" in line for line in verdict.messages) == (row == 2)
        state = judge(RULES, verdict.state, "cue hits 1", "1 at rail").state
    verdict = judge(RULES, state)
    assert (verdict.state.over, verdict.state.winner) == (True, 1)


def test_fair_shot_resets_the_fouls_of_its_player_only() -> None:
    state = replace(PLAY, fouls=(2, 2))
    assert judge(RULES, state, "cue hits 1", "1 at rail").state.fouls == (0, 2)


def test_third_foul_of_a_single_player_loses() -> None:
    state = replace(RULES.start(players=1), opening=False, fouls=(2,))
    verdict = judge(RULES, state)
    assert (verdict.state.over, verdict.state.winner) == (True, None)
    assert judge(RULES, replace(state, push_out=True), push_out=True).state.decisions == ()


def test_frame_potted_in_order_is_won() -> None:
    state = judge(RULES, START, "cue hits 1", *potted_lines("12345678")).state
    assert state.scores == (8, 0)
    assert judge(RULES, state, "cue hits 9", "9 in left").state.winner == 0
