"""Icons: the pictures on the panel's buttons, drawn large and made small so that they are smooth."""

from functools import lru_cache

import pygame

from sandbox.play.drawing.palette import Colour

NAMES = ("play", "pause", "step", "back", "restart", "camera", "record", "stop", "save", "help", "picker")
_OVER = 4
_GRID = 24
"""Icons are drawn on a field of 24 by 24."""


@lru_cache(maxsize=128)
def icon(name: str, side: int, colour: Colour) -> pygame.Surface | None:
    """Return an icon of `NAMES`, side px wide and high, or None where there is no such icon."""
    if name not in NAMES:
        return None
    side = max(side, 1)
    large = pygame.Surface((side * _OVER, side * _OVER), pygame.SRCALPHA)
    large.fill((*colour, 0))  # so that edges do not darken towards black
    _Pen(large, side * _OVER / _GRID, colour).draw(name)
    return pygame.transform.smoothscale(large, (side, side))


class _Pen:
    """Draws on a field of 24 by 24."""

    def __init__(self, surface: pygame.Surface, scale: float, colour: Colour) -> None:
        self.surface, self.scale, self.colour = surface, scale, colour

    def draw(self, name: str) -> None:
        """Draw an icon by its name."""
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
        else:
            for x in (3.5, 13.0):
                for y in (3.5, 13.0):
                    self._box(x, y, 7.5, 7.5, 1.5)

    def _restart(self) -> None:
        rect = self._rect(4, 4.5, 16, 16)
        pygame.draw.arc(self.surface, self.colour, rect, -3.6, 1.2, max(round(2.8 * self.scale), 1))
        self._polygon((12.5, 0.8), (19.5, 5.6), (12.2, 10.2))

    def _help(self) -> None:
        pygame.draw.arc(self.surface, self.colour, self._rect(6.5, 3, 11, 10.5), -1.3, 3.3, round(2.8 * self.scale))
        self._box(10.7, 11.2, 2.7, 4.6)
        self._disc(12, 19.3, 1.8)

    def _rect(self, x: float, y: float, wide: float, high: float) -> pygame.Rect:
        return pygame.Rect(*(round(part * self.scale) for part in (x, y, wide, high)))

    def _box(self, x: float, y: float, wide: float, high: float, radius: float = 0.8) -> None:
        rect = self._rect(x, y, wide, high)
        pygame.draw.rect(self.surface, self.colour, rect, border_radius=round(radius * self.scale))

    def _disc(self, x: float, y: float, radius: float, colour: tuple[int, int, int, int] | None = None) -> None:
        at = x * self.scale, y * self.scale
        pygame.draw.circle(self.surface, self.colour if colour is None else colour, at, radius * self.scale)

    def _polygon(self, *corners: tuple[float, float]) -> None:
        pygame.draw.polygon(self.surface, self.colour, [(x * self.scale, y * self.scale) for x, y in corners])
