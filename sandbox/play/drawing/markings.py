"""Markings: what a scene has painted on the ground, which changes with the camera alone."""

import math
from itertools import pairwise

import numpy as np
import pygame

from sandbox.play.camera import Camera
from sandbox.play.drawing.palette import Colour, hex_colour
from sandbox.play.drawing.shade import Look, disc_distance, paint
from sandbox.play.drawing.strokes import Pixel, cut, fill, stroke
from sandbox.scene.description.base import Point
from sandbox.scene.description.play import Marking
from sandbox.scene.scene import Scene

BEYOND = 16_000.0
"""px to which widths of lines are cut: SDL counts in 32 bits, and draws all of it"""


def draw_markings(
    surface: pygame.Surface, camera: Camera, scene: Scene, unit: float = 1.0, antialias: bool = True
) -> None:
    """Draw the markings of a scene, as far as they are in sight."""
    for marking in scene.play.markings:
        colour = hex_colour(marking.colour)
        if marking.position is not None and marking.radius is not None:
            _circle(surface, camera, marking, (marking.position, marking.radius), colour, unit, antialias)
        elif marking.filled:
            corners = camera.to_screen(np.asarray(marking.points)).tolist()
            kept = cut([(x, y) for x, y in corners], surface.get_clip())
            if kept:
                fill(surface, kept, colour, antialias)
        else:
            places: list[Pixel] = [(x, y) for x, y in camera.to_screen(np.asarray(marking.points)).tolist()]
            width = min(max(marking.width * camera.scale, unit), BEYOND)
            for a, b in pairwise(places):
                stroke(surface, a, b, colour, width, antialias)


def _circle(
    surface: pygame.Surface,
    camera: Camera,
    marking: Marking,
    circle: tuple[Point, float],
    colour: Colour,
    unit: float,
    antialias: bool,
) -> None:
    place = np.asarray([circle[0]])
    wide = 0.0 if marking.filled else max(marking.width * camera.scale, unit)
    radius = max(circle[1] * camera.scale, unit) + 0.5 * wide
    if not camera.in_sight(place, np.asarray([radius / camera.scale]))[0]:
        return
    x, y = camera.to_screen(place)[0].tolist()
    area = surface.get_clip()
    left, top = max(x - radius - 2.0, area.left), max(y - radius - 2.0, area.top)
    right, bottom = min(x + radius + 2.0, area.right), min(y + radius + 2.0, area.bottom)
    if left < right and top < bottom:
        within = pygame.Rect(int(left), int(top), math.ceil(right) - int(left), math.ceil(bottom) - int(top))
        look = Look(colour if marking.filled else None, colour, wide, antialias=antialias)
        paint(surface, disc_distance(x, y, radius), look, within)
