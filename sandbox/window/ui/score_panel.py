"""Score panel: score and status of a game as rows of labelled values, and the result of the game."""

from typing import NamedTuple

import pygame

from sandbox.window.game_host import ScoreDisplay
from sandbox.window.render.circles import draw_disc
from sandbox.window.render.palette import FAINT, GREEN, INK, LINE, WARNING
from sandbox.window.render.text import draw_box, draw_text, ellipsis, text_size, wrap_text

FRAME_RATE_WIDTH = 66.0
"""px at UI scale 1, reserved at the right for the frame rate"""
MIN_TOP_WIDTH = 300.0
"""px at UI scale 1, width below which the panel is placed at the bottom"""
TEXT_SIZES = (14.0, 12.5, 11.0)
"""px at UI scale 1: the largest that gives a single row, else the smallest"""
SCORE = "score"
"""label of the first value"""
MAX_LINES = 8
"""largest number of values besides the score"""
MAX_TOP_ROWS = 3
"""number of rows next to the status plate above which the panel is placed at the bottom, where it is wider"""


ScoreCell = tuple[str, str]
"""(label, text)"""


class ScoreLayout(NamedTuple):
    """Position and content of the score panel."""

    rect: pygame.Rect
    above: bool
    """whether the panel is at the top"""
    rows: list[tuple[list[ScoreCell], list[int]]]
    """cells and their widths, px, for each row"""
    end: tuple[str, ...]
    """lines about the result"""
    size: float
    """text size, px"""
    gap: int
    """px between cells"""

    def margins(self, area: pygame.Rect) -> tuple[int, int]:
        """Return the heights that the panel covers at the top and at the bottom of an area, px."""
        return (self.rect.bottom - area.top, 0) if self.above else (0, area.bottom - self.rect.top)


def layout_score(display: ScoreDisplay, area: pygame.Rect, left: int, ui_scale: float) -> ScoreLayout:
    """Lay out the panel at the top of an area, or at the bottom if the top is too narrow.

    Args:
        display: score and values.
        area: px, part of the window that the panel may cover.
        left: px, right edge of the status plate at the top.
        ui_scale: 1 on a display of 1080 lines.
    """
    scale = ui_scale * min(1.0, area.width / (520.0 * ui_scale), area.height / (360.0 * ui_scale))
    margin = round(10 * scale)
    right = area.right - round(FRAME_RATE_WIDTH * ui_scale)
    above = right - left >= MIN_TOP_WIDTH * ui_scale
    rows, size, gap, max_width = _fit_rows(display, right - left, scale)
    if not above or len(rows) > MAX_TOP_ROWS:  # the bottom has the full width
        above, left, right = False, area.left + margin, area.right - margin
        rows, size, gap, max_width = _fit_rows(display, right - left, scale)
    end = wrap_text(_end_text(display), size, max_width - 1.4 * size, 2, bold=True) if display.over is not None else ()
    width = max(
        max(sum(cells) + gap * (len(cells) - 1) for _, cells in rows), *(_line_width(line, size) for line in end), 0
    )
    height = _row_height(size) * len(rows) + round(1.5 * size) * len(end) + round(0.9 * size)
    rect = pygame.Rect(0, 0, width + 2 * _pad(size), height)
    rect.midtop = (left + right) // 2, area.top + margin
    if not above:
        rect.bottomleft = left, area.bottom - margin
    return ScoreLayout(rect, above, rows, tuple(end), size, gap)


def _fit_rows(
    display: ScoreDisplay, width: int, scale: float
) -> tuple[list[tuple[list[ScoreCell], list[int]]], float, int, int]:
    """Return the rows, their text size, the gap between cells and the width available for a row, px."""
    for letter_size in TEXT_SIZES:
        size = letter_size * scale
        gap, max_width = round(1.1 * size), width - 2 * _pad(size)
        rows = _rows(display, max_width, size, gap)
        if len(rows) == 1:
            break
    return rows, size, gap, max_width


def draw_score(surface: pygame.Surface, layout: ScoreLayout) -> None:
    """Draw the score panel."""
    rect, _, rows, end, size, gap = layout
    draw_box(surface, rect, 0.57 * size)
    y = rect.top + round(0.45 * size)
    for cells, widths in rows:
        _draw_cells(surface, cells, widths, (rect.left + _pad(size), y), size, gap)
        y += _row_height(size)
    for k, line in enumerate(end):
        middle = y + (k + 0.5) * 1.5 * size
        if k == 0:
            draw_disc(surface, (rect.left + _pad(size) + 0.4 * size, middle), 0.3 * size, WARNING)
        draw_text(surface, line, (rect.left + _pad(size) + 1.2 * size, middle), size, INK, "midleft", bold=k == 0)


def _pad(size: float) -> int:
    return round(0.7 * size)


def _row_height(size: float) -> int:
    return round(2.75 * size)


def _rows(display: ScoreDisplay, max_width: float, size: float, gap: int) -> list[tuple[list[ScoreCell], list[int]]]:
    """Return the cells in as few rows as fit, of about equal widths, with the widths of cells, px; score first."""
    cells: list[ScoreCell] = []
    widths: list[int] = []
    grain = round(1.5 * size)  # widths are rounded up, so that a value of another length does not move other cells
    lines = [line for line in display.lines if line[0].lower() != SCORE]  # rules may state it again
    for name, text in [(SCORE, display.score), *lines[:MAX_LINES]]:
        label = name[:1].upper() + name[1:]
        text = ellipsis(text, 1.25 * size, max_width, mono=True)
        width = max(text_size(label, 0.82 * size)[0], text_size(text, 1.25 * size, mono=True)[0])
        cells.append((label, text))
        widths.append(-(-width // grain) * grain)
    ends = _row_ends(widths, max_width, gap)
    narrower = max_width - grain
    while narrower >= max(widths) and len(balanced := _row_ends(widths, narrower, gap)) == len(ends):
        ends, narrower = balanced, narrower - grain
    starts = [0, *ends[:-1]]
    return [(cells[a:b], widths[a:b]) for a, b in zip(starts, ends, strict=True)]


def _row_ends(widths: list[int], max_width: float, gap: int) -> list[int]:
    """Return the index after the last cell of each row, filling one row after the other."""
    ends: list[int] = []
    start = 0
    for k in range(1, len(widths) + 1):
        if k > start + 1 and sum(widths[start:k]) + gap * (k - start - 1) > max_width:
            ends.append(k - 1)
            start = k - 1
    return [*ends, len(widths)]


def _draw_cells(
    surface: pygame.Surface,
    cells: list[ScoreCell],
    widths: list[int],
    position: tuple[int, float],
    size: float,
    gap: int,
) -> None:
    x, y = position
    for k, ((label, text), width) in enumerate(zip(cells, widths, strict=True)):
        draw_text(surface, label, (x, y + 0.55 * size), 0.82 * size, FAINT, "midleft")
        warns = text.endswith("!")
        is_score = label == "Score"
        colour = WARNING if warns else GREEN if is_score else INK
        draw_text(surface, text, (x, y + 1.75 * size), 1.25 * size, colour, "midleft", bold=is_score, mono=True)
        x += width + gap
        if k < len(cells) - 1:
            line = x - gap // 2
            pygame.draw.line(surface, LINE, (line, y + 0.2 * size), (line, y + 2.35 * size))


def _end_text(display: ScoreDisplay) -> str:
    return f"{display.over}  ·  R: new game" if display.can_restart else f"{display.over}"


def _line_width(line: str, size: float) -> int:
    return text_size(line, size, bold=True)[0] + round(1.3 * size)
