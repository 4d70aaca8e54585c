"""Help overlay: lists the keys of the scene, all other keys, and mouse actions."""

from collections.abc import Sequence
from typing import NamedTuple

import pygame

from sandbox.window.input.keymap import Command
from sandbox.window.render.palette import BACKGROUND, FAINT, INK, LINE, ORANGE, PANEL_RAISED, SKY
from sandbox.window.render.text import draw_box, draw_text, ellipsis, text_lines_width, text_size

TEXT_SIZES = (14.0, 13.0, 12.0, 11.0, 10.0, 9.0, 8.0)
"""px at UI scale 1: the largest size at which everything fits is used; at the smallest, the page can be scrolled"""

TITLE_HEIGHT = 3.7
"""in text heights"""

LINE_STEP = 1.66
"""in text heights"""

MOUSE_HELP = (
    ("Wheel", "zoom at the cursor"),
    ("Right-drag", "pan"),
    ("Left-drag", "pull a body"),
    ("Left-drag, paused", "move a body"),
    ("Click", "select a body"),
)


SCENE_GROUP = "This scene"
RESERVED_KEYS = ("P", "O", "F1", "Esc")


class HelpGroup(NamedTuple):
    """Keys under a common heading."""

    title: str
    lines: tuple[tuple[str, str], ...]
    """(keys, action)"""


def help_groups(
    scene_keys: Sequence[tuple[str, str]] = (), gamepad: Sequence[tuple[str, str]] = ()
) -> tuple[HelpGroup, ...]:
    """Return all groups: keys of the scene, gamepad, other bindings, and the mouse actions that the scene leaves."""
    titles = dict.fromkeys(command.group for command in Command)
    taken = {name for label, _ in scene_keys for name in _key_names(label)}
    own = tuple(
        HelpGroup(title, tuple(_command_line(command, taken) for command in Command if command.group == title))
        for title in titles
    )
    first = (HelpGroup(SCENE_GROUP, tuple(scene_keys)),) if scene_keys else ()
    second = (HelpGroup("Gamepad", tuple(gamepad)),) if gamepad else ()
    mouse = tuple(line for line in MOUSE_HELP if line[0].split(",")[0] not in taken)
    return (*first, *second, *own, HelpGroup("Mouse", mouse))


def _key_names(label: str) -> list[str]:
    """Return the keys in a label; `S (hold)` gives S."""
    return [name.split(" (")[0].strip() for name in label.split(" or ")]


def _command_line(command: Command, taken: set[str]) -> tuple[str, str]:
    """Return the line of a command without keys that the scene binds; in parentheses if none remains."""
    keys = [name for name in _key_names(command.label) if name in RESERVED_KEYS or name not in taken]
    return (" or ".join(keys), command.about) if keys else (command.label, f"({command.about})")


class HelpOverlay:
    """Overlay with the list of keys."""

    def __init__(self) -> None:
        self.open = False
        self._scroll = 0.0

    def handle_event(self, event: pygame.event.Event) -> bool:
        """Close on any key or click, scroll with the wheel; return whether the event was consumed."""
        if not self.open:
            return False
        if event.type == pygame.MOUSEWHEEL:
            self._scroll -= 3 * event.y
            return True
        if event.type == pygame.MOUSEBUTTONDOWN and event.button > 3:  # wheel events as buttons
            return True
        if event.type in (pygame.KEYDOWN, pygame.MOUSEBUTTONDOWN):
            self.open, self._scroll = False, 0.0
            return True
        return False

    def draw(
        self,
        surface: pygame.Surface,
        ui_scale: float,
        scene_keys: Sequence[tuple[str, str]] = (),
        gamepad: Sequence[tuple[str, str]] = (),
        groups: Sequence[HelpGroup] = (),
    ) -> None:
        """Draw the overlay over the whole window, regardless of `open`; `groups` replace all others, if given."""
        draw_box(surface, surface.get_rect(), 0, BACKGROUND, 236, None)
        groups = tuple(groups) or help_groups(scene_keys, gamepad)
        margin = round(min(28 * ui_scale, 0.04 * min(surface.get_size())))
        area = surface.get_rect().inflate(-2 * margin, -2 * margin)
        size, columns = _fit_columns(groups, area, ui_scale)
        height = max(sum(_group_height(group, size) for group in column) for column in columns) + TITLE_HEIGHT * size
        self._scroll = min(max(self._scroll, 0.0), max(height - area.height, 0.0) / size)
        hint = "press any key to close" if height <= area.height else "scroll for more · press any key to close"
        _draw_columns(surface, columns, area.move(0, -round(self._scroll * size)), size, hint)


HelpColumn = list[HelpGroup]


