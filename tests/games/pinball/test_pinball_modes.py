"""Modes and multiball: readiness, start and end."""

import pytest

from sandbox.action import Move
from tests.games.pinball.pinball_by_hand import OPEN, SERVE, Table, is_launch, moves, table

pytestmark = pytest.mark.fail_slow(60)  # whole games


def ready(*omitted: str) -> Table:
    """Return a table with a set of standup targets just completed."""
    game = Table(table(*omitted))
    game.play()
    game.advance(("standup 1", 0.5), ("standup 2", 0.5))
    return game


def test_full_set_readies_a_mode_that_a_hole_starts() -> None:
    game = ready("lock")
    assert game.lines()["Mode"] == "ready"
    game.advance(("hole", 0.0))
    assert game.lines()["Bumper fever"] == "12 to go, 30 s"


def test_table_without_holes_starts_a_mode_at_once() -> None:
    assert "Bumper fever" in ready("hole", "lock").lines()


def test_mode_scores_each_hit_and_its_completion() -> None:
    game = ready("hole", "lock")
    before = game.game.score
    for _ in range(12):
        game.advance(("bumper a", 0.5))
    assert game.game.score == before + 12 * (500 + 1_000) + 50_000
    assert game.game.modes.mode is None
    assert "reward" in game.cues


def test_mode_ends_by_time_that_is_paused_while_no_ball_is_in_play() -> None:
    game = ready("hole", "lock")
    game.put(0, SERVE)
    game.wait(50.0)
    assert game.lines()["Bumper fever"] == "12 to go, 30 s"
    game.put(0, OPEN)
    while "Bumper fever" in game.lines():
        start = game.time
        game.advance(("lane 1", 0.0))  # a switch reports the ball
        assert start < 100.0
    assert 29.9 < game.time - 8.17 - 50.0 < 30.2  # after the 8.1 s of the ball save


def test_next_mode_differs_and_is_counted_for_the_player() -> None:
    game = ready("hole", "lock")
    game.game.modes.mode = None
    game.advance(("standup 1", 0.5), ("standup 2", 0.5))
    assert "Target hunt" in game.lines()
    assert game.game.sheet.modes == 2


def test_modes_without_their_elements_are_left_out() -> None:
    names = {mode.name for mode in Table(table("ramp in", "ramp out", "spinner")).game.modes.modes}
    assert names == {"bumper fever", "target hunt"}


def lock(game: Table) -> int:
    """Light the lock, and lock the ball in play; return the next ball."""
    (ball,) = game.game.trough.in_play
    game.put(ball, OPEN)
    game.wait(0.5)
    game.advance(("standup 1", 0.5, ball), ("standup 2", 0.5, ball))
    game.advance(("lock", 0.0, ball))
    game.wait(1.0)
    return game.game.trough.in_play[0]


def test_unlit_lock_acts_as_a_hole() -> None:
    game = Table(table())
    game.play()
    game.advance(("lock", 0.0))
    assert game.game.sheet.locked == 0
    assert moves(game.wait(1.0))[0][0] == "ball 0"


def test_locked_ball_is_stored_and_another_is_launched() -> None:
    game = Table(table())
    game.play()
    lock(game)
    assert game.game.sheet.locked == 1
    launch = [action for action in game.actions if isinstance(action, Move)][-1]
    assert launch.position == SERVE
    assert is_launch(launch, (0.0, 3.0))
    assert game.lines()["Ball"] == "1 of 3"
    assert game.lines()["Locked"] == "1"


def multiball() -> Table:
    game = Table(table())
    game.play()
    for _ in range(2):
        lock(game)
    (ball,) = game.game.trough.in_play
    game.put(ball, OPEN)
    game.wait(0.5)
    game.advance(("standup 1", 0.5, ball), ("standup 2", 0.5, ball))
    game.advance(("lock", 0.0, ball))
    for _ in range(4):
        game.wait(1.0)
        for each in game.game.trough.in_play:
            game.put(each, (0.1 * each + 0.1, 0.5))
    return game


def test_last_lock_starts_multiball_with_all_balls() -> None:
    game = multiball()
    assert sorted(game.game.trough.in_play) == [0, 1, 2]
    assert game.game.multiball.on
    assert "multiball" in game.cues


def test_ramp_scores_a_jackpot_in_multiball() -> None:
    game = multiball()
    ball, before = game.game.trough.in_play[0], game.game.score
    game.advance(("ramp in", 0.0, ball))
    game.advance(("ramp out", 0.0, ball))
    assert game.game.score == before + 10_000 + 50_000


def test_multiball_saves_balls_at_first_and_ends_with_one_ball_left() -> None:
    game = multiball()
    first = game.game.trough.in_play[0]
    game.advance(("drain", 0.0, first))
    assert "save" in game.cues
    game.wait(1.0)
    assert len(game.game.trough.in_play) == 3
    for _ in range(4):
        game.wait(3.0)
        for each in game.game.trough.in_play:
            game.put(each, (0.1 * each + 0.1, 0.5))
    for remaining in (2, 1):
        game.advance(("drain", 0.0, game.game.trough.in_play[0]))
        game.advance()
        assert len(game.game.trough.in_play) == remaining
        assert game.game.multiball.on is (remaining > 1)
    assert game.lines()["Ball"] == "1 of 3"
    game.advance(("drain", 0.0, game.game.trough.in_play[0]))
    game.wait(1.6)
    assert game.lines()["Ball"] == "2 of 3"


def test_table_with_one_ball_has_no_multiball() -> None:
    game = Table(table(balls=1))
    game.play()
    game.advance(("standup 1", 0.5), ("standup 2", 0.5))
    game.advance(("lock", 0.0))
    assert game.game.sheet.locked == 0


def test_locks_are_counted_per_player() -> None:
    game = Table(table(players=2))
    game.play()
    ball = lock(game)
    game.play(ball)
    game.advance(("drain", 0.0, ball))
    game.wait(2.0)
    assert (game.lines()["Player"], game.game.sheet.locked) == ("2 of 2", 0)
    (ball,) = game.game.trough.in_play
    game.play(ball)
    game.advance(("drain", 0.0, ball))
    game.wait(2.0)
    assert game.game.sheet.locked == 1
