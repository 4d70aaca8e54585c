"""A table in the window: events as SDL would send them."""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pygame
import pytest

from sandbox.action import Move, Strike
from sandbox.games.billiards.rules.snooker import SnookerState
from sandbox.games.billiards.tables import INCH
from sandbox.games.billiards.view.controls import BilliardsControls
from sandbox.games.billiards.view.player import BilliardsPlayer
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.app import App
from sandbox.window.app_state import AppState
from sandbox.window.ui.help import help_groups
from tests.window.pressing import key, key_up, move, press, release

pytestmark = pytest.mark.full  # a window or a film

SIZE = (1000, 620)
TURN = 1.0 / 60.0
"""s"""
TABLE = """
title = "Table"
[billiards]
table = "pool-7ft"
game = "9-ball"
[[shot]]
aim = 1.5708
speed = 4.0
"""


@pytest.fixture
def window(tmp_path: Path) -> Iterator[App]:
    path = tmp_path / "table.toml"
    path.write_text(TABLE, encoding="utf-8")
    opened = App(AppState(), size=SIZE, folder=tmp_path, say=lambda _: None)
    assert opened.app_state.open(path)
    pygame.event.clear()
    opened.run_frame(TURN)
    yield opened
    opened.close()


def controls_in(window: App) -> BilliardsControls:
    assert isinstance(window.app_state.controls, BilliardsControls)
    return window.app_state.controls


def game_in(window: App) -> BilliardsPlayer:
    return controls_in(window).player


def do(window: App, *events: pygame.event.Event) -> None:
    for event in events:
        window.handle_event(event)
    window.run_frame(TURN)


def at(window: App, x: float, y: float) -> tuple[float, float]:
    across, down = window.context.camera.to_screen(np.array([x, y])).tolist()
    return across, down


def roll_out(window: App) -> None:
    game = game_in(window)
    window.run_frame(TURN)
    for _ in range(5000):
        if game.host.waiting:
            return
        game.live.step()
        window.run_frame(TURN)
    raise AssertionError("the balls never rest")


def test_table_is_played_on_the_exact_engine_and_lies_down(window: App) -> None:
    assert window.app_state.engine == "exact"
    assert window.context.camera.turned
    corners = window.context.camera.to_screen(np.array([[0.0, 0.0], [39.0 * INCH, 78.0 * INCH]]))
    assert corners.min() > 0.0
    assert corners[:, 0].max() < SIZE[0] - window.context.gui.panel.width


def test_help_lists_the_keys_of_the_table(window: App) -> None:
    told = dict(window.app_state.key_bindings.help_rows)
    for label in ("S (hold)", "E (hold)", "X (hold)", "Space", "G", "Z"):
        assert label in told
    named = dict(help_groups(window.app_state.key_bindings.help_rows))
    assert ("Space", "shoot") in named["This scene"]
    assert any(keys == "P" for keys, _ in named["Time"])  # Space is the table's


def test_mouse_aims_and_space_shoots(window: App) -> None:
    game = game_in(window)
    x, y = game.position[game.ball]
    do(window, move(*at(window, x + 0.2, y + 0.3)))
    # A pixel at 0.36 m
    assert game.cue.aim == pytest.approx(math.atan2(0.3, 0.2), abs=1.5 / (0.36 * window.context.camera.scale))
    do(window, key(pygame.K_SPACE))
    (strike,) = (action for action in game.live.session.actions if isinstance(action, Strike))
    assert strike.aim == game.cue.aim
    assert not window.app_state.paused


def test_e_sets_english_and_leaves_the_engine(window: App) -> None:
    game = game_in(window)
    before = game.cue.aim
    do(window, move(400, 300), key(pygame.K_e))
    do(window, move(420, 290))
    do(window, key_up(pygame.K_e))
    assert game.cue.side > 0.0
    assert game.cue.height > 0.0
    assert window.app_state.engine == "exact"
    english = game.cue.side
    do(window, move(480, 200))
    assert game.cue.side == english
    assert game.cue.aim != before


def test_x_and_arrows_set_the_power(window: App) -> None:
    game = game_in(window)
    before = game.cue.power
    do(window, move(400, 300), key(pygame.K_x), move(400, 290), key_up(pygame.K_x))
    assert game.cue.power > before
    now = game.cue.power
    do(window, key(pygame.K_DOWN))
    assert game.cue.power < now


