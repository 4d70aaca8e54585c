"""A window without a display, on a scene given as text."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pygame

from sandbox.play.running.live import Live
from sandbox.play.stage import Stage
from sandbox.play.window import Window


@contextmanager
def window_on(text: str, folder: Path, size: tuple[int, int] = (640, 480)) -> Iterator[Window]:
    """Open a window on a scene, and close it in the end."""
    file = folder / "scene.toml"
    file.write_text(text, encoding="utf-8")
    stage = Stage()
    stage.take(file)
    opened = Window(stage, size=size, folder=folder, say=lambda _: None)
    try:
        yield opened
    finally:
        opened.close()


def turned(window: Window, *events: pygame.event.Event, elapsed: float = 0.05) -> Live:
    """Post events, let the window make one turn, and return what is live in it."""
    for event in events:
        pygame.event.post(event)
    window.turn(elapsed)
    assert isinstance(window.stage.show, Live)
    return window.stage.show
