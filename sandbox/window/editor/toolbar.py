"""Tools of the editor, and its toolbar: a column of tool buttons at the left of the window, each with its key."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import pygame

from sandbox.window.render.palette import BACKGROUND, FAINT, INK, LINE, PANEL, PANEL_RAISED, SKY
from sandbox.window.render.text import draw_box, draw_hint, draw_text
from sandbox.window.ui.icons import icon

BUTTON_SIDE = 32
"""px at UI scale 1, side of a button"""
BUTTON_GAP = 3
"""px at UI scale 1 between buttons"""
MAX_COLUMNS = 4
GROUP_STARTS = ("ball", "plane", "rod", "thrust", "eraser")
"""Tools before which there is a wider gap"""


@dataclass(frozen=True)
class EditTool:
    """Tool of the editor."""

    name: str
    key: str
    """letter or digit that chooses it"""
    about: str


TOOLS = (
    EditTool("select", "v", "select, move, rotate, scale"),
    EditTool("ball", "b", "ball: drag from its centre"),
    EditTool("box", "x", "box: drag from corner to corner"),
    EditTool("capsule", "c", "capsule: drag from end to end"),
    EditTool("polygon", "y", "polygon: click its corners"),
    EditTool("plane", "l", "plane: drag along its surface; solid to the right"),
    EditTool("wall", "w", "wall: click its corners; Enter ends it"),
    EditTool("post", "t", "post: drag from its centre"),
    EditTool("zone", "z", "zone: click its corners"),
    EditTool("rod", "1", "rod: click two bodies, or a body and the world"),
    EditTool("pivot", "2", "pivot: click where two bodies lie on each other, or a wheel"),
    EditTool("rope", "3", "rope: click two bodies, or a body and the world"),
    EditTool("spring", "4", "spring: click two bodies, or a body and the world"),
    EditTool("motor", "5", "motor with its pivot: as a pivot"),
    EditTool("slide", "6", "slide: click two bodies, or a body and the world"),
    EditTool("groove", "7", "groove: click a body, and the other end of its path"),
    EditTool("gear", "8", "gear or belt: click two bodies"),
    EditTool("flipper", "9", "flipper: click a body at its hinge"),
    EditTool("plunger", "0", "plunger: drag back from a body"),
    EditTool("thrust", "f", "thrust: drag the arrow of a force from a body"),
    EditTool("attraction", "g", "attraction: click a point or a body"),
    EditTool("eraser", "e", "eraser: click or drag over elements"),
)
"""All tools, in the order of the toolbar."""


class Toolbar:
    """Column of tool buttons."""

    def __init__(self, tools: Sequence[EditTool] = TOOLS) -> None:
        self._tools = tuple(tools)
        self._rects: list[tuple[EditTool, pygame.Rect]] = []
        self._hovered: EditTool | None = None
        self._pressed: EditTool | None = None
        self._pointer = (0, 0)
        self.notes: dict[str, str] = {}
        """descriptions of tools in their present state, in place of their own, by name"""
        self.rect = pygame.Rect(0, 0, 0, 0)
        """px, as last laid out"""

    def layout(self, area: pygame.Rect, ui_scale: float) -> None:
        """Lay out the buttons in an area, px: in one column, or in as many more as it needs if it is too low."""
        side, gap, pad = round(BUTTON_SIDE * ui_scale), round(BUTTON_GAP * ui_scale), round(6 * ui_scale)
        free = area.height - 4 * pad
        columns = next((n for n in range(1, MAX_COLUMNS) if self._height(n, side, gap) <= free), MAX_COLUMNS)
        left, top = area.left + 2 * pad, area.top + 2 * pad
        self._rects, x, y, column = [], left, top, 0
        for tool in self._tools:
            if tool.name in GROUP_STARTS:
                y += (side + gap if column else 0) + 2 * gap
                x, column = left, 0
            self._rects.append((tool, pygame.Rect(x, y, side, side)))
            column += 1
            x += side + gap
            if column == columns:
                x, column = left, 0
                y += side + gap
        self.rect = self._rects[0][1].unionall([rect for _, rect in self._rects]).inflate(2 * pad, 2 * pad)

    def layout_row(self, corner: tuple[int, int], ui_scale: float) -> None:
        """Lay out the buttons in a row, with the upper left corner of the toolbar at a position, px."""
        side, gap, pad = round(BUTTON_SIDE * ui_scale), round(BUTTON_GAP * ui_scale), round(6 * ui_scale)
        left, top = corner[0] + pad, corner[1] + pad
        self._rects = [
            (tool, pygame.Rect(left + k * (side + gap), top, side, side)) for k, tool in enumerate(self._tools)
        ]
        self.rect = pygame.Rect(*corner, len(self._tools) * (side + gap) - gap + 2 * pad, side + 2 * pad)

    def _height(self, columns: int, side: int, gap: int) -> int:
        """Return the height of all groups, each of which begins in a row of its own, px."""
        names = [tool.name for tool in self._tools]
        starts = [0, *(k for k, name in enumerate(names) if name in GROUP_STARTS and k > 0), len(names)]
        rows = sum(-(-(end - begin) // columns) for begin, end in pairwise(starts))
        return rows * (side + gap) + 2 * gap * (len(starts) - 2)

    def tool_at(self, position: tuple[int, int]) -> EditTool | None:
        """Return the tool of the button at a position, px."""
        return next((tool for tool, rect in self._rects if rect.collidepoint(position)), None)

    def rect_of(self, name: str) -> pygame.Rect:
        """Return the rectangle of the button of a tool, px.

        Raises:
            KeyError: there is no such tool.
        """
        return {tool.name: rect for tool, rect in self._rects}[name]

    def handle_event(self, event: pygame.event.Event) -> tuple[bool, str | None]:
        """Process a mouse event; return whether it was consumed, and the name of a tool that is chosen."""
        if event.type == pygame.MOUSEMOTION:
            self._pointer, self._hovered = event.pos, self.tool_at(event.pos)
            return self._pressed is not None, None
        if event.type == pygame.MOUSEBUTTONDOWN and event.button <= 3:
            self._pressed = self.tool_at(event.pos) if event.button == 1 else None  # also after a lost release
            return self.rect.collidepoint(event.pos), None
        if event.type == pygame.MOUSEBUTTONUP and event.button == 1 and self._pressed is not None:
            pressed, self._pressed = self._pressed, None
            return True, pressed.name if self.tool_at(event.pos) is pressed else None
        return False, None

    def draw(self, surface: pygame.Surface, chosen: str, ui_scale: float) -> None:
        """Draw the toolbar; `chosen` is the name of the tool in use."""
        draw_box(surface, self.rect, 7 * ui_scale, PANEL, 235)
        for tool, rect in self._rects:
            is_chosen = tool.name == chosen
            fill = SKY if is_chosen else LINE if tool is self._hovered else PANEL_RAISED
            pygame.draw.rect(surface, fill, rect, border_radius=round(5 * ui_scale))
            colour = BACKGROUND if is_chosen else INK
            image = icon(tool.name, round(0.66 * rect.width), colour)
            surface.blit(image, image.get_rect(center=rect.center))
            if len(tool.key) == 1:
                corner = rect.right - 3 * ui_scale, rect.bottom - 1 * ui_scale
                colour = colour if is_chosen else FAINT
                draw_text(surface, tool.key.upper(), corner, 8.5 * ui_scale, colour, "bottomright")

    def draw_hint(self, surface: pygame.Surface, ui_scale: float) -> None:
        """Draw the tooltip of the button under the pointer."""
        if self._hovered is not None:
            tool = self._hovered
            at = self._pointer[0] + round(300 * ui_scale), self._pointer[1]
            key = tool.key.upper() if len(tool.key) == 1 else tool.key
            draw_hint(surface, f"{self.notes.get(tool.name, tool.about)} ({key})", at, ui_scale)
