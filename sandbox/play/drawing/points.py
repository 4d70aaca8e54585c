"""Points: particles written straight into the pixels of a surface, some hundred thousand a picture.

In one compiled pass where numba is there; else by numpy, in pieces that stay in the processor's cache, into arrays
that are kept. Both draw the same.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pygame

from sandbox.arrays import BoolArray, FloatArray
from sandbox.play.camera import Camera
from sandbox.play.drawing.palette import ColourArray

PIECE = 16384
"""Particles at a time: what is worked on, some 500 kB, stays in cache."""

MANY = 20_000
"""Particles from which on a compiled pass is worth its import."""

LARGEST = 3
"""px, the side of the largest point"""

Packed = npt.NDArray[np.uint32]
Index = npt.NDArray[np.intp]
Write = Callable[[Index, Packed], None]
"""Gives pixels, by row·stride + column, their colours."""


class Points:
    """Draws particles as squares of 1 to 3 px; the arrays it works in are kept."""

    def __init__(self) -> None:
        self._x, self._y = np.empty(PIECE), np.empty(PIECE)
        self._index, self._tones = np.empty(PIECE, np.intp), np.empty(PIECE, np.uint32)
        self._inside, self._more = np.empty(PIECE, np.bool_), np.empty(PIECE, np.bool_)

    def draw(
        self,
        surface: pygame.Surface,
        camera: Camera,
        position: FloatArray,
        colours: Packed,
        present: BoolArray | None = None,
        side: int = 1,
    ) -> None:
        """Draw particles; among those of one piece a later one covers an earlier one.

        Args:
            surface: where; with 32 bits a pixel it is fast.
            camera: what it shows; a particle lies in the pixel that `Camera.to_screen` says.
            position: (N, 2) m; those at nan or inf are left out.
            colours: (N,) as `packed` makes them for this surface.
            present: (N,) who is drawn; None for all.
            side: px, 1, 2 or 3; the particle's pixel is the middle, or the lower right of the middle.
        """
        area = surface.get_clip()
        if not area.width or not area.height:
            return
        if camera.turned:  # the same as one that is not, of a world that is
            right, up = camera.centre[1], -camera.centre[0]
            position, camera = position[:, ::-1] * (1.0, -1.0), replace(camera, centre=(right, up), turned=False)
        if len(position) >= MANY and self._compiled(surface, camera, position, colours, present, area, side):
            return
        write, stride = _writer(surface)
        # What is far beyond the picture may overflow, and nan is no place; the comparisons leave both out.
        with np.errstate(invalid="ignore", over="ignore"):
            for first in range(0, len(position), PIECE):
                piece = slice(first, min(first + PIECE, len(position)))
                x, y = self._placed(camera, position[piece], side)
                who = None if present is None else present[piece]
                self._whole(x, y, colours[piece], who, area, side, write, stride)
                if side > 1:
                    _cut(x, y, colours[piece], who, area, side, write, stride)

    def _compiled(
        self,
        surface: pygame.Surface,
        camera: Camera,
        position: FloatArray,
        colours: Packed,
        present: BoolArray | None,
        area: pygame.Rect,
        side: int,
    ) -> bool:
        """Draw all in one compiled pass; return whether that could be done."""
        from sandbox.engines.common.kernel import COMPILED

        if not COMPILED or not is_flat(surface):
            return False
        from sandbox.play.drawing.scatter import scatter

        flat = flat_pixels(surface)
        there = np.ones(len(position), np.bool_) if present is None else present
        edges = area.left, area.top, area.right, area.bottom
        middle = camera.size[0] / 2.0, camera.size[1] / 2.0
        stride = surface.get_pitch() // 4
        scatter(flat, stride, edges, position, colours, there, camera.centre, camera.scale, middle, side)
        return True

    def _placed(self, camera: Camera, position: FloatArray, side: int) -> tuple[FloatArray, FloatArray]:
        """Return column and row of the upper left pixel of each, as floats: some are too far for whole numbers."""
        x, y = self._x[: len(position)], self._y[: len(position)]
        for axis, (out, sign) in enumerate(((x, 1.0), (y, -1.0))):  # as Camera.to_screen, in its order
            np.subtract(position[:, axis], camera.centre[axis], out=out)
            out *= sign * camera.scale
            out += camera.size[axis] / 2.0
            np.floor(out, out=out)
            if side > 1:
                out -= side // 2
        return x, y

    def _whole(
        self,
        x: FloatArray,
        y: FloatArray,
        colours: Packed,
        present: BoolArray | None,
        area: pygame.Rect,
        side: int,
        write: Write,
        stride: int,
    ) -> None:
        """Draw those that lie wholly in an area."""
        inside, more = self._inside[: len(x)], self._more[: len(x)]
        np.greater_equal(x, area.left, out=inside)
        inside &= np.less_equal(x, area.right - side, out=more)
        inside &= np.greater_equal(y, area.top, out=more)
        inside &= np.less_equal(y, area.bottom - side, out=more)
        if present is not None:
            inside &= present
        place = np.multiply(y, stride, out=None if side > 1 else y)
        place += x
        if inside.all():
            index = self._index[: len(x)]
        else:
            kept = np.flatnonzero(inside)
            index = self._index[: len(kept)]
            place, colours = place[kept], np.take(colours, kept, out=self._tones[: len(kept)], mode="clip")
        np.copyto(index, place, casting="unsafe")
        for down in range(side):
            for right in range(side):
                offset = down * stride + right
                write(index + offset if offset else index, colours)


def _cut(
    x: FloatArray,
    y: FloatArray,
    colours: Packed,
    present: BoolArray | None,
    area: pygame.Rect,
    side: int,
    write: Write,
    stride: int,
) -> None:
    """Draw those that an area's edge cuts: few."""
    reached = (x > area.left - side) & (x < area.right) & (y > area.top - side) & (y < area.bottom)
    whole = (x >= area.left) & (x <= area.right - side) & (y >= area.top) & (y <= area.bottom - side)
    cut = np.flatnonzero(reached & ~whole if present is None else reached & ~whole & present)
    if not len(cut):
        return
    across, along = x[cut].astype(np.intp), y[cut].astype(np.intp)
    for down in range(side):
        for right in range(side):
            column, row = across + right, along + down
            inside = (column >= area.left) & (column < area.right) & (row >= area.top) & (row < area.bottom)
            write((row * stride + column)[inside], colours[cut][inside])


