"""Icons of buttons and tools, drawn oversampled on a grid of 24 units and scaled down for smooth edges."""

import math
from collections.abc import Callable, Mapping
from functools import lru_cache

import pygame

from sandbox.window.render.palette import RgbColour

_OVERSAMPLING = 4
_GRID = 24


class IconCanvas:
    """Draws on a grid of 24 by 24 units, y down."""

    def __init__(self, surface: pygame.Surface, scale: float, colour: RgbColour) -> None:
        self._surface, self._scale, self._colour = surface, scale, colour

    def line(self, *points: tuple[float, float], width: float = 2.0, closed: bool = False) -> None:
        """Draw a polyline with round joints."""
        ends = (*points[1:], points[0]) if closed else points[1:]
        for a, b in zip(points, ends, strict=False):
            self._segment(a, b, width)
        for point in points:
            self.disc(*point, 0.5 * width)

    def _segment(self, a: tuple[float, float], b: tuple[float, float], width: float) -> None:
        length = math.dist(a, b)
        if not length:
            return
        x, y = 0.5 * width * (a[1] - b[1]) / length, 0.5 * width * (b[0] - a[0]) / length
        self.polygon((a[0] + x, a[1] + y), (b[0] + x, b[1] + y), (b[0] - x, b[1] - y), (a[0] - x, a[1] - y))

    def polygon(self, *corners: tuple[float, float]) -> None:
        """Fill a polygon."""
        pygame.draw.polygon(self._surface, self._colour, [(x * self._scale, y * self._scale) for x, y in corners])

    def box(self, x: float, y: float, width: float, height: float, radius: float = 0.8) -> None:
        """Fill a rectangle with round corners, given by its upper left corner."""
        rect = pygame.Rect(*(round(part * self._scale) for part in (x, y, width, height)))
        pygame.draw.rect(self._surface, self._colour, rect, border_radius=round(radius * self._scale))

    def disc(self, x: float, y: float, radius: float, is_erased: bool = False) -> None:
        """Fill a disc, or make it transparent."""
        colour = (0, 0, 0, 0) if is_erased else self._colour
        pygame.draw.circle(self._surface, colour, (x * self._scale, y * self._scale), radius * self._scale)

    def ring(self, x: float, y: float, radius: float, width: float = 2.0) -> None:
        """Draw a circle."""
        centre = x * self._scale, y * self._scale
        outer = (radius + 0.5 * width) * self._scale
        pygame.draw.circle(self._surface, self._colour, centre, outer, round(width * self._scale))

    def arc(self, x: float, y: float, radius: float, start: float, end: float, width: float = 2.0) -> None:
        """Draw an arc between two angles, degrees, counter-clockwise."""
        count = max(round(abs(end - start) / 10.0), 2)
        angles = [math.radians(start + (end - start) * k / count) for k in range(count + 1)]
        self.line(*((x + radius * math.cos(a), y - radius * math.sin(a)) for a in angles), width=width)


def _pause(canvas: IconCanvas) -> None:
    canvas.box(6, 4, 4.2, 16)
    canvas.box(13.8, 4, 4.2, 16)


def _step(canvas: IconCanvas) -> None:
    canvas.polygon((4, 4), (15, 12), (4, 20))
    canvas.box(16, 4, 3.6, 16)


def _back(canvas: IconCanvas) -> None:
    canvas.polygon((20, 4), (9, 12), (20, 20))
    canvas.box(4.4, 4, 3.6, 16)


def _thick_arc(canvas: IconCanvas, x: float, y: float, radius: float, start: int, end: int) -> None:
    """Draw an arc between two angles, degrees, with round ends."""
    for degrees in range(start, end + 1, 3):
        angle = math.radians(degrees)
        canvas.disc(x + radius * math.cos(angle), y - radius * math.sin(angle), 1.4)


def _restart(canvas: IconCanvas) -> None:
    _thick_arc(canvas, 12, 13, 8, 180, 450)
    canvas.polygon((12.6, 0.6), (12.6, 9.4), (6.6, 5))


def _camera(canvas: IconCanvas) -> None:
    canvas.box(2, 7, 20, 13, 2.5)
    canvas.box(8, 4, 8, 5, 1.5)
    canvas.disc(12, 13.2, 4.6, is_erased=True)
    canvas.disc(12, 13.2, 2.6)


def _save(canvas: IconCanvas) -> None:
    canvas.box(10.4, 3, 3.2, 10)
    canvas.polygon((5.5, 10), (18.5, 10), (12, 17))
    canvas.box(4, 18.4, 16, 2.8, 1)


def _help(canvas: IconCanvas) -> None:
    _thick_arc(canvas, 12, 8, 4.6, -70, 185)
    canvas.box(10.6, 11.6, 2.8, 4.4, 0)
    canvas.disc(12, 19.4, 1.8)


