"""Flow of balls: plunger, ball save, drain, bonus, turns of players, lost balls, the end."""

import copy

import numpy as np
import pytest

from sandbox.action import Move
from sandbox.games.pinball.game_flow import BALL_SAVE_TIME, BONUS_TIME
from tests.games.pinball.pinball_by_hand import OPEN, SERVE, Table, drives, is_launch, moves, table

pytestmark = pytest.mark.fail_slow(60)  # whole games

WAIT = BONUS_TIME + 0.05
"""s, until the next ball is served"""


def drain(game: Table, ball: int = 0) -> None:
    """Drain a ball after its save has ended, and wait until the next is served."""
    game.play(ball)
    game.advance(("drain", 0.0, ball))
    game.wait(WAIT)


def next_ball(game: Table) -> int:
    """Return the ball in play."""
    (ball,) = game.game.trough.in_play
    return ball


def test_game_begins_with_a_ball_at_the_plunger() -> None:
    game = Table(table())
    assert moves(game.wait(0.02)) == [("ball 0", SERVE)]
    assert game.cues == ["serve"]
    assert (game.lines()["Ball"], game.game.game_over) == ("1 of 3", None)


def test_plunger_follows_the_value_of_its_control() -> None:
    game = Table(table())
    assert drives(game.press("plunger", 0.7)) == [("plunger", 0.7)]
    assert drives(game.press("plunger", 0.0)) == [("plunger", 0.0)]


def test_table_without_plunger_launches_when_the_control_is_released() -> None:
    game = Table(table("plunger"))
    game.wait(0.02)
    assert not game.press("plunger")
    (launch,) = game.press("plunger", 0.0)
    assert is_launch(launch, (0.0, 3.0))


@pytest.mark.parametrize(("after", "saved"), [(BALL_SAVE_TIME - 0.5, True), (BALL_SAVE_TIME + 0.5, False)])
def test_ball_that_drains_soon_after_the_launch_is_relaunched(after: float, saved: bool) -> None:
    game = Table(table())
    game.wait(20.0)  # in the lane: the ball save has not started
    game.put(0, OPEN)
    game.wait(after)
    done = game.advance(("drain", 0.0)) + game.wait(1.0)
    served = [action for action in done if isinstance(action, Move) and action.position == SERVE]
    assert ("save" in game.cues) is saved
    assert [is_launch(each, (0.0, 3.0)) for each in served] == [False] + [True] * saved
    game.wait(WAIT)
    assert game.lines()["Ball"] == ("1 of 3" if saved else "2 of 3")


def test_ball_save_restarts_after_a_ball_fell_back_into_the_lane() -> None:
    game = Table(table())
    game.wait(0.02)
    game.put(0, OPEN)
    game.wait(0.5)
    game.put(0, SERVE)
    game.wait(20.0)
    game.put(0, OPEN)
    game.wait(BALL_SAVE_TIME - 0.5)
    game.advance(("drain", 0.0))
    assert "save" in game.cues


def test_relaunch_does_not_extend_the_ball_save() -> None:
    game = Table(table())
    game.wait(0.02)
    game.put(0, OPEN)
    game.wait(BALL_SAVE_TIME - 1.0)
    game.advance(("drain", 0.0))
    game.wait(1.5)
    ball = next_ball(game)
    game.put(ball, OPEN)
    game.wait(0.1)
    game.advance(("drain", 0.0, ball))
    assert game.cues.count("save") == 1


def test_bonus_is_multiplied_by_the_lanes_at_the_end_of_a_ball() -> None:
    game = Table(table())
    game.play()
    game.advance(("lane 1", 0.0), ("lane 2", 0.0), ("lane 3", 0.0), ("drop 1", 0.5))
    before, sheet = game.game.score, game.game.sheet
    assert (sheet.bonus, sheet.bonus_multiplier) == (3 * 100 + 2_000 + 200, 2)
    game.advance(("drain", 0.0))
    game.wait(BONUS_TIME - 0.1)
    assert game.game.score == before
    game.wait(0.15)
    assert game.game.score == before + 2 * 2_500
    assert (sheet.bonus, sheet.bonus_multiplier) == (0, 1)


@pytest.mark.parametrize("balls", [1, 2, 3])
def test_balls_are_never_placed_onto_each_other(balls: int) -> None:
    game = Table(table(balls=balls))
    for _ in range(3):
        game.wait(1.0)
        for saved in (True, False):
            (ball,) = game.game.trough.in_play
            game.put(ball, OPEN)
            game.wait(0.5 if saved else 9.0)
            game.advance(("drain", 0.0, ball))
            for _ in range(200):
                game.advance()
                gaps = np.hypot(*(game.position[:, None] - game.position[None]).T) + np.eye(balls)
                assert gaps.min() > 2.0 * game.game.board.radius
            if game.game.game_over:
                return


