"""Shapes given by a signed distance function, painted with antialiased edges as sprites or directly onto a surface.

Distances are in pixels, negative inside; pixel (i, j) is sampled at its centre (i + ½, j + ½).
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pygame

from sandbox.arrays import FloatArray
from sandbox.window.hit_test import segment_distance
from sandbox.window.render.palette import RgbColour

SignedDistance = Callable[[FloatArray, FloatArray], FloatArray]
"""Maps x and y, px, which broadcast, to the signed distance; Lipschitz constant at most 1."""

TILE = 16
"""px; edges are shaded in square tiles of this side, interior tiles are filled"""
FAR_OUTSIDE = 1e6


class ShapeStyle(NamedTuple):
    """Style of a shape: optional fill, and a rim inside the edge."""

    fill: RgbColour | None
    rim: RgbColour
    line: float
    """rim width, px"""
    opacity: float = 1.0
    antialias: bool = True


def shade_sdf(distance: FloatArray, style: ShapeStyle) -> npt.NDArray[np.uint32]:
    """Return the pixels (…) of a shape as 0xAARRGGBB; nan distances are transparent."""
    finite = np.nan_to_num(distance, nan=FAR_OUTSIDE, posinf=FAR_OUTSIDE, neginf=-FAR_OUTSIDE).astype(np.float32)
    inside = np.clip(0.5 - finite, 0.0, 1.0)
    rim = np.clip(finite + np.float32(style.line + 0.5), 0.0, 1.0) if style.line > 0 else np.zeros_like(finite)
    if not style.antialias:
        inside, rim = np.rint(inside), np.rint(rim)
    if style.fill is None:
        inside = inside * rim
        rim = np.ones_like(rim)
    pixels = np.rint(inside * np.float32(255.0 * style.opacity)).astype(np.uint32)
    for edge, middle in zip(style.rim, style.fill or style.rim, strict=True):
        pixels = pixels << 8 | np.rint(middle + (edge - middle) * rim).astype(np.uint32)
    return np.asarray(pixels, np.uint32)


def sdf_surface(pixels: npt.NDArray[np.uint32], encoded: bool = True) -> pygame.Surface:
    """Return a surface from pixels (W, H), 0xAARRGGBB; with run-length encoding it blits several times faster."""
    surface = pygame.Surface(pixels.shape, pygame.SRCALPHA, 32, (0xFF0000, 0xFF00, 0xFF, 0xFF000000))
    pygame.surfarray.pixels2d(surface)[:] = pixels
    if encoded:
        surface.set_alpha(255, pygame.RLEACCEL)
    return surface


def disc_distance(x: float, y: float, radius: float) -> SignedDistance:
    """Return the distance from a circle; above a radius of 1e12 px the circle is approximated by a straight line."""
    if radius < 1e12:
        return lambda px, py: np.asarray(np.sqrt((px - x) ** 2 + (py - y) ** 2) - radius)
    far = float(np.hypot(x, y))
    if far == 0.0:
        return lambda px, py: np.broadcast_to(-radius, np.broadcast_shapes(px.shape, py.shape))
    return lambda px, py: (far - radius) - (px * (x / far) + py * (y / far))


def capsule_distance(a: tuple[float, float], b: tuple[float, float], radius: float) -> SignedDistance:
    """Return the distance from a capsule: a segment with round ends."""
    distance = segment_distance((a, b))
    return lambda px, py: distance(px, py) - radius


def arc_distance(x: float, y: float, radius: float, middle: float, half: float) -> SignedDistance:
    """Return the distance from an arc of a circle, px, never negative.

    Args:
        x: of the centre, px.
        y: of the centre, px.
        radius: px.
        middle: rad, direction of the midpoint of the arc, counter-clockwise, as in the world (y up).
        half: rad, half of the angle of the arc, 0 to π.
    """
    along, across, cosine = math.cos(middle), -math.sin(middle), math.cos(half)
    ends = [(x + radius * math.cos(angle), y - radius * math.sin(angle)) for angle in (middle - half, middle + half)]

    def distance(px: FloatArray, py: FloatArray) -> FloatArray:
        right, down = px - x, py - y
        length = np.sqrt(right * right + down * down)
        beside = np.minimum.reduce([np.hypot(px - ex, py - ey) for ex, ey in ends])
        return np.where(right * along + down * across >= length * cosine, np.abs(length - radius), beside)

    return distance


def line_distance(offset: float, normal: tuple[float, float]) -> SignedDistance:
    """Return the distance from a half-plane with outward unit normal `normal` (y down)."""
    return lambda px, py: offset + px * normal[0] + py * normal[1]


def draw_sdf(
    surface: pygame.Surface, distance: SignedDistance, style: ShapeStyle, bounds: pygame.Rect | None = None
) -> None:
    """Paint a shape of any size and position onto a surface.

    Args:
        surface: of any format.
        distance: of the shape.
        style: style of the shape.
        bounds: px, bounding box of the shape, if known.
    """
    area = surface.get_clip() if bounds is None else surface.get_clip().clip(bounds)
    if not area.width or not area.height:
        return
    left, top = np.arange(area.left, area.right, TILE), np.arange(area.top, area.bottom, TILE)
    across, along = (np.asarray(corner + TILE / 2.0, np.float64) for corner in (left, top))
    middle = distance(across[:, None], along[None, :])
    reach = TILE / 2.0 * np.sqrt(2.0) + 1.0
    full = middle < -reach - style.line
    if style.fill is not None and style.opacity == 1.0:
        _fill(surface, full, area, style.fill)
        edge = ~full & (middle < reach)
    else:
        edge = (middle < reach) if style.fill is not None else (middle < reach) & ~full
    column, row = np.nonzero(edge)
    if not len(column):
        return
    x = np.asarray(left[column, None] + np.arange(TILE) + 0.5, np.float64)[:, :, None]
    y = np.asarray(top[row, None] + np.arange(TILE) + 0.5, np.float64)[:, None, :]
    pixels = shade_sdf(distance(x, y), style)
    strip = sdf_surface(pixels.reshape(-1, TILE), encoded=False)
    clip = surface.get_clip()
    surface.set_clip(area)
    places = zip(left[column].tolist(), top[row].tolist(), strict=True)
    surface.blits([(strip, place, (k * TILE, 0, TILE, TILE)) for k, place in enumerate(places)], False)
    surface.set_clip(clip)


def draw_sdf_disc(surface: pygame.Surface, centre: tuple[float, float], radius: float, style: ShapeStyle) -> None:
    """Paint a disc or ring of any size and position, px, onto a surface."""
    (x, y), area = centre, surface.get_clip()
    left, top = max(x - radius - 2.0, area.left), max(y - radius - 2.0, area.top)
    right, bottom = min(x + radius + 2.0, area.right), min(y + radius + 2.0, area.bottom)
    if left < right and top < bottom:
        rect = pygame.Rect(int(left), int(top), math.ceil(right) - int(left), math.ceil(bottom) - int(top))
        draw_sdf(surface, disc_distance(x, y, radius), style, rect)


def _fill(surface: pygame.Surface, full: npt.NDArray[np.bool_], area: pygame.Rect, colour: RgbColour) -> None:
    """Fill the interior tiles, one rectangle for each run in a row."""
    if full.all():
        surface.fill(colour, area)
        return
    padded = np.zeros((full.shape[0] + 2, full.shape[1]), np.int8)
    padded[1:-1] = full
    change = np.diff(padded, axis=0).T  # (rows, columns + 1): +1 at the start of a run, −1 after its end
    starts, ends = np.argwhere(change == 1), np.argwhere(change == -1)
    for (row, first), (_, last) in zip(starts.tolist(), ends.tolist(), strict=True):
        run = pygame.Rect(area.left + first * TILE, area.top + row * TILE, (last - first) * TILE, TILE)
        surface.fill(colour, run.clip(area))
