"""Moving surfaces: chevrons that travel along the outlines of objects with a surface speed or velocity.

Each object has an outline that its surface follows, clockwise for a positive speed: a line for a plane, a closed curve
for walls, posts and bodies. With a surface velocity, chevrons travel in its direction on all sides: they are where
parallel lines across the velocity, which move with it, cross the outline.
"""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple, TypeAlias
from weakref import WeakKeyDictionary

import numpy as np
import pygame

from sandbox.arrays import FloatArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import surface_parts
from sandbox.scene.description.base import BodySource, HasMaterial, Point
from sandbox.scene.description.bodies import Compound
from sandbox.scene.description.fixed import Plane, Post, Wall
from sandbox.scene.geometry.shapes import Piece, geometry_of
from sandbox.window.render.draw_context import DrawContext
from sandbox.window.render.lines import clip_segment, draw_line
from sandbox.window.render.palette import BACKGROUND, YELLOW, mix_colours

CHEVRON_SPACING = 26.0
"""px between chevrons at a UI scale of 1"""
CHEVRON_HALF_WIDTH, CHEVRON_LENGTH = 3.6, 4.6
"""px, half width and length of a chevron"""
MAX_CHEVRONS = 600
MIN_COSINE = 0.2
"""Cosine of the angle between a velocity and an edge, below which the edge has no chevrons"""
ARC_STEPS = 24
"""Segments of a full circle"""
COLOUR = mix_colours(BACKGROUND, YELLOW, 0.75)

Chevron: TypeAlias = tuple[float, float, float, float]
"""Position of a chevron, px, and its direction."""


def draw_moving_surfaces(view: DrawContext) -> None:
    """Draw chevrons along all visible moving surfaces of a scene."""
    drawn = 0
    for outline in _outlines(view):
        for x, y, along_x, along_y in _chevrons(view, outline):
            drawn += 1
            if drawn > MAX_CHEVRONS:
                return
            _draw_chevron(view, x, y, along_x, along_y)


class MovingOutline(NamedTuple):
    """Outline of an object whose surface moves."""

    points: FloatArray
    """(K, 2) m, clockwise"""
    origin: FloatArray
    """(2,) m, a point of the object"""
    speed: float
    """m/s, along the outline"""
    velocity: FloatArray
    """(2,) m/s"""

    @classmethod
    def of(cls, surface: HasMaterial, points: FloatArray, origin: FloatArray) -> "MovingOutline":
        """Return the outline of an object with the motion of a surface."""
        return cls(points, origin, surface.surface_speed, np.asarray(surface.surface_velocity))


def _is_moving(surface: HasMaterial) -> bool:
    return surface.surface_speed != 0.0 or any(surface.surface_velocity)


def _outlines(view: DrawContext) -> Iterator[MovingOutline]:
    """Yield the outlines of visible objects with a moving surface."""
    scene, bodies, frame = view.snapshot.scene, view.snapshot.bodies, view.snapshot.frame
    for collider in scene.fixed:
        if _is_moving(collider) and (isinstance(collider, Plane) or collider.solid):
            for points, origin in _outline_of(view, collider):
                yield MovingOutline.of(collider, points, np.asarray(origin))
    moving = moving_elements(bodies)
    if not any(moving):
        return
    for index in view.shown.tolist():
        if not moving[bodies.element[index]]:
            continue
        element = bodies.elements[bodies.element[index]]
        parts, cos, sin = surface_parts([element]), math.cos(frame.angle[index]), math.sin(frame.angle[index])
        for piece in geometry_of(element).pieces:
            if _is_moving(parts[piece.part]):
                x, y = _around_piece(piece).T
                turned, centre = np.column_stack((cos * x - sin * y, sin * x + cos * y)), frame.position[index]
                yield MovingOutline.of(parts[piece.part], centre + turned, centre)


_MOVING_ELEMENTS: WeakKeyDictionary[Bodies, tuple[bool, ...]] = WeakKeyDictionary()


def moving_elements(bodies: Bodies) -> tuple[bool, ...]:
    """Return for each element of bodies whether a part of it has a moving surface, computed once for the bodies."""
    found = _MOVING_ELEMENTS.get(bodies)
    if found is None:
        found = _MOVING_ELEMENTS[bodies] = tuple(map(_has_moving_surface, bodies.elements))
    return found


def _has_moving_surface(element: BodySource) -> bool:
    parts = surface_parts([element]) if isinstance(element, Compound) else (element,)
    return any(map(_is_moving, parts))


def _outline_of(view: DrawContext, collider: Plane | Wall | Post) -> Iterator[tuple[FloatArray, Point]]:
    """Yield each outline of a static collider, with a point of it."""
    if isinstance(collider, Post):
        yield _around_piece(Piece(((0.0, 0.0),), collider.radius)) + np.asarray(collider.position), collider.position
    elif isinstance(collider, Wall):
        for ends in pairwise(_points(collider)):
            yield _around_piece(Piece(ends, 0.5 * collider.thickness)), ends[0]
    else:
        yield _along_plane(view, collider), collider.point


def _points(wall: Wall) -> tuple[tuple[float, float], ...]:
    return (*wall.points, wall.points[0]) if wall.closed else tuple(wall.points)


def _along_plane(view: DrawContext, plane: Plane) -> FloatArray:
    """Return the visible part of the surface of a half-plane, from left to right of its normal."""
    camera, size = view.camera, math.hypot(*plane.normal)
    normal = np.asarray(plane.normal) / size
    along, centre = np.asarray((normal[1], -normal[0])), np.asarray(camera.centre)
    foot = centre - ((centre - np.asarray(plane.point)) @ normal) * normal
    reach = sum(camera.size) / camera.scale
    # Chevrons are counted from the point of the plane, so that they do not move with the camera.
    spacing = CHEVRON_SPACING * view.ui_scale / camera.scale
    offset = math.fmod(float((foot - np.asarray(plane.point)) @ along), spacing)
    return np.stack([foot + (sign * reach - offset) * along for sign in (-1.0, 1.0)])


