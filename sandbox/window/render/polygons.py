"""Polygonal and compound bodies, drawn by a compiled rasteriser or with pygame's polygons.

The two differ only in antialiasing. The scene decides: if it has more than `FEW_POLYGONS` such bodies and numba is
installed, the compiled rasteriser draws them. The rim of a body lies inside its edge.
"""

import math

import numpy as np
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.window.hit_test import Hull, rounded_hull
from sandbox.window.render.body_geometry import BodyGeometry, ScreenPose, clipped_box
from sandbox.window.render.circles import DARKEN_FRACTION, CircleStyle, darken
from sandbox.window.render.draw_context import DrawContext
from sandbox.window.render.lines import SDL_COORDINATE_LIMIT, Pixel, clip_polygon, fill_polygon
from sandbox.window.render.palette import BACKGROUND, ColourArray, RgbColour
from sandbox.window.render.particles import flat_pixels, is_flat, packed_pixels
from sandbox.window.render.sdf import ShapeStyle, draw_sdf

FEW_POLYGONS = 8
"""Number of bodies of a scene up to which numba is not imported for their sake; its import takes 0.4 s."""
ARC_ERROR = 0.1
"""px, largest distance between an arc and its chords"""
MAX_ARC_CHORDS = 256
THIN_RIM = 2.0
"""px, rim width below which the pygame fallback draws the rim as a one-pixel line"""


class PolygonRenderer:
    """Draws bodies of any shape, and caches their geometry between frames."""

    def __init__(self) -> None:
        self._cached: tuple[Bodies, BodyGeometry] | None = None

    def geometry(self, bodies: Bodies) -> BodyGeometry:
        """Return the geometry of bodies, cached for the last `Bodies`."""
        if self._cached is None or self._cached[0] is not bodies:
            self._cached = bodies, BodyGeometry(bodies)
        return self._cached[1]

    def draw(
        self,
        surface: pygame.Surface,
        bodies: Bodies,
        indices: IntArray,
        centre: FloatArray,
        angle: FloatArray,
        scale: float,
        colours: ColourArray,
        style: CircleStyle,
    ) -> None:
        """Draw bodies in order.

        Args:
            surface: the target.
            bodies: all N bodies.
            indices: (K,) indices of the bodies that are drawn.
            centre: (K, 2) px, finite.
            angle: (K,) rad, counter-clockwise, as in the world (y up); non-finite values count as 0.
            scale: px/m.
            colours: (K, 3).
            style: of all bodies; hollow draws only the rim, in the colour of the body.
        """
        if not len(indices):
            return
        geometry = self.geometry(bodies)
        angle = np.where(np.isfinite(angle), angle, 0.0)
        line = geometry.rims(indices, scale, style.line)
        if style.hollow:
            line = np.full(len(indices), style.line)
        is_near = bool((np.abs(centre).max(axis=1) + bodies.radius[indices] * scale < SDL_COORDINATE_LIMIT).all())
        is_many = np.count_nonzero(~bodies.round) > FEW_POLYGONS
        if is_many and is_near and _in_one_pass(surface, geometry, indices, centre, angle, scale, colours, line, style):
            return
        rows = zip(
            indices.tolist(), centre.tolist(), angle.tolist(), map(tuple, colours.tolist()), line.tolist(), strict=True
        )
        for number, (x, y), angle_k, colour, width in rows:
            pose = ScreenPose(x, y, angle_k, scale)
            if style.hollow:
                self.ring(surface, bodies, number, pose, 0.0, colour, width, style.antialias)
            else:
                _draw_plain(surface, geometry.hulls(number, pose), colour, width, style.antialias, is_near)

    def ring(
        self,
        surface: pygame.Surface,
        bodies: Bodies,
        number: int,
        place: ScreenPose,
        gap: float,
        colour: RgbColour,
        line: float,
        antialias: bool = True,
    ) -> None:
        """Draw an outline of a body, `line` px wide, with its outer edge at `gap` px from the body."""
        geometry = self.geometry(bodies)
        distance = geometry.distance(number, place)
        rect = clipped_box(geometry.within(number, place, gap + 2.0), surface.get_clip())
        if rect.width:
            ring_style = ShapeStyle(None, colour, line, antialias=antialias)
            draw_sdf(surface, lambda x, y: np.asarray(distance(x, y) - gap), ring_style, rect)

    def boxes(self, view: DrawContext) -> FloatArray:
        """Return left, top, right and bottom of the bounding boxes of the visible bodies, (K, 4) px."""
        angle = view.snapshot.frame.angle[view.shown]
        angle = np.where(np.isfinite(angle), angle, 0.0)
        return self.geometry(view.snapshot.bodies).boxes(view.shown, view.centre, angle, view.camera.scale)


