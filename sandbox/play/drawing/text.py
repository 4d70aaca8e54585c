"""Text: words on a surface, in DejaVu Sans where it is installed, rendered once and kept."""

import math
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

import pygame

from sandbox.play.drawing.palette import Colour

LONGEST = 400
"""Letters of one line that are rendered; no surface grows beyond what SDL takes."""
SMALLEST, LARGEST = 4, 128
"""px, the sizes that are rendered"""
FARTHEST = 30_000
"""px, how far outside a picture a place may be for its text to be tried at all"""


def write(
    surface: pygame.Surface,
    text: str,
    at: tuple[float, float],
    size: float,
    colour: Colour,
    anchor: str = "topleft",
    bold: bool = False,
    mono: bool = False,
) -> pygame.Rect:
    """Write one line of text.

    Args:
        surface: where.
        text: what; it is cut after `LONGEST` letters, and a control character becomes a space.
        at: the place of the anchor, px; at one that is not finite nothing is written.
        size: of the letters, px.
        colour: of the letters.
        anchor: which point of the text lies there, as a `pygame.Rect` calls it: `topleft`, `midright`, `center` …
        bold: in a heavier weight.
        mono: all letters equally wide, for figures that change.

    Returns:
        The place that the text covers, whether in the picture or not.
    """
    x, y = at
    if not (abs(x) < FARTHEST and abs(y) < FARTHEST):  # nor where it is nan
        return pygame.Rect(0, 0, 0, 0)
    words = _rendered(renderable(text), _whole(size), colour, bold, mono)
    rect = words.get_rect(**{anchor: (round(x), round(y))})
    surface.blit(words, rect)
    return rect


def measure(text: str, size: float, bold: bool = False, mono: bool = False) -> tuple[int, int]:
    """Return the width and height of a line of text, px."""
    return _font(_whole(size), bold, mono).size(renderable(text))


def _whole(size: float) -> int:
    return round(min(max(size, SMALLEST), LARGEST)) if math.isfinite(size) else SMALLEST


def renderable(text: str) -> str:
    """Return a text that can be rendered, or be a caption: a zero letter or half a surrogate pair would raise."""
    text = text[:LONGEST]
    if text.isprintable():
        return text
    return "".join(letter if letter.isprintable() else " " for letter in text)


@lru_cache(maxsize=512)
def _rendered(text: str, size: int, colour: Colour, bold: bool, mono: bool) -> pygame.Surface:
    if not text:
        return pygame.Surface((0, _font(size, bold, mono).get_height()), pygame.SRCALPHA)
    return _font(size, bold, mono).render(text, True, colour)


@lru_cache(maxsize=64)
def _font(size: int, bold: bool, mono: bool) -> pygame.font.Font:
    if not pygame.font.get_init():
        pygame.font.init()
    pygame.register_quit(_forget)  # fonts do not outlive pygame
    path = font_file(bold, mono)
    return pygame.font.Font(None if path is None else str(path), size)


def _forget() -> None:
    _rendered.cache_clear()
    _font.cache_clear()


@lru_cache(maxsize=4)
def font_file(bold: bool, mono: bool) -> Path | None:
    """Return where a DejaVu font lies, among matplotlib's files, which are looked up and not imported."""
    spec = find_spec("matplotlib")
    if spec is None or spec.origin is None:
        return None
    name = f"DejaVuSans{'Mono' if mono else ''}{'-Bold' if bold else ''}.ttf"
    path = Path(spec.origin).parent / "mpl-data" / "fonts" / "ttf" / name
    return path if path.is_file() else None
