"""A game in a session: strokes, turns, and the way back."""

import math
from dataclasses import replace

import numpy as np
import pytest
from seated import FREE, NINE, RADIUS, game_of, roll_out, turn

from sandbox.action import ActionError, Strike
from sandbox.games.billiards.rules.base import ShotResult
from sandbox.games.billiards.view.controls import BilliardsOverlay, HumanPlayer
from sandbox.games.billiards.view.hud import status_line
from sandbox.measure.replay import rerun


def test_time_stands_still_until_somebody_strikes() -> None:
    game = game_of(FREE)
    for _ in range(30):
        turn(game)
    assert game.live.session.time == 0.0
    game.shoot()
    turn(game)
    assert game.live.session.time > 0.0


def test_shot_of_the_scene_is_laid_ready_and_not_played() -> None:
    game = game_of(NINE)
    assert (game.cue.aim, game.cue.speed, game.cue.side) == (1.5708, 4.0, 0.2)
    assert not game.live.frame.velocity.any()


def test_forecast_is_what_is_played() -> None:
    game = game_of(FREE)
    game.cue.aim, game.cue.speed = math.pi / 2 - 0.02, 1.5
    aim = BilliardsOverlay(HumanPlayer(game)).aim()
    assert aim is not None
    assert aim.forecast is not None
    found = aim.forecast
    assert found.hit == game.live.bodies.names.index("1")
    assert found.ghost is not None
    assert found.onward is not None
    assert math.dist(found.ghost, game.position[found.hit]) == pytest.approx(2 * RADIUS, abs=1e-9)  # they touch
    game.shoot()
    roll_out(game)
    # The same engine, the same numbers; only the clock of a session counts in steps.
    assert game.live.frame.position[aim.ball] == pytest.approx(found.way[-1], abs=1e-9)
    assert game.live.frame.position[found.hit] == pytest.approx(found.onward[-1], abs=1e-9)


def test_forecast_does_not_change_the_table() -> None:
    game = game_of(FREE)
    before = game.live.session.simulation.state_hash()
    for k in range(5):
        game.cue.aim = 0.3 * k
        BilliardsOverlay(HumanPlayer(game)).aim()
    assert game.live.session.simulation.state_hash() == before


def test_miss_is_a_foul_and_gives_the_ball_in_hand() -> None:
    game = game_of(NINE)
    game.shoot()
    roll_out(game)
    game.cue.aim, game.cue.speed = -math.pi / 2, 0.3  # away from all
    shooter = game.match.turn
    if game.match.state.in_hand is None:
        game.shoot()
        roll_out(game)
        assert game.match.verdict is not None
        assert game.match.verdict.fouls
    assert game.match.turn != shooter or game.match.state.in_hand is not None


def test_undo_takes_a_stroke_back_while_the_balls_roll() -> None:
    game = game_of(FREE)
    before = game.live.session.simulation.state_hash()
    game.cue.aim = 1.4
    game.shoot(2.0)
    for _ in range(20):
        turn(game)
    assert game.live.session.time > 0.0
    game.undo()
    game.live.finish_seek()
    assert game.strokes == 0
    assert game.live.session.simulation.state_hash() == before
    assert (game.cue.aim, game.cue.speed) == (1.4, 2.0)
    assert game.waits


def test_stroke_after_undo_goes_its_own_way_and_replays() -> None:
    game = game_of(FREE)
    game.shoot(2.0)
    roll_out(game)
    game.undo()
    game.live.finish_seek()
    game.cue.aim += 0.3
    game.shoot(1.0)
    roll_out(game)
    session = game.live.session.recording()
    (strike,) = session.actions
    assert isinstance(strike, Strike)
    assert strike.speed == 1.0
    assert rerun(session).info["state_hash"] == session.state_hash


def test_undo_without_a_stroke_says_so() -> None:
    with pytest.raises(ActionError, match="no shot"):
        game_of(FREE).undo()


