"""GIF recorder: films that need no player. Each picture is written immediately, so memory does not grow with length.

A gif has at most 256 colours per picture. A palette is used until its error for a picture is too large. Only pixels
that changed are written, the others remain as drawn; so a pixel only changes its colour if its source does. Pillow
writes header and frames.

Source: CompuServe, "Graphics Interchange Format, Version 89a", 1990.
"""

import math
from contextlib import suppress
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pygame
from PIL import GifImagePlugin, Image

from sandbox.window.capture.image_files import AtomicFile, PictureError, Pixels, Size, rgb_pixels, unwritable_reason

COMMON_COLOURS = 96
"""number of palette entries for the most frequent colours, which are exact; the others come from a median cut"""
MAX_ERROR = 20.0
"""of 255: distance of a colour from its palette entry up to which it is acceptable"""
MAX_BAD_FRACTION = 3e-4
"""fraction of a picture's pixels with an unacceptable colour above which the palette is renewed"""
MIN_DURATION = 0.02
"""s: viewers show a picture with a shorter duration for 0.1 s"""
TRANSPARENT = 255
"""palette index of pixels that did not change; colours use the other indices"""
TRAILER = b";"
"""Last byte of a gif"""

Indices = npt.NDArray[np.uint8]
"""(H, W) palette entries"""
Mask = npt.NDArray[np.bool_]


class PaletteQuantiser:
    """Maps pictures to a palette, which is renewed when its error for a picture is too large.

    Args:
        max_colours: number of colours of the palette, at most 256.
    """

    def __init__(self, max_colours: int) -> None:
        self._max_colours = max_colours
        self.table: Pixels = np.zeros((256, 3), np.uint8)
        """palette, (256, 3) sRGB; meaningless before the first picture"""
        self._lookup: Image.Image | None = None
        self._previous: Pixels | None = None
        self._tolerated = MAX_BAD_FRACTION

    def quantise(self, picture: Pixels, part: Pixels) -> Indices:
        """Return the palette entries of a part of a picture; the palette is renewed for the picture if necessary."""
        count = picture.shape[0] * picture.shape[1]
        if self._lookup is not None:
            index, bad_count = self._nearest(self._lookup, part)
            if bad_count <= self._tolerated * count:
                return index
        index, bad_count = self._nearest(self._renew(picture), part)
        # With more colours than a palette holds, each picture would renew it, at the cost of a table and a median cut.
        self._tolerated = max(MAX_BAD_FRACTION, 2.0 * bad_count / count)
        return index

    def _nearest(self, lookup: Image.Image, pixels: Pixels) -> tuple[Indices, int]:
        """Return the nearest palette entries, and the number of pixels with an unacceptable colour."""
        image = Image.fromarray(np.ascontiguousarray(pixels))
        index = np.asarray(image.quantize(palette=lookup, dither=Image.Dither.NONE))
        error = self.table[index].astype(np.int32) - pixels
        return index, int((np.square(error).sum(axis=2) > MAX_ERROR**2).sum())

    def _renew(self, picture: Pixels) -> Image.Image:
        """Choose a palette for a picture and for the picture of the previous palette."""
        both = picture if self._previous is None else np.concatenate((picture, self._previous))
        self._previous = picture
        self.table = choose_palette(both, self._max_colours)
        self._lookup = Image.new("P", (1, 1))
        # Pillow looks up the lowest colour of a cell of 4 x 4 x 4 colours for all of them.
        self._lookup.putpalette((self.table[: self._max_colours] & 0xFC).tobytes())
        return self._lookup


def choose_palette(picture: Pixels, max_colours: int) -> Pixels:
    """Return a palette (256, 3) for a picture (H, W, 3); entries beyond `max_colours` repeat the first.

    Colours are counted in cells of 4 x 4 x 4. The commonest are kept. The rest is chosen by a median cut in which a
    cell counts by the logarithm of its pixels: a drawing has large flat areas, and small accents that must not vanish.
    """
    colours = picture.reshape(-1, 3)
    red, green, blue = (colours.astype(np.int32) >> 2).T
    _, first, count = np.unique(red << 12 | green << 6 | blue, return_index=True, return_counts=True)
    order = np.argsort(-count, kind="stable")
    found, count = colours[first[order]], count[order]
    if len(found) > max_colours:
        weight = 1 + np.log2(1.0 + count[COMMON_COLOURS:]).astype(np.int64)
        row = np.repeat(found[COMMON_COLOURS:], weight, axis=0)
        cut = Image.fromarray(row[None]).quantize(max_colours - COMMON_COLOURS, Image.Quantize.MEDIANCUT)
        rest = np.asarray(cut.getpalette(), np.uint8).reshape(-1, 3)[: max_colours - COMMON_COLOURS]
        found = np.concatenate((found[:COMMON_COLOURS], rest))
    return np.concatenate((found, np.repeat(found[:1], 256 - len(found), axis=0)))


