"""8-ball: every foul, every ending, every change of turn."""

from dataclasses import replace

import pytest

from sandbox.games.billiards.rules.base import GameError
from sandbox.games.billiards.rules.pool import GROUPS, EightBall, EightBallState
from tests.games.billiards.shot_by_hand import fallen, played

RULES = EightBall()
START = RULES.start()
OPEN = replace(START, opening=False, in_hand=None)
MINE = replace(OPEN, groups=("solids", "stripes"))
LAST = replace(MINE, table=("8", *GROUPS["stripes"]), scores=(7, 0))
DRY = ("cue hits 1", "1 at rail", "2 at rail", "3 at rail", "4 at rail")
ALONE = RULES.start(players=1)


def test_break_may_touch_any_ball() -> None:
    assert RULES.legal_targets(START) == set(START.table)
    assert RULES.choices(START).balls == ()
    assert not RULES.choices(START).pocket


def test_break_that_makes_a_ball_goes_on_and_leaves_the_table_open() -> None:
    verdict = played(RULES, START, "cue hits 1", "9 in left")
    assert verdict.continues
    assert verdict.state.turn == 0
    assert verdict.state.groups == (None, None)
    assert "9" not in verdict.state.table


def test_break_without_a_ball_passes_the_turn() -> None:
    verdict = played(RULES, START, *DRY)
    assert not verdict.fouls
    assert verdict.state.turn == 1
    assert verdict.state.decisions == ()
    assert verdict.state.in_hand is None


def test_break_with_three_to_the_rail_may_be_had_again() -> None:
    verdict = played(RULES, START, *DRY[:-1])
    assert not verdict.fouls
    assert verdict.state.turn == 1
    assert verdict.state.decisions == ("play", "rerack", "rerack and pass")
    mine, yours = (RULES.decide(verdict.state, each) for each in ("rerack", "rerack and pass"))
    assert mine.rerack
    assert mine.state == replace(START, turn=1)
    assert yours.state == START


def test_cue_ball_does_not_count_among_the_four() -> None:
    assert "rerack" in played(RULES, START, *DRY[:-1], "cue at rail").state.decisions


def test_scratch_on_the_break_is_in_hand_behind_the_head_string() -> None:
    verdict = played(RULES, START, *DRY, "9 in left", "cue in left")
    assert verdict.fouls == ("scratch",)
    assert not verdict.continues
    assert (verdict.state.turn, verdict.state.in_hand) == (1, "behind the head string")
    assert "9" not in verdict.state.table


def test_break_that_misses_all_may_be_taken_in_hand() -> None:
    verdict = played(RULES, START, "cue at rail")
    assert verdict.fouls == ("the cue ball hit no ball",)
    assert verdict.state.decisions == ("play", "rerack", "rerack and pass", "in hand")
    assert RULES.decide(verdict.state, "in hand").state.in_hand == "behind the head string"
    assert RULES.decide(verdict.state, "play").state.in_hand is None


def test_eight_on_the_break_is_spotted_or_racked_anew_by_the_breaker() -> None:
    verdict = played(RULES, START, *DRY, "8 in left")
    assert not verdict.state.over
    assert [each.ball for each in verdict.respot] == ["8"]
    assert "8" in verdict.state.table
    assert (verdict.state.turn, verdict.state.decisions) == (0, ("play", "rerack"))


def test_eight_and_scratch_on_the_break_leave_the_choice_to_the_other() -> None:
    verdict = played(RULES, START, *DRY, "8 in left", "cue in left")
    assert not verdict.state.over
    assert (verdict.state.turn, verdict.state.decisions) == (1, ("play", "rerack"))
    assert verdict.state.in_hand == "behind the head string"


def test_open_table_has_all_but_the_eight_on() -> None:
    assert RULES.legal_targets(OPEN) == set(OPEN.table) - {"8"}
    verdict = played(RULES, OPEN, "cue hits 8", "9 in left")
    assert verdict.fouls
    assert verdict.state.groups == (None, None)


@pytest.mark.parametrize(("ball", "groups"), [("2", ("solids", "stripes")), ("14", ("stripes", "solids"))])
def test_first_ball_made_chooses_the_groups(ball: str, groups: tuple[str, str]) -> None:
    verdict = played(RULES, OPEN, f"cue hits {ball}", f"{ball} in left")
    assert verdict.continues
    assert verdict.state.groups == groups
    assert verdict.state.scores == (1, 0)


def test_ball_that_was_called_chooses_the_groups() -> None:
    verdict = played(RULES, OPEN, "cue hits 2", "2 in left", "14 in right", ball="14", pocket="right")
    assert verdict.state.groups == ("stripes", "solids")
    assert verdict.state.scores == (1, 1)


def test_ball_in_another_pocket_than_called_chooses_nothing() -> None:
    verdict = played(RULES, OPEN, "cue hits 2", "2 in left", ball="2", pocket="right")
    assert verdict.state.groups == (None, None)
    assert verdict.state.turn == 1


def test_foul_on_an_open_table_leaves_it_open() -> None:
    verdict = played(RULES, OPEN, "cue hits 2", "2 in left", "cue in left")
    assert verdict.state.groups == (None, None)
    assert "2" not in verdict.state.table


