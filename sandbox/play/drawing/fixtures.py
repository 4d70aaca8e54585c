"""StaticColliders: planes, walls, posts and the world's bounds, which change with the camera alone."""

import math
from itertools import pairwise

import numpy as np
import pygame

from sandbox.play.camera import Box, Camera
from sandbox.play.drawing.palette import (
    BACKGROUND,
    FAINT,
    NEUTRAL,
    SOLID,
    SURFACE,
    Colour,
    colour_of_fixed,
    mixed,
)
from sandbox.play.drawing.shade import Look, capsule_distance, disc_distance, line_distance, paint
from sandbox.play.drawing.strokes import Pixel, clipped, dashes, stroke
from sandbox.scene.description.fixed import Plane, Post, Wall
from sandbox.scene.scene import Scene

HATCH, HATCHES = 9.0, 600
"""px between two hatches of a plane, and the most of them"""
WAYS = 60.0
"""px between two arrows through a wall that lets pass from one side"""
CAP = 5.0
"""px, the least radius at which a post that kicks shows its ring"""
ABSENT = 0.4
"""How much of its colour is left of what is not solid"""
MOST_ROUND = 300
"""Segments of thick walls in sight that get round, shaded ends; where there are more, all are plain lines."""


def draw_fixtures(
    surface: pygame.Surface, camera: Camera, scene: Scene, unit: float = 1.0, antialias: bool = True
) -> None:
    """Draw what is fixed in a scene, as far as it is in sight."""
    for plane in scene.planes:
        _plane(surface, camera, plane, unit, antialias)
    for wall in scene.walls:
        _wall(surface, camera, wall, unit, antialias)
    for post in scene.posts:
        _post(surface, camera, post, unit, antialias)


def draw_bounds(
    surface: pygame.Surface, camera: Camera, bounds: Box | None, unit: float = 1.0, antialias: bool = True
) -> None:
    """Draw the box outside which bodies are retired, dashed."""
    if bounds is not None:
        dashes(surface, outline(camera, bounds), FAINT, 8.0 * unit, antialias)


def outline(camera: Camera, box: Box) -> list[tuple[Pixel, Pixel]]:
    """Return the sides of a box, px."""
    (left, bottom), (right, top) = box
    world = np.asarray([(left, bottom), (right, bottom), (right, top), (left, top), (left, bottom)])
    return list(pairwise((x, y) for x, y in camera.to_screen(world).tolist()))


def _plane(surface: pygame.Surface, camera: Camera, plane: Plane, unit: float, antialias: bool) -> None:
    length = math.hypot(*plane.normal)
    nx, ny = plane.normal[0] / length, plane.normal[1] / length
    middle = camera.size[0] / 2.0, camera.size[1] / 2.0
    # The height of the picture's middle above the plane is worked out in metres: the plane's own point may be so far
    # away that its place in pixels says nothing.
    height = ((camera.centre[0] - plane.point[0]) * nx + (camera.centre[1] - plane.point[1]) * ny) * camera.scale
    down = nx, -ny
    offset = height - middle[0] * down[0] - middle[1] * down[1]
    edge = colour_of_fixed(plane, SURFACE)
    filling = SOLID if plane.colour is None else mixed(BACKGROUND, edge, 0.25)
    paint(surface, line_distance(offset, down), Look(filling, edge, 2.0 * unit, antialias=antialias))

    foot = middle[0] - height * down[0], middle[1] - height * down[1]
    along = -down[1], down[0]
    reach = camera.size[0] + camera.size[1]
    if abs(height) < reach:
        phase = math.fmod(
            ((plane.point[0] - camera.centre[0]) * along[0] - (plane.point[1] - camera.centre[1]) * along[1])
            * camera.scale,
            HATCH * unit,
        )
        _hatch(surface, foot, along, down, phase, reach, mixed(filling, edge, 0.3), unit, antialias)


def _hatch(
    surface: pygame.Surface,
    foot: Pixel,
    along: Pixel,
    out: Pixel,
    phase: float,
    reach: float,
    colour: Colour,
    unit: float,
    antialias: bool,
) -> None:
    """Draw short slanted lines behind a plane's edge; they move with the plane's point."""
    ends = (
        (foot[0] - along[0] * reach, foot[1] - along[1] * reach),
        (foot[0] + along[0] * reach, foot[1] + along[1] * reach),
    )
    part = clipped(*ends, surface.get_clip(), 20.0 * unit)
    if part is None:
        return
    step = HATCH * unit
    low, high = sorted((p[0] - foot[0]) * along[0] + (p[1] - foot[1]) * along[1] for p in part)
    first = math.ceil((low - phase) / step)
    for k in range(first, min(math.floor((high - phase) / step) + 1, first + HATCHES)):
        s = phase + k * step
        x, y = foot[0] + along[0] * s - out[0] * 3.0 * unit, foot[1] + along[1] * s - out[1] * 3.0 * unit
        slant = (along[0] - out[0]) * 6.0 * unit, (along[1] - out[1]) * 6.0 * unit
        stroke(surface, (x, y), (x + slant[0], y + slant[1]), colour, 1.0, antialias)


