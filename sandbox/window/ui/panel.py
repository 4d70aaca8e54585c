"""Panel: the column at the right, with buttons, knobs and switches. It knows nothing of what they do.

Layout: where the widgets of the panel lie, one below the other.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import pygame

from sandbox.window.input.keymap import BINDINGS, Command
from sandbox.window.playback.parameters import Parameter, ParameterValue
from sandbox.window.render.palette import FAINT, LINE, PANEL, PANEL_RAISED
from sandbox.window.render.text import draw_hint, draw_text
from sandbox.window.ui.widgets import (
    Checkbox,
    OptionButton,
    ParameterSlider,
    ParameterWidget,
    PushButton,
    Widget,
    WidgetEvent,
)


class PanelHeading(NamedTuple):
    """The name of a section, above it."""

    text: str
    top: int
    """px from the top of the content"""


class PanelLayout(NamedTuple):
    """Places in the content, whose upper left corner is (0, 0); px."""

    places: tuple[tuple[Widget, pygame.Rect], ...]
    """from top to bottom"""
    headings: tuple[PanelHeading, ...]
    height: int


def arrange_widgets(
    buttons: Sequence[PushButton],
    dials: Sequence[ParameterWidget],
    switches: Sequence[Checkbox],
    width: int,
    unit: float,
) -> PanelLayout:
    """Lay widgets out in a column of a width: buttons, then dials, then switches in two columns where they fit."""
    pad = round(14 * unit)
    column = pygame.Rect(pad, pad, max(width - 2 * pad - round(4 * unit), 1), 0)
    places: list[tuple[Widget, pygame.Rect]] = []
    headings: list[PanelHeading] = []
    y = pad
    if buttons:
        y = _lay_buttons(buttons, column, y, unit, places) + round(8 * unit)
    if dials:
        headings.append(PanelHeading("Settings", y))
        y += round(24 * unit)
        for dial in dials:
            high = round((27 if isinstance(dial, OptionButton) else 38) * unit)
            places.append((dial, pygame.Rect(column.left, y, column.width, high - round(4 * unit))))
            y += high
        y += round(8 * unit)
    if switches:
        headings.append(PanelHeading("Show", y))
        y = _lay_switches(switches, column, y + round(24 * unit), unit, places)
    return PanelLayout(tuple(places), tuple(headings), y + pad // 2)


def _lay_buttons(
    buttons: Sequence[PushButton],
    column: pygame.Rect,
    y: int,
    unit: float,
    places: list[tuple[Widget, pygame.Rect]],
) -> int:
    """Place buttons in as few rows of equal length as they fit into, and return where they end."""
    least, gap, high = round(30 * unit), round(5 * unit), round(32 * unit)
    most = max((column.width + gap) // (least + gap), 1)
    rows = -(-len(buttons) // most)
    across = -(-len(buttons) // rows)
    wide = (column.width + gap) / across - gap
    for k, button in enumerate(buttons):
        row, place = divmod(k, across)
        left = column.left + round(place * (wide + gap))
        places.append((button, pygame.Rect(left, y + row * (high + gap), max(round(wide), 1), high)))
    return y + rows * (high + gap)


def _lay_switches(
    switches: Sequence[Checkbox],
    column: pygame.Rect,
    y: int,
    unit: float,
    places: list[tuple[Widget, pygame.Rect]],
) -> int:
    """Place switches in columns, each read downwards, and return where they end."""
    gap, high = round(14 * unit), round(23 * unit)
    columns = 2 if column.width >= 200 * unit else 1
    each = max((column.width - (columns - 1) * gap) // columns, 1)
    rows = -(-len(switches) // columns)
    for k, switch in enumerate(switches):
        place, row = divmod(k, rows)
        places.append((switch, pygame.Rect(column.left + place * (each + gap), y + row * high, each, high)))
    return y + rows * high


PANEL_WIDTH = 264
"""px at unit 1"""
WIDEST = 0.6
"""share of a small window that it covers, at most"""
FOLDS = 0.45
"""share of a window beyond which it is folded away at first"""
SCROLL = 48
"""px at unit 1, a notch of the wheel"""

_BUTTONS = {
    "play": ("Resume", Command.PAUSE),
    "pause": ("Pause", Command.PAUSE),
    "step": ("Step forward", Command.STEP),
    "back": ("Step back", Command.BACK),
    "restart": ("Restart", Command.RESTART),
    "camera": ("Screenshot", Command.SCREENSHOT),
    "record": ("Record", Command.RECORD),
    "stop": ("Stop recording", Command.RECORD),
    "save": ("Save the session", Command.SAVE),
    "help": ("Help", Command.HELP),
    "picker": ("Open a scene", Command.PICKER),
}
_LABELS = {"trust": "horizon", "antialias": "antialiasing"}
"""of switches that are not labelled by their names"""
_MOUSE = (pygame.MOUSEMOTION, pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP)


class SidePanel:
    """A column of widgets that is told what to show, and calls back when somebody uses it."""

    def __init__(self, size: tuple[int, int], unit: float = 1.0) -> None:
        """Make an empty panel for a window of a size in px."""
        self.on_change: Callable[[str, ParameterValue, bool], None] = _nothing
        """(key, value, final); values of whole knobs are floats too"""
        self.on_toggle: Callable[[str, bool], None] = _nothing
        self.on_button: Callable[[str], None] = _nothing
        self.size, self.unit = size, unit
        self._wanted: bool | None = None  # whether it was asked for, or to be hidden; else a small window hides it
        self._dials: dict[str, ParameterWidget] = {}
        self._switches: dict[str, Checkbox] = {}
        self._buttons: list[PushButton] = []
        self._layout = PanelLayout((), (), 0)
        self._scroll = 0
        self._sheet = pygame.Surface((1, 1))
        self._drawn: tuple[object, ...] = ()
        """what the sheet shows"""
        self._pointer: tuple[int, int] | None = None
        self._pressed: set[int] = set()
        self._bar_held = False
        self.used = True
        """an event or a resize may have changed a widget since this was last reset: `show` is needed"""
        self._dirty = True  # the sheet has to be checked for changes
        self.resize(size, unit)

    @property
    def width(self) -> int:
        """What it covers at the right of the window, px; 0 while it is hidden."""
        return self._full if self.visible else 0

    @property
    def _full(self) -> int:
        return max(min(round(PANEL_WIDTH * self.unit), round(WIDEST * self.size[0])), 1)

    @property
    def visible(self) -> bool:
        """Whether it is shown: in a window that it would cover much of, only once it is asked for.

        Hiding it ends what is being dragged.
        """
        return self._wanted if self._wanted is not None else round(PANEL_WIDTH * self.unit) <= FOLDS * self.size[0]

    @visible.setter
    def visible(self, visible: bool) -> None:
        self._wanted = visible
        if not visible:
            self.release()

    @property
    def widgets(self) -> tuple[Widget, ...]:
        """All widgets, from top to bottom."""
        return tuple(widget for widget, _ in self._layout.places)

    def resize(self, size: tuple[int, int], unit: float) -> None:
        """Fit it to a window of another size, px."""
        self.size, self.unit = size, unit
        self._sheet = pygame.Surface((self._full, max(size[1], 1)))
        self._drawn = ()
        self.used = True
        self._lay_out()

    def show(self, knobs: Sequence[Parameter], toggles: Mapping[str, bool], buttons: Sequence[str] = ()) -> None:
        """Show these knobs, switches and buttons, and call nobody back. What stays keeps being held."""
        self._dirty = True
        before = [*self._dials, *self._switches, len(self._buttons)]
        dials: dict[str, ParameterWidget] = {}
        for knob in knobs:
            kind = OptionButton if knob.choices else ParameterSlider
            old = self._dials.get(knob.key)
            dial = old if type(old) is kind else kind(self._sheet, knob)
            dial.show_parameter(knob)
            dials[knob.key] = dial
        lay_out = any(self._dials.get(key) is not dial for key, dial in dials.items())
        self._dials = dials
        self._switches = {name: self._switch(name, on) for name, on in toggles.items()}
        del self._buttons[len(buttons) :]
        for k, name in enumerate(buttons):
            if k == len(self._buttons):
                self._buttons.append(PushButton(self._sheet, name))
            self._buttons[k].name, self._buttons[k].hint = name, _told(name)
        if lay_out or before != [*self._dials, *self._switches, len(self._buttons)]:
            self._lay_out()

    def _switch(self, name: str, on: bool) -> Checkbox:
        switch = self._switches.get(name)
        if switch is None:
            key = next((binding.label for binding in BINDINGS if binding.command == name), "")
            switch = Checkbox(self._sheet, name, on, _LABELS.get(name, ""), key)
        switch.on = on
        return switch

    def _lay_out(self) -> None:
        """Give every widget its place in the content, whose top is at 0."""
        self._layout = arrange_widgets(
            self._buttons, list(self._dials.values()), list(self._switches.values()), self._full, self.unit
        )
        self._move()

    def _move(self) -> None:
        """Place the widgets as far as the content is scrolled."""
        self._dirty = True
        self._scroll = min(max(self._scroll, 0), max(self._layout.height - self.size[1], 0))
        for widget, place in self._layout.places:
            widget.surface = self._sheet
            widget.set_rect(place.move(0, -self._scroll), self.unit)

    def release(self) -> None:
        """End whatever is being dragged, with its final report."""
        self.used = self._dirty = True
        self._pressed.clear()
        self._bar_held = False
        self._pointer = None
        for widget in self.widgets:
            widget.release()
        self._call_back()

    def handle_event(self, event: pygame.event.Event) -> bool:
        """Take an event in, and tell whether it was used up. Pass every event, motion too: the wheel has no place.

        A press outside belongs to the picture, and so do the motion and release that follow it.
        """
        if event.type in (pygame.WINDOWFOCUSLOST, pygame.WINDOWLEAVE):
            if event.type == pygame.WINDOWFOCUSLOST or not self._pressed:
                self.release()
            return False
        if not self.visible:
            return False
        if event.type == pygame.MOUSEWHEEL:
            return self._wheel(event)
        if event.type not in _MOUSE:
            return False
        at = event.pos[0] - (self.size[0] - self._full), event.pos[1]
        inside = 0 <= at[0] < self._full and 0 <= at[1] < self.size[1]
        self._pointer = at if inside or self._pressed else None
        if event.type == pygame.MOUSEBUTTONUP:
            ours = event.button in self._pressed
            self._pressed.discard(event.button)
        elif event.type == pygame.MOUSEBUTTONDOWN:
            ours = inside
            if ours and event.button <= 3:  # 4 and up are the wheel once more
                self._pressed.add(event.button)
        else:
            foreign = any(getattr(event, "buttons", ())) and not self._pressed
            ours = bool(self._pressed) or (inside and not foreign)
        if ours or event.type == pygame.MOUSEMOTION:
            self._pass_on(event, at)
        return ours

    def _pass_on(self, event: pygame.event.Event, at: tuple[int, int]) -> None:
        self.used = self._dirty = True
        if self._grab_bar(event, at):
            return
        moved = pygame.event.Event(event.type, {**event.dict, "pos": at})
        for widget in self.widgets:
            widget.handle_event(moved)
        self._call_back()

    def _grab_bar(self, event: pygame.event.Event, at: tuple[int, int]) -> bool:
        """Scroll by the bar at the right edge, and tell whether it is held."""
        if event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            self._bar_held = self._layout.height > self.size[1] and at[0] >= self._full - 9 * self.unit
        if not self._bar_held:
            return False
        if event.type == pygame.MOUSEBUTTONUP and event.button == 1:
            self._bar_held = False
        self._scroll = round(at[1] / max(self.size[1], 1) * self._layout.height - self.size[1] / 2)
        self._move()
        return True

    def _wheel(self, event: pygame.event.Event) -> bool:
        if self._pointer is None:
            return False
        self.used = self._dirty = True
        notches = int(event.y)
        if notches and not any(dial.scroll(notches, self._pointer) for dial in self._dials.values()):
            self._scroll -= round(notches * SCROLL * self.unit)
            self._move()
        self._call_back()
        return True

    def _call_back(self) -> None:
        """Tell what was done since the last call; a callback may show other things meanwhile."""
        reports: list[WidgetEvent] = []
        for widget in self.widgets:
            reports += widget.events
            widget.events.clear()
        for report in reports:
            if report.kind == "button":
                self.on_button(report.name)
            elif isinstance(report.value, bool):
                self.on_toggle(report.name, report.value)
            else:
                self.on_change(report.name, report.value, report.final)

    def draw(self, surface: pygame.Surface) -> None:
        """Draw it at the right of the window, if it is visible."""
        if not self.visible:
            return
        if self._dirty:
            self._dirty = False
            state = (
                self._scroll,
                self._bar_held,
                self._layout.headings,
                *(widget.draw_state for widget in self.widgets),
            )
            if state != self._drawn:
                self._draw_sheet()
                self._drawn = state
        surface.blit(self._sheet, (self.size[0] - self._full, 0))
        self._draw_hint(surface)

    def _draw_sheet(self) -> None:
        """Draw the whole column, off the window, as most pictures show it unchanged."""
        sheet, unit = self._sheet, self.unit
        sheet.fill(PANEL)
        for text, top in self._layout.headings:
            y = top - self._scroll + 10 * unit
            word = draw_text(sheet, text.upper(), (14 * unit, y), 10.5 * unit, FAINT, "midleft", bold=True)
            start = word.right + 8 * unit
            pygame.draw.line(sheet, LINE, (start, y), (self._full - 18 * unit, y), max(round(unit), 1))
        for widget in self.widgets:
            if widget.rect.bottom >= -40 * unit and widget.rect.top <= self.size[1] + 40 * unit:
                widget.draw()
        pygame.draw.line(sheet, LINE, (0, 0), (0, self.size[1]), max(round(unit), 1))
        if self._layout.height > self.size[1]:
            high = max(round(self.size[1] ** 2 / self._layout.height), round(16 * unit))
            top = round(self._scroll / (self._layout.height - self.size[1]) * (self.size[1] - high))
            wide = round(5 * unit)
            bar = pygame.Rect(self._full - wide - round(2 * unit), top, wide, high)
            pygame.draw.rect(sheet, LINE if self._bar_held else PANEL_RAISED, bar, border_radius=wide)

    def _draw_hint(self, surface: pygame.Surface) -> None:
        hint = next((widget.hint for widget in self.widgets if widget.hovered and widget.hint), "")
        if hint and self._pointer is not None and not self._pressed:
            x, y = self._pointer
            draw_hint(surface, hint, (self.size[0] - self._full + x, y), self.unit)


def _nothing(*_: object) -> None:
    """Call nobody back."""


def _told(name: str) -> str:
    about, command = _BUTTONS.get(name, ("", None))
    key = next((binding.label for binding in BINDINGS if binding.command == command), "")
    return f"{about} ({key})" if key else about