def _in_one_pass(
    surface: pygame.Surface,
    geometry: BodyGeometry,
    indices: IntArray,
    centre: FloatArray,
    angle: FloatArray,
    scale: float,
    colours: ColourArray,
    line: FloatArray,
    style: CircleStyle,
) -> bool:
    """Draw all bodies in one compiled pass; return whether that was possible."""
    from sandbox.engines.common.kernel import COMPILED

    if not COMPILED or not is_flat(surface):
        return False
    from sandbox.window.render.kernels import rasterise_polygons

    area = surface.get_clip()
    edges = area.left, area.top, area.right, area.bottom
    pose = np.column_stack((centre, np.cos(angle), np.sin(angle), np.full(len(indices), scale)))
    inner = outer = packed_pixels(colours, surface)
    if not style.hollow and style.line:
        outer = packed_pixels(
            np.rint(colours * (1.0 - DARKEN_FRACTION) + np.asarray(BACKGROUND) * DARKEN_FRACTION).astype(np.uint8),
            surface,
        )
    rasterise_polygons(
        flat_pixels(surface),
        surface.get_pitch() // 4,
        edges,
        geometry.pieces,
        np.empty((len(geometry.pieces.corner), 9)),
        indices,
        pose,
        line,
        inner,
        outer,
        style.hollow,
        style.antialias,
    )
    return True


def _draw_plain(
    surface: pygame.Surface, hulls: list[Hull], colour: RgbColour, line: float, antialias: bool, near: bool
) -> None:
    """Draw a body as polygons: its pieces in the rim colour, then inset pieces in the fill colour."""
    reach = 2 * math.ceil(line) + 8
    area = None if near else surface.get_clip().inflate(reach, reach)
    if len(hulls) == 1 and 0.0 < line < THIN_RIM:
        corners = _corners(hulls[0], area)
        if corners:
            fill_polygon(surface, corners, colour, antialias)
            edge = pygame.draw.aalines if antialias else pygame.draw.lines
            edge(surface, darken(colour), True, [(x - 0.5, y - 0.5) for x, y in corners])
        return
    half = 0.5 if antialias else 0.25  # pygame also fills pixels that an edge touches
    passes = ((half, darken(colour)), (half + line, colour)) if line > 0.0 else ((half, colour),)
    for depth, tone in passes:
        inset = [_inset(hull, min(depth, 0.9 * _inscribed_radius(hull))) for hull in hulls]
        _fill_hulls(surface, inset, tone, antialias, area)


def _fill_hulls(
    surface: pygame.Surface, hulls: list[Hull], colour: RgbColour, antialias: bool, area: pygame.Rect | None
) -> None:
    for hull in hulls:
        corners = _corners(hull, area)
        if corners:
            fill_polygon(surface, corners, colour, antialias)


def _corners(hull: Hull, area: pygame.Rect | None) -> list[Pixel]:
    """Return the corners of a hull as a polygon, clipped to an area if given; empty if nothing remains."""
    chords = math.ceil(math.pi * math.sqrt(hull.radius / (8.0 * ARC_ERROR)))
    corners = [(x, y) for x, y in rounded_hull(hull, min(max(chords, 2), MAX_ARC_CHORDS)).tolist()]
    return corners if area is None else clip_polygon(corners, area)


def _inscribed_radius(hull: Hull) -> float:
    """Return a lower bound of the inradius of a hull, px: area / perimeter of its corners, plus its rounding radius."""
    corners, radius = hull
    if len(corners) < 3:
        return radius
    following = np.roll(corners, -1, axis=0)
    twice = abs(float((corners[:, 0] * following[:, 1] - following[:, 0] * corners[:, 1]).sum()))
    return radius + 0.5 * twice / max(float(np.hypot(*(following - corners).T).sum()), 1e-300)


def _inset(hull: Hull, depth: float) -> Hull:
    """Return a hull shrunk by a depth, px, which must be less than its inscribed radius."""
    corners, radius = hull
    if radius >= depth:
        return Hull(corners, radius - depth)
    depth -= radius
    following = np.roll(corners, -1, axis=0)
    along = following - corners
    along /= np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-300)[:, None]
    x, y = corners.T
    sign = 1.0 if float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum()) >= 0.0 else -1.0
    inwards = np.column_stack((-along[:, 1], along[:, 0])) * sign
    before = np.roll(inwards, 1, axis=0)
    cosine = (inwards * before).sum(axis=1)
    return Hull(corners + depth * (inwards + before) / np.maximum(1.0 + cosine, 1e-3)[:, None], 0.0)
