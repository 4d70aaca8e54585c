"""Summary of a shot, from which the rules judge it."""

import pytest

from sandbox.games.billiards.rules.base import GameError, ShotCall, ShotChoices, summarise
from sandbox.games.billiards.rules.registry import RULESETS, ruleset_named
from tests.games.billiards.shot_by_hand import shot

TABLE = ("1", "2", "3")


def test_first_hit_is_the_earliest_in_any_order_of_events_and_of_the_pair() -> None:
    events = shot("cue at rail", "2 hits cue", "2 hits 1", "cue hits 3")
    assert summarise(events[::-1], "cue", TABLE).first == ("2",)


def test_two_simultaneous_first_hits_are_both_reported() -> None:
    assert summarise(shot(("cue hits 1", "cue hits 2"), "cue hits 3"), "cue", TABLE).first == ("1", "2")


def test_cushion_contacts_before_the_first_hit_drive_no_ball() -> None:
    assert summarise(shot("cue at rail", "cue hits 1"), "cue", TABLE).driven == frozenset()
    assert summarise(shot("cue hits 1", "cue at rail", "2 in corner"), "cue", TABLE).driven == {"cue", "2"}


def test_cushion_contact_at_the_time_of_the_first_hit_drives_a_ball() -> None:
    assert summarise(shot(("1 at rail", "cue hits 1")), "cue", TABLE).driven == {"1"}


def test_contacts_with_itself_and_with_cushions_are_no_first_hit() -> None:
    summary = summarise(shot("cue hits cue", "cue at 1", "2 hits 3"), "cue", TABLE)
    assert summary.first == ()


def test_potted_ball_is_listed_once_with_its_first_pocket() -> None:
    summary = summarise(shot("cue hits 1", "1 in left", "1 in right", "cue in left"), "cue", TABLE)
    assert summary.down == ("1",)
    assert summary.pocket_of("1") == "left"
    assert summary.pocket_of("2") is None
    assert summary.scratched


def test_event_of_a_ball_not_on_the_table_is_refused() -> None:
    with pytest.raises(GameError, match="not on the table: 9"):
        summarise(shot("cue hits 9"), "cue", TABLE)


def test_invalid_call_is_refused_with_every_fault() -> None:
    with pytest.raises(GameError) as caught:
        ShotChoices(balls=("1", "2")).check(ShotCall(ball="3", pocket="left", safety=True, push_out=True))
    for each in ("'3' cannot be called", "no pocket", "no safety", "no push-out"):
        assert each in str(caught.value)


def test_games_are_found_by_name() -> None:
    for name in RULESETS:
        assert ruleset_named(name).name == name
    with pytest.raises(GameError, match="unknown game 'chess'; games: 8-ball"):
        ruleset_named("chess")


@pytest.mark.parametrize("name", RULESETS)
def test_games_need_one_or_two_players(name: str) -> None:
    for players in (0, 3):
        with pytest.raises(GameError, match="1 or 2 can"):
            RULESETS[name].start(players)
