"""Film of the editor: a car, a heap of boxes, a ball on a rope and a thrown one are drawn, and then run."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pygame
from PIL import Image

from sandbox.window.app import App
from sandbox.window.app_state import AppState, Messages

from .files import image_of, save_gif

SIZE = (1280, 720)
FILM = (656, 369)
FPS = 12.5
POINTER = [(0, 0), (0, 19), (4.5, 15), (7.5, 22), (10.5, 20.5), (7.6, 14), (13, 13.5)]
"""px, outline of the pointer, which a surface does not show"""
Place = tuple[float, float]


class _Hand:
    """Moves the pointer of a window smoothly, presses buttons and keys, and films the window."""

    def __init__(self, window: App) -> None:
        self.window, self.frames = window, list[Image.Image]()
        self.at: Place = (640.0, 250.0)

    def film(self, count: int = 1, elapsed: float = 1.0 / FPS) -> None:
        """Run and record some frames."""
        for _ in range(count):
            self.window.run_frame(elapsed)
            surface = self.window.context.surface.copy()
            outline = [(self.at[0] + x, self.at[1] + y) for x, y in POINTER]
            pygame.draw.polygon(surface, (255, 255, 255), outline)
            pygame.draw.polygon(surface, (0, 0, 0), outline, 1)
            self.frames.append(image_of(surface).resize(FILM, Image.Resampling.LANCZOS))

    def pixel(self, point: Place) -> Place:
        """Return the pixel of a point, m."""
        x, y = self.window.context.camera.to_screen(np.asarray(point)).tolist()
        return x, y

    def go(self, pixel: Place, frames: int, is_held: bool = False) -> None:
        """Move the pointer to a pixel."""
        start = self.at
        for k in range(1, frames + 1):
            part = k / frames
            part = part * part * (3.0 - 2.0 * part)
            self.at = tuple(a + (b - a) * part for a, b in zip(start, pixel, strict=True))  # type: ignore[assignment]
            place = round(self.at[0]), round(self.at[1])
            buttons = (int(is_held), 0, 0)
            pygame.event.post(pygame.event.Event(pygame.MOUSEMOTION, pos=place, rel=(0, 0), buttons=buttons))
            self.film()

    def button(self, kind: int) -> None:
        """Press or release the left button."""
        place = round(self.at[0]), round(self.at[1])
        pygame.event.post(pygame.event.Event(kind, pos=place, button=1))

    def click(self, pixel: Place, frames: int = 5) -> None:
        """Click a pixel."""
        self.go(pixel, frames)
        self.button(pygame.MOUSEBUTTONDOWN)
        self.button(pygame.MOUSEBUTTONUP)
        self.film()

    def drag(self, begin: Place, end: Place, frames: int = 6) -> None:
        """Drag from one point to another, m."""
        self.go(self.pixel(begin), 5)
        self.button(pygame.MOUSEBUTTONDOWN)
        self.go(self.pixel(end), frames, is_held=True)
        self.button(pygame.MOUSEBUTTONUP)
        self.film(2)

    def key(self, code: int, mod: int = 0) -> None:
        """Press a key."""
        for kind in (pygame.KEYDOWN, pygame.KEYUP):
            pygame.event.post(pygame.event.Event(kind, key=code, mod=mod, unicode="", scancode=0))

    def choose(self, tool: str) -> None:
        """Click the button of a tool."""
        editing = self.window.editing
        assert editing is not None
        self.click(editing.toolbar.rect_of(tool).center, 5)


def make(path: Path) -> None:
    """Draw the scene, run it, return to it, and film all of it."""
    with tempfile.TemporaryDirectory() as folder:  # of autosaves
        _make(path, Path(folder))


def _make(path: Path, folder: Path) -> None:
    window = App(AppState(), size=SIZE, folder=folder, say=lambda _: None)
    window.start_editing()
    window.app_state.messages = Messages()
    window.run_frame(1.0 / FPS)  # lays out the toolbar
    hand = _Hand(window)
    hand.choose("box")
    hand.drag((-4.5, 0.6), (-2.5, 1.0))
    hand.choose("ball")
    hand.drag((-4.1, 0.5), (-3.7, 0.5))
    hand.drag((-2.9, 0.5), (-2.5, 0.5))
    hand.choose("motor")
    hand.click(hand.pixel((-4.1, 0.75)))
    hand.click(hand.pixel((-2.9, 0.75)))
    hand.choose("box")
    hand.drag((0.5, 0.0), (1.0, 0.4), 4)
    hand.choose("select")
    for row, (x, y) in enumerate(((1.3, 0.2), (1.0, 0.6))):
        hand.click(hand.pixel((0.7, 0.2)), 4)
        hand.key(pygame.K_d, pygame.KMOD_CTRL)
        hand.film(2)
        assert window.editing is not None
        box = window.editing.draft.scene.boxes[row + 2].position
        hand.drag(box, (x, y), 5)
    _set_friction(hand)
    _hang_a_ball(hand)
    _throw_a_ball(hand)
    hand.film(6)
    hand.key(pygame.K_SPACE)
    hand.film(80)
    hand.key(pygame.K_e, pygame.KMOD_CTRL)
    hand.film(16)
    window.close()
    save_gif(hand.frames, path, FPS, 40, 0.8)


def _set_friction(hand: _Hand) -> None:
    """Select the wheels with a rubber band, and type their friction into the panel."""
    hand.drag((-5.0, -0.4), (-2.2, 0.95), 6)
    editing = hand.window.editing
    assert editing is not None
    hand.film(2)
    field = editing.panel.box_of("selection:ball", "friction")
    assert field is not None
    hand.click(field.center, 7)
    hand.key(pygame.K_a, pygame.KMOD_CTRL)
    _type(hand, "1")
    hand.key(pygame.K_RETURN)
    hand.film(3)


def _hang_a_ball(hand: _Hand) -> None:
    """Draw a ball that hangs from a rope."""
    hand.choose("ball")
    hand.drag((3.4, 2.6), (3.75, 2.6))
    hand.choose("rope")
    hand.click(hand.pixel((3.4, 2.6)))
    hand.click(hand.pixel((2.4, 4.2)))
    hand.film(4)


def _throw_a_ball(hand: _Hand) -> None:
    """Draw a ball, and drag the arrow of its velocity, while its path is shown."""
    hand.choose("ball")
    hand.drag((-1.6, 2.0), (-1.3, 2.0))
    hand.choose("select")
    editing = hand.window.editing
    assert editing is not None
    hand.film(2)
    handles = editing.editor.handles(editing.view_scale)
    tip = next(handle.point for handle in handles if handle.kind == "velocity")
    hand.drag(tip, (-0.9, 2.6), 16)
    hand.film(6)


def _type(hand: _Hand, text: Sequence[str]) -> None:
    for letter in text:
        pygame.event.post(pygame.event.Event(pygame.TEXTINPUT, text=letter))
        hand.film(2)
