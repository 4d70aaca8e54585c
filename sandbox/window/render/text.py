"""Cached text in DejaVu Sans if installed, translucent boxes behind it, wrapping and truncation to a width."""

import math
from collections.abc import Sequence
from functools import lru_cache
from importlib.util import find_spec
from itertools import product
from pathlib import Path

import pygame

from sandbox.window.render.lines import SDL_COORDINATE_LIMIT
from sandbox.window.render.palette import INK, LINE, PANEL, RgbColour

MAX_TEXT_LENGTH = 400
"""Number of characters of a line that are rendered; limits the width of the surface."""
MIN_FONT_SIZE, MAX_FONT_SIZE = 4, 128
"""px, range of font sizes"""


def draw_text(
    surface: pygame.Surface,
    text: str,
    at: tuple[float, float],
    size: float,
    colour: RgbColour,
    anchor: str = "topleft",
    bold: bool = False,
    mono: bool = False,
) -> pygame.Rect:
    """Draw one line of text.

    Args:
        surface: the target.
        text: truncated after `MAX_TEXT_LENGTH` characters; control characters become spaces.
        at: position of the anchor, px; if it is not finite, nothing is drawn.
        size: font size, px.
        colour: of the text.
        anchor: point of the text at `at`, named as in `pygame.Rect`: `topleft`, `midright`, `center` …
        bold: whether the weight is bold.
        mono: whether the font is monospaced, for changing numbers.

    Returns:
        The rectangle of the text, which may lie outside the surface.
    """
    x, y = at
    if not (abs(x) < SDL_COORDINATE_LIMIT and abs(y) < SDL_COORDINATE_LIMIT):  # also rejects nan
        return pygame.Rect(0, 0, 0, 0)
    words = _rendered(renderable(text), _integer_size(size), colour, bold, mono)
    rect = words.get_rect(**{anchor: (round(x), round(y))})
    surface.blit(words, rect)
    return rect


def text_size(text: str, size: float, bold: bool = False, mono: bool = False) -> tuple[int, int]:
    """Return the width and height of a line of text, px."""
    return _font(_integer_size(size), bold, mono).size(renderable(text))


def _integer_size(size: float) -> int:
    return round(min(max(size, MIN_FONT_SIZE), MAX_FONT_SIZE)) if math.isfinite(size) else MIN_FONT_SIZE


def renderable(text: str) -> str:
    """Return a text that pygame can render or set as caption: null characters and lone surrogates would raise."""
    text = text[:MAX_TEXT_LENGTH]
    if text.isprintable():
        return text
    return "".join(letter if letter.isprintable() else " " for letter in text)


@lru_cache(maxsize=512)
def _rendered(text: str, size: int, colour: RgbColour, bold: bool, mono: bool) -> pygame.Surface:
    font = _font(size, bold, mono)
    if not font.size(text)[0]:  # empty, or only characters without width, such as variation selectors
        return pygame.Surface((0, font.get_height()), pygame.SRCALPHA)
    return font.render(text, True, colour)


@lru_cache(maxsize=64)
def _font(size: int, bold: bool, mono: bool) -> pygame.font.Font:
    if not pygame.font.get_init():
        pygame.font.init()
    pygame.register_quit(_forget)  # fonts are invalid after pygame.quit
    path = font_file(bold, mono)
    return pygame.font.Font(None if path is None else str(path), size)


def _forget() -> None:
    _rendered.cache_clear()
    _font.cache_clear()


@lru_cache(maxsize=4)
def font_file(bold: bool, mono: bool) -> Path | None:
    """Return the path of a DejaVu font in matplotlib's data, without importing matplotlib; None if not found."""
    spec = find_spec("matplotlib")
    if spec is None or spec.origin is None:
        return None
    name = f"DejaVuSans{'Mono' if mono else ''}{'-Bold' if bold else ''}.ttf"
    path = Path(spec.origin).parent / "mpl-data" / "fonts" / "ttf" / name
    return path if path.is_file() else None


BOX_OPACITY = 214
MAX_BOX_SIDE = 16_384
"""px, largest side of a box"""


def draw_box(
    surface: pygame.Surface,
    rect: pygame.Rect,
    radius: float,
    colour: RgbColour = PANEL,
    opacity: int = BOX_OPACITY,
    edge: RgbColour | None = LINE,
) -> None:
    """Draw a rounded translucent box; nothing if its area is empty."""
    if rect.width <= 0 or rect.height <= 0 or max(rect.size) > MAX_BOX_SIDE:
        return
    surface.blit(_plate(rect.size, round(radius), colour, opacity, edge), rect)


@lru_cache(maxsize=64)
def _plate(
    size: tuple[int, int], radius: int, colour: RgbColour, opacity: int, edge: RgbColour | None
) -> pygame.Surface:
    made = pygame.Surface(size, pygame.SRCALPHA)
    pygame.draw.rect(made, (*colour, opacity), made.get_rect(), border_radius=radius)
    if edge is not None:
        pygame.draw.rect(made, (*edge, opacity), made.get_rect(), 1, border_radius=radius)
    return made


