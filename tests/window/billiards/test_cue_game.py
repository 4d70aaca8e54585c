"""A billiards game in a session: strokes, turns, undo and the bot."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sandbox.action import ActionError, Strike
from sandbox.games.billiards.rules.base import Ruling
from sandbox.games.billiards.view.hud import status_line
from sandbox.measure.run.sessions import rerun
from tests.window.billiards.seated import FREE, NINE, RADIUS, advance, controls_at, roll_out

pytestmark = pytest.mark.fail_slow(60)  # a window or a film


def test_time_stops_until_the_first_stroke() -> None:
    table = controls_at(FREE)
    game = table.player
    for _ in range(30):
        advance(table)
    assert game.live.session.time == 0.0
    game.shoot()
    advance(table)
    assert game.live.session.time > 0.0


def test_shot_of_the_scene_presets_the_cue_without_a_stroke() -> None:
    table = controls_at(NINE)
    game = table.player
    assert (game.cue.aim, game.cue.speed, game.cue.side) == (1.5708, 4.0, 0.2)
    assert not game.live.frame.velocity.any()


def test_predicted_shot_equals_the_played_shot() -> None:
    table = controls_at(FREE)
    game = table.player
    game.cue.aim, game.cue.speed = math.pi / 2 - 0.02, 1.5
    aim = table.aim()
    assert aim is not None
    assert aim.prediction is not None
    found = aim.prediction
    assert found.hit == game.live.bodies.names.index("1")
    assert found.ghost is not None
    assert found.object_path is not None
    assert math.dist(found.ghost, game.position[found.hit]) == pytest.approx(2 * RADIUS, abs=1e-9)  # they touch
    game.shoot()
    roll_out(table)
    # The same engine computes both; only the clock of a session counts in steps.
    assert game.live.frame.position[aim.ball] == pytest.approx(found.cue_path[-1], abs=1e-9)
    assert game.live.frame.position[found.hit] == pytest.approx(found.object_path[-1], abs=1e-9)


def test_prediction_does_not_change_the_table() -> None:
    table = controls_at(FREE)
    game = table.player
    before = game.live.session.simulation.state_hash()
    for k in range(5):
        game.cue.aim = 0.3 * k
        table.aim()
    assert game.live.session.simulation.state_hash() == before


def test_undo_restores_the_table_while_the_balls_roll() -> None:
    table = controls_at(FREE)
    game = table.player
    before = game.live.session.simulation.state_hash()
    game.cue.aim = 1.4
    game.shoot(2.0)
    for _ in range(20):
        advance(table)
    assert game.live.session.time > 0.0
    game.undo()
    game.live.finish_seek()
    assert game.strokes == 0
    assert game.live.session.simulation.state_hash() == before
    assert (game.cue.aim, game.cue.speed) == (1.4, 2.0)
    assert game.host.waiting
    game.cue.aim += 0.3
    game.shoot(1.0)  # replaces the undone stroke
    roll_out(table)
    session = game.live.session.recording()
    (strike,) = session.actions
    assert isinstance(strike, Strike)
    assert strike.speed == 1.0
    assert rerun(session).info["state_hash"] == session.state_hash


def test_undo_without_a_stroke_is_an_error() -> None:
    with pytest.raises(ActionError, match="no shot"):
        controls_at(FREE).player.undo()


def test_stroke_while_balls_roll_is_refused() -> None:
    table = controls_at(FREE)
    game = table.player
    game.shoot()
    advance(table)
    with pytest.raises(ActionError, match="at rest"):
        game.shoot()


def test_seeking_back_restores_the_turn_and_replays_to_the_end() -> None:
    table = controls_at(NINE)
    game = table.player
    game.shoot()
    roll_out(table)
    after, end = game.match, game.live.session.time
    game.live.scrub(0.5 * end)
    game.live.commit_scrub()
    game.live.finish_seek()
    assert game.match.turn == 0
    assert game.match.state.opening
    assert not game.can_shoot
    assert not game.host.waiting  # recorded strokes are replayed
    while not game.host.waiting:
        game.live.step()
        advance(table, 0.0)
    assert game.live.session.time == end
    assert game.match == after


def test_match_uses_positions_of_balls_moved_by_the_user() -> None:
    from sandbox.action import Move

    table = controls_at(FREE)
    game = table.player
    game.live.apply(Move(time=0.0, body="2", position=(0.7, 0.7), velocity=(0.0, 0.0)))
    advance(table)
    index = game.live.bodies.names.index("2")
    assert game.match.position[index] == (0.7, 0.7)


def test_bot_plays_after_the_break() -> None:
    table = controls_at(NINE, "you vs bot")
    game = table.player
    game.shoot(0.5)  # too slow to pot a ball: the bot is next
    roll_out(table)
    assert not game.is_own_turn
    for _ in range(200_000):
        if game.is_own_turn:
            break
        if not game.host.waiting:
            game.live.step()
        advance(table, 0.02)
    assert game.is_own_turn
    assert game.strokes > 1
    session = game.live.session.recording()
    assert rerun(session).info["state_hash"] == session.state_hash
    game.undo()
    game.live.finish_seek()
    assert game.is_own_turn
    assert game.strokes == 0  # undone to the stroke of the human player
    table.close()


def test_thinking_bot_is_named_in_the_status_and_shows_no_aim() -> None:
    table = controls_at(NINE, "you vs bot")
    game = table.player
    state, messages = replace(game.match.state, turn=1), ("foul: scratch; player 2 has the ball in hand",)
    game.rules.match = replace(game.match, state=state, verdict=Ruling(state, messages=messages))
    assert game.is_bot_thinking
    assert table.aim() is None
    assert status_line(game) == "foul: scratch; bot has the ball in hand; bot is thinking"
    for _ in range(200_000):
        advance(table, 0.02)
        if not game.is_bot_thinking:
            break
    aim = table.aim()
    assert aim is not None
    assert aim.angle == game.cue.aim
    assert status_line(game).endswith("bot is aiming")
    table.close()


def test_ball_in_hand_is_limited_to_the_area_of_the_rules() -> None:
    table = controls_at(NINE)
    game = table.player
    assert game.match.state.in_hand == "behind the head string"
    head = game.match.layout.home[1]
    game.toggle_in_hand()
    game.carry((0.4, 0.3))
    assert game.carried == (0.4, 0.3)
    assert not game.refused
    game.carry((0.4, 1.9))
    assert game.refused
    assert game.carried is not None
    assert game.carried[1] <= head + 1e-9  # rounding of the head string
    game.carry((0.4, 0.3))
    game.put_down()
    assert game.position[game.ball] == (0.4, 0.3)
    assert game.carried is None
    advance(table)  # the rules see an action after the next step
    assert game.host.waiting
    assert game.match.position[game.ball] == (0.4, 0.3)


def test_ball_that_is_not_in_hand_cannot_be_picked_up() -> None:
    table = controls_at(NINE)
    game = table.player
    game.shoot(5.0)
    roll_out(table)
    assert game.match.state.in_hand is None
    with pytest.raises(ActionError, match="in hand"):
        game.toggle_in_hand()


def test_free_play_allows_ball_in_hand_at_any_time() -> None:
    table = controls_at(FREE)
    game = table.player
    game.shoot(1.0)
    roll_out(table)
    game.toggle_in_hand()
    game.carry((0.8, 0.4))
    game.put_down()
    assert game.position[game.ball] == (0.8, 0.4)
    assert not np.any(game.live.frame.velocity)
