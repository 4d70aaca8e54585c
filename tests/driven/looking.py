"""Queries of screenshots: colours within regions, located by the camera."""

from pathlib import Path

import numpy as np
import pygame

from sandbox.window.app import App
from sandbox.window.app_state import AppState
from sandbox.window.camera import Camera
from sandbox.window.render.palette import WARNING, RgbColour
from tests.driven.driving import SIZE, Shot

CHANNEL_TOLERANCE = 6
"""Largest difference of a channel from its colour: shading and antialiasing change pixels beside an edge by more."""
HUD = pygame.Rect(10, 10, 360, 150)
"""Region of the state display, px."""
ARENA = pygame.Rect(0, 165, 636, 195)
"""Region that text does not cover either, px: the state display is above it, messages are below."""
MESSAGES = pygame.Rect(0, 360, 636, 204)


def window_camera(path: Path) -> Camera:
    """Return the camera of a window of the default size that shows a scene, computed without a display."""
    state = AppState()
    window = App(state, size=SIZE, say=lambda _: None)
    try:
        assert state.open(path)
        window.run_frame(0.0)
        return window.context.camera
    finally:
        window.close()


def mask(shot: Shot, colour: RgbColour, box: pygame.Rect = ARENA) -> "np.ndarray[tuple[int, int], np.dtype[np.bool_]]":
    """Return which pixels of a region have a colour, (height, width)."""
    part = shot[box.top : box.bottom, box.left : box.right].astype(np.int16)
    return np.asarray((np.abs(part - np.asarray(colour)) <= CHANNEL_TOLERANCE).all(axis=2))


def shows_paused(shot: Shot) -> bool:
    """Return whether the state display shows PAUSED in red."""
    return count_pixels(shot, WARNING, HUD) > 60


def colour_at(shot: Shot, point: tuple[float, float]) -> RgbColour:
    """Return the colour of a pixel."""
    red, green, blue = map(int, shot[round(point[1]), round(point[0])])
    return red, green, blue


def count_pixels(shot: Shot, colour: RgbColour, box: pygame.Rect = ARENA) -> int:
    """Return how many pixels of a region have a colour."""
    return int(mask(shot, colour, box).sum())


def centroid(shot: Shot, colour: RgbColour, box: pygame.Rect = ARENA) -> tuple[float, float]:
    """Return the centroid of all pixels of a colour in a region, px in the window; nan if there are none."""
    rows, columns = np.nonzero(mask(shot, colour, box))
    if not len(rows):
        return float("nan"), float("nan")
    return float(columns.mean()) + box.left + 0.5, float(rows.mean()) + box.top + 0.5


def is_near(a: tuple[float, float], b: tuple[float, float], within: float) -> bool:
    """Return whether two points are at most `within` px apart."""
    return bool(np.hypot(a[0] - b[0], a[1] - b[1]) <= within)


def on_screen(camera: Camera, point: tuple[float, float]) -> tuple[float, float]:
    """Return the position on the screen, px, of a point in the scene, m."""
    x, y = camera.to_screen(np.asarray(point)).tolist()
    return x, y


def are_different(a: Shot, b: Shot, box: pygame.Rect = ARENA) -> bool:
    """Return whether two screenshots differ in a region."""
    region = np.s_[box.top : box.bottom, box.left : box.right]
    return not np.array_equal(a[region], b[region])
