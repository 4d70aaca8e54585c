"""Polygons: bodies that are no lone discs, drawn whole: no seam shows where their pieces overlap or abut.

A crowd is drawn in one compiled pass where numba is there; a few by their distance, as large discs are; a crowd
without numba plainly. The first two look the same.
"""

import sys

import numpy as np
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.window.hit_test import rounded_hull
from sandbox.window.render.body_geometry import BodyGeometry, ScreenPose, clipped_box
from sandbox.window.render.circles import DARK, CircleStyle, darken
from sandbox.window.render.draw_context import DrawContext
from sandbox.window.render.lines import fill_polygon
from sandbox.window.render.palette import BACKGROUND, Colour, ColourArray
from sandbox.window.render.particles import flat_pixels, is_flat, packed_pixels
from sandbox.window.render.sdf import ShapeStyle, draw_sdf

FEW_POLYGONS = 8
"""Bodies up to which numba is not imported for them alone"""
SDL_COORDINATE_LIMIT = 1e6
"""px: bodies farther away, or larger, are drawn by their distance, which knows no whole numbers"""


class PolygonRenderer:
    """Draws bodies of any shape, and keeps what is known of their pieces between pictures."""

    def __init__(self) -> None:
        self._known: tuple[Bodies, BodyGeometry] | None = None

    def anatomy(self, bodies: Bodies) -> BodyGeometry:
        """Return what bodies consist of."""
        if self._known is None or self._known[0] is not bodies:
            self._known = bodies, BodyGeometry(bodies)
        return self._known[1]

    def draw(
        self,
        surface: pygame.Surface,
        bodies: Bodies,
        who: IntArray,
        centre: FloatArray,
        angle: FloatArray,
        scale: float,
        colours: ColourArray,
        style: CircleStyle,
    ) -> None:
        """Draw bodies in their order.

        Args:
            surface: where.
            bodies: N of them.
            who: (K,) the numbers of those that are drawn.
            centre: (K, 2) px, finite.
            angle: (K,) rad, counted as in the world, where y is up; what is not finite counts as 0.
            scale: px/m.
            colours: (K, 3).
            style: of all of them; hollow is the rim alone, in its own colour.
        """
        if not len(who):
            return
        anatomy = self.anatomy(bodies)
        angle = np.where(np.isfinite(angle), angle, 0.0)
        line = anatomy.rims(who, scale, style.line)
        if style.hollow:
            line = np.full(len(who), style.line)
        near = bool((np.abs(centre).max(axis=1) + bodies.radius[who] * scale < SDL_COORDINATE_LIMIT).all())
        worth = len(who) > FEW_POLYGONS or "numba" in sys.modules
        if worth and near and _in_one_pass(surface, anatomy, who, centre, angle, scale, colours, line, style):
            return
        plain = len(who) > FEW_POLYGONS and near
        rows = zip(
            who.tolist(), centre.tolist(), angle.tolist(), map(tuple, colours.tolist()), line.tolist(), strict=True
        )
        for number, (x, y), turned, colour, width in rows:
            place = ScreenPose(x, y, turned, scale)
            if plain:
                _plain(surface, anatomy, number, place, colour, style)
                continue
            look = ShapeStyle(colour, darken(colour), width, antialias=style.antialias)
            if style.hollow:
                look = look._replace(fill=None, rim=colour)
            _painted(surface, anatomy, number, place, look, 0.0)

    def ring(
        self,
        surface: pygame.Surface,
        bodies: Bodies,
        number: int,
        place: ScreenPose,
        gap: float,
        colour: Colour,
        line: float,
    ) -> None:
        """Draw a line around a body, so wide; its outer edge is a gap, px, away from it."""
        _painted(surface, self.anatomy(bodies), number, place, ShapeStyle(None, colour, line), gap)

    def boxes(self, view: DrawContext) -> FloatArray:
        """Return left, top, right and bottom of the boxes around the bodies of a view, (K, 4) px."""
        angle = view.sight.frame.angle[view.shown]
        angle = np.where(np.isfinite(angle), angle, 0.0)
        return self.anatomy(view.sight.bodies).boxes(view.shown, view.centre, angle, view.camera.scale)


def _painted(
    surface: pygame.Surface, anatomy: BodyGeometry, number: int, place: ScreenPose, look: ShapeStyle, gap: float
) -> None:
    distance = anatomy.distance(number, place)
    within = clipped_box(anatomy.within(number, place, gap + 2.0), surface.get_clip())
    if within.width:
        draw_sdf(surface, lambda x, y: np.asarray(distance(x, y) - gap), look, within)


def _in_one_pass(
    surface: pygame.Surface,
    anatomy: BodyGeometry,
    who: IntArray,
    centre: FloatArray,
    angle: FloatArray,
    scale: float,
    colours: ColourArray,
    line: FloatArray,
    style: CircleStyle,
) -> bool:
    """Draw all in one compiled pass; return whether that could be done."""
    from sandbox.engines.common.kernel import COMPILED

    if not COMPILED or not is_flat(surface):
        return False
    from sandbox.window.render.kernels import rasterise_polygons

    area = surface.get_clip()
    edges = area.left, area.top, area.right, area.bottom
    pose = np.column_stack((centre, np.cos(angle), np.sin(angle), np.full(len(who), scale)))
    inner = outer = packed_pixels(colours, surface)
    if not style.hollow and style.line:
        outer = packed_pixels(np.rint(colours * (1.0 - DARK) + np.asarray(BACKGROUND) * DARK).astype(np.uint8), surface)
    rasterise_polygons(
        flat_pixels(surface),
        surface.get_pitch() // 4,
        edges,
        anatomy.pieces,
        np.empty((len(anatomy.pieces.corner), 9)),
        who,
        pose,
        line,
        inner,
        outer,
        style.hollow,
        style.antialias,
    )
    return True


def _plain(
    surface: pygame.Surface, anatomy: BodyGeometry, number: int, place: ScreenPose, colour: Colour, style: CircleStyle
) -> None:
    """Draw a body with what pygame has: its pieces filled, and of a lone one its edge."""
    hulls = anatomy.hulls(number, place)
    line = pygame.draw.aalines if style.antialias else pygame.draw.lines
    for hull in hulls:
        corners = [(x, y) for x, y in rounded_hull(hull).tolist()]
        if not style.hollow:
            fill_polygon(surface, corners, colour, style.antialias)
        if style.hollow or len(hulls) == 1:
            edge = colour if style.hollow else darken(colour)
            line(surface, edge, True, [(x - 0.5, y - 0.5) for x, y in corners])
