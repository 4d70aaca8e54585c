"""Column at the right of the window whose content scrolls: base of the side panel and of the property panel."""

import pygame

from sandbox.window.render.palette import LINE, PANEL, PANEL_RAISED
from sandbox.window.render.text import draw_hint

COLUMN_WIDTH = 264
"""px at UI scale 1"""
MAX_WIDTH_FRACTION = 0.6
"""largest fraction of the window's width that the column covers"""
SCROLL_STEP = 48
"""px at UI scale 1 per notch of the wheel"""
BAR_REACH = 9
"""px at UI scale 1 from the right edge, within which a press holds the scroll bar"""


class ScrollColumn:
    """Scrolling column with a cached drawing, the sheet, whose coordinates all positions have.

    A subclass lays out its content in `_lay_out`, which sets `_height`, and draws it in `_draw_content`.
    """

    def __init__(self, size: tuple[int, int], ui_scale: float) -> None:
        self.size, self.ui_scale = size, ui_scale
        self._sheet = pygame.Surface((1, 1))
        self._is_dirty = True  # whether the cached drawing may be outdated
        self._height = 0
        """px, of the content"""
        self._scroll = 0
        self._is_bar_held = False
        self._pointer: tuple[int, int] | None = None
        """None while the mouse is elsewhere"""
        self._pressed: set[int] = set()
        """mouse buttons that were pressed in the column and are still down"""

    @property
    def column_width(self) -> int:
        """Width of the column, px."""
        return max(min(round(COLUMN_WIDTH * self.ui_scale), round(MAX_WIDTH_FRACTION * self.size[0])), 1)

    @property
    def column_left(self) -> int:
        """Left end of the column in the window, px."""
        return self.size[0] - self.column_width

    def resize(self, size: tuple[int, int], ui_scale: float) -> None:
        """Lay out the column for a window of another size, px."""
        self.size, self.ui_scale = size, ui_scale
        self._sheet = pygame.Surface((self.column_width, max(size[1], 1)))
        self._lay_out()

    def _lay_out(self) -> None:
        """Compute the places of the content."""

    def _scroll_to(self, scroll: int) -> None:
        """Scroll to a position, px, which is clamped."""
        self._scroll = min(max(scroll, 0), max(self._height - self.size[1], 0))
        self._is_dirty = True

    def _is_on_bar(self, at: tuple[int, int]) -> bool:
        return self._height > self.size[1] and at[0] >= self.column_width - BAR_REACH * self.ui_scale

    def _drag_bar(self, at: tuple[int, int]) -> None:
        """Scroll so that the middle of the scroll bar is at a position."""
        self._scroll_to(round(at[1] / max(self.size[1], 1) * self._height - self.size[1] / 2))

    def handle_event(self, event: pygame.event.Event) -> bool:
        """Process an event; return whether it was consumed. Motion events are required: wheel events have no position.

        A press outside the column belongs to the scene view, as do the motion and the release that follow it.
        """
        if event.type in (pygame.WINDOWFOCUSLOST, pygame.WINDOWLEAVE):
            if event.type == pygame.WINDOWFOCUSLOST or not self._pressed:
                self.release()
            return False
        if event.type == pygame.MOUSEWHEEL and self._pointer is not None:
            self._turn_wheel(int(event.y))
            return True
        if event.type not in (pygame.MOUSEMOTION, pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP):
            return False
        at = event.pos[0] - self.column_left, event.pos[1]
        is_inside = bool(0 <= at[0] < self.column_width and 0 <= at[1] < self.size[1])
        self._pointer = at if is_inside or self._pressed else None
        if event.type == pygame.MOUSEBUTTONUP:
            is_ours = event.button in self._pressed
            self._pressed.discard(event.button)
        elif event.type == pygame.MOUSEBUTTONDOWN:
            is_ours = is_inside
            if is_ours and event.button <= 3:  # buttons from 4 up are wheel events
                self._pressed.add(event.button)
        else:
            is_ours = bool(self._pressed) or (is_inside and not any(getattr(event, "buttons", ())))
        self._handle_mouse(event, at, is_ours)
        return is_ours

    def _handle_mouse(self, event: pygame.event.Event, at: tuple[int, int], is_ours: bool) -> None:
        """Process a mouse event at a position; `is_ours` is false for events that belong to the scene view."""

    def _turn_wheel(self, notches: int) -> None:
        """Scroll."""
        self._scroll_to(self._scroll - round(notches * SCROLL_STEP * self.ui_scale))

    def release(self) -> None:
        """End a press or drag without a mouse event."""
        self._pressed.clear()
        self._pointer = None
        self._is_bar_held = False
        self._is_dirty = True

    def draw(self, surface: pygame.Surface) -> None:
        """Draw the column at the right of the window, with the tooltip of what is under the pointer."""
        if self._is_dirty:
            self._is_dirty = False
            self._draw_sheet()
        surface.blit(self._sheet, (self.column_left, 0))
        if self._pointer is not None and not self._pressed:
            hint = self._hint()
            if hint:
                draw_hint(surface, hint, (self.column_left + self._pointer[0], self._pointer[1]), self.ui_scale)

    def _hint(self) -> str:
        """Return the tooltip of what is under the pointer; empty without one."""
        return ""

    def _draw_sheet(self) -> None:
        """Draw the column on the cached surface, which most frames only blit."""
        sheet, ui_scale, height = self._sheet, self.ui_scale, self.size[1]
        sheet.fill(PANEL)
        self._draw_content(sheet)
        pygame.draw.line(sheet, LINE, (0, 0), (0, height), max(round(ui_scale), 1))
        if self._height > height:
            length, width = max(round(height**2 / self._height), round(16 * ui_scale)), round(5 * ui_scale)
            top = round(self._scroll / (self._height - height) * (height - length))
            bar = pygame.Rect(self.column_width - width - round(2 * ui_scale), top, width, length)
            pygame.draw.rect(sheet, LINE if self._is_bar_held else PANEL_RAISED, bar, border_radius=width)

    def _draw_content(self, sheet: pygame.Surface) -> None:
        """Draw the visible part of the content."""
