"""Side panel: a column of buttons, parameters and check boxes at the right of the window, and its layout.

User actions are reported through three callbacks; the panel does not know their effect.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import pygame

from sandbox.window.input.keymap import Command
from sandbox.window.playback.parameters import Parameter, ParameterValue
from sandbox.window.render.palette import FAINT, LINE
from sandbox.window.render.text import draw_text
from sandbox.window.ui.scroll_column import COLUMN_WIDTH, ScrollColumn
from sandbox.window.ui.widgets import (
    Checkbox,
    OptionButton,
    ParameterSlider,
    ParameterWidget,
    PushButton,
    Widget,
    WidgetEvent,
)


class PanelButton(NamedTuple):
    """Button of the panel."""

    command: Command
    about: str
    """tooltip, without the key"""

    @property
    def hint(self) -> str:
        """Tooltip of the button."""
        return f"{self.about} ({self.command.label})"


BUTTONS = {
    "play": PanelButton(Command.PAUSE, "Resume"),
    "pause": PanelButton(Command.PAUSE, "Pause"),
    "back": PanelButton(Command.BACK, "Step back"),
    "step": PanelButton(Command.STEP, "Step forward"),
    "restart": PanelButton(Command.RESTART, "Restart"),
    "camera": PanelButton(Command.SCREENSHOT, "Screenshot"),
    "record": PanelButton(Command.RECORD, "Record"),
    "stop": PanelButton(Command.RECORD, "Stop recording"),
    "save": PanelButton(Command.SAVE, "Save the session"),
    "edit": PanelButton(Command.EDIT, "Edit the scene"),
    "picker": PanelButton(Command.PICKER, "Open a scene"),
    "help": PanelButton(Command.HELP, "Help"),
}
"""Buttons by their icons, in the order of the panel, which shows either `play` or `pause`, and `record` or `stop`."""


class PanelHeading(NamedTuple):
    """Heading of a panel section."""

    text: str
    top: int
    """px below the top of the content"""


class PanelLayout(NamedTuple):
    """Positions of all widgets relative to the upper left corner of the content, px."""

    rects: tuple[tuple[Widget, pygame.Rect], ...]
    """from top to bottom"""
    headings: tuple[PanelHeading, ...]
    height: int


def arrange_widgets(
    buttons: Sequence[PushButton],
    parameter_widgets: Sequence[ParameterWidget],
    checkboxes: Sequence[Checkbox],
    width: int,
    ui_scale: float,
) -> PanelLayout:
    """Lay out widgets in a column: buttons, parameters, then check boxes, which form two columns if they fit."""
    pad = round(14 * ui_scale)
    column = pygame.Rect(pad, pad, max(width - 2 * pad - round(4 * ui_scale), 1), 0)
    rects: list[tuple[Widget, pygame.Rect]] = []
    headings: list[PanelHeading] = []
    y = pad
    if buttons:
        y = _layout_buttons(buttons, column, y, ui_scale, rects) + round(8 * ui_scale)
    if parameter_widgets:
        headings.append(PanelHeading("Settings", y))
        y += round(24 * ui_scale)
        for widget in parameter_widgets:
            height = round((27 if isinstance(widget, OptionButton) else 38) * ui_scale)
            rects.append((widget, pygame.Rect(column.left, y, column.width, height - round(4 * ui_scale))))
            y += height
        y += round(8 * ui_scale)
    if checkboxes:
        headings.append(PanelHeading("Show", y))
        y = _layout_checkboxes(checkboxes, column, y + round(24 * ui_scale), ui_scale, rects)
    return PanelLayout(tuple(rects), tuple(headings), y + pad // 2)


def _layout_buttons(
    buttons: Sequence[PushButton],
    column: pygame.Rect,
    y: int,
    ui_scale: float,
    rects: list[tuple[Widget, pygame.Rect]],
) -> int:
    """Lay out buttons in the fewest rows of equal length; return the y below them."""
    min_width, gap, height = round(30 * ui_scale), round(5 * ui_scale), round(32 * ui_scale)
    max_per_row = max((column.width + gap) // (min_width + gap), 1)
    rows = -(-len(buttons) // max_per_row)
    per_row = -(-len(buttons) // rows)
    button_width = (column.width + gap) / per_row - gap
    for k, button in enumerate(buttons):
        row, index = divmod(k, per_row)
        left = column.left + round(index * (button_width + gap))
        rects.append((button, pygame.Rect(left, y + row * (height + gap), max(round(button_width), 1), height)))
    return y + rows * (height + gap)


def _layout_checkboxes(
    checkboxes: Sequence[Checkbox],
    column: pygame.Rect,
    y: int,
    ui_scale: float,
    rects: list[tuple[Widget, pygame.Rect]],
) -> int:
    """Lay out check boxes in columns, filled downwards; return the y below them."""
    gap, height = round(14 * ui_scale), round(23 * ui_scale)
    columns = 2 if column.width >= 200 * ui_scale else 1
    width = max((column.width - (columns - 1) * gap) // columns, 1)
    rows = -(-len(checkboxes) // columns)
    for k, checkbox in enumerate(checkboxes):
        index, row = divmod(k, rows)
        rects.append((checkbox, pygame.Rect(column.left + index * (width + gap), y + row * height, width, height)))
    return y + rows * height


FOLD_WIDTH_FRACTION = 0.45
"""fraction of the window's width above which the panel is initially hidden"""

