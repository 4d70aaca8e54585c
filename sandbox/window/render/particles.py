"""Particles, written directly to the pixels of a surface: by a compiled kernel, or by numpy if numba is missing.

Particles of emitters may fade through several colours over their lifetime.
"""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pygame

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.discs import Emitter
from sandbox.window.camera import Camera
from sandbox.window.render.palette import ColourArray, hex_colour

MANY_PARTICLES = 20_000
"""Number of particles from which the import of the compiled pass pays off."""

MAX_POINT_SIZE = 3
"""px, side of the largest point"""

Packed = npt.NDArray[np.uint32]


class ParticleRenderer:
    """Draws particles as squares of 1 to 3 px."""

    def draw(
        self,
        surface: pygame.Surface,
        camera: Camera,
        position: FloatArray,
        colours: Packed,
        present: BoolArray | None = None,
        side: int = 1,
    ) -> None:
        """Draw particles in order; later ones cover earlier ones.

        Args:
            surface: of any format; 32 bits per pixel is fastest.
            camera: its `to_screen` gives the pixel of each particle.
            position: (N, 2) m; particles at nan or inf are skipped.
            colours: (N,) from `packed_pixels` for this surface.
            present: (N,) whether a particle is drawn; None for all.
            side: px, 1, 2 or 3; the pixel of the particle is the centre of the square, for side 2 its lower right.
        """
        area = surface.get_clip()
        if not area.width or not area.height:
            return
        if camera.turned:  # equivalent: an unrotated camera and rotated positions
            right, up = camera.centre[1], -camera.centre[0]
            position, camera = position[:, ::-1] * (1.0, -1.0), replace(camera, centre=(right, up), turned=False)
        if len(position) >= MANY_PARTICLES and _draw_compiled(surface, camera, position, colours, present, area, side):
            return
        if present is not None:
            position, colours = position[present], colours[present]
        with np.errstate(invalid="ignore", over="ignore"):  # the comparisons reject nan and overflow
            corner = np.floor(camera.to_screen(position)) - side // 2
            near = ((corner > (area.left - side, area.top - side)) & (corner < area.bottomright)).all(axis=1)
        x, y = corner[near].astype(np.intp).T
        three = surface.get_bytesize() == 3
        table = pygame.surfarray.pixels3d(surface) if three else pygame.surfarray.pixels2d(surface)
        tones = _split_channels(colours[near]) if three else colours[near]
        for right, down in np.ndindex(side, side):
            column, row = x + right, y + down
            inside = (column >= area.left) & (column < area.right) & (row >= area.top) & (row < area.bottom)
            table[column[inside], row[inside]] = tones[inside]


def _draw_compiled(
    surface: pygame.Surface,
    camera: Camera,
    position: FloatArray,
    colours: Packed,
    present: BoolArray | None,
    area: pygame.Rect,
    side: int,
) -> bool:
    """Draw all particles in one compiled pass; return whether that was possible."""
    from sandbox.engines.common.kernel import COMPILED

    if not COMPILED or not is_flat(surface):
        return False
    from sandbox.window.render.kernels import rasterise_points

    flat = flat_pixels(surface)
    drawn = np.ones(len(position), np.bool_) if present is None else present
    edges = area.left, area.top, area.right, area.bottom
    middle = camera.size[0] / 2.0, camera.size[1] / 2.0
    stride = surface.get_pitch() // 4
    rasterise_points(flat, stride, edges, position, colours, drawn, camera.centre, camera.scale, middle, side)
    return True


def is_flat(surface: pygame.Surface) -> bool:
    """Return whether the pixels of a surface are contiguous rows of 32-bit integers."""
    return surface.get_bytesize() == 4 and surface.get_pitch() % 4 == 0 and surface.get_parent() is None


def flat_pixels(surface: pygame.Surface) -> Packed:
    """Return a writable view of the pixels of a surface, (width · height,)."""
    return np.frombuffer(memoryview(surface.get_buffer()), np.uint32)  # type: ignore[arg-type]  # it is a buffer, which its stub leaves out


def _split_channels(tones: Packed) -> ColourArray:
    return np.stack((tones >> 16 & 255, tones >> 8 & 255, tones & 255), 1).astype(np.uint8)


