"""Mouse gestures of the cue."""

import math

import pytest

from sandbox.games.billiards.game import MAX_CUE_SPEED, MAX_TIP_OFFSET
from sandbox.games.billiards.view.controls import DIAL_RADIUS, FINE_FACTOR, MAX_DRAW_BACK, CueControls
from sandbox.games.billiards.view.player import BilliardsPlayer
from tests.window.billiards.seated import FREE, NINE, controls_at

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of `exact`

CUE = (0.5, 0.5)
EMPTY_POINT = (0.9, 0.2)
"""Point without a ball, m."""


def player_at(text: str) -> BilliardsPlayer:
    return controls_at(text).player


def cue_controls(game: BilliardsPlayer) -> CueControls:
    return CueControls(game)


def move(controls: CueControls, before: tuple[float, float], now: tuple[float, float], time: float = 0.0) -> None:
    controls.move(before, now, (0.0, 0.0), False, time)


def test_cue_points_to_the_mouse() -> None:
    game = player_at(FREE)
    move(cue_controls(game), CUE, (0.9, 0.9))
    assert game.cue.aim == pytest.approx(math.pi / 4, abs=1e-12)  # rounding


def test_mouse_on_the_cue_ball_keeps_the_aim() -> None:
    game = player_at(FREE)
    before = game.cue.aim
    move(cue_controls(game), EMPTY_POINT, (0.501, 0.5))
    assert game.cue.aim == before


def test_fine_aim_scales_the_angle_and_does_not_jump_afterwards() -> None:
    game = player_at(FREE)
    controls = cue_controls(game)
    move(controls, CUE, (1.0, 0.5))
    controls.move((1.0, 0.5), (1.0, 0.6), (0.0, 0.0), True, 0.0)
    turned = math.atan2(0.1, 0.5)
    assert game.cue.aim == pytest.approx(FINE_FACTOR * turned, abs=1e-12)  # rounding
    move(controls, (1.0, 0.6), (1.0, 0.7))
    assert game.cue.aim == pytest.approx(math.atan2(0.2, 0.5) - (1 - FINE_FACTOR) * turned, abs=1e-12)  # no jump


def test_english_is_limited_to_the_circle_without_miscue() -> None:
    game = player_at(FREE)
    controls = cue_controls(game)
    controls.begin("english")
    controls.move(CUE, EMPTY_POINT, (0.2 * DIAL_RADIUS, -0.1 * DIAL_RADIUS), False, 0.0)
    assert (game.cue.side, game.cue.height) == pytest.approx((0.2, 0.1), abs=1e-12)  # rounding
    controls.move(CUE, EMPTY_POINT, (5.0 * DIAL_RADIUS, 5.0 * DIAL_RADIUS), False, 0.0)
    assert math.hypot(game.cue.side, game.cue.height) == pytest.approx(MAX_TIP_OFFSET, abs=1e-12)  # rounding
    controls.end()
    game.shoot()  # no engine refuses the stroke


def test_power_follows_the_mouse_up() -> None:
    game = player_at(FREE)
    controls = cue_controls(game)
    game.cue.power = 0.5
    controls.begin("power")
    controls.move(CUE, EMPTY_POINT, (0.0, -0.4 * DIAL_RADIUS), False, 0.0)
    assert game.cue.power == pytest.approx(0.7, abs=1e-12)  # rounding


def test_pushing_the_cue_strokes_at_the_speed_of_the_mouse() -> None:
    game = player_at(FREE)
    game.cue.aim = 0.0
    controls = cue_controls(game)
    controls.begin("stroke")
    x, time = 0.0, 0.0
    for _ in range(10):  # back
        move(controls, (x, 0.0), (x - 0.02, 0.0), time)
        x, time = x - 0.02, time + 0.01
    assert game.cue.back == pytest.approx(0.2, abs=1e-12)  # rounding
    assert game.strokes == 0
    while game.strokes == 0:
        assert x < 0.2
        move(controls, (x, 0.0), (x + 0.02, 0.0), time)
        x, time = x + 0.02, time + 0.01
    # 2 m/s; the measured interval contains 7 or 8 of these motions.
    assert game.cue.speed == pytest.approx(2.0, rel=0.2)


def test_releasing_the_stroke_key_makes_no_stroke() -> None:
    game = player_at(FREE)
    controls = cue_controls(game)
    controls.begin("stroke")
    move(controls, CUE, (0.5, 0.4))
    controls.end()
    assert game.cue.back == 0.0
    assert game.strokes == 0


def test_stroke_speed_is_proportional_to_the_draw_back_distance() -> None:
    game = player_at(FREE)
    game.cue.aim = math.pi / 2
    controls = cue_controls(game)
    assert controls.press(EMPTY_POINT, 0.0)
    back = EMPTY_POINT[0], EMPTY_POINT[1] - 0.5 * MAX_DRAW_BACK
    move(controls, EMPTY_POINT, back)
    controls.release(back, moved=True)
    assert game.strokes == 1
    assert game.cue.speed == pytest.approx(0.5 * MAX_CUE_SPEED, abs=1e-9)  # rounding


def test_click_on_the_cloth_makes_no_stroke() -> None:
    game = player_at(FREE)
    controls = cue_controls(game)
    assert controls.press(EMPTY_POINT, 0.0)
    controls.release(EMPTY_POINT, moved=False)
    assert game.strokes == 0


def test_press_on_another_ball_is_not_handled_by_the_cue() -> None:
    assert not cue_controls(player_at(FREE)).press((0.5, 1.0), 0.0)


def test_cue_ball_in_hand_is_dragged() -> None:
    game = player_at(NINE)
    controls = cue_controls(game)
    start = game.position[game.ball]
    assert controls.press(start, 0.0)
    move(controls, start, (0.3, 0.2))
    controls.release((0.3, 0.2), moved=True)
    assert game.position[game.ball] == (0.3, 0.2)
