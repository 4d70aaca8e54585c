"""Zones: faint tinted areas beneath everything that moves, with a thin outline."""

from itertools import pairwise

import numpy as np
import pygame

from sandbox.arrays import FloatArray
from sandbox.play.camera import Camera
from sandbox.play.drawing.palette import FAINT, GREEN, ORANGE, SKY, Colour, hex_colour
from sandbox.play.drawing.shade import Distance, Look, capsule_distance, disc_distance, paint
from sandbox.scene.description.base import Point
from sandbox.scene.description.fixed import Zone
from sandbox.scene.scene import Scene

FILLED, LINED = 0.13, 0.55
"""opacity of the area, and of its outline"""
LINE = 1.5
"""px, of the outline"""


def draw_zones(
    surface: pygame.Surface, camera: Camera, scene: Scene, unit: float = 1.0, antialias: bool = True
) -> None:
    """Draw the zones of a scene, as far as they are in sight."""
    for zone in scene.zones:
        distance, within = _distance(zone, camera)
        box = within.inflate(4, 4).clip(surface.get_clip())
        colour = colour_of_zone(zone)
        paint(surface, distance, Look(colour, colour, 0.0, FILLED, antialias), box)
        paint(surface, distance, Look(None, colour, LINE * unit, LINED, antialias), box)


def colour_of_zone(zone: Zone) -> Colour:
    """Return the colour of a zone: its own, or one by what it does."""
    if zone.colour is not None:
        return hex_colour(zone.colour)
    if zone.holds:
        return ORANGE
    if zone.to_layer is not None:
        return GREEN
    return FAINT if zone.gravity is None else SKY


def _distance(zone: Zone, camera: Camera) -> tuple[Distance, pygame.Rect]:
    """Return the distance from a zone, px, and the part of the picture that it may be in."""
    if zone.points is None:
        assert zone.position is not None and zone.radius is not None
        corners, reach = _pixels((zone.position,), camera), zone.radius * camera.scale
        x, y = corners[0].tolist()
        return disc_distance(x, y, reach), _box(corners, reach)
    corners = _pixels(zone.points, camera)
    if zone.thickness is None:
        return _outline(corners), _box(corners, 0.0)
    half = 0.5 * zone.thickness * camera.scale
    ends = [(x, y) for x, y in corners.tolist()]
    parts = [capsule_distance(a, b, half) for a, b in pairwise(ends)]

    def nearest(px: FloatArray, py: FloatArray) -> FloatArray:
        return np.asarray(np.minimum.reduce([part(px, py) for part in parts]))

    return nearest, _box(corners, half)


def _outline(corners: FloatArray) -> Distance:
    """Return the distance from a simple polygon (K, 2), px; inside, a ray crosses an odd number of sides."""
    sides = list(zip(corners.tolist(), np.roll(corners, -1, axis=0).tolist(), strict=True))

    def distance(px: FloatArray, py: FloatArray) -> FloatArray:
        px, py = np.broadcast_arrays(px, py)
        apart, inside = np.full(px.shape, np.inf), np.zeros(px.shape, np.bool_)
        for (ax, ay), (bx, by) in sides:
            apart = np.minimum(apart, capsule_distance((ax, ay), (bx, by), 0.0)(px, py))
            if ay != by:
                inside ^= ((ay > py) != (by > py)) & (px < ax + (bx - ax) * (py - ay) / (by - ay))
        return np.where(inside, -apart, apart)

    return distance


def _pixels(points: tuple[Point, ...], camera: Camera) -> FloatArray:
    return np.asarray(camera.to_screen(np.asarray(points, dtype=np.float64)), dtype=np.float64)


def _box(corners: FloatArray, reach: float) -> pygame.Rect:
    """Return the box of places (K, 2) and so much around them, px, cut to what SDL can count."""
    low, high = (corners.min(axis=0) - reach).clip(-1e6, 1e6), (corners.max(axis=0) + reach).clip(-1e6, 1e6)
    return pygame.Rect(*np.floor(low).astype(int).tolist(), *np.ceil(high - low + 1.0).astype(int).tolist())
