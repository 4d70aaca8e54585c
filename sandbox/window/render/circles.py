"""Antialiased discs and rings, blitted from cached sprites."""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.window.render.lines import SDL_COORDINATE_LIMIT, draw_line
from sandbox.window.render.palette import BACKGROUND, ColourArray, RgbColour
from sandbox.window.render.particles import packed_pixels
from sandbox.window.render.sdf import ShapeStyle, disc_distance, draw_sdf_disc, sdf_surface, shade_sdf

MAX_SPRITE_RADIUS = 96.0
"""px, largest radius that is drawn as a sprite; larger discs are painted directly, clipped to the surface"""
SPRITES_PER_PX = 128
"""Sprites per px of radius: radii are quantised to 1/128 px."""
SUBPIXEL_OFFSETS = 4
"""Sub-pixel positions of a sprite along each axis, so that slow balls move smoothly."""
SPRITE_BUDGET = 8_000_000
"""px of cached sprites, 32 MB"""
SPRITE_CROWD = 48
"""Number of large discs above which they are drawn without antialiasing; they mostly cover each other."""
SHORTEST_SPOKE = 4.0
"""px, smallest radius with a rotation mark"""
MAX_THIN_RADIUS = 14.0
"""px, largest radius with a rotation mark one pixel wide"""
MAX_THICK_MARKS = 300
"""Number of rotation marks above which all are one pixel wide."""
DARKEN_FRACTION = 0.5
"""Fraction by which the colours of rims and rotation marks are mixed with the background."""


class CircleStyle(NamedTuple):
    """Style of discs."""

    line: float = 1.5
    """rim width, px"""
    hollow: bool = False
    antialias: bool = True


class CircleRenderer:
    """Draws discs and rings, and caches their sprites between frames."""

    def __init__(self) -> None:
        self._sprites: dict[CircleStyle, dict[int, pygame.Surface]] = {}
        self._pixels = 0

    def draw(
        self, surface: pygame.Surface, centre: FloatArray, radius: FloatArray, colours: ColourArray, style: CircleStyle
    ) -> None:
        """Draw discs in order, those drawn as sprites first.

        Args:
            surface: the target.
            centre: (K, 2) px, finite.
            radius: (K,) px, of any size.
            colours: (K, 3).
            style: of all discs; a hollow disc is only a rim, in the colour of the disc.
        """
        small = radius <= MAX_SPRITE_RADIUS
        if small.all():
            self._blit(surface, centre, radius, colours, style)
            return
        self._blit(surface, centre[small], radius[small], colours[small], style)
        large = np.flatnonzero(~small).tolist()
        for k in large:
            x, y = centre[k].tolist()
            red, green, blue = colours[k].tolist()
            _paint(surface, x, y, float(radius[k]), (red, green, blue), style, len(large) > SPRITE_CROWD)

    def ring(
        self, surface: pygame.Surface, centre: tuple[float, float], radius: float, colour: RgbColour, style: CircleStyle
    ) -> None:
        """Draw one ring."""
        ring = style._replace(hollow=True)
        self.draw(surface, np.asarray([centre]), np.asarray([radius]), np.asarray([colour], np.uint8), ring)

    def _blit(
        self, surface: pygame.Surface, centre: FloatArray, radius: FloatArray, colours: ColourArray, style: CircleStyle
    ) -> None:
        size = np.maximum(np.rint(radius * SPRITES_PER_PX), 1.0).astype(np.int64)
        steps = SUBPIXEL_OFFSETS if style.antialias else 1
        subpixel = np.floor(centre * steps + 0.5).astype(np.int64)
        corner = subpixel // steps - (np.ceil(size / SPRITES_PER_PX).astype(np.int64) + 1)[:, None]
        keys = _keys(size, colours, subpixel % steps).tolist()
        if self._pixels > SPRITE_BUDGET:
            self._sprites.clear()
            self._pixels = 0
        sprites = self._sprites.setdefault(style, {})
        for key in set(keys).difference(sprites):
            sprites[key] = sprite = _sprite(key, style)
            self._pixels += sprite.get_width() * sprite.get_height()
        positions = zip(corner[:, 0].tolist(), corner[:, 1].tolist(), strict=True)
        surface.blits(list(zip(map(sprites.__getitem__, keys), positions, strict=True)), False)


def _keys(size: IntArray, colours: ColourArray, offset: IntArray) -> IntArray:
    """Return the cache keys of sprites: radius, red, green, blue and the sub-pixel offsets, packed into an integer."""
    key = size
    for channel in range(3):
        key = key << 8 | colours[:, channel]
    return (key << 2 | offset[:, 0]) << 2 | offset[:, 1]


def _sprite(key: int, style: CircleStyle) -> pygame.Surface:
    down, across = key & 3, key >> 2 & 3
    blue, green, red = key >> 4 & 255, key >> 12 & 255, key >> 20 & 255
    radius = (key >> 28) / SPRITES_PER_PX
    half = math.ceil(radius) + 1
    pixels = np.arange(2 * half + 1, dtype=np.float64) + 0.5
    # Coverage that falls off linearly over a pixel adds 1/12 px² to the squared radius, visible on tiny discs.
    drawn_radius = math.sqrt(max(radius**2 - 1.0 / 12.0, 0.04)) if style.antialias else radius
    distance = disc_distance(half + across / SUBPIXEL_OFFSETS, half + down / SUBPIXEL_OFFSETS, drawn_radius)
    return sdf_surface(
        shade_sdf(distance(pixels[:, None], pixels[None, :]), _shape_style(radius, (red, green, blue), style))
    )