def test_dial_and_power_can_be_clicked(window: App) -> None:
    game = game_in(window)
    window.draw()
    dials = controls_in(window).hud.dials
    tip, power = dials["tip"], dials["power"]
    do(window, press(tip.centerx - 0.25 * tip.width / 2, tip.centery), release(tip.centerx, tip.centery))
    assert game.cue.side == pytest.approx(-0.25, abs=2.0 / tip.width)  # a pixel
    do(window, press(power.centerx, power.top + 1), release(power.centerx, power.top + 1))
    assert game.cue.power > 0.95
    assert game.strokes == 0


def test_g_and_a_click_put_the_ball_in_hand_down(window: App) -> None:
    game = game_in(window)
    do(window, key(pygame.K_g), move(*at(window, 0.3, 0.25)))
    do(window, press(*at(window, 0.3, 0.25)), release(*at(window, 0.3, 0.25)))
    (moved,) = game.live.session.actions
    assert isinstance(moved, Move)
    assert game.position[game.ball] == pytest.approx((0.3, 0.25), abs=1.0 / window.context.camera.scale)  # a pixel
    assert game.strokes == 0


def test_foul_is_said_and_z_takes_the_stroke_back(window: App) -> None:
    game = game_in(window)
    x, y = game.position[game.ball]
    do(window, move(*at(window, x, y - 0.3)), key(pygame.K_DOWN))
    game.cue.speed = 0.4
    do(window, key(pygame.K_SPACE))
    roll_out(window)
    assert game.match.verdict is not None
    assert "the cue ball hit no ball" in "; ".join(game.match.messages)
    assert game.match.turn == 1
    do(window, key(pygame.K_z))
    window.run_frame(TURN)
    assert game.strokes == 0
    assert game.match.turn == 0
    assert game.position[game.ball] == (x, y)


def test_stroke_works_while_paused_and_goes_on_by_steps(window: App) -> None:
    game = game_in(window)
    do(window, key(pygame.K_p), key(pygame.K_SPACE))
    assert game.strokes == 1
    assert game.live.session.time == 0.0
    do(window, key(pygame.K_o))
    assert game.live.session.time == pytest.approx(0.01, abs=1e-12)


def test_players_are_chosen_in_the_panel(window: App) -> None:
    do(window, key(pygame.K_SPACE))
    window.app_state.set_parameter("players", "you vs bot")
    game = game_in(window)
    assert game.players == "you vs bot"
    assert game.strokes == 0
    window.app_state.set_parameter("players", "one player")
    assert game_in(window).match.state.players == 1


def test_snooker_may_be_played_with_the_miss(window: App) -> None:
    assert window.app_state.open(find("snooker"))
    for value, misses in (("on", True), ("off", False)):
        window.app_state.set_parameter("misses", value)
        state = game_in(window).match.state
        assert isinstance(state, SnookerState)
        assert state.misses is misses


def test_window_without_room_draws_the_table_all_the_same(window: App) -> None:
    for size in ((320, 240), (200, 900), (1600, 400)):
        window.context.resize(pygame.Surface(size))
        window.draw()
        do(window, move(5, 5), press(5, 5), release(5, 5))
        picture = pygame.surfarray.array3d(window.context.surface)
        assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 10, size  # cloth, cushions, balls and texts


def test_restart_begins_the_game_anew(window: App) -> None:
    do(window, key(pygame.K_SPACE))
    before = game_in(window)
    do(window, key(pygame.K_r))
    assert game_in(window) is not before
    assert game_in(window).strokes == 0
    assert (game_in(window).cue.aim, game_in(window).cue.speed) == (1.5708, 4.0)


def test_balls_of_a_game_are_moved_by_the_cue_alone(window: App) -> None:
    game = game_in(window)
    x, y = game.position[game.live.bodies.names.index("1")]
    start, end = at(window, x, y), at(window, x - 0.2, y)
    do(window, move(*start), press(*start), move(*end, held=True), release(*end))
    assert game.live.session.actions == ()
    assert "the cue moves balls" in window.app_state.messages.visible()[-1][1]
