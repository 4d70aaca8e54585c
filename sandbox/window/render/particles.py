"""Points: particles written straight into the pixels of a surface, some hundred thousand a picture.

In one compiled pass where numba is there; else by numpy, in pieces that stay in the processor's cache, into arrays
that are kept. Both draw the same.

Ageing: particles that fade from colour to colour over their lives.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pygame

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.discs import Emitter
from sandbox.window.camera import Camera
from sandbox.window.render.palette import ColourArray, hex_colour

PIECE = 16384
"""Particles at a time: what is worked on, some 500 kB, stays in cache."""

MANY_PARTICLES = 20_000
"""Particles from which on a compiled pass is worth its import."""

MAX_POINT_SIZE = 3
"""px, the side of the largest point"""

Packed = npt.NDArray[np.uint32]
Index = npt.NDArray[np.intp]
Write = Callable[[Index, Packed], None]
"""Gives pixels, by row·stride + column, their colours."""


class ParticleRenderer:
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
        if len(position) >= MANY_PARTICLES and self._compiled(surface, camera, position, colours, present, area, side):
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
        from sandbox.window.render.kernels import rasterise_points

        flat = flat_pixels(surface)
        there = np.ones(len(position), np.bool_) if present is None else present
        edges = area.left, area.top, area.right, area.bottom
        middle = camera.size[0] / 2.0, camera.size[1] / 2.0
        stride = surface.get_pitch() // 4
        rasterise_points(flat, stride, edges, position, colours, there, camera.centre, camera.scale, middle, side)
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


def packed_pixels(colours: ColourArray, surface: pygame.Surface) -> Packed:
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


SHADES = 64
"""Steps of a life that are told apart: one and the next look alike, and a crowd has few colours at once."""


class LifetimeColours:
    """Those of some bodies that fade, and how."""

    def __init__(self, bodies: Bodies) -> None:
        colours = [each.colours if isinstance(each, Emitter) else None for each in bodies.elements]
        fading = [k for k, each in enumerate(colours) if each is not None]
        self.shades: ColourArray = np.concatenate(
            [np.empty((0, 3), np.uint8), *(fade_colours(each) for each in colours if each is not None)]
        )
        """(S, 3), SHADES of each element that fades, one element after the other"""
        order = np.full(len(colours), -1, np.int64)
        order[fading] = np.arange(len(fading))
        row = order[bodies.element]
        numbers = np.flatnonzero(row >= 0)
        first = int(numbers[0]) if len(numbers) else 0
        consecutive = len(numbers) == 0 or int(numbers[-1]) == first + len(numbers) - 1
        self.who: slice | IntArray = slice(first, first + len(numbers)) if consecutive else numbers
        """(F,) numbers of those that fade"""
        self._place = np.full(len(bodies), -1, np.int64)
        self._place[numbers] = np.arange(len(numbers))
        self._first: IntArray = row[numbers] * SHADES
        self._born, self._rate = bodies.born[numbers], SHADES / bodies.lifetime[numbers]

    def __len__(self) -> int:
        return len(self._born)

    def fade(self, tones: Packed, shades: Packed, time: float) -> None:
        """Give those of all bodies (N,) who fade the tones of their ages.

        Args:
            tones: (N,) as a surface holds them, changed in place.
            shades: (S,) the shades, as the surface holds them.
            time: s.
        """
        if (
            isinstance(self.who, slice)
            and len(self) >= MANY_PARTICLES
            and self._compiled(tones[self.who], shades, time)
        ):
            return
        tones[self.who] = shades[self._shade(time, slice(None))]

    def _compiled(self, tones: Packed, shades: Packed, time: float) -> bool:
        """Fade in one compiled pass; return whether that could be done."""
        from sandbox.engines.common.kernel import COMPILED

        if COMPILED:
            from sandbox.window.render.kernels import rasterise_faded_points

            rasterise_faded_points(tones, shades, time, self._born, self._rate, self._first, SHADES)
        return COMPILED

    def over(self, colours: ColourArray, numbers: IntArray, time: float) -> ColourArray:
        """Return the colours of some bodies (K, 3), by their numbers (K,), those who fade as at a time, s."""
        place = self._place[numbers]
        fade = place >= 0
        colours = colours.copy()
        colours[fade] = self.shades[self._shade(time, place[fade])]
        return colours

    def _shade(self, time: float, rows: slice | IntArray) -> IntArray:
        """Return which of the shades some of those who fade have."""
        age = (time - self._born[rows]) * self._rate[rows]
        return self._first[rows] + np.clip(age, 0.0, SHADES - 1.0).astype(np.int64)


def fade_colours(colours: tuple[str, ...]) -> ColourArray:
    """Return colours from the first to the last in equal steps, (SHADES, 3)."""
    stops = np.asarray([hex_colour(each) for each in colours], np.float64)
    along = np.linspace(0.0, len(stops) - 1.0, SHADES)
    mixed = [np.interp(along, np.arange(len(stops)), stops[:, channel]) for channel in range(3)]
    return np.rint(np.stack(mixed, 1)).astype(np.uint8)
