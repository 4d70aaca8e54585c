"""A window without a display, on a scene given as text."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pygame

from sandbox.window.app import App
from sandbox.window.app_state import AppState
from sandbox.window.playback.live import LiveView


@contextmanager
def window_on(text: str, folder: Path, size: tuple[int, int] = (640, 480)) -> Iterator[App]:
    """Open a window on a scene, and close it in the end."""
    file = folder / "scene.toml"
    file.write_text(text, encoding="utf-8")
    stage = AppState()
    stage.open_other(file)
    opened = App(stage, size=size, folder=folder, say=lambda _: None)
    try:
        yield opened
    finally:
        opened.close()


def turned(window: App, *events: pygame.event.Event, elapsed: float = 0.05) -> LiveView:
    """Post events, let the window make one turn, and return what is live in it."""
    for event in events:
        pygame.event.post(event)
    window.run_frame(elapsed)
    assert isinstance(window.app_state.view, LiveView)
    return window.app_state.view
