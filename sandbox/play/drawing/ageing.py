"""Ageing: particles that fade from colour to colour over their lives."""

import numpy as np

from sandbox.arrays import IntArray
from sandbox.play.drawing.palette import ColourArray, hex_colour
from sandbox.play.drawing.points import MANY, Packed
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.discs import Emitter

SHADES = 64
"""Steps of a life that are told apart: one and the next look alike, and a crowd has few colours at once."""


class Ageing:
    """Those of some bodies that fade, and how."""

    def __init__(self, bodies: Bodies) -> None:
        colours = [each.colours if isinstance(each, Emitter) else None for each in bodies.elements]
        fading = [k for k, each in enumerate(colours) if each is not None]
        self.shades: ColourArray = np.concatenate(
            [np.empty((0, 3), np.uint8), *(faded(each) for each in colours if each is not None)]
        )
        """(S, 3), SHADES of each element that fades, one element after the other"""
        order = np.full(len(colours), -1, np.int64)
        order[fading] = np.arange(len(fading))
        row = order[bodies.element]
        numbers = np.flatnonzero(row >= 0)
        first = int(numbers[0]) if len(numbers) else 0
        consecutive = len(numbers) == 0 or int(numbers[-1]) == first + len(numbers) - 1
        self.who: slice | IntArray = slice(first, first + len(numbers)) if consecutive else numbers
        """(F,) numbers of those that fade"""
        self._place = np.full(len(bodies), -1, np.int64)
        self._place[numbers] = np.arange(len(numbers))
        self._first: IntArray = row[numbers] * SHADES
        self._born, self._rate = bodies.born[numbers], SHADES / bodies.lifetime[numbers]

    def __len__(self) -> int:
        return len(self._born)

    def fade(self, tones: Packed, shades: Packed, time: float) -> None:
        """Give those of all bodies (N,) who fade the tones of their ages.

        Args:
            tones: (N,) as a surface holds them, changed in place.
            shades: (S,) the shades, as the surface holds them.
            time: s.
        """
        if isinstance(self.who, slice) and len(self) >= MANY and self._compiled(tones[self.who], shades, time):
            return
        tones[self.who] = shades[self._shade(time, slice(None))]

    def _compiled(self, tones: Packed, shades: Packed, time: float) -> bool:
        """Fade in one compiled pass; return whether that could be done."""
        from sandbox.engines.common.kernel import COMPILED

        if COMPILED:
            from sandbox.play.drawing.scatter import fade

            fade(tones, shades, time, self._born, self._rate, self._first, SHADES)
        return COMPILED

    def over(self, colours: ColourArray, numbers: IntArray, time: float) -> ColourArray:
        """Return the colours of some bodies (K, 3), by their numbers (K,), those who fade as at a time, s."""
        place = self._place[numbers]
        fade = place >= 0
        colours = colours.copy()
        colours[fade] = self.shades[self._shade(time, place[fade])]
        return colours

    def _shade(self, time: float, rows: slice | IntArray) -> IntArray:
        """Return which of the shades some of those who fade have."""
        age = (time - self._born[rows]) * self._rate[rows]
        return self._first[rows] + np.clip(age, 0.0, SHADES - 1.0).astype(np.int64)


def faded(colours: tuple[str, ...]) -> ColourArray:
    """Return colours from the first to the last in equal steps, (SHADES, 3)."""
    stops = np.asarray([hex_colour(each) for each in colours], np.float64)
    along = np.linspace(0.0, len(stops) - 1.0, SHADES)
    mixed = [np.interp(along, np.arange(len(stops)), stops[:, channel]) for channel in range(3)]
    return np.rint(np.stack(mixed, 1)).astype(np.uint8)
