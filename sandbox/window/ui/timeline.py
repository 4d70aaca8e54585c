"""Timeline: seek bar at the bottom of the window."""

import math
from collections.abc import Sequence

import pygame

from sandbox.formatting import format_time
from sandbox.window.render.circles import draw_disc
from sandbox.window.render.palette import FAINT, INK, LINE, ORANGE, PANEL_RAISED, SKY
from sandbox.window.render.text import draw_box, draw_text, text_size

TIMELINE_HEIGHT = 34
"""px at UI scale 1"""


class Timeline:
    """Seek bar over the simulated time of a session or run, with a knob at the present."""

    def __init__(self) -> None:
        self.held = False
        """whether the knob is being dragged"""
        self._pointer: tuple[int, int] | None = None
        self._span = 0.0, 0.0
        self._step = 0.01
        self._ui_scale = 1.0

    def handle_event(self, event: pygame.event.Event, area: pygame.Rect) -> float | None:
        """Return the time selected by a press or a drag, s, or None.

        Args:
            event: any event; it is consumed if `held` is true before or after it.
            area: rectangle of the bar.
        """
        if event.type in (pygame.WINDOWFOCUSLOST, pygame.WINDOWLEAVE):
            self._pointer = None
            self.held = self.held and event.type == pygame.WINDOWLEAVE
        elif event.type == pygame.MOUSEMOTION:
            self._pointer = event.pos
            return self._time_at(event.pos[0], area) if self.held else None
        elif event.type == pygame.MOUSEBUTTONDOWN and event.button == 1 and area.collidepoint(event.pos):
            self.held = True
            return self._time_at(event.pos[0], area)
        elif event.type == pygame.MOUSEBUTTONUP and event.button == 1 and self.held:
            self.held = False
            return self._time_at(event.pos[0], area)
        return None

    def draw(
        self,
        surface: pygame.Surface,
        area: pygame.Rect,
        start: float,
        now: float,
        end: float,
        keyframes: Sequence[float] = (),
        ui_scale: float = 1.0,
        step: float = 0.01,
    ) -> None:
        """Draw the bar, unless the area is too small.

        Args:
            surface: the window.
            area: rectangle of the bar.
            start: first time, s.
            now: present time, s.
            end: last simulated time, s.
            keyframes: times of the keyframes, s.
            ui_scale: 1 on a display of 1080 lines.
            step: s, smallest difference that the labels show; there are at least 2 decimals.
        """
        self._step = step
        start, end = (time if math.isfinite(time) else 0.0 for time in (start, end))
        self._span, self._ui_scale = (start, max(start, end)), ui_scale
        track = self._track(area)
        if area.height < 6 or track.width < 4:
            return
        draw_box(surface, area, 6 * ui_scale)
        size = self._size(area)
        if track.left - area.left > 2 * size:  # space for labels
            draw_text(surface, self._text(now), (track.left - size, area.centery), size, INK, "midright", mono=True)
            draw_text(surface, self._text(end), (track.right + size, area.centery), size, FAINT, "midleft", mono=True)
        thickness = max(round(4 * ui_scale), 2)
        bar = pygame.Rect(track.left, area.centery - thickness // 2, track.width, thickness)
        pygame.draw.rect(surface, PANEL_RAISED, bar, border_radius=thickness)
        pygame.draw.rect(surface, LINE, bar, 1, border_radius=thickness)
        knob = self._x_of(now, track)
        bar.width = knob - bar.left
        pygame.draw.rect(surface, SKY, bar, border_radius=thickness)
        tick = max(round(5 * ui_scale), 2)
        for x in {self._x_of(time, track) for time in keyframes if start <= time <= end}:
            pygame.draw.line(surface, ORANGE, (x, bar.bottom + 1), (x, bar.bottom + tick), max(round(ui_scale), 1))
        radius = max(min(round((8 if self.held else 6.5) * ui_scale), area.height // 2), 2)
        draw_disc(surface, (knob, area.centery), radius, SKY)
        draw_disc(surface, (knob, area.centery), max(radius - 2.4 * ui_scale, 1), INK)
        self._draw_hover(surface, area, track, size)

    def _draw_hover(self, surface: pygame.Surface, area: pygame.Rect, track: pygame.Rect, size: float) -> None:
        if self._pointer is None or not (self.held or area.collidepoint(self._pointer)):
            return
        x = min(max(self._pointer[0], track.left), track.right)
        pygame.draw.line(surface, INK, (x, area.top + 3), (x, area.bottom - 4))
        text = self._text(self._time_at(x, area))
        width, height = text_size(text, size, mono=True)
        box = pygame.Rect(0, 0, width + round(size), height + round(0.5 * size))
        box.midbottom = x, area.top - round(3 * self._ui_scale)
        box.clamp_ip(surface.get_rect())
        draw_box(surface, box, 4 * self._ui_scale, opacity=240)
        draw_text(surface, text, box.center, size, INK, "center", mono=True)

    def _text(self, time: float) -> str:
        return format_time(time, self._step)

    def _size(self, area: pygame.Rect) -> float:
        return min(12.5 * self._ui_scale, 0.6 * area.height)

    def _track(self, area: pygame.Rect) -> pygame.Rect:
        """Return the rectangle of the track: between the labels if that leaves half of the bar, else the whole bar."""
        size = self._size(area)
        label_width = text_size(self._text(self._span[1]), size, mono=True)[0] + round(2 * size)
        edge = label_width if 4 * label_width <= area.width else round(0.8 * size)
        return pygame.Rect(area.left + edge, area.top, max(area.width - 2 * edge, 0), area.height)

    def _x_of(self, time: float, track: pygame.Rect) -> int:
        start, end = self._span
        fraction = (time - start) / (end - start) if end > start and math.isfinite(time) else 0.0
        return track.left + round(min(max(fraction, 0.0), 1.0) * track.width)

    def _time_at(self, x: float, area: pygame.Rect) -> float:
        start, end = self._span
        track = self._track(area)
        fraction = min(max((x - track.left) / max(track.width, 1), 0.0), 1.0)
        return end if fraction == 1.0 else start + fraction * (end - start)