_LABELS = {"trust": "horizon", "antialias": "antialiasing"}
"""labels that differ from the name"""


class SidePanel(ScrollColumn):
    """Column of widgets. `show` sets its content; callbacks report user actions."""

    def __init__(self, size: tuple[int, int], ui_scale: float = 1.0) -> None:
        """Create an empty panel for a window of a size in px."""
        self.on_change: Callable[[str, ParameterValue, bool], None] = _ignore
        """(key, value, final); values of integer parameters are floats too"""
        self.on_toggle: Callable[[str, bool], None] = _ignore
        self.on_button: Callable[[Command], None] = _ignore
        super().__init__(size, ui_scale)
        self._visible: bool | None = None  # set by the user; None: shown unless the window is small
        self._parameter_widgets: dict[str, ParameterWidget] = {}
        self._checkboxes: dict[str, Checkbox] = {}
        self._buttons: list[PushButton] = []
        self._layout = PanelLayout((), (), 0)
        self._drawn_state: tuple[object, ...] = ()
        """all values that the cached drawing depends on"""
        self.used = True
        """whether an event or a resize may have changed a widget, so that `show` is required; reset by the owner"""
        self.resize(size, ui_scale)

    @property
    def width(self) -> int:
        """Width that the panel covers at the right of the window, px; 0 while hidden."""
        return self.column_width if self.visible else 0

    @property
    def visible(self) -> bool:
        """Whether the panel is shown; in a small window it is hidden until the user shows it.

        Hiding the panel ends a drag.
        """
        if self._visible is not None:
            return self._visible
        return round(COLUMN_WIDTH * self.ui_scale) <= FOLD_WIDTH_FRACTION * self.size[0]

    @visible.setter
    def visible(self, visible: bool) -> None:
        self._visible = visible
        if not visible:
            self.release()

    @property
    def widgets(self) -> tuple[Widget, ...]:
        """All widgets, from top to bottom."""
        return tuple(widget for widget, _ in self._layout.rects)

    def resize(self, size: tuple[int, int], ui_scale: float) -> None:
        """Lay out the panel for a window of another size, px."""
        self._drawn_state = ()
        self.used = True
        super().resize(size, ui_scale)

    def show(self, parameters: Sequence[Parameter], toggles: Mapping[str, bool], buttons: Sequence[str] = ()) -> None:
        """Show parameters, check boxes and buttons, without callbacks. Widgets that remain keep their drags."""
        self._is_dirty = True
        before = [*self._parameter_widgets, *self._checkboxes, len(self._buttons)]
        parameter_widgets: dict[str, ParameterWidget] = {}
        for parameter in parameters:
            kind = OptionButton if parameter.choices else ParameterSlider
            old = self._parameter_widgets.get(parameter.key)
            widget = old if type(old) is kind else kind(self._sheet, parameter)
            widget.show_parameter(parameter)
            parameter_widgets[parameter.key] = widget
        changed = any(self._parameter_widgets.get(key) is not widget for key, widget in parameter_widgets.items())
        self._parameter_widgets = parameter_widgets
        self._checkboxes = {name: self._checkbox(name, on) for name, on in toggles.items()}
        del self._buttons[len(buttons) :]
        for k, name in enumerate(buttons):
            if k == len(self._buttons):
                self._buttons.append(PushButton(self._sheet, name))
            self._buttons[k].name, self._buttons[k].hint = name, BUTTONS[name].hint
        if changed or before != [*self._parameter_widgets, *self._checkboxes, len(self._buttons)]:
            self._lay_out()

    def _checkbox(self, name: str, on: bool) -> Checkbox:
        checkbox = self._checkboxes.get(name)
        if checkbox is None:
            key = next((command.label for command in Command if command == name), "")
            checkbox = Checkbox(self._sheet, name, on, _LABELS.get(name, ""), key)
        checkbox.on = on
        return checkbox

    def _lay_out(self) -> None:
        """Lay out all widgets in content coordinates."""
        self._layout = arrange_widgets(
            self._buttons,
            list(self._parameter_widgets.values()),
            list(self._checkboxes.values()),
            self.column_width,
            self.ui_scale,
        )
        self._height = self._layout.height
        self._scroll_to(self._scroll)

    def _scroll_to(self, scroll: int) -> None:
        """Scroll to a position, px, which is clamped, and move the widgets."""
        super()._scroll_to(scroll)
        for widget, rect in self._layout.rects:
            widget.surface = self._sheet
            widget.set_rect(rect.move(0, -self._scroll), self.ui_scale)

    def release(self) -> None:
        """End a drag, with its final event."""
        super().release()
        self.used = True
        for widget in self.widgets:
            widget.release()
        self._report_events()

    def handle_event(self, event: pygame.event.Event) -> bool:
        """Process an event; return whether it was consumed. A hidden panel still ends its drags."""
        is_loss = event.type in (pygame.WINDOWFOCUSLOST, pygame.WINDOWLEAVE)
        return (self.visible or is_loss) and super().handle_event(event)

    def _handle_mouse(self, event: pygame.event.Event, at: tuple[int, int], is_ours: bool) -> None:
        """Drag the scroll bar, or pass the event to the widgets."""
        if not is_ours and event.type != pygame.MOUSEMOTION:
            return
        self.used = self._is_dirty = True
        if event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            self._is_bar_held = self._is_on_bar(at)
        if self._is_bar_held:
            self._is_bar_held = event.type != pygame.MOUSEBUTTONUP or event.button != 1
            self._drag_bar(at)
            return
        moved = pygame.event.Event(event.type, {**event.dict, "pos": at})
        for widget in self.widgets:
            widget.handle_event(moved)
        self._report_events()

    def _turn_wheel(self, notches: int) -> None:
        """Change the parameter under the pointer, or scroll."""
        self.used = self._is_dirty = True
        assert self._pointer is not None
        pointer = self._pointer
        if notches and not any(widget.scroll(notches, pointer) for widget in self._parameter_widgets.values()):
            super()._turn_wheel(notches)
        self._report_events()

    def _report_events(self) -> None:
        """Report the events since the last call; a callback may change the content of the panel."""
        events: list[WidgetEvent] = []
        for widget in self.widgets:
            events += widget.events
            widget.events.clear()
        for used in events:
            if used.kind == "button":
                self.on_button(BUTTONS[used.name].command)
            elif isinstance(used.value, bool):
                self.on_toggle(used.name, used.value)
            else:
                self.on_change(used.name, used.value, used.final)

    def draw(self, surface: pygame.Surface) -> None:
        """Draw the panel at the right of the window, if visible."""
        if self.visible:
            super().draw(surface)

    def _draw_sheet(self) -> None:
        """Draw the column on the cached surface if it has changed."""
        states = (widget.draw_state for widget in self.widgets)
        state = (self._scroll, self._is_bar_held, self._layout.headings, *states)
        if state != self._drawn_state:
            super()._draw_sheet()
            self._drawn_state = state

    def _draw_content(self, sheet: pygame.Surface) -> None:
        """Draw the headings and the visible widgets."""
        ui_scale = self.ui_scale
        for text, top in self._layout.headings:
            y = top - self._scroll + 10 * ui_scale
            word = draw_text(sheet, text.upper(), (14 * ui_scale, y), 10.5 * ui_scale, FAINT, "midleft", bold=True)
            ends = (word.right + 8 * ui_scale, y), (self.column_width - 18 * ui_scale, y)
            pygame.draw.line(sheet, LINE, *ends, max(round(ui_scale), 1))
        for widget in self.widgets:
            if widget.rect.bottom >= -40 * ui_scale and widget.rect.top <= self.size[1] + 40 * ui_scale:
                widget.draw()

    def _hint(self) -> str:
        """Return the tooltip of the widget under the pointer; empty without one."""
        return next((widget.hint for widget in self.widgets if widget.hovered and widget.hint), "")


def _ignore(*_: object) -> None:
    """No-op, the default of the callbacks."""
