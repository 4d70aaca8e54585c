"""Widgets: what all of the panel's share, switches and buttons; made from the base of pygame-widgets.

How they differ from theirs: they live on events, not on the mouse's state once a frame, so that a press and release
within one frame count; they belong to whoever made them, not to the library's global list; and what happened to one
is kept in its `reports`, so that it holds nothing of its panel.

Dials: what turns a knob, a slider for figures and a row of words for choices; made from those of pygame-widgets.
"""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import pygame
from pygame_widgets.slider import Slider  # type: ignore[import-untyped]  # the library ships no types
from pygame_widgets.widget import WidgetBase  # type: ignore[import-untyped]  # the library ships no types

from sandbox.window.playback.parameters import Parameter, ParameterValue
from sandbox.window.render.palette import BACKGROUND, FAINT, INK, LINE, PANEL_RAISED, SKY, WARNING, Colour, mix_colours
from sandbox.window.render.text import draw_text, ellipsis, text_size
from sandbox.window.ui.icons import draw_disc, icon

WIDGET_TEXT_SIZE = 12.5
"""px at unit 1"""


class WidgetEvent(NamedTuple):
    """What somebody did to a widget."""

    kind: Literal["change", "toggle", "button"]
    name: str
    value: ParameterValue | bool = True
    final: bool = True
    """not while a slider is still dragged"""


class Widget(WidgetBase):  # type: ignore[misc]  # the library ships no types
    """What all widgets share. Positions of events are those on the surface that it is drawn on."""

    def __init__(self, surface: pygame.Surface) -> None:
        super().__init__(surface, 0, 0, 0, 0)
        self.setIsSubWidget(True)  # out of the library's global list
        self.unit = 1.0
        self.held = False
        self.hovered = False
        self.reports: list[WidgetEvent] = []
        self.hint = ""
        """what is told beside the pointer"""

    @property
    def rect(self) -> pygame.Rect:
        """Where it is."""
        return pygame.Rect(self.getX(), self.getY(), self.getWidth(), self.getHeight())

    def place(self, rect: pygame.Rect, unit: float) -> None:
        """Move it."""
        for name, value in zip(("x", "y", "width", "height"), rect, strict=True):
            self.set(name, value)
        self.unit = unit

    def listen(self, events: Sequence[pygame.event.Event]) -> None:
        """Take events in: a press and a release within it make a click."""
        for event in events:
            if event.type == pygame.MOUSEMOTION:
                self.hovered = self.rect.collidepoint(event.pos)
            elif event.type == pygame.MOUSEBUTTONDOWN and event.button in (1, 3):
                self.held = self.hovered = self.rect.collidepoint(event.pos)
            elif event.type == pygame.MOUSEBUTTONUP and event.button in (1, 3):
                clicked = self.held and self.rect.collidepoint(event.pos)
                self.held = False
                if clicked and self.isEnabled():
                    self.click(event)

    def click(self, event: pygame.event.Event) -> None:
        """React to a click, given its release."""

    def release(self) -> None:
        """End what is being done, as when the window loses its focus."""
        self.held = self.hovered = False

    @property
    def look(self) -> tuple[object, ...]:
        """All that its drawing depends on."""
        return (*self.rect, self.unit, self.held, self.hovered, self.isEnabled())

    @property
    def ink(self) -> Colour:
        """The colour of its words."""
        return INK if self.isEnabled() else mix_colours(FAINT, BACKGROUND, 0.35)


