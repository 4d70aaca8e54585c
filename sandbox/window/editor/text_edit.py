"""Text of one line with a caret and a selection, edited by keys, and how it is drawn."""

from dataclasses import dataclass
from typing import Literal

import pygame

from sandbox.window.render.palette import INK, PANEL_RAISED, SKY, RgbColour, mix_colours
from sandbox.window.render.text import draw_text, text_size

SELECTED: RgbColour = mix_colours(PANEL_RAISED, SKY, 0.45)


@dataclass
class TextEdit:
    """Text of a line with a caret and a selection. Positions are numbers of characters before them."""

    text: str
    caret: int = 0
    anchor: int = 0
    """other end of the selection; equal to the caret without one"""

    def select_all(self) -> None:
        """Select the whole text, with the caret at its end."""
        self.anchor, self.caret = 0, len(self.text)

    @property
    def selection(self) -> tuple[int, int]:
        """Start and end of the selection."""
        return min(self.caret, self.anchor), max(self.caret, self.anchor)

    def insert(self, text: str) -> None:
        """Replace the selection by a text."""
        start, end = self.selection
        text = "".join(letter for letter in text if letter.isprintable())
        self.text = self.text[:start] + text + self.text[end:]
        self.caret = self.anchor = start + len(text)

    def delete(self, step: Literal[-1, 1]) -> None:
        """Delete the selection or, without one, the character before (−1) or behind (1) the caret."""
        if self.caret == self.anchor:
            self.anchor = min(max(self.caret + step, 0), len(self.text))
        self.insert("")

    def move(self, position: int, is_selecting: bool) -> None:
        """Move the caret to a position, which is clamped; extend the selection or remove it."""
        self.caret = min(max(position, 0), len(self.text))
        if not is_selecting:
            self.anchor = self.caret

    def press(self, key: int, mod: int) -> bool:
        """Process a key; return whether it is used. Text comes as `TEXTINPUT` events."""
        is_selecting = bool(mod & pygame.KMOD_SHIFT)
        is_whole = bool(mod & (pygame.KMOD_CTRL | pygame.KMOD_META))
        start, end = self.selection
        has_selection = start != end and not is_selecting
        match key:
            case pygame.K_LEFT:
                self.move(0 if is_whole else start if has_selection else self.caret - 1, is_selecting)
            case pygame.K_RIGHT:
                self.move(len(self.text) if is_whole else end if has_selection else self.caret + 1, is_selecting)
            case pygame.K_HOME | pygame.K_UP:
                self.move(0, is_selecting)
            case pygame.K_END | pygame.K_DOWN:
                self.move(len(self.text), is_selecting)
            case pygame.K_BACKSPACE:
                self.delete(-1)
            case pygame.K_DELETE:
                self.delete(1)
            case pygame.K_a if is_whole:
                self.select_all()
            case _:
                return False
        return True


def draw_text_edit(surface: pygame.Surface, edit: TextEdit, area: pygame.Rect, size: float, shift: int = 0) -> int:
    """Draw a text with its selection and caret in an area, moved to the left so that the caret is in view.

    Args:
        surface: to draw on.
        edit: the text.
        area: px.
        size: of the font, px.
        shift: px by which the text was moved before; it stays if possible.

    Returns:
        px by which the text is moved.
    """

    def width(text: str) -> int:
        return text_size(text, size, mono=True)[0]

    line_width, caret = max(round(size / 12), 1), width(edit.text[: edit.caret])
    room = max(area.width - line_width, 1)
    shift = min(max(shift, caret - room), caret)
    shift = min(shift, max(width(edit.text) - room, 0))
    left, height, clip = area.left - shift, round(1.3 * size), surface.get_clip()
    surface.set_clip(area.inflate(2, 0).clip(clip))
    start, end = (width(edit.text[:position]) for position in edit.selection)
    top = area.centery - height // 2
    if start != end:
        pygame.draw.rect(surface, SELECTED, (left + start, top, end - start, height))
    draw_text(surface, edit.text, (left, area.centery), size, INK, "midleft", mono=True)
    pygame.draw.rect(surface, INK, (left + caret, top, line_width, height))
    surface.set_clip(clip)
    return shift
