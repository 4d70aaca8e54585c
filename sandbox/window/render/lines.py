"""Lines, dashes, arrows and polygons, clipped before they reach SDL, and many thin lines in one compiled pass."""

import math
from collections.abc import Iterable

import numpy as np
import pygame

from sandbox.arrays import BoolArray, FloatArray
from sandbox.window.render.palette import RgbColour
from sandbox.window.render.particles import Packed, flat_pixels, is_flat

SDL_COORDINATE_LIMIT = 16_000.0
"""px, largest coordinate or length passed to SDL, which computes in 32 bits, and in 16 bits for polygons"""

Pixel = tuple[float, float]
"""Point in px from the upper left corner of the surface; pixel centres are at half-integers."""


def clip_segment(a: Pixel, b: Pixel, area: pygame.Rect, margin: float = 4.0) -> tuple[Pixel, Pixel] | None:
    """Return the part of a segment within an area enlarged by a margin, or None.

    Liang–Barsky algorithm, 1984: each edge narrows the parameter range of the segment.
    """
    left, top, right, bottom = area.left, area.top, area.right, area.bottom
    if left <= a[0] <= right and left <= b[0] <= right and top <= a[1] <= bottom and top <= b[1] <= bottom:
        return a, b
    dx, dy = b[0] - a[0], b[1] - a[1]
    if not (math.isfinite(dx) and math.isfinite(dy) and math.isfinite(a[0]) and math.isfinite(a[1])):
        return None
    first, last = 0.0, 1.0
    for move, gap in (
        (-dx, a[0] - left + margin),
        (dx, right + margin - a[0]),
        (-dy, a[1] - top + margin),
        (dy, bottom + margin - a[1]),
    ):
        if move == 0.0:
            if gap < 0.0:
                return None
        elif move < 0.0:
            first = max(first, gap / move)
        else:
            last = min(last, gap / move)
    if first > last:
        return None
    start = a if first == 0.0 else (a[0] + first * dx, a[1] + first * dy)
    end = b if last == 1.0 else (a[0] + last * dx, a[1] + last * dy)
    widest = 4.0 * margin + area.width + area.height  # bound on rounding errors of far-away points
    if any(abs(p[0] - area.centerx) > widest or abs(p[1] - area.centery) > widest for p in (start, end)):
        return None
    return start, end


def draw_line(
    surface: pygame.Surface, a: Pixel, b: Pixel, colour: RgbColour, width: float = 1.0, antialias: bool = True
) -> None:
    """Draw a line with flat ends, `width` px wide."""
    clipped = clip_segment(a, b, surface.get_clip(), width + 4.0)
    if clipped is None:
        return
    (ax, ay), (bx, by) = clipped
    start, end = (ax - 0.5, ay - 0.5), (bx - 0.5, by - 0.5)  # SDL pixel centres are at integers
    if not antialias:
        pygame.draw.line(surface, colour, _nearest_pixel(start), _nearest_pixel(end), max(1, round(width)))
        return
    length = math.hypot(bx - ax, by - ay)
    if width < 1.5 or length < 1e-9:
        pygame.draw.aaline(surface, colour, start, end)
        return
    half = width / 2.0 - 0.5  # an antialiased line adds half a pixel
    if width < 3.0:  # a narrow polygon would look wavy, as its corners are rounded to whole pixels
        shift = -(by - ay) / length * half, (bx - ax) / length * half
        for side in (-1.0, 0.0, 1.0):
            moved = side * shift[0], side * shift[1]
            pygame.draw.aaline(
                surface, colour, (start[0] + moved[0], start[1] + moved[1]), (end[0] + moved[0], end[1] + moved[1])
            )
        return
    across = -(by - ay) / length * half, (bx - ax) / length * half
    fill_polygon(
        surface,
        [
            (ax + across[0], ay + across[1]),
            (bx + across[0], by + across[1]),
            (bx - across[0], by - across[1]),
            (ax - across[0], ay - across[1]),
        ],
        colour,
    )


def fill_polygon(surface: pygame.Surface, corners: list[Pixel], colour: RgbColour, antialias: bool = True) -> None:
    """Fill a polygon whose corners lie on or near the surface."""
    moved = [(x - 0.5, y - 0.5) for x, y in corners]
    pygame.draw.polygon(surface, colour, [_nearest_pixel(p) for p in moved])
    if antialias:
        pygame.draw.aalines(surface, colour, True, moved)


def clip_polygon(corners: list[Pixel], area: pygame.Rect) -> list[Pixel]:
    """Return the part of a polygon within an area; empty if there is none.

    Sutherland–Hodgman algorithm, 1974: the edges of the area clip in turn. Where clipping splits a concave polygon, the
    parts stay connected along the edge.
    """
    left, top, right, bottom = area.left - 2.0, area.top - 2.0, area.right + 2.0, area.bottom + 2.0
    for axis, sign, limit in ((0, 1.0, left), (0, -1.0, right), (1, 1.0, top), (1, -1.0, bottom)):
        kept: list[Pixel] = []
        for a, b in zip(corners, (*corners[1:], *corners[:1]), strict=True):
            inside_a, inside_b = sign * (a[axis] - limit), sign * (b[axis] - limit)
            if inside_a >= 0.0:
                kept.append(a)
            if (inside_a >= 0.0) != (inside_b >= 0.0):
                fraction = inside_a / (inside_a - inside_b)
                kept.append((a[0] + fraction * (b[0] - a[0]), a[1] + fraction * (b[1] - a[1])))
        corners = kept
    return corners if len(corners) > 2 else []


