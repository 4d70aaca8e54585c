"""8-ball: every foul, every ending, every change of turn."""

from dataclasses import replace

import pytest

from sandbox.games.billiards.rules.base import GameError
from sandbox.games.billiards.rules.pool import GROUPS, EightBall, EightBallState
from tests.games.billiards.shot_by_hand import Case, assert_case, assert_verdict, judge, potted_lines

RULES = EightBall()
START = RULES.start()
OPEN = replace(START, opening=False, in_hand=None)
OWN = replace(OPEN, groups=("solids", "stripes"))
ON_EIGHT = replace(OWN, table=("8", *GROUPS["stripes"]), scores=(7, 0))
DRY = ("cue hits 1", "1 at rail", "2 at rail", "3 at rail", "4 at rail")
SINGLE = RULES.start(players=1)
BEHIND, NONE = "behind the head string", (None, None)
RERACKS = ("play", "rerack", "rerack and pass")
FAIR, LOST = {"fouls": ()}, {"over": True, "winner": 1}

CASES = {
    "break that pots a ball continues and leaves the table open": Case(
        START, ("cue hits 1", "9 in left"), {"continues": True, "turn": 0, "groups": NONE, "down": "9"}
    ),
    "break without a pot passes the turn": Case(START, DRY, FAIR | {"turn": 1, "decisions": (), "in_hand": None}),
    "break with three balls to the rail can be repeated": Case(
        START, DRY[:-1], FAIR | {"turn": 1, "decisions": RERACKS}
    ),
    "cue ball does not count among the four": Case(START, (*DRY[:-1], "cue at rail"), {"decisions": RERACKS}),
    "scratch on the break": Case(
        START,
        (*DRY, "9 in left", "cue in left"),
        {"fouls": ("scratch",), "continues": False, "turn": 1, "in_hand": BEHIND, "down": "9"},
    ),
    "break that hits no ball": Case(
        START, "cue at rail", {"fouls": ("the cue ball hit no ball",), "decisions": (*RERACKS, "in hand")}
    ),
    "eight on the break is spotted": Case(
        START,
        (*DRY, "8 in left"),
        {"over": False, "respot": ("8",), "up": "8", "turn": 0, "decisions": ("play", "rerack")},
    ),
    "eight and scratch on the break": Case(
        START,
        (*DRY, "8 in left", "cue in left"),
        {"over": False, "turn": 1, "decisions": ("play", "rerack"), "in_hand": BEHIND},
    ),
    "first potted ball, a solid": Case(
        OPEN, ("cue hits 2", "2 in left"), {"continues": True, "groups": ("solids", "stripes"), "scores": (1, 0)}
    ),
    "first potted ball, a stripe": Case(
        OPEN, ("cue hits 14", "14 in left"), {"continues": True, "groups": ("stripes", "solids"), "scores": (1, 0)}
    ),
    "called ball assigns the groups": Case(
        OPEN,
        ("cue hits 2", "2 in left", "14 in right"),
        {"groups": ("stripes", "solids"), "scores": (1, 1)},
        {"ball": "14", "pocket": "right"},
    ),
    "pocket that was not called": Case(
        OPEN, ("cue hits 2", "2 in left"), {"groups": NONE, "turn": 1}, {"ball": "2", "pocket": "right"}
    ),
    "foul on an open table": Case(OPEN, ("cue hits 2", "2 in left", "cue in left"), {"groups": NONE, "down": "2"}),
    "two simultaneous first hits": Case(OWN, (("cue hits 9", "cue hits 1"), "1 at rail"), FAIR),
    "own ball": Case(OWN, ("cue hits 1", "1 in left"), {"continues": True}),
    "ball of the opponent": Case(OWN, ("cue hits 1", "9 in left"), FAIR | {"turn": 1, "scores": (0, 1)}),
    "safety": Case(OWN, ("cue hits 1", "1 in left"), {"turn": 1, "scores": (1, 0)}, {"safety": True}),
    "no pot": Case(OWN, ("cue hits 1", "1 at rail"), {"turn": 1, "in_hand": None}),
    "eight in a pocket that was not called": Case(ON_EIGHT, ("cue hits 8", "8 in left"), LOST, {"pocket": "right"}),
    "eight on a foul": Case(ON_EIGHT, ("cue hits 8", "8 in left", "cue in right"), LOST, {"pocket": "left"}),
    "eight early": Case(OWN, ("cue hits 1", "8 in left"), LOST, {"pocket": "left"}),
    "eight without a called pocket": Case(ON_EIGHT, ("cue hits 8", "8 in left"), LOST),
    "eight on a safety": Case(ON_EIGHT, ("cue hits 8", "8 in left"), LOST, {"pocket": "left", "safety": True}),
    "eight with the last ball of the group": Case(
        replace(OWN, table=("1", "8", "9")), ("cue hits 1", "1 in left", "8 in right"), LOST, {"pocket": "right"}
    ),
    "scratch on the eight": Case(
        ON_EIGHT, ("cue hits 8", "cue in left"), {"over": False, "in_hand": "anywhere"}, {"pocket": "right"}
    ),
    "single player breaks again": Case(SINGLE, DRY[:-1], {"turn": 0, "decisions": ("play", "rerack")}),
}
FOULS = {
    "scratch": ("cue hits 1", "1 at rail", "cue in left"),
    "the cue ball hit no ball": ("cue at rail",),
    "the 9 was hit first instead of one of 1, 2, 3, 4, 5, 6, 7": ("cue hits 9", "cue hits 1", "1 in left"),
    "the 8 was hit first instead of one of 1, 2, 3, 4, 5, 6, 7": ("cue hits 8", "cue at rail"),
    "no rail after contact": ("cue at rail", "cue hits 1", "1 hits 2"),
}


