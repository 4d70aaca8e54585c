"""Head-up display: status lines, messages, values of the selected body, and faults of the scene file."""

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple

import pygame

from sandbox.formatting import format_percent, format_si, format_time
from sandbox.window.playback.snapshot import HudStatus
from sandbox.window.render.circles import draw_disc
from sandbox.window.render.palette import FAINT, GREEN, INK, ORANGE, PANEL, SKY, VERMILION, WARNING, RgbColour
from sandbox.window.render.text import (
    draw_box,
    draw_text,
    draw_text_lines,
    ellipsis,
    text_lines_width,
    text_size,
    wrap_text,
)

MAX_SPEED_ERROR = 0.10
"""relative difference between real and requested speed above which both are shown"""
MAX_SHOWN_MESSAGES = 4
"""number of the newest messages that are shown"""
FULL_SIZE_AREA = 460, 320
"""px at UI scale 1, area below which text is scaled down"""
MIN_TEXT_SIZE = 9.0
"""px, smallest legible text size"""

MAX_STATUS_HEIGHT_FRACTION = 0.4
"""largest height of the status plate as a fraction of the area"""
MIN_MESSAGE_WIDTH = 14.0
"""width in text heights below which a message is placed above another plate rather than beside it"""

MAX_RANK_BESIDE_FAULTS = 2
"""highest rank of rows that are shown together with faults of a scene file"""

PAUSE_LINE = "PAUSED  (P or Space)"
"""the longest pause line"""

Mark = Literal["", "disc", "triangle", "ring", "bars"]


class HudRow(NamedTuple):
    """One row of the status plate."""

    text: str
    colour: RgbColour = INK
    mark: Mark = ""
    """shape before the text, because a state must not be shown by colour alone"""
    bold: bool = False
    mono: bool = False
    rank: int = 5
    """priority: rows of the highest ranks are dropped first if space is short"""


def hud_rows(status: HudStatus) -> tuple[HudRow, ...]:
    """Return the rows of the status plate from top to bottom."""
    title = f"{status.title}  ·  replay" if status.replay else status.title
    step = status.time / status.step if status.step else 0.01
    found = [
        HudRow(title, bold=True, rank=4),
        HudRow(f"{status.engine}  ·  {status.settings}", FAINT, rank=1),
        HudRow(f"step {status.step:,}   {format_time(status.time, step)}", mono=True, rank=0),
    ]
    if status.ended is not None:
        found.append(HudRow(f"ENDED: {status.ended} (R: restart)", WARNING, "triangle", bold=True, rank=2))
    elif status.unfocused:
        found.append(HudRow("PAUSED  (no focus)", WARNING, "bars", bold=True, rank=2))
    elif status.paused:
        space_claimed = any("space" in key.lower() for key, _ in status.claimed)
        found.append(HudRow("PAUSED  (P)" if space_claimed else PAUSE_LINE, WARNING, "bars", bold=True, rank=2))
    found += _speed_rows(status) + _prediction_rows(status)
    if status.recording is not None:
        found.append(HudRow(f"recording {status.recording}", WARNING, "disc", rank=3))
    if status.busy is not None:
        found.append(HudRow(status.busy, SKY, "ring", rank=3))
    return tuple(found)


def _speed_rows(status: HudStatus) -> list[HudRow]:
    asked, real = status.speed, status.real_speed
    still = status.paused or status.ended is not None
    apart = not still and math.isfinite(real) and abs(real - asked) > MAX_SPEED_ERROR * abs(asked)
    if apart:
        return [HudRow(f"speed {format_percent(asked)}, running at {format_percent(real)}", ORANGE, rank=4)]
    return [] if asked == 1 else [HudRow(f"speed {format_percent(asked)}", rank=5)]


def _prediction_rows(status: HudStatus) -> list[HudRow]:
    """Return the rows about predictability, ghost and missed contacts."""
    found = []
    if status.trust == "trusted":
        found.append(HudRow("predictable", GREEN, "disc", rank=6))
    elif status.trust == "lost":
        since = "" if status.horizon is None else f" (since {format_time(status.horizon)})"
        found.append(HudRow(f"no longer predictable{since}", WARNING, "triangle", rank=3))
    if status.ghost is not None:
        away = "" if status.distance is None else f": {format_si(status.distance, 'm')} away"
        found.append(HudRow(f"ghost {status.ghost}{away}", INK, "ring", rank=6))
    if status.missed is not None:
        noun = "contact" if status.missed == 1 else "contacts"
        missing = status.missed > 0
        text = f"{status.missed} missed {noun}" if missing else "no missed contacts"
        found.append(
            HudRow(text, VERMILION if missing else FAINT, "triangle" if missing else "", rank=4 if missing else 8)
        )
    return found


