"""Lamps: dark discs on the ground where a part of a game has its light, and the glow of those that are lit.

The ground is drawn once and kept; what is lit is laid over it as sprites that are kept too.

Playfield: a ground of markings alone, with lamps, shadows of what is fixed, and caps on posts that kick.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pygame

from sandbox.scene.description.base import GROUND, Point
from sandbox.scene.description.fixed import Post
from sandbox.scene.description.play import PlayPart
from sandbox.scene.scene import Scene
from sandbox.window.camera import Camera
from sandbox.window.render.lines import Pixel, clip_segment, draw_line
from sandbox.window.render.palette import BACKGROUND, INK, Colour, colour_of_fixed, hex_colour, mix_colours
from sandbox.window.render.sdf import ShapeStyle, disc_distance, draw_sdf
from sandbox.window.render.static_geometry import draw_markings, draw_static_bodies, draw_zones, on_layer

AMBER: Colour = (255, 196, 84)
WHITE: Colour = (255, 255, 255)
RADIUS = 0.0065
"""m"""
GLOW, STRENGTH = 6.5, 0.75
"""how far the light reaches, in radii of the lamp, and how much it adds beside it"""
MAX_LAMP_RADIUS = 400.0
"""px, radius of a lamp so near that its glow would cost more than it shows"""
MAX_SPRITES = 64
"""sprites that are kept"""


class LampSprite(NamedTuple):
    """A lit lamp."""

    glow: pygame.Surface
    """added to what is below it"""
    bulb: pygame.Surface
    """laid over it"""


def draw_lamps(
    surface: pygame.Surface, camera: Camera, scene: Scene, unit: float = 1.0, antialias: bool = True
) -> None:
    """Draw all the lamps of a scene as they are while nobody lights them."""
    for part in scene.play.parts:
        if part.light is not None:
            colour = _colour(part)
            look = ShapeStyle(
                mix_colours(BACKGROUND, colour, 0.35), mix_colours(BACKGROUND, colour, 0.7), 1.2 * unit, 1.0, antialias
            )
            draw_spot(surface, camera, part.light, RADIUS, look)


def draw_spot(surface: pygame.Surface, camera: Camera, at: Point, radius: float, look: ShapeStyle) -> None:
    """Draw a disc on the ground, as far as it is in sight; place and radius in m."""
    ((x, y),), size = camera.to_screen(np.asarray([at])).tolist(), radius * camera.scale
    if clip_segment((x, y), (x, y), surface.get_clip(), size + 4.0) is None:
        return
    reach = min(size, 1e6)
    low, high = (min(max(v - reach, -1e6), 1e6) for v in (x, y)), (min(max(v + reach, -1e6), 1e6) for v in (x, y))
    (left, top), (right, bottom) = low, high
    within = pygame.Rect(int(left) - 3, int(top) - 3, int(right - left) + 7, int(bottom - top) + 7)
    draw_sdf(surface, disc_distance(x, y, size), look, within)


class LampRenderer:
    """Draws what is lit, and keeps the sprites."""

    def __init__(self) -> None:
        self._sprites: dict[tuple[Colour, float], LampSprite] = {}

    def draw(self, surface: pygame.Surface, camera: Camera, scene: Scene, lit: frozenset[str]) -> None:
        """Draw the lamps of the parts of these names."""
        radius = max(RADIUS * camera.scale, 1.0)
        if not lit or radius > MAX_LAMP_RADIUS:
            return
        for part in scene.play.parts:
            if part.light is None or part.name not in lit:
                continue
            x, y = camera.to_screen(np.asarray(part.light)).tolist()
            if clip_segment((x, y), (x, y), surface.get_clip(), GLOW * radius + 2.0) is None:
                continue
            glow, bulb = self._sprite(_colour(part), radius)
            surface.blit(glow, glow.get_rect(center=(round(x), round(y))), special_flags=pygame.BLEND_RGB_ADD)
            surface.blit(bulb, bulb.get_rect(center=(round(x), round(y))))

    def _sprite(self, colour: Colour, radius: float) -> LampSprite:
        known = self._sprites.get((colour, radius))
        if known is None:
            if len(self._sprites) >= MAX_SPRITES:  # of a zoom before
                self._sprites.clear()
            self._sprites[colour, radius] = known = LampSprite(_glow(colour, radius), _bulb(colour, radius))
        return known


def _colour(part: PlayPart) -> Colour:
    return AMBER if part.colour is None else hex_colour(part.colour)


def _distances(reach: float) -> "np.ndarray[tuple[int, int], np.dtype[np.float64]]":
    """Return the distance of each pixel of a sprite from its middle, px."""
    side = 2 * int(np.ceil(reach)) + 1
    along = np.arange(side) - side // 2
    return np.hypot(along[:, None], along[None, :])


def _glow(colour: Colour, radius: float) -> pygame.Surface:
    """Return light that fades with the square of what is left to its reach."""
    share = STRENGTH * np.maximum(1.0 - _distances(GLOW * radius) / (GLOW * radius), 0.0) ** 2
    surface = pygame.Surface(share.shape, 0, 32)
    pygame.surfarray.blit_array(surface, np.rint(share[:, :, None] * colour).astype(np.uint8))
    return surface


def _bulb(colour: Colour, radius: float) -> pygame.Surface:
    """Return a disc that is nearly white in its middle."""
    size = radius + 1.0  # to cover the rim of the dark one, wherever in its pixel that has its middle
    away = _distances(size + 1.0)
    surface = pygame.Surface(away.shape, pygame.SRCALPHA, 32)
    white = (0.8 * (1.0 - np.minimum(away / size, 1.0) ** 2))[:, :, None]
    pygame.surfarray.pixels3d(surface)[:] = np.rint(white * WHITE + (1.0 - white) * colour).astype(np.uint8)
    pygame.surfarray.pixels_alpha(surface)[:] = np.rint(255.0 * np.clip(size + 0.5 - away, 0.0, 1.0)).astype(np.uint8)
    return surface


DARK: Colour = (5, 8, 14)
SHADOW = (0.003, -0.005)
"""m, from what is fixed to its shadow"""
SHADE, NOTHING = 90, (255, 0, 255)
"""how dark shadows are, of 255; and the colour that stands for none"""
LARGE_DISC = 4000.0
"""px: what is larger than the picture needs no shadow"""
RAISED = 0.62
"""of the radius of a post that kicks: its cap"""


def draw_playfield(
    surface: pygame.Surface, camera: Camera, scene: Scene, unit: float = 1.0, antialias: bool = True
) -> None:
    """Draw such a ground and what is fixed on it, as far as it is in sight."""
    draw_markings(surface, camera, scene, unit, antialias)
    _shadows(surface, camera, scene)
    draw_lamps(surface, camera, scene, unit, antialias)
    draw_zones(surface, camera, _coloured(scene), unit, antialias)
    draw_static_bodies(surface, camera, on_layer(scene, 0), unit, antialias)
    for post in scene.posts:
        if post.kick is not None:
            _cap(surface, camera, post, unit, antialias)


def _coloured(scene: Scene) -> Scene:
    """Return a scene with only those zones that have a colour of their own; paint and lamps mark the others."""
    return scene.model_copy(update={"zones": tuple(zone for zone in scene.zones if zone.colour is not None)})


def _cap(surface: pygame.Surface, camera: Camera, post: Post, unit: float, antialias: bool) -> None:
    """Draw the cap of a bumper: a bright ring, a lid in its colour, a light on it."""
    colour = colour_of_fixed(post)
    for share, inner, rim in (
        (1.0, mix_colours(DARK, colour, 0.45), mix_colours(colour, INK, 0.35)),
        (RAISED + 0.12, INK, mix_colours(INK, colour, 0.3)),
        (RAISED, colour, mix_colours(colour, DARK, 0.35)),
    ):
        draw_spot(
            surface, camera, post.position, share * post.radius, ShapeStyle(inner, rim, 1.5 * unit, 1.0, antialias)
        )
    glint = post.position[0] - 0.2 * post.radius, post.position[1] + 0.22 * post.radius
    draw_spot(surface, camera, glint, 0.2 * post.radius, ShapeStyle(INK, INK, 0.0, 0.35, antialias))


def _shadows(surface: pygame.Surface, camera: Camera, scene: Scene) -> None:
    """Darken the ground beside what is fixed on it, once where shadows overlap."""
    layer = pygame.Surface(surface.get_size(), 0, surface)
    layer.fill(NOTHING)
    layer.set_colorkey(NOTHING)
    layer.set_alpha(SHADE)
    for wall in scene.walls:
        if not wall.solid or GROUND not in wall.layers:
            continue
        points = np.asarray((*wall.points, wall.points[0]) if wall.closed else wall.points) + SHADOW
        half = max(0.5 * wall.thickness * camera.scale, 1.0)
        ends: list[Pixel] = [(x, y) for x, y in camera.to_screen(points).tolist()]
        for a, b in pairwise(ends):
            draw_line(layer, a, b, DARK, 2.0 * half, antialias=False)
        if 1.0 < half < LARGE_DISC:
            for end in ends:
                _dark(layer, end, half)
    for post in scene.posts:
        x, y = camera.to_screen(np.asarray(post.position) + SHADOW).tolist()
        if post.solid and GROUND in post.layers and post.radius * camera.scale < LARGE_DISC:
            _dark(layer, (x, y), post.radius * camera.scale)
    surface.blit(layer, (0, 0))


def _dark(layer: pygame.Surface, at: Pixel, radius: float) -> None:
    if clip_segment(at, at, layer.get_rect(), radius) is not None:
        pygame.draw.circle(layer, DARK, at, radius)
