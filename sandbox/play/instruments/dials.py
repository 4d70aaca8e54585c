"""Dials: what turns a knob, a slider for figures and a row of words for choices; made from those of pygame-widgets."""

from collections.abc import Sequence

import pygame
from pygame_widgets.slider import Slider  # type: ignore[import-untyped]  # the library ships no types

from sandbox.play.drawing.palette import INK, LINE, PANEL_RAISED, SKY
from sandbox.play.drawing.text import write
from sandbox.play.instruments.icons import draw_disc
from sandbox.play.instruments.knob import Knob, Value
from sandbox.play.instruments.plates import shortened
from sandbox.play.instruments.widgets import LETTERS, Control, Report

DOUBLE = 400
"""ms between the two presses of a double click, at most"""


class Dial(Control):
    """What sliders and choices share: a knob, and the value that is shown."""

    def __init__(self, surface: pygame.Surface, knob: Knob) -> None:
        super().__init__(surface)
        self.knob = knob
        self.now: Value = knob.value
        self.show_knob(knob)

    def show_knob(self, knob: Knob) -> None:
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

    def change(self, value: Value, final: bool) -> None:
        """Report a new value."""
        self.now = value
        self.reports.append(Report("change", self.knob.key, value, final))

    def turn(self, notches: int, at: tuple[int, int]) -> bool:
        """Change by notches of the wheel where the pointer is on what moves."""
        if not self.contains(*at) or not self.isEnabled():
            return False
        value = self.knob.stepped(self.now, notches)
        if value != self.now:
            self.change(value, final=True)
        return True


class KnobSlider(Dial, Slider):  # type: ignore[misc]  # the library ships no types
    """A slider: label and value above, the track below. The library's slider is its track, from 0 to 1."""

    def __init__(self, surface: pygame.Surface, knob: Knob) -> None:
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

    def show_knob(self, knob: Knob) -> None:
        """Take over what a knob says, without a report; what is being dragged keeps its value."""
        super().show_knob(knob)
        self.setValue(knob.share(self.now))

    def change(self, value: Value, final: bool) -> None:
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
        size, track = LETTERS * self.unit, self.rect
        middle = self.row.top + 0.75 * size
        text = self.knob.text(self.now)
        taken = write(self.win, text, (self.row.right, middle), size, self.ink, "midright", mono=True).width
        label = shortened(self.knob.label, size, self.row.width - taken - size)
        write(self.win, label, (self.row.left, middle), size, self.ink, "midleft")
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


class Choice(Dial):
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
        size, box = LETTERS * self.unit, self._box
        label = shortened(self.knob.label, size, box.left - self.rect.left - 0.5 * size)
        write(self.win, label, (self.rect.left, box.centery), size, self.ink, "midleft")
        lit = self.hovered and self.isEnabled()
        pygame.draw.rect(self.win, LINE if lit else PANEL_RAISED, box, border_radius=round(4 * self.unit))
        text = shortened(self.knob.text(self.now), 0.95 * size, box.width - 2.2 * size)
        write(self.win, text, box.center, 0.95 * size, self.ink, "center")
        reach, x = 0.28 * size, 0.6 * size
        for end, way in ((box.left + x, -1), (box.right - x, 1)):
            corners = [(end - way * reach / 2, box.centery - reach), (end + way * reach / 2, box.centery)]
            corners.append((corners[0][0], box.centery + reach))
            colour = SKY if self.isEnabled() else LINE
            pygame.draw.lines(self.win, colour, False, corners, max(round(1.6 * self.unit), 1))