def test_stroke_while_balls_roll_is_refused() -> None:
    game = game_of(FREE)
    game.shoot()
    turn(game)
    with pytest.raises(ActionError, match="at rest"):
        game.shoot()


def test_going_back_finds_the_turn_of_then_and_time_goes_on() -> None:
    game = game_of(NINE)
    game.shoot()
    roll_out(game)
    after, end = game.match, game.live.session.time
    game.live.scrub(0.5 * end)
    game.live.commit_scrub()
    game.live.finish_seek()
    assert game.match.turn == 0
    assert game.match.state.opening
    assert not game.aiming
    assert not game.waits  # what was done is seen again
    while not game.waits:
        game.live.step()
        turn(game, 0.0)
    assert game.live.session.time == end
    assert game.match is after


def test_strokes_of_a_hand_that_moves_balls_begin_where_they_lie() -> None:
    from sandbox.action import Move

    game = game_of(FREE)
    game.live.apply(Move(time=0.0, body="2", position=(0.7, 0.7), velocity=(0.0, 0.0)))
    turn(game)
    number = game.live.bodies.names.index("2")
    assert game.match.position[number] == (0.7, 0.7)


def test_bot_answers_the_break() -> None:
    game = game_of(NINE, "you vs bot")
    game.shoot(6.0)
    roll_out(game)
    for _ in range(200_000):
        if game.mine:
            break
        if not game.waits:
            game.live.step()
        turn(game, 0.02)
    assert game.mine
    if game.strokes > 1:
        session = game.live.session.recording()
        assert rerun(session).info["state_hash"] == session.state_hash
        game.undo()
        game.live.finish_seek()
        assert game.mine  # back at the person's stroke
    game.close()


def test_bot_has_one_name_and_no_aim_while_it_thinks() -> None:
    game = game_of(NINE, "you vs bot")
    person = HumanPlayer(game)
    state, said = replace(game.match.state, turn=1), ("foul: scratch; player 2 has the ball in hand",)
    game.go_another_way(replace(game.match, state=state, verdict=ShotResult(state, messages=said)))
    assert game.bot_is_thinking
    assert BilliardsOverlay(person).aim() is None
    assert status_line(person) == "foul: scratch; bot has the ball in hand; bot is thinking"
    for _ in range(200_000):
        turn(game, 0.02)
        if not game.bot_is_thinking:
            break
    aim = BilliardsOverlay(person).aim()
    assert aim is not None
    assert aim.angle == game.cue.aim
    assert status_line(person).endswith("bot is aiming")
    game.close()


def test_ball_in_hand_goes_only_where_the_rules_say() -> None:
    game = game_of(NINE)
    person = HumanPlayer(game)
    assert game.match.state.in_hand == "behind the head string"
    head = game.match.layout.home[1]
    person.take_in_hand()
    person.carry((0.4, 0.3))
    assert person.carried == (0.4, 0.3)
    assert not person.refused
    person.carry((0.4, 1.9))
    assert person.refused
    assert person.carried is not None
    assert person.carried[1] <= head + 1e-9  # the rounding of the line
    person.carry((0.4, 0.3))
    person.put_down()
    assert game.position[game.ball] == (0.4, 0.3)
    assert person.carried is None
    assert game.match.position[game.ball] == (0.4, 0.3)


def test_ball_that_is_not_in_hand_stays() -> None:
    game = game_of(NINE)
    game.shoot(5.0)
    roll_out(game)
    if game.match.state.in_hand is None:
        with pytest.raises(ActionError, match="in hand"):
            HumanPlayer(game).take_in_hand()


def test_free_play_gives_the_ball_in_hand_at_any_time() -> None:
    game = game_of(FREE)
    game.shoot(1.0)
    roll_out(game)
    person = HumanPlayer(game)
    person.take_in_hand()
    person.carry((0.8, 0.4))
    person.put_down()
    assert game.position[game.ball] == (0.8, 0.4)
    assert not np.any(game.live.frame.velocity)
