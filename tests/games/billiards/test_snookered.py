"""Snooker rules that depend on the situation of the balls: free balls, touching balls, snookers."""

from dataclasses import replace

from sandbox.games.billiards.rules.base import Situation
from sandbox.games.billiards.rules.snooker import COLOURS, REDS, Snooker
from tests.games.billiards.shot_by_hand import judge

RULES = Snooker()
PLAY = replace(RULES.start(), opening=False, in_hand=None)
COLOUR = replace(PLAY, on="colour", table=(*REDS[1:], *COLOURS), scores=(1, 0))
ORDER = replace(PLAY, on="yellow", table=COLOURS)
SNOOKERED = Situation(snookered=True)


def test_offender_who_plays_again_has_no_free_ball() -> None:
    state = RULES.settle(judge(RULES, PLAY).state, SNOOKERED).state
    assert state.free
    again = RULES.decide(state, "pass").state
    assert (again.turn, again.free) == (0, False)
    assert not RULES.settle(again, SNOOKERED).state.free


def test_free_ball_is_given_only_when_snookered_after_a_foul() -> None:
    fair = judge(RULES, PLAY, "cue hits red-1").state
    assert not RULES.settle(fair, SNOOKERED).state.free
    foul = judge(RULES, PLAY).state
    assert not RULES.settle(foul, Situation()).state.free
    free = RULES.settle(foul, SNOOKERED).state
    assert RULES.choices(free).balls == COLOURS
    assert RULES.legal_targets(free) == set(PLAY.table)


FREE = replace(PLAY, free=True)
FREE_YELLOW = replace(ORDER, free=True)


def test_free_ball_counts_as_a_red_and_is_respotted() -> None:
    verdict = judge(RULES, FREE, "cue hits blue", "blue in left", ball="blue")
    assert verdict.points == (1, 0)
    assert [each.ball for each in verdict.respot] == ["blue"]
    assert (verdict.state.on, verdict.state.free) == ("colour", False)


def test_free_ball_and_red_both_score() -> None:
    assert judge(RULES, FREE, "cue hits blue", "blue in left", "red-1 in left", ball="blue").points == (2, 0)


def test_free_ball_among_the_colours_scores_the_ball_on_which_stays_on() -> None:
    verdict = judge(RULES, FREE_YELLOW, "cue hits black", "black in left", ball="black")
    assert verdict.points == (2, 0)
    assert (verdict.state.on, verdict.state.table) == ("yellow", COLOURS)


def test_free_ball_and_colour_on_score_once_and_the_colour_stays_down() -> None:
    verdict = judge(RULES, FREE_YELLOW, "cue hits black", "black in left", "yellow in left", ball="black")
    assert verdict.points == (2, 0)
    assert verdict.state.on == "green"
    assert [each.ball for each in verdict.respot] == ["black"]


def test_potting_the_ball_on_by_the_free_ball_is_fair() -> None:
    assert judge(RULES, FREE_YELLOW, "cue hits black", "yellow in left", ball="black").points == (2, 0)


def test_free_ball_must_be_hit_first_or_together_with_a_ball_on() -> None:
    missed = judge(RULES, FREE, "cue hits red-1", ball="blue")
    assert missed.points == (0, 4)
    both = judge(RULES, FREE, ("cue hits red-1", "cue hits blue"), ball="blue")
    assert not both.fouls


def test_free_ball_is_optional() -> None:
    assert judge(RULES, FREE, "cue hits red-1", "red-1 in left").points == (1, 0)
    assert judge(RULES, FREE, "cue hits blue").points == (0, 5)


def test_snooker_behind_the_free_ball_is_a_foul_except_on_pink_and_black() -> None:
    state = judge(RULES, FREE, "cue hits blue", ball="blue").state
    verdict = RULES.settle(state, Situation(snookered=True, by=("blue",)))
    assert verdict.points == verdict.state.scores == (0, 4)
    assert (verdict.state.fouled, verdict.state.free) == (True, True)
    assert verdict.state.decisions == ("play", "pass")
    assert not RULES.settle(state, Situation(snookered=True, by=("pink",))).fouls
    last = replace(PLAY, on="pink", table=("pink", "black"), free=True)
    state = judge(RULES, last, "cue hits black", ball="black").state
    assert not RULES.settle(state, Situation(snookered=True, by=("black",))).fouls


def test_snooker_behind_the_free_ball_costs_the_value_of_the_ball_on() -> None:
    state = replace(PLAY, on="blue", table=("blue", "pink", "black"), free=True)
    state = judge(RULES, state, "cue hits pink", ball="pink").state
    assert RULES.settle(state, Situation(snookered=True, by=("pink",))).points == (0, 5)


def test_free_ball_foul_of_a_single_player_costs_no_points() -> None:
    state = replace(RULES.start(players=1), opening=False, free=True)
    state = judge(RULES, state, "cue hits blue", ball="blue").state
    verdict = RULES.settle(state, Situation(snookered=True, by=("blue",)))
    assert verdict.fouls
    assert verdict.state.scores == (0,)


def test_touching_ball_on_counts_as_hit() -> None:
    red = RULES.settle(PLAY, Situation(touching=("red-1",))).state
    assert not judge(RULES, red).fouls
    assert not judge(RULES, red, "cue hits black").fouls
    pink = RULES.settle(COLOUR, Situation(touching=("pink",))).state
    assert not judge(RULES, pink, ball="pink").fouls
    assert not judge(RULES, pink).fouls
    assert not judge(RULES, pink, "cue hits blue", "blue in left").fouls
    assert judge(RULES, pink, ball="blue").fouls


def test_touching_ball_that_is_not_on_does_not_count_as_hit() -> None:
    assert judge(RULES, RULES.settle(PLAY, Situation(touching=("pink",))).state).fouls
