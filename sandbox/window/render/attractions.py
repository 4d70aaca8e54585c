"""Centres of attractions that are points of the world: a sun with rays, or a hollow one if it repels.

An attraction towards a body has no symbol, as the body itself is visible.
"""

import math

import numpy as np

from sandbox.scene.compile.scene import Scene
from sandbox.window.render.canvas import Canvas
from sandbox.window.render.circles import draw_disc
from sandbox.window.render.lines import SDL_COORDINATE_LIMIT, draw_line
from sandbox.window.render.palette import BACKGROUND, YELLOW, mix_colours

DISC_RADIUS, RAY_LENGTH = 6.0, 5.0
"""px at a UI scale of 1, of the disc, and length of a ray"""
RAY_GAP = 2.5
"""px between the disc and its rays"""
RAY_COUNT = 8
COLOUR = mix_colours(BACKGROUND, YELLOW, 0.8)


def draw_attractions(canvas: Canvas, scene: Scene) -> None:
    """Draw the centre of each attraction towards a point."""
    for attraction in scene.attractions:
        if isinstance(attraction.toward, str) or not attraction.strength:
            continue
        x, y = canvas.camera.to_screen(np.asarray(attraction.toward)).tolist()
        if max(abs(x), abs(y)) < SDL_COORDINATE_LIMIT:
            _draw_sun(canvas, (x, y), repels=attraction.strength < 0.0)


def _draw_sun(canvas: Canvas, centre: tuple[float, float], *, repels: bool) -> None:
    unit, (x, y) = canvas.ui_scale, centre
    for k in range(RAY_COUNT):
        across, up = math.cos(math.tau * k / RAY_COUNT), math.sin(math.tau * k / RAY_COUNT)
        inner, outer = (DISC_RADIUS + RAY_GAP) * unit, (DISC_RADIUS + RAY_GAP + RAY_LENGTH) * unit
        ends = (x + inner * across, y + inner * up), (x + outer * across, y + outer * up)
        draw_line(canvas.surface, *ends, COLOUR, 1.6 * unit, canvas.antialias)
    draw_disc(canvas.surface, centre, DISC_RADIUS * unit, COLOUR, hole=(DISC_RADIUS - 2.0) * unit if repels else 0.0)
