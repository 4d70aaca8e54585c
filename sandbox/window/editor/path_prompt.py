"""Prompt for the file that a scene is saved as."""

from pathlib import Path

import pygame

from sandbox.window.render.palette import FAINT, INK, PANEL_RAISED, SKY, WARNING
from sandbox.window.render.text import draw_box, draw_text, wrap_text
from sandbox.window.ui.text_edit import TextEdit, draw_text_edit

PROMPT_WIDTH = 520
"""px at UI scale 1"""


class PathPrompt:
    """Asks for a path. `handle_event` returns it once it is entered."""

    def __init__(self, path: Path) -> None:
        self._edit = TextEdit(str(path))
        stem = len(str(path)) - len(path.suffix)
        self._edit.anchor, self._edit.caret = stem - len(path.stem), stem  # typing replaces the name
        self._asked: Path | None = None
        self._shift = 0  # px by which the text is moved to the left
        self.note = ""
        """question or fault that is shown below the field"""
        self.is_closed = False

    def handle_event(self, event: pygame.event.Event) -> Path | None:
        """Process an event of the keyboard; return the path when Enter is pressed."""
        if event.type == pygame.TEXTINPUT:
            self._edit.insert(event.text)
        elif event.type == pygame.KEYDOWN:
            if event.key == pygame.K_ESCAPE:
                self.is_closed = True
            elif event.key in (pygame.K_RETURN, pygame.K_KP_ENTER):
                return self._path()
            else:
                self._edit.press(event)
        return None

    def _path(self) -> Path | None:
        """Return the path, with `.toml` added; None if it is empty, or if an existing file must be confirmed."""
        text = self._edit.text.strip()
        if not text:
            self.note = "type the name of a file, such as my-scene.toml"
            return None
        try:
            path = Path(text).expanduser()
        except RuntimeError:  # there is no such user
            path = Path(text)
        if not path.name:
            self.note = f"{text} is a folder; give the name of a file"
            return None
        if path.suffix.lower() != ".toml":
            path = path.with_name(f"{path.name}.toml")
        try:
            exists = path.exists()
        except OSError:  # reported when it is written
            exists = False
        if exists and path != self._asked:
            self._asked, self.note = path, f"{path.name} exists; Enter again replaces it"
            return None
        return path

    def draw(self, surface: pygame.Surface, ui_scale: float) -> None:
        """Draw the prompt in the middle of the window."""
        size = 13.5 * ui_scale
        lines = wrap_text(self.note, size, (PROMPT_WIDTH - 40) * ui_scale, 3) if self.note else []
        width = min(round(PROMPT_WIDTH * ui_scale), surface.get_width() - 20)
        rect = pygame.Rect(0, 0, width, round((96 + 20 * len(lines)) * ui_scale))
        rect.center = surface.get_rect().center
        draw_box(surface, rect, 8 * ui_scale, opacity=248, edge=SKY)
        left, top = rect.left + 18 * ui_scale, rect.top + 14 * ui_scale
        draw_text(surface, "Save the scene as", (left, top), size, INK, bold=True)
        draw_text(
            surface, "Enter: save · Esc: cancel", (rect.right - 18 * ui_scale, top), 0.85 * size, FAINT, "topright"
        )
        field = pygame.Rect(
            round(left), round(top + 26 * ui_scale), round(rect.width - 36 * ui_scale), round(28 * ui_scale)
        )
        pygame.draw.rect(surface, PANEL_RAISED, field, border_radius=round(4 * ui_scale))
        inner = field.inflate(-round(0.8 * size), 0)
        self._shift = draw_text_edit(surface, self._edit, inner, size, self._shift)
        for k, line in enumerate(lines):
            draw_text(surface, line, (left, field.bottom + (8 + 20 * k) * ui_scale), size, WARNING)
