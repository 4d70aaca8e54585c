"""Trails: where bodies have been, fading with age; for a crowd as points."""

from itertools import pairwise

import numpy as np
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.play.drawing.palette import BACKGROUND, ColourArray
from sandbox.play.drawing.points import Points, packed
from sandbox.play.drawing.view import View

LINES = 300
"""Bodies whose trails are lines."""
PLACES = 96
"""The most places of one body that are joined."""
SHADES = 8
"""Steps in which a trail fades."""
MOST_POINTS = 200_000


def draw_trails(view: View, points: Points) -> None:
    """Draw the last places of the bodies in sight, the older the fainter."""
    if not len(view.shown) or sum(len(piece) for piece in view.sight.trails) < 2:
        return
    crowd = len(view.shown) > LINES
    some = view.first(MOST_POINTS // 16)
    places = _joined(view.sight.trails, some.shown, max(MOST_POINTS // len(some.shown), 1) if crowd else PLACES)
    shades = np.linspace(0.15, 0.85, SHADES)
    tints = [np.rint(np.asarray(BACKGROUND) * (1 - s) + some.colours * s).astype(np.uint8) for s in shades]
    bounds = np.linspace(0, len(places), SHADES + 1).astype(int).tolist()
    for shade, (first, last) in enumerate(pairwise(bounds)):
        if crowd:
            tones = np.tile(packed(tints[shade], view.surface), last - first)
            points.draw(view.surface, view.camera, places[first:last].reshape(-1, 2), tones)
        elif last > first:
            _lines(view, places[first : last + 1], tints[shade])


def _joined(pieces: tuple[FloatArray, ...], shown: IntArray, most: int) -> FloatArray:
    """Return the places of some bodies, (T, K, 2) m, thinned out to `most`; nan for a body that a piece knows not."""
    total = sum(len(piece) for piece in pieces)
    every = -(-total // most)
    rows = []
    skip = (total - 1) % every  # so that the newest place is among them
    for piece in pieces:
        kept = piece[skip::every]
        skip = (skip - len(piece)) % every
        known = shown < piece.shape[1]
        part = np.full((len(kept), len(shown), 2), np.nan)
        part[:, known] = kept[:, shown[known]]
        rows.append(part)
    return np.concatenate(rows)


def _lines(view: View, places: FloatArray, tints: ColourArray) -> None:
    """Draw one shade of every trail; a trail is broken where its body was nowhere, or far out of the picture."""
    if len(places) < 2:
        return
    width, height = view.camera.size
    with np.errstate(invalid="ignore", over="ignore"):
        pixels = view.camera.to_screen(places) - 0.5
        x, y = pixels[..., 0], pixels[..., 1]
        near = (np.abs(x - width / 2) < 4 * width + 100) & (np.abs(y - height / 2) < 4 * height + 100)
    draw = pygame.draw.aalines if view.antialias and len(tints) <= LINES // 4 else pygame.draw.lines
    whole = np.asarray(near.all(axis=0), np.bool_)
    for k, (tint, trail) in enumerate(zip(tints.tolist(), pixels.transpose(1, 0, 2).tolist(), strict=True)):
        if whole[k]:
            draw(view.surface, tint, False, trail)
            continue
        sound = near[:, k]
        turns = np.concatenate(([0], np.flatnonzero(np.diff(sound)) + 1, [len(sound)])).tolist()
        for first, last in pairwise(turns):
            if sound[first] and last - first > 1:
                draw(view.surface, tint, False, trail[first:last])