def _shape_style(radius: float, colour: RgbColour, style: CircleStyle) -> ShapeStyle:
    if style.hollow:
        return ShapeStyle(None, colour, style.line, antialias=style.antialias)
    rim = min(0.16 * radius, style.line * min(1.0 + radius / 80.0, 2.5))
    return ShapeStyle(colour, darken(colour), rim, antialias=style.antialias)


def _paint(
    surface: pygame.Surface, x: float, y: float, radius: float, colour: RgbColour, style: CircleStyle, plain: bool
) -> None:
    """Draw a disc that is too large for a sprite."""
    if plain and radius < SDL_COORDINATE_LIMIT:
        pygame.draw.circle(surface, colour, (round(x), round(y)), round(radius), 2 if style.hollow else 0)
        return
    draw_sdf_disc(surface, (x, y), radius, _shape_style(radius, colour, style))


def darken(colour: RgbColour) -> RgbColour:
    """Return the colour of the rim and the rotation mark of a ball."""
    red, green, blue = (round(c + (b - c) * DARKEN_FRACTION) for c, b in zip(colour, BACKGROUND, strict=True))
    return red, green, blue


def draw_rotation_marks(
    surface: pygame.Surface,
    centre: FloatArray,
    radius: FloatArray,
    angle: FloatArray,
    colours: ColourArray,
    antialias: bool,
) -> None:
    """Draw the radial line that shows the angle of a disc; it starts at 35 % of the radius.

    Args:
        surface: the target.
        centre: (K, 2) px.
        radius: (K,) px; discs below `SHORTEST_SPOKE` or above 1e6 get no mark.
        angle: (K,) rad, counter-clockwise, as in the world (y up).
        colours: (K, 3) of the discs.
        antialias: whether edges are smooth.
    """
    shown = np.flatnonzero((radius >= SHORTEST_SPOKE) & (radius < 1e6) & np.isfinite(angle))
    direction = np.stack((np.cos(angle[shown]), -np.sin(angle[shown])), 1)
    middle, reach = centre[shown] - 0.5, radius[shown, None]  # SDL pixel centres are at integers
    ends = np.concatenate((middle + direction * reach * 0.35, middle + direction * (reach * 0.95 - 1.0)), 1)
    tones = np.rint(colours[shown] * (1.0 - DARKEN_FRACTION) + np.asarray(BACKGROUND) * DARKEN_FRACTION).astype(
        np.uint8
    )
    is_thin = (reach[:, 0] <= MAX_THIN_RADIUS) | (len(shown) > MAX_THICK_MARKS)
    line = pygame.draw.aaline if antialias else pygame.draw.line
    # Flat lists of numbers: thousands of small tuples would trigger the garbage collector.
    columns = (column.tolist() for column in (packed_pixels(tones[is_thin], surface), *ends[is_thin].T))
    for tone, ax, ay, bx, by in zip(*columns, strict=True):
        line(surface, tone, (ax, ay), (bx, by))
    for k in np.flatnonzero(~is_thin).tolist():
        ax, ay, bx, by = (ends[k] + 0.5).tolist()
        red, green, blue = tones[k].tolist()
        width = min(0.08 * float(reach[k, 0]), 6.0)
        draw_line(surface, (ax, ay), (bx, by), (red, green, blue), width, antialias)


OVERSAMPLING = 4
"""oversampling factor per axis of the images of `draw_disc`"""


def draw_disc(
    surface: pygame.Surface, position: tuple[float, float], radius: float, colour: RgbColour, hole: float = 0.0
) -> None:
    """Draw a small antialiased disc, or a ring with inner radius `hole` if that is positive; px.

    One out of sight is left out: SDL has no coordinates beyond 32 bits.
    """
    (x, y), (width, height) = position, surface.get_size()
    if not (-radius <= x <= width + radius and -radius <= y <= height + radius):
        return
    image = _disc_image(round(OVERSAMPLING * max(radius, 0.5)), colour, round(OVERSAMPLING * hole))
    surface.blit(image, image.get_rect(center=(round(x), round(y))))


@lru_cache(maxsize=256)
def _disc_image(radius: int, colour: RgbColour, hole: int) -> pygame.Surface:
    side = 2 * (radius // OVERSAMPLING) + 3  # odd, so that there is a centre pixel
    large = pygame.Surface((side * OVERSAMPLING, side * OVERSAMPLING), pygame.SRCALPHA)
    large.fill((*colour, 0))
    middle = large.get_rect().center
    pygame.draw.circle(large, colour, middle, radius)
    if hole > 0:
        pygame.draw.circle(large, (*colour, 0), middle, hole)
    return pygame.transform.smoothscale(large, (side, side))
