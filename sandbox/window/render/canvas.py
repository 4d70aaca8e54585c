"""Canvas: where and how a picture is drawn."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pygame

from sandbox.arrays import FloatArray
from sandbox.scene.description.base import Point
from sandbox.window.camera import Camera

FARTHEST = 1e6
"""px, largest coordinate of rectangles: SDL has no coordinates beyond 32 bits"""


@dataclass(frozen=True, eq=False)
class Canvas:
    """Target, camera and style of a picture."""

    surface: pygame.Surface
    """of size `camera.size`"""
    camera: Camera
    ui_scale: float = 1.0
    """px, width of a line that is one pixel wide on a 1080p display; line widths and text scale with it"""
    antialias: bool = True
    """whether edges are smooth"""

    def pixels(self, points: Sequence[Point] | FloatArray, limit: float = np.inf) -> list[tuple[float, float]]:
        """Return points, m, in pixels; coordinates beyond a limit are moved to it."""
        found = self.camera.to_screen(np.asarray(points))
        if limit < np.inf:
            found = np.clip(np.nan_to_num(found, nan=limit, posinf=limit, neginf=-limit), -limit, limit)
        return [(x, y) for x, y in found.tolist()]
