"""2D camera: maps world coordinates, y up in m, to pixels, y down, and back."""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from sandbox.arrays import FloatArray

MAX_SCALE, MIN_SCALE = 1e12, 1e-14
"""px/m: resolution of double precision, and the widest view of the largest scene"""

PAN_TIME, ZOOM_OUT_TIME, ZOOM_IN_TIME = 0.15, 0.1, 0.8
"""s: time constants of a camera that follows a body"""
INNER_FRACTION, OUTER_FRACTION = 0.4, 0.8
"""fractions of the free area: the camera does not move while the followed body is in the inner one, and keeps it in the
outer one"""

ViewBox = tuple[tuple[float, float], tuple[float, float]]
"""Lower-left and upper-right corner, m."""


@dataclass(frozen=True)
class Camera:
    """View of a part of the world; immutable, so moving it returns another camera.

    A turned camera, for tables longer than wide, shows y to the right and x downwards.
    """

    centre: tuple[float, float]
    """world position of the middle of the picture, m"""
    scale: float
    """px/m"""
    size: tuple[int, int]
    """px, of the picture"""
    turned: bool = False
    """whether it is rotated by a quarter turn clockwise"""

    @classmethod
    def fitting(
        cls,
        box: ViewBox,
        size: tuple[int, int],
        margin: float = 0.06,
        inset: int = 0,
        foot: int = 0,
        turned: bool = False,
        head: int = 0,
    ) -> Self:
        """Return a camera that shows a whole box.

        Args:
            box: box, m; its sides may be 0.
            size: size of the picture, px.
            margin: margin on each side, as a fraction of the picture.
            inset: covered width at the right, px, for example by a panel.
            foot: covered height at the bottom, px.
            turned: whether the camera is rotated.
            head: covered height at the top, px.
        """
        (left, bottom), (right, top) = box
        free = max(size[0] - inset, size[0] // 3, 1), max(size[1] - head - foot, size[1] // 3, 1)
        free_fraction = 1.0 - 2.0 * margin
        width, height = max(right - left, 1e-9), max(top - bottom, 1e-9)
        if turned:
            width, height = height, width
        scale = min(max(min(free[0] * free_fraction / width, free[1] * free_fraction / height), MIN_SCALE), MAX_SCALE)
        centred = cls(((left + right) / 2.0, (bottom + top) / 2.0), scale, size, turned)
        above = max(min(head, size[1] - free[1]), 0)
        return centred.panned(((free[0] - size[0]) / 2.0, above + (free[1] - size[1]) / 2.0))

    def to_screen(self, points: FloatArray) -> FloatArray:
        """Return points (…, 2), m, as pixels (…, 2) from the upper left corner."""
        middle = np.asarray(self.size) / 2.0
        return self.vectors_to_screen(points - np.asarray(self.centre)) + middle

    def vectors_to_screen(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (…, 2), m, in pixels, (…, 2)."""
        if self.turned:
            return np.asarray(vectors[..., ::-1] * self.scale)
        return np.asarray(vectors * (self.scale, -self.scale))

    def to_world(self, pixel: tuple[float, float]) -> tuple[float, float]:
        """Return the world position of a pixel, m."""
        x, y = self._world_vector((pixel[0] - self.size[0] / 2.0, pixel[1] - self.size[1] / 2.0))
        return self.centre[0] + x, self.centre[1] + y

    def _world_vector(self, pixels: tuple[float, float]) -> tuple[float, float]:
        """Return a vector in pixels as one in the world, m."""
        right, down = pixels[0] / self.scale, pixels[1] / self.scale
        return (down, right) if self.turned else (right, -down)

    @property
    def box(self) -> ViewBox:
        """The visible part of the world, m."""
        half = self.size[0] / 2.0 / self.scale, self.size[1] / 2.0 / self.scale
        if self.turned:
            half = half[1], half[0]
        x, y = self.centre
        return (x - half[0], y - half[1]), (x + half[0], y + half[1])

    def in_sight(
        self, position: FloatArray, radius: FloatArray | float
    ) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
        """Return which circles at (N, 2) m are at least partly visible, (N,); circles at nan are not."""
        (left, bottom), (right, top) = self.box
        x, y = position[:, 0], position[:, 1]
        return np.asarray((x + radius >= left) & (x - radius <= right) & (y + radius >= bottom) & (y - radius <= top))

    def zoomed(self, factor: float, about: tuple[float, float]) -> Self:
        """Return this camera zoomed in by a factor; the world position of the pixel `about` is kept."""
        scale = min(max(self.scale * factor, MIN_SCALE), MAX_SCALE)
        x, y = self.to_world(about)
        closer = replace(self, scale=scale)
        right, up = closer._world_vector((about[0] - self.size[0] / 2.0, about[1] - self.size[1] / 2.0))
        centre = x - right, y - up
        return replace(closer, centre=centre) if all(map(math.isfinite, centre)) else self

    def panned(self, by: tuple[float, float]) -> Self:
        """Return this camera moved so that the picture moves by a vector, px."""
        x, y = self._world_vector(by)
        return replace(self, centre=(self.centre[0] - x, self.centre[1] - y))

    def zoomed_to(self, scale: float) -> Self:
        """Return this camera with another scale, px/m, and the same centre."""
        return replace(self, scale=min(max(scale, MIN_SCALE), MAX_SCALE))

    def eased(self, target: Self, elapsed: float) -> Self:
        """Return this camera eased towards another for `elapsed` s; zooming out is faster than zooming in."""
        factor = target.scale / self.scale
        part = 1.0 - math.exp(-elapsed / (ZOOM_OUT_TIME if factor < 1.0 else ZOOM_IN_TIME))
        move = 1.0 - math.exp(-elapsed / PAN_TIME)
        x, y = (a + (b - a) * move for a, b in zip(self.centre, target.centre, strict=True))
        return replace(self, centre=(x, y), scale=self.scale * factor**part)

    def keeping(self, position: FloatArray, free: tuple[float, float, float, float], elapsed: float) -> Self:
        """Return this camera moved so that a position, m, stays near the middle of the free area, px.

        It does not move while the position is in the inner part, eases up to the outer part, and jumps beyond it.
        """
        moved = self
        for part, fraction in ((INNER_FRACTION, 1.0 - math.exp(-elapsed / PAN_TIME)), (OUTER_FRACTION, 1.0)):
            pixel, by = moved.to_screen(position), []
            for k in range(2):
                middle, half = (free[k] + free[k + 2]) / 2.0, part * (free[k + 2] - free[k]) / 2.0
                by.append(float(min(max(pixel[k], middle - half), middle + half) - pixel[k]) * fraction)
            moved = moved.panned((by[0], by[1])) if any(by) else moved
        return moved

    def resized(self, size: tuple[int, int]) -> Self:
        """Return this camera for a picture of another size, px, with about the same view."""
        before, after = min(self.size), max(min(size), 1)
        return replace(self, size=size, scale=min(max(self.scale * after / max(before, 1), MIN_SCALE), MAX_SCALE))
