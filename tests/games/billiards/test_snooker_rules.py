"""Snooker: every foul, every ending, every change of turn; free balls, touching balls, snookers."""

from dataclasses import replace

import pytest

from sandbox.games.billiards.rules.base import GameError, Situation
from sandbox.games.billiards.rules.snooker import COLOUR_VALUES, COLOURS, REDS, Snooker, remaining
from tests.games.billiards.shot_by_hand import Case, assert_case, assert_verdict, judge, potted_lines

RULES = Snooker()
START = RULES.start()
PLAY = replace(START, opening=False, in_hand=None)
COLOUR = replace(PLAY, on="colour", table=(*REDS[1:], *COLOURS), scores=(1, 0))
LAST_COLOUR = replace(COLOUR, table=COLOURS)
ORDER = replace(PLAY, on="yellow", table=COLOURS)
BLACK = replace(PLAY, on="black", table=("black",))
MISS = replace(RULES.start(misses=True), opening=False, in_hand=None)
FREE, FREE_YELLOW = replace(PLAY, free=True), replace(ORDER, free=True)
SNOOKERED = Situation(snookered=True)
RED_POTTED = ("cue hits red-1", "red-1 in left")


def called(ball: str) -> dict[str, str]:
    return {"ball": ball}


CASES = {
    "red": Case(
        START,
        RED_POTTED,
        {"continues": True, "points": (1, 0), "on": "colour", "run": 1, "opening": False, "down": ("red-1",)},
    ),
    "two reds": Case(PLAY, (*RED_POTTED, "red-2 in right"), {"points": (2, 0)}),
    "first colour hit counts as nominated": Case(COLOUR, ("cue hits pink", "pink in left"), {"points": (6, 0)}),
    "colour after the last red": Case(
        LAST_COLOUR,
        ("cue hits black", "black in left"),
        {"respot": ("black",), "on": "yellow", "table": COLOURS},
        called("black"),
    ),
    "missed colour after the last red": Case(
        LAST_COLOUR, "cue hits black", {"turn": 1, "on": "yellow"}, called("black")
    ),
    "colours in order stay down": Case(ORDER, ("cue hits yellow", "yellow in left"), {"on": "green", "respot": ()}),
    "no pot and no cushion": Case(PLAY, "cue hits red-1", {"fouls": (), "turn": 1, "on": "red", "run": 0}),
    "missed colour": Case(COLOUR, "cue hits pink", {"turn": 1, "on": "red"}, called("pink")),
    "several fouls count once": Case(
        PLAY, ("cue hits yellow", "black in left", "cue in left"), {"points": (0, 7), "in_hand": "in the D"}
    ),
    "foul respots colours, highest first": Case(
        PLAY,
        (*RED_POTTED, "blue in left", "black in right"),
        {"scores": (0, 7), "respot": ("black", "blue"), "table": (*REDS[1:], *COLOURS)},
    ),
    "colour on potted on a foul": Case(
        ORDER, ("cue hits yellow", "yellow in left", "cue in left"), {"on": "yellow", "respot": ("yellow",)}
    ),
    "final black": Case(
        replace(BLACK, scores=(10, 12)),
        ("cue hits black", "black in left"),
        {"points": (7, 0), "over": True, "winner": 0},
    ),
    "foul on the final black": Case(
        replace(BLACK, scores=(20, 12)),
        ("cue hits black", "cue in left"),
        {"over": True, "winner": 0, "scores": (20, 19)},
    ),
    "missed black": Case(replace(BLACK, scores=(20, 18)), "cue hits black", {"over": False, "turn": 1, "on": "black"}),
    "free ball counts as a red": Case(
        FREE,
        ("cue hits blue", "blue in left"),
        {"points": (1, 0), "respot": ("blue",), "on": "colour", "free": False},
        called("blue"),
    ),
    "free ball and red": Case(
        FREE, ("cue hits blue", "blue in left", "red-1 in left"), {"points": (2, 0)}, called("blue")
    ),
    "free ball among the colours": Case(
        FREE_YELLOW,
        ("cue hits black", "black in left"),
        {"points": (2, 0), "on": "yellow", "table": COLOURS},
        called("black"),
    ),
    "free ball and colour on": Case(
        FREE_YELLOW,
        ("cue hits black", "black in left", "yellow in left"),
        {"points": (2, 0), "on": "green", "respot": ("black",)},
        called("black"),
    ),
    "ball on by the free ball": Case(
        FREE_YELLOW, ("cue hits black", "yellow in left"), {"points": (2, 0)}, called("black")
    ),
    "free ball is hit after a red": Case(FREE, "cue hits red-1", {"points": (0, 4)}, called("blue")),
    "free ball and red together": Case(FREE, (("cue hits red-1", "cue hits blue"),), {"fouls": ()}, called("blue")),
    "free ball is optional": Case(FREE, RED_POTTED, {"points": (1, 0)}),
    "free ball that is not called": Case(FREE, "cue hits blue", {"points": (0, 5)}),
}
FOULS = [
    (PLAY, {}, (*RED_POTTED[:1], "cue in left"), 4, "in-off"),
    (PLAY, {}, ("cue at rail",), 4, "the cue ball hit no ball"),
    (PLAY, {}, ("cue hits yellow",), 4, "the yellow was hit first"),
    (PLAY, {}, ("cue hits black",), 7, "the black was hit first"),
    (PLAY, {}, ("cue hits red-1", "pink in left"), 6, "the pink was potted but not on"),
    (PLAY, {}, (("cue hits red-1", "cue hits blue"),), 5, "the red-1 and the blue were hit first"),
    (COLOUR, called("pink"), ("cue at rail",), 6, "the cue ball hit no ball"),
    (COLOUR, called("pink"), ("cue hits red-2",), 6, "the red-2 was hit first"),
    (COLOUR, called("green"), ("cue hits green", "red-2 in left"), 4, "the red-2 was potted but not on"),
    (COLOUR, called("green"), ("cue hits black",), 7, "the black was hit first"),
    (COLOUR, called("green"), (("cue hits green", "cue hits pink"),), 6, "the green and the pink were hit first"),
    (COLOUR, {}, ("cue hits red-2",), 7, "the red-2 was hit first"),
    (COLOUR, {}, (), 7, "the cue ball hit no ball"),
    (ORDER, {}, ("cue hits green",), 4, "the green was hit first"),
    (ORDER, {}, ("cue hits yellow", "blue in left"), 5, "the blue was potted but not on"),
]


