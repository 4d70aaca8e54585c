"""Snooker: every foul, every ending, every change of turn."""

from dataclasses import replace

import pytest

from sandbox.games.billiards.rules.base import GameError, Situation
from sandbox.games.billiards.rules.snooker import COLOURS, REDS, VALUES, Snooker, SnookerState, remaining
from tests.games.billiards.shot_by_hand import judge, potted_lines

RULES = Snooker()
START = RULES.start()
PLAY = replace(START, opening=False, in_hand=None)
COLOUR = replace(PLAY, on="colour", table=(*REDS[1:], *COLOURS), scores=(1, 0))
ORDER = replace(PLAY, on="yellow", table=COLOURS)
BLACK = replace(PLAY, on="black", table=("black",))
SNOOKERED = Situation(snookered=True)


def test_start_is_in_the_d_with_reds_on_and_147_points_remaining() -> None:
    assert START.in_hand == "in the D"
    assert RULES.legal_targets(START) == set(REDS)
    assert remaining(START) == 147
    assert not START.misses
    assert not RULES.settle(START, SNOOKERED).state.free


def test_potted_red_scores_one_stays_down_and_a_colour_is_next() -> None:
    verdict = judge(RULES, START, "cue hits red-1", "red-1 in left")
    assert verdict.continues
    assert verdict.points == (1, 0)
    assert (verdict.state.on, verdict.state.run, verdict.state.opening) == ("colour", 1, False)
    assert RULES.legal_targets(verdict.state) == set(COLOURS)
    assert "red-1" not in verdict.state.table


def test_each_red_of_a_stroke_scores() -> None:
    assert judge(RULES, PLAY, "cue hits red-1", "red-1 in left", "red-2 in right").points == (2, 0)


@pytest.mark.parametrize("colour", COLOURS)
def test_potted_colour_scores_its_value_is_respotted_and_red_is_next(colour: str) -> None:
    verdict = judge(RULES, COLOUR, f"cue hits {colour}", f"{colour} in left", ball=colour)
    assert verdict.points == (VALUES[colour], 0)
    assert (verdict.state.on, verdict.continues) == ("red", True)
    assert [each.spots[0] for each in verdict.respot] == [colour]
    assert verdict.state.table == COLOUR.table


def test_respot_lists_the_own_spot_then_the_highest_spots() -> None:
    (verdict,) = judge(RULES, COLOUR, "cue hits blue", "blue in left", ball="blue").respot
    assert verdict.spots == ("blue", "black", "pink", "brown", "green", "yellow")


def test_first_colour_hit_counts_as_nominated() -> None:
    assert judge(RULES, COLOUR, "cue hits pink", "pink in left").points == (6, 0)


def test_colour_after_the_last_red_is_respotted_and_yellow_is_on() -> None:
    state = replace(PLAY, table=("red-9", *COLOURS))
    state = judge(RULES, state, "cue hits red-9", "red-9 in left").state
    verdict = judge(RULES, state, "cue hits black", "black in left", ball="black")
    assert [each.ball for each in verdict.respot] == ["black"]
    assert (verdict.state.on, verdict.state.table) == ("yellow", COLOURS)


def test_missed_colour_after_the_last_red_has_yellow_on() -> None:
    state = replace(COLOUR, table=COLOURS)
    verdict = judge(RULES, state, "cue hits black", ball="black")
    assert (verdict.state.turn, verdict.state.on) == (1, "yellow")


def test_colours_in_order_stay_down() -> None:
    verdict = judge(RULES, ORDER, "cue hits yellow", "yellow in left")
    assert (verdict.state.on, verdict.respot) == ("green", ())
    assert RULES.legal_targets(verdict.state) == {"green"}


def test_stroke_without_a_pot_or_cushion_passes_the_turn_without_a_foul() -> None:
    verdict = judge(RULES, PLAY, "cue hits red-1")
    assert not verdict.fouls
    assert (verdict.state.turn, verdict.state.on, verdict.state.run) == (1, "red", 0)


