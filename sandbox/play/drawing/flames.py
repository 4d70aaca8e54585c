"""Flames: the thrusts that fire, each as a flame within a flame."""

import math

import numpy as np
import pygame

from sandbox.play.drawing.palette import ORANGE, YELLOW, Colour
from sandbox.play.drawing.view import View

OUTLINE = ((0.0, -0.13), (0.12, -0.19), (0.3, -0.17), (0.6, -0.09), (1.0, 0.0))
"""One side of a flame: shares of its length along it, and across"""
INNER = 0.55
"""of the outer flame's size, the one inside"""
LEAST = 2.0
"""px, the shortest that is drawn"""


def draw_flames(view: View) -> None:
    """Draw all flames, which bodies cover where they begin."""
    frame, camera = view.sight.frame, view.camera
    for number, place, way in view.sight.flames:
        if number >= len(frame.position) or not frame.present[number]:
            continue
        angle, (x, y) = float(frame.angle[number]), frame.position[number].tolist()
        if not math.isfinite(x + y + angle):
            continue
        sine, cosine = math.sin(angle), math.cos(angle)
        root = x + place[0] * cosine - place[1] * sine, y + place[0] * sine + place[1] * cosine
        out = way[0] * cosine - way[1] * sine, way[0] * sine + way[1] * cosine
        begin, end = camera.to_screen(np.array((root, (root[0] + out[0], root[1] + out[1])))).tolist()
        along = end[0] - begin[0], end[1] - begin[1]
        if math.hypot(*along) >= LEAST and max(map(abs, (*begin, *end))) < 30_000.0:
            _tongue(view, begin, along, 1.0, ORANGE)
            _tongue(view, begin, along, INNER, YELLOW)


def _tongue(view: View, begin: list[float], along: tuple[float, float], size: float, colour: Colour) -> None:
    (x, y), (dx, dy) = begin, along
    sides = [*OUTLINE, *((share, -across) for share, across in reversed(OUTLINE[:-1]))]
    points = [(x + size * (a * dx - b * dy), y + size * (a * dy + b * dx)) for a, b in sides]
    pygame.draw.polygon(view.surface, colour, points)
    if view.antialias:
        pygame.draw.aalines(view.surface, colour, True, points)
