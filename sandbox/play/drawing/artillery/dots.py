"""Dots: small discs and rings, and discs that let through what is behind them; only where a picture can have them."""

import math

import pygame

from sandbox.play.drawing.palette import Colour
from sandbox.play.drawing.strokes import Pixel

FARTHEST = 1e4
"""px from a picture's corner, beyond which SDL is not asked"""


def dot(surface: pygame.Surface, at: Pixel, radius: float, colour: Colour, line: float = 0.0) -> None:
    """Draw a disc, or a ring of so many px."""
    if abs(at[0]) < FARTHEST and abs(at[1]) < FARTHEST and radius < FARTHEST:
        width = max(round(line), 1) if line else 0
        pygame.draw.circle(surface, colour, (round(at[0]), round(at[1])), max(round(radius), 1), width)


def glow(surface: pygame.Surface, at: Pixel, radius: float, colour: Colour, opacity: int) -> None:
    """Lay a disc over a picture of which so much, 0 to 255, hides what is behind."""
    if not (abs(at[0]) < FARTHEST and abs(at[1]) < FARTHEST and radius < 0.2 * FARTHEST):
        return
    side = max(math.ceil(radius), 1)
    layer = pygame.Surface((2 * side + 1, 2 * side + 1), pygame.SRCALPHA)
    pygame.draw.circle(layer, (*colour, opacity), (side, side), side)
    surface.blit(layer, (round(at[0]) - side, round(at[1]) - side))
