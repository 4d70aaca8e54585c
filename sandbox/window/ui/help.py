"""Manual: the help overlay, every key and what the mouse does, those that the scene claims first."""

from collections.abc import Sequence
from typing import NamedTuple

import pygame

from sandbox.window.input.keymap import BINDINGS, Binding
from sandbox.window.render.palette import BACKGROUND, FAINT, INK, LINE, ORANGE, PANEL_RAISED, SKY
from sandbox.window.render.text import draw_box, draw_text, ellipsis, text_size

SIZES = (14.0, 13.0, 12.0, 11.0, 10.0, 9.0)
"""px at unit 1, of letters: the largest at which everything fits; at the smallest the wheel scrolls."""

HEAD = 3.7
"""heights of a letter that the title takes"""

LINE_STEP = 1.66
"""heights of a letter from line to line"""

MOUSE = (
    ("Wheel", "zoom at the cursor"),
    ("Right-drag", "pan"),
    ("Left-drag", "pull a body"),
    ("Left-drag, paused", "move a body"),
    ("Click", "select a body"),
)


CLAIMED = "This scene"
UNCLAIMABLE = ("P", "O", "F1", "Esc")


class HelpGroup(NamedTuple):
    """Keys that belong together."""

    title: str
    lines: tuple[tuple[str, str], ...]
    """keys, and what they do"""


def help_groups(claimed: Sequence[tuple[str, str]] = ()) -> tuple[HelpGroup, ...]:
    """Return all that help lists: what the scene claims, all bindings, the mouse."""
    titles = dict.fromkeys(binding.group for binding in BINDINGS)
    taken = {name for label, _ in claimed for name in _names(label)}
    ours = tuple(
        HelpGroup(title, tuple(_line(binding, taken) for binding in BINDINGS if binding.group == title))
        for title in titles
    )
    first = (HelpGroup(CLAIMED, tuple(claimed)),) if claimed else ()
    return (*first, *ours, HelpGroup("Mouse", MOUSE))


def _names(label: str) -> list[str]:
    """Return the keys that a label names: `S (hold)` is about S."""
    return [name.split(" (")[0].strip() for name in label.split(" or ")]


def _line(binding: Binding, taken: set[str]) -> tuple[str, str]:
    """Return a binding as help lists it, with what the scene leaves of its keys."""
    keys = [name for name in _names(binding.label) if name in UNCLAIMABLE or name not in taken]
    return (" or ".join(keys), binding.about) if keys else (binding.label, f"({binding.about})")


class HelpOverlay:
    """The overlay, open or closed."""

    def __init__(self) -> None:
        self.open = False
        self._scroll = 0.0

    def handle_event(self, event: pygame.event.Event) -> bool:
        """Close at any key or click, scroll by the wheel; tell whether the event was used up. Closed, nothing is."""
        if not self.open:
            return False
        if event.type == pygame.MOUSEWHEEL:
            self._scroll -= 3 * event.y
            return True
        if event.type == pygame.MOUSEBUTTONDOWN and event.button > 3:  # the wheel once more
            return True
        if event.type in (pygame.KEYDOWN, pygame.MOUSEBUTTONDOWN):
            self.open, self._scroll = False, 0.0
            return True
        return False

    def draw(self, surface: pygame.Surface, unit: float, claimed: Sequence[tuple[str, str]] = ()) -> None:
        """Draw the overlay over the whole picture, open or not."""
        draw_box(surface, surface.get_rect(), 0, BACKGROUND, 236, None)
        everything = help_groups(claimed)
        margin = round(min(28 * unit, 0.04 * min(surface.get_size())))
        free = surface.get_rect().inflate(-2 * margin, -2 * margin)
        size, columns = _fitted(everything, free, unit)
        tall = max(sum(_height(group, size) for group in column) for column in columns) + HEAD * size
        self._scroll = min(max(self._scroll, 0.0), max(tall - free.height, 0.0) / size)
        hint = "press any key to close" if tall <= free.height else "scroll for more · press any key to close"
        _draw_columns(surface, columns, free.move(0, -round(self._scroll * size)), size, hint)


Column = list[HelpGroup]


def _width(group: HelpGroup, size: float) -> tuple[int, int]:
    """Return how wide the keys of a group and the words beside them are."""
    keys = max(text_size(keys, 0.92 * size, mono=True)[0] for keys, _ in group.lines)
    words = max(text_size(words, size)[0] for _, words in group.lines)
    return keys + round(1.0 * size), words