def _group_widths(group: HelpGroup, size: float) -> tuple[int, int]:
    """Return the widths of the keys and of the descriptions of a group, px."""
    keys, words = zip(*group.lines, strict=True)
    return text_lines_width(keys, 0.92 * size, mono=True) + round(1.0 * size), text_lines_width(words, size)


def _group_height(group: HelpGroup, size: float) -> float:
    return (LINE_STEP * len(group.lines) + 2.9) * size


def _column_widths(column: HelpColumn, size: float) -> tuple[int, int]:
    widths = [_group_widths(group, size) for group in column]
    return max(keys for keys, _ in widths), max(words for _, words in widths)


def _fit_columns(groups: Sequence[HelpGroup], area: pygame.Rect, ui_scale: float) -> tuple[float, list[HelpColumn]]:
    """Return the largest text size at which all groups fit, px, and the columns; at the smallest they may overflow."""
    for size in TEXT_SIZES:
        columns = _fill_columns(groups, area, size * ui_scale)
        if columns is not None:
            return size * ui_scale, _balance_columns(groups, area, size * ui_scale, columns)
    smallest = TEXT_SIZES[-1] * ui_scale
    for times in (1.5, 2.0, 3.0, 5.0):
        columns = _fill_columns(groups, pygame.Rect(area.topleft, (area.width, round(times * area.height))), smallest)
        if columns is not None:
            return smallest, columns
    return smallest, [list(groups)]


def _fill_columns(groups: Sequence[HelpGroup], area: pygame.Rect, size: float) -> list[HelpColumn] | None:
    """Return the groups in the fewest columns that fit an area below the title; None if they do not fit."""
    max_height = area.height - TITLE_HEIGHT * size
    columns: list[HelpColumn] = [[]]
    filled = 0.0
    for group in groups:
        height = _group_height(group, size)
        if height > max_height:
            return None
        if filled + height > max_height:
            columns.append([])
            filled = 0.0
        columns[-1].append(group)
        filled += height
    total = sum(sum(_column_widths(column, size)) + 1.2 * size for column in columns) + 2.4 * size * (len(columns) - 1)
    return columns if total <= area.width else None


def _balance_columns(
    groups: Sequence[HelpGroup], area: pygame.Rect, size: float, columns: list[HelpColumn]
) -> list[HelpColumn]:
    """Return the same number of columns with heights as equal as possible."""
    for percent in range(40, 100, 4):
        lower = pygame.Rect(area.left, area.top, area.width, area.height * percent // 100)
        found = _fill_columns(groups, lower, size)
        if found is not None and len(found) == len(columns):
            return found
    return columns


def _draw_columns(
    surface: pygame.Surface, columns: list[HelpColumn], area: pygame.Rect, size: float, hint: str
) -> None:
    widths = [_column_widths(column, size) for column in columns]
    gap = 2.4 * size
    total = sum(sum(width) + 1.2 * size for width in widths) + gap * (len(columns) - 1)
    tallest = max((sum(_group_height(group, size) for group in column) for column in columns), default=0.0)
    left = max(area.centerx - total / 2, area.left)
    top = max(area.centery - (tallest + TITLE_HEIGHT * size) / 2, area.top)
    rect = draw_text(surface, "Keys", (left, top), 1.7 * size, INK, bold=True)
    hint = ellipsis(hint, size, area.right - rect.right - size)
    draw_text(surface, hint, (rect.right + size, rect.bottom - 0.25 * size), size, FAINT, "bottomleft")
    for column, (keys, words) in zip(columns, widths, strict=True):
        y = top + TITLE_HEIGHT * size
        for group in column:
            _draw_group(surface, group, (left, y), keys, keys + words + 1.2 * size, size)
            y += _group_height(group, size)
        left += keys + words + 1.2 * size + gap


def _draw_group(
    surface: pygame.Surface, group: HelpGroup, position: tuple[float, float], keys: int, width: float, size: float
) -> None:
    left, y = position
    colour = ORANGE if group.title == SCENE_GROUP else SKY
    draw_text(surface, group.title, position, size, colour, bold=True)
    line_y = round(y + 1.5 * size)
    pygame.draw.line(surface, LINE, (left, line_y), (left + width, line_y), max(round(size / 13), 1))
    y += 2.45 * size
    for label, about in group.lines:
        cap = pygame.Rect(0, 0, text_size(label, 0.92 * size, mono=True)[0] + round(0.8 * size), round(1.5 * size))
        cap.midleft = round(left), round(y)
        draw_box(surface, cap, 0.3 * size, PANEL_RAISED, 255, LINE)
        draw_text(surface, label, cap.center, 0.92 * size, INK, "center", mono=True)
        shade = FAINT if about.startswith("(") else INK  # bound by the scene
        draw_text(surface, about, (left + keys + 1.2 * size, y), size, shade, "midleft")
        y += LINE_STEP * size
