"""Palette: the colours of the window. Accents are those of Okabe and Ito, told apart by colour-blind people too.

Source: M. Okabe, K. Ito, "Color Universal Design", 2008; its black is left out, as the background is dark.
"""

import numpy as np
import numpy.typing as npt

from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.base import BodySpec, HasMaterial
from sandbox.scene.description.discs import Emitter

Colour = tuple[int, int, int]
"""sRGB, 0 to 255 each."""
ColourArray = npt.NDArray[np.uint8]

BACKGROUND: Colour = (20, 24, 31)
PANEL: Colour = (29, 35, 44)
PANEL_RAISED: Colour = (42, 50, 62)
LINE: Colour = (56, 66, 80)
GRID: Colour = (29, 34, 43)
GRID_STRONG: Colour = (37, 44, 55)
SOLID: Colour = (38, 46, 57)
"""What planes and walls are filled with."""
SURFACE: Colour = (138, 151, 168)
"""The lit edge of what is solid."""
INK: Colour = (230, 235, 242)
FAINT: Colour = (146, 158, 174)
NEUTRAL: Colour = (126, 137, 152)
"""Fixed bodies and posts."""

ORANGE: Colour = (230, 159, 0)
SKY: Colour = (86, 180, 233)
GREEN: Colour = (0, 158, 115)
YELLOW: Colour = (240, 228, 66)
BLUE: Colour = (0, 114, 178)
VERMILION: Colour = (213, 94, 0)
PURPLE: Colour = (204, 121, 167)
ACCENTS: tuple[Colour, ...] = (SKY, ORANGE, GREEN, YELLOW, PURPLE, VERMILION, BLUE)
"""In the order in which elements get them."""

TOUCHING, CLEAR = VERMILION, GREEN
"""Bodies that overlap something, and those that do not, where a scene shows contact by colour."""
WARNING: Colour = (255, 92, 80)
"""Only beside words or a shape: red alone says nothing to some."""

FEW_BODIES = 8
"""A generator of no more balls gives each a colour of its own."""
COMPANIONS: dict[Colour, Colour] = {
    SKY: BLUE,
    ORANGE: VERMILION,
    GREEN: BLUE,
    YELLOW: ORANGE,
    PURPLE: BLUE,
    VERMILION: PURPLE,
    BLUE: SKY,
}
TINTS = (0.0, 0.45, -0.3, 0.2, -0.15, 0.65)
"""How far the balls of a larger generator lean from its accent to its companion, or if negative to white: lively, but
of one family."""


def hex_colour(text: str) -> Colour:
    """Return the colour that `#rrggbb` writes."""
    value = int(text[1:], 16)
    return value >> 16, value >> 8 & 255, value & 255


def mix_colours(a: Colour, b: Colour, share: float) -> Colour:
    """Return the colour that is `share` of the way from `a` to `b`."""
    red, green, blue = (round(x + (y - x) * share) for x, y in zip(a, b, strict=True))
    return red, green, blue


def accent(number: int) -> Colour:
    """Return the accent of the number-th element."""
    return ACCENTS[number % len(ACCENTS)]


def colour_of_fixed(thing: HasMaterial, otherwise: Colour = NEUTRAL) -> Colour:
    """Return the colour of a plane, wall or post: its own, or a neutral one."""
    return otherwise if thing.colour is None else hex_colour(thing.colour)


def colour_of(bodies: Bodies) -> ColourArray:
    """Return the colours of bodies, (N, 3), which stay what they are when another body joins.

    An element's own colour, or the first that it fades from, else the accents in turn; fixed ones are neutral.
    """
    colours = np.empty((len(bodies), 3), np.uint8)
    first = np.searchsorted(bodies.element, np.arange(len(bodies.elements) + 1))
    for k, element in enumerate(bodies.elements):
        start, end = int(first[k]), int(first[k + 1])
        if element.colour is not None:
            colours[start:end] = hex_colour(element.colour)
        elif isinstance(element, Emitter) and element.colours is not None:
            colours[start:end] = hex_colour(element.colours[0])
        elif isinstance(element, BodySpec):
            colours[start:end] = NEUTRAL if element.fixed else accent(k)
        elif end - start <= FEW_BODIES:
            colours[start:end] = [accent(k + n) for n in range(end - start)]
        else:
            tints = np.asarray(_family(accent(k + isinstance(element, Emitter))), np.uint8)  # sparks begin with orange
            colours[start:end] = tints[np.arange(end - start) % len(tints)]
    return colours


def _family(colour: Colour) -> list[Colour]:
    """Return the tints of a larger generator."""
    return [mix_colours(colour, COMPANIONS[colour] if share > 0 else (255, 255, 255), abs(share)) for share in TINTS]
