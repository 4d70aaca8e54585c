"""Overlay of the editor: outlines of the selection and of the element under the pointer, handles, and dimensions."""

import math
from collections.abc import Sequence

import numpy as np
import pygame

from sandbox.arrays import FloatArray
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.description.fixed import Plane, Post, Wall, Zone
from sandbox.scene.description.surface import Pocket
from sandbox.scene.editing.elements import ElementKey, bodies_of, element_at, exists
from sandbox.window.editor.editor import Editor
from sandbox.window.editor.force_tools import ACCELERATION_PER_METRE
from sandbox.window.editor.gestures import Gesture
from sandbox.window.editor.ghost_path import GhostPath
from sandbox.window.editor.handles import EditHandle
from sandbox.window.editor.picking import attachment_lines, start_frame, to_world
from sandbox.window.editor.snapping import ViewScale
from sandbox.window.hit_test import hulls_of, rounded_hull
from sandbox.window.render.circles import draw_disc
from sandbox.window.render.draw_context import FARTHEST, Canvas
from sandbox.window.render.lines import draw_arrow, draw_dashes, draw_line
from sandbox.window.render.palette import BACKGROUND, INK, ORANGE, PURPLE, SKY, WARNING, YELLOW, RgbColour, mix_colours
from sandbox.window.render.text import TextPlate, draw_box, draw_text, text_size

MAX_OUTLINES = 1_000
"""Elements, and bodies of an element, that get an outline"""
MAX_STRONG_OUTLINES = 30
"""Selected elements up to which outlines have a dark edge"""

ElementOutline = tuple[FloatArray, bool]
"""Corners, (K, 2) m, and whether the last one is connected to the first."""


def outlines_of(scene: Scene, key: ElementKey) -> list[ElementOutline]:
    """Return the outlines of an element."""
    if not exists(scene, key):
        return []
    element, bodies = element_at(scene, key), bodies_of(scene, key)
    if len(bodies):
        frame = start_frame(scene)
        hulls = [hull for k in list(bodies)[:MAX_OUTLINES] for hull in hulls_of(scene.bodies, frame, k)]
        return [(rounded_hull(hull, 12), True) for hull in hulls]
    match element:
        case Post() | Pocket():
            return [(_circle(element.position, element.radius), True)]
        case Wall():
            return [(np.asarray(element.points), element.closed)]
        case Plane():
            length = math.hypot(*element.normal) or 1.0
            along = np.asarray((element.normal[1], -element.normal[0])) / length
            return [(np.asarray(element.point) + np.outer((-1e4, 1e4), along), False)]
        case Zone():
            if element.points is not None:
                return [(np.asarray(element.points), element.thickness is None)]
            return [(_circle(element.position or (0.0, 0.0), element.radius or 0.0), True)]
        case _:
            return [(np.asarray(line), False) for line in attachment_lines(scene, element)]


def _circle(centre: Point, radius: float) -> FloatArray:
    angles = np.linspace(0.0, 2.0 * math.pi, 48, endpoint=False)
    return np.asarray(centre) + radius * np.column_stack((np.cos(angles), np.sin(angles)))


def draw_overlay(canvas: Canvas, editor: Editor, view: ViewScale) -> None:
    """Draw everything of the editor that lies on the scene."""
    scene, gesture = editor.scene, editor.gesture
    _draw_forces(canvas, scene)
    if editor.hovered is not None and gesture is None and editor.hovered not in editor.selection:
        _draw_outlines(canvas, scene, editor.hovered, mix_colours(SKY, INK, 0.5), 1.0)
    faulty, message = editor.fault or ([], "")
    is_large = len(editor.selection) > MAX_STRONG_OUTLINES
    for key in editor.selection[:MAX_OUTLINES]:
        _draw_outlines(canvas, scene, key, WARNING if key in faulty else INK, 1.0 if is_large else 2.0)
    if gesture is not None:
        gesture.draw(canvas)
    _draw_handles(canvas, scene, editor.handles(view))
    if gesture is not None:
        _draw_snapped(canvas, gesture)
        if editor.pointer is not None:
            _draw_dimensions(canvas, gesture, editor.pointer)
    if message:
        _draw_fault(canvas, editor.selection_bounds(), message)