class GifRecorder:
    """Writes a gif; durations are whole 0.01 s, and their sum is the real time.

    Pictures that follow within `MIN_DURATION` are left out.

    Args:
        outfile: the file.
        size: px.
        max_frames: maximum number of frames of the gif.

    Raises:
        PictureError: the file cannot be written.
    """

    def __init__(self, outfile: AtomicFile, size: Size, max_frames: int) -> None:
        self._outfile = outfile
        self._size = size
        self._max_frames = max_frames
        self._quantiser = PaletteQuantiser(TRANSPARENT)
        self._first_table: bytes | None = None
        self._cells: Pixels | None = None
        self._pending: tuple[Image.Image, tuple[int, int]] | None = None
        self._pending_seconds = 0.0
        self._seconds = 0.0
        self._hundredths = 0
        self._count = 0
        try:
            self._stream = outfile.temporary.open("xb")
        except OSError as error:
            raise unwritable_reason(outfile.temporary.parent, error) from None

    def add(self, surface: pygame.Surface, seconds: float) -> None:
        """Add a picture and its duration, s.

        Raises:
            PictureError: the gif has `max_frames`, or the file cannot be written.
        """
        # A millionth of slack: 1/50 s is not exact in binary.
        if self._pending is not None and self._pending_seconds < MIN_DURATION * (1 - 1e-6):
            self._pending_seconds += seconds
            return
        if self._count >= self._max_frames:
            raise PictureError(
                f"a gif holds at most {self._max_frames:,} frames; record a shorter one, or an mp4, which may be longer"
            )
        self._flush()
        self._pending, self._pending_seconds = self._frame(rgb_pixels(surface, self._size)), seconds
        self._count += 1

    def close(self) -> Path:
        """Finish the file and return its path.

        Raises:
            PictureError: the file cannot be written, or no picture was added. Nothing is left then.
        """
        try:
            if not self._count:
                raise PictureError("a recording needs at least one frame")
            self._flush()
            self._write(TRAILER)
            try:
                self._stream.close()
            except OSError as error:
                raise unwritable_reason(self._outfile.temporary.parent, error) from None
            return self._outfile.place()
        finally:
            self.cancel()

    def cancel(self) -> None:
        """Close and remove the temporary file."""
        with suppress(OSError):  # a full disk; the file is removed anyway
            self._stream.close()
        self._outfile.discard()

    def _frame(self, picture: Pixels) -> tuple[Image.Image, tuple[int, int]]:
        """Return the rectangle of a picture that changed, as an image with a palette, and its upper left corner, px."""
        cells = np.asarray(picture >> 2, np.uint8)  # resolution of the palette
        changed = np.ones(picture.shape[:2], np.bool_) if self._cells is None else (cells != self._cells).any(axis=2)
        self._cells = cells
        left, top, right, bottom = _changed_box(changed)
        index = self._quantiser.quantise(picture, picture[top:bottom, left:right])
        image = Image.fromarray(np.where(changed[top:bottom, left:right], index, np.uint8(TRANSPARENT)))
        image.putpalette(self._quantiser.table.tobytes())
        return image, (left, top)

    def _flush(self) -> None:
        """Write the pending frame, whose duration is known once the next one is added."""
        if self._pending is None:
            return
        (image, corner), self._pending = self._pending, None
        self._seconds += self._pending_seconds
        until = math.floor(self._seconds * 100.0 + 0.5)
        shown = min(max(until - self._hundredths, 1), 0xFFFF)
        self._hundredths += shown
        table = bytes(image.getpalette() or ())
        if self._first_table is None:  # the first frame covers the whole picture, and its table is the global one
            self._first_table = table
            self._write(*GifImagePlugin.getheader(image, info={"loop": 0})[0])
        self._write(
            *GifImagePlugin.getdata(
                image,
                corner,
                duration=10 * shown,  # ms
                transparency=TRANSPARENT,
                disposal=1,  # the next frame is drawn over this one
                include_color_table=table != self._first_table,
            )
        )

    def _write(self, *blocks: bytes) -> None:
        try:
            self._stream.write(b"".join(blocks))
        except OSError as error:
            raise unwritable_reason(self._outfile.temporary.parent, error) from None


def _changed_box(changed: Mask) -> tuple[int, int, int, int]:
    """Return left, top, right, bottom of the changed pixels; one pixel if none has changed."""
    rows, columns = np.flatnonzero(changed.any(axis=1)), np.flatnonzero(changed.any(axis=0))
    if not len(rows):
        return 0, 0, 1, 1
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1