class HudText(NamedTuple):
    """Layout of the status plate."""

    rect: pygame.Rect
    """rectangle of the plate; empty if no row fits"""
    lines: tuple[tuple[HudRow, str], ...]
    """rows and their text, truncated to fit"""


def _scale_area(area: pygame.Rect, ui_scale: float) -> tuple[pygame.Rect, float]:
    """Return the area without its margin, and the text size, px; both are scaled down in a small area."""
    scale = ui_scale * min(
        max(min(area.width / (FULL_SIZE_AREA[0] * ui_scale), area.height / (FULL_SIZE_AREA[1] * ui_scale)), 0.4), 1.0
    )
    margin = -2 * round(max(10 * scale, 3))
    return area.inflate(margin, margin), max(13.5 * scale, MIN_TEXT_SIZE)


def layout_rows(status: HudStatus, area: pygame.Rect, ui_scale: float, taken: Sequence[pygame.Rect] = ()) -> HudText:
    """Lay out the status plate at the upper left of an area, next to the rectangles in `taken`.

    Rows of the highest ranks are dropped if the plate would exceed `MAX_STATUS_HEIGHT_FRACTION` of the area.
    """
    area, size = _scale_area(area, ui_scale)
    shown = hud_rows(status)
    if status.faults:
        shown = tuple(row for row in shown if row.rank <= MAX_RANK_BESIDE_FAULTS)
    pad, line_height = _pad(size), round(1.42 * size)
    available = pygame.Rect(
        area.topleft,
        (area.width, min(area.height, max(round(MAX_STATUS_HEIGHT_FRACTION * area.height), 5 * line_height))),
    )
    for each in taken:
        if each.top < available.bottom and each.left > area.left + 8 * size:
            available.width = min(available.width, each.left - round(0.5 * size) - area.left)
    count = (available.height - 2 * pad) // line_height
    if count < 1 or area.width < 2 * size or area.height < size:
        return HudText(pygame.Rect(area.topleft, (0, 0)), ())
    least = sorted(row.rank for row in shown)[:count][-1]
    visible_rows = [row for row in shown if row.rank <= least][:count]
    indent, width = round(1.3 * size), available.width - 2 * pad
    texts = [ellipsis(row.text, size, width - (indent if row.mark else 0), row.bold, row.mono) for row in visible_rows]
    widest = max(
        text_size(text, size, row.bold, row.mono)[0] + (indent if row.mark else 0)
        for row, text in zip(visible_rows, texts, strict=True)
    )
    grain = round(2 * size)  # keeps the width constant while digits change
    rect = pygame.Rect(
        area.topleft, (min(-(-widest // grain) * grain, width) + 2 * pad, len(visible_rows) * line_height + 2 * pad)
    )
    return HudText(rect, tuple(zip(visible_rows, texts, strict=True)))


def draw_hud(
    surface: pygame.Surface,
    status: HudStatus,
    visible: pygame.Rect,
    ui_scale: float,
    taken: Sequence[pygame.Rect] = (),
    scale_bar: pygame.Rect | None = None,
    field: pygame.Rect | None = None,
) -> dict[str, pygame.Rect]:
    """Draw all plates of the head-up display; plates without space are dropped, the least important first.

    Args:
        surface: the window.
        status: the values to show.
        visible: area of the window that nothing covers, px.
        ui_scale: 1 on a display of 1080 lines.
        taken: rectangles of other plates, which are kept free.
        scale_bar: at the lower left; messages are drawn beside it.
        field: of a playing field, which messages leave free if there is enough space to its left.

    Returns:
        The rectangles of the plates, px, by name; empty ones of those that are not drawn.
    """
    area, size = _scale_area(visible, ui_scale)
    if area.width < 2 * size or area.height < size:
        return {}
    rows = layout_rows(status, visible, ui_scale, taken)
    _draw_rows(surface, rows, size)
    plates = {"state": rows.rect, "rate": _draw_rate(surface, status, area, [rows.rect, *taken], size)}
    if status.faults:
        top = rows.rect.bottom + _pad(size)
        below = pygame.Rect(area.left, top, area.width, area.bottom - top)
        plates["faults"] = _draw_faults(surface, status.faults, below if below.height > 6 * size else area, size)
        return plates
    plates["picked"] = _draw_picked(surface, status.picked, area, [rows.rect, plates["rate"], *taken], size)
    others = [rows.rect, plates["rate"], plates["picked"], *taken]
    message_area = _message_area(area, scale_bar, field, size)
    for k, rect in enumerate(draw_messages(surface, status.messages, message_area, others, size)):
        plates[f"message {k}"] = rect
    if status.question is not None:
        draw_notice(surface, status.question, area, size, WARNING)
    elif status.waits_for_start:
        on_field = area if field is None or not area.colliderect(field) else area.clip(field)
        draw_notice(surface, "Press Space to start", on_field, 1.5 * size, SKY, status.start_keys)
    elif status.out_of_sight is not None:
        draw_notice(surface, status.out_of_sight, area, size, SKY)
    return plates


def hud_width(longest: str, ui_scale: float) -> int:
    """Return the right edge of the status plate at full size, px, given its longest line.

    The plate is at least as wide as the pause line.
    """
    size = 13.5 * ui_scale
    paused = text_size(PAUSE_LINE, size, bold=True)[0] + round(1.3 * size)
    width = max(text_size(longest, size)[0] + round(2 * size), paused + round(0.5 * size))
    return round(10 * ui_scale) + width + 2 * _pad(size)


def _pad(size: float) -> int:
    return round(0.6 * size)


def _draw_rows(surface: pygame.Surface, rows: HudText, size: float) -> None:
    """Draw the status plate."""
    pad, line_height, rect = _pad(size), round(1.42 * size), rows.rect
    draw_box(surface, rect, 0.5 * size)
    for k, (row, text) in enumerate(rows.lines):
        middle = rect.top + pad + (k + 0.5) * line_height
        left = rect.left + pad
        if row.mark:
            draw_mark(surface, row.mark, (left + 0.42 * size, middle), 0.4 * size, row.colour)
            left += round(1.3 * size)
        colour = INK if row.colour == GREEN else row.colour
        draw_text(surface, text, (left, middle), size, colour, "midleft", row.bold, row.mono)


def draw_mark(
    surface: pygame.Surface, mark: Mark, position: tuple[float, float], radius: float, colour: RgbColour
) -> None:
    """Draw the shape before a row."""
    x, y = position
    width = max(round(0.4 * radius), 1)
    if mark == "disc":
        draw_disc(surface, position, radius, colour)
    elif mark == "ring":
        draw_disc(surface, position, radius, colour, 0.55 * radius)
    elif mark == "triangle":
        corners = [(x, y - radius), (x + 1.1 * radius, y + 0.9 * radius), (x - 1.1 * radius, y + 0.9 * radius)]
        pygame.draw.polygon(surface, colour, corners)
        pygame.draw.aalines(surface, colour, True, corners)
        pygame.draw.line(surface, PANEL, (x, y - 0.35 * radius), (x, y + 0.3 * radius), width)
    elif mark == "bars":
        for side in (-0.75, 0.2):
            pygame.draw.rect(surface, colour, (x + side * radius, y - radius, 0.65 * radius, 2 * radius))


def draw_notice(
    surface: pygame.Surface, text: str, area: pygame.Rect, size: float, edge: RgbColour, detail: str = ""
) -> None:
    """Draw a notice in the centre of the area, with details below it in small letters."""
    lines = wrap_text(text, size, area.width - 2 * size, 3, bold=True)
    small = 0.62 * size
    details = wrap_text(detail, small, area.width - 2 * size, 4) if detail else ()
    line_height, small_height = round(1.4 * size), round(1.5 * small)
    width = max(text_lines_width(lines, size, bold=True), text_lines_width(details, small))
    height = len(lines) * line_height + len(details) * small_height + round(size)
    rect = pygame.Rect(0, 0, width + 2 * round(size), height)
    rect.center = area.center
    draw_box(surface, rect, 0.5 * size, opacity=244, edge=edge)
    x, y = rect.centerx, rect.top + 0.5 * size
    draw_text_lines(surface, details, (x, y + len(lines) * line_height), small_height, small, FAINT, "center")
    draw_text_lines(surface, lines, (x, y), line_height, size, INK, "center", bold=True)


def _draw_rate(
    surface: pygame.Surface, status: HudStatus, area: pygame.Rect, taken: Sequence[pygame.Rect], size: float
) -> pygame.Rect:
    """Draw the frame rate at the upper right; return its rectangle."""
    nothing = pygame.Rect(0, 0, 0, 0)
    if not (math.isfinite(status.frames_per_second) and status.frames_per_second > 0):
        return nothing
    text, small = f"{status.frames_per_second:.0f} fps", max(0.8 * size, MIN_TEXT_SIZE)
    width, height = text_size(text, small, mono=True)
    rect = pygame.Rect(area.right - width, area.top, width, height).inflate(_pad(size), 0)
    if rect.left < area.left or rect.bottom > area.bottom or rect.inflate(size, 0).collidelist(list(taken)) >= 0:
        return nothing
    draw_box(surface, rect, 0.3 * size, opacity=120, edge=None)
    draw_text(surface, text, rect.center, small, FAINT, "center", mono=True)
    return rect


def _draw_picked(
    surface: pygame.Surface, lines: tuple[str, ...], area: pygame.Rect, taken: Sequence[pygame.Rect], size: float
) -> pygame.Rect:
    """Draw the values of the selected body at the upper right or below other plates; return their rectangle."""
    nothing = pygame.Rect(0, 0, 0, 0)
    if not lines:
        return nothing
    small, pad = max(0.93 * size, MIN_TEXT_SIZE), _pad(size)
    line_height = round(1.4 * small)
    texts = [ellipsis(text, small, area.width - 2 * pad, k == 0, k > 0) for k, text in enumerate(lines)]
    width = max(text_size(text, small, k == 0, k > 0)[0] for k, text in enumerate(texts)) + 2 * pad
    rect = pygame.Rect(area.right - width, area.top + round(1.6 * size), width, len(texts) * line_height + 2 * pad)
    tops = sorted({rect.top, *(each.bottom + pad for each in taken if each.height)})
    candidates = [rect.move(dx, top - rect.top) for dx in (0, area.left - rect.left) for top in tops]
    found = [
        each
        for each in candidates
        if each.bottom <= area.bottom and each.inflate(pad, pad // 2).collidelist(list(taken)) < 0
    ]
    if not found:
        return nothing
    rect = found[0]
    draw_box(surface, rect, 0.5 * size)
    for k, text in enumerate(texts):
        position = rect.left + pad, rect.top + pad + (k + 0.5) * line_height
        draw_text(surface, text, position, small, INK, "midleft", bold=k == 0, mono=k > 0)
    return rect


def _message_area(
    area: pygame.Rect, scale_bar: pygame.Rect | None, field: pygame.Rect | None, size: float
) -> pygame.Rect:
    """Return the area for messages: beside the scale bar and left of the field, as far as both leave enough width."""
    left, right = area.left, area.right
    if field is not None and field.left - _pad(size) - left >= round(MIN_MESSAGE_WIDTH * size):
        right = min(right, field.left - _pad(size))
    if scale_bar is not None and right - scale_bar.right - _pad(size) >= round(MIN_MESSAGE_WIDTH * size):
        left = max(left, scale_bar.right + _pad(size))
    return pygame.Rect(left, area.top, right - left, area.height)


def draw_messages(
    surface: pygame.Surface,
    messages: tuple[tuple[str, str], ...],
    area: pygame.Rect,
    taken: Sequence[pygame.Rect],
    size: float,
) -> list[pygame.Rect]:
    """Draw the newest messages at the lower left, beside or above other plates; return their rectangles."""
    narrowest = round(MIN_MESSAGE_WIDTH * size)
    pad, line_height, mark_room = _pad(size), round(1.35 * size), round(1.6 * size)
    drawn: list[pygame.Rect] = []
    bottom = area.bottom
    for level, text in reversed(messages[-MAX_SHOWN_MESSAGES:]):
        colour = {"warning": ORANGE, "error": WARNING}.get(level, SKY)
        mark: Mark = "triangle" if level in ("warning", "error") else "disc"
        slot = pygame.Rect(area.left, 0, min(area.width, round(44 * size)), 2 * line_height + 2 * pad)
        slot.bottom = bottom
        for each in taken:
            if each.colliderect(slot) and each.left - area.left >= narrowest:
                slot.width = min(slot.width, each.left - pad - area.left)
        room = slot.width - 2 * pad - mark_room
        lines = wrap_text(text, size, room, 2)
        width = text_lines_width(lines, size)
        rect = pygame.Rect(area.left, 0, width + 2 * pad + mark_room, len(lines) * line_height + 2 * pad)
        rect.bottom = bottom
        while (hit := rect.collidelist(list(taken))) >= 0 and rect.top >= area.top:
            rect.bottom = taken[hit].top - round(0.4 * size)
        if not lines or rect.top < area.top:
            return drawn
        draw_box(surface, rect, 0.5 * size)
        draw_mark(surface, mark, (rect.left + pad + 0.5 * size, rect.top + pad + line_height / 2), 0.42 * size, colour)
        draw_text_lines(surface, lines, (rect.right - pad - width, rect.top + pad), line_height, size)
        bottom = rect.top - round(0.4 * size)
        drawn.append(rect)
    return drawn


def _draw_faults(surface: pygame.Surface, faults: tuple[str, ...], area: pygame.Rect, size: float) -> pygame.Rect:
    """Draw the faults of the scene file in a centred box; return its rectangle."""
    pad, line_height = round(min(1.1 * size, 0.04 * area.width)), round(1.45 * size)
    room = min(area.width, round(62 * size)) - 2 * pad
    title = "1 fault in the scene file" if len(faults) == 1 else f"{len(faults)} faults in the scene file"
    title_lines = wrap_text(
        f"{title}; the previous scene keeps running (Esc: close)", size, room - 1.6 * size, 2, bold=True
    )
    max_lines = (area.height - 2 * pad) // line_height - len(title_lines)
    if max_lines < 5:
        max_lines += len(title_lines) - 1
        title_lines = (ellipsis(title, size, room - 1.6 * size, bold=True),)
    lines = _fault_lines(faults, size, room, max_lines)
    rect = pygame.Rect(0, 0, room + 2 * pad, (len(title_lines) + len(lines)) * line_height + 2 * pad)
    rect.center = area.center
    if not area.contains(rect):
        return pygame.Rect(0, 0, 0, 0)
    draw_box(surface, rect, 0.6 * size, opacity=244, edge=WARNING)
    draw_mark(
        surface, "triangle", (rect.left + pad + 0.4 * size, rect.top + pad + line_height / 2), 0.5 * size, WARNING
    )
    left, y = rect.left + pad, rect.top + pad + line_height / 2
    for text in title_lines:
        draw_text(surface, text, (left + round(1.6 * size), y), size, INK, "midleft", bold=True)
        y += line_height
    for indent, text in lines:
        colour = FAINT if indent else INK
        draw_text(surface, text, (left + indent, y), size, colour, "midleft", mono=True)
        y += line_height
    return rect


def _fault_lines(faults: tuple[str, ...], size: float, room: int, max_lines: int) -> list[tuple[int, str]]:
    """Return (indent in px, text) lines of the faults; if space is short, the last line counts the faults left out."""
    indent = round(1.4 * size)
    lines: list[tuple[int, str]] = []
    for number, fault in enumerate(faults):
        first, *rest = wrap_text(fault, size, room - indent, 4, mono=True) or ("",)
        last = number == len(faults) - 1
        if len(lines) + 1 + len(rest) + (not last) > max_lines:
            if number == 0:  # truncated to fit
                first, *rest = wrap_text(fault, size, room - indent, max(max_lines, 1), mono=True) or ("",)
                return [(0, first), *((indent, text) for text in rest)][: max(max_lines, 0)]
            lines.append((0, f"… and {len(faults) - number} more"))
            break
        lines += [(0, first), *((indent, text) for text in rest)]
    return lines[: max(max_lines, 0)]
