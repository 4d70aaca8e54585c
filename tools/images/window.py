"""Pictures of the window: scenes and games as they are played, by scripts and bots."""

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
"""of the pinball player; and the time from which enough lamps are lit, s"""
FAST = 1.0
"""m/s, of a ball that is in play"""
TRIGGER = ("right", 0.5, 0.7), ("up", 0.5, 1.18), ("fire", 9.0, 9.1)
"""Keys held in the duel's first turn, from when until when, s: the shell lands near the other tank."""
LAND = (128, 160, 1152, 800)
"""px: a part of the window without plates"""
CLOTH = (0, 148, 1136, 790)
"""px: the table in the window"""
AFTER_FIRE = 14.0
"""s, when the shell is over the hills and the first messages are gone"""
FLIGHT = (
    (2.6, "turn left", 1.0),
    (3.1, "turn left", 0.0),
    (3.2, "turn right", 1.0),
    (3.65, "turn right", 0.0),
    (3.7, "engine", 0.8),
    (6.1, "turn right", 0.6),
)
"""s, controls and values of a landing"""


companions.CATCH_UP_TIME = 600.0
"""s: a ghost appears on a busy machine too"""


def _open(scene: str, size: tuple[int, int], *overrides: str) -> App:
    stage = AppState(overrides=list(overrides))
    opened = App(stage, size=size)
    stage.open(find(scene))
    opened.run_frame(FRAME)
    stage.messages = Messages()
    return opened


def _close(opened: App, path: Path, colours: int = COLOURS) -> None:
    image = image_of(opened.context.surface)
    opened.close()
    save_png(image, path, colours)


def ghost(path: Path) -> None:
    """Play the gas on pymunk, with the ghost of the exact engine."""
    opened = _open("gas", SIZE)
    opened.context.gui.overlays |= {"energy"}
    opened.app_state.toggle_ghost()
    live = opened.app_state.live
    assert live is not None
    live.diagnostics.watch_divergence(True)
    while live.frame.time < 1.6:
        opened.run_frame(FRAME)
    _close(opened, path)


def duel(path: Path) -> None:
    """Fire once; keep the shell on its way."""
    _close(_duel("duel", SIZE), path, 256)


def artillery_thumbnail(scene: str) -> Callable[[Path], None]:
    """Return what makes the thumbnail of a game of artillery."""

    def make(path: Path) -> None:
        opened = _duel(scene, SIZE)
        image = image_of(opened.context.surface).crop(LAND)
        opened.close()
        save_thumbnail(image.resize(THUMBNAIL, Image.Resampling.LANCZOS), path)

    return make


def _duel(scene: str, size: tuple[int, int]) -> App:
    opened = _open(scene, size)
    opened.context.gui.panel.visible = False
    opened.context.fit_scene()
    opened.app_state.start_game()
    host, live = opened.app_state.host, opened.app_state.live
    assert host is not None
    assert live is not None
    while live.frame.time < AFTER_FIRE:
        for control, begin, end in TRIGGER:
            host.hold("script", control, float(begin <= live.frame.time < end))
        opened.run_frame(FRAME)
    return opened


def landing(path: Path) -> None:
    """Descend towards the pad by a script of throttles."""
    opened = _open("landing", SIZE, "world.seed=9")
    opened.context.gui.overlays |= {"trails"}
    opened.app_state.start_game()
    host, live = opened.app_state.host, opened.app_state.live
    assert host is not None
    assert live is not None
    for seconds, control, value in FLIGHT:
        while live.frame.time < seconds:
            opened.run_frame(FRAME)
        host.hold("script", control, value)
    for _ in range(12):
        opened.run_frame(FRAME)
    _close(opened, path)


def pinball(path: Path) -> None:
    """Let a player who watches the ball play for half a minute."""
    opened = _open("pinball/full", UPRIGHT)
    opened.context.gui.panel.visible = False
    opened.context.gui.overlays |= {"trails"}
    opened.context.fit_scene()
    opened.app_state.start_game()
    live, host = opened.app_state.live, opened.app_state.host
    assert live is not None
    assert host is not None
    live.diagnostics.watch_divergence(False)
    player = PinballBot(live.scene.world.seed, SKILL)
    (_, bottom), (_, top) = view_bounds(live.scene)
    while live.frame.time < LIT or not _plays(live.frame, (bottom + top) / 2.0):
        for control, value in player.decide(StepInfo(live.frame.time, live.frame, live.contacts, ()), host.rules):
            host.hold("player", control, value)
        opened.run_frame(FRAME)
    _close(opened, path)


def _plays(frame: sandbox.Frame, height: float) -> bool:
    """Tell whether the fastest body is fast, and higher than this, m."""
    speed = np.linalg.norm(frame.velocity, axis=1)
    fastest = int(speed.argmax())
    return bool(speed[fastest] > FAST and frame.position[fastest, 1] > height)


def table(path: Path) -> None:
    """Break, and aim the next shot as a good player would; the numbers of the bot are those of its seed."""
    opened = _open("8-ball", SIZE)
    controls = opened.app_state.controls
    assert isinstance(controls, BilliardsControls)
    game = controls.player
    game.shoot()
    opened.run_frame(FRAME)
    while not game.host.waiting:
        opened.run_frame(FRAME)
    plan = BilliardsBot(1.0, 1).intend(game.match).stroke
    game.cue.aim, game.cue.speed = plan.aim, plan.speed
    game.cue.tip_at(plan.side, plan.height)
    opened.app_state.messages = Messages()
    opened.run_frame(FRAME)
    _close(opened, path)


def rolling(path: Path) -> None:
    """Break at 9-ball, and film the table."""
    opened = _open("9-ball", SIZE)
    opened.context.gui.panel.visible = False
    opened.context.fit_scene()
    opened.handle_event(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_SPACE, mod=0, unicode=" ", scancode=0))
    frames = []
    for k in range(round(2.6 / FRAME)):
        opened.run_frame(FRAME)
        if k % 3 == 0:
            frames.append(image_of(opened.context.surface).crop(CLOTH).resize((640, 362), Image.Resampling.LANCZOS))
    opened.close()
    save_gif(frames, path, 20.0, 128, 0.8)
