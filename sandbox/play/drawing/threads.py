"""Threads: many thin lines at once, in one compiled pass where numba is there, else by pygame."""

import numpy as np
import pygame

from sandbox.arrays import BoolArray, FloatArray
from sandbox.play.drawing.points import Packed, flat_pixels, is_flat

MANY = 300
"""Lines from which on a compiled pass is worth its import."""
BEYOND = 4000.0
"""px outside the picture to which a line may reach without being cut"""


def draw_threads(surface: pygame.Surface, ends: FloatArray, tones: Packed, antialias: bool = True) -> None:
    """Draw lines of 1 px.

    Args:
        surface: where.
        ends: (K, 4) px, x and y of both ends; lines at nan or inf are left out.
        tones: (K,) as `packed` makes them for this surface.
        antialias: whether edges are smooth.
    """
    kept, ends = _cut(surface, ends)
    tones = tones[kept]
    if antialias and len(ends) >= MANY and is_flat(surface):
        from sandbox.engines.common.kernel import COMPILED

        if COMPILED:
            from sandbox.play.drawing.wires import wires

            area = surface.get_clip()
            edges = area.left, area.top, area.right, area.bottom
            wires(flat_pixels(surface), surface.get_pitch() // 4, edges, ends, tones)
            return
    line = pygame.draw.aaline if antialias else pygame.draw.line
    # Flat lists of numbers: thousands of small ones would keep the garbage collector busy.
    columns = [column.tolist() for column in (tones, *(ends - 0.5).T)]
    for tone, ax, ay, bx, by in zip(*columns, strict=True):
        line(surface, tone, (ax, ay), (bx, by))


def _cut(surface: pygame.Surface, ends: FloatArray) -> tuple[BoolArray, FloatArray]:
    """Return which lines come near the picture, (K,), and those, cut to some distance around it as by `clipped`."""
    area = surface.get_clip()
    low = np.asarray((area.left, area.top)) - BEYOND
    high = np.asarray((area.right, area.bottom)) + BEYOND
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        a, b = ends[:, :2], ends[:, 2:]
        near = np.asarray(np.isfinite(ends).all(axis=1), np.bool_)
        near &= (np.maximum(a, b) >= (area.left, area.top)).all(axis=1)
        near &= (np.minimum(a, b) <= (area.right, area.bottom)).all(axis=1)
        inside = np.asarray(((ends >= np.tile(low, 2)) & (ends <= np.tile(high, 2))).all(axis=1), np.bool_)
        if bool(inside[near].all()):
            return near, ends[near]
        way = b - a
        shares = np.stack(((low - a) / way, (high - a) / way))
        first = np.fmax(np.fmin(*shares).max(axis=1), 0.0)
        last = np.fmin(np.fmax(*shares).min(axis=1), 1.0)
        cut = np.where(inside[:, None], ends, np.hstack((a + first[:, None] * way, a + last[:, None] * way)))
        near &= (first < last) & (np.abs(cut) < 4.0 * BEYOND + 2.0 * max(area.size)).all(axis=1) | inside & near
    return near, cut[near]
