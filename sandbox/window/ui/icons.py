"""Icons of buttons, drawn oversampled and scaled down for smooth edges."""

import math
from functools import lru_cache

import pygame

from sandbox.window.render.palette import RgbColour

ICON_NAMES = ("play", "pause", "step", "back", "restart", "camera", "record", "stop", "save", "help", "picker", "edit")
_OVERSAMPLING = 4
_GRID = 24
"""side of the grid on which icons are drawn"""


@lru_cache(maxsize=128)
def icon(name: str, side: int, colour: RgbColour) -> pygame.Surface | None:
    """Return an icon of `ICON_NAMES` with a side of `side` px; None for other names."""
    if name not in ICON_NAMES:
        return None
    side = max(side, 1)
    large = pygame.Surface((side * _OVERSAMPLING, side * _OVERSAMPLING), pygame.SRCALPHA)
    large.fill((*colour, 0))  # transparent pixels in the same colour, so that smoothing does not darken edges
    _Pen(large, side * _OVERSAMPLING / _GRID, colour).draw(name)
    return pygame.transform.smoothscale(large, (side, side))


class _Pen:
    """Draws icons on a grid of 24 by 24 units."""

    def __init__(self, surface: pygame.Surface, scale: float, colour: RgbColour) -> None:
        self.surface, self.scale, self.colour = surface, scale, colour

    def draw(self, name: str) -> None:
        """Draw an icon by name."""
        if name == "play":
            self._polygon((7, 4), (20, 12), (7, 20))
        elif name == "pause":
            self._box(6, 4, 4.2, 16)
            self._box(13.8, 4, 4.2, 16)
        elif name == "step":
            self._polygon((4, 4), (15, 12), (4, 20))
            self._box(16, 4, 3.6, 16)
        elif name == "back":
            self._polygon((20, 4), (9, 12), (20, 20))
            self._box(4.4, 4, 3.6, 16)
        elif name == "restart":
            self._restart()
        elif name == "camera":
            self._box(2, 7, 20, 13, 2.5)
            self._box(8, 4, 8, 5, 1.5)
            self._disc(12, 13.2, 4.6, (0, 0, 0, 0))
            self._disc(12, 13.2, 2.6)
        elif name == "record":
            self._disc(12, 12, 7.5)
        elif name == "stop":
            self._box(5.5, 5.5, 13, 13, 1.5)
        elif name == "save":
            self._box(10.4, 3, 3.2, 10)
            self._polygon((5.5, 10), (18.5, 10), (12, 17))
            self._box(4, 18.4, 16, 2.8, 1)
        elif name == "help":
            self._help()
        elif name == "edit":
            self._polygon((4, 20), (5.4, 14.6), (9.4, 18.6))
            self._polygon((6.6, 13.4), (14.4, 5.6), (18.4, 9.6), (10.6, 17.4))
            self._polygon((15.6, 4.4), (17, 3), (21, 7), (19.6, 8.4))
        else:
            for x in (3.5, 13.0):
                for y in (3.5, 13.0):
                    self._box(x, y, 7.5, 7.5, 1.5)

    def _restart(self) -> None:
        self._arc(12, 13, 8, 180, 450)
        self._polygon((12.6, 0.6), (12.6, 9.4), (6.6, 5))

    def _help(self) -> None:
        self._arc(12, 8, 4.6, -70, 185)
        self._box(10.6, 11.6, 2.8, 4.4, 0)
        self._disc(12, 19.4, 1.8)

    def _arc(self, x: float, y: float, radius: float, start: float, end: float) -> None:
        """Draw an arc between two angles in degrees, with round ends."""
        for degrees in range(round(start), round(end) + 1, 3):
            angle = math.radians(degrees)
            self._disc(x + radius * math.cos(angle), y - radius * math.sin(angle), 1.4)

    def _rect(self, x: float, y: float, width: float, height: float) -> pygame.Rect:
        return pygame.Rect(*(round(part * self.scale) for part in (x, y, width, height)))

    def _box(self, x: float, y: float, width: float, height: float, radius: float = 0.8) -> None:
        rect = self._rect(x, y, width, height)
        pygame.draw.rect(self.surface, self.colour, rect, border_radius=round(radius * self.scale))

    def _disc(self, x: float, y: float, radius: float, colour: tuple[int, int, int, int] | None = None) -> None:
        position = x * self.scale, y * self.scale
        pygame.draw.circle(self.surface, self.colour if colour is None else colour, position, radius * self.scale)

    def _polygon(self, *corners: tuple[float, float]) -> None:
        pygame.draw.polygon(self.surface, self.colour, [(x * self.scale, y * self.scale) for x, y in corners])
