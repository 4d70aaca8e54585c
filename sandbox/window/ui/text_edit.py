"""Text of one line with a caret, a selection and a history, edited by keys, and how it is drawn."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import pygame

from sandbox.window.input.clipboard import copy_text, pasted_text
from sandbox.window.input.keymap import latin_key
from sandbox.window.render.palette import INK, PANEL_RAISED, SKY, RgbColour, mix_colours
from sandbox.window.render.text import draw_text, text_size

SELECTED: RgbColour = mix_colours(PANEL_RAISED, SKY, 0.45)
SHORTCUTS = frozenset({pygame.K_a, pygame.K_x, pygame.K_c, pygame.K_v, pygame.K_z, pygame.K_y})
"""Keys that, with Ctrl, select, cut, copy, paste, undo and redo"""


def printable(text: str) -> str:
    """Return the characters of a text that can be shown."""
    return "".join(letter for letter in text if letter.isprintable())


def is_text_shortcut(event: pygame.event.Event) -> bool:
    """Return whether a key press edits a text by Ctrl, or Cmd on a Mac. Ctrl+Alt may be AltGr, which types."""
    if event.type != pygame.KEYDOWN or event.mod & (pygame.KMOD_ALT | pygame.KMOD_MODE):
        return False
    return bool(event.mod & (pygame.KMOD_CTRL | pygame.KMOD_META)) and latin_key(event) in SHORTCUTS


class TextState(NamedTuple):
    """A text with its caret and selection, as `TextEdit.undo` restores it."""

    text: str
    caret: int
    anchor: int


@dataclass
class TextEdit:
    """Text of a line with a caret and a selection. Positions are numbers of characters before them."""

    text: str
    caret: int = 0
    anchor: int = 0
    """other end of the selection; equal to the caret without one"""
    clean: Callable[[str], str] = printable
    """returns what may be inserted of a text"""
    max_length: int | None = None
    """number of characters above which more are not inserted"""
    _past: list[TextState] = field(default_factory=list)
    _future: list[TextState] = field(default_factory=list)
    _last: Literal["typed", "deleted", ""] = ""  # kind of the last change; further ones of it are undone with it

    def select_all(self) -> None:
        """Select the whole text, with the caret at its end."""
        self.anchor, self.caret, self._last = 0, len(self.text), ""

    @property
    def selection(self) -> tuple[int, int]:
        """Start and end of the selection."""
        return min(self.caret, self.anchor), max(self.caret, self.anchor)

    @property
    def selected_text(self) -> str:
        """Text of the selection."""
        start, end = self.selection
        return self.text[start:end]

    def insert(self, text: str) -> None:
        """Replace the selection by a text. Letters that are typed one after the other are undone together."""
        text = self.clean(text)
        if self.max_length is not None:
            text = text[: max(self.max_length - len(self.text) + len(self.selected_text), 0)]
        if text or self.selected_text:
            self._replace(text, "typed" if len(text) == 1 else "")

    def delete(self, step: Literal[-1, 1]) -> None:
        """Delete the selection or, without one, the character before (−1) or behind (1) the caret."""
        anchor = self.anchor
        if self.caret == self.anchor:
            self.anchor = min(max(self.caret + step, 0), len(self.text))
        if self.selected_text:
            self._replace("", "deleted", anchor)

    def _replace(self, text: str, kind: Literal["typed", "deleted", ""], anchor: int | None = None) -> None:
        """Replace the selection, and keep the state before, whose anchor may be another one."""
        start, end = self.selection
        before = TextState(self.text, self.caret, self.anchor if anchor is None else anchor)
        if not kind or kind != self._last or before.caret != before.anchor:
            self._past.append(before)
        self._future.clear()
        self.text = self.text[:start] + text + self.text[end:]
        self.caret = self.anchor = start + len(text)
        self._last = kind

    @property
    def can_undo(self) -> bool:
        """Whether the text was changed, and the change is not undone."""
        return bool(self._past)

    def undo(self) -> None:
        """Undo the last change, if any."""
        self._restore(self._past, self._future)

    def redo(self) -> None:
        """Do the last undone change again, if any."""
        self._restore(self._future, self._past)

    def _restore(self, source: list[TextState], other: list[TextState]) -> None:
        if source:
            other.append(TextState(self.text, self.caret, self.anchor))
            self.text, self.caret, self.anchor = source.pop()
        self._last = ""

    def move(self, position: int, is_selecting: bool) -> None:
        """Move the caret to a position, which is clamped; extend the selection or remove it."""
        self.caret, self._last = min(max(position, 0), len(self.text)), ""
        if not is_selecting:
            self.anchor = self.caret

    def press(self, event: pygame.event.Event) -> bool:
        """Process the press of a key; return whether it is used. Text comes as `TEXTINPUT` events.

        Raises:
            ClipboardError: the system gives no access to its clipboard. The text is unchanged.
        """
        if is_text_shortcut(event):
            self._press_shortcut(latin_key(event), bool(event.mod & pygame.KMOD_SHIFT))
            return True
        is_selecting = bool(event.mod & pygame.KMOD_SHIFT)
        is_whole = bool(event.mod & (pygame.KMOD_CTRL | pygame.KMOD_META))
        start, end = self.selection
        has_selection = start != end and not is_selecting
        match event.key:
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
            case _:
                return False
        return True

    def _press_shortcut(self, key: int, shift: bool) -> None:
        """Run one of `SHORTCUTS`."""
        if key == pygame.K_a:
            self.select_all()
        elif key == pygame.K_z:
            (self.redo if shift else self.undo)()
        elif key == pygame.K_y:
            self.redo()
        elif key == pygame.K_v:
            self.insert(pasted_text())
            self._last = ""
        elif self.selected_text:
            copy_text(self.selected_text)
            if key == pygame.K_x:
                self._replace("", "")


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