def _edit(canvas: IconCanvas) -> None:
    canvas.polygon((4, 20), (5.4, 14.6), (9.4, 18.6))
    canvas.polygon((6.6, 13.4), (14.4, 5.6), (18.4, 9.6), (10.6, 17.4))
    canvas.polygon((15.6, 4.4), (17, 3), (21, 7), (19.6, 8.4))


def _picker(canvas: IconCanvas) -> None:
    for x in (3.5, 13.0):
        for y in (3.5, 13.0):
            canvas.box(x, y, 7.5, 7.5, 1.5)


def _select(canvas: IconCanvas) -> None:
    canvas.polygon((6, 3), (6, 19), (10.2, 15.2), (13, 21), (15.6, 19.8), (12.9, 14.2), (18.4, 13.8))


def _capsule(canvas: IconCanvas) -> None:
    canvas.line((8, 7.5), (16, 7.5))
    canvas.line((8, 16.5), (16, 16.5))
    canvas.arc(8, 12, 4.5, 90, 270)
    canvas.arc(16, 12, 4.5, -90, 90)


def _plane(canvas: IconCanvas) -> None:
    canvas.line((2.5, 10), (21.5, 10), width=2.4)
    for x in (5, 10, 15, 20):
        canvas.line((x, 11), (x - 3, 17), width=1.4)


def _post(canvas: IconCanvas) -> None:
    canvas.ring(12, 12, 6.5)
    canvas.disc(12, 12, 2.2)


def _zone(canvas: IconCanvas) -> None:
    corners = [(4, 6), (18, 4), (20, 17), (7, 20)]
    for (ax, ay), (bx, by) in zip(corners, (*corners[1:], corners[0]), strict=True):
        for k in range(4):
            begin, end = (k + 0.1) / 4, (k + 0.65) / 4
            canvas.line(
                (ax + (bx - ax) * begin, ay + (by - ay) * begin),
                (ax + (bx - ax) * end, ay + (by - ay) * end),
                width=1.8,
            )


def _rod(canvas: IconCanvas) -> None:
    canvas.line((6, 18), (18, 6))
    canvas.disc(6, 18, 3)
    canvas.disc(18, 6, 3)


def _pivot(canvas: IconCanvas) -> None:
    canvas.ring(12, 12, 4.2)
    canvas.disc(12, 12, 1.7)
    canvas.line((2.5, 17.5), (8.4, 14.2), width=2.4)
    canvas.line((15.6, 9.8), (21.5, 6.5), width=2.4)


def _rope(canvas: IconCanvas) -> None:
    canvas.disc(5, 6, 2.6)
    canvas.disc(19, 6, 2.6)
    canvas.arc(12, 6, 7, 180, 360, width=1.8)


def _spring(canvas: IconCanvas) -> None:
    zigzag = [(4.5, 19.5), (7, 17)]
    for k in range(5):
        x, y = 8.2 + 1.9 * k, 15.8 - 1.9 * k
        side = 2.6 if k % 2 else -2.6
        zigzag.append((x + side, y + side))
    canvas.line(*zigzag, (17, 7), (19.5, 4.5), width=1.7)
    canvas.disc(4.5, 19.5, 2.4)
    canvas.disc(19.5, 4.5, 2.4)


def _motor(canvas: IconCanvas) -> None:
    canvas.arc(12, 12, 7.5, -60, 220)
    canvas.polygon((2.6, 13.4), (9.6, 14.4), (5.2, 20))
    canvas.disc(12, 12, 2.4)


def _slide(canvas: IconCanvas) -> None:
    canvas.line((3.5, 12), (9, 12), width=2.2)
    canvas.line((15, 12), (20.5, 12), width=2.2)
    canvas.line((7, 8), (15, 8), width=1.8)
    canvas.line((7, 16), (15, 16), width=1.8)
    canvas.line((15, 8), (15, 16), width=1.8)
    canvas.disc(3.5, 12, 2.4)
    canvas.disc(20.5, 12, 2.4)


def _groove(canvas: IconCanvas) -> None:
    canvas.line((7, 8), (17, 8), width=1.8)
    canvas.line((7, 16), (17, 16), width=1.8)
    canvas.arc(7, 12, 4, 90, 270, width=1.8)
    canvas.arc(17, 12, 4, -90, 90, width=1.8)
    canvas.disc(9, 12, 2.3)


def _gear(canvas: IconCanvas) -> None:
    canvas.ring(12, 12, 5.2, width=2.2)
    canvas.disc(12, 12, 1.6)
    for k in range(8):
        cos, sin = math.cos(math.radians(45 * k)), math.sin(math.radians(45 * k))
        canvas.line((12 + 6.6 * cos, 12 + 6.6 * sin), (12 + 9 * cos, 12 + 9 * sin), width=2.6)


