"""Lamps: dark discs at the lights of game parts (`[[play.part]]`), and the glow of those that are lit.

Unlit lamps belong to the cached background; lit lamps are drawn over it as cached sprites.
"""

from typing import NamedTuple

import numpy as np
import pygame

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.description.play import PlayPart
from sandbox.window.render.draw_context import Canvas
from sandbox.window.render.lines import clip_segment
from sandbox.window.render.palette import BACKGROUND, RgbColour, hex_colour, mix_colours
from sandbox.window.render.sdf import ShapeStyle, draw_sdf_disc

AMBER: RgbColour = (255, 196, 84)
WHITE: RgbColour = (255, 255, 255)
LAMP_RADIUS = 0.0065
"""m"""
GLOW_RADIUS, GLOW_STRENGTH = 6.5, 0.75
"""radius of the glow in lamp radii, and its additive intensity next to the lamp"""
MAX_LAMP_RADIUS = 400.0
"""px, radius above which no glow is drawn, as it would be costly"""
MAX_SPRITES = 64
"""size of the sprite cache"""


class LampSprite(NamedTuple):
    """Sprites of a lit lamp."""

    glow: pygame.Surface
    """blended additively"""
    bulb: pygame.Surface
    """blended over the glow"""


def draw_lamps(canvas: Canvas, scene: Scene) -> None:
    """Draw all lamps of a scene unlit."""
    for part in scene.play.parts:
        if part.light is not None:
            colour = _colour(part)
            look = ShapeStyle(
                mix_colours(BACKGROUND, colour, 0.35),
                mix_colours(BACKGROUND, colour, 0.7),
                1.2 * canvas.ui_scale,
                1.0,
                canvas.antialias,
            )
            draw_spot(canvas, part.light, LAMP_RADIUS, look)


def draw_spot(canvas: Canvas, at: Point, radius: float, look: ShapeStyle) -> None:
    """Draw the visible part of a disc on the ground; position and radius in m."""
    ((x, y),), size = canvas.camera.to_screen(np.asarray([at])).tolist(), radius * canvas.camera.scale
    draw_sdf_disc(canvas.surface, (x, y), size, look)


class LampRenderer:
    """Draws lit lamps, and caches their sprites."""

    def __init__(self) -> None:
        self._sprites: dict[tuple[RgbColour, float], LampSprite] = {}

    def draw(self, canvas: Canvas, scene: Scene, lit: frozenset[str]) -> None:
        """Draw the lamps of the parts named in `lit`."""
        radius = max(LAMP_RADIUS * canvas.camera.scale, 1.0)
        if not lit or radius > MAX_LAMP_RADIUS:
            return
        for part in scene.play.parts:
            if part.light is None or part.name not in lit:
                continue
            x, y = canvas.camera.to_screen(np.asarray(part.light)).tolist()
            if clip_segment((x, y), (x, y), canvas.surface.get_clip(), GLOW_RADIUS * radius + 2.0) is None:
                continue
            glow, bulb = self._sprite(_colour(part), radius)
            canvas.surface.blit(glow, glow.get_rect(center=(round(x), round(y))), special_flags=pygame.BLEND_RGB_ADD)
            canvas.surface.blit(bulb, bulb.get_rect(center=(round(x), round(y))))

    def _sprite(self, colour: RgbColour, radius: float) -> LampSprite:
        known = self._sprites.get((colour, radius))
        if known is None:
            if len(self._sprites) >= MAX_SPRITES:  # sprites of earlier zoom levels
                self._sprites.clear()
            self._sprites[colour, radius] = known = LampSprite(_glow(colour, radius), _bulb(colour, radius))
        return known


def _colour(part: PlayPart) -> RgbColour:
    return AMBER if part.colour is None else hex_colour(part.colour)


def _distances(reach: float) -> "np.ndarray[tuple[int, int], np.dtype[np.float64]]":
    """Return the distance of each pixel of a sprite from its centre, px."""
    side = 2 * int(np.ceil(reach)) + 1
    along = np.arange(side) - side // 2
    return np.hypot(along[:, None], along[None, :])


def _glow(colour: RgbColour, radius: float) -> pygame.Surface:
    """Return the glow: intensity falls quadratically to 0 at its radius."""
    fraction = GLOW_STRENGTH * np.maximum(1.0 - _distances(GLOW_RADIUS * radius) / (GLOW_RADIUS * radius), 0.0) ** 2
    surface = pygame.Surface(fraction.shape, 0, 32)
    pygame.surfarray.blit_array(surface, np.rint(fraction[:, :, None] * colour).astype(np.uint8))
    return surface


def _bulb(colour: RgbColour, radius: float) -> pygame.Surface:
    """Return the bulb: a disc that is nearly white at the centre."""
    size = radius + 1.0  # covers the rim of the unlit lamp for any sub-pixel offset
    away = _distances(size + 1.0)
    surface = pygame.Surface(away.shape, pygame.SRCALPHA, 32)
    white = (0.8 * (1.0 - np.minimum(away / size, 1.0) ** 2))[:, :, None]
    pygame.surfarray.pixels3d(surface)[:] = np.rint(white * WHITE + (1.0 - white) * colour).astype(np.uint8)
    pygame.surfarray.pixels_alpha(surface)[:] = np.rint(255.0 * np.clip(size + 0.5 - away, 0.0, 1.0)).astype(np.uint8)
    return surface
