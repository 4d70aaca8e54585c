"""How balls come and go: plunger, save, drain, bonus, players in turn, lost balls, the end."""

import copy

import numpy as np
import pytest

from sandbox.action import Move
from sandbox.games.pinball.game_flow import BALL_SAVE_TIME, BONUS_TIME
from tests.games.pinball.pinball_by_hand import OPEN, SERVE, Table, drives, moves, table, thrown

WAIT = BONUS_TIME + 0.05
"""s, until the next ball is there"""


def drained(game: Table, ball: int = 0) -> None:
    """Drain a ball that nothing saves, and have the next served."""
    game.play(ball)
    game.look(("drain", 0.0, ball))
    game.wait(WAIT)


def next_ball(game: Table) -> int:
    """The ball in play."""
    (ball,) = game.game.trough.live
    return ball


def test_game_begins_with_a_ball_at_the_plunger() -> None:
    game = Table(table())
    assert moves(game.wait(0.02)) == [("ball 0", SERVE)]
    assert game.cues == ["serve"]
    assert (game.lines()["Ball"], game.game.game_over) == ("1 of 3", None)


def test_plunger_is_pulled_as_far_as_the_control() -> None:
    game = Table(table())
    assert drives(game.press("plunger", 0.7)) == [("plunger", 0.7)]
    assert drives(game.press("plunger", 0.0)) == [("plunger", 0.0)]


def test_table_without_plunger_launches_when_the_control_is_let_go() -> None:
    game = Table(table("plunger"))
    game.wait(0.02)
    assert not game.press("plunger")
    (launch,) = game.press("plunger", 0.0)
    assert thrown(launch, (0.0, 3.0))


@pytest.mark.parametrize(("after", "saved"), [(BALL_SAVE_TIME - 0.5, True), (BALL_SAVE_TIME + 0.5, False)])
def test_ball_that_drains_soon_after_the_launch_comes_back_by_itself(after: float, saved: bool) -> None:
    game = Table(table())
    game.wait(20.0)  # in the lane: the save does not run yet
    game.put(0, OPEN)
    game.wait(after)
    done = game.look(("drain", 0.0)) + game.wait(1.0)
    served = [action for action in done if isinstance(action, Move) and action.position == SERVE]
    assert ("save" in game.cues) is saved
    assert [thrown(each, (0.0, 3.0)) for each in served] == [False] + [True] * saved
    game.wait(WAIT)
    assert game.lines()["Ball"] == ("1 of 3" if saved else "2 of 3")


def test_save_begins_anew_with_a_shot_that_fell_back() -> None:
    game = Table(table())
    game.wait(0.02)
    game.put(0, OPEN)
    game.wait(0.5)
    game.put(0, SERVE)
    game.wait(20.0)
    game.put(0, OPEN)
    game.wait(BALL_SAVE_TIME - 0.5)
    game.look(("drain", 0.0))
    assert "save" in game.cues


def test_saved_ball_is_not_saved_for_longer() -> None:
    game = Table(table())
    game.wait(0.02)
    game.put(0, OPEN)
    game.wait(BALL_SAVE_TIME - 1.0)
    game.look(("drain", 0.0))
    game.wait(1.5)
    ball = next_ball(game)
    game.put(ball, OPEN)
    game.wait(0.1)
    game.look(("drain", 0.0, ball))
    assert game.cues.count("save") == 1


def test_bonus_counts_at_the_end_as_often_as_lanes_say() -> None:
    game = Table(table())
    game.play()
    game.look(("lane 1", 0.0), ("lane 2", 0.0), ("lane 3", 0.0), ("drop 1", 0.5))
    before, sheet = game.game.score, game.game.sheet
    assert (sheet.bonus, sheet.times) == (3 * 100 + 2_000 + 200, 2)
    game.look(("drain", 0.0))
    game.wait(BONUS_TIME - 0.1)
    assert game.game.score == before
    game.wait(0.15)
    assert game.game.score == before + 2 * 2_500
    assert (sheet.bonus, sheet.times) == (0, 1)


@pytest.mark.parametrize("balls", [1, 2, 3])
def test_no_two_balls_are_ever_put_onto_each_other(balls: int) -> None:
    game = Table(table(balls=balls))
    for _ in range(3):
        game.wait(1.0)
        for saved in (True, False):
            (ball,) = game.game.trough.live
            game.put(ball, OPEN)
            game.wait(0.5 if saved else 9.0)
            game.look(("drain", 0.0, ball))
            for _ in range(200):
                game.look()
                gaps = np.hypot(*(game.position[:, None] - game.position[None]).T) + np.eye(balls)
                assert gaps.min() > 2.0 * game.game.board.radius
            if game.game.game_over:
                return


