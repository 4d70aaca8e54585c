"""Sky: dusk over far ridges. It stands still behind the ground, whatever the camera does."""

import math
from functools import lru_cache
from itertools import pairwise

import numpy as np
import pygame

from sandbox.play.drawing.palette import Colour, mixed
from sandbox.scene.artillery.landscape import displaced

TONES: tuple[tuple[float, Colour], ...] = (
    (0.0, (13, 17, 34)),
    (0.45, (34, 44, 82)),
    (0.72, (92, 84, 122)),
    (0.88, (186, 124, 116)),
    (1.0, (232, 172, 122)),
)
"""Shares of the way down the picture, and colours there."""
RIDGES: tuple[tuple[float, float, Colour], ...] = (
    (0.60, 0.20, (66, 66, 106)),
    (0.74, 0.16, (48, 52, 88)),
)
"""How far down the picture ridges stand, how far they reach up and down, and their colours; the nearest last."""
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
        tops = (level - 0.5 * reach * line) * height
        corners = [(width * n / 95.0, top) for n, top in enumerate(tops.tolist())]
        corners = [*corners, (float(width), float(height)), (0.0, float(height))]
        pygame.draw.polygon(whole, colour, corners)
        pygame.draw.aalines(whole, mixed(colour, TONES[-1][1], 0.25), False, corners[:-2])
        _haze(whole, round(level * height), colour, k)
    return whole


def tone(share: float) -> Colour:
    """Return the colour of the sky so far down the picture."""
    for (above, first), (below, second) in pairwise(TONES):
        if share <= below:
            return mixed(first, second, (share - above) / (below - above))
    return TONES[-1][1]


def _haze(surface: pygame.Surface, top: int, colour: Colour, k: int) -> None:
    """Let the foot of a ridge go into mist."""
    width, height = surface.get_size()
    mist = mixed(colour, TONES[-1][1], 0.30 - 0.12 * k)
    veil = pygame.Surface((1, max(height - top, 1)), pygame.SRCALPHA)
    for y in range(veil.get_height()):
        veil.set_at((0, y), (*mist, round(150.0 * (1.0 - math.exp(-2.5 * y / veil.get_height())))))
    layer = pygame.Surface((width, veil.get_height()), pygame.SRCALPHA)
    line = displaced(96, 0.5, k + 3)
    line = (line - line.mean()) / max(float(np.abs(line - line.mean()).max()), 1e-9)
    tops = (RIDGES[k][0] - 0.5 * RIDGES[k][1] * line) * height - top
    corners = [(width * n / 95.0, max(at, 0.0)) for n, at in enumerate(tops.tolist())]
    layer.blit(pygame.transform.scale(veil, layer.get_size()), (0, 0))
    mask = pygame.Surface(layer.get_size(), pygame.SRCALPHA)
    pygame.draw.polygon(mask, (255, 255, 255, 255), [*corners, (width, layer.get_height()), (0, layer.get_height())])
    layer.blit(mask, (0, 0), special_flags=pygame.BLEND_RGBA_MIN)
    surface.blit(layer, (0, top))