class Checkbox(Widget):
    """A box that is ticked or not, its label, and the key that does the same."""

    def __init__(self, surface: pygame.Surface, name: str, on: bool, label: str = "", key: str = "") -> None:
        super().__init__(surface)
        self.name, self.on, self.label, self.key = name, on, label or name, key

    @property
    def look(self) -> tuple[object, ...]:
        """All that its drawing depends on."""
        return (*super().look, self.name, self.on, self.label, self.key)

    def click(self, event: pygame.event.Event) -> None:
        """Turn it."""
        if event.button == 1:
            self.on = not self.on
            self.reports.append(WidgetEvent("toggle", self.name, self.on))

    def draw(self) -> None:
        """Draw it on its surface."""
        size, rect = WIDGET_TEXT_SIZE * self.unit, self.rect
        side = round(14 * self.unit)
        box = pygame.Rect(rect.left, rect.centery - side // 2, side, side)
        radius = round(3.5 * self.unit)
        pygame.draw.rect(self.win, SKY if self.on else PANEL_RAISED, box, border_radius=radius)
        edge = SKY if self.on or self.hovered else LINE
        pygame.draw.rect(self.win, edge, box, max(round(self.unit), 1), border_radius=radius)
        if self.on:
            corners = [(0.22, 0.52), (0.42, 0.72), (0.78, 0.28)]
            places = [(box.left + x * side, box.top + y * side) for x, y in corners]
            pygame.draw.lines(self.win, BACKGROUND, False, places, max(round(2 * self.unit), 1))
        left = box.right + round(0.5 * size)
        keyed = text_size(self.key, 0.85 * size, mono=True)[0] + round(0.6 * size) if self.key else 0
        draw_text(self.win, self.key, (rect.right, rect.centery), 0.85 * size, FAINT, "midright", mono=True)
        label = ellipsis(self.label, size, rect.right - keyed - left)
        draw_text(self.win, label, (left, rect.centery), size, INK if self.on else FAINT, "midleft")


class PushButton(Widget):
    """A button with an icon, or with its name where there is none."""

    def __init__(self, surface: pygame.Surface, name: str, hint: str = "") -> None:
        super().__init__(surface)
        self.name, self.hint = name, hint

    @property
    def look(self) -> tuple[object, ...]:
        """All that its drawing depends on."""
        return (*super().look, self.name)

    def click(self, event: pygame.event.Event) -> None:
        """Report it."""
        if event.button == 1:
            self.reports.append(WidgetEvent("button", self.name))

    def draw(self) -> None:
        """Draw it on its surface."""
        rect = self.rect
        colour = mix_colours(PANEL_RAISED, SKY, 0.45) if self.held else LINE if self.hovered else PANEL_RAISED
        pygame.draw.rect(self.win, colour, rect, border_radius=round(5 * self.unit))
        side = round(0.62 * min(rect.size))
        picture = icon(self.name, side, WARNING if self.name in ("record", "stop") else INK)
        if picture is not None:
            self.win.blit(picture, picture.get_rect(center=rect.center))
        else:
            size = WIDGET_TEXT_SIZE * self.unit
            draw_text(self.win, ellipsis(self.name, size, rect.width - size), rect.center, size, INK, "center")


DOUBLE = 400
"""ms between the two presses of a double click, at most"""


class ParameterWidget(Widget):
    """What sliders and choices share: a knob, and the value that is shown."""

    def __init__(self, surface: pygame.Surface, knob: Parameter) -> None:
        super().__init__(surface)
        self.knob = knob
        self.now: ParameterValue = knob.value
        self.show_knob(knob)

    def show_knob(self, knob: Parameter) -> None:
        """Take over what a knob says, without a report; what is being dragged keeps its value."""
        self.knob = knob
        (self.enable if knob.enabled else self.disable)()
        self.hint = "" if knob.enabled else knob.why
        if not knob.enabled:
            self.held = False
        if not self.held:
            self.now = knob.value

    @property
    def look(self) -> tuple[object, ...]:
        """All that its drawing depends on."""
        return (*super().look, self.knob, self.now)

    def change(self, value: ParameterValue, final: bool) -> None:
        """Report a new value."""
        self.now = value
        self.reports.append(WidgetEvent("change", self.knob.key, value, final))

    def turn(self, notches: int, at: tuple[int, int]) -> bool:
        """Change by notches of the wheel where the pointer is on what moves."""
        if not self.contains(*at) or not self.isEnabled():
            return False
        value = self.knob.stepped(self.now, notches)
        if value != self.now:
            self.change(value, final=True)
        return True


class ParameterSlider(ParameterWidget, Slider):  # type: ignore[misc]  # the library ships no types
    """A slider: label and value above, the track below. The library's slider is its track, from 0 to 1."""

    def __init__(self, surface: pygame.Surface, knob: Parameter) -> None:
        self.min, self.max, self.value = 0.0, 1.0, 0.0
        self._changed = False
        self._gripped, self._grip = False, 0.0
        self.row = pygame.Rect(0, 0, 0, 0)
        """label, value and track together"""
        self._pressed = -DOUBLE - 1, (0, 0)
        super().__init__(surface, knob)
        self.min, self.max = 0.0, 1.0
        self.show_knob(knob)

    def place(self, rect: pygame.Rect, unit: float) -> None:
        """Move it: the track lies in the lower part of the rectangle."""
        high = round(14 * unit)
        side = round(7 * unit)
        super().place(pygame.Rect(rect.left + side, rect.bottom - high, rect.width - 2 * side, high), unit)
        self.row = rect
        self.handleRadius = side

    def show_knob(self, knob: Parameter) -> None:
        """Take over what a knob says, without a report; what is being dragged keeps its value."""
        super().show_knob(knob)
        self.setValue(knob.share(self.now))

    def change(self, value: ParameterValue, final: bool) -> None:
        """Report a new value."""
        super().change(value, final)
        self.setValue(self.knob.share(value))

    def listen(self, events: Sequence[pygame.event.Event]) -> None:
        """Take events in; a drag goes on wherever the pointer goes, and ends with a final report."""
        for event in events:
            if event.type == pygame.MOUSEMOTION:
                self.hovered = self.row.collidepoint(event.pos)
                if self.held:
                    self._follow(event.pos[0])
            elif event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
                if self.isEnabled() and self.contains(*event.pos):
                    self._press(event.pos)
            elif event.type == pygame.MOUSEBUTTONUP and event.button == 1 and self.held:
                self._follow(event.pos[0])
                self.release()

    def _press(self, at: tuple[int, int]) -> None:
        now = pygame.time.get_ticks()
        then, where = self._pressed
        near = max(abs(at[0] - where[0]), abs(at[1] - where[1])) <= 6 * self.unit
        default = self.knob.default
        if now - then <= DOUBLE and near and default is not None:
            self._pressed = -DOUBLE - 1, at
            if self.now != default:
                self.change(default, final=True)
            return
        self._pressed = now, at
        self.held, self._changed = True, False
        handle = self.getX() + self.getValue() * self.getWidth()
        self._gripped = abs(at[0] - handle) <= self.handleRadius
        self._grip = at[0] - handle if self._gripped else 0.0  # a gripped handle does not jump
        if not self._gripped:
            self._follow(at[0])

    def _follow(self, x: float) -> None:
        """Move to where the pointer is; where it has not moved since it gripped the handle, nothing changes."""
        if x == self._pressed[1][0] and self._gripped and not self._changed:
            return
        value = self.knob.at((x - self._grip - self.getX()) / max(self.getWidth(), 1))
        if value != self.now:
            self._changed = True
            self.change(value, final=False)

    def release(self) -> None:
        """End a drag, with a final report if anything was changed."""
        changed = self.held and self._changed
        super().release()
        if changed:
            self.change(self.now, final=True)

    def draw(self) -> None:
        """Draw it on its surface."""
        size, track = WIDGET_TEXT_SIZE * self.unit, self.rect
        middle = self.row.top + 0.75 * size
        text = self.knob.text(self.now)
        taken = draw_text(self.win, text, (self.row.right, middle), size, self.ink, "midright", mono=True).width
        label = ellipsis(self.knob.label, size, self.row.width - taken - size)
        draw_text(self.win, label, (self.row.left, middle), size, self.ink, "midleft")
        thick = max(round(4 * self.unit), 2)
        bar = pygame.Rect(track.left, track.centery - thick // 2, track.width, thick)
        pygame.draw.rect(self.win, LINE, bar, border_radius=thick)
        share = self.getValue()
        zero = self.knob.share(0.0) if not self.knob.log and self.knob.low < 0 else 0.0
        ends = sorted(bar.left + round(part * bar.width) for part in (zero, share))
        bar.left, bar.width = ends[0], ends[1] - ends[0]
        live = self.isEnabled()
        pygame.draw.rect(self.win, SKY if live else PANEL_RAISED, bar, border_radius=thick)
        at = track.left + round(share * track.width), track.centery
        radius = self.handleRadius if self.held or self.hovered else self.handleRadius - self.unit
        draw_disc(self.win, at, radius, SKY if live else LINE)
        draw_disc(self.win, at, max(radius - 2.4 * self.unit, 1), INK if live else PANEL_RAISED)


class OptionButton(ParameterWidget):
    """One of several words: a click goes to the next, on its left end or with the right button to the one before."""

    def contains(self, x: int, y: int) -> bool:
        """Tell whether a place is on the word."""
        return bool(self._box.collidepoint(x, y))

    @property
    def _box(self) -> pygame.Rect:
        rect = self.rect
        wide = round(0.68 * rect.width)
        return pygame.Rect(rect.right - wide, rect.top, wide, rect.height)

    def click(self, event: pygame.event.Event) -> None:
        """Change to the next word, or the one before."""
        if self.contains(*event.pos) and self.knob.choices:
            back = event.button == 3 or event.pos[0] < self._box.left + 0.25 * self._box.width
            self.change(self.knob.stepped(self.now, -1 if back else 1), final=True)

    def draw(self) -> None:
        """Draw it on its surface."""
        size, box = WIDGET_TEXT_SIZE * self.unit, self._box
        label = ellipsis(self.knob.label, size, box.left - self.rect.left - 0.5 * size)
        draw_text(self.win, label, (self.rect.left, box.centery), size, self.ink, "midleft")
        lit = self.hovered and self.isEnabled()
        pygame.draw.rect(self.win, LINE if lit else PANEL_RAISED, box, border_radius=round(4 * self.unit))
        text = ellipsis(self.knob.text(self.now), 0.95 * size, box.width - 2.2 * size)
        draw_text(self.win, text, box.center, 0.95 * size, self.ink, "center")
        reach, x = 0.28 * size, 0.6 * size
        for end, way in ((box.left + x, -1), (box.right - x, 1)):
            corners = [(end - way * reach / 2, box.centery - reach), (end + way * reach / 2, box.centery)]
            corners.append((corners[0][0], box.centery + reach))
            colour = SKY if self.isEnabled() else LINE
            pygame.draw.lines(self.win, colour, False, corners, max(round(1.6 * self.unit), 1))
