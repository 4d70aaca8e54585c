"""Rows of the property panel: a field with its value, its text and its editing, and how check boxes are drawn."""

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import pygame

from sandbox.scene.editing.fields import FieldSpec, format_value, summary
from sandbox.window.render.palette import (
    BACKGROUND,
    FAINT,
    INK,
    LINE,
    PANEL,
    PANEL_RAISED,
    SKY,
    RgbColour,
    mix_colours,
)
from sandbox.window.render.text import draw_text, ellipsis
from sandbox.window.ui.text_edit import TextEdit
from sandbox.window.ui.widgets import draw_check_box

VALUE_SIZE = 11.5
"""px at UI scale 1, font size of values"""
LEFT_OUT, MIXED = "–", "…"
"""Text of a field without a value, and of one whose values differ."""
DIMMED: RgbColour = mix_colours(FAINT, BACKGROUND, 0.15)
"""Colour of defaults and units."""
TYPED_KINDS = frozenset({"number", "integer", "text", "numbers", "name", "list", "either"})
"""Kinds of fields that are edited as text."""
MAX_SHOWN_ITEMS, MAX_EDITED_ITEMS = 8, 200
"""Longer lists are shown by their length, or are edited in the file or by their corners only."""


@dataclass(frozen=True)
class PropertyRow:
    """A field and its present value."""

    spec: FieldSpec
    value: Any
    """None if the key is left out; must not be changed in place"""
    is_mixed: bool = False
    """whether several elements are selected whose values differ"""


@dataclass(frozen=True)
class PropertySection:
    """Rows under a heading, such as those of one element."""

    title: str
    key: str
    """unique; passed to callbacks"""
    rows: tuple[PropertyRow, ...]
    is_open: bool = True
    """whether it is initially unfolded"""
    button: Literal["", "add", "remove"] = ""
    """button of its heading: a plus that adds a table of its kind, or a cross that removes what it shows"""


class RowId(NamedTuple):
    """Identity of a row: the keys of its section and of its field."""

    section: str
    field: str


@dataclass
class FieldEdit:
    """Editing of a field."""

    row: RowId
    edit: TextEdit
    initial: str
    """text before the editing, which need not be applied"""
    is_touched: bool = False
    """whether the user has typed or deleted something"""
    shift: int = 0
    """px by which the text is moved to the left, so that the caret is in the box"""

    def press(self, event: pygame.event.Event) -> bool:
        """Process the press of a key; return whether the text uses it.

        Raises:
            ClipboardError: the system gives no access to its clipboard. The text is unchanged.
        """
        before = self.edit.text
        if not self.edit.press(event):
            return False
        if event.key in (pygame.K_BACKSPACE, pygame.K_DELETE):
            self.is_touched = True
        elif self.edit.text != before:
            self.is_touched = self.edit.can_undo
        return True


@dataclass(frozen=True)
class RejectedInput:
    """Input that was not applied, and the reason."""

    text: str | None
    """typed text; None for check boxes and choices"""
    error: str
    value: Any
    """value of the field at that time"""


def is_typed(row: PropertyRow) -> bool:
    """Return whether the value of a row can be edited as text."""
    is_long = isinstance(row.value, list) and len(row.value) > MAX_EDITED_ITEMS
    return row.spec.kind in TYPED_KINDS and not is_long


def shown_text(row: PropertyRow) -> tuple[str, RgbColour]:
    """Return the text of a value and its colour; the default, dimmed, of a key that is left out."""
    if row.is_mixed:
        return MIXED, INK
    if row.value is not None:
        if isinstance(row.value, list) and len(row.value) > MAX_SHOWN_ITEMS:
            return summary(row.value), INK if is_typed(row) else FAINT
        return format_value(row.spec, row.value) or LEFT_OUT, INK
    return format_value(row.spec, row.spec.default) or LEFT_OUT, DIMMED


