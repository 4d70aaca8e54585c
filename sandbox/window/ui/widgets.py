"""Widgets of the side panel: check box, button, slider, and a button that cycles through options.

Widgets handle events instead of polling the mouse once per frame, so that a press and its release within one frame
count as a click. User actions are queued in `events`; a widget holds no reference to its panel.
"""

from typing import Literal, NamedTuple

import pygame

from sandbox.window.playback.parameters import Parameter, ParameterValue
from sandbox.window.render.circles import draw_disc
from sandbox.window.render.palette import (
    BACKGROUND,
    FAINT,
    INK,
    LINE,
    PANEL_RAISED,
    SKY,
    WARNING,
    RgbColour,
    mix_colours,
)
from sandbox.window.render.text import draw_text, ellipsis, text_size
from sandbox.window.ui.icons import icon

WIDGET_TEXT_SIZE = 12.5
"""px at UI scale 1"""
DOUBLE_CLICK_MS = 400
"""longest time between the presses of a double click"""
DOUBLE_CLICK_DISTANCE = 6
"""px at UI scale 1, largest distance between the presses"""


class WidgetEvent(NamedTuple):
    """User action on a widget."""

    kind: Literal["change", "toggle", "button"]
    name: str
    value: ParameterValue | bool = True
    final: bool = True
    """False while a slider is being dragged"""


class Widget:
    """Base of all widgets: geometry, pointer state and event queue. Positions are relative to `surface`."""

    def __init__(self, surface: pygame.Surface) -> None:
        self.surface = surface
        self.rect = pygame.Rect(0, 0, 0, 0)
        self.ui_scale = 1.0
        self.enabled = True
        self.held = False
        self.hovered = False
        self.events: list[WidgetEvent] = []
        self.hint = ""
        """tooltip"""

    def set_rect(self, rect: pygame.Rect, ui_scale: float) -> None:
        """Move and resize the widget."""
        self.rect, self.ui_scale = rect.copy(), ui_scale

    def contains(self, x: int, y: int) -> bool:
        """Return whether a position is inside the widget, excluding its edge."""
        return self.rect.left < x < self.rect.right and self.rect.top < y < self.rect.bottom

    def handle_event(self, event: pygame.event.Event) -> None:
        """Process a mouse event; a press and a release inside the widget are a click."""
        if event.type == pygame.MOUSEMOTION:
            self.hovered = self.rect.collidepoint(event.pos)
        elif event.type == pygame.MOUSEBUTTONDOWN and event.button in (1, 3):
            self.held = self.hovered = self.rect.collidepoint(event.pos)
        elif event.type == pygame.MOUSEBUTTONUP and event.button in (1, 3):
            clicked = self.held and self.rect.collidepoint(event.pos)
            self.held = False
            if clicked and self.enabled:
                self.click(event)

    def click(self, event: pygame.event.Event) -> None:
        """Handle a click; `event` is the release of the button."""

    def release(self) -> None:
        """End a press or drag without a mouse event, for example when the window loses focus."""
        self.held = self.hovered = False

    def draw(self) -> None:
        """Draw the widget on its surface."""

    @property
    def draw_state(self) -> tuple[object, ...]:
        """All values that the drawing depends on."""
        return (*self.rect, self.ui_scale, self.held, self.hovered, self.enabled)

    @property
    def text_colour(self) -> RgbColour:
        """Colour of label and value; dimmed while disabled."""
        return INK if self.enabled else mix_colours(FAINT, BACKGROUND, 0.35)


