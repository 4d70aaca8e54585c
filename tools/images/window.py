"""Pictures of the window: scenes and games played by scripts and bots."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pygame
from PIL import Image

import sandbox
from sandbox.games.billiards.bot import BilliardsBot
from sandbox.games.billiards.view.controls import BilliardsControls
from sandbox.games.contract import StepInfo
from sandbox.games.pinball.bot import PinballBot
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.app import App
from sandbox.window.app_state import AppState, Messages
from sandbox.window.playback import diagnostics as companions
from sandbox.window.view_bounds import view_bounds

from .files import image_of, save_gif, save_png
from .thumbnails import SIZE as THUMBNAIL
from .thumbnails import save as save_thumbnail

SIZE, UPRIGHT = (1280, 800), (960, 900)
COLOURS = 128
FRAME = 1.0 / 60.0  # s
SKILL, LIT = 0.95, 25.0
"""Skill of the pinball player, and time after which enough lamps are lit, s."""
FAST = 1.0
"""m/s; a faster ball is in play."""
TRIGGER = ("right", 0.5, 0.7), ("up", 0.5, 1.18), ("fire", 9.0, 9.1)
"""Keys held in the first turn of the duel, with begin and end, s: the shell lands near the other tank."""
LAND = (128, 160, 1152, 800)
"""px; part of the window without panels."""
CLOTH = (0, 148, 1136, 790)
"""px; the table in the window."""
AFTER_FIRE = 14.0
"""s; the shell is above the hills and the first messages have disappeared."""
FLIGHT = (
    (2.6, "turn left", 1.0),
    (3.1, "turn left", 0.0),
    (3.2, "turn right", 1.0),
    (3.65, "turn right", 0.0),
    (3.7, "engine", 0.8),
    (6.1, "turn right", 0.6),
)
"""Times, s, controls and values of a landing."""


companions.CATCH_UP_TIME = 600.0
"""s; long enough for a ghost to appear on a busy machine."""


def _open(scene: str, size: tuple[int, int], *overrides: str) -> App:
    state = AppState(overrides=list(overrides))
    window = App(state, size=size)
    state.open(find(scene))
    window.run_frame(FRAME)
    state.messages = Messages()
    return window


def _close(window: App, path: Path, colours: int = COLOURS) -> None:
    image = image_of(window.context.surface)
    window.close()
    save_png(image, path, colours)


def ghost(path: Path) -> None:
    """Run the gas on pymunk, with the ghost of the exact engine."""
    window = _open("gas", SIZE)
    window.context.gui.overlays |= {"energy"}
    window.app_state.toggle_ghost()
    live = window.app_state.live
    assert live is not None
    live.diagnostics.watch_divergence(True)
    while live.frame.time < 1.6:
        window.run_frame(FRAME)
    _close(window, path)


def duel(path: Path) -> None:
    """Fire once, and make the picture while the shell flies."""
    _close(_duel("duel", SIZE), path, 256)


def artillery_thumbnail(scene: str) -> Callable[[Path], None]:
    """Return a function that makes the thumbnail of an artillery game."""

    def make(path: Path) -> None:
        window = _duel(scene, SIZE)
        image = image_of(window.context.surface).crop(LAND)
        window.close()
        save_thumbnail(image.resize(THUMBNAIL, Image.Resampling.LANCZOS), path)

    return make


def _duel(scene: str, size: tuple[int, int]) -> App:
    window = _open(scene, size)
    window.context.gui.panel.visible = False
    window.context.fit_scene()
    window.app_state.start_game()
    host, live = window.app_state.host, window.app_state.live
    assert host is not None
    assert live is not None
    while live.frame.time < AFTER_FIRE:
        for control, begin, end in TRIGGER:
            host.hold("script", control, float(begin <= live.frame.time < end))
        window.run_frame(FRAME)
    return window


def landing(path: Path) -> None:
    """Descend towards the pad by a script of throttles."""
    window = _open("landing", SIZE, "world.seed=9")
    window.context.gui.overlays |= {"trails"}
    window.app_state.start_game()
    host, live = window.app_state.host, window.app_state.live
    assert host is not None
    assert live is not None
    for seconds, control, value in FLIGHT:
        while live.frame.time < seconds:
            window.run_frame(FRAME)
        host.hold("script", control, value)
    for _ in range(12):
        window.run_frame(FRAME)
    _close(window, path)


def pinball(path: Path) -> None:
    """Play pinball with a bot for half a minute."""
    window = _open("pinball/full", UPRIGHT)
    window.context.gui.panel.visible = False
    window.context.gui.overlays |= {"trails"}
    window.context.fit_scene()
    window.app_state.start_game()
    live, host = window.app_state.live, window.app_state.host
    assert live is not None
    assert host is not None
    live.diagnostics.watch_divergence(False)
    player = PinballBot(live.scene.world.seed, SKILL)
    (_, bottom), (_, top) = view_bounds(live.scene)
    while live.frame.time < LIT or not _is_in_play(live.frame, (bottom + top) / 2.0):
        for control, value in player.decide(StepInfo(live.frame.time, live.frame, live.contacts, ()), host.rules):
            host.hold("player", control, value)
        window.run_frame(FRAME)
    _close(window, path)


def _is_in_play(frame: sandbox.Frame, height: float) -> bool:
    """Return whether the fastest body is fast and higher than `height`, m."""
    speed = np.linalg.norm(frame.velocity, axis=1)
    fastest = int(speed.argmax())
    return bool(speed[fastest] > FAST and frame.position[fastest, 1] > height)


def table(path: Path) -> None:
    """Break, and aim the next shot as a skilled bot would; the bot is seeded."""
    window = _open("8-ball", SIZE)
    controls = window.app_state.controls
    assert isinstance(controls, BilliardsControls)
    game = controls.player
    game.shoot()
    window.run_frame(FRAME)
    while not game.host.waiting:
        window.run_frame(FRAME)
    plan = BilliardsBot(1.0, 1).intend(game.match).stroke
    game.cue.aim, game.cue.speed = plan.aim, plan.speed
    game.cue.tip_at(plan.side, plan.height)
    window.app_state.messages = Messages()
    window.run_frame(FRAME)
    _close(window, path)


def rolling(path: Path) -> None:
    """Break at 9-ball, and film the table."""
    window = _open("9-ball", SIZE)
    window.context.gui.panel.visible = False
    window.context.fit_scene()
    window.handle_event(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_SPACE, mod=0, unicode=" ", scancode=0))
    frames = []
    for k in range(round(2.6 / FRAME)):
        window.run_frame(FRAME)
        if k % 3 == 0:
            frames.append(image_of(window.context.surface).crop(CLOTH).resize((640, 362), Image.Resampling.LANCZOS))
    window.close()
    save_gif(frames, path, 20.0, 128, 0.8)