def test_game_ends_after_three_balls() -> None:
    game = Table(table())
    for _ in range(3):
        assert game.game.game_over is None
        drain(game, next_ball(game) if game.game.trough.in_play else 0)
    assert game.game.game_over == "game over"
    assert "over" in game.cues


def test_players_alternate_and_have_separate_scores() -> None:
    game = Table(table(players=3))
    panels = []
    for turn in range(9):
        game.wait(0.02)
        ball = next_ball(game)
        panels.append((game.lines()["Player"], game.lines()["Ball"]))
        game.play(ball)
        for _ in range(turn + 1):
            game.advance(("outlane", 0.0, ball))
            game.advance()
        game.advance(("drain", 0.0, ball))
        game.wait(WAIT)
    assert panels[:4] == [("1 of 3", "1 of 3"), ("2 of 3", "1 of 3"), ("3 of 3", "1 of 3"), ("1 of 3", "2 of 3")]
    bonus = [100 * (1 + 4 + 7), 100 * (2 + 5 + 8), 100 * (3 + 6 + 9)]
    scores = [7_000 * (1 + 4 + 7), 7_000 * (2 + 5 + 8), 7_000 * (3 + 6 + 9)]
    assert [each.score for each in game.game.flow.sheets] == [a + b for a, b in zip(scores, bonus, strict=True)]
    assert game.game.game_over
    assert game.game.score == scores[2] + bonus[2]  # the highest score


def test_extra_ball_is_played_once_by_the_same_player() -> None:
    game = Table(table(players=2))
    game.play()
    for _ in range(3 * 4):  # four sets of lanes, for an extra ball
        game.advance(("lane 1", 0.0), ("lane 2", 0.0), ("lane 3", 0.0))
        game.advance()
    assert game.game.sheet.extra_balls == 1
    assert game.lines()["Ball"] == "1 of 3, shoot again"
    game.advance(("drain", 0.0))
    game.wait(WAIT)
    assert (game.lines()["Player"], game.lines()["Ball"]) == ("1 of 2", "1 of 3")
    drain(game, next_ball(game))
    assert game.lines()["Player"] == "2 of 2"


def test_one_ball_is_enough_for_a_game() -> None:
    game = Table(table(balls=1))
    for _ in range(3):
        drain(game)
    assert game.game.game_over == "game over"


@pytest.mark.parametrize("position", [(0.2, -0.5), (9.0, 0.5), (float("nan"), 0.5), (0.2, float("inf"))])
def test_ball_that_left_the_table_is_returned_to_the_plunger_and_reported(position: tuple[float, float]) -> None:
    game = Table(table())
    game.play()
    game.put(0, position)
    served = moves(game.advance()) + moves(game.wait(1.0))
    assert served[-1][1] == SERVE
    assert game.lines()[""] == "ball returned"
    assert game.lines()["Ball"] == "1 of 3"
    assert len(game.game.trough.in_play) == 1


def test_removed_ball_ends_the_ball_and_the_last_one_the_game() -> None:
    game = Table(table(balls=2))
    for ball in (0, 1):
        game.play(ball)
        game.present[ball] = False
        game.advance()
        game.wait(WAIT)
    assert game.game.game_over == "game over: no ball left on the table"


def test_flippers_and_nudge_are_off_between_balls() -> None:
    game = Table(table())
    game.play()
    game.advance(("drain", 0.0))
    for control in ("left flipper", "nudge"):
        assert all(level == 0.0 for _, level in drives(game.press(control)))
    assert drives(game.press("plunger")) == [("plunger", 0.0)]


def test_copy_is_independent_and_deterministic() -> None:
    game = Table(table())
    game.play()
    game.advance(("spinner", 0.0), ("drop 1", 0.5), ("hole", 0.0))
    other = copy.deepcopy(game)
    one, two = game.wait(3.0), other.wait(3.0)
    assert one == two
    assert game.game.score == other.game.score
    other.advance(("bumper a", 0.5))
    assert other.game.score == game.game.score + 500


def test_unknown_control_is_refused() -> None:
    with pytest.raises(KeyError, match="dance"):
        Table(table()).press("dance")


def test_control_before_the_first_step_does_nothing() -> None:
    from sandbox.games.pinball.rules import PinballRules

    scene = table()
    assert PinballRules(scene, scene.bodies).on_input("left flipper", 1.0) == ()
