"""8-ball: every foul, every ending, every change of turn."""

from dataclasses import replace

import pytest

from sandbox.games.billiards.rules.base import GameError
from sandbox.games.billiards.rules.pool import GROUPS, EightBall, EightBallState
from tests.games.billiards.shot_by_hand import judge, potted_lines

RULES = EightBall()
START = RULES.start()
OPEN = replace(START, opening=False, in_hand=None)
SOLIDS_STRIPES = replace(OPEN, groups=("solids", "stripes"))
ON_EIGHT = replace(SOLIDS_STRIPES, table=("8", *GROUPS["stripes"]), scores=(7, 0))
DRY = ("cue hits 1", "1 at rail", "2 at rail", "3 at rail", "4 at rail")
SINGLE_PLAYER = RULES.start(players=1)


def test_any_ball_is_on_at_the_break() -> None:
    assert RULES.legal_targets(START) == set(START.table)
    assert RULES.choices(START).balls == ()
    assert not RULES.choices(START).pocket


def test_break_that_pots_a_ball_continues_and_leaves_the_table_open() -> None:
    verdict = judge(RULES, START, "cue hits 1", "9 in left")
    assert verdict.continues
    assert verdict.state.turn == 0
    assert verdict.state.groups == (None, None)
    assert "9" not in verdict.state.table


def test_break_without_a_pot_passes_the_turn() -> None:
    verdict = judge(RULES, START, *DRY)
    assert not verdict.fouls
    assert verdict.state.turn == 1
    assert verdict.state.decisions == ()
    assert verdict.state.in_hand is None


def test_break_with_only_three_balls_to_the_rail_can_be_repeated() -> None:
    verdict = judge(RULES, START, *DRY[:-1])
    assert not verdict.fouls
    assert verdict.state.turn == 1
    assert verdict.state.decisions == ("play", "rerack", "rerack and pass")
    own_break, other_break = (RULES.decide(verdict.state, each) for each in ("rerack", "rerack and pass"))
    assert own_break.rerack
    assert own_break.state == replace(START, turn=1)
    assert other_break.state == START


def test_cue_ball_does_not_count_among_the_four_balls_to_the_rail() -> None:
    assert "rerack" in judge(RULES, START, *DRY[:-1], "cue at rail").state.decisions


def test_scratch_on_the_break_gives_ball_in_hand_behind_the_head_string() -> None:
    verdict = judge(RULES, START, *DRY, "9 in left", "cue in left")
    assert verdict.fouls == ("scratch",)
    assert not verdict.continues
    assert (verdict.state.turn, verdict.state.in_hand) == (1, "behind the head string")
    assert "9" not in verdict.state.table


def test_break_that_hits_no_ball_offers_ball_in_hand() -> None:
    verdict = judge(RULES, START, "cue at rail")
    assert verdict.fouls == ("the cue ball hit no ball",)
    assert verdict.state.decisions == ("play", "rerack", "rerack and pass", "in hand")
    assert RULES.decide(verdict.state, "in hand").state.in_hand == "behind the head string"
    assert RULES.decide(verdict.state, "play").state.in_hand is None


def test_eight_on_the_break_is_spotted_and_the_breaker_can_rerack() -> None:
    verdict = judge(RULES, START, *DRY, "8 in left")
    assert not verdict.state.over
    assert [each.ball for each in verdict.respot] == ["8"]
    assert "8" in verdict.state.table
    assert (verdict.state.turn, verdict.state.decisions) == (0, ("play", "rerack"))


def test_eight_and_scratch_on_the_break_give_the_opponent_the_choice() -> None:
    verdict = judge(RULES, START, *DRY, "8 in left", "cue in left")
    assert not verdict.state.over
    assert (verdict.state.turn, verdict.state.decisions) == (1, ("play", "rerack"))
    assert verdict.state.in_hand == "behind the head string"


def test_all_balls_except_the_eight_are_on_at_an_open_table() -> None:
    assert RULES.legal_targets(OPEN) == set(OPEN.table) - {"8"}
    verdict = judge(RULES, OPEN, "cue hits 8", "9 in left")
    assert verdict.fouls
    assert verdict.state.groups == (None, None)


@pytest.mark.parametrize(("ball", "groups"), [("2", ("solids", "stripes")), ("14", ("stripes", "solids"))])
def test_first_potted_ball_assigns_the_groups(ball: str, groups: tuple[str, str]) -> None:
    verdict = judge(RULES, OPEN, f"cue hits {ball}", f"{ball} in left")
    assert verdict.continues
    assert verdict.state.groups == groups
    assert verdict.state.scores == (1, 0)


def test_called_ball_assigns_the_groups() -> None:
    verdict = judge(RULES, OPEN, "cue hits 2", "2 in left", "14 in right", ball="14", pocket="right")
    assert verdict.state.groups == ("stripes", "solids")
    assert verdict.state.scores == (1, 1)


def test_ball_in_a_pocket_that_was_not_called_assigns_no_groups() -> None:
    verdict = judge(RULES, OPEN, "cue hits 2", "2 in left", ball="2", pocket="right")
    assert verdict.state.groups == (None, None)
    assert verdict.state.turn == 1


