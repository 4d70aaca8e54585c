"""Coats: what balls are painted with: numbers, stripes, and the spots that show how a cue ball turns."""

from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
import pygame

from sandbox.arrays import FloatArray
from sandbox.games.billiards.equipment import POOL, SOLIDS, WHITE
from sandbox.play.drawing.palette import Colour, hex_colour
from sandbox.play.drawing.text import write

Kind = Literal["plain", "solid", "stripe", "spots"]

IVORY: Colour = hex_colour(WHITE)
RED: Colour = (196, 44, 40)
DARK: Colour = (24, 24, 28)
STRIPE = 0.58
"""half the width of a stripe, of the radius"""
DISC = 0.46
"""radius of the disc under a number, likewise"""
SPOT = 0.17
BRIGHT = 350
"""Sum of its colour's parts, from which a ball's spots are red; else they are white."""
STRUCK = ("cue", "white", "yellow")
"""Balls that cues strike, by name; a yellow one only on a table with a white."""


class Coat(NamedTuple):
    """How a ball is painted."""

    kind: Kind
    colour: Colour
    label: str = ""


def coat_of(name: str, colour: Colour, struck: bool) -> Coat:
    """Return the coat of a ball.

    Args:
        name: numbers of pool have stripes and figures.
        colour: as the scene has it.
        struck: whether it is one that cues strike.
    """
    if struck:
        return Coat("spots", colour)
    if name not in POOL.colours or not name.isdigit():
        return Coat("plain", colour)
    number = int(name)
    if number <= 8:
        return Coat("solid", colour, name)
    full = hex_colour(SOLIDS[str(number - 8)])
    return Coat("stripe", full if colour == hex_colour(POOL.colours[name]) else colour, name)


def painted(coat: Coat, ball: FloatArray, radius: float) -> FloatArray:
    """Return the colours (P, 3) at points (P, 3) of the unit sphere, in the ball's own frame.

    Args:
        coat: of the ball.
        ball: the points.
        radius: of the ball in the picture, px, for edges as soft as a pixel.
    """
    own, soft = np.asarray(coat.colour, np.float64), max(radius, 1.0)
    if coat.kind == "plain":
        return np.broadcast_to(own, ball.shape)
    if coat.kind == "spots":
        off = 1.0 - np.abs(ball).max(axis=1)  # from the nearest of the six ends of the axes, of the height
        share = np.clip((SPOT - np.sqrt(2.0 * off)) * soft + 0.5, 0.0, 1.0)
        spot = RED if sum(coat.colour) > BRIGHT else IVORY
        return np.asarray(own + (np.asarray(spot) - own) * share[:, None])
    colours = np.broadcast_to(own, ball.shape)
    if coat.kind == "stripe":
        white = np.clip((np.abs(ball[:, 1]) - STRIPE) * soft + 0.5, 0.0, 1.0)
        colours = own + (np.asarray(IVORY) - own) * white[:, None]
    x, y = ball[:, 0] * np.where(ball[:, 2] < 0.0, -1.0, 1.0), ball[:, 1]
    disc = np.clip((DISC - np.hypot(x, y)) * soft + 0.5, 0.0, 1.0)
    colours = colours + (np.asarray(IVORY) - colours) * disc[:, None]
    side = int(min(max(round(2.0 * DISC * soft), 5), 64))
    figure = _figure(coat.label, side)
    column = np.clip(((x / DISC + 1.0) * 0.5 * side).astype(np.intp), 0, side - 1)
    row = np.clip(((1.0 - y / DISC) * 0.5 * side).astype(np.intp), 0, side - 1)
    ink = figure[column, row] * (np.hypot(x, y) < DISC)
    return colours + (np.asarray(DARK) - colours) * ink[:, None]


@lru_cache(maxsize=512)
def _figure(label: str, side: int) -> FloatArray:
    """Return how much ink a number has at the pixels of its disc, (side, side)."""
    large = pygame.Surface((128, 128), pygame.SRCALPHA)
    write(large, label, (64, 66), 92 if len(label) == 1 else 76, (255, 255, 255), "center", bold=True)
    small = pygame.transform.smoothscale(large, (side, side))
    return np.asarray(pygame.surfarray.array_alpha(small) / 255.0)
