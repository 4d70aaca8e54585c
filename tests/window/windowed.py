"""Scene texts, and windows without a display that show a scene."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pygame

from sandbox.window.app import App
from sandbox.window.app_state import AppState
from sandbox.window.playback.live import LiveView


@contextmanager
def open_window(scene: str | Path, folder: Path, size: tuple[int, int] = (640, 480)) -> Iterator[App]:
    """Open a window on a scene, given by its text or file, and close it at the end."""
    file = scene if isinstance(scene, Path) else folder / "scene.toml"
    if isinstance(scene, str):
        file.write_text(scene, encoding="utf-8")
    state = AppState()
    state.open_other(file)
    window = App(state, size=size, folder=folder, say=lambda _: None)
    try:
        yield window
    finally:
        window.close()


def run_frame(window: App, *events: pygame.event.Event, elapsed: float = 0.05) -> LiveView:
    """Post events, run one frame of the window, and return its live view."""
    for event in events:
        pygame.event.post(event)
    window.run_frame(elapsed)
    assert isinstance(window.app_state.view, LiveView)
    return window.app_state.view