def largest_area(shape: tuple[float, float], free: pygame.Rect, occupied: Sequence[pygame.Rect]) -> pygame.Rect:
    """Return the part of the free area, outside all occupied rectangles, that holds the largest rectangle of a shape.

    Args:
        shape: width and height, in any unit.
        free: px.
        occupied: px; ignored if no area remains.
    """
    occupied = [each.clip(free) for each in occupied if each.clip(free).size > (0, 0) and free.colliderect(each)]
    lefts, rights = {free.left, *(each.right for each in occupied)}, {free.right, *(each.left for each in occupied)}
    tops, bottoms = {free.top, *(each.bottom for each in occupied)}, {free.bottom, *(each.top for each in occupied)}
    best, best_scale = free, 0.0
    for left, right in product(sorted(lefts), sorted(rights, reverse=True)):
        for top, bottom in product(sorted(tops), sorted(bottoms, reverse=True)):
            scale = min((right - left) / shape[0], (bottom - top) / shape[1])
            candidate = pygame.Rect(left, top, max(right - left, 0), max(bottom - top, 0))
            if scale > best_scale and candidate.collidelist(occupied) < 0:
                best, best_scale = candidate, scale
    return best


@lru_cache(maxsize=1024)
def ellipsis(text: str, size: float, width: float, bold: bool = False, mono: bool = False) -> str:
    """Return a text truncated with `…` to a width in px; "" if not even one character fits."""
    text = text[:MAX_TEXT_LENGTH]
    if text_size(text, size, bold, mono)[0] <= width:
        return text
    fits, cut = 0, len(text)
    while cut - fits > 1:  # invariant: `fits` characters and … fit (or none do); `cut` characters do not
        middle = (fits + cut) // 2
        if text_size(f"{text[:middle].rstrip()}…", size, bold, mono)[0] <= width:
            fits = middle
        else:
            cut = middle
    return f"{text[:fits].rstrip()}…" if fits else ""


@lru_cache(maxsize=256)
def wrap_text(
    text: str, size: float, width: float, most: int = 3, bold: bool = False, mono: bool = False
) -> tuple[str, ...]:
    """Return a text wrapped at spaces to a width in px, at most `most` lines; the last one is truncated with `…`."""
    words = text[: MAX_TEXT_LENGTH * most].split()
    lines: list[str] = []
    while words and len(lines) < most:
        count = 1
        while count < len(words) and text_size(" ".join(words[: count + 1]), size, bold, mono)[0] <= width:
            count += 1
        line = " ".join(words) if len(lines) == most - 1 else " ".join(words[:count])
        lines.append(ellipsis(line, size, width, bold, mono))
        words = words[count:]
    return tuple(lines)


def text_lines_width(lines: Sequence[str], size: float, bold: bool = False, mono: bool = False) -> int:
    """Return the width of the longest of some lines, px; 0 without any."""
    return max((text_size(line, size, bold, mono)[0] for line in lines), default=0)


def draw_text_lines(
    surface: pygame.Surface,
    lines: Sequence[str],
    at: tuple[float, float],
    step: int,
    size: float,
    colour: RgbColour = INK,
    anchor: str = "midleft",
    bold: bool = False,
) -> None:
    """Draw lines below each other, `step` px apart; `at` is the point of the upper edge that the anchor names, px."""
    for k, line in enumerate(lines):
        draw_text(surface, line, (at[0], at[1] + (k + 0.5) * step), size, colour, anchor, bold)


class TextPlate:
    """Text on a box. It is laid out before it is drawn, so that the caller can place `rect`."""

    def __init__(self, text: str, size: float, max_width: float, max_lines: int = 4, pad: float = 0.4) -> None:
        """Wrap a text to a width, px; `pad` is the space above and below it in text heights."""
        self._lines = wrap_text(text, size, max_width, max_lines)
        self._size, self._step, self._pad = size, round(1.4 * size), pad
        width, height = text_lines_width(self._lines, size), len(self._lines) * self._step
        self.rect = pygame.Rect(0, 0, width + round(1.4 * size), height + round(2.0 * pad * size))

    def draw(self, surface: pygame.Surface, radius: float, opacity: int, edge: RgbColour = LINE) -> None:
        """Draw the plate with rounded corners."""
        draw_box(surface, self.rect, radius, opacity=opacity, edge=edge)
        at = self.rect.left + 0.7 * self._size, self.rect.top + self._pad * self._size
        draw_text_lines(surface, self._lines, at, self._step, self._size)


def draw_hint(surface: pygame.Surface, text: str, pointer: tuple[int, int], ui_scale: float) -> None:
    """Draw a tooltip below the pointer, kept inside the surface."""
    plate = TextPlate(text, 12 * ui_scale, min(280 * ui_scale, 0.9 * surface.get_width()))
    plate.rect.topright = pointer[0], pointer[1] + round(20 * ui_scale)
    plate.rect.clamp_ip(surface.get_rect())
    plate.draw(surface, 4 * ui_scale, 246)
