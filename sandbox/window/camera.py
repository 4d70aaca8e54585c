"""Camera: which part of the world a picture shows. It alone knows that pixels count downwards."""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from sandbox.arrays import FloatArray

CLOSEST, FARTHEST = 1e12, 1e-14
"""px/m: what double precision can still tell apart, and the widest view of the largest scene"""

PAN, ZOOM_OUT, ZOOM_IN = 0.15, 0.1, 0.8
"""s in which a camera that follows something has come most of the way"""
INNER, OUTER = 0.4, 0.8
"""Parts of what is free in which the followed body moves in the picture, and beyond which it never is."""

Box = tuple[tuple[float, float], tuple[float, float]]
"""Lower-left and upper-right corner, m."""


@dataclass(frozen=True)
class Camera:
    """A view of the world: y up in metres there, y down in pixels here. A value: moving it makes another.

    One that is turned, as for tables that are longer than wide, has y to the right and x downwards.
    """

    centre: tuple[float, float]
    """what is shown in the middle, m"""
    scale: float
    """px/m"""
    size: tuple[int, int]
    """of the picture, px"""
    turned: bool = False
    """by a quarter, clockwise"""

    @classmethod
    def fitting(
        cls,
        box: Box,
        size: tuple[int, int],
        margin: float = 0.06,
        inset: int = 0,
        foot: int = 0,
        turned: bool = False,
        head: int = 0,
    ) -> Self:
        """Return the camera that shows a box whole.

        Args:
            box: what to show, m; its sides may be 0.
            size: of the picture, px.
            margin: share of the picture left free on each side.
            inset: px at the right that something else covers.
            foot: px at the bottom that something else covers.
            turned: whether the picture is.
            head: px at the top that something else covers.
        """
        (left, bottom), (right, top) = box
        free = max(size[0] - inset, size[0] // 3, 1), max(size[1] - head - foot, size[1] // 3, 1)
        room = 1.0 - 2.0 * margin
        width, height = max(right - left, 1e-9), max(top - bottom, 1e-9)
        if turned:
            width, height = height, width
        scale = min(max(min(free[0] * room / width, free[1] * room / height), FARTHEST), CLOSEST)
        whole = cls(((left + right) / 2.0, (bottom + top) / 2.0), scale, size, turned)
        above = max(min(head, size[1] - free[1]), 0)
        return whole.panned(((free[0] - size[0]) / 2.0, above + (free[1] - size[1]) / 2.0))

    def to_screen(self, points: FloatArray) -> FloatArray:
        """Return where points (…, 2), m, lie in the picture, (…, 2) px from its upper left corner."""
        middle = np.asarray(self.size) / 2.0
        return self.ways(points - np.asarray(self.centre)) + middle

    def ways(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (…, 2), m, as they are in the picture, (…, 2) px."""
        if self.turned:
            return np.asarray(vectors[..., ::-1] * self.scale)
        return np.asarray(vectors * (self.scale, -self.scale))

    def to_world(self, pixel: tuple[float, float]) -> tuple[float, float]:
        """Return the place that a pixel shows, m."""
        x, y = self._way((pixel[0] - self.size[0] / 2.0, pixel[1] - self.size[1] / 2.0))
        return self.centre[0] + x, self.centre[1] + y

    def _way(self, pixels: tuple[float, float]) -> tuple[float, float]:
        """Return a vector of the picture, px, as it is in the world, m."""
        right, down = pixels[0] / self.scale, pixels[1] / self.scale
        return (down, right) if self.turned else (right, -down)

    @property
    def box(self) -> Box:
        """What is in sight, m."""
        half = self.size[0] / 2.0 / self.scale, self.size[1] / 2.0 / self.scale
        if self.turned:
            half = half[1], half[0]
        x, y = self.centre
        return (x - half[0], y - half[1]), (x + half[0], y + half[1])

    def in_sight(
        self, position: FloatArray, radius: FloatArray | float
    ) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
        """Tell which circles, at (N, 2) m, are at least partly in the picture, (N,). Those at nan are not."""
        (left, bottom), (right, top) = self.box
        x, y = position[:, 0], position[:, 1]
        return np.asarray((x + radius >= left) & (x - radius <= right) & (y + radius >= bottom) & (y - radius <= top))

    def zoomed(self, factor: float, about: tuple[float, float]) -> Self:
        """Return this camera closer by a factor; the place under a pixel stays there."""
        scale = min(max(self.scale * factor, FARTHEST), CLOSEST)
        x, y = self.to_world(about)
        closer = replace(self, scale=scale)
        right, up = closer._way((about[0] - self.size[0] / 2.0, about[1] - self.size[1] / 2.0))
        centre = x - right, y - up
        return replace(closer, centre=centre) if all(map(math.isfinite, centre)) else self

    def panned(self, by: tuple[float, float]) -> Self:
        """Return this camera moved so that what is shown moves by so many pixels."""
        x, y = self._way(by)
        return replace(self, centre=(self.centre[0] - x, self.centre[1] - y))

    def zoomed_to(self, scale: float) -> Self:
        """Return this camera with another scale, px/m, about the middle of the picture."""
        return replace(self, scale=min(max(scale, FARTHEST), CLOSEST))

    def eased(self, target: Self, elapsed: float) -> Self:
        """Return this camera on its way to another: soon where that is farther away, slowly where it is closer."""
        factor = target.scale / self.scale
        part = 1.0 - math.exp(-elapsed / (ZOOM_OUT if factor < 1.0 else ZOOM_IN))
        move = 1.0 - math.exp(-elapsed / PAN)
        x, y = (a + (b - a) * move for a, b in zip(self.centre, target.centre, strict=True))
        return replace(self, centre=(x, y), scale=self.scale * factor**part)

    def keeping(self, place: FloatArray, free: tuple[float, float, float, float], elapsed: float) -> Self:
        """Return this camera moved so that a place, m, stays near the middle of what is free, px.

        In the inner part of it the camera rests; from there to the outer part it moves softly, and beyond at once.
        """
        moved = self
        for part, share in ((INNER, 1.0 - math.exp(-elapsed / PAN)), (OUTER, 1.0)):
            pixel, by = moved.to_screen(place), []
            for k in range(2):
                middle, half = (free[k] + free[k + 2]) / 2.0, part * (free[k + 2] - free[k]) / 2.0
                by.append(float(min(max(pixel[k], middle - half), middle + half) - pixel[k]) * share)
            moved = moved.panned((by[0], by[1])) if any(by) else moved
        return moved

    def resized(self, size: tuple[int, int]) -> Self:
        """Return this camera for a picture of another size, showing about the same."""
        before, after = min(self.size), max(min(size), 1)
        return replace(self, size=size, scale=min(max(self.scale * after / max(before, 1), FARTHEST), CLOSEST))
