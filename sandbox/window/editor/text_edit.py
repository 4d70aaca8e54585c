"""Text of one line with a caret and a selection, edited by keys."""

from dataclasses import dataclass
from typing import Literal

import pygame


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
