"""Overlay of the editor: outlines of the selection and of the element under the pointer, handles, and dimensions."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pygame

from sandbox.arrays import FloatArray
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.description.fixed import Plane, Post, Wall, Zone
from sandbox.scene.description.surface import Pocket
from sandbox.scene.editing.elements import ElementKey, bodies_of, element_at, exists
from sandbox.window.camera import Camera
from sandbox.window.editor.draw_gestures import OutlineGesture
from sandbox.window.editor.drive_tools import PlungerGesture
from sandbox.window.editor.editor import Editor
from sandbox.window.editor.force_tools import ACCELERATION_PER_METRE, ThrustGesture
from sandbox.window.editor.gestures import SelectGesture, ViewScale
from sandbox.window.editor.ghost_path import GhostPath
from sandbox.window.editor.handles import EditHandle
from sandbox.window.editor.joint_tools import JointGesture
from sandbox.window.editor.picking import attachment_lines, start_frame, to_world
from sandbox.window.hit_test import hulls_of, rounded_hull
from sandbox.window.render.circles import draw_disc
from sandbox.window.render.lines import draw_arrow, draw_dashes, draw_line
from sandbox.window.render.palette import BACKGROUND, INK, ORANGE, PURPLE, SKY, WARNING, YELLOW, RgbColour, mix_colours
from sandbox.window.render.text import TextPlate, draw_box, draw_text, text_size

MAX_OUTLINES = 1_000
"""Elements, and bodies of an element, that get an outline"""
MAX_STRONG_OUTLINES = 30
"""Selected elements up to which outlines have a dark edge"""
FARTHEST = 1e6
"""px, largest coordinate of rectangles"""

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


def _draw_dot(
    surface: pygame.Surface, position: tuple[float, float], radius: float, colour: RgbColour, hole: float = 0.0
) -> None:
    """Draw a disc or ring, unless it is out of sight: SDL has no coordinates beyond 32 bits."""
    (x, y), (width, height) = position, surface.get_size()
    if -radius <= x <= width + radius and -radius <= y <= height + radius:
        draw_disc(surface, (x, y), radius, colour, hole)


def _nearest_to_view(camera: Camera, points: FloatArray) -> list[list[float]]:
    """Return points, (K, 2) m, in pixels; those that SDL has no coordinates for are moved to `FARTHEST`."""
    pixels = np.nan_to_num(camera.to_screen(points), nan=FARTHEST, posinf=FARTHEST, neginf=-FARTHEST)
    moved: list[list[float]] = np.clip(pixels, -FARTHEST, FARTHEST).tolist()
    return moved


def draw_overlay(surface: pygame.Surface, camera: Camera, editor: Editor, view: ViewScale) -> None:
    """Draw everything of the editor that lies on the scene."""
    scene = editor.scene
    _draw_forces(surface, camera, scene, view)
    if editor.hovered is not None and editor.gesture is None and editor.hovered not in editor.selection:
        _draw_outlines(surface, camera, scene, editor.hovered, mix_colours(SKY, INK, 0.5), 1.0, view)
    faulty, message = editor.fault or ([], "")
    is_large = len(editor.selection) > MAX_STRONG_OUTLINES
    for key in editor.selection[:MAX_OUTLINES]:
        colour = WARNING if key in faulty else INK
        _draw_outlines(surface, camera, scene, key, colour, 1.0 if is_large else 2.0, view)
    _draw_gesture(surface, camera, editor, view)
    _draw_handles(surface, camera, editor, view)
    if editor.snapped is not None:
        x, y = camera.to_screen(np.asarray(editor.snapped[0])).tolist()
        size = 5 * view.ui_scale
        draw_line(surface, (x - size, y - size), (x + size, y + size), ORANGE, 1.6 * view.ui_scale)
        draw_line(surface, (x - size, y + size), (x + size, y - size), ORANGE, 1.6 * view.ui_scale)
    _draw_dimensions(surface, camera, editor, view)
    if message:
        _draw_fault(surface, camera, editor, message, view)


def _draw_forces(surface: pygame.Surface, camera: Camera, scene: Scene, view: ViewScale) -> None:
    """Draw the arrows of thrusts, as long as the accelerations that they give, and the centres of attractions."""
    unit, mass = view.ui_scale, scene.bodies.mass
    for thrust in scene.thrusts:
        index = scene.bodies.number_of.get(thrust.body)
        begin = to_world(scene, thrust.body, thrust.point)
        if index is None or begin is None:
            continue
        length = float(mass[index]) * ACCELERATION_PER_METRE
        (px, py), (fx, fy) = thrust.point, thrust.force
        end = to_world(scene, thrust.body, (px + fx / length, py + fy / length))
        a, b = camera.to_screen(np.asarray((begin, end))).tolist()
        draw_arrow(surface, (a[0], a[1]), (b[0], b[1]), ORANGE, 2.5 * unit, edge=BACKGROUND)
    for attraction in scene.attractions:
        if isinstance(attraction.toward, str):
            index = scene.bodies.number_of.get(attraction.toward)
            place = None if index is None else scene.bodies.position[index]
        else:
            place = np.asarray(attraction.toward)
        if place is not None:
            x, y = camera.to_screen(place).tolist()
            _draw_dot(surface, (x, y), 7 * unit, PURPLE, 5.4 * unit)
            _draw_dot(surface, (x, y), 2.5 * unit, PURPLE)


def _draw_outlines(
    surface: pygame.Surface,
    camera: Camera,
    scene: Scene,
    key: ElementKey,
    colour: RgbColour,
    width: float,
    view: ViewScale,
) -> None:
    for corners, closed in outlines_of(scene, key):
        pixels = [tuple(point) for point in camera.to_screen(corners).tolist()]
        if len(pixels) == 2 and math.dist(pixels[0], pixels[1]) < 1.0:  # a pivot
            _draw_dot(surface, pixels[0], 8 * view.ui_scale, colour, 6 * view.ui_scale)
            continue
        if width < 2.0 and len(pixels) > 2:
            draw_thin_outline(surface, pixels, closed, colour)
            continue
        ends = (*pixels[1:], pixels[0]) if closed else pixels[1:]
        strokes = ((colour, width),) if width < 2.0 else ((BACKGROUND, width + 2.0), (colour, width))
        for tone, thickness in strokes:  # a dark edge, so that the outline shows on every colour
            for a, b in zip(pixels, ends, strict=False):
                draw_line(surface, (a[0], a[1]), (b[0], b[1]), tone, thickness * view.ui_scale)


def draw_thin_outline(
    surface: pygame.Surface, pixels: Sequence[tuple[float, ...]], closed: bool, colour: RgbColour
) -> None:
    """Draw a polyline one pixel wide, unless it is out of sight."""
    xs, ys = [point[0] for point in pixels], [point[1] for point in pixels]
    width, height = surface.get_size()
    if max(xs) > 0 and min(xs) < width and max(ys) > 0 and min(ys) < height and max(map(abs, (*xs, *ys))) < 1e5:
        pygame.draw.aalines(surface, colour, closed, [(x, y) for x, y in zip(xs, ys, strict=True)])


def _draw_gesture(surface: pygame.Surface, camera: Camera, editor: Editor, view: ViewScale) -> None:
    gesture, unit = editor.gesture, view.ui_scale
    if isinstance(gesture, SelectGesture):
        (ax, ay), (bx, by) = _nearest_to_view(camera, np.asarray((gesture.begin, gesture.end)))
        rect = pygame.Rect(round(min(ax, bx)), round(min(ay, by)), round(abs(ax - bx)), round(abs(ay - by)))
        draw_box(surface, rect, 0, SKY, 40, SKY)
    elif isinstance(gesture, OutlineGesture):
        pixels = camera.to_screen(np.asarray((*gesture.corners, gesture.end))).tolist()
        for a, b in pairwise(pixels):
            draw_line(surface, (a[0], a[1]), (b[0], b[1]), SKY, 1.6 * unit)
        if len(gesture.corners) > 2:
            draw_dashes(surface, [((pixels[-1][0], pixels[-1][1]), (pixels[0][0], pixels[0][1]))], SKY, 5 * unit)
        for x, y in pixels[:-1]:
            _draw_dot(surface, (x, y), 4 * unit, SKY)
        _draw_dot(surface, (pixels[0][0], pixels[0][1]), 6 * unit, INK, 4 * unit)
    elif isinstance(gesture, ThrustGesture | PlungerGesture):
        a, b = camera.to_screen(np.asarray((gesture.begin, gesture.end))).tolist()
        draw_arrow(surface, (a[0], a[1]), (b[0], b[1]), ORANGE, 3.0 * unit, edge=BACKGROUND)
    elif isinstance(gesture, JointGesture):
        a, b = camera.to_screen(np.asarray((gesture.begin, gesture.end))).tolist()
        draw_line(surface, (a[0], a[1]), (b[0], b[1]), SKY, 2.0 * unit)
        for x, y in (a, b):
            _draw_dot(surface, (x, y), 4 * unit, SKY)


def _draw_handles(surface: pygame.Surface, camera: Camera, editor: Editor, view: ViewScale) -> None:
    handles, unit = editor.handles(view), view.ui_scale
    corners = [handle.point for handle in handles if handle.kind == "scale"]
    if len(corners) == 4:
        pixels = [tuple(each) for each in camera.to_screen(np.asarray(corners)).tolist()]
        sides = [((a[0], a[1]), (b[0], b[1])) for a, b in zip(pixels, (*pixels[1:], pixels[0]), strict=True)]
        draw_dashes(surface, sides, mix_colours(SKY, BACKGROUND, 0.3), 4 * unit)
    for handle in handles:
        ((x, y),) = _nearest_to_view(camera, np.asarray((handle.point,)))
        if handle.kind == "scale":
            side = round(8 * unit)
            rect = pygame.Rect(0, 0, side, side)
            rect.center = round(x), round(y)
            pygame.draw.rect(surface, INK, rect)
            pygame.draw.rect(surface, SKY, rect, max(round(1.5 * unit), 1))
        elif handle.kind == "velocity":
            _draw_velocity(surface, camera, editor, handle, view)
        elif handle.kind == "rotate":
            _draw_dot(surface, (x, y), 6.5 * unit, INK)
            _draw_dot(surface, (x, y), 5 * unit, SKY, 2 * unit)
        else:
            _draw_dot(surface, (x, y), 5 * unit, SKY)
            _draw_dot(surface, (x, y), 3.4 * unit, INK)


def _draw_velocity(
    surface: pygame.Surface, camera: Camera, editor: Editor, handle: EditHandle, view: ViewScale
) -> None:
    """Draw the arrow of the velocity of the selected body, and its handle."""
    scene, unit = editor.scene, view.ui_scale
    a, b = camera.to_screen(np.asarray((scene.bodies.position[handle.index], handle.point))).tolist()
    if scene.bodies.velocity[handle.index].any():
        draw_arrow(surface, (a[0], a[1]), (b[0], b[1]), YELLOW, 2.5 * unit, edge=BACKGROUND)
    _draw_dot(surface, (b[0], b[1]), 5.5 * unit, BACKGROUND)
    _draw_dot(surface, (b[0], b[1]), 4 * unit, YELLOW)


def draw_ghost_path(surface: pygame.Surface, camera: Camera, path: GhostPath, ui_scale: float) -> None:
    """Draw a predicted path as dots, which are equally far apart in time and fade out."""
    pixels = camera.to_screen(path.points)
    finite = pixels[np.isfinite(pixels).all(axis=1)]
    count = len(finite)
    for k, (x, y) in enumerate(finite.tolist()):
        colour = mix_colours(YELLOW, BACKGROUND, 0.15 + 0.7 * k / max(count, 1))
        _draw_dot(surface, (x, y), (2.2 if k % 10 else 3.2) * ui_scale, colour)


def _draw_dimensions(surface: pygame.Surface, camera: Camera, editor: Editor, view: ViewScale) -> None:
    """Draw the dimensions of the gesture beside the pointer, and numbers that are being typed."""
    gesture = editor.gesture
    if gesture is None or editor.pointer is None:
        return
    text = f"{gesture.typed}▏" if gesture.typed else gesture.dimensions()
    if not text or isinstance(gesture, SelectGesture):
        return
    size = 13 * view.ui_scale
    width, height = text_size(text, size, mono=True)
    ((x, y),) = _nearest_to_view(camera, np.asarray((editor.pointer,)))
    rect = pygame.Rect(round(x + 16 * view.ui_scale), round(y + 14 * view.ui_scale), round(width + size), height + 6)
    rect.clamp_ip(surface.get_rect())
    draw_box(surface, rect, 4 * view.ui_scale, edge=ORANGE if gesture.typed else None, opacity=235)
    draw_text(surface, text, rect.center, size, INK, "center", mono=True)


def _draw_fault(surface: pygame.Surface, camera: Camera, editor: Editor, message: str, view: ViewScale) -> None:
    """Draw the message of a refused change at the selection."""
    box = editor.selection_bounds()
    if box is None:
        return
    plate = TextPlate(message, 12.5 * view.ui_scale, 320 * view.ui_scale, pad=0.45)
    ((x, y),) = _nearest_to_view(camera, np.asarray(((0.5 * (box[0][0] + box[1][0]), box[0][1]),)))
    plate.rect.midtop = round(x), round(y + 14 * view.ui_scale)
    plate.rect.clamp_ip(surface.get_rect())
    plate.draw(surface, 5 * view.ui_scale, 245, WARNING)
