"""What rules read from a shot."""

import pytest

from sandbox.games.billiards.rules.base import GameError, ShotCall, ShotChoices, summarise
from sandbox.games.billiards.rules.registry import RULESETS, ruleset_named
from tests.games.billiards.shot_by_hand import shot

TABLE = ("1", "2", "3")


def test_first_touch_is_the_earliest_in_any_order_and_from_either_side() -> None:
    events = shot("cue at rail", "2 hits cue", "2 hits 1", "cue hits 3")
    assert summarise(events[::-1], "cue", TABLE).first == ("2",)


def test_first_touch_of_two_at_one_time_is_both() -> None:
    assert summarise(shot(("cue hits 1", "cue hits 2"), "cue hits 3"), "cue", TABLE).first == ("1", "2")


def test_cushions_before_the_touch_drive_no_ball() -> None:
    assert summarise(shot("cue at rail", "cue hits 1"), "cue", TABLE).driven == frozenset()
    assert summarise(shot("cue hits 1", "cue at rail", "2 in corner"), "cue", TABLE).driven == {"cue", "2"}


def test_cushion_at_the_time_of_the_touch_drives_a_ball() -> None:
    assert summarise(shot(("1 at rail", "cue hits 1")), "cue", TABLE).driven == {"1"}


def test_ball_touches_itself_never_and_cushions_are_no_balls() -> None:
    seen = summarise(shot("cue hits cue", "cue at 1", "2 hits 3"), "cue", TABLE)
    assert seen.first == ()


def test_ball_that_fell_is_told_once_with_its_pocket() -> None:
    seen = summarise(shot("cue hits 1", "1 in left", "1 in right", "cue in left"), "cue", TABLE)
    assert seen.down == ("1",)
    assert seen.pocket_of("1") == "left"
    assert seen.pocket_of("2") is None
    assert seen.scratched


def test_ball_that_is_not_there_is_refused() -> None:
    with pytest.raises(GameError, match="not on the table: 9"):
        summarise(shot("cue hits 9"), "cue", TABLE)


def test_call_that_cannot_be_made_is_refused_with_all_that_is_wrong() -> None:
    with pytest.raises(GameError) as told:
        ShotChoices(balls=("1", "2")).check(ShotCall(ball="3", pocket="left", safety=True, push_out=True))
    for each in ("'3' cannot be called", "no pocket", "no safety", "no push-out"):
        assert each in str(told.value)


def test_games_go_by_name() -> None:
    for name in RULESETS:
        assert ruleset_named(name).name == name
    with pytest.raises(GameError, match="unknown game 'chess'; games: 8-ball"):
        ruleset_named("chess")


@pytest.mark.parametrize("name", RULESETS)
def test_games_are_for_one_or_two(name: str) -> None:
    for players in (0, 3):
        with pytest.raises(GameError, match="1 or 2 can"):
            RULESETS[name].start(players)
