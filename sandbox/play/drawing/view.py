"""View: one picture in the making: where, of what, and which bodies are in it."""

from dataclasses import dataclass

import numpy as np
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.play.camera import Camera
from sandbox.play.drawing.discs import Style
from sandbox.play.drawing.palette import ColourArray
from sandbox.play.sight import Sight


@dataclass(frozen=True, eq=False)
class View:
    """What the parts of a picture share."""

    surface: pygame.Surface
    camera: Camera
    sight: Sight
    unit: float
    """px, of a line that is one pixel wide on a 1080p display"""
    antialias: bool
    shown: IntArray
    """(K,) numbers of the bodies that are present and in sight"""
    centre: FloatArray
    """(K, 2) px"""
    radius: FloatArray
    """(K,) px"""
    colours: ColourArray
    """(K, 3)"""

    def first(self, most: int) -> "View":
        """Return this view with no more than so many bodies, spread over all of them."""
        if len(self.shown) <= most:
            return self
        kept = np.linspace(0, len(self.shown) - 1, most).astype(np.intp)
        parts = self.shown[kept], self.centre[kept], self.radius[kept], self.colours[kept]
        return View(self.surface, self.camera, self.sight, self.unit, self.antialias, *parts)

    def inside(self, pixels: FloatArray, margin: float = 0.0) -> IntArray:
        """Return which places (K, 2) px lie in the picture or no more than a margin outside it; none that is nan."""
        x, y = pixels[:, 0], pixels[:, 1]
        width, height = self.camera.size
        return np.flatnonzero((x >= -margin) & (x < width + margin) & (y >= -margin) & (y < height + margin))

    def style(self, line: float = 1.5) -> Style:
        """Return the style of discs with a rim of so many px at unit 1."""
        return Style(line * self.unit, antialias=self.antialias)