@pytest.mark.parametrize("name", CASES)
def test_verdict(name: str) -> None:
    assert_case(RULES, CASES[name])


@pytest.mark.parametrize(("state", "call", "lines", "penalty", "why"), FOULS)
def test_foul_scores_for_the_opponent(state, call, lines, penalty, why) -> None:
    verdict = judge(RULES, state, *lines, **call)
    scores = state.scores[0], penalty
    assert_verdict(verdict, fouls=(why,), points=(0, penalty), scores=scores, turn=1, decisions=("play", "pass"))
    assert verdict.state.on in ("red", "yellow")


def test_start_is_in_the_d_with_reds_on_and_147_points_remaining() -> None:
    assert (START.in_hand, START.misses) == ("in the D", False)
    assert RULES.legal_targets(START) == set(REDS)
    assert remaining(START) == 147
    assert not RULES.settle(START, SNOOKERED).state.free
    after_red = judge(RULES, START, *RED_POTTED).state
    assert RULES.legal_targets(after_red) == set(COLOURS)
    assert RULES.legal_targets(judge(RULES, ORDER, "cue hits yellow", "yellow in left").state) == {"green"}


@pytest.mark.parametrize("colour", COLOURS)
def test_potted_colour_scores_its_value_is_respotted_and_red_is_next(colour: str) -> None:
    verdict = judge(RULES, COLOUR, f"cue hits {colour}", f"{colour} in left", ball=colour)
    assert_verdict(
        verdict, points=(COLOUR_VALUES[colour], 0), on="red", continues=True, table=COLOUR.table, respot=(colour,)
    )
    others = ("black", "pink", "blue", "brown", "green", "yellow")
    assert verdict.respot[0].spots == (colour, *(each for each in others if each != colour))


def test_only_colours_can_be_nominated_and_only_after_a_red() -> None:
    for state, ball in ((COLOUR, "red-2"), (PLAY, "pink")):
        with pytest.raises(GameError, match=f"'{ball}' cannot be called now"):
            judge(RULES, state, ball=ball)


def test_miss_can_be_replayed_from_the_same_position_and_points_stay() -> None:
    state = replace(MISS, on="colour", table=COLOUR.table, scores=(8, 0), run=8)
    missed = judge(RULES, state, "cue hits red-2", "red-2 in left", ball="pink").state
    assert missed.decisions == ("play", "pass", "restore")
    assert_verdict(RULES.decide(missed, "restore"), restore=True, state=replace(state, scores=(8, 6)))
    assert "restore" not in judge(RULES, PLAY, "cue at rail").state.decisions  # without the rule
    assert "restore" not in judge(RULES, MISS, "cue hits red-1", "cue in left").state.decisions  # the ball on was hit


# 27 points remain and the foul costs 4: a player 24 behind needs fouls after it, a player 28 behind before it.
@pytest.mark.parametrize(("scores", "offered"), [((0, 23), True), ((0, 24), False), ((27, 0), True), ((28, 0), False)])
def test_no_miss_when_a_player_needs_points_from_fouls(scores: tuple[int, int], offered: bool) -> None:
    state = replace(MISS, on="yellow", table=COLOURS, scores=scores)
    assert ("restore" in judge(RULES, state).state.decisions) == offered


