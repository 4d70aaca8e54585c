"""Widgets: what all of the panel's share, switches and buttons; made from the base of pygame-widgets.

How they differ from theirs: they live on events, not on the mouse's state once a frame, so that a press and release
within one frame count; they belong to whoever made them, not to the library's global list; and what happened to one
is kept in its `reports`, so that it holds nothing of its panel.
"""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import pygame
from pygame_widgets.widget import WidgetBase  # type: ignore[import-untyped]  # the library ships no types

from sandbox.play.drawing.palette import BACKGROUND, FAINT, INK, LINE, PANEL_RAISED, SKY, WARNING, Colour, mixed
from sandbox.play.drawing.text import measure, write
from sandbox.play.instruments.icons import icon
from sandbox.play.instruments.knob import Value
from sandbox.play.instruments.plates import shortened

LETTERS = 12.5
"""px at unit 1"""


class Report(NamedTuple):
    """What somebody did to a widget."""

    kind: Literal["change", "toggle", "button"]
    name: str
    value: Value | bool = True
    final: bool = True
    """not while a slider is still dragged"""


class Control(WidgetBase):  # type: ignore[misc]  # the library ships no types
    """What all widgets share. Positions of events are those on the surface that it is drawn on."""

    def __init__(self, surface: pygame.Surface) -> None:
        super().__init__(surface, 0, 0, 0, 0)
        self.setIsSubWidget(True)  # out of the library's global list
        self.unit = 1.0
        self.held = False
        self.hovered = False
        self.reports: list[Report] = []
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
        return INK if self.isEnabled() else mixed(FAINT, BACKGROUND, 0.35)


class Switch(Control):
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
            self.reports.append(Report("toggle", self.name, self.on))

    def draw(self) -> None:
        """Draw it on its surface."""
        size, rect = LETTERS * self.unit, self.rect
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
        keyed = measure(self.key, 0.85 * size, mono=True)[0] + round(0.6 * size) if self.key else 0
        write(self.win, self.key, (rect.right, rect.centery), 0.85 * size, FAINT, "midright", mono=True)
        label = shortened(self.label, size, rect.right - keyed - left)
        write(self.win, label, (left, rect.centery), size, INK if self.on else FAINT, "midleft")


class PushButton(Control):
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
            self.reports.append(Report("button", self.name))

    def draw(self) -> None:
        """Draw it on its surface."""
        rect = self.rect
        colour = mixed(PANEL_RAISED, SKY, 0.45) if self.held else LINE if self.hovered else PANEL_RAISED
        pygame.draw.rect(self.win, colour, rect, border_radius=round(5 * self.unit))
        side = round(0.62 * min(rect.size))
        picture = icon(self.name, side, WARNING if self.name in ("record", "stop") else INK)
        if picture is not None:
            self.win.blit(picture, picture.get_rect(center=rect.center))
        else:
            size = LETTERS * self.unit
            write(self.win, shortened(self.name, size, rect.width - size), rect.center, size, INK, "center")
