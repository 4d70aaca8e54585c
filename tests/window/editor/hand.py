"""Mouse and keyboard of a user of the editor, with events as SDL sends them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pygame

from sandbox.scene.compile.scene import Scene
from sandbox.window.app import App
from sandbox.window.editor.edit_view import EditView
from sandbox.window.editor.editor import Editor
from tests.window.pressing import key, key_up, move, press, release, wheel

SIZE = (1280, 720)
CTRL, SHIFT = pygame.KMOD_CTRL, pygame.KMOD_SHIFT
Point = tuple[float, float]

BALL = """# two balls
[[plane]]
point = [0, 0]
normal = [0, 1]
[[ball]]
name = "a"
position = [0.0, 2.0]  # above
radius = 0.5
[[ball]]
name = "b"
position = [2.0, 2.0]
radius = 0.5
"""


class Hand:
    """Mouse and keyboard of a user in the editor; points in metres."""

    def __init__(self, window: App) -> None:
        self.window = window

    @property
    def path(self) -> Path:
        """File of the edited scene."""
        assert self.window.app_state.path is not None
        return self.window.app_state.path

    @property
    def view(self) -> EditView:
        assert self.window.editing is not None
        return self.window.editing

    @property
    def editor(self) -> Editor:
        return self.view.editor

    @property
    def scene(self) -> Scene:
        return self.view.draft.scene

    def frame(self, *events: pygame.event.Event) -> None:
        for event in events:
            pygame.event.post(event)
        self.window.run_frame(0.02)

    def pixel(self, point: Point) -> tuple[float, float]:
        x, y = self.window.context.camera.to_screen(np.asarray(point)).tolist()
        return x, y

    def key(self, code: int, mod: int = 0, text: str = "") -> None:
        text_event = [pygame.event.Event(pygame.TEXTINPUT, text=text)] if text else []
        self.frame(key(code, mod), *text_event, key_up(code))

    def type(self, text: str) -> None:
        for letter in text:
            self.key(pygame.key.key_code(letter), 0, letter)

    def click(self, *points: Point) -> None:
        for point in points:
            self.frame(move(*self.pixel(point)))
            self.frame(press(*self.pixel(point)), release(*self.pixel(point)))

    def drag(self, begin: Point, end: Point, steps: int = 3, is_released: bool = True) -> None:
        self.frame(move(*self.pixel(begin)), press(*self.pixel(begin)))
        for k in range(1, steps + 1):
            point = tuple(a + (b - a) * k / steps for a, b in zip(begin, end, strict=True))
            self.frame(move(*self.pixel((point[0], point[1])), held=True))
        if is_released:
            self.frame(release(*self.pixel(end)))

    def set_field(self, section: str, field: str, text: str) -> None:
        """Click a field of the property panel, type a value and press Enter."""
        box = self.in_view(lambda: self.view.panel.box_of(section, field))
        self.frame(press(*box.center), release(*box.center))
        self.key(pygame.K_a, CTRL)
        self.key(pygame.K_DELETE)
        for letter in text:
            self.frame(pygame.event.Event(pygame.TEXTINPUT, text=letter))
        self.key(pygame.K_RETURN)

    def in_view(self, rect_of: Callable[[], pygame.Rect | None]) -> pygame.Rect:
        """Turn the wheel until a rectangle of the property panel is in view, and return it."""
        self.frame()
        for _ in range(100):
            rect = rect_of()
            assert rect is not None, self.editor.selection
            if rect.top >= 0 and rect.bottom <= SIZE[1]:
                return rect
            self.frame(move(*rect.clamp(pygame.Rect(0, 0, *SIZE)).center), wheel(1 if rect.top < 0 else -1))
        raise AssertionError("it cannot be scrolled into view")

    def press_button(self, section: str) -> None:
        """Click the plus or the cross of a heading of the property panel."""
        button = self.in_view(lambda: self.view.panel.button_of(section))
        self.frame(press(*button.center), release(*button.center))
        self.frame()

    def save_as(self, path: Path, mod: int = 0) -> None:
        """Save a new scene, typing its name; with Shift, also a scene that has a file."""
        self.key(pygame.K_s, CTRL | mod)
        assert self.view.prompt is not None
        self.key(pygame.K_a, CTRL)
        for letter in str(path):
            self.frame(pygame.event.Event(pygame.TEXTINPUT, text=letter))
        self.key(pygame.K_RETURN)
        assert self.view.prompt is None

    def messages(self) -> str:
        """Return the messages that are shown, in one text."""
        return " ".join(text for _, text in self.window.app_state.messages.visible())

    def warnings(self) -> list[str]:
        """Return the warnings that are shown."""
        return [text for level, text in self.window.context.app_state.messages.visible() if level == "warning"]


OpenOn = Callable[..., Hand]
"""Function that opens a window on a scene and edits it; see the fixture `open_on`."""
