"""What is to be seen, and where: colours within regions, by the arithmetic of the camera and of the panel."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pygame

from sandbox.window.app import App
from sandbox.window.app_state import AppState
from sandbox.window.camera import Camera
from sandbox.window.render.palette import WARNING, RgbColour
from tests.driven.driving import SIZE, Shot

NEAR = 6
"""How far a channel may be from its colour: shading and antialiasing change what is beside an edge by more."""
HUD = pygame.Rect(10, 10, 360, 150)
"""Where the state of things is told."""
PICTURE = pygame.Rect(0, 0, 636, 566)
"""What neither the panel nor the timeline covers."""
ENGINE_ROW = pygame.Rect(12, 36, 330, 20)
ARENA = pygame.Rect(0, 165, 636, 235)
"""What words do not cover either: the state of things lies above, messages below."""
MESSAGES = pygame.Rect(0, 400, 636, 164)
STEP_ROW = pygame.Rect(12, 56, 330, 20)


class Laid(NamedTuple):
    """Where things lie in a window that shows a scene, px."""

    widgets: dict[str, pygame.Rect]
    camera: Camera


def laid_out(path: Path) -> Laid:
    """Return where a window of the usual size has its widgets and its camera, from one without a display."""
    stage = AppState()
    window = App(stage, size=SIZE, say=lambda _: None)
    try:
        assert stage.open(path)
        window.run_frame(0.0)
        left = SIZE[0] - window.context.gui.panel.width
        rects = {}
        for widget in window.context.gui.panel.widgets:
            name = widget.parameter.key if hasattr(widget, "parameter") else widget.name
            rects[name] = widget.rect.move(left, 0)
        return Laid(rects, window.context.camera)
    finally:
        window.close()


def mask(shot: Shot, colour: RgbColour, box: pygame.Rect = ARENA) -> "np.ndarray[tuple[int, int], np.dtype[np.bool_]]":
    """Tell which pixels of a region have a colour, (height, width)."""
    part = shot[box.top : box.bottom, box.left : box.right].astype(np.int16)
    return np.asarray((np.abs(part - np.asarray(colour)) <= NEAR).all(axis=2))


def paused(shot: Shot) -> bool:
    """Tell whether PAUSED is seen in red."""
    return count(shot, WARNING, HUD) > 60


def at(shot: Shot, place: tuple[float, float]) -> RgbColour:
    """Return the colour of a pixel."""
    red, green, blue = map(int, shot[round(place[1]), round(place[0])])
    return red, green, blue


def count(shot: Shot, colour: RgbColour, box: pygame.Rect = ARENA) -> int:
    """Return how many pixels of a region have a colour."""
    return int(mask(shot, colour, box).sum())


def middle(shot: Shot, colour: RgbColour, box: pygame.Rect = ARENA) -> tuple[float, float]:
    """Return the middle of all pixels of a colour in a region, px in the window; nan where there are none."""
    rows, columns = np.nonzero(mask(shot, colour, box))
    if not len(rows):
        return float("nan"), float("nan")
    return float(columns.mean()) + box.left + 0.5, float(rows.mean()) + box.top + 0.5


def near(a: tuple[float, float], b: tuple[float, float], within: float) -> bool:
    """Tell whether two places are no farther apart than so many px."""
    return bool(np.hypot(a[0] - b[0], a[1] - b[1]) <= within)


def on_screen(camera: Camera, place: tuple[float, float]) -> tuple[float, float]:
    """Return where a place, m, is seen, px."""
    x, y = camera.to_screen(np.asarray(place)).tolist()
    return x, y


def differ(a: Shot, b: Shot, box: pygame.Rect = ARENA) -> bool:
    """Tell whether two pictures differ in a region."""
    there = np.s_[box.top : box.bottom, box.left : box.right]
    return not np.array_equal(a[there], b[there])