def test_three_balls_are_a_game() -> None:
    game = Table(table())
    for _ in range(3):
        assert game.game.game_over is None
        drained(game, next_ball(game) if game.game.trough.live else 0)
    assert game.game.game_over == "game over"
    assert "over" in game.cues


def test_players_play_in_turn_with_scores_of_their_own() -> None:
    game = Table(table(players=3))
    seen = []
    for turn in range(9):
        game.wait(0.02)
        ball = next_ball(game)
        seen.append((game.lines()["Player"], game.lines()["Ball"]))
        game.play(ball)
        for _ in range(turn + 1):
            game.look(("outlane", 0.0, ball))
            game.look()
        game.look(("drain", 0.0, ball))
        game.wait(WAIT)
    assert seen[:4] == [("1 of 3", "1 of 3"), ("2 of 3", "1 of 3"), ("3 of 3", "1 of 3"), ("1 of 3", "2 of 3")]
    bonus = [100 * (1 + 4 + 7), 100 * (2 + 5 + 8), 100 * (3 + 6 + 9)]
    scores = [7_000 * (1 + 4 + 7), 7_000 * (2 + 5 + 8), 7_000 * (3 + 6 + 9)]
    assert [each.score for each in game.game.flow.sheets] == [a + b for a, b in zip(scores, bonus, strict=True)]
    assert game.game.game_over
    assert game.game.score == scores[2] + bonus[2]  # the best


def test_extra_ball_is_played_by_the_same_player_once_for_its_reason() -> None:
    game = Table(table(players=2))
    game.play()
    for _ in range(3 * 4):  # four sets of lanes: the bonus counts four times, and again five times
        game.look(("lane 1", 0.0), ("lane 2", 0.0), ("lane 3", 0.0))
        game.look()
    assert game.game.sheet.again == 1
    assert game.lines()["Ball"] == "1 of 3, shoot again"
    game.look(("drain", 0.0))
    game.wait(WAIT)
    assert (game.lines()["Player"], game.lines()["Ball"]) == ("1 of 2", "1 of 3")
    drained(game, next_ball(game))
    assert game.lines()["Player"] == "2 of 2"


def test_one_ball_is_enough_for_a_game() -> None:
    game = Table(table(balls=1))
    for _ in range(3):
        drained(game)
    assert game.game.game_over == "game over"


@pytest.mark.parametrize("where", [(0.2, -0.5), (9.0, 0.5), (float("nan"), 0.5), (0.2, float("inf"))])
def test_ball_that_left_the_table_is_returned_to_the_plunger_and_told(where: tuple[float, float]) -> None:
    game = Table(table())
    game.play()
    game.put(0, where)
    served = moves(game.look()) + moves(game.wait(1.0))
    assert served[-1][1] == SERVE
    assert game.lines()[""] == "ball returned"
    assert game.lines()["Ball"] == "1 of 3"
    assert len(game.game.trough.live) == 1


def test_ball_that_is_gone_for_good_ends_the_ball_and_the_last_one_the_game() -> None:
    game = Table(table(balls=2))
    for ball in (0, 1):
        game.play(ball)
        game.present[ball] = False
        game.look()
        game.wait(WAIT)
    assert game.game.game_over == "game over: no ball left on the table"


def test_nothing_moves_but_by_the_player_between_balls() -> None:
    game = Table(table())
    game.play()
    game.look(("drain", 0.0))
    for control in ("left flipper", "nudge"):
        assert all(level == 0.0 for _, level in drives(game.press(control)))
    assert drives(game.press("plunger")) == [("plunger", 0.0)]


def test_copy_goes_its_own_way_and_the_same_way() -> None:
    game = Table(table())
    game.play()
    game.look(("spinner", 0.0), ("drop 1", 0.5), ("hole", 0.0))
    other = copy.deepcopy(game)
    one, two = game.wait(3.0), other.wait(3.0)
    assert one == two
    assert game.game.score == other.game.score
    other.look(("bumper a", 0.5))
    assert other.game.score == game.game.score + 500


def test_control_that_there_is_not_is_refused() -> None:
    with pytest.raises(KeyError, match="dance"):
        Table(table()).press("dance")


def test_unknown_before_the_first_look_does_nothing() -> None:
    from sandbox.games.pinball.rules import PinballRules

    scene = table()
    assert PinballRules(scene, scene.bodies).on_input("left flipper", 1.0) == ()
