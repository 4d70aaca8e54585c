"""View of pinball: a playfield of markings, with lamps, shadows of static bodies, and caps on bumpers."""

from itertools import pairwise

import numpy as np
import pygame

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import GROUND
from sandbox.scene.description.fixed import Post
from sandbox.window.render.draw_context import Canvas, DrawContext, GameView
from sandbox.window.render.lamps import draw_lamps, draw_spot
from sandbox.window.render.lines import Pixel, clip_segment, draw_line
from sandbox.window.render.palette import INK, RgbColour, colour_of_fixed, mix_colours
from sandbox.window.render.sdf import ShapeStyle
from sandbox.window.render.static_geometry import draw_markings, draw_static_bodies, draw_zones, on_layer

DARK: RgbColour = (5, 8, 14)
SHADOW_OFFSET = (0.003, -0.005)
"""m, offset of the shadow of a static body"""
SHADOW_ALPHA, TRANSPARENT = 90, (255, 0, 255)
"""opacity of shadows, of 255; and the colour key of the shadow layer"""
LARGE_DISC = 4000.0
"""px, radius above which a disc has no shadow: it is larger than the window"""
CAP_RADIUS = 0.62
"""radius of the cap of a bumper, as a fraction of the radius of the post"""


def draw_playfield(canvas: Canvas, scene: Scene) -> None:
    """Draw a playfield: markings, shadows, lamps, zones and static bodies, as far as they are visible."""
    draw_markings(canvas, scene)
    _draw_shadows(canvas, scene)
    draw_lamps(canvas, scene)
    draw_zones(canvas, _with_coloured_zones(scene))
    draw_static_bodies(canvas, on_layer(scene, 0))
    for post in scene.posts:
        if post.kick is not None:
            _draw_cap(canvas, post)


def _with_coloured_zones(scene: Scene) -> Scene:
    """Return a scene with only those zones that have a colour; markings and lamps show the others."""
    return scene.model_copy(update={"zones": tuple(zone for zone in scene.zones if zone.colour is not None)})


def _draw_cap(canvas: Canvas, post: Post) -> None:
    """Draw the cap of a bumper: a bright ring, a lid in its colour, and a highlight."""
    colour = colour_of_fixed(post)
    for fraction, inner, rim in (
        (1.0, mix_colours(DARK, colour, 0.45), mix_colours(colour, INK, 0.35)),
        (CAP_RADIUS + 0.12, INK, mix_colours(INK, colour, 0.3)),
        (CAP_RADIUS, colour, mix_colours(colour, DARK, 0.35)),
    ):
        draw_spot(
            canvas,
            post.position,
            fraction * post.radius,
            ShapeStyle(inner, rim, 1.5 * canvas.ui_scale, 1.0, canvas.antialias),
        )
    glint = post.position[0] - 0.2 * post.radius, post.position[1] + 0.22 * post.radius
    draw_spot(canvas, glint, 0.2 * post.radius, ShapeStyle(INK, INK, 0.0, 0.35, canvas.antialias))


def _draw_shadows(canvas: Canvas, scene: Scene) -> None:
    """Draw the shadows of static bodies; overlapping shadows darken the ground only once."""
    layer = pygame.Surface(canvas.surface.get_size(), 0, canvas.surface)
    layer.fill(TRANSPARENT)
    layer.set_colorkey(TRANSPARENT)
    layer.set_alpha(SHADOW_ALPHA)
    for wall in scene.walls:
        if not wall.solid or GROUND not in wall.layers:
            continue
        points = np.asarray((*wall.points, wall.points[0]) if wall.closed else wall.points) + SHADOW_OFFSET
        half = max(0.5 * wall.thickness * canvas.camera.scale, 1.0)
        ends: list[Pixel] = [(x, y) for x, y in canvas.camera.to_screen(points).tolist()]
        for a, b in pairwise(ends):
            draw_line(layer, a, b, DARK, 2.0 * half, antialias=False)
        if 1.0 < half < LARGE_DISC:
            for end in ends:
                _draw_dark_disc(layer, end, half)
    for post in scene.posts:
        x, y = canvas.camera.to_screen(np.asarray(post.position) + SHADOW_OFFSET).tolist()
        if post.solid and GROUND in post.layers and post.radius * canvas.camera.scale < LARGE_DISC:
            _draw_dark_disc(layer, (x, y), post.radius * canvas.camera.scale)
    canvas.surface.blit(layer, (0, 0))


def _draw_dark_disc(layer: pygame.Surface, at: Pixel, radius: float) -> None:
    if clip_segment(at, at, layer.get_rect(), radius) is not None:
        pygame.draw.circle(layer, DARK, at, radius)


class PinballView(GameView):
    """Draws the playfield; balls are drawn as in other scenes."""

    def background(self, ctx: DrawContext) -> bool:
        """Draw the playfield."""
        draw_playfield(ctx, ctx.snapshot.scene)
        return True
