"""Snooker as balls lie: free balls, touching balls, snookers."""

from dataclasses import replace

from sandbox.games.billiards.rules.base import Situation
from sandbox.games.billiards.rules.snooker import COLOURS, REDS, Snooker
from tests.games.billiards.shot_by_hand import played

RULES = Snooker()
PLAY = replace(RULES.start(), opening=False, in_hand=None)
COLOUR = replace(PLAY, on="colour", table=(*REDS[1:], *COLOURS), scores=(1, 0))
ORDER = replace(PLAY, on="yellow", table=COLOURS)
SNOOKERED = Situation(snookered=True)


def test_offender_may_be_made_to_play_again_without_a_free_ball() -> None:
    state = RULES.settle(played(RULES, PLAY).state, SNOOKERED).state
    assert state.free
    again = RULES.decide(state, "pass").state
    assert (again.turn, again.free) == (0, False)
    assert not RULES.settle(again, SNOOKERED).state.free


def test_free_ball_is_had_after_a_foul_alone() -> None:
    fair = played(RULES, PLAY, "cue hits red-1").state
    assert not RULES.settle(fair, SNOOKERED).state.free
    foul = played(RULES, PLAY).state
    assert not RULES.settle(foul, Situation()).state.free
    free = RULES.settle(foul, SNOOKERED).state
    assert RULES.choices(free).balls == COLOURS
    assert RULES.legal_targets(free) == set(PLAY.table)


FREE = replace(PLAY, free=True)
FREE_YELLOW = replace(ORDER, free=True)


def test_free_ball_counts_as_a_red_and_comes_back() -> None:
    verdict = played(RULES, FREE, "cue hits blue", "blue in left", ball="blue")
    assert verdict.points == (1, 0)
    assert [each.ball for each in verdict.respot] == ["blue"]
    assert (verdict.state.on, verdict.state.free) == ("colour", False)


def test_free_ball_and_red_both_score() -> None:
    assert played(RULES, FREE, "cue hits blue", "blue in left", "red-1 in left", ball="blue").points == (2, 0)


def test_free_ball_in_the_order_counts_as_the_ball_on_which_stays_on() -> None:
    verdict = played(RULES, FREE_YELLOW, "cue hits black", "black in left", ball="black")
    assert verdict.points == (2, 0)
    assert (verdict.state.on, verdict.state.table) == ("yellow", COLOURS)


def test_free_ball_and_colour_on_score_once_and_the_colour_stays_down() -> None:
    verdict = played(RULES, FREE_YELLOW, "cue hits black", "black in left", "yellow in left", ball="black")
    assert verdict.points == (2, 0)
    assert verdict.state.on == "green"
    assert [each.ball for each in verdict.respot] == ["black"]


def test_free_ball_by_which_the_ball_on_falls_is_fair() -> None:
    assert played(RULES, FREE_YELLOW, "cue hits black", "yellow in left", ball="black").points == (2, 0)


def test_free_ball_must_be_touched_first_or_with_a_ball_on() -> None:
    missed = played(RULES, FREE, "cue hits red-1", ball="blue")
    assert missed.points == (0, 4)
    both = played(RULES, FREE, ("cue hits red-1", "cue hits blue"), ball="blue")
    assert not both.fouls


def test_free_ball_may_be_left_alone() -> None:
    assert played(RULES, FREE, "cue hits red-1", "red-1 in left").points == (1, 0)
    assert played(RULES, FREE, "cue hits blue").points == (0, 5)


def test_free_ball_that_snookers_is_foul_but_for_pink_and_black() -> None:
    state = played(RULES, FREE, "cue hits blue", ball="blue").state
    verdict = RULES.settle(state, Situation(snookered=True, by=("blue",)))
    assert verdict.points == verdict.state.scores == (0, 4)
    assert (verdict.state.fouled, verdict.state.free) == (True, True)
    assert verdict.state.decisions == ("play", "pass")
    assert not RULES.settle(state, Situation(snookered=True, by=("pink",))).fouls
    last = replace(PLAY, on="pink", table=("pink", "black"), free=True)
    state = played(RULES, last, "cue hits black", ball="black").state
    assert not RULES.settle(state, Situation(snookered=True, by=("black",))).fouls


def test_free_ball_that_snookers_on_a_dearer_colour_costs_that() -> None:
    state = replace(PLAY, on="blue", table=("blue", "pink", "black"), free=True)
    state = played(RULES, state, "cue hits pink", ball="pink").state
    assert RULES.settle(state, Situation(snookered=True, by=("pink",))).points == (0, 5)


def test_free_ball_of_one_who_plays_alone_gives_no_points_away() -> None:
    state = replace(RULES.start(players=1), opening=False, free=True)
    state = played(RULES, state, "cue hits blue", ball="blue").state
    verdict = RULES.settle(state, Situation(snookered=True, by=("blue",)))
    assert verdict.fouls
    assert verdict.state.scores == (0,)


def test_touching_ball_on_counts_as_played() -> None:
    red = RULES.settle(PLAY, Situation(touching=("red-1",))).state
    assert not played(RULES, red).fouls
    assert not played(RULES, red, "cue hits black").fouls
    pink = RULES.settle(COLOUR, Situation(touching=("pink",))).state
    assert not played(RULES, pink, ball="pink").fouls
    assert not played(RULES, pink).fouls
    assert not played(RULES, pink, "cue hits blue", "blue in left").fouls
    assert played(RULES, pink, ball="blue").fouls


def test_touching_ball_not_on_does_not() -> None:
    assert played(RULES, RULES.settle(PLAY, Situation(touching=("pink",))).state).fouls
