"""View of curling: granite stones with a coloured top and a handle that shows their angle."""

import numpy as np

from sandbox.arrays import IntArray
from sandbox.window.render.circles import SHORTEST_SPOKE, CircleRenderer, darken
from sandbox.window.render.draw_context import DrawContext, GameView
from sandbox.window.render.lines import draw_line
from sandbox.window.render.palette import RgbColour

GRANITE: RgbColour = (120, 124, 130)
TOP, HANDLE, GRIP = 0.66, 0.50, 0.26
"""radius of the top, and half-length and width of the handle, as fractions of the radius"""
PALE = 0.45
"""fraction of white in the colour of a handle"""


def draw_stones(view: DrawContext, discs: CircleRenderer) -> None:
    """Draw the visible pucks; bodies without collisions, such as the broom, are markers, drawn as rings."""
    bodies = view.snapshot.bodies
    marks = np.asarray([element.collides == "none" for element in bodies.elements], np.bool_)[bodies.element]
    ring = marks[view.shown]
    centre, radius, colours = view.centre[~ring], view.radius[~ring], view.colours[~ring]
    stone = np.broadcast_to(np.asarray(GRANITE, np.uint8), colours.shape)
    discs.draw(view.surface, centre, radius, stone, view.style())
    discs.draw(view.surface, centre, TOP * radius, colours, view.style(1.0))
    angle = view.snapshot.frame.angle[view.shown[~ring]]
    for k in np.flatnonzero((radius >= SHORTEST_SPOKE) & (radius < 1e6) & np.isfinite(angle)).tolist():
        (x, y), reach = centre[k].tolist(), float(radius[k])
        dx, dy = HANDLE * reach * np.cos(angle[k]), -HANDLE * reach * np.sin(angle[k])
        tone = _pale(colours[k].tolist())
        draw_line(view.surface, (x - dx, y - dy), (x + dx, y + dy), tone, max(GRIP * reach, 1.0), view.antialias)
    for k in np.flatnonzero(ring).tolist():
        (x, y), (red, green, blue) = view.centre[k].tolist(), view.colours[k].tolist()
        discs.ring(view.surface, (x, y), float(view.radius[k]) + 1.0, darken((red, green, blue)), view.style(4.0))
        discs.ring(view.surface, (x, y), float(view.radius[k]), (red, green, blue), view.style(2.5))


def _pale(colour: list[int]) -> RgbColour:
    red, green, blue = (round(part + (255 - part) * PALE) for part in colour)
    return red, green, blue


class CurlingView(GameView):
    """Draws the stones; the renderer draws the ice."""

    def __init__(self) -> None:
        self._discs = CircleRenderer()

    def bodies(self, ctx: DrawContext) -> IntArray:
        """Draw the stones; nothing if bodies are points or not round."""
        if ctx.has_points or not ctx.snapshot.bodies.round.all():
            return np.empty(0, np.int64)
        draw_stones(ctx, self._discs)
        return ctx.shown
