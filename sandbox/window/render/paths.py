"""Courses of bodies on paths: dotted lines with a disc at each point."""

from itertools import pairwise

from sandbox.scene.compile.bodies import Bodies
from sandbox.window.render.circles import draw_disc
from sandbox.window.render.draw_context import Canvas
from sandbox.window.render.lines import draw_dashes
from sandbox.window.render.palette import BACKGROUND, SKY, mix_colours


def draw_paths(canvas: Canvas, bodies: Bodies) -> None:
    """Draw the course of the centre of each body that has a path."""
    surface, unit, colour = canvas.surface, canvas.ui_scale, mix_colours(SKY, BACKGROUND, 0.25)
    for motion in bodies.paths.values():
        course = canvas.pixels(motion.course())
        draw_dashes(surface, pairwise(course), colour, 2.5 * unit, canvas.antialias)
        for pixel in canvas.pixels(motion.stops()):
            draw_disc(surface, pixel, 3.0 * unit, colour)
