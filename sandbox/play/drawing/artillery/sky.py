"""Sky: dusk over far ridges. It stands still behind the ground, whatever the camera does."""

import math
from functools import lru_cache
from itertools import pairwise

import numpy as np
import pygame

from sandbox.arrays import FloatArray
from sandbox.games.artillery.landscape import displaced
from sandbox.play.drawing.palette import Colour, mixed

TONES: tuple[tuple[float, Colour], ...] = (
    (0.0, (13, 17, 34)),
    (0.30, (34, 42, 80)),
    (0.48, (92, 80, 120)),
    (0.60, (182, 118, 116)),
    (0.70, (232, 168, 122)),
    (1.0, (240, 186, 140)),
)
"""Shares of the way down the picture, and colours there."""
RIDGES: tuple[tuple[float, float, Colour], ...] = (
    (0.56, 0.22, (84, 74, 112)),
    (0.72, 0.18, (58, 56, 92)),
)
"""How far down the picture ridges stand, how far they reach up and down, and their colours; the nearest last."""
MIST: Colour = (176, 128, 122)
STARS = 140


@lru_cache(maxsize=2)
def sky(size: tuple[int, int]) -> pygame.Surface:
    """Return the sky of a picture so large, px."""
    width, height = max(size[0], 1), max(size[1], 1)
    strip = pygame.Surface((1, height))
    for y in range(height):
        strip.set_at((0, y), tone(y / height))
    whole = pygame.transform.scale(strip, (width, height))
    random = np.random.Generator(np.random.PCG64(7))
    for x, y, bright in random.uniform(size=(STARS, 3)).tolist():
        down = 0.6 * y * y
        colour = mixed(tone(down), (240, 240, 255), 0.25 + 0.55 * bright * (1.0 - y))
        whole.set_at((int(x * (width - 1)), int(down * height)), colour)
    for k, (level, reach, colour) in enumerate(RIDGES):
        line = displaced(96, 0.5, k + 3)
        line = (line - line.mean()) / max(float(np.abs(line - line.mean()).max()), 1e-9)
        tops = np.interp(np.linspace(0.0, 95.0, width), np.arange(96), (level - 0.5 * reach * line) * height)
        _ridge(whole, tops, colour)
    return whole


def tone(share: float) -> Colour:
    """Return the colour of the sky so far down the picture."""
    for (above, first), (below, second) in pairwise(TONES):
        if share <= below:
            return mixed(first, second, (share - above) / (below - above))
    return TONES[-1][1]


def _ridge(surface: pygame.Surface, tops: FloatArray, colour: Colour) -> None:
    """Draw a ridge, whose foot is lost in mist, a column of pixels at a time."""
    height = surface.get_height()
    strip = pygame.Surface((1, height), 0, surface)
    for y in range(height):
        strip.set_at((0, y), mixed(colour, MIST, 0.75 * (1.0 - math.exp(-3.0 * y / height))))
    surface.blits([(strip, (x, top)) for x, top in enumerate(np.floor(tops).astype(int).tolist())], doreturn=False)
    pygame.draw.aalines(surface, mixed(colour, MIST, 0.3), False, list(enumerate(tops.tolist())))
