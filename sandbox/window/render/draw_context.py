"""View: one picture in the making: where, of what, and which bodies are in it."""

from dataclasses import dataclass, replace

import numpy as np
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.window.camera import Camera
from sandbox.window.playback.snapshot import Snapshot
from sandbox.window.render.circles import CircleStyle
from sandbox.window.render.palette import ColourArray


@dataclass(frozen=True, eq=False)
class DrawContext:
    """What the parts of a picture share."""

    surface: pygame.Surface
    camera: Camera
    sight: Snapshot
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
    body_colours: ColourArray
    """(N, 3) of all bodies, by index"""
    has_points: bool = False
    """whether the smallest bodies are drawn as points, below everything else"""

    def first(self, most: int) -> "DrawContext":
        """Return this view with no more than so many bodies, spread over all of them."""
        if len(self.shown) <= most:
            return self
        kept = np.linspace(0, len(self.shown) - 1, most).astype(np.intp)
        return replace(
            self,
            shown=self.shown[kept],
            centre=self.centre[kept],
            radius=self.radius[kept],
            colours=self.colours[kept],
        )

    def inside(self, pixels: FloatArray, margin: float = 0.0) -> IntArray:
        """Return which places (K, 2) px lie in the picture or no more than a margin outside it; none that is nan."""
        x, y = pixels[:, 0], pixels[:, 1]
        width, height = self.camera.size
        return np.flatnonzero((x >= -margin) & (x < width + margin) & (y >= -margin) & (y < height + margin))

    def style(self, line: float = 1.5) -> CircleStyle:
        """Return the style of discs with a rim of so many px at unit 1."""
        return CircleStyle(line * self.unit, antialias=self.antialias)
