"""Head-up display: what the window tells in words, over the picture."""

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple

import pygame

from sandbox.window.format import format_percent, format_si, format_time
from sandbox.window.playback.snapshot import HudStatus
from sandbox.window.render.palette import FAINT, GREEN, INK, ORANGE, PANEL, SKY, VERMILION, WARNING, Colour
from sandbox.window.render.text import draw_box, draw_text, ellipsis, text_size, wrap_text
from sandbox.window.ui.icons import draw_disc

APART = 0.10
"""How far real speed may be from the asked before it is told."""
MESSAGES = 4
"""The newest are shown."""
FULL = 460, 320
"""px at unit 1: a smaller picture gets smaller letters."""
SMALLEST = 9.0
"""px, letters that can still be read"""

TALLEST = 0.4
"""of a picture, that the state of things takes from above at most"""
LEAST_MESSAGE = 14.0
"""heights of a letter: a message gets no narrower to find room beside something"""

ESSENTIAL = 2
"""The rank of what is shown even beside the faults of a file."""

PAUSED = "PAUSED  (P or Space)"
"""The longest line that says that time stands still."""

Mark = Literal["", "disc", "triangle", "ring", "bars"]


class HudRow(NamedTuple):
    """One line about the state of things."""

    text: str
    colour: Colour = INK
    mark: Mark = ""
    """a shape before it, so that no state rests on colour alone"""
    bold: bool = False
    mono: bool = False
    rank: int = 5
    """where there is no room for all, the lowest stay"""


def hud_rows(status: HudStatus) -> tuple[HudRow, ...]:
    """Return the lines at the top left, in the order in which they are shown."""
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
        found.append(HudRow("PAUSED  (P)" if space_claimed else PAUSED, WARNING, "bars", bold=True, rank=2))
    found += _speed(status) + _doubts(status)
    if status.recording is not None:
        found.append(HudRow(f"recording {status.recording}", WARNING, "disc", rank=3))
    if status.busy is not None:
        found.append(HudRow(status.busy, SKY, "ring", rank=3))
    return tuple(found)


def _speed(status: HudStatus) -> list[HudRow]:
    asked, real = status.speed, status.real_speed
    still = status.paused or status.ended is not None
    apart = not still and math.isfinite(real) and abs(real - asked) > APART * abs(asked)
    if apart:
        return [HudRow(f"speed {format_percent(asked)}, running at {format_percent(real)}", ORANGE, rank=4)]
    return [] if asked == 1 else [HudRow(f"speed {format_percent(asked)}", rank=5)]


def _doubts(status: HudStatus) -> list[HudRow]:
    """Return what is known of how far the picture can be believed."""
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
    """The lines at the upper left, as they are laid out."""

    rect: pygame.Rect
    """of their plate; empty where none fits"""
    lines: tuple[tuple[HudRow, str], ...]
    """each with as much of its text as there is room for"""


def _scaled(free: pygame.Rect, unit: float) -> tuple[pygame.Rect, float]:
    """Return what words may cover of a picture, and the size of their letters, px: small pictures get small ones."""
    scale = unit * min(max(min(free.width / (FULL[0] * unit), free.height / (FULL[1] * unit)), 0.4), 1.0)
    margin = -2 * round(max(10 * scale, 3))
    return free.inflate(margin, margin), max(13.5 * scale, SMALLEST)