def _flipper(canvas: IconCanvas) -> None:
    canvas.polygon((5.6, 10.6), (18.6, 17.6), (17.4, 19.8), (3.2, 16.6))
    canvas.disc(5.4, 13.8, 3.4)
    canvas.disc(18, 18.7, 1.6)
    canvas.arc(5.4, 13.8, 13, -4, 36, width=1.8)
    canvas.polygon((17.4, 3.6), (18.8, 8.4), (13.6, 8))


def _plunger(canvas: IconCanvas) -> None:
    canvas.line((12, 3), (12, 17), width=2.6)
    canvas.line((8, 3.5), (16, 3.5), width=2.6)
    for y in (8, 11, 14):
        canvas.line((8, y + 1), (16, y - 1), width=1.5)
    canvas.line((6.5, 17), (17.5, 17), width=2)
    canvas.disc(12, 20, 2.2)


def _thrust(canvas: IconCanvas) -> None:
    canvas.line((4, 20), (14, 10), width=2.6)
    canvas.polygon((20, 4), (17.6, 13), (11, 6.4))


def _attraction(canvas: IconCanvas) -> None:
    canvas.disc(12, 12, 3)
    for k in range(4):
        angle = math.radians(45 + 90 * k)
        cos, sin = math.cos(angle), math.sin(angle)
        canvas.line((12 + 10.5 * cos, 12 + 10.5 * sin), (12 + 7 * cos, 12 + 7 * sin), width=1.8)
        tip = 12 + 5 * cos, 12 + 5 * sin
        side = 2.4 * sin, -2.4 * cos
        base = 12 + 8 * cos, 12 + 8 * sin
        canvas.polygon(tip, (base[0] + side[0], base[1] + side[1]), (base[0] - side[0], base[1] - side[1]))


def _eraser(canvas: IconCanvas) -> None:
    canvas.line((4, 15), (12.5, 6.5), (19, 13), (12.5, 19.5), (8.5, 19.5), closed=True)
    canvas.polygon((12.5, 6.5), (19, 13), (15.2, 16.8), (8.7, 10.3))


def _undo(canvas: IconCanvas, side: float = 1.0) -> None:
    def x(value: float) -> float:
        return 12.0 + side * (value - 12.0)

    canvas.line((x(7), 9), (x(14), 9), width=2.4)
    canvas.arc(x(14), 14, 5, 90, -90 if side > 0 else 270, width=2.4)
    canvas.line((x(14), 19), (x(9), 19), width=2.4)
    canvas.polygon((x(2.5), 9), (x(9), 4), (x(9), 14))


ICONS: Mapping[str, Callable[[IconCanvas], None]] = {
    "play": lambda canvas: canvas.polygon((7, 4), (20, 12), (7, 20)),
    "pause": _pause,
    "step": _step,
    "back": _back,
    "restart": _restart,
    "camera": _camera,
    "record": lambda canvas: canvas.disc(12, 12, 7.5),
    "stop": lambda canvas: canvas.box(5.5, 5.5, 13, 13, 1.5),
    "save": _save,
    "help": _help,
    "edit": _edit,
    "picker": _picker,
    "select": _select,
    "ball": lambda canvas: canvas.ring(12, 12, 8),
    "box": lambda canvas: canvas.line((4.5, 6), (19.5, 6), (19.5, 18), (4.5, 18), closed=True),
    "capsule": _capsule,
    "polygon": lambda canvas: canvas.line((4, 15), (8, 5), (17, 4), (20.5, 12), (13, 20), closed=True),
    "plane": _plane,
    "wall": lambda canvas: canvas.line((3, 19), (8, 7), (15, 15), (21, 4), width=2.8),
    "post": _post,
    "zone": _zone,
    "rod": _rod,
    "pivot": _pivot,
    "rope": _rope,
    "spring": _spring,
    "motor": _motor,
    "slide": _slide,
    "groove": _groove,
    "gear": _gear,
    "flipper": _flipper,
    "plunger": _plunger,
    "thrust": _thrust,
    "attraction": _attraction,
    "eraser": _eraser,
    "undo": _undo,
    "redo": lambda canvas: _undo(canvas, -1.0),
}
"""Drawings of all icons."""


@lru_cache(maxsize=128)
def icon(name: str, side: int, colour: RgbColour) -> pygame.Surface:
    """Return an icon of `ICONS` with a side of `side` px.

    Raises:
        KeyError: there is no such icon.
    """
    side = max(side, 1)
    large = pygame.Surface((side * _OVERSAMPLING, side * _OVERSAMPLING), pygame.SRCALPHA)
    large.fill((*colour, 0))  # transparent pixels in the same colour, so that smoothing does not darken edges
    ICONS[name](IconCanvas(large, side * _OVERSAMPLING / _GRID, colour))
    return pygame.transform.smoothscale(large, (side, side))