def _wall(surface: pygame.Surface, camera: Camera, wall: Wall, unit: float, antialias: bool) -> None:
    points = np.asarray((*wall.points, wall.points[0]) if wall.closed else wall.points)
    half = wall.thickness / 2.0 * camera.scale
    thin = half <= 1.0 * unit
    half = max(half, 1.0 * unit)
    edge = colour_of_fixed(wall, SURFACE)
    filling = edge if thin else SOLID if wall.colour is None else mixed(BACKGROUND, edge, 0.4)
    area = surface.get_clip()
    pixels = camera.to_screen(points).tolist()
    parts = [part for a, b in pairwise(pixels) if (part := clipped((a[0], a[1]), (b[0], b[1]), area, half + 4.0))]
    if not wall.solid:
        ends = (((a[0], a[1]), (b[0], b[1])) for a, b in pairwise(pixels))
        dashes(surface, ends, mixed(BACKGROUND, edge, ABSENT), 5.0 * unit, antialias)
        return
    if wall.one_way:
        for a, b in pairwise(pixels):
            _ways_through(surface, (a[0], a[1]), (b[0], b[1]), half, edge, unit, antialias)
    plain = len(parts) > MOST_ROUND
    rim = 0.0 if thin else min(1.5 * unit, half)
    # The outline of all segments first and then the filling of all, so that no outline shows inside a corner.
    for inset, colour in ((0.0, edge), (rim, filling)) if rim else ((0.0, edge),):
        for a, b in parts:
            if plain and half < 4000.0:
                stroke(surface, a, b, colour, 2.0 * (half - inset), antialias)
            else:
                look = Look(colour, colour, 0.0, antialias=antialias)
                paint(surface, capsule_distance(a, b, half - inset), look, _around(a, b, half, area))


def _ways_through(
    surface: pygame.Surface, a: Pixel, b: Pixel, half: float, colour: Colour, unit: float, antialias: bool
) -> None:
    """Draw small arrows out of a wall's left, the way that it lets pass; they stay where they are on it."""
    part, length = clipped(a, b, surface.get_clip(), half + 12.0 * unit), math.dist(a, b)
    if part is None or length < 2.0:
        return
    ux, uy = (b[0] - a[0]) / length, (b[1] - a[1]) / length
    out = uy, -ux  # on the screen y points down: so it is to the left
    step = length / max(1, round(length / (WAYS * unit)))
    first = math.floor(math.dist(a, part[0]) / step)
    for k in range(first, min(math.ceil(math.dist(a, part[1]) / step), first + HATCHES)):
        s = (k + 0.5) * step
        x, y = a[0] + s * ux + half * out[0], a[1] + s * uy + half * out[1]
        tip = x + 10.0 * unit * out[0], y + 10.0 * unit * out[1]
        stroke(surface, (x, y), tip, colour, 1.5 * unit, antialias)
        for side in (-4.0 * unit, 4.0 * unit):
            barb = tip[0] - 4.0 * unit * out[0] + side * ux, tip[1] - 4.0 * unit * out[1] + side * uy
            stroke(surface, tip, barb, colour, 1.5 * unit, antialias)


def _around(a: Pixel, b: Pixel, reach: float, area: pygame.Rect) -> pygame.Rect:
    """Return the part of an area that is no farther than `reach` from the box of two points."""
    left, top = max(min(a[0], b[0]) - reach - 2.0, area.left), max(min(a[1], b[1]) - reach - 2.0, area.top)
    right, bottom = min(max(a[0], b[0]) + reach + 2.0, area.right), min(max(a[1], b[1]) + reach + 2.0, area.bottom)
    if right <= left or bottom <= top:
        return pygame.Rect(0, 0, 0, 0)
    return pygame.Rect(int(left), int(top), math.ceil(right) - int(left), math.ceil(bottom) - int(top))


def _post(surface: pygame.Surface, camera: Camera, post: Post, unit: float, antialias: bool) -> None:
    place = np.asarray([post.position])
    radius = max(post.radius * camera.scale, 1.0 * unit)
    if not camera.in_sight(place, radius / camera.scale)[0]:
        return
    x, y = camera.to_screen(place)[0].tolist()
    edge = colour_of_fixed(post, NEUTRAL)
    around = _around((x, y), (x, y), radius, surface.get_clip())
    if not post.solid:
        faint = mixed(BACKGROUND, edge, ABSENT)
        paint(surface, disc_distance(x, y, radius), Look(BACKGROUND, faint, 1.0 * unit, antialias=antialias), around)
        return
    look = Look(mixed(BACKGROUND, edge, 0.55), edge, min(1.5 * unit, radius), antialias=antialias)
    paint(surface, disc_distance(x, y, radius), look, around)
    if post.kick is not None and radius > CAP * unit:  # the ring of a bumper, inside its cap
        ring = Look(mixed(BACKGROUND, edge, 0.3), edge, 1.5 * unit, antialias=antialias)
        paint(surface, disc_distance(x, y, 0.6 * radius), ring, around)