def layout_rows(status: HudStatus, free: pygame.Rect, unit: float, taken: Sequence[pygame.Rect] = ()) -> HudText:
    """Lay out the state of things at the upper left of what is free, beside what takes some of the top.

    It is no higher than `TALLEST` of the picture: the least important lines are left out.
    """
    free, size = _scaled(free, unit)
    shown = hud_rows(status)
    if status.faults:
        shown = tuple(row for row in shown if row.rank <= ESSENTIAL)
    pad, line = _pad(size), round(1.42 * size)
    room = pygame.Rect(free.topleft, (free.width, min(free.height, max(round(TALLEST * free.height), 5 * line))))
    for each in taken:
        if each.top < room.bottom and each.left > free.left + 8 * size:
            room.width = min(room.width, each.left - round(0.5 * size) - free.left)
    count = (room.height - 2 * pad) // line
    if count < 1 or free.width < 2 * size or free.height < size:
        return HudText(pygame.Rect(free.topleft, (0, 0)), ())
    least = sorted(row.rank for row in shown)[:count][-1]
    kept = [row for row in shown if row.rank <= least][:count]
    indent, wide = round(1.3 * size), room.width - 2 * pad
    texts = [ellipsis(row.text, size, wide - (indent if row.mark else 0), row.bold, row.mono) for row in kept]
    widest = max(
        text_size(text, size, row.bold, row.mono)[0] + (indent if row.mark else 0)
        for row, text in zip(kept, texts, strict=True)
    )
    grain = round(2 * size)  # so that the plate does not tremble with its figures
    rect = pygame.Rect(free.topleft, (min(-(-widest // grain) * grain, wide) + 2 * pad, len(kept) * line + 2 * pad))
    return HudText(rect, tuple(zip(kept, texts, strict=True)))


def draw_hud(
    surface: pygame.Surface,
    status: HudStatus,
    unit: float,
    *,
    right: int = 0,
    bottom: int = 0,
    taken: Sequence[pygame.Rect] = (),
    plates: dict[str, pygame.Rect] | None = None,
) -> pygame.Rect:
    """Draw the state of things over a picture; what finds no room is left out, the least important first.

    Return what the faults of the scene file cover, if there are any.

    Args:
        surface: the picture.
        status: what to tell.
        unit: px of a pixel at 1080 lines.
        right: px at the right that something else covers.
        bottom: px at the bottom that something else covers.
        taken: what else lies over the picture; words go beside it.
        plates: filled with what each plate covers.
    """
    plates, nothing = {} if plates is None else plates, pygame.Rect(0, 0, 0, 0)
    whole = pygame.Rect(0, 0, max(surface.get_width() - right, 0), max(surface.get_height() - bottom, 0))
    free, size = _scaled(whole, unit)
    if free.width < 2 * size or free.height < size:
        return nothing
    told = layout_rows(status, whole, unit, taken)
    _draw_rows(surface, told, size)
    plates["state"] = told.rect
    plates["rate"] = _draw_rate(surface, status, free, [told.rect, *taken], size)
    if status.faults:
        top = told.rect.bottom + _pad(size)
        below = pygame.Rect(free.left, top, free.width, free.bottom - top)
        return _draw_faults(surface, status.faults, below if below.height > 6 * size else free, size)
    plates["picked"] = _draw_picked(surface, status.picked, free, [told.rect, plates["rate"], *taken], size)
    others = [told.rect, plates["rate"], plates["picked"], *taken]
    for k, rect in enumerate(_draw_messages(surface, status.messages, free, others, size)):
        plates[f"message {k}"] = rect
    if status.question is not None:
        _draw_notice(surface, status.question, free, size, WARNING)
    elif status.waits_for_start:
        _draw_notice(surface, "Press Space to start", free, 1.5 * size, SKY)
    elif status.out_of_sight is not None:
        _draw_notice(surface, status.out_of_sight, free, size, SKY)
    return nothing


def hud_width(longest: str, unit: float) -> int:
    """Return how far to the right the state of things reaches at full size, px, by the longest of its lines.

    There is always room for the line that says that it is paused.
    """
    size = 13.5 * unit
    paused = text_size(PAUSED, size, bold=True)[0] + round(1.3 * size)
    wide = max(text_size(longest, size)[0] + round(2 * size), paused + round(0.5 * size))
    return round(10 * unit) + wide + 2 * _pad(size)


def _pad(size: float) -> int:
    return round(0.6 * size)


def _draw_rows(surface: pygame.Surface, told: HudText, size: float) -> None:
    """Draw the lines at the upper left on their plate."""
    pad, line, rect = _pad(size), round(1.42 * size), told.rect
    draw_box(surface, rect, 0.5 * size)
    for k, (row, text) in enumerate(told.lines):
        middle = rect.top + pad + (k + 0.5) * line
        left = rect.left + pad
        if row.mark:
            draw_mark(surface, row.mark, (left + 0.42 * size, middle), 0.4 * size, row.colour)
            left += round(1.3 * size)
        colour = INK if row.colour == GREEN else row.colour
        draw_text(surface, text, (left, middle), size, colour, "midleft", row.bold, row.mono)


def draw_mark(surface: pygame.Surface, mark: Mark, at: tuple[float, float], radius: float, colour: Colour) -> None:
    """Draw the small shape that stands before a line."""
    x, y = at
    wide = max(round(0.4 * radius), 1)
    if mark == "disc":
        draw_disc(surface, at, radius, colour)
    elif mark == "ring":
        draw_disc(surface, at, radius, colour, 0.55 * radius)
    elif mark == "triangle":
        corners = [(x, y - radius), (x + 1.1 * radius, y + 0.9 * radius), (x - 1.1 * radius, y + 0.9 * radius)]
        pygame.draw.polygon(surface, colour, corners)
        pygame.draw.aalines(surface, colour, True, corners)
        pygame.draw.line(surface, PANEL, (x, y - 0.35 * radius), (x, y + 0.3 * radius), wide)
    elif mark == "bars":
        for side in (-0.75, 0.2):
            pygame.draw.rect(surface, colour, (x + side * radius, y - radius, 0.65 * radius, 2 * radius))


def _draw_notice(surface: pygame.Surface, text: str, free: pygame.Rect, size: float, edge: Colour) -> None:
    """Draw what waits for an answer, in the middle."""
    lines = wrap_text(text, size, free.width - 2 * size, 3, bold=True)
    line = round(1.4 * size)
    wide = max(text_size(each, size, bold=True)[0] for each in lines)
    rect = pygame.Rect(0, 0, wide + 2 * round(size), len(lines) * line + round(size))
    rect.center = free.center
    draw_box(surface, rect, 0.5 * size, opacity=244, edge=edge)
    for k, each in enumerate(lines):
        at = rect.centerx, rect.top + 0.5 * size + (k + 0.5) * line
        draw_text(surface, each, at, size, INK, "center", bold=True)


def _draw_rate(
    surface: pygame.Surface, status: HudStatus, free: pygame.Rect, taken: Sequence[pygame.Rect], size: float
) -> pygame.Rect:
    """Draw how many pictures there are a second, at the upper right; return what that covers."""
    nothing = pygame.Rect(0, 0, 0, 0)
    if not (math.isfinite(status.frames_per_second) and status.frames_per_second > 0):
        return nothing
    text, small = f"{status.frames_per_second:.0f} fps", max(0.8 * size, SMALLEST)
    wide, high = text_size(text, small, mono=True)
    rect = pygame.Rect(free.right - wide, free.top, wide, high).inflate(_pad(size), 0)
    if rect.left < free.left or rect.bottom > free.bottom or rect.inflate(size, 0).collidelist(list(taken)) >= 0:
        return nothing
    draw_box(surface, rect, 0.3 * size, opacity=120, edge=None)
    draw_text(surface, text, rect.center, small, FAINT, "center", mono=True)
    return rect


def _draw_picked(
    surface: pygame.Surface, lines: tuple[str, ...], free: pygame.Rect, taken: Sequence[pygame.Rect], size: float
) -> pygame.Rect:
    """Draw the figures of the picked body at the upper right, or below what lies there; return what they cover."""
    nothing = pygame.Rect(0, 0, 0, 0)
    if not lines:
        return nothing
    small, pad = max(0.93 * size, SMALLEST), _pad(size)
    line = round(1.4 * small)
    texts = [ellipsis(text, small, free.width - 2 * pad, k == 0, k > 0) for k, text in enumerate(lines)]
    wide = max(text_size(text, small, k == 0, k > 0)[0] for k, text in enumerate(texts)) + 2 * pad
    rect = pygame.Rect(free.right - wide, free.top + round(1.6 * size), wide, len(texts) * line + 2 * pad)
    tops = sorted({rect.top, *(each.bottom + pad for each in taken if each.height)})
    places = [rect.move(aside, top - rect.top) for aside in (0, free.left - rect.left) for top in tops]
    found = [
        each
        for each in places
        if each.bottom <= free.bottom and each.inflate(pad, pad // 2).collidelist(list(taken)) < 0
    ]
    if not found:
        return nothing
    rect = found[0]
    draw_box(surface, rect, 0.5 * size)
    for k, text in enumerate(texts):
        at = rect.left + pad, rect.top + pad + (k + 0.5) * line
        draw_text(surface, text, at, small, INK, "midleft", bold=k == 0, mono=k > 0)
    return rect


def _draw_messages(
    surface: pygame.Surface,
    messages: tuple[tuple[str, str], ...],
    free: pygame.Rect,
    taken: Sequence[pygame.Rect],
    size: float,
) -> list[pygame.Rect]:
    """Draw the newest messages at the lower left, beside or above what lies there; return what they cover."""
    pad, line, mark_room = _pad(size), round(1.35 * size), round(1.6 * size)
    drawn: list[pygame.Rect] = []
    bottom = free.bottom
    for level, text in reversed(messages[-MESSAGES:]):
        colour = {"warning": ORANGE, "error": WARNING}.get(level, SKY)
        mark: Mark = "triangle" if level in ("warning", "error") else "disc"
        reach = pygame.Rect(free.left, 0, min(free.width, round(44 * size)), 2 * line + 2 * pad)
        reach.bottom = bottom
        for each in taken:
            if each.colliderect(reach) and each.left - free.left >= round(LEAST_MESSAGE * size):
                reach.width = min(reach.width, each.left - pad - free.left)
        room = reach.width - 2 * pad - mark_room
        lines = wrap_text(text, size, room, 2)
        wide = max((text_size(part, size)[0] for part in lines), default=0)
        rect = pygame.Rect(free.left, 0, wide + 2 * pad + mark_room, len(lines) * line + 2 * pad)
        rect.bottom = bottom
        while (hit := rect.collidelist(list(taken))) >= 0 and rect.top >= free.top:
            rect.bottom = taken[hit].top - round(0.4 * size)
        if not lines or rect.top < free.top:
            return drawn
        draw_box(surface, rect, 0.5 * size)
        draw_mark(surface, mark, (rect.left + pad + 0.5 * size, rect.top + pad + line / 2), 0.42 * size, colour)
        for k, part in enumerate(lines):
            draw_text(surface, part, (rect.right - pad - wide, rect.top + pad + (k + 0.5) * line), size, INK, "midleft")
        bottom = rect.top - round(0.4 * size)
        drawn.append(rect)
    return drawn


def _draw_faults(surface: pygame.Surface, faults: tuple[str, ...], free: pygame.Rect, size: float) -> pygame.Rect:
    """Draw the faults of the scene file in a box in the middle, and return it; what finds no room is counted."""
    pad, line = round(min(1.1 * size, 0.04 * free.width)), round(1.45 * size)
    room = min(free.width, round(62 * size)) - 2 * pad
    head = "1 fault in the scene file" if len(faults) == 1 else f"{len(faults)} faults in the scene file"
    heads = wrap_text(f"{head}; the previous scene keeps running (Esc: close)", size, room - 1.6 * size, 2, bold=True)
    most = (free.height - 2 * pad) // line - len(heads)
    if most < 5:
        most += len(heads) - 1
        heads = (ellipsis(head, size, room - 1.6 * size, bold=True),)
    lines = _fault_lines(faults, size, room, most)
    rect = pygame.Rect(0, 0, room + 2 * pad, (len(heads) + len(lines)) * line + 2 * pad)
    rect.center = free.center
    if not free.contains(rect):
        return pygame.Rect(0, 0, 0, 0)
    draw_box(surface, rect, 0.6 * size, opacity=244, edge=WARNING)
    draw_mark(surface, "triangle", (rect.left + pad + 0.4 * size, rect.top + pad + line / 2), 0.5 * size, WARNING)
    left, y = rect.left + pad, rect.top + pad + line / 2
    for text in heads:
        draw_text(surface, text, (left + round(1.6 * size), y), size, INK, "midleft", bold=True)
        y += line
    for indent, text in lines:
        colour = FAINT if indent else INK
        draw_text(surface, text, (left + indent, y), size, colour, "midleft", mono=True)
        y += line
    return rect


def _fault_lines(faults: tuple[str, ...], size: float, room: int, most: int) -> list[tuple[int, str]]:
    """Return lines with their indents, px: each fault begins at the left, and the last line counts what is missing."""
    indent = round(1.4 * size)
    lines: list[tuple[int, str]] = []
    for number, fault in enumerate(faults):
        first, *rest = wrap_text(fault, size, room - indent, 4, mono=True) or ("",)
        last = number == len(faults) - 1
        if len(lines) + 1 + len(rest) + (not last) > most:
            if number == 0:  # as much of it as there is room for
                first, *rest = wrap_text(fault, size, room - indent, max(most, 1), mono=True) or ("",)
                return [(0, first), *((indent, text) for text in rest)][: max(most, 0)]
            lines.append((0, f"… and {len(faults) - number} more"))
            break
        lines += [(0, first), *((indent, text) for text in rest)]
    return lines[: max(most, 0)]