def _writer(surface: pygame.Surface) -> tuple[Write, int]:
    """Return what writes into a surface's pixels, and how many of them its rows count, with what pads them."""
    if is_flat(surface):
        return flat_pixels(surface).__setitem__, surface.get_pitch() // 4
    width, three = surface.get_width(), surface.get_bytesize() == 3
    table = pygame.surfarray.pixels3d(surface) if three else pygame.surfarray.pixels2d(surface)

    def write(index: Index, tones: Packed) -> None:
        table[index % width, index // width] = _apart(tones) if three else tones

    return write, width


def is_flat(surface: pygame.Surface) -> bool:
    """Tell whether a surface's pixels are whole numbers of 32 bits, in one row after the other."""
    return surface.get_bytesize() == 4 and surface.get_pitch() % 4 == 0 and surface.get_parent() is None


def flat_pixels(surface: pygame.Surface) -> Packed:
    """Return a surface's pixels, to be written to."""
    return np.frombuffer(memoryview(surface.get_buffer()), np.uint32)  # type: ignore[arg-type]  # it is a buffer, which its stub leaves out


def _apart(tones: Packed) -> ColourArray:
    return np.stack((tones >> 16 & 255, tones >> 8 & 255, tones & 255), 1).astype(np.uint8)


def packed(colours: ColourArray, surface: pygame.Surface) -> Packed:
    """Return colours (N, 3) as a surface holds them, (N,); for one of 3 bytes a pixel as 0xRRGGBB."""
    wide = colours.astype(np.uint32)
    if surface.get_bytesize() == 3:
        return np.asarray(wide[:, 0] << 16 | wide[:, 1] << 8 | wide[:, 2], np.uint32)
    if surface.get_bytesize() < 4:
        distinct, which = np.unique(colours.reshape(-1, 3), axis=0, return_inverse=True)
        tones = [surface.map_rgb((red, green, blue)) for red, green, blue in distinct.tolist()]
        return np.asarray(tones, np.uint32)[which.reshape(-1)]
    red, green, blue, _ = surface.get_shifts()
    alpha = np.uint32(surface.get_masks()[3] & 0xFFFFFFFF)
    return np.asarray(wide[:, 0] << red | wide[:, 1] << green | wide[:, 2] << blue | alpha, np.uint32)