@pytest.mark.parametrize("name", CASES)
def test_verdict(name: str) -> None:
    assert_case(RULES, CASES[name])


@pytest.mark.parametrize("why", FOULS)
def test_foul_gives_the_opponent_ball_in_hand_anywhere(why: str) -> None:
    assert_verdict(judge(RULES, OWN, *FOULS[why]), fouls=(why,), continues=False, turn=1, in_hand="anywhere")


def test_balls_on_and_choices_of_each_state() -> None:
    assert RULES.legal_targets(START) == set(START.table)
    assert (RULES.choices(START).balls, RULES.choices(START).pocket) == ((), False)
    assert RULES.legal_targets(OPEN) == set(OPEN.table) - {"8"}
    assert RULES.legal_targets(ON_EIGHT) == {"8"}
    assert (RULES.choices(ON_EIGHT).needed, RULES.choices(OWN).needed) == (True, False)
    assert_verdict(judge(RULES, OPEN, "cue hits 8", "9 in left"), continues=False, turn=1, groups=NONE)


def test_decisions_after_the_break() -> None:
    state = judge(RULES, START, *DRY[:-1]).state
    assert_verdict(RULES.decide(state, "rerack"), rerack=True, state=replace(START, turn=1))
    assert RULES.decide(state, "rerack and pass").state == START
    missed = judge(RULES, START, "cue at rail").state
    assert RULES.decide(missed, "in hand").state.in_hand == BEHIND
    assert RULES.decide(missed, "play").state.in_hand is None
    with pytest.raises(GameError, match="'pass' is not offered"):
        RULES.decide(START, "pass")


def test_eight_in_the_called_pocket_wins_and_ends_the_frame() -> None:
    verdict = judge(RULES, ON_EIGHT, "cue hits 8", "8 in left", pocket="left")
    assert_verdict(verdict, over=True, winner=0)
    assert RULES.legal_targets(verdict.state) == set()
    assert RULES.choices(verdict.state).balls == ()
    with pytest.raises(GameError, match="over"):
        judge(RULES, verdict.state, "cue hits 9")


def test_single_player_can_win_or_lose() -> None:
    state = replace(SINGLE, opening=False, groups=("solids",), table=("8", "9"))
    for pocket, winner in (("left", 0), ("right", None)):
        assert_verdict(judge(RULES, state, "cue hits 8", "8 in left", pocket=pocket), over=True, winner=winner)


def test_frame_of_own_balls_is_won() -> None:
    state: EightBallState = judge(RULES, START, "cue hits 1", *potted_lines(GROUPS["solids"])).state
    verdict = judge(RULES, state, "cue hits 9", *potted_lines(GROUPS["stripes"]))
    assert_verdict(verdict, groups=("stripes", "solids"), scores=(7, 7))
    assert judge(RULES, verdict.state, "cue hits 8", "8 in side", pocket="side").state.winner == 0