def text_room(row: PropertyRow, box: pygame.Rect, ui_scale: float) -> int:
    """Return the width of the text of a value in its box without the unit, px."""
    pad = round(6 * ui_scale)
    arrow = pad + 0.28 * VALUE_SIZE * ui_scale if row.spec.kind == "choice" else 0
    return round(box.width - 2 * pad - arrow)


def draw_value_box(sheet: pygame.Surface, box: pygame.Rect, is_hovered: bool, is_edited: bool, ui_scale: float) -> None:
    """Draw the box of a value."""
    radius = round(3 * ui_scale)
    pygame.draw.rect(sheet, BACKGROUND if is_edited else PANEL_RAISED, box, border_radius=radius)
    if is_edited or is_hovered:
        edge = SKY if is_edited else LINE
        pygame.draw.rect(sheet, edge, box, max(round(ui_scale), 1), border_radius=radius)


def draw_flag(sheet: pygame.Surface, box: pygame.Rect, row: PropertyRow, is_hovered: bool, ui_scale: float) -> None:
    """Draw the check box of a flag at the left of a box."""
    side = round(14 * ui_scale)
    value = row.spec.default if row.value is None else row.value
    is_on = bool(value) and not row.is_mixed
    is_default = row.value is None and not row.is_mixed
    square = pygame.Rect(box.left, box.centery - side // 2, side, side)
    draw_check_box(sheet, square, is_on, is_hovered, ui_scale, mix_colours(SKY, PANEL, 0.55) if is_default else SKY)
    if row.is_mixed or value is None:
        dash = pygame.Rect(0, 0, round(0.5 * side), max(round(2 * ui_scale), 1))
        dash.center = square.center
        pygame.draw.rect(sheet, INK if row.is_mixed else FAINT, dash)


def draw_choice(sheet: pygame.Surface, box: pygame.Rect, row: PropertyRow, is_hovered: bool, ui_scale: float) -> None:
    """Draw the value of a choice, with an arrow if there are others."""
    size, pad = VALUE_SIZE * ui_scale, round(6 * ui_scale)
    text, colour = shown_text(row)
    draw_value_box(sheet, box, is_hovered, False, ui_scale)
    text = ellipsis(text, size, text_room(row, box, ui_scale))
    draw_text(sheet, text, (box.left + pad, box.centery), size, colour, "midleft")
    if len(row.spec.choices) + row.spec.is_optional > 1:
        height = round(0.28 * size)
        x, y = box.right - pad, box.centery
        arrow = [(x - height, y - height), (x, y), (x - height, y + height)]
        pygame.draw.lines(sheet, SKY, False, arrow, max(round(1.6 * ui_scale), 1))


def draw_swatch(sheet: pygame.Surface, box: pygame.Rect, colour: str, ui_scale: float) -> int:
    """Draw a sample of a colour `#rrggbb` at the left of a box; return the width that it takes, px."""
    side, pad = round(11 * ui_scale), round(6 * ui_scale)
    sample = pygame.Rect(box.left + pad, box.centery - side // 2, side, side)
    pygame.draw.rect(sheet, pygame.Color(colour), sample, border_radius=round(2 * ui_scale))
    return side + pad


def draw_heading_button(
    sheet: pygame.Surface, box: pygame.Rect, is_plus: bool, colour: RgbColour, ui_scale: float
) -> None:
    """Draw the plus or the cross of a heading."""
    x, y = box.center
    arm, width = 3.5 * ui_scale, max(round(1.4 * ui_scale), 1)
    if is_plus:
        arm *= 1.3
        pygame.draw.line(sheet, colour, (x - arm, y), (x + arm, y), width)
        pygame.draw.line(sheet, colour, (x, y - arm), (x, y + arm), width)
        return
    pygame.draw.line(sheet, colour, (x - arm, y - arm), (x + arm, y + arm), width)
    pygame.draw.line(sheet, colour, (x - arm, y + arm), (x + arm, y - arm), width)