def draw_arrow(
    surface: pygame.Surface,
    a: Pixel,
    b: Pixel,
    colour: RgbColour,
    width: float = 2.0,
    antialias: bool = True,
    edge: RgbColour | None = None,
) -> None:
    """Draw an arrow from `a` to `b`, with a head in proportion to its width and an outline of colour `edge`, if any."""
    length = math.hypot(b[0] - a[0], b[1] - a[1])
    if not 0.0 < length < math.inf:
        return
    along = (b[0] - a[0]) / length, (b[1] - a[1]) / length
    head = min(5.0 * width, 0.6 * length)
    neck = b[0] - along[0] * head, b[1] - along[1] * head
    end = neck[0] + along[0], neck[1] + along[1]
    if edge is not None:
        draw_line(surface, a, end, edge, width + 2.0, antialias)
    draw_line(surface, a, end, colour, width, antialias)
    if clip_segment(b, neck, surface.get_clip(), 40.0) is not None:
        side = -along[1] * head * 0.42, along[0] * head * 0.42
        corners = [b, (neck[0] + side[0], neck[1] + side[1]), (neck[0] - side[0], neck[1] - side[1])]
        fill_polygon(surface, corners, colour, antialias)
        if edge is not None and antialias:
            outline = [(x + 1.2 * (x - neck[0]) / head - 0.5, y + 1.2 * (y - neck[1]) / head - 0.5) for x, y in corners]
            pygame.draw.aalines(surface, edge, True, outline)


def draw_dashes(
    surface: pygame.Surface,
    corners: Iterable[tuple[Pixel, Pixel]],
    colour: RgbColour,
    dash: float,
    antialias: bool = True,
) -> None:
    """Draw dashed segments; the dashes are fixed to the segment, not to the clip rectangle."""
    area = surface.get_clip()
    for a, b in corners:
        clipped = clip_segment(a, b, area)
        if clipped is None:
            continue
        (ax, ay), (bx, by) = clipped
        length = math.hypot(bx - ax, by - ay)
        if length == 0.0:
            continue
        ux, uy = (bx - ax) / length, (by - ay) / length
        at = -math.fmod(math.hypot(ax - a[0], ay - a[1]), 2.0 * dash)
        while at < length:
            start, end = max(at, 0.0), min(at + dash, length)
            if end > start:
                p, q = (ax + ux * start, ay + uy * start), (ax + ux * end, ay + uy * end)
                draw_line(surface, p, q, colour, 1.0, antialias)
            at += 2.0 * dash


def _nearest_pixel(point: Pixel) -> tuple[int, int]:
    return math.floor(point[0] + 0.5), math.floor(point[1] + 0.5)  # `round` rounds halves to even


MANY_LINES = 300
"""Number of lines from which the import of the compiled pass pays off."""
UNCLIPPED_MARGIN = 4000.0
"""px outside the surface up to which a line is not clipped"""


def draw_thin_lines(surface: pygame.Surface, ends: FloatArray, tones: Packed, antialias: bool = True) -> None:
    """Draw lines of 1 px.

    Args:
        surface: the target.
        ends: (K, 4) px, x and y of both ends; lines with nan or inf are skipped.
        tones: (K,) from `packed_pixels` for this surface.
        antialias: whether edges are smooth.
    """
    kept, ends = _clip_lines(surface, ends)
    tones = tones[kept]
    if antialias and len(ends) >= MANY_LINES and is_flat(surface):
        from sandbox.engines.common.kernel import COMPILED

        if COMPILED:
            from sandbox.window.render.kernels import rasterise_lines

            area = surface.get_clip()
            edges = area.left, area.top, area.right, area.bottom
            rasterise_lines(flat_pixels(surface), surface.get_pitch() // 4, edges, ends, tones)
            return
    line = pygame.draw.aaline if antialias else pygame.draw.line
    # Flat lists of numbers: thousands of small tuples would trigger the garbage collector.
    columns = [column.tolist() for column in (tones, *(ends - 0.5).T)]
    for tone, ax, ay, bx, by in zip(*columns, strict=True):
        line(surface, tone, (ax, ay), (bx, by))


def _clip_lines(surface: pygame.Surface, ends: FloatArray) -> tuple[BoolArray, FloatArray]:
    """Return which lines come near the surface, (K,), and those lines, clipped at `UNCLIPPED_MARGIN` px around it."""
    area = surface.get_clip()
    low = np.asarray((area.left, area.top)) - UNCLIPPED_MARGIN
    high = np.asarray((area.right, area.bottom)) + UNCLIPPED_MARGIN
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        a, b = ends[:, :2], ends[:, 2:]
        is_near = np.asarray(np.isfinite(ends).all(axis=1), np.bool_)
        is_near &= (np.maximum(a, b) >= (area.left, area.top)).all(axis=1)
        is_near &= (np.minimum(a, b) <= (area.right, area.bottom)).all(axis=1)
        inside = np.asarray(((ends >= np.tile(low, 2)) & (ends <= np.tile(high, 2))).all(axis=1), np.bool_)
        if bool(inside[is_near].all()):
            return is_near, ends[is_near]
        vector = b - a
        fractions = np.stack(((low - a) / vector, (high - a) / vector))
        first = np.fmax(np.fmin(*fractions).max(axis=1), 0.0)
        last = np.fmin(np.fmax(*fractions).min(axis=1), 1.0)
        cut = np.where(inside[:, None], ends, np.hstack((a + first[:, None] * vector, a + last[:, None] * vector)))
        is_near &= (first < last) & (np.abs(cut) < 4.0 * UNCLIPPED_MARGIN + 2.0 * max(area.size)).all(
            axis=1
        ) | inside & is_near
    return is_near, cut[is_near]
