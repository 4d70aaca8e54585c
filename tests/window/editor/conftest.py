"""Windows in which scenes are edited."""

from collections.abc import Iterator
from pathlib import Path

import pygame
import pytest

from sandbox.window.app import App
from sandbox.window.app_state import AppState
from tests.window.editor.hand import SIZE, Hand, OpenOn


@pytest.fixture
def open_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[OpenOn]:
    """Return a function that opens a window on a scene, given by its text or file, and edits it by default."""
    monkeypatch.chdir(tmp_path)
    windows: list[App] = []

    def edit(scene: str | Path | None, edits: bool = True) -> Hand:
        path = scene
        if isinstance(scene, str):
            path = tmp_path / "scene.toml"
            path.write_text(scene)
        window = App(AppState(), size=SIZE, folder=tmp_path, say=lambda _: None)
        windows.append(window)
        assert path is None or window.app_state.open(path), window.app_state.faults
        pygame.event.clear()
        hand = Hand(window)
        if edits:
            window.start_editing()
            hand.frame()
            assert window.editing is not None
        return hand

    yield edit
    if pygame.display.get_init():
        pygame.key.set_mods(0)
    for window in windows:
        window.close()


@pytest.fixture
def hand(open_on: OpenOn) -> Hand:
    """A window without a scene, in which a new one is edited."""
    return open_on(None)
