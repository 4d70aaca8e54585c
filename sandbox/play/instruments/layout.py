"""Layout: where the widgets of the panel lie, one below the other."""

from collections.abc import Sequence
from typing import NamedTuple

import pygame

from sandbox.play.instruments.dials import Choice, Dial
from sandbox.play.instruments.widgets import Control, PushButton, Switch


class Heading(NamedTuple):
    """The name of a section, above it."""

    text: str
    top: int
    """px from the top of the content"""


class Layout(NamedTuple):
    """Places in the content, whose upper left corner is (0, 0); px."""

    places: tuple[tuple[Control, pygame.Rect], ...]
    """from top to bottom"""
    headings: tuple[Heading, ...]
    height: int


def arrange(
    buttons: Sequence[PushButton], dials: Sequence[Dial], switches: Sequence[Switch], width: int, unit: float
) -> Layout:
    """Lay widgets out in a column of a width: buttons, then dials, then switches in two columns where they fit."""
    pad = round(14 * unit)
    column = pygame.Rect(pad, pad, max(width - 2 * pad - round(4 * unit), 1), 0)
    places: list[tuple[Control, pygame.Rect]] = []
    headings: list[Heading] = []
    y = pad
    if buttons:
        y = _lay_buttons(buttons, column, y, unit, places) + round(8 * unit)
    if dials:
        headings.append(Heading("Settings", y))
        y += round(24 * unit)
        for dial in dials:
            high = round((27 if isinstance(dial, Choice) else 38) * unit)
            places.append((dial, pygame.Rect(column.left, y, column.width, high - round(4 * unit))))
            y += high
        y += round(8 * unit)
    if switches:
        headings.append(Heading("Show", y))
        y = _lay_switches(switches, column, y + round(24 * unit), unit, places)
    return Layout(tuple(places), tuple(headings), y + pad // 2)


def _lay_buttons(
    buttons: Sequence[PushButton],
    column: pygame.Rect,
    y: int,
    unit: float,
    places: list[tuple[Control, pygame.Rect]],
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
    switches: Sequence[Switch],
    column: pygame.Rect,
    y: int,
    unit: float,
    places: list[tuple[Control, pygame.Rect]],
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
