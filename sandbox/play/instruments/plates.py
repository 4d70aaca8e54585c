"""Plates: translucent backings that keep words readable over any picture, and lines fitted to a width."""

from collections.abc import Sequence
from functools import lru_cache
from itertools import product

import pygame

from sandbox.play.drawing.palette import INK, LINE, PANEL, Colour
from sandbox.play.drawing.text import LONGEST, measure, write

OPACITY = 214
LARGEST = 16_384
"""px, of a plate's side"""


def plate(
    surface: pygame.Surface,
    rect: pygame.Rect,
    radius: float,
    colour: Colour = PANEL,
    opacity: int = OPACITY,
    edge: Colour | None = LINE,
) -> None:
    """Lay a rounded translucent plate; one without an area is not drawn."""
    if rect.width <= 0 or rect.height <= 0 or max(rect.size) > LARGEST:
        return
    surface.blit(_plate(rect.size, round(radius), colour, opacity, edge), rect)


@lru_cache(maxsize=64)
def _plate(size: tuple[int, int], radius: int, colour: Colour, opacity: int, edge: Colour | None) -> pygame.Surface:
    made = pygame.Surface(size, pygame.SRCALPHA)
    pygame.draw.rect(made, (*colour, opacity), made.get_rect(), border_radius=radius)
    if edge is not None:
        pygame.draw.rect(made, (*edge, opacity), made.get_rect(), 1, border_radius=radius)
    return made


def largest_room(shape: tuple[float, float], free: pygame.Rect, taken: Sequence[pygame.Rect]) -> pygame.Rect:
    """Return the part of what is free, beside all that is taken, in which a rectangle of a shape is largest.

    Args:
        shape: width and height, in any unit.
        free: px.
        taken: px; where nothing else is left, they are not minded.
    """
    taken = [each.clip(free) for each in taken if each.clip(free).size > (0, 0) and free.colliderect(each)]
    lefts, rights = {free.left, *(each.right for each in taken)}, {free.right, *(each.left for each in taken)}
    tops, bottoms = {free.top, *(each.bottom for each in taken)}, {free.bottom, *(each.top for each in taken)}
    best, most = free, 0.0
    for left, right in product(sorted(lefts), sorted(rights, reverse=True)):
        for top, bottom in product(sorted(tops), sorted(bottoms, reverse=True)):
            scale = min((right - left) / shape[0], (bottom - top) / shape[1])
            room = pygame.Rect(left, top, max(right - left, 0), max(bottom - top, 0))
            if scale > most and room.collidelist(taken) < 0:
                best, most = room, scale
    return best


@lru_cache(maxsize=1024)
def shortened(text: str, size: float, width: float, bold: bool = False, mono: bool = False) -> str:
    """Return as much of a text as fits a width in px, with `…` where something is missing; "" where nothing fits."""
    text = text[:LONGEST]
    if measure(text, size, bold, mono)[0] <= width:
        return text
    fits, cut = 0, len(text)
    while cut - fits > 1:  # `fits` letters and … fit, or nothing does; `cut` do not
        middle = (fits + cut) // 2
        if measure(f"{text[:middle].rstrip()}…", size, bold, mono)[0] <= width:
            fits = middle
        else:
            cut = middle
    return f"{text[:fits].rstrip()}…" if fits else ""


@lru_cache(maxsize=256)
def wrapped(
    text: str, size: float, width: float, most: int = 3, bold: bool = False, mono: bool = False
) -> tuple[str, ...]:
    """Return a text as lines that fit a width in px, broken at spaces; the last of `most` is shortened."""
    words = text[: LONGEST * most].split()
    lines: list[str] = []
    while words and len(lines) < most:
        count = 1
        while count < len(words) and measure(" ".join(words[: count + 1]), size, bold, mono)[0] <= width:
            count += 1
        whole = " ".join(words) if len(lines) == most - 1 else " ".join(words[:count])
        lines.append(shortened(whole, size, width, bold, mono))
        words = words[count:]
    return tuple(lines)


def draw_hint(surface: pygame.Surface, text: str, pointer: tuple[int, int], unit: float) -> None:
    """Draw what is told about the thing under the pointer, below it and inside the picture."""
    size = 12 * unit
    lines = wrapped(text, size, min(280 * unit, 0.9 * surface.get_width()), 4)
    wide = max((measure(line, size)[0] for line in lines), default=0)
    step = round(1.4 * size)
    box = pygame.Rect(0, 0, wide + round(1.4 * size), len(lines) * step + round(0.8 * size))
    box.topright = pointer[0], pointer[1] + round(20 * unit)
    box.clamp_ip(surface.get_rect())
    plate(surface, box, 4 * unit, opacity=246)
    for k, line in enumerate(lines):
        at = box.left + 0.7 * size, box.top + 0.4 * size + (k + 0.5) * step
        write(surface, line, at, size, INK, "midleft")
