"""9-ball: every foul, every ending, every change of turn."""

from dataclasses import replace

import pytest

from sandbox.games.billiards.rules.base import GameError
from sandbox.games.billiards.rules.pool import NineBall
from tests.games.billiards.shot_by_hand import Case, assert_case, assert_verdict, judge, potted_lines

RULES = NineBall()
START = RULES.start()
PLAY = replace(START, opening=False, in_hand=None)
SECOND = replace(PLAY, push_out=True)
DRY = ("cue hits 1", "1 at rail", "2 at rail", "3 at rail", "4 at rail")
FAIR, IN_HAND, PUSH = {"fouls": ()}, {"turn": 1, "in_hand": "anywhere", "push_out": False}, {"push_out": True}

CASES = {
    "break that pots a ball": Case(
        START, ("cue hits 1", "5 in left"), {"continues": True, "points": (1, 0), "opening": False, "push_out": True}
    ),
    "fair break without a pot": Case(START, DRY, FAIR | {"turn": 1, "push_out": True}),
    "illegal break": Case(START, DRY[:-1], IN_HAND | {"fouls": ("illegal break",)}),
    "wrong ball on the break": Case(
        START, ("cue hits 2", "5 in left"), IN_HAND | {"fouls": ("the 2 was hit first instead of the 1",)}
    ),
    "no ball on the break": Case(START, "cue at rail", IN_HAND | {"fouls": ("the cue ball hit no ball",)}),
    "scratch on the break": Case(START, (*DRY, "cue in left"), IN_HAND | {"fouls": ("scratch",)}),
    "nine on the break": Case(START, (*DRY, "9 in left"), {"over": True, "winner": 0}),
    "nine by a combination": Case(PLAY, ("cue hits 1", "1 hits 9", "9 in left"), {"winner": 0}),
    "nine on a foul is spotted": Case(
        PLAY,
        ("cue hits 9", "9 in left"),
        {"fouls": ("the 9 was hit first instead of the 1",), "over": False, "respot": ("9",), "up": "9"},
    ),
    "other balls on a foul stay down": Case(
        PLAY, ("cue hits 2", "2 in left"), {"down": "2", "respot": (), "scores": (0, 0)}
    ),
    "any fair pot continues": Case(PLAY, ("cue hits 1", "6 in left"), {"continues": True}),
    "no pot": Case(PLAY, ("cue hits 1", "1 at rail"), {"turn": 1, "in_hand": None}),
    "push-out without a hit": Case(
        SECOND, (), FAIR | {"turn": 1, "decisions": ("play", "pass"), "push_out": False}, PUSH
    ),
    "push-out that pots balls": Case(
        SECOND,
        ("cue hits 5", "5 in left", "9 in left"),
        {"continues": False, "over": False, "turn": 1, "scores": (0, 0), "down": "5", "respot": ("9",)},
        PUSH,
    ),
    "push-out that scratches": Case(SECOND, "cue in left", {"fouls": ("scratch",), "decisions": ()}, PUSH),
    "push-out is offered once": Case(SECOND, ("cue hits 1", "1 in left"), {"push_out": False}),
}
FOULS = {
    "scratch": ("cue hits 1", "1 in left", "cue in left"),
    "the cue ball hit no ball": ("cue at rail",),
    "the 3 was hit first instead of the 1": ("cue hits 3", "cue hits 1", "1 in left"),
    "no rail after contact": ("cue hits 1",),
}


@pytest.mark.parametrize("name", CASES)
def test_verdict(name: str) -> None:
    assert_case(RULES, CASES[name])


@pytest.mark.parametrize("why", FOULS)
def test_foul_gives_the_opponent_ball_in_hand_anywhere(why: str) -> None:
    verdict = judge(RULES, PLAY, *FOULS[why])
    assert_verdict(verdict, fouls=(why,), turn=1, in_hand="anywhere")
    assert verdict.state.fouls == (1, 0)


def test_lowest_ball_is_on_at_the_break_and_after() -> None:
    assert RULES.legal_targets(START) == {"1"}
    assert RULES.legal_targets(replace(PLAY, table=("9", "4", "7"))) == {"4"}


def test_push_out_is_a_choice_of_the_second_shot_and_the_opponent_decides() -> None:
    assert RULES.choices(SECOND).push_out
    state = judge(RULES, SECOND, push_out=True).state
    assert [RULES.decide(state, each).state.turn for each in ("play", "pass")] == [1, 0]
    for other in (START, PLAY, state):
        assert not RULES.choices(other).push_out
        with pytest.raises(GameError, match="push-out"):
            judge(RULES, other, push_out=True)


def test_third_consecutive_foul_loses_after_a_warning_at_the_second() -> None:
    state = PLAY
    for row in (1, 2):
        verdict = judge(RULES, state)
        assert any("one more loses" in line for line in verdict.messages) == (row == 2)
        state = judge(RULES, verdict.state, "cue hits 1", "1 at rail").state
    assert_verdict(judge(RULES, state), over=True, winner=1)
    fair = judge(RULES, replace(PLAY, fouls=(2, 2)), "cue hits 1", "1 at rail").state
    assert fair.fouls == (0, 2)


def test_third_foul_of_a_single_player_loses() -> None:
    state = replace(RULES.start(players=1), opening=False, fouls=(2,))
    assert_verdict(judge(RULES, state), over=True, winner=None)
    assert judge(RULES, replace(state, push_out=True), push_out=True).state.decisions == ()


def test_frame_potted_in_order_is_won() -> None:
    state = judge(RULES, START, "cue hits 1", *potted_lines("12345678")).state
    assert state.scores == (8, 0)
    assert judge(RULES, state, "cue hits 9", "9 in left").state.winner == 0