def test_missed_colour_passes_with_red_on() -> None:
    verdict = judge(RULES, COLOUR, "cue hits pink", ball="pink")
    assert (verdict.state.turn, verdict.state.on) == (1, "red")


FOULS = [
    (PLAY, {}, ("cue hits red-1", "cue in left"), 4, "in-off"),
    (PLAY, {}, ("cue at rail",), 4, "the cue ball hit no ball"),
    (PLAY, {}, ("cue hits yellow",), 4, "the yellow was hit first"),
    (PLAY, {}, ("cue hits black",), 7, "the black was hit first"),
    (PLAY, {}, ("cue hits red-1", "pink in left"), 6, "the pink was potted but not on"),
    (PLAY, {}, (("cue hits red-1", "cue hits blue"),), 5, "the red-1 and the blue were hit first"),
    (COLOUR, {"ball": "pink"}, ("cue at rail",), 6, "the cue ball hit no ball"),
    (COLOUR, {"ball": "pink"}, ("cue hits red-2",), 6, "the red-2 was hit first"),
    (COLOUR, {"ball": "green"}, ("cue hits green", "red-2 in left"), 4, "the red-2 was potted but not on"),
    (COLOUR, {"ball": "green"}, ("cue hits black",), 7, "the black was hit first"),
    (COLOUR, {"ball": "green"}, (("cue hits green", "cue hits pink"),), 6, "the green and the pink were hit first"),
    (COLOUR, {}, ("cue hits red-2",), 7, "the red-2 was hit first"),
    (COLOUR, {}, (), 7, "the cue ball hit no ball"),
    (ORDER, {}, ("cue hits green",), 4, "the green was hit first"),
    (ORDER, {}, ("cue hits yellow", "blue in left"), 5, "the blue was potted but not on"),
]


@pytest.mark.parametrize(("state", "call", "lines", "penalty", "why"), FOULS)
def test_foul_scores_for_the_opponent(
    state: SnookerState, call: dict[str, str], lines: tuple[str, ...], penalty: int, why: str
) -> None:
    verdict = judge(RULES, state, *lines, **call)
    assert verdict.fouls == (why,)
    assert verdict.points == (0, penalty)
    assert verdict.state.scores == (state.scores[0], penalty)
    assert verdict.state.turn == 1
    assert verdict.state.on in ("red", "yellow")
    assert verdict.state.decisions == ("play", "pass")


def test_several_fouls_of_a_stroke_count_once_with_the_highest_penalty() -> None:
    verdict = judge(RULES, PLAY, "cue hits yellow", "black in left", "cue in left")
    assert len(verdict.fouls) == 3
    assert verdict.points == (0, 7)
    assert verdict.state.in_hand == "in the D"


def test_foul_scores_nothing_and_respots_only_colours_highest_first() -> None:
    verdict = judge(RULES, PLAY, "cue hits red-1", "red-1 in left", "blue in left", "black in right")
    assert verdict.state.scores == (0, 7)
    assert [each.ball for each in verdict.respot] == ["black", "blue"]
    assert verdict.state.table == (*REDS[1:], *COLOURS)


def test_colour_on_potted_on_a_foul_is_respotted() -> None:
    verdict = judge(RULES, ORDER, "cue hits yellow", "yellow in left", "cue in left")
    assert verdict.state.on == "yellow"
    assert [each.ball for each in verdict.respot] == ["yellow"]


def test_red_cannot_be_nominated() -> None:
    with pytest.raises(GameError, match="'red-2' cannot be called now"):
        judge(RULES, COLOUR, ball="red-2")
    with pytest.raises(GameError, match="'pink' cannot be called now"):
        judge(RULES, PLAY, ball="pink")


MISS = replace(RULES.start(misses=True), opening=False, in_hand=None)


