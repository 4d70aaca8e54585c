"""Windows in which scenes are edited."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pygame
import pytest

from sandbox.window.app import App
from sandbox.window.app_state import AppState
from tests.window.editor.hand import CTRL, SIZE, Hand


@pytest.fixture
def hand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Hand]:
    """A window without a scene, in which a new one is edited."""
    monkeypatch.chdir(tmp_path)
    window = App(AppState(), size=SIZE, folder=tmp_path, say=lambda _: None)
    pygame.event.clear()
    window.start_editing()
    found = Hand(window)
    found.frame()
    yield found
    window.close()


@pytest.fixture
def open_on(tmp_path: Path) -> Iterator[Callable[[str], Hand]]:
    """Return a function that opens a window on a scene and edits it."""
    windows: list[App] = []

    def edit(text: str) -> Hand:
        path = tmp_path / "scene.toml"
        path.write_text(text)
        window = App(AppState(), size=SIZE, folder=tmp_path, say=lambda _: None)
        windows.append(window)
        assert window.app_state.open(path)
        pygame.event.clear()
        found = Hand(window)
        found.key(pygame.K_e, CTRL)
        found.frame()
        return found

    yield edit
    for window in windows:
        window.close()