def packed_pixels(colours: ColourArray, surface: pygame.Surface) -> Packed:
    """Return colours (N, 3) in the pixel format of a surface, (N,); for 3 bytes per pixel as 0xRRGGBB."""
    channels = colours.astype(np.uint32)
    if surface.get_bytesize() == 3:
        return np.asarray(channels[:, 0] << 16 | channels[:, 1] << 8 | channels[:, 2], np.uint32)
    if surface.get_bytesize() < 4:
        distinct, which = np.unique(colours.reshape(-1, 3), axis=0, return_inverse=True)
        tones = [surface.map_rgb((red, green, blue)) for red, green, blue in distinct.tolist()]
        return np.asarray(tones, np.uint32)[which.reshape(-1)]
    red, green, blue, _ = surface.get_shifts()
    alpha = np.uint32(surface.get_masks()[3] & 0xFFFFFFFF)
    return np.asarray(channels[:, 0] << red | channels[:, 1] << green | channels[:, 2] << blue | alpha, np.uint32)


SHADE_COUNT = 64
"""Number of shades over a lifetime: neighbouring shades look alike, and the number of colours stays small."""


class LifetimeColours:
    """Colours of bodies that fade over their lifetime."""

    def __init__(self, bodies: Bodies) -> None:
        colours = [each.colours if isinstance(each, Emitter) else None for each in bodies.elements]
        fading = [k for k, each in enumerate(colours) if each is not None]
        self.shades: ColourArray = np.concatenate(
            [np.empty((0, 3), np.uint8), *(fade_colours(each) for each in colours if each is not None)]
        )
        """(S, 3), SHADE_COUNT rows for each fading element, in the order of elements"""
        order = np.full(len(colours), -1, np.int64)
        order[fading] = np.arange(len(fading))
        row = order[bodies.element]
        numbers = np.flatnonzero(row >= 0)
        first = int(numbers[0]) if len(numbers) else 0
        consecutive = len(numbers) == 0 or int(numbers[-1]) == first + len(numbers) - 1
        self.indices: slice | IntArray = slice(first, first + len(numbers)) if consecutive else numbers
        """(F,) indices of the fading bodies"""
        self._row_of_body = np.full(len(bodies), -1, np.int64)
        self._row_of_body[numbers] = np.arange(len(numbers))
        self._first: IntArray = row[numbers] * SHADE_COUNT
        self._born, self._rate = bodies.born[numbers], SHADE_COUNT / bodies.lifetime[numbers]

    def __len__(self) -> int:
        return len(self._born)

    def fade(self, tones: Packed, shades: Packed, time: float) -> None:
        """Set the colours of the fading bodies by their age.

        Args:
            tones: (N,) of all bodies, in the pixel format of the surface, changed in place.
            shades: (S,) packed `self.shades`.
            time: s.
        """
        if (
            isinstance(self.indices, slice)
            and len(self) >= MANY_PARTICLES
            and self._compiled(tones[self.indices], shades, time)
        ):
            return
        tones[self.indices] = shades[self._shade(time, slice(None))]

    def _compiled(self, tones: Packed, shades: Packed, time: float) -> bool:
        """Fade in one compiled pass; return whether that was possible."""
        from sandbox.engines.common.kernel import COMPILED

        if COMPILED:
            from sandbox.window.render.kernels import rasterise_faded_points

            rasterise_faded_points(tones, shades, time, self._born, self._rate, self._first, SHADE_COUNT)
        return COMPILED

    def over(self, colours: ColourArray, numbers: IntArray, time: float) -> ColourArray:
        """Return a copy of the colours (K, 3) of bodies, by index (K,), with fading ones set for a time in s."""
        place = self._row_of_body[numbers]
        fade = place >= 0
        colours = colours.copy()
        colours[fade] = self.shades[self._shade(time, place[fade])]
        return colours

    def _shade(self, time: float, rows: slice | IntArray) -> IntArray:
        """Return the indices into the shades of fading bodies at a time in s."""
        age = (time - self._born[rows]) * self._rate[rows]
        return self._first[rows] + np.clip(age, 0.0, SHADE_COUNT - 1.0).astype(np.int64)


def fade_colours(colours: tuple[str, ...]) -> ColourArray:
    """Return the colours interpolated in equal steps from first to last, (SHADE_COUNT, 3)."""
    stops = np.asarray([hex_colour(each) for each in colours], np.float64)
    along = np.linspace(0.0, len(stops) - 1.0, SHADE_COUNT)
    mixed = [np.interp(along, np.arange(len(stops)), stops[:, channel]) for channel in range(3)]
    return np.rint(np.stack(mixed, 1)).astype(np.uint8)