def test_foul_on_an_open_table_leaves_it_open() -> None:
    verdict = judge(RULES, OPEN, "cue hits 2", "2 in left", "cue in left")
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
def test_foul_gives_the_opponent_ball_in_hand_anywhere(why: str) -> None:
    verdict = judge(RULES, SOLIDS_STRIPES, *FOULS[why])
    assert verdict.fouls == (why,)
    assert not verdict.continues
    assert (verdict.state.turn, verdict.state.in_hand) == (1, "anywhere")


def test_two_simultaneous_first_hits_are_fair_if_one_ball_is_on() -> None:
    assert not judge(RULES, SOLIDS_STRIPES, ("cue hits 9", "cue hits 1"), "1 at rail").fouls


def test_potting_an_own_ball_continues_and_an_opponents_ball_passes_the_turn() -> None:
    assert judge(RULES, SOLIDS_STRIPES, "cue hits 1", "1 in left").continues
    verdict = judge(RULES, SOLIDS_STRIPES, "cue hits 1", "9 in left")
    assert (verdict.state.turn, verdict.state.scores) == (1, (0, 1))
    assert not verdict.fouls


def test_safety_ends_the_turn_even_with_a_pot() -> None:
    verdict = judge(RULES, SOLIDS_STRIPES, "cue hits 1", "1 in left", safety=True)
    assert verdict.state.turn == 1
    assert verdict.state.scores == (1, 0)


def test_turn_without_a_pot_passes() -> None:
    verdict = judge(RULES, SOLIDS_STRIPES, "cue hits 1", "1 at rail")
    assert (verdict.state.turn, verdict.state.in_hand) == (1, None)


def test_eight_is_on_after_the_group_and_its_pocket_must_be_called() -> None:
    assert RULES.legal_targets(ON_EIGHT) == {"8"}
    assert RULES.choices(ON_EIGHT).needed
    assert not RULES.choices(SOLIDS_STRIPES).needed


def test_eight_in_the_called_pocket_wins() -> None:
    verdict = judge(RULES, ON_EIGHT, "cue hits 8", "8 in left", pocket="left")
    assert (verdict.state.over, verdict.state.winner) == (True, 0)
    assert RULES.legal_targets(verdict.state) == set()
    assert RULES.choices(verdict.state).balls == ()
    with pytest.raises(GameError, match="over"):
        judge(RULES, verdict.state, "cue hits 9")


LOSSES = {
    "the 8 was pocketed in a pocket that was not called": (
        ON_EIGHT,
        ("cue hits 8", "8 in left"),
        {"pocket": "right"},
    ),
    "the 8 was pocketed on a foul: scratch": (
        ON_EIGHT,
        ("cue hits 8", "8 in left", "cue in right"),
        {"pocket": "left"},
    ),
    "the 8 was pocketed early": (SOLIDS_STRIPES, ("cue hits 1", "8 in left"), {"pocket": "left"}),
}


@pytest.mark.parametrize("why", LOSSES)
def test_eight_loses_when_potted_illegally(why: str) -> None:
    state, lines, call = LOSSES[why]
    verdict = judge(RULES, state, *lines, **call)
    assert verdict.messages[0] == why
    assert (verdict.state.over, verdict.state.winner) == (True, 1)


@pytest.mark.parametrize("call", [{}, {"pocket": "left", "safety": True}])
def test_eight_loses_without_a_called_pocket_or_on_a_safety(call: dict[str, object]) -> None:
    assert judge(RULES, ON_EIGHT, "cue hits 8", "8 in left", **call).state.winner == 1


def test_eight_potted_with_the_last_ball_of_the_group_loses() -> None:
    state = replace(SOLIDS_STRIPES, table=("1", "8", "9"))
    assert judge(RULES, state, "cue hits 1", "1 in left", "8 in right", pocket="right").state.winner == 1


def test_scratch_without_potting_the_eight_is_an_ordinary_foul() -> None:
    verdict = judge(RULES, ON_EIGHT, "cue hits 8", "cue in left", pocket="right")
    assert not verdict.state.over
    assert verdict.state.in_hand == "anywhere"


def test_single_player_keeps_the_turn_and_can_win_or_lose() -> None:
    missed = judge(RULES, SINGLE_PLAYER, *DRY[:-1])
    assert missed.state.turn == 0
    assert missed.state.decisions == ("play", "rerack")
    state = replace(SINGLE_PLAYER, opening=False, groups=("solids",), table=("8", "9"))
    assert judge(RULES, state, "cue hits 8", "8 in left", pocket="left").state.winner == 0
    lost = judge(RULES, state, "cue hits 8", "8 in left", pocket="right").state
    assert (lost.over, lost.winner) == (True, None)


def test_decision_that_is_not_offered_is_refused() -> None:
    with pytest.raises(GameError, match="'pass' is not offered"):
        RULES.decide(START, "pass")


def test_frame_of_own_balls_is_won() -> None:
    state: EightBallState = judge(RULES, START, "cue hits 1", *potted_lines(GROUPS["solids"])).state
    state = judge(RULES, state, "cue hits 9", *potted_lines(GROUPS["stripes"])).state
    assert state.groups == ("stripes", "solids")
    assert state.scores == (7, 7)
    assert judge(RULES, state, "cue hits 8", "8 in side", pocket="side").state.winner == 0