@pytest.mark.parametrize("lines", [("cue hits black", "black in left"), ("cue in left",)])
def test_level_scores_respot_the_black_and_the_next_score_or_foul_ends(lines: tuple[str, ...]) -> None:
    scores = (5, 12) if "black in left" in lines else (12, 5)
    verdict = judge(RULES, replace(BLACK, scores=scores), *lines)
    assert_verdict(verdict, over=False, respot=("black",), table=("black",), in_hand="in the D", fouled=False)
    assert verdict.state.decisions == ("play", "pass")
    first = RULES.decide(verdict.state, "pass").state
    assert first.turn == 0
    assert judge(RULES, first, "cue hits black", "black in left").state.winner == 0
    assert judge(RULES, first).state.winner == 1


def test_frame_can_be_claimed_with_a_lead_of_more_than_the_black() -> None:
    state = replace(PLAY, on="pink", table=("pink", "black"))
    close, claimable = (
        judge(RULES, replace(state, scores=(each, 10)), "cue hits pink", "pink in left").state for each in (11, 12)
    )
    assert (close.decisions, claimable.decisions) == ((), ("play", "claim"))
    over = RULES.decide(claimable, "claim").state
    assert (over.over, over.winner) == (True, 0)
    assert RULES.choices(replace(over, free=True)).balls == ()


def test_single_player_can_make_147_and_fouls_cost_nothing() -> None:
    state = RULES.start(players=1)
    assert_verdict(judge(RULES, state), scores=(0,), turn=0, decisions=())
    for red in REDS:
        state = judge(RULES, state, f"cue hits {red}", *potted_lines([red])).state
        state = judge(RULES, state, "cue hits black", *potted_lines(["black"]), ball="black").state
    for colour in COLOURS:
        state = judge(RULES, state, f"cue hits {colour}", *potted_lines([colour])).state
    assert (state.over, state.winner, state.scores) == (True, 0, (147,))


def test_free_ball_is_given_only_when_snookered_after_a_foul_of_the_other_player() -> None:
    fair, foul = judge(RULES, PLAY, "cue hits red-1").state, judge(RULES, PLAY).state
    assert not RULES.settle(fair, SNOOKERED).state.free
    assert not RULES.settle(foul, Situation()).state.free
    free = RULES.settle(foul, SNOOKERED).state
    assert free.free
    assert RULES.choices(free).balls == COLOURS
    assert RULES.legal_targets(free) == set(PLAY.table)
    again = RULES.decide(free, "pass").state  # the offender plays again
    assert (again.turn, again.free) == (0, False)
    assert not RULES.settle(again, SNOOKERED).state.free


def test_snooker_behind_the_free_ball_is_a_foul_except_on_pink_and_black() -> None:
    state = judge(RULES, FREE, "cue hits blue", ball="blue").state
    verdict = RULES.settle(state, Situation(snookered=True, by=("blue",)))
    assert_verdict(verdict, points=(0, 4), scores=(0, 4), fouled=True, free=True, decisions=("play", "pass"))
    assert not RULES.settle(state, Situation(snookered=True, by=("pink",))).fouls
    last = replace(PLAY, on="pink", table=("pink", "black"), free=True)
    state = judge(RULES, last, "cue hits black", ball="black").state
    assert not RULES.settle(state, Situation(snookered=True, by=("black",))).fouls
    state = replace(PLAY, on="blue", table=("blue", "pink", "black"), free=True)
    state = judge(RULES, state, "cue hits pink", ball="pink").state
    assert RULES.settle(state, Situation(snookered=True, by=("pink",))).points == (0, 5)  # of the ball on


def test_free_ball_foul_of_a_single_player_costs_no_points() -> None:
    state = replace(RULES.start(players=1), opening=False, free=True)
    state = judge(RULES, state, "cue hits blue", ball="blue").state
    verdict = RULES.settle(state, Situation(snookered=True, by=("blue",)))
    assert verdict.fouls
    assert verdict.state.scores == (0,)


def test_touching_ball_counts_as_hit_if_it_is_on() -> None:
    red = RULES.settle(PLAY, Situation(touching=("red-1",))).state
    assert not judge(RULES, red).fouls
    assert not judge(RULES, red, "cue hits black").fouls
    pink = RULES.settle(COLOUR, Situation(touching=("pink",))).state
    assert not judge(RULES, pink, ball="pink").fouls
    assert not judge(RULES, pink).fouls
    assert not judge(RULES, pink, "cue hits blue", "blue in left").fouls
    assert judge(RULES, pink, ball="blue").fouls
    assert judge(RULES, RULES.settle(PLAY, Situation(touching=("pink",))).state).fouls