def _height(group: HelpGroup, size: float) -> float:
    return (LINE_STEP * len(group.lines) + 2.9) * size


def _wide(column: Column, size: float) -> tuple[int, int]:
    widths = [_width(group, size) for group in column]
    return max(keys for keys, _ in widths), max(words for _, words in widths)


def _fitted(everything: Sequence[HelpGroup], free: pygame.Rect, unit: float) -> tuple[float, list[Column]]:
    """Return the largest letters at which everything fits, px, and the columns; at the smallest they may be longer."""
    for size in SIZES:
        columns = _columns(everything, free, size * unit)
        if columns is not None:
            return size * unit, _levelled(everything, free, size * unit, columns)
    smallest = SIZES[-1] * unit
    for times in (1.5, 2.0, 3.0, 5.0):
        columns = _columns(everything, pygame.Rect(free.topleft, (free.width, round(times * free.height))), smallest)
        if columns is not None:
            return smallest, columns
    return smallest, [list(everything)]


def _columns(everything: Sequence[HelpGroup], free: pygame.Rect, size: float) -> list[Column] | None:
    """Return groups in columns that fit a rectangle below the title, as few as can be, or None."""
    room = free.height - HEAD * size
    columns: list[Column] = [[]]
    filled = 0.0
    for group in everything:
        tall = _height(group, size)
        if tall > room:
            return None
        if filled + tall > room:
            columns.append([])
            filled = 0.0
        columns[-1].append(group)
        filled += tall
    total = sum(sum(_wide(column, size)) + 1.2 * size for column in columns) + 2.4 * size * (len(columns) - 1)
    return columns if total <= free.width else None


def _levelled(everything: Sequence[HelpGroup], free: pygame.Rect, size: float, columns: list[Column]) -> list[Column]:
    """Return as many columns, none taller than it has to be."""
    for percent in range(40, 100, 4):
        lower = pygame.Rect(free.left, free.top, free.width, free.height * percent // 100)
        found = _columns(everything, lower, size)
        if found is not None and len(found) == len(columns):
            return found
    return columns


def _draw_columns(surface: pygame.Surface, columns: list[Column], free: pygame.Rect, size: float, hint: str) -> None:
    widths = [_wide(column, size) for column in columns]
    gap = 2.4 * size
    total = sum(sum(width) + 1.2 * size for width in widths) + gap * (len(columns) - 1)
    tallest = max((sum(_height(group, size) for group in column) for column in columns), default=0.0)
    left = max(free.centerx - total / 2, free.left)
    top = max(free.centery - (tallest + HEAD * size) / 2, free.top)
    rect = draw_text(surface, "Keys", (left, top), 1.7 * size, INK, bold=True)
    hint = ellipsis(hint, size, free.right - rect.right - size)
    draw_text(surface, hint, (rect.right + size, rect.bottom - 0.25 * size), size, FAINT, "bottomleft")
    for column, (keys, words) in zip(columns, widths, strict=True):
        y = top + HEAD * size
        for group in column:
            _draw_group(surface, group, (left, y), keys, keys + words + 1.2 * size, size)
            y += _height(group, size)
        left += keys + words + 1.2 * size + gap


def _draw_group(
    surface: pygame.Surface, group: HelpGroup, at: tuple[float, float], keys: int, width: float, size: float
) -> None:
    left, y = at
    colour = ORANGE if group.title == CLAIMED else SKY
    draw_text(surface, group.title, at, size, colour, bold=True)
    line_y = round(y + 1.5 * size)
    pygame.draw.line(surface, LINE, (left, line_y), (left + width, line_y), max(round(size / 13), 1))
    y += 2.45 * size
    for label, about in group.lines:
        cap = pygame.Rect(0, 0, text_size(label, 0.92 * size, mono=True)[0] + round(0.8 * size), round(1.5 * size))
        cap.midleft = round(left), round(y)
        draw_box(surface, cap, 0.3 * size, PANEL_RAISED, 255, LINE)
        draw_text(surface, label, cap.center, 0.92 * size, INK, "center", mono=True)
        shade = FAINT if about.startswith("(") else INK  # the scene has the key
        draw_text(surface, about, (left + keys + 1.2 * size, y), size, shade, "midleft")
        y += LINE_STEP * size
