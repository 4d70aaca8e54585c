"""Property panel: the fields of tables of a scene file as rows that can be edited, at the right of the window.

Rows are positions and values, not widgets: a scene has hundreds of them, and only those in view are drawn.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import pygame

from sandbox.scene.editing.fields import format_value, parse
from sandbox.window.editor.property_rows import (
    DIMMED,
    TYPED_KINDS,
    VALUE_SIZE,
    FieldEdit,
    PropertyRow,
    PropertySection,
    RejectedInput,
    RowId,
    draw_choice,
    draw_flag,
    draw_heading_button,
    draw_swatch,
    draw_value_box,
    is_typed,
    shown_text,
    text_room,
)
from sandbox.window.render.palette import (
    FAINT,
    INK,
    LINE,
    WARNING,
)
from sandbox.window.render.text import draw_text, draw_text_lines, ellipsis, text_lines_width, text_size, wrap_text
from sandbox.window.ui.scroll_column import ScrollColumn
from sandbox.window.ui.text_edit import TextEdit, draw_text_edit

LABEL_SIZE, UNIT_SIZE, ERROR_SIZE, NOTE_SIZE = 12.0, 10.5, 11.0, 12.0
"""px at UI scale 1, font sizes"""
ROW_HEIGHT, BOX_HEIGHT, HEADING_HEIGHT, SECTION_GAP = 24, 20, 26, 8
"""px at UI scale 1"""
MAX_ERROR_LINES, MAX_NOTE_LINES = 5, 8
_ENTER_KEYS = (pygame.K_RETURN, pygame.K_KP_ENTER)


class PanelItem(NamedTuple):
    """Heading or row at its place in the content of the panel."""

    section: PropertySection
    row: PropertyRow | None
    """None for a heading"""
    top: int
    """px below the top of the content"""
    height: int
    """px, including the lines of an error"""
    error: tuple[str, ...] = ()

    @property
    def row_id(self) -> RowId:
        """Identity of the row; without a field for a heading."""
        return RowId(self.section.key, "" if self.row is None else self.row.spec.key)


class PropertyPanel(ScrollColumn):
    """Panel of fields. `show` sets its content, `on_change` reports the user's changes."""

    def __init__(self, size: tuple[int, int], ui_scale: float = 1.0) -> None:
        """Create an empty panel for a window of a size in px."""
        self.on_change: Callable[[str, str, Any], str | None] = _accept
        """(section key, field key, value; None removes the key); returns an error to be shown at the field, or None"""
        self.on_remove: Callable[[str], object] = _accept
        """(section key) called by the cross of a heading"""
        self.on_add: Callable[[str], object] = _accept
        """(section key) called by the plus of a heading"""
        super().__init__(size, ui_scale)
        self._sections: tuple[PropertySection, ...] = ()
        self._note = ""
        self._is_open: dict[str, bool] = {}
        """by the key of the section; remains when it is no longer shown"""
        self._editing: FieldEdit | None = None
        self._rejected: dict[RowId, RejectedInput] = {}
        self._items: tuple[PanelItem, ...] = ()
        self._note_lines: tuple[str, ...] = ()
        self._label_width = 0
        """px"""
        self._hovered: RowId | None = None
        self._is_selecting = False
        self.resize(size, ui_scale)

    @property
    def width(self) -> int:
        """Width that the panel covers at the right of the window, px."""
        return self.column_width

    @property
    def has_focus(self) -> bool:
        """Whether a field is edited as text, which takes the keyboard."""
        return self._editing is not None

    @property
    def focused(self) -> RowId | None:
        """Section and field that are edited as text."""
        return None if self._editing is None else self._editing.row

    def show(self, sections: Sequence[PropertySection], note: str = "") -> None:
        """Show sections, and a note above them. The editing of a field continues if it is still among them."""
        shown = tuple(sections)
        if shown == self._sections and note == self._note:
            return
        self._sections, self._note = shown, note
        for section in shown:
            self._is_open.setdefault(section.key, section.is_open)
        rows = {RowId(section.key, row.spec.key): row for section in shown for row in section.rows}
        if self._editing is not None:
            row = rows.get(self._editing.row)
            if row is None or not is_typed(row):
                self._end_editing()
        self._rejected = {
            key: rejected
            for key, rejected in self._rejected.items()
            if key in rows and (rows[key].value == rejected.value or self.focused == key)
        }
        self._lay_out()

    def is_open(self, section: str) -> bool:
        """Return whether a section is unfolded."""
        return self._is_open.get(section, True)

    # Layout

    def _px(self, length: float) -> int:
        return round(length * self.ui_scale)

    @property
    def _column(self) -> tuple[int, int]:
        """Left end and width of the rows, px; leaves room for the scroll bar, as in the side panel."""
        pad = self._px(14)
        return pad, max(self.width - 2 * pad - self._px(4), 1)

    def _lay_out(self) -> None:
        """Compute the places of all headings and rows."""
        width = self._column[1]
        self._note_lines = wrap_text(self._note, NOTE_SIZE * self.ui_scale, width, MAX_NOTE_LINES)
        y = self._px(12)
        if self._note_lines:
            y += len(self._note_lines) * self._note_step + self._px(8)
        items = []
        for section in self._sections:
            items.append(PanelItem(section, None, y, self._px(HEADING_HEIGHT)))
            y += self._px(HEADING_HEIGHT)
            if self.is_open(section.key):
                for row in section.rows:
                    rejected = self._rejected.get(RowId(section.key, row.spec.key))
                    error = () if rejected is None else self._wrapped_error(rejected.error)
                    height = self._px(ROW_HEIGHT) + (len(error) * self._error_step + self._px(4) if error else 0)
                    items.append(PanelItem(section, row, y, height, error))
                    y += height
                y += self._px(SECTION_GAP)
        self._items, self._height = tuple(items), y + self._px(6)
        labels = [item.row.spec.key for item in items if item.row is not None]
        widest = text_lines_width(labels, LABEL_SIZE * self.ui_scale)
        self._label_width = min(max(widest + self._px(8), round(0.36 * width)), round(0.53 * width))
        self._scroll_to(self._scroll)
        self._update_hover()

    @property
    def _note_step(self) -> int:
        return round(1.4 * NOTE_SIZE * self.ui_scale)

    @property
    def _error_step(self) -> int:
        return round(1.3 * ERROR_SIZE * self.ui_scale)

    def _wrapped_error(self, error: str) -> tuple[str, ...]:
        return wrap_text(error, ERROR_SIZE * self.ui_scale, self._column[1], MAX_ERROR_LINES)

    def _box(self, item: PanelItem) -> pygame.Rect:
        """Return the box of the value of a row on the sheet."""
        left, width = self._column
        height = self._px(BOX_HEIGHT)
        top = item.top - self._scroll + (self._px(ROW_HEIGHT) - height) // 2
        return pygame.Rect(left + self._label_width, top, max(width - self._label_width, 1), height)

    def box_of(self, section: str, field: str) -> pygame.Rect | None:
        """Return the box of a field's value in the window, px, which may be out of view; None if it is not shown."""
        item = self._item_of(RowId(section, field))
        return None if item is None else self._box(item).move(self.column_left, 0)

    def heading_of(self, section: str) -> pygame.Rect | None:
        """Return the rectangle of a heading in the window, px, which may be out of view; None if it is not shown."""
        item = self._item_of(RowId(section, ""))
        if item is None:
            return None
        left, width = self._column
        return pygame.Rect(self.column_left + left, item.top - self._scroll, width, item.height)

    def button_of(self, section: str) -> pygame.Rect | None:
        """Return the box of the button of a heading in the window, px, which may be out of view; None without one."""
        item = self._item_of(RowId(section, ""))
        if item is None or not item.section.button:
            return None
        return self._button(item).move(self.column_left, 0)

    def _button(self, item: PanelItem) -> pygame.Rect:
        """Return the box of the button of a heading on the sheet."""
        left, width = self._column
        side = min(self._px(BOX_HEIGHT), width)
        return pygame.Rect(left + width - side, item.top - self._scroll + (item.height - side) // 2, side, side)

    def _is_on_button(self, item: PanelItem, at: tuple[int, int]) -> bool:
        return item.row is None and bool(item.section.button) and bool(self._button(item).collidepoint(at))

    def _item_of(self, row_id: RowId) -> PanelItem | None:
        return next((item for item in self._items if item.row_id == row_id), None)

    def _item_at(self, at: tuple[int, int]) -> PanelItem | None:
        y = at[1] + self._scroll
        return next((item for item in self._items if item.top <= y < item.top + item.height), None)

    # Editing

    def commit(self) -> None:
        """End the editing of a field, applying it. A text that is not accepted stays at the field with its error."""
        if self._editing is not None:
            self._apply()
            self._end_editing()

    def _end_editing(self) -> None:
        self._editing, self._is_selecting, self._is_dirty = None, False, True

    def _start_editing(self, item: PanelItem) -> None:
        """Edit a field as text, selected as a whole; a rejected text is continued."""
        assert item.row is not None
        initial = "" if item.row.is_mixed else format_value(item.row.spec, item.row.value)
        rejected = self._rejected.get(item.row_id)
        text = initial if rejected is None or rejected.text is None else rejected.text
        self._editing = FieldEdit(item.row_id, TextEdit(text), initial)
        self._editing.edit.select_all()
        self._is_dirty = True
        self._scroll_into_view(item)

    def _scroll_into_view(self, item: PanelItem) -> None:
        if item.top < self._scroll:
            self._scroll_to(item.top - self._px(6))
        elif item.top + item.height > self._scroll + self.size[1]:
            self._scroll_to(item.top + item.height + self._px(6) - self.size[1])

    def _apply(self) -> bool:
        """Report the edited value if it differs; return whether it was accepted."""
        editing = self._editing
        item = None if editing is None else self._item_of(editing.row)
        if editing is None or item is None or item.row is None:
            return True
        row, text = item.row, editing.edit.text
        if text == editing.initial and not (row.is_mixed and editing.is_touched):
            return self._settle(editing.row, None)
        try:
            value = parse(row.spec, text)
        except ValueError as error:
            return self._settle(editing.row, RejectedInput(text, str(error), row.value))
        if not row.is_mixed and format_value(row.spec, value) == format_value(row.spec, row.value):
            return self._settle(editing.row, None)
        return self._report(item, value, text)

    def _report(self, item: PanelItem, value: Any, text: str | None) -> bool:
        """Report a value by the callback, which may show other content; return whether it was accepted."""
        assert item.row is not None
        error = self.on_change(item.section.key, item.row.spec.key, value)
        return self._settle(item.row_id, None if error is None else RejectedInput(text, error, item.row.value))

    def _settle(self, row_id: RowId, rejected: RejectedInput | None) -> bool:
        """Keep or remove the error of a row; return whether it has none. Errors of clicks end with any other input."""
        before = self._rejected
        self._rejected = {key: each for key, each in before.items() if key != row_id and each.text is not None}
        if rejected is not None:
            self._rejected[row_id] = rejected
        if before != self._rejected:
            self._lay_out()
            item = self._item_of(row_id)
            if item is not None and rejected is not None:
                self._scroll_into_view(item)
        return rejected is None

    def _cancel(self) -> None:
        """End the editing of a field without applying it."""
        if self._editing is not None:
            row_id = self._editing.row
            self._end_editing()
            self._settle(row_id, None)

    def _go(self, step: int) -> None:
        """Apply the edited field and edit the next (1) or previous (−1) one that is edited as text."""
        here = self.focused
        if here is None or not self._apply():
            return
        typed = [item for item in self._items if item.row is not None and is_typed(item.row)]
        self._end_editing()
        index = next((k for k, item in enumerate(typed) if item.row_id == here), None)
        if index is not None:
            self._start_editing(typed[(index + step) % len(typed)])

    def _cycle(self, item: PanelItem, step: int) -> None:
        """Set a check box or choice to its next (1) or previous (−1) value."""
        assert item.row is not None
        spec, row = item.row.spec, item.row
        values: list[Any] = [False, True] if spec.kind == "flag" else list(spec.choices)
        if spec.is_optional:
            values.insert(0, None)
        present = spec.default if row.value is None else row.value
        if row.is_mixed or present not in values:
            order = [True, False] if spec.kind == "flag" else list(spec.choices)
            value = order[0 if step > 0 else -1]
        else:
            value = values[(values.index(present) + step) % len(values)]
            if value == present:
                return
        self._report(item, value, None)

    # Events

    def handle_event(self, event: pygame.event.Event) -> bool:
        """Process an event; return whether it was consumed. Motion events are required: wheel events have no position.

        While a field is edited, keys are consumed, except function keys and shortcuts without a meaning for a text.
        """
        if event.type == pygame.KEYDOWN:
            return self._press_key(event)
        if event.type == pygame.TEXTINPUT:
            return self._type(event.text)
        return super().handle_event(event)

    def _handle_mouse(self, event: pygame.event.Event, at: tuple[int, int], is_ours: bool) -> None:
        """Process a mouse event; a press elsewhere ends the editing of a field."""
        if event.type == pygame.MOUSEMOTION:
            if not is_ours:
                self._pointer = None  # a drag of the scene does not highlight rows
            self._drag(at)
        elif event.type == pygame.MOUSEBUTTONDOWN and event.button <= 3:
            if is_ours:
                self._press(event.button, at)
            else:
                self.commit()
        elif event.type == pygame.MOUSEBUTTONUP and event.button == 1 and is_ours:
            self._is_bar_held = self._is_selecting = False
            self._is_dirty = True

    def release(self) -> None:
        """End a press or drag without a mouse event."""
        super().release()
        self._is_selecting = False
        self._update_hover()

    def _press_key(self, event: pygame.event.Event) -> bool:
        editing = self._editing
        if editing is None:
            return False
        self._is_dirty = True
        is_command = bool(event.mod & (pygame.KMOD_CTRL | pygame.KMOD_ALT | pygame.KMOD_META))
        if event.key == pygame.K_ESCAPE:
            self._cancel()
        elif event.key in _ENTER_KEYS and not is_command:
            if self._apply():
                self._end_editing()
        elif event.key == pygame.K_TAB and not is_command:
            self._go(-1 if event.mod & pygame.KMOD_SHIFT else 1)
        elif not editing.press(event) and (is_command or pygame.K_F1 <= event.key <= pygame.K_F12):
            return False
        return True

    def _type(self, text: str) -> bool:
        if self._editing is None:
            return False
        self._editing.edit.insert(text)
        self._editing.is_touched = self._is_dirty = True
        return True

    def _turn_wheel(self, notches: int) -> None:
        super()._turn_wheel(notches)
        self._update_hover()

    def _press(self, button: int, at: tuple[int, int]) -> None:
        """Process a press in the panel.

        Headings, check boxes and choices act at once: an error of the edited field, which the press applies, may move
        them away from the pointer before the release.
        """
        self._is_dirty = True
        item = self._item_at(at)
        is_on_box = item is not None and item.row is not None and bool(self._box(item).collidepoint(at))
        if item is not None and is_on_box and button == 1 and item.row_id == self.focused:
            self._place_caret(at[0], is_selecting=False)
            self._is_selecting = True
            return
        target = None if item is None else item.row_id
        self.commit()  # may change the content
        if button == 1 and self._is_on_bar(at):
            self._is_bar_held = True
            self._drag(at)
            return
        item = None if target is None else self._item_of(target)
        if item is None:
            return
        if self._is_on_button(item, at):
            if button == 1:
                (self.on_add if item.section.button == "add" else self.on_remove)(item.section.key)
        elif item.row is None:
            if button == 1:
                self._is_open[item.section.key] = not self.is_open(item.section.key)
                self._lay_out()
        elif is_on_box and item.row.spec.kind in ("flag", "choice"):
            if button in (1, 3):
                self._cycle(item, 1 if button == 1 else -1)
        elif is_on_box and button == 1 and is_typed(item.row):
            self._start_editing(item)

    def _drag(self, at: tuple[int, int]) -> None:
        """Scroll by the scroll bar, or extend the selection of the text."""
        if self._is_bar_held:
            self._drag_bar(at)
        elif self._is_selecting:
            self._place_caret(at[0], is_selecting=True)
        self._update_hover()

    def _update_hover(self) -> None:
        item = None if self._pointer is None else self._item_at(self._pointer)
        hovered = None if item is None else item.row_id
        self._is_dirty |= hovered != self._hovered
        self._hovered = hovered

    def _place_caret(self, x: int, is_selecting: bool) -> None:
        """Move the caret to the gap between characters that is nearest to a position on the sheet, px."""
        editing = self._editing
        item = None if editing is None else self._item_of(editing.row)
        if editing is None or item is None:
            return
        along = x - self._box(item).left - self._px(6) + editing.shift
        text = editing.edit.text
        nearest = min(range(len(text) + 1), key=lambda k: abs(self._value_width(text[:k]) - along))
        editing.edit.move(nearest, is_selecting)
        self._is_dirty = True

    def _value_width(self, text: str) -> int:
        return text_size(text, VALUE_SIZE * self.ui_scale, mono=True)[0]

    # Drawing

    def _hint(self) -> str:
        """Return the tooltip: at a label the description, after a truncated key; at a truncated value the whole."""
        row_id, pointer = self._hovered, self._pointer
        item = None if row_id is None else self._item_of(row_id)
        if pointer is None:
            return ""
        if item is not None and self._is_on_button(item, pointer):
            is_add = item.section.button == "add"
            return f"add a {item.section.key}" if is_add else f"remove {item.section.title}"
        if item is None or item.row is None or row_id == self.focused:
            return ""
        spec, box = item.row.spec, self._box(item)
        if pointer[0] < box.left:
            is_whole = self._label(spec.key) == spec.key
            return spec.description if is_whole else f"{spec.key}: {spec.description}"
        text = shown_text(item.row)[0]
        is_mono = spec.kind in TYPED_KINDS
        room = text_room(item.row, box, self.ui_scale)
        is_whole = text_size(text, VALUE_SIZE * self.ui_scale, mono=is_mono)[0] <= room
        return "" if spec.kind == "flag" or not box.collidepoint(pointer) or is_whole else f"{text} {spec.unit}".strip()

    def _label(self, key: str) -> str:
        return ellipsis(key, LABEL_SIZE * self.ui_scale, self._label_width - self._px(6))

    def _visible_items(self) -> Iterator[PanelItem]:
        for item in self._items:
            if item.top + item.height >= self._scroll and item.top <= self._scroll + self.size[1]:
                yield item

    def _draw_content(self, sheet: pygame.Surface) -> None:
        """Draw the note, and the visible headings and rows."""
        left = self._column[0]
        top = self._px(12) - self._scroll
        draw_text_lines(sheet, self._note_lines, (left, top), self._note_step, NOTE_SIZE * self.ui_scale, FAINT)
        for item in self._visible_items():
            if item.row is None:
                self._draw_heading(item)
            else:
                self._draw_row(item, item.row)

    def _draw_heading(self, item: PanelItem) -> None:
        """Draw a heading with a triangle that shows whether the section is unfolded."""
        sheet, ui_scale = self._sheet, self.ui_scale
        left, width = self._column
        y = item.top - self._scroll + item.height // 2
        colour = INK if item.row_id == self._hovered else FAINT
        r = 3.5 * ui_scale
        x = left + r
        if not item.section.rows:
            corners = []
        elif self.is_open(item.section.key):
            corners = [(x - r, y - 0.6 * r), (x + r, y - 0.6 * r), (x, y + 0.8 * r)]
        else:
            corners = [(x - 0.6 * r, y - r), (x - 0.6 * r, y + r), (x + 0.8 * r, y)]
        if corners:
            pygame.draw.polygon(sheet, colour, corners)
        # Titles contain names, which are case-sensitive, so that they are not in capitals as those of the side panel.
        start = left + (self._px(13) if corners else 0)
        size = 11.5 * ui_scale
        if item.section.button:
            width -= self._button(item).width
            draw_heading_button(sheet, self._button(item), item.section.button == "add", colour, ui_scale)
        title = ellipsis(item.section.title, size, width - self._px(30), bold=True)
        word = draw_text(sheet, title, (start, y), size, colour, "midleft", bold=True)
        if word.right + self._px(8) < left + width:
            pygame.draw.line(sheet, LINE, (word.right + self._px(8), y), (left + width, y), max(self._px(1), 1))

    def _draw_row(self, item: PanelItem, row: PropertyRow) -> None:
        sheet, left, box = self._sheet, self._column[0], self._box(item)
        rejected = self._rejected.get(item.row_id)
        is_set = row.value is not None or row.is_mixed or row.spec.is_required
        colour = INK if is_set else FAINT
        draw_text(sheet, self._label(row.spec.key), (left, box.centery), LABEL_SIZE * self.ui_scale, colour, "midleft")
        if row.spec.kind == "flag":
            draw_flag(sheet, box, row, item.row_id == self._hovered, self.ui_scale)
        elif row.spec.kind == "choice":
            draw_choice(sheet, box, row, item.row_id == self._hovered, self.ui_scale)
        else:
            self._draw_value(item, row, box)
        top = box.bottom + self._px(3)
        draw_text_lines(sheet, item.error, (left, top), self._error_step, ERROR_SIZE * self.ui_scale, WARNING)
        if rejected is not None:
            pygame.draw.rect(sheet, WARNING, box, max(self._px(1), 1), border_radius=self._px(3))

    def _draw_value(self, item: PanelItem, row: PropertyRow, box: pygame.Rect) -> None:
        """Draw the value of a field that is edited as text, or of one that cannot be edited."""
        sheet, size = self._sheet, VALUE_SIZE * self.ui_scale
        rejected, pad = self._rejected.get(item.row_id), self._px(6)
        text, colour = shown_text(row)
        if rejected is not None and rejected.text is not None:
            text, colour = rejected.text, INK
        if not is_typed(row):
            text = ellipsis(text, size, text_room(row, box, self.ui_scale))
            draw_text(sheet, text, (box.left + pad, box.centery), size, colour, "midleft")
            return
        is_edited = item.row_id == self.focused
        draw_value_box(sheet, box, item.row_id == self._hovered, is_edited, self.ui_scale)
        if is_edited:
            self._draw_edit(text, box.inflate(-2 * pad, 0))
            return
        unit, unit_size = row.spec.unit, UNIT_SIZE * self.ui_scale
        unit_width = text_size(unit, unit_size)[0] + self._px(5) if unit else 0
        room = text_room(row, box, self.ui_scale)
        if unit and self._value_width(text) + unit_width > room:
            unit_width = 0  # the number is more important than its unit, which the tooltip has too
        elif unit:
            draw_text(sheet, unit, (box.right - pad, box.centery), unit_size, DIMMED, "midright")
        text = ellipsis(text, size, room - unit_width, mono=True)
        x = box.left + pad
        if row.spec.pattern.startswith("^#") and re.search(row.spec.pattern, text):
            x += draw_swatch(sheet, box, text, self.ui_scale)
        draw_text(sheet, text, (x, box.centery), size, colour, "midleft", mono=True)

    def _draw_edit(self, placeholder: str, area: pygame.Rect) -> None:
        """Draw the edited text in an area; before anything is typed, a placeholder if it is empty."""
        editing, size = self._editing, VALUE_SIZE * self.ui_scale
        assert editing is not None
        if not editing.edit.text and not editing.is_touched:
            draw_text(self._sheet, placeholder, (area.left, area.centery), size, DIMMED, "midleft", mono=True)
        editing.shift = draw_text_edit(self._sheet, editing.edit, area, size, editing.shift)


def _accept(*_: object) -> None:
    """Accept a change, the default of the callback."""