def _draw_snapped(canvas: Canvas, gesture: Gesture) -> None:
    """Draw a cross at the centre or corner to which the pointer has snapped."""
    if gesture.snapped is None or gesture.snapped.to == "grid":
        return
    ((x, y),) = canvas.pixels((gesture.snapped.point,))
    size = 5 * canvas.ui_scale
    draw_line(canvas.surface, (x - size, y - size), (x + size, y + size), ORANGE, 1.6 * canvas.ui_scale)
    draw_line(canvas.surface, (x - size, y + size), (x + size, y - size), ORANGE, 1.6 * canvas.ui_scale)


def _draw_forces(canvas: Canvas, scene: Scene) -> None:
    """Draw the arrows of thrusts, as long as the accelerations that they give, and the centres of attractions."""
    surface, unit, mass = canvas.surface, canvas.ui_scale, scene.bodies.mass
    for thrust in scene.thrusts:
        index = scene.bodies.number_of.get(thrust.body)
        begin = to_world(scene, thrust.body, thrust.point)
        if index is None or begin is None:
            continue
        length = float(mass[index]) * ACCELERATION_PER_METRE
        (px, py), (fx, fy) = thrust.point, thrust.force
        end = to_world(scene, thrust.body, (px + fx / length, py + fy / length))
        a, b = canvas.pixels((begin, end or begin))
        draw_arrow(surface, a, b, ORANGE, 2.5 * unit, edge=BACKGROUND)
    for attraction in scene.attractions:
        if isinstance(attraction.toward, str):
            index = scene.bodies.number_of.get(attraction.toward)
            place = None if index is None else scene.bodies.position[index]
        else:
            place = np.asarray(attraction.toward)
        if place is not None:
            (pixel,) = canvas.pixels(place[None])
            draw_disc(surface, pixel, 7 * unit, PURPLE, 5.4 * unit)
            draw_disc(surface, pixel, 2.5 * unit, PURPLE)


def _draw_outlines(canvas: Canvas, scene: Scene, key: ElementKey, colour: RgbColour, width: float) -> None:
    surface, unit = canvas.surface, canvas.ui_scale
    for corners, closed in outlines_of(scene, key):
        pixels = canvas.pixels(corners)
        if len(pixels) == 2 and math.dist(pixels[0], pixels[1]) < 1.0:  # a pivot
            draw_disc(surface, pixels[0], 8 * unit, colour, 6 * unit)
            continue
        if width < 2.0 and len(pixels) > 2:
            draw_thin_outline(surface, pixels, closed, colour)
            continue
        ends = (*pixels[1:], pixels[0]) if closed else pixels[1:]
        strokes = ((colour, width),) if width < 2.0 else ((BACKGROUND, width + 2.0), (colour, width))
        for tone, thickness in strokes:  # a dark edge, so that the outline shows on every colour
            for a, b in zip(pixels, ends, strict=False):
                draw_line(surface, a, b, tone, thickness * unit)


def draw_thin_outline(
    surface: pygame.Surface, pixels: Sequence[tuple[float, ...]], closed: bool, colour: RgbColour
) -> None:
    """Draw a polyline one pixel wide, unless it is out of sight."""
    xs, ys = [point[0] for point in pixels], [point[1] for point in pixels]
    width, height = surface.get_size()
    if max(xs) > 0 and min(xs) < width and max(ys) > 0 and min(ys) < height and max(map(abs, (*xs, *ys))) < 1e5:
        pygame.draw.aalines(surface, colour, closed, [(x, y) for x, y in zip(xs, ys, strict=True)])