def test_miss_can_be_replayed_from_the_same_position_and_points_stay() -> None:
    state = replace(MISS, on="colour", table=COLOUR.table, scores=(8, 0), run=8)
    verdict = judge(RULES, state, "cue hits red-2", "red-2 in left", ball="pink")
    assert verdict.state.decisions == ("play", "pass", "restore")
    back = RULES.decide(verdict.state, "restore")
    assert back.restore
    assert back.state == replace(state, scores=(8, 6))


def test_no_miss_without_the_rule_or_when_the_ball_on_was_hit() -> None:
    assert "restore" not in judge(RULES, PLAY, "cue at rail").state.decisions
    assert "restore" not in judge(RULES, MISS, "cue hits red-1", "cue in left").state.decisions


# 27 points remain and the foul costs 4: a player 24 behind needs fouls after it, a player 28 behind before it.
@pytest.mark.parametrize(("scores", "offered"), [((0, 23), True), ((0, 24), False), ((27, 0), True), ((28, 0), False)])
def test_no_miss_when_a_player_needs_points_from_fouls(scores: tuple[int, int], offered: bool) -> None:
    state = replace(MISS, on="yellow", table=COLOURS, scores=scores)
    assert ("restore" in judge(RULES, state).state.decisions) == offered


def test_final_black_potted_ends_the_frame() -> None:
    verdict = judge(RULES, replace(BLACK, scores=(10, 12)), "cue hits black", "black in left")
    assert verdict.points == (7, 0)
    assert (verdict.state.over, verdict.state.winner) == (True, 0)


def test_foul_on_the_final_black_ends_the_frame() -> None:
    verdict = judge(RULES, replace(BLACK, scores=(20, 12)), "cue hits black", "cue in left")
    assert (verdict.state.over, verdict.state.winner, verdict.state.scores) == (True, 0, (20, 19))


def test_missed_black_passes_the_turn() -> None:
    verdict = judge(RULES, replace(BLACK, scores=(20, 18)), "cue hits black")
    assert not verdict.state.over
    assert (verdict.state.turn, verdict.state.on) == (1, "black")


@pytest.mark.parametrize("lines", [("cue hits black", "black in left"), ("cue in left",)])
def test_level_scores_respot_the_black_and_the_next_score_or_foul_ends(lines: tuple[str, ...]) -> None:
    scores = (5, 12) if "black in left" in lines else (12, 5)
    verdict = judge(RULES, replace(BLACK, scores=scores), *lines)
    state = verdict.state
    assert not state.over
    assert [each.ball for each in verdict.respot] == ["black"]
    assert (state.table, state.in_hand, state.decisions) == (("black",), "in the D", ("play", "pass"))
    assert not state.fouled
    first = RULES.decide(state, "pass").state
    assert first.turn == 0
    assert judge(RULES, first, "cue hits black", "black in left").state.winner == 0
    assert judge(RULES, first).state.winner == 1


def test_frame_can_be_claimed_with_a_lead_of_more_than_the_black() -> None:
    state = replace(PLAY, on="pink", table=("pink", "black"))
    close, claimable = (
        judge(RULES, replace(state, scores=(each, 10)), "cue hits pink", "pink in left").state for each in (11, 12)
    )
    assert close.decisions == ()
    assert claimable.decisions == ("play", "claim")
    over = RULES.decide(claimable, "claim").state
    assert (over.over, over.winner) == (True, 0)
    assert RULES.choices(replace(over, free=True)).balls == ()


def test_single_player_can_make_147_and_fouls_cost_nothing() -> None:
    state = RULES.start(players=1)
    foul = judge(RULES, state)
    assert (foul.state.scores, foul.state.turn, foul.state.decisions) == ((0,), 0, ())
    for red in REDS:
        state = judge(RULES, state, f"cue hits {red}", *potted_lines([red])).state
        state = judge(RULES, state, "cue hits black", *potted_lines(["black"]), ball="black").state
    for colour in COLOURS:
        state = judge(RULES, state, f"cue hits {colour}", *potted_lines([colour])).state
    assert (state.over, state.winner, state.scores) == (True, 0, (147,))
