"""A billiards table in the window, played by keyboard and mouse events."""

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
from tests.toml_text import toml
from tests.window.pressing import key, key_up, move, press, release

pytestmark = pytest.mark.fail_slow(60)  # a window or a film

SIZE = (1000, 620)
FRAME_TIME = 1.0 / 60.0
"""s"""
TABLE = toml(title="Table") + toml("billiards", table="pool-7ft", game="9-ball") + toml("shot", aim=1.5708, speed=4.0)


@pytest.fixture
def window(tmp_path: Path) -> Iterator[App]:
    path = tmp_path / "table.toml"
    path.write_text(TABLE, encoding="utf-8")
    window = App(AppState(), size=SIZE, folder=tmp_path, say=lambda _: None)
    assert window.app_state.open(path)
    pygame.event.clear()
    window.run_frame(FRAME_TIME)
    yield window
    window.close()


def controls_in(window: App) -> BilliardsControls:
    assert isinstance(window.app_state.controls, BilliardsControls)
    return window.app_state.controls


def game_in(window: App) -> BilliardsPlayer:
    return controls_in(window).player


def run_events(window: App, *events: pygame.event.Event) -> None:
    for event in events:
        window.handle_event(event)
    window.run_frame(FRAME_TIME)


def on_screen(window: App, x: float, y: float) -> tuple[float, float]:
    across, down = window.context.camera.to_screen(np.array([x, y])).tolist()
    return across, down


def roll_out(window: App) -> None:
    game = game_in(window)
    window.run_frame(FRAME_TIME)
    for _ in range(5000):
        if game.host.waiting:
            return
        game.live.step()
        window.run_frame(FRAME_TIME)
    raise AssertionError("the balls do not come to rest")


def test_table_uses_the_exact_engine_and_a_rotated_camera(window: App) -> None:
    assert window.app_state.engine == "exact"
    assert window.context.camera.turned
    corners = window.context.camera.to_screen(np.array([[0.0, 0.0], [39.0 * INCH, 78.0 * INCH]]))
    assert corners.min() > 0.0
    assert corners[:, 0].max() < SIZE[0] - window.context.gui.panel.width


def test_help_lists_the_keys_of_the_table(window: App) -> None:
    rows = dict(window.app_state.key_bindings.help_rows)
    for label in ("S (hold)", "E (hold)", "X (hold)", "Space", "G", "Z"):
        assert label in rows
    groups = dict(help_groups(window.app_state.key_bindings.help_rows))
    assert ("Space", "shoot") in groups["This scene"]
    assert any(keys == "P" for keys, _ in groups["Time"])  # the table uses Space


def test_mouse_aims_and_space_shoots(window: App) -> None:
    game = game_in(window)
    x, y = game.position[game.ball]
    run_events(window, move(*on_screen(window, x + 0.2, y + 0.3)))
    # A pixel at 0.36 m
    assert game.cue.aim == pytest.approx(math.atan2(0.3, 0.2), abs=1.5 / (0.36 * window.context.camera.scale))
    run_events(window, key(pygame.K_SPACE))
    (strike,) = (action for action in game.live.session.actions if isinstance(action, Strike))
    assert strike.aim == game.cue.aim
    assert not window.app_state.paused


def test_e_sets_english_and_does_not_switch_the_engine(window: App) -> None:
    game = game_in(window)
    before = game.cue.aim
    run_events(window, move(400, 300), key(pygame.K_e))
    run_events(window, move(420, 290))
    run_events(window, key_up(pygame.K_e))
    assert game.cue.side > 0.0
    assert game.cue.height > 0.0
    assert window.app_state.engine == "exact"
    english = game.cue.side
    run_events(window, move(480, 200))
    assert game.cue.side == english
    assert game.cue.aim != before


def test_x_and_arrows_set_the_power(window: App) -> None:
    game = game_in(window)
    before = game.cue.power
    run_events(window, move(400, 300), key(pygame.K_x), move(400, 290), key_up(pygame.K_x))
    assert game.cue.power > before
    now = game.cue.power
    run_events(window, key(pygame.K_DOWN))
    assert game.cue.power < now