class Checkbox(Widget):
    """Check box with its label and the key that toggles it."""

    def __init__(self, surface: pygame.Surface, name: str, on: bool, label: str = "", key: str = "") -> None:
        super().__init__(surface)
        self.name, self.on, self.label, self.key = name, on, label or name, key

    @property
    def draw_state(self) -> tuple[object, ...]:
        """All values that the drawing depends on."""
        return (*super().draw_state, self.name, self.on, self.label, self.key)

    def click(self, event: pygame.event.Event) -> None:
        """Toggle the box."""
        if event.button == 1:
            self.on = not self.on
            self.events.append(WidgetEvent("toggle", self.name, self.on))

    def draw(self) -> None:
        """Draw the widget on its surface."""
        size, rect = WIDGET_TEXT_SIZE * self.ui_scale, self.rect
        side = round(14 * self.ui_scale)
        box = pygame.Rect(rect.left, rect.centery - side // 2, side, side)
        draw_check_box(self.surface, box, self.on, self.hovered, self.ui_scale)
        left = box.right + round(0.5 * size)
        key_width = text_size(self.key, 0.85 * size, mono=True)[0] + round(0.6 * size) if self.key else 0
        draw_text(self.surface, self.key, (rect.right, rect.centery), 0.85 * size, FAINT, "midright", mono=True)
        label = ellipsis(self.label, size, rect.right - key_width - left)
        draw_text(self.surface, label, (left, rect.centery), size, INK if self.on else FAINT, "midleft")


def draw_check_box(
    surface: pygame.Surface, box: pygame.Rect, is_on: bool, is_hovered: bool, ui_scale: float, fill: RgbColour = SKY
) -> None:
    """Draw the square of a check box; `fill` is its colour while it is on."""
    radius = round(3.5 * ui_scale)
    pygame.draw.rect(surface, fill if is_on else PANEL_RAISED, box, border_radius=radius)
    edge = SKY if is_on or is_hovered else LINE
    pygame.draw.rect(surface, edge, box, max(round(ui_scale), 1), border_radius=radius)
    if is_on:
        tick = [
            (box.left + x * box.width, box.top + y * box.width) for x, y in ((0.22, 0.52), (0.42, 0.72), (0.78, 0.28))
        ]
        pygame.draw.lines(surface, BACKGROUND, False, tick, max(round(2 * ui_scale), 1))


class PushButton(Widget):
    """Button with an icon, by whose name it is called."""

    def __init__(self, surface: pygame.Surface, name: str, hint: str = "") -> None:
        super().__init__(surface)
        self.name, self.hint = name, hint

    @property
    def draw_state(self) -> tuple[object, ...]:
        """All values that the drawing depends on."""
        return (*super().draw_state, self.name)

    def click(self, event: pygame.event.Event) -> None:
        """Queue a button event."""
        if event.button == 1:
            self.events.append(WidgetEvent("button", self.name))

    def draw(self) -> None:
        """Draw the widget on its surface."""
        rect = self.rect
        colour = mix_colours(PANEL_RAISED, SKY, 0.45) if self.held else LINE if self.hovered else PANEL_RAISED
        pygame.draw.rect(self.surface, colour, rect, border_radius=round(5 * self.ui_scale))
        side = round(0.62 * min(rect.size))
        image = icon(self.name, side, WARNING if self.name in ("record", "stop") else INK)
        self.surface.blit(image, image.get_rect(center=rect.center))


class ParameterWidget(Widget):
    """Base of the widgets that change a parameter."""

    def __init__(self, surface: pygame.Surface, parameter: Parameter) -> None:
        super().__init__(surface)
        self.parameter = parameter
        self.value: ParameterValue = parameter.value
        """displayed value; during a drag, newer than `parameter.value`"""
        self.show_parameter(parameter)

    def show_parameter(self, parameter: Parameter) -> None:
        """Update the parameter without an event; during a drag the displayed value is kept."""
        self.parameter = parameter
        self.enabled = parameter.enabled
        self.hint = "" if parameter.enabled else parameter.why
        if not parameter.enabled:
            self.held = False
        if not self.held:
            self.value = parameter.value

    @property
    def draw_state(self) -> tuple[object, ...]:
        """All values that the drawing depends on."""
        return (*super().draw_state, self.parameter, self.value)

    def change(self, value: ParameterValue, final: bool) -> None:
        """Set a new value and queue its event."""
        self.value = value
        self.events.append(WidgetEvent("change", self.parameter.key, value, final))

    def scroll(self, notches: int, position: tuple[int, int]) -> bool:
        """Change the value by notches of the wheel if the pointer is over the track; return whether it is."""
        if not self.contains(*position) or not self.enabled:
            return False
        value = self.parameter.stepped(self.value, notches)
        if value != self.value:
            self.change(value, final=True)
        return True


class ParameterSlider(ParameterWidget):
    """Slider with label and value above the track. `rect` is the track, `row` the whole widget."""

    def __init__(self, surface: pygame.Surface, parameter: Parameter) -> None:
        self.fraction = 0.0
        """position of the handle, 0 at the left to 1 at the right end of the track"""
        self.row = pygame.Rect(0, 0, 0, 0)
        """rectangle of label, value and track"""
        self.handle_radius = 0
        """px"""
        self._dragged = False  # whether the value has changed since the press
        self._on_handle, self._grip = False, 0.0  # whether the press hit the handle; offset from its centre, px
        self._last_press = -DOUBLE_CLICK_MS - 1, (0, 0)
        super().__init__(surface, parameter)

    def set_rect(self, rect: pygame.Rect, ui_scale: float) -> None:
        """Move and resize the widget; the track is in the lower part of the rectangle."""
        height = round(14 * ui_scale)
        radius = round(7 * ui_scale)
        track = pygame.Rect(rect.left + radius, rect.bottom - height, rect.width - 2 * radius, height)
        super().set_rect(track, ui_scale)
        self.row, self.handle_radius = rect.copy(), radius

    def show_parameter(self, parameter: Parameter) -> None:
        """Update the parameter without an event; during a drag the displayed value is kept."""
        super().show_parameter(parameter)
        self.fraction = parameter.fraction(self.value)

    def change(self, value: ParameterValue, final: bool) -> None:
        """Set a new value and queue its event."""
        super().change(value, final)
        self.fraction = self.parameter.fraction(value)

    def handle_event(self, event: pygame.event.Event) -> None:
        """Process a mouse event; a drag continues outside the widget and ends with a final event."""
        if event.type == pygame.MOUSEMOTION:
            self.hovered = self.row.collidepoint(event.pos)
            if self.held:
                self._drag_to(event.pos[0])
        elif event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            if self.enabled and self.contains(*event.pos):
                self._press(event.pos)
        elif event.type == pygame.MOUSEBUTTONUP and event.button == 1 and self.held:
            self._drag_to(event.pos[0])
            self.release()

    def _press(self, position: tuple[int, int]) -> None:
        now = pygame.time.get_ticks()
        last, (x, y) = self._last_press
        near = max(abs(position[0] - x), abs(position[1] - y)) <= DOUBLE_CLICK_DISTANCE * self.ui_scale
        default = self.parameter.default
        if now - last <= DOUBLE_CLICK_MS and near and default is not None:
            self._last_press = -DOUBLE_CLICK_MS - 1, position
            if self.value != default:
                self.change(default, final=True)
            return
        self._last_press = now, position
        self.held, self._dragged = True, False
        handle = self.rect.left + self.fraction * self.rect.width
        self._on_handle = abs(position[0] - handle) <= self.handle_radius
        self._grip = position[0] - handle if self._on_handle else 0.0  # avoids a jump of the handle
        if not self._on_handle:
            self._drag_to(position[0])

    def _drag_to(self, x: float) -> None:
        """Set the value at a pointer position; a press on the handle without motion changes nothing."""
        if x == self._last_press[1][0] and self._on_handle and not self._dragged:
            return
        value = self.parameter.at((x - self._grip - self.rect.left) / max(self.rect.width, 1))
        if value != self.value:
            self._dragged = True
            self.change(value, final=False)

    def release(self) -> None:
        """End a drag, with a final event if the value has changed."""
        dragged = self.held and self._dragged
        super().release()
        if dragged:
            self.change(self.value, final=True)

    def draw(self) -> None:
        """Draw the widget on its surface."""
        size, track = WIDGET_TEXT_SIZE * self.ui_scale, self.rect
        y = self.row.top + 0.75 * size
        text, colour = self.parameter.text(self.value), self.text_colour
        value_width = draw_text(self.surface, text, (self.row.right, y), size, colour, "midright", mono=True).width
        label = ellipsis(self.parameter.label, size, self.row.width - value_width - size)
        draw_text(self.surface, label, (self.row.left, y), size, colour, "midleft")
        thickness = max(round(4 * self.ui_scale), 2)
        bar = pygame.Rect(track.left, track.centery - thickness // 2, track.width, thickness)
        pygame.draw.rect(self.surface, LINE, bar, border_radius=thickness)
        zero = self.parameter.fraction(0.0) if not self.parameter.log and self.parameter.low < 0 else 0.0
        ends = sorted(bar.left + round(part * bar.width) for part in (zero, self.fraction))
        bar.left, bar.width = ends[0], ends[1] - ends[0]
        pygame.draw.rect(self.surface, SKY if self.enabled else PANEL_RAISED, bar, border_radius=thickness)
        centre = track.left + round(self.fraction * track.width), track.centery
        radius = self.handle_radius if self.held or self.hovered else self.handle_radius - self.ui_scale
        draw_disc(self.surface, centre, radius, SKY if self.enabled else LINE)
        draw_disc(self.surface, centre, max(radius - 2.4 * self.ui_scale, 1), INK if self.enabled else PANEL_RAISED)


class OptionButton(ParameterWidget):
    """Button that cycles through options: forwards on a click, backwards on a right click or on its left end."""

    def contains(self, x: int, y: int) -> bool:
        """Return whether a position is on the button, excluding its label."""
        return bool(self._box.collidepoint(x, y))

    @property
    def _box(self) -> pygame.Rect:
        width = round(0.68 * self.rect.width)
        return pygame.Rect(self.rect.right - width, self.rect.top, width, self.rect.height)

    def click(self, event: pygame.event.Event) -> None:
        """Select the next or the previous option."""
        if self.contains(*event.pos) and self.parameter.choices:
            back = event.button == 3 or event.pos[0] < self._box.left + 0.25 * self._box.width
            self.change(self.parameter.stepped(self.value, -1 if back else 1), final=True)

    def draw(self) -> None:
        """Draw the widget on its surface."""
        size, box, colour = WIDGET_TEXT_SIZE * self.ui_scale, self._box, self.text_colour
        label = ellipsis(self.parameter.label, size, box.left - self.rect.left - 0.5 * size)
        draw_text(self.surface, label, (self.rect.left, box.centery), size, colour, "midleft")
        lit = self.hovered and self.enabled
        pygame.draw.rect(self.surface, LINE if lit else PANEL_RAISED, box, border_radius=round(4 * self.ui_scale))
        text = ellipsis(self.parameter.text(self.value), 0.95 * size, box.width - 2.2 * size)
        draw_text(self.surface, text, box.center, 0.95 * size, colour, "center")
        height, x = 0.28 * size, 0.6 * size
        for end, sign in ((box.left + x, -1), (box.right - x, 1)):
            tip = end + sign * height / 2, box.centery
            arrow = [(end - sign * height / 2, box.centery + dy) for dy in (-height, height)]
            stroke = max(round(1.6 * self.ui_scale), 1)
            pygame.draw.lines(self.surface, SKY if self.enabled else LINE, False, [arrow[0], tip, arrow[1]], stroke)