def _around_piece(piece: Piece) -> FloatArray:
    """Return the closed outline (K, 2), m, clockwise, of a convex piece with its radius."""
    corners, radius = np.asarray(piece.corners, dtype=np.float64), piece.radius
    count = len(corners)
    if count == 1:
        around = np.linspace(0.0, -math.tau, ARC_STEPS + 1)
        return np.asarray(corners[0] + radius * np.column_stack((np.cos(around), np.sin(around))))
    points = []
    for k in range(count):  # counter-clockwise; reversed below
        before, after = corners[k] - corners[k - 1], corners[(k + 1) % count] - corners[k]
        start, turn = math.atan2(-before[0], before[1]), _turn(before, after)
        steps = max(1, math.ceil(ARC_STEPS * turn / math.tau)) if radius > 0.0 else 0
        for step in range(steps + 1):
            angle = start + (turn * step / steps if steps else 0.0)
            points.append(corners[k] + radius * np.asarray((math.cos(angle), math.sin(angle))))
    return np.asarray([*points, points[0]])[::-1]


def _turn(before: FloatArray, after: FloatArray) -> float:
    """Return the angle from one edge to the next, counter-clockwise; half a turn at the ends of a segment."""
    angle = math.atan2(before[0] * after[1] - before[1] * after[0], float(before @ after))
    return angle if angle > 0.0 else math.pi if before @ after < 0.0 else 0.0


def _chevrons(view: DrawContext, outline: MovingOutline) -> Iterator[Chevron]:
    """Yield the visible chevrons on an outline."""
    pixels = view.camera.to_screen(np.vstack((outline.points, outline.origin)))
    if not np.isfinite(pixels).all():
        return
    if outline.speed:
        yield from _along_outline(view, pixels[:-1], outline.speed)
    if outline.velocity.any():
        yield from _across_velocity(view, pixels[:-1], pixels[-1], outline.velocity)


def _along_outline(view: DrawContext, pixels: FloatArray, speed: float) -> Iterator[Chevron]:
    """Yield chevrons that travel along an outline (K, 2), px, at a speed, m/s."""
    lengths = np.hypot(*np.diff(pixels, axis=0).T)
    total, spacing = float(lengths.sum()), CHEVRON_SPACING * view.ui_scale
    if total < spacing:
        return
    if (pixels[0] == pixels[-1]).all():
        spacing = total / round(total / spacing)
    phase, sign = math.fmod(speed * view.snapshot.frame.time * view.camera.scale, spacing), math.copysign(1.0, speed)
    area, begin = pygame.Rect((0, 0), view.camera.size), 0.0
    for (a, b), length in zip(pairwise(pixels.tolist()), lengths.tolist(), strict=True):
        clipped = clip_segment((a[0], a[1]), (b[0], b[1]), area, 10.0 * view.ui_scale)
        if clipped is not None and length > 0.0:
            along = (b[0] - a[0]) / length, (b[1] - a[1]) / length
            first, last = (begin + math.dist(a, end) - phase for end in clipped)
            for k in range(math.ceil(first / spacing), math.ceil(last / spacing)):
                distance = k * spacing + phase - begin
                x, y = a[0] + distance * along[0], a[1] + distance * along[1]
                yield x, y, sign * along[0], sign * along[1]
        begin += length


def _across_velocity(
    view: DrawContext, pixels: FloatArray, origin: FloatArray, velocity: FloatArray
) -> Iterator[Chevron]:
    """Yield chevrons where lines across a velocity, m/s, which move with it, cross an outline (K, 2), px."""
    spacing, speed = CHEVRON_SPACING * view.ui_scale, math.hypot(*velocity)
    direction = velocity * (1.0, -1.0) / speed  # y points down on the screen
    phase = math.fmod(speed * view.snapshot.frame.time * view.camera.scale, spacing)
    area = pygame.Rect((0, 0), view.camera.size)
    for a, b in pairwise(pixels.tolist()):
        clipped = clip_segment((a[0], a[1]), (b[0], b[1]), area, 10.0 * view.ui_scale)
        if clipped is None:
            continue
        start, end = np.asarray(clipped)
        edge, length = end - start, math.dist(*clipped)
        first, last = float((start - origin) @ direction) - phase, float((end - origin) @ direction) - phase
        if abs(last - first) <= MIN_COSINE * length:
            continue
        along = edge / math.copysign(length, last - first)
        for k in range(math.ceil(min(first, last) / spacing), math.ceil(max(first, last) / spacing)):
            x, y = start + edge * ((k * spacing - first) / (last - first))
            yield float(x), float(y), float(along[0]), float(along[1])


def _draw_chevron(view: DrawContext, x: float, y: float, along_x: float, along_y: float) -> None:
    """Draw two strokes that meet in the direction of motion, on a dark halo."""
    half, length = CHEVRON_HALF_WIDTH * view.ui_scale, CHEVRON_LENGTH * view.ui_scale
    tip = x + 0.5 * length * along_x, y + 0.5 * length * along_y
    back = x - 0.5 * length * along_x, y - 0.5 * length * along_y
    wings = [(back[0] - sign * half * along_y, back[1] + sign * half * along_x) for sign in (-1.0, 1.0)]
    for colour, width in ((BACKGROUND, 3.6), (COLOUR, 1.6)):
        for wing in wings:
            draw_line(view.surface, wing, tip, colour, width * view.ui_scale, view.antialias)