def test_clicks_set_tip_offset_and_power(window: App) -> None:
    game = game_in(window)
    window.draw()
    dials = controls_in(window).hud.dials
    tip, power = dials["tip"], dials["power"]
    run_events(window, press(tip.centerx - 0.25 * tip.width / 2, tip.centery), release(tip.centerx, tip.centery))
    assert game.cue.side == pytest.approx(-0.25, abs=2.0 / tip.width)  # a pixel
    run_events(window, press(power.centerx, power.top + 1), release(power.centerx, power.top + 1))
    assert game.cue.power > 0.95
    assert game.strokes == 0


def test_g_and_a_click_place_the_ball_in_hand(window: App) -> None:
    game = game_in(window)
    run_events(window, key(pygame.K_g), move(*on_screen(window, 0.3, 0.25)))
    run_events(window, press(*on_screen(window, 0.3, 0.25)), release(*on_screen(window, 0.3, 0.25)))
    (moved,) = game.live.session.actions
    assert isinstance(moved, Move)
    assert game.position[game.ball] == pytest.approx((0.3, 0.25), abs=1.0 / window.context.camera.scale)  # a pixel
    assert game.strokes == 0


def test_foul_is_reported_and_z_undoes_the_stroke(window: App) -> None:
    game = game_in(window)
    x, y = game.position[game.ball]
    run_events(window, move(*on_screen(window, x, y - 0.3)), key(pygame.K_DOWN))
    game.cue.speed = 0.4
    run_events(window, key(pygame.K_SPACE))
    roll_out(window)
    assert game.match.verdict is not None
    assert "the cue ball hit no ball" in "; ".join(game.match.messages)
    assert game.match.turn == 1
    run_events(window, key(pygame.K_z))
    window.run_frame(FRAME_TIME)
    assert game.strokes == 0
    assert game.match.turn == 0
    assert game.position[game.ball] == (x, y)


def test_stroke_while_paused_advances_by_single_steps(window: App) -> None:
    game = game_in(window)
    run_events(window, key(pygame.K_p), key(pygame.K_SPACE))
    assert game.strokes == 1
    assert game.live.session.time == 0.0
    run_events(window, key(pygame.K_o))
    assert game.live.session.time == pytest.approx(0.01, abs=1e-12)


def test_players_parameter_restarts_the_game(window: App) -> None:
    run_events(window, key(pygame.K_SPACE))
    window.app_state.set_parameter("players", "you vs bot")
    game = game_in(window)
    assert game.players == "you vs bot"
    assert game.strokes == 0
    window.app_state.set_parameter("players", "one player")
    assert game_in(window).match.state.players == 1


def test_misses_parameter_sets_the_miss_rule_of_snooker(window: App) -> None:
    assert window.app_state.open(find("snooker"))
    for value, misses in (("on", True), ("off", False)):
        window.app_state.set_parameter("misses", value)
        state = game_in(window).match.state
        assert isinstance(state, SnookerState)
        assert state.misses is misses


def test_small_and_narrow_windows_draw_the_table(window: App) -> None:
    for size in ((320, 240), (200, 900), (1600, 400)):
        window.context.resize(pygame.Surface(size))
        window.draw()
        run_events(window, move(5, 5), press(5, 5), release(5, 5))
        picture = pygame.surfarray.array3d(window.context.surface)
        assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 10, size  # cloth, cushions, balls and texts


def test_restart_starts_a_new_game(window: App) -> None:
    run_events(window, key(pygame.K_SPACE))
    before = game_in(window)
    run_events(window, key(pygame.K_r))
    assert game_in(window) is not before
    assert game_in(window).strokes == 0
    assert (game_in(window).cue.aim, game_in(window).cue.speed) == (1.5708, 4.0)


def test_balls_of_a_game_cannot_be_dragged(window: App) -> None:
    game = game_in(window)
    x, y = game.position[game.live.bodies.names.index("1")]
    start, end = on_screen(window, x, y), on_screen(window, x - 0.2, y)
    run_events(window, move(*start), press(*start), move(*end, held=True), release(*end))
    assert game.live.session.actions == ()
    assert "the cue moves balls" in window.app_state.messages.visible()[-1][1]
