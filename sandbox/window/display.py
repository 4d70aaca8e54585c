"""Creation of the window, and the UI scale derived from the height of the display."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

import pygame

from sandbox.window.render.palette import BACKGROUND, INK, SKY

SIZE = (1280, 800)
MIN_SIZE = (160, 120)
MAX_DESKTOP_FRACTION = 0.9
"""largest fraction of the desktop that a new window covers"""
REFERENCE_HEIGHT = 1080
"""height of a display with UI scale 1, px"""


class NoDisplayError(Exception):
    """No display is available; `str()` gives the reason."""


def open_screen(size: tuple[int, int] | None, title: str) -> pygame.Surface:
    """Open the window.

    Args:
        size: px; by default derived from the desktop.
        title: title of the window.

    Raises:
        NoDisplayError: there is no display.
    """
    os.environ["SDL_VIDEO_X11_WMCLASS"] = "sandbox"  # on import, pygame sets it to the name of the script
    asked = "SDL_VIDEODRIVER" in os.environ
    try:
        with _silenced():
            pygame.display.init()
        pygame.font.init()
        if not asked and pygame.display.get_driver() in ("dummy", "offscreen"):
            raise pygame.error("no display found")
        surface = pygame.display.set_mode(size or _fitting(), pygame.RESIZABLE)
    except (pygame.error, NotImplementedError) as error:
        close_screen()
        raise NoDisplayError(f"cannot open a window: {str(error) or 'there is no display'}") from None
    pygame.display.set_caption(title, "sandbox")
    pygame.display.set_icon(_icon())
    pygame.key.set_repeat(350, 40)
    return surface


@contextmanager
def _silenced() -> Iterator[None]:
    """Redirect standard error while SDL probes for a display, as libraries used by SDL print to it."""
    try:
        kept = os.dup(2)
    except OSError:  # standard error is closed
        yield
        return
    hole = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(hole, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(hole)
        os.close(kept)


def close_screen() -> None:
    """Close the window."""
    pygame.quit()


def ui_scale() -> float:
    """Return the UI scale: display height / 1080 px, rounded to quarters, at least 1."""
    try:
        heights = [height for _, height in pygame.display.get_desktop_sizes()]
    except pygame.error:
        heights = []
    return max(round(4.0 * min(heights, default=REFERENCE_HEIGHT) / REFERENCE_HEIGHT) / 4.0, 1.0)


def _fitting() -> tuple[int, int]:
    desktops = pygame.display.get_desktop_sizes() or [SIZE]
    scale = ui_scale()
    width, height = (max(round(side * MAX_DESKTOP_FRACTION), 1) for side in desktops[0])
    return max(min(round(SIZE[0] * scale), width), MIN_SIZE[0]), max(min(round(SIZE[1] * scale), height), MIN_SIZE[1])


def _icon() -> pygame.Surface:
    """Return the window icon: a ball on a plane, with the ring of its ghost."""
    icon = pygame.Surface((64, 64), pygame.SRCALPHA)
    pygame.draw.rect(icon, BACKGROUND, icon.get_rect(), border_radius=12)
    pygame.draw.line(icon, INK, (8, 52), (56, 52), 4)
    pygame.draw.circle(icon, SKY, (28, 34), 16)
    pygame.draw.circle(icon, INK, (38, 26), 16, 3)
    return icon
