"""Score panel: how a game with rules stands, as a row of labelled figures, and how it ended."""

from typing import NamedTuple

import pygame

from sandbox.window.game_host import ScoreDisplay
from sandbox.window.render.palette import FAINT, GREEN, INK, LINE, WARNING
from sandbox.window.render.text import draw_box, draw_text, ellipsis, text_size, wrap_text
from sandbox.window.ui.icons import draw_disc

RIGHT = 66.0
"""px at unit 1 beside it, for how many pictures a second there are"""
NARROWEST = 300.0
TEXT_SIZES = (14.0, 12.5, 11.0)
"""px at unit 1: the largest at which all stands in one row; else the smallest"""
MOST_LINES = 8
MOST_ROWS = 3
"""beside the state of things; of more, it lies at the bottom, where it is wider"""


ScoreCell = tuple[str, str]
"""Label and text."""


class ScoreLayout(NamedTuple):
    """Where it lies, and what stands in it."""

    rect: pygame.Rect
    above: bool
    """whether it lies at the top"""
    rows: list[tuple[list[ScoreCell], list[int]]]
    """cells and their widths, px"""
    end: tuple[str, ...]
    """how the game ended"""
    size: float
    """px, of letters"""
    gap: int
    """px between cells"""

    def margins(self, area: pygame.Rect) -> tuple[int, int]:
        """Return the heights that the panel takes at the top and at the bottom of an area, px."""
        return (self.rect.bottom - area.top, 0) if self.above else (0, area.bottom - self.rect.top)


def layout_score(board: ScoreDisplay, free: pygame.Rect, left: int, unit: float) -> ScoreLayout:
    """Lay it at the top of what is free, or where that is too narrow, at the bottom.

    Args:
        board: what is shown.
        free: px, what it may cover.
        left: px, what else covers the top.
        unit: px of a pixel at 1080 lines.
    """
    scale = unit * min(1.0, free.width / (520.0 * unit), free.height / (360.0 * unit))
    margin = round(10 * scale)
    right = free.right - round(RIGHT * unit)
    above = right - left >= NARROWEST * unit
    rows, size, gap, room = _fitted(board, right - left, scale)
    if not above or len(rows) > MOST_ROWS:  # at the bottom it has the whole width
        above, left, right = False, free.left + margin, free.right - margin
        rows, size, gap, room = _fitted(board, right - left, scale)
    end = wrap_text(_told(board), size, room - 1.4 * size, 2, bold=True) if board.over is not None else ()
    wide = max(max(sum(cells) + gap * (len(cells) - 1) for _, cells in rows), *(_wide(line, size) for line in end), 0)
    high = _tall(size) * len(rows) + round(1.5 * size) * len(end) + round(0.9 * size)
    rect = pygame.Rect(0, 0, wide + 2 * _pad(size), high)
    rect.midtop = (left + right) // 2, free.top + margin
    if not above:
        rect.bottomleft = left, free.bottom - margin
    return ScoreLayout(rect, above, rows, tuple(end), size, gap)


def _fitted(
    board: ScoreDisplay, width: int, scale: float
) -> tuple[list[tuple[list[ScoreCell], list[int]]], float, int, int]:
    """Return the rows, the size of their letters, the gap between cells and the room in a row, px."""
    for letters in TEXT_SIZES:
        size = letters * scale
        gap, room = round(1.1 * size), width - 2 * _pad(size)
        rows = _rows(board, room, size, gap)
        if len(rows) == 1:
            break
    return rows, size, gap, room


def draw_score(surface: pygame.Surface, layout: ScoreLayout) -> None:
    """Draw the score panel."""
    rect, _, rows, end, size, gap = layout
    draw_box(surface, rect, 0.57 * size)
    y = rect.top + round(0.45 * size)
    for cells, widths in rows:
        _draw_cells(surface, cells, widths, (rect.left + _pad(size), y), size, gap)
        y += _tall(size)
    for k, line in enumerate(end):
        middle = y + (k + 0.5) * 1.5 * size
        if k == 0:
            draw_disc(surface, (rect.left + _pad(size) + 0.4 * size, middle), 0.3 * size, WARNING)
        draw_text(surface, line, (rect.left + _pad(size) + 1.2 * size, middle), size, INK, "midleft", bold=k == 0)


def _pad(size: float) -> int:
    return round(0.7 * size)


def _tall(size: float) -> int:
    return round(2.75 * size)


def _rows(board: ScoreDisplay, room: float, size: float, gap: int) -> list[tuple[list[ScoreCell], list[int]]]:
    """Return the cells in rows that fit, each with their widths, px; the score comes first."""
    cells = [("score", board.score), *board.lines[:MOST_LINES]]
    rows: list[tuple[list[ScoreCell], list[int]]] = [([], [])]
    for name, text in cells:
        label = name[:1].upper() + name[1:]
        text = ellipsis(text, 1.25 * size, room, mono=True)
        wide = max(text_size(label, 0.82 * size)[0], text_size(text, 1.25 * size, mono=True)[0])
        wide += -wide % round(1.5 * size)  # figures that change their length do not make all others jump
        if rows[-1][1] and sum(rows[-1][1]) + gap * len(rows[-1][1]) + wide > room:
            rows.append(([], []))
        rows[-1][0].append((label, text))
        rows[-1][1].append(wide)
    return rows


def _draw_cells(
    surface: pygame.Surface, cells: list[ScoreCell], widths: list[int], at: tuple[int, float], size: float, gap: int
) -> None:
    x, y = at
    for k, ((label, text), wide) in enumerate(zip(cells, widths, strict=True)):
        draw_text(surface, label, (x, y + 0.55 * size), 0.82 * size, FAINT, "midleft")
        warns = text.endswith("!")
        colour = WARNING if warns else GREEN if label == "score" else INK
        draw_text(surface, text, (x, y + 1.75 * size), 1.25 * size, colour, "midleft", bold=label == "score", mono=True)
        x += wide + gap
        if k < len(cells) - 1:
            line = x - gap // 2
            pygame.draw.line(surface, LINE, (line, y + 0.2 * size), (line, y + 2.35 * size))


def _told(board: ScoreDisplay) -> str:
    return f"{board.over}  ·  R: new game"


def _wide(line: str, size: float) -> int:
    return text_size(line, size, bold=True)[0] + round(1.3 * size)