def _draw_handles(canvas: Canvas, scene: Scene, handles: Sequence[EditHandle]) -> None:
    surface, unit = canvas.surface, canvas.ui_scale
    corners = [handle.point for handle in handles if handle.kind == "scale"]
    if len(corners) == 4:
        pixels = canvas.pixels(corners)
        sides = list(zip(pixels, (*pixels[1:], pixels[0]), strict=True))
        draw_dashes(surface, sides, mix_colours(SKY, BACKGROUND, 0.3), 4 * unit)
    for handle in handles:
        ((x, y),) = canvas.pixels((handle.point,), FARTHEST)
        if handle.kind == "scale":
            side = round(8 * unit)
            rect = pygame.Rect(0, 0, side, side)
            rect.center = round(x), round(y)
            pygame.draw.rect(surface, INK, rect)
            pygame.draw.rect(surface, SKY, rect, max(round(1.5 * unit), 1))
        elif handle.kind == "velocity":
            _draw_velocity(canvas, scene, handle)
        elif handle.kind == "rotate":
            draw_disc(surface, (x, y), 6.5 * unit, INK)
            draw_disc(surface, (x, y), 5 * unit, SKY, 2 * unit)
        else:
            draw_disc(surface, (x, y), 5 * unit, SKY)
            draw_disc(surface, (x, y), 3.4 * unit, INK)


def _draw_velocity(canvas: Canvas, scene: Scene, handle: EditHandle) -> None:
    """Draw the arrow of the velocity of the selected body, and its handle."""
    surface, unit = canvas.surface, canvas.ui_scale
    a, b = canvas.pixels(np.asarray((scene.bodies.position[handle.index], handle.point)))
    if scene.bodies.velocity[handle.index].any():
        draw_arrow(surface, a, b, YELLOW, 2.5 * unit, edge=BACKGROUND)
    draw_disc(surface, b, 5.5 * unit, BACKGROUND)
    draw_disc(surface, b, 4 * unit, YELLOW)


def draw_ghost_path(canvas: Canvas, path: GhostPath) -> None:
    """Draw a predicted path as dots, which are equally far apart in time and fade out."""
    finite = [pixel for pixel in canvas.pixels(path.points) if all(map(math.isfinite, pixel))]
    for k, pixel in enumerate(finite):
        colour = mix_colours(YELLOW, BACKGROUND, 0.15 + 0.7 * k / len(finite))
        draw_disc(canvas.surface, pixel, (2.2 if k % 10 else 3.2) * canvas.ui_scale, colour)


def _draw_dimensions(canvas: Canvas, gesture: Gesture, pointer: Point) -> None:
    """Draw the dimensions of a gesture beside the pointer, m, and numbers that are being typed."""
    text = f"{gesture.typed}▏" if gesture.typed else gesture.dimensions()
    if not text or not gesture.edits:
        return
    size, unit = 13 * canvas.ui_scale, canvas.ui_scale
    width, height = text_size(text, size, mono=True)
    ((x, y),) = canvas.pixels((pointer,), FARTHEST)
    rect = pygame.Rect(round(x + 16 * unit), round(y + 14 * unit), round(width + size), height + 6)
    rect.clamp_ip(canvas.surface.get_rect())
    draw_box(canvas.surface, rect, 4 * unit, edge=ORANGE if gesture.typed else None, opacity=235)
    draw_text(canvas.surface, text, rect.center, size, INK, "center", mono=True)


def _draw_fault(canvas: Canvas, box: tuple[Point, Point] | None, message: str) -> None:
    """Draw the message of a refused change below the box of the selection, m."""
    if box is None:
        return
    unit = canvas.ui_scale
    plate = TextPlate(message, 12.5 * unit, 320 * unit, pad=0.45)
    ((x, y),) = canvas.pixels(((0.5 * (box[0][0] + box[1][0]), box[0][1]),), FARTHEST)
    plate.rect.midtop = round(x), round(y + 14 * unit)
    plate.rect.clamp_ip(canvas.surface.get_rect())
    plate.draw(canvas.surface, 5 * unit, 245, WARNING)
