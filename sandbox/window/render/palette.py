"""Colour palette of the window. The accents are distinguishable with colour vision deficiency.

Source: M. Okabe, K. Ito, "Color Universal Design", 2008; black is omitted, as the background is dark.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.base import BodySpec, HasMaterial
from sandbox.scene.description.discs import Emitter

RgbColour = tuple[int, int, int]
"""sRGB, 0 to 255 per channel."""
ColourArray = npt.NDArray[np.uint8]

BACKGROUND: RgbColour = (20, 24, 31)
PANEL: RgbColour = (29, 35, 44)
PANEL_RAISED: RgbColour = (42, 50, 62)
LINE: RgbColour = (56, 66, 80)
GRID: RgbColour = (29, 34, 43)
GRID_STRONG: RgbColour = (37, 44, 55)
SOLID: RgbColour = (38, 46, 57)
"""Fill of planes and walls."""
SURFACE: RgbColour = (138, 151, 168)
"""Edge of solid geometry."""
INK: RgbColour = (230, 235, 242)
FAINT: RgbColour = (146, 158, 174)
NEUTRAL: RgbColour = (126, 137, 152)
"""Static bodies and posts."""

ORANGE: RgbColour = (230, 159, 0)
SKY: RgbColour = (86, 180, 233)
GREEN: RgbColour = (0, 158, 115)
YELLOW: RgbColour = (240, 228, 66)
BLUE: RgbColour = (0, 114, 178)
VERMILION: RgbColour = (213, 94, 0)
PURPLE: RgbColour = (204, 121, 167)
ACCENTS: tuple[RgbColour, ...] = (SKY, ORANGE, GREEN, YELLOW, PURPLE, VERMILION, BLUE)
"""In the order in which they are assigned to elements."""

TOUCHING, CLEAR = VERMILION, GREEN
"""Bodies with and without overlap, in scenes that show contact by colour."""
WARNING: RgbColour = (255, 92, 80)
"""Used only together with text or a shape, because of colour vision deficiency."""

FEW_BODIES = 8
"""Number of bodies up to which each body of a generator gets its own accent."""
COMPANIONS: dict[RgbColour, RgbColour] = {
    SKY: BLUE,
    ORANGE: VERMILION,
    GREEN: BLUE,
    YELLOW: ORANGE,
    PURPLE: BLUE,
    VERMILION: PURPLE,
    BLUE: SKY,
}
TINTS = (0.0, 0.45, -0.3, 0.2, -0.15, 0.65)
"""Colours of the bodies of a larger generator: fraction of mixing from its accent towards the companion or, if
negative, towards white.
"""


def hex_colour(text: str) -> RgbColour:
    """Return the colour given as `#rrggbb`."""
    value = int(text[1:], 16)
    return value >> 16, value >> 8 & 255, value & 255


def mix_colours(a: RgbColour, b: RgbColour, fraction: float) -> RgbColour:
    """Return the linear mix of `a` and `b`: `a` at share 0, `b` at share 1."""
    red, green, blue = (round(x + (y - x) * fraction) for x, y in zip(a, b, strict=True))
    return red, green, blue


def accent(number: int) -> RgbColour:
    """Return the accent of the element with this index."""
    return ACCENTS[number % len(ACCENTS)]


def colour_of_fixed(thing: HasMaterial, otherwise: RgbColour = NEUTRAL) -> RgbColour:
    """Return the colour of a plane, wall or post: its own, or `otherwise`."""
    return otherwise if thing.colour is None else hex_colour(thing.colour)


def colour_of(bodies: Bodies, numbers: Sequence[int] | None = None) -> ColourArray:
    """Return the colours of bodies, (N, 3); adding a body does not change those of the others.

    The colour of the element, or the first colour of its fade; else an accent; static bodies are neutral.

    Args:
        bodies: N of them.
        numbers: numbers of the accents of `bodies.elements`; by default their indices.
    """
    colours = np.empty((len(bodies), 3), np.uint8)
    first = np.searchsorted(bodies.element, np.arange(len(bodies.elements) + 1))
    accents = range(len(bodies.elements)) if numbers is None else numbers
    for index, (element, k) in enumerate(zip(bodies.elements, accents, strict=True)):
        start, end = int(first[index]), int(first[index + 1])
        if element.colour is not None:
            colours[start:end] = hex_colour(element.colour)
        elif isinstance(element, Emitter) and element.colours is not None:
            colours[start:end] = hex_colour(element.colours[0])
        elif isinstance(element, BodySpec):
            colours[start:end] = NEUTRAL if element.fixed else accent(k)
        elif end - start <= FEW_BODIES:
            colours[start:end] = [accent(k + n) for n in range(end - start)]
        else:
            tints = np.asarray(_family(accent(k + isinstance(element, Emitter))), np.uint8)  # emitters start at orange
            colours[start:end] = tints[np.arange(end - start) % len(tints)]
    return colours


def _family(colour: RgbColour) -> list[RgbColour]:
    """Return the tints for the bodies of a larger generator."""
    return [
        mix_colours(colour, COMPANIONS[colour] if fraction > 0 else (255, 255, 255), abs(fraction))
        for fraction in TINTS
    ]
