"""The game of the how-to "Write a game": a file outside of the package; headless, in a window, and as environment."""

import importlib
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pygame
import pytest

from sandbox import game_names as names
from sandbox.engines.switching import start
from sandbox.game_names import game_names, register_game
from sandbox.game_spec import GameSpec
from sandbox.gym import SandboxEnv
from sandbox.measure.run.sessions import play_out, rerun
from sandbox.scene.files.load import loads
from sandbox.window.app import App
from sandbox.window.app_state import AppState
from sandbox.window.camera import Camera
from sandbox.window.capture.image_files import offscreen
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.snapshot import Snapshot
from sandbox.window.render.renderer import Renderer
from tests.window.pressing import key

pytestmark = pytest.mark.fail_slow(60)  # a window or a film

PAGE = Path(__file__).parents[3] / "docs/howto/write-a-game.md"
GOLD, WHITE = (255, 215, 0), (255, 255, 255)


@pytest.fixture
def keepy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """Import the module of the how-to."""
    found = re.search(
        r"<!-- file: keepy_uppy\.py -->\n```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL
    )
    assert found is not None
    (tmp_path / "keepy_uppy.py").write_text(found[1], encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(names, "_ADDED", {})
    yield importlib.import_module("keepy_uppy")
    del sys.modules["keepy_uppy"]


def test_game_runs_headless_and_replays(keepy: ModuleType) -> None:
    assert "keepy-uppy" in game_names()
    game = play_out(loads(keepy.SCENE), keepy.Kicker(2))
    assert (game.score, game.over) == (2, "the ball touched the floor")
    replay = rerun(game.recording)
    assert replay.info["state_hash"] == game.recording.state_hash
    assert replay.info["game"]["score"] == 2


def test_view_colours_the_ball_by_the_state_of_the_rules(keepy: ModuleType) -> None:
    scene, camera = loads(keepy.SCENE), Camera((0.0, 1.0), 100.0, (400, 400))
    for in_reach, colour in ((True, GOLD), (False, WHITE)):
        surface = offscreen(camera.size)
        Renderer().draw(surface, camera, Snapshot(scene, scene.bodies, start(scene, "pymunk").frame(), game=in_reach))
        x, y = camera.to_screen(np.array([0.0, 1.5])).tolist()
        assert surface.get_at((round(x), round(y)))[:3] == colour


def test_game_is_played_in_the_window(keepy: ModuleType, tmp_path: Path) -> None:
    file = tmp_path / "keepy.toml"
    file.write_text(keepy.SCENE, encoding="utf-8")
    state = AppState()
    state.open_other(file)
    window = App(state, size=(640, 480), folder=tmp_path, say=lambda _: None)
    try:
        live = window.app_state.view
        assert isinstance(live, LiveView)
        window.run_frame(0.02)
        assert live.session.time == 0.0  # a real-time game waits for a key
        pygame.event.post(key(pygame.K_SPACE))
        while live.session.time < 0.45:  # the ball falls from 1.5 m to below 0.6 m
            window.run_frame(0.02)
        x, y = window.context.camera.to_screen(live.frame.position[0]).tolist()
        assert window.context.surface.get_at((round(x), round(y)))[:3] == GOLD
        assert window.app_state.host is not None
        window.app_state.host.hold("test", "kick", 1.0)
        window.run_frame(0.02)
        assert window.app_state.host.rules.score == 1
    finally:
        window.close()


def test_game_is_a_gymnasium_environment(keepy: ModuleType) -> None:
    env = SandboxEnv(loads(keepy.SCENE), every=10)
    observation, info = env.reset(seed=1)
    assert env.observation_space.contains(observation)
    ended = False
    while not ended:
        _, reward, ended, _, info = env.step([0])
    assert (reward, info["over"]) == (0.0, "the ball touched the floor")
    env.close()


def test_built_in_game_cannot_be_replaced() -> None:
    with pytest.raises(ValueError, match="'pinball'"):
        register_game(GameSpec(names=("keepy-uppy", "pinball")))
    assert "keepy-uppy" not in game_names()


def test_registered_game_cannot_add_scene_tables() -> None:
    with pytest.raises(ValueError, match=r"\[keepy\]"):
        register_game(GameSpec(names=("keepy-uppy",), tables={"keepy": "keepy_uppy:TABLE"}))
    assert "keepy-uppy" not in game_names()
