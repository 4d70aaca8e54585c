"""What the mouse does at a table."""

import math

import pytest

from sandbox.games.billiards.game import MAX_CUE_SPEED, MAX_TIP_OFFSET
from sandbox.games.billiards.view.controls import DIAL, FINE, ROOM, CueControls
from sandbox.games.billiards.view.player import BilliardsPlayer
from tests.window.billiards.seated import FREE, NINE, controls_at

CUE = (0.5, 0.5)
AWAY = (0.9, 0.2)
"""m, where no ball is"""


def player_at(text: str) -> BilliardsPlayer:
    return controls_at(text).player


def hand_at(game: BilliardsPlayer) -> CueControls:
    return CueControls(game)


def move(hand: CueControls, before: tuple[float, float], now: tuple[float, float], time: float = 0.0) -> None:
    hand.move(before, now, (0.0, 0.0), False, time)


def test_cue_points_to_the_mouse() -> None:
    game = player_at(FREE)
    move(hand_at(game), CUE, (0.9, 0.9))
    assert game.cue.aim == pytest.approx(math.pi / 4, abs=1e-12)  # rounding


def test_mouse_on_the_cue_ball_points_nowhere() -> None:
    game = player_at(FREE)
    before = game.cue.aim
    move(hand_at(game), AWAY, (0.501, 0.5))
    assert game.cue.aim == before


def test_fine_aim_turns_by_a_share_and_stays_when_the_mouse_goes_on() -> None:
    game = player_at(FREE)
    hand = hand_at(game)
    move(hand, CUE, (1.0, 0.5))
    hand.move((1.0, 0.5), (1.0, 0.6), (0.0, 0.0), True, 0.0)
    turned = math.atan2(0.1, 0.5)
    assert game.cue.aim == pytest.approx(FINE * turned, abs=1e-12)  # rounding
    move(hand, (1.0, 0.6), (1.0, 0.7))
    assert game.cue.aim == pytest.approx(math.atan2(0.2, 0.5) - (1 - FINE) * turned, abs=1e-12)  # no jump


def test_english_stays_within_the_circle_beyond_which_tips_slip() -> None:
    game = player_at(FREE)
    hand = hand_at(game)
    hand.begin("english")
    hand.move(CUE, AWAY, (0.2 * DIAL, -0.1 * DIAL), False, 0.0)
    assert (game.cue.side, game.cue.height) == pytest.approx((0.2, 0.1), abs=1e-12)  # rounding
    hand.move(CUE, AWAY, (5.0 * DIAL, 5.0 * DIAL), False, 0.0)
    assert math.hypot(game.cue.side, game.cue.height) == pytest.approx(MAX_TIP_OFFSET, abs=1e-12)  # rounding
    hand.end()
    game.shoot()  # which no engine refuses


def test_power_follows_the_mouse_up() -> None:
    game = player_at(FREE)
    hand = hand_at(game)
    game.cue.power = 0.5
    hand.begin("power")
    hand.move(CUE, AWAY, (0.0, -0.4 * DIAL), False, 0.0)
    assert game.cue.power == pytest.approx(0.7, abs=1e-12)  # rounding


def test_pushing_the_cue_through_the_ball_strokes_as_fast_as_the_hand() -> None:
    game = player_at(FREE)
    game.cue.aim = 0.0
    hand = hand_at(game)
    hand.begin("stroke")
    x, time = 0.0, 0.0
    for _ in range(10):  # back
        move(hand, (x, 0.0), (x - 0.02, 0.0), time)
        x, time = x - 0.02, time + 0.01
    assert game.cue.back == pytest.approx(0.2, abs=1e-12)  # rounding
    assert game.strokes == 0
    while game.strokes == 0:
        assert x < 0.2
        move(hand, (x, 0.0), (x + 0.02, 0.0), time)
        x, time = x + 0.02, time + 0.01
    # 2 m/s; the time over which it is measured holds 7 or 8 of these motions.
    assert game.cue.speed == pytest.approx(2.0, rel=0.2)


def test_letting_go_of_the_key_strokes_nothing() -> None:
    game = player_at(FREE)
    hand = hand_at(game)
    hand.begin("stroke")
    move(hand, CUE, (0.5, 0.4))
    hand.end()
    assert game.cue.back == 0.0
    assert game.strokes == 0


def test_drawing_the_cue_back_and_letting_go_strokes_by_how_far() -> None:
    game = player_at(FREE)
    game.cue.aim = math.pi / 2
    hand = hand_at(game)
    assert hand.press(AWAY, 0.0)
    back = AWAY[0], AWAY[1] - 0.5 * ROOM
    move(hand, AWAY, back)
    hand.release(back, moved=True)
    assert game.strokes == 1
    assert game.cue.speed == pytest.approx(0.5 * MAX_CUE_SPEED, abs=1e-9)  # rounding


def test_click_on_the_cloth_strokes_nothing() -> None:
    game = player_at(FREE)
    hand = hand_at(game)
    assert hand.press(AWAY, 0.0)
    hand.release(AWAY, moved=False)
    assert game.strokes == 0


def test_press_on_another_ball_is_left_to_the_hands() -> None:
    assert not hand_at(player_at(FREE)).press((0.5, 1.0), 0.0)


def test_cue_ball_in_hand_is_dragged() -> None:
    game = player_at(NINE)
    hand = hand_at(game)
    at = game.position[game.ball]
    assert hand.press(at, 0.0)
    move(hand, at, (0.3, 0.2))
    hand.release((0.3, 0.2), moved=True)
    assert game.position[game.ball] == (0.3, 0.2)