FOULS = {
    "scratch": ("cue hits 1", "1 at rail", "cue in left"),
    "the cue ball hit no ball": ("cue at rail",),
    "the 9 was hit first instead of one of 1, 2, 3, 4, 5, 6, 7": ("cue hits 9", "cue hits 1", "1 in left"),
    "the 8 was hit first instead of one of 1, 2, 3, 4, 5, 6, 7": ("cue hits 8", "cue at rail"),
    "no rail after contact": ("cue at rail", "cue hits 1", "1 hits 2"),
}


@pytest.mark.parametrize("why", FOULS)
def test_foul_gives_the_other_the_ball_anywhere(why: str) -> None:
    verdict = played(RULES, MINE, *FOULS[why])
    assert verdict.fouls == (why,)
    assert not verdict.continues
    assert (verdict.state.turn, verdict.state.in_hand) == (1, "anywhere")


def test_two_at_one_time_are_fair_if_one_is_on() -> None:
    assert not played(RULES, MINE, ("cue hits 9", "cue hits 1"), "1 at rail").fouls


def test_own_ball_goes_on_the_others_does_not() -> None:
    assert played(RULES, MINE, "cue hits 1", "1 in left").continues
    verdict = played(RULES, MINE, "cue hits 1", "9 in left")
    assert (verdict.state.turn, verdict.state.scores) == (1, (0, 1))
    assert not verdict.fouls


def test_safety_ends_the_turn_whatever_falls() -> None:
    verdict = played(RULES, MINE, "cue hits 1", "1 in left", safety=True)
    assert verdict.state.turn == 1
    assert verdict.state.scores == (1, 0)


def test_turn_without_a_ball_passes() -> None:
    verdict = played(RULES, MINE, "cue hits 1", "1 at rail")
    assert (verdict.state.turn, verdict.state.in_hand) == (1, None)


def test_eight_is_on_once_the_group_is_down_and_its_pocket_must_be_called() -> None:
    assert RULES.legal_targets(LAST) == {"8"}
    assert RULES.choices(LAST).needed
    assert not RULES.choices(MINE).needed


def test_eight_in_the_pocket_that_was_called_wins() -> None:
    verdict = played(RULES, LAST, "cue hits 8", "8 in left", pocket="left")
    assert (verdict.state.over, verdict.state.winner) == (True, 0)
    assert RULES.legal_targets(verdict.state) == set()
    assert RULES.choices(verdict.state).balls == ()
    with pytest.raises(GameError, match="over"):
        played(RULES, verdict.state, "cue hits 9")


LOSSES = {
    "the 8 was pocketed in a pocket that was not called": (LAST, ("cue hits 8", "8 in left"), {"pocket": "right"}),
    "the 8 was pocketed on a foul: scratch": (
        LAST,
        ("cue hits 8", "8 in left", "cue in right"),
        {"pocket": "left"},
    ),
    "the 8 was pocketed early": (MINE, ("cue hits 1", "8 in left"), {"pocket": "left"}),
}


@pytest.mark.parametrize("why", LOSSES)
def test_eight_loses(why: str) -> None:
    state, lines, call = LOSSES[why]
    verdict = played(RULES, state, *lines, **call)
    assert verdict.messages[0] == why
    assert (verdict.state.over, verdict.state.winner) == (True, 1)


@pytest.mark.parametrize("call", [{}, {"pocket": "left", "safety": True}])
def test_eight_loses_where_no_pocket_or_a_safety_was_called(call: dict[str, object]) -> None:
    assert played(RULES, LAST, "cue hits 8", "8 in left", **call).state.winner == 1


def test_eight_with_the_last_of_the_group_loses() -> None:
    state = replace(MINE, table=("1", "8", "9"))
    assert played(RULES, state, "cue hits 1", "1 in left", "8 in right", pocket="right").state.winner == 1


def test_scratch_on_the_eight_that_does_not_fall_is_a_plain_foul() -> None:
    verdict = played(RULES, LAST, "cue hits 8", "cue in left", pocket="right")
    assert not verdict.state.over
    assert verdict.state.in_hand == "anywhere"


def test_one_who_plays_alone_keeps_the_turn_and_may_win_or_lose() -> None:
    missed = played(RULES, ALONE, *DRY[:-1])
    assert missed.state.turn == 0
    assert missed.state.decisions == ("play", "rerack")
    state = replace(ALONE, opening=False, groups=("solids",), table=("8", "9"))
    assert played(RULES, state, "cue hits 8", "8 in left", pocket="left").state.winner == 0
    lost = played(RULES, state, "cue hits 8", "8 in left", pocket="right").state
    assert (lost.over, lost.winner) == (True, None)


def test_what_is_not_offered_cannot_be_decided() -> None:
    with pytest.raises(GameError, match="'pass' is not offered"):
        RULES.decide(START, "pass")


def test_frame_of_own_balls_only_is_won() -> None:
    state: EightBallState = played(RULES, START, "cue hits 1", *fallen(GROUPS["solids"])).state
    state = played(RULES, state, "cue hits 9", *fallen(GROUPS["stripes"])).state
    assert state.groups == ("stripes", "solids")
    assert state.scores == (7, 7)
    assert played(RULES, state, "cue hits 8", "8 in side", pocket="side").state.winner == 0
