"""Grid lines at round distances, and the scale bar that labels the grid spacing."""

import math

import numpy as np
import pygame

from sandbox.formatting import format_si
from sandbox.window.camera import Camera
from sandbox.window.render.draw_context import Canvas
from sandbox.window.render.palette import BACKGROUND, FAINT, GRID, GRID_STRONG
from sandbox.window.render.text import draw_text

MIN_LINE_SPACING = 56.0
"""px, smallest spacing of grid lines"""
EMPHASIS_PERIOD = 5
"""Every fifth line is emphasised."""


def step_of(camera: Camera, ui_scale: float = 1.0) -> float:
    """Return the grid spacing, m: 1, 2 or 5 times a power of ten."""
    least = MIN_LINE_SPACING * ui_scale / camera.scale
    power = 10.0 ** math.floor(math.log10(least))
    return next((k * power for k in (1.0, 2.0, 5.0) if k * power >= least), 10.0 * power)


def draw_grid(canvas: Canvas) -> None:
    """Draw the grid; an axis whose coordinates exceed 1e12 spacings gets no lines (float resolution)."""
    camera = canvas.camera
    step = step_of(camera, canvas.ui_scale)
    thickness = max(1, round(canvas.ui_scale))
    lines: list[tuple[bool, pygame.Rect]] = []
    for axis in (0, 1):
        low, high = (corner[axis] for corner in camera.box)
        if max(abs(low), abs(high)) / step > 1e12:
            continue
        numbers = np.arange(math.ceil(low / step), math.floor(high / step) + 1)
        places = np.zeros((len(numbers), 2))
        places[:, axis] = numbers * step
        for number, pixel in zip(numbers.tolist(), np.floor(camera.to_screen(places)[:, axis]).tolist(), strict=True):
            if axis == 0:
                rect = pygame.Rect(int(pixel), 0, thickness, camera.size[1])
            else:
                rect = pygame.Rect(0, int(pixel), camera.size[0], thickness)
            lines.append((number % EMPHASIS_PERIOD == 0, rect))
    for strong, rect in sorted(lines, key=lambda line: line[0]):  # emphasised lines last, as they cross the others
        canvas.surface.fill(GRID_STRONG if strong else GRID, rect)


def scale_rect(camera: Camera, ui_scale: float = 1.0, foot: float = 0.0) -> pygame.Rect:
    """Return the rectangle that `draw_scale` covers, px, its label included."""
    width, height = round(step_of(camera, ui_scale) * camera.scale + 4 * ui_scale), round(28 * ui_scale)
    return pygame.Rect(round(16 * ui_scale), round(camera.size[1] - 16 * ui_scale - foot) - height, width, height)


def draw_scale(canvas: Canvas, foot: float = 0.0) -> None:
    """Draw the scale bar in the lower left corner, `foot` px above the lower edge."""
    surface, camera, ui_scale = canvas.surface, canvas.camera, canvas.ui_scale
    step = step_of(camera, ui_scale)
    length, thick = round(step * camera.scale), max(1, round(1.5 * ui_scale))
    left, base = round(18 * ui_scale), round(camera.size[1] - 18 * ui_scale - foot)
    tick = round(5 * ui_scale)
    surface.fill(FAINT, pygame.Rect(left, base - thick, length, thick))
    for x in (left, left + length - thick):
        surface.fill(FAINT, pygame.Rect(x, base - thick - tick, thick, tick))
    text, middle, above = format_si(step, "m", digits=1), left + length / 2.0, base - tick - 3 * ui_scale
    # a shadow, for contrast
    draw_text(surface, text, (middle + 1, above + 1), 12 * ui_scale, BACKGROUND, "midbottom")
    draw_text(surface, text, (middle, above), 12 * ui_scale, FAINT, "midbottom")
