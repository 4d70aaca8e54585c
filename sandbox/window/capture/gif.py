"""Gif: films that need no player. Pictures go to the file as they come, so a long one takes no more memory.

A gif has at most 256 colours a picture. One palette serves until pictures come that it shows badly; a colour
never changes in between, so nothing flickers. Only what has changed since the last picture is written.

Source: CompuServe, "Graphics Interchange Format, Version 89a", 1990.

Colours: reducing pictures to a palette, the same colour always to the same entry.

Colours are told apart by the upper six bits of each channel, a cell. A palette has the commonest cells' colours as
they are, and the rest from a median cut in which rare colours count for more than their share: the flat areas of a
drawing are few and large, its accents small.
"""

import math
import struct
from contextlib import suppress
from io import BytesIO
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pygame
from PIL import Image

from sandbox.window.capture.image_files import AtomicFile, CaptureError, Size, rgb_pixels, unwritable_reason

CELLS = 1 << 18
AS_THEY_ARE = 96
"""Entries of the commonest colours."""
FAR = 20.0
"""of 255: a colour so far from its entry is shown badly"""
MANY = 3e-4
"""Share of a picture's pixels that may be shown badly before the palette is renewed."""
FADING = 0.5
"""What colours of before count when a palette is renewed."""
AT_ONCE = 4096
"""Cells whose distances to all entries are worked on at once: 12 MB."""

Index = npt.NDArray[np.uint8]
Cells = npt.NDArray[np.int32]


class PaletteQuantiser:
    """A palette that lasts, and is renewed where it must be.

    Args:
        most: entries it may have, of at most 256.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._palette = np.zeros((0, 3))
        self._entry = np.full(CELLS, -1, np.int16)
        self._error = np.zeros(CELLS)
        self._colour = np.zeros((CELLS, 3))
        self._known = np.zeros(CELLS, np.bool_)
        self._weight = np.zeros(CELLS)
        self._tolerated = MANY

    @property
    def table(self) -> bytes:
        """The palette as 256 times red, green, blue."""
        entries = np.zeros((256, 3), np.uint8)
        entries[: len(self._palette)] = np.round(self._palette)
        return entries.tobytes()

    def reduce(self, picture: npt.NDArray[np.uint8]) -> tuple[Cells, Index, bool]:
        """Reduce a picture (H, W, 3).

        Returns:
            Each pixel's cell (H, W), each pixel's entry (H, W), and whether the palette was renewed for it.
        """
        red, green, blue = (picture[..., k].astype(np.int32) >> 2 for k in range(3))
        cells = np.asarray(red << 12 | green << 6 | blue)
        counts = np.bincount(cells.ravel(), minlength=CELLS)
        used = np.flatnonzero(counts)
        if not self._known[used].all():
            self._learn(cells, picture, counts, used)
        self._weight[used] += counts[used]
        self._assign(used)
        bad = self._bad(used, counts)
        renewed = not len(self._palette) or bad > self._tolerated
        if renewed:
            self._renew()
            self._assign(used)
            # More colours than a palette holds: renewing it for every picture would make them flicker.
            self._tolerated = max(MANY, 2.0 * self._bad(used, counts))
        return cells, self._entry[cells].astype(np.uint8), renewed

    def _learn(
        self,
        cells: Cells,
        picture: npt.NDArray[np.uint8],
        counts: npt.NDArray[np.int64],
        used: npt.NDArray[np.int64],
    ) -> None:
        """Note the mean colour of each cell that is met for the first time."""
        new = used[~self._known[used]]
        for k in range(3):
            total = np.bincount(cells.ravel(), weights=picture[..., k].ravel(), minlength=CELLS)
            self._colour[new, k] = total[new] / counts[new]
        self._known[new] = True

    def _assign(self, used: npt.NDArray[np.int64]) -> None:
        """Give each cell that has none its nearest entry."""
        if not len(self._palette):
            return
        new = used[self._entry[used] < 0]
        for begin in range(0, len(new), AT_ONCE):
            some = new[begin : begin + AT_ONCE]
            away = np.square(self._colour[some, None] - self._palette).sum(axis=2)
            nearest = away.argmin(axis=1)
            self._entry[some] = nearest
            self._error[some] = np.sqrt(away[np.arange(len(some)), nearest])

    def _bad(self, used: npt.NDArray[np.int64], counts: npt.NDArray[np.int64]) -> float:
        """Return the share of pixels that are shown badly."""
        return float(counts[used][self._error[used] > FAR].sum() / counts.sum())

    def _renew(self) -> None:
        """Choose a palette for all colours seen, the recent ones above all."""
        seen = np.flatnonzero(self._weight > 0.5)
        seen = seen[np.argsort(-self._weight[seen], kind="stable")]
        first, rest = seen[: self._most], seen[self._most :]
        if len(rest):
            first, rest = seen[:AS_THEY_ARE], seen[AS_THEY_ARE:]
        palette = np.round(self._colour[first])
        if len(rest):
            palette = np.concatenate((palette, self._cut(rest, self._most - AS_THEY_ARE)))
        self._palette = palette
        self._entry[:] = -1
        self._error[:] = 0.0
        self._weight *= FADING

    def _cut(self, cells: npt.NDArray[np.int64], most: int) -> npt.NDArray[np.float64]:
        """Return at most so many colours (K, 3) by median cut, each cell counting by the logarithm of its pixels."""
        times = 1 + np.log2(1.0 + self._weight[cells]).astype(np.int64)
        row = np.repeat(np.round(self._colour[cells]).astype(np.uint8), times, axis=0)
        image = Image.fromarray(row[None]).quantize(most, Image.Quantize.MEDIANCUT)
        return np.asarray(image.getpalette()[: 3 * most], np.float64).reshape(-1, 3)  # type: ignore[index]  # it has one


Indices = npt.NDArray[np.uint8]

TRANSPARENT = 255
"""The index of what stays as it was; colours have the others."""
SHORTEST = 0.02
"""s, that viewers show a picture; they show a shorter one for 0.1 s"""
LOOP = b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00"
"""Play it again, for ever."""
END = b"\x3b"


class GifRecorder:
    """A film of pictures that are shown as long as they were; in whole 0.01 s, whose sum is the real time.

    Pictures that come faster than `SHORTEST` are left out.

    Args:
        outfile: where it goes.
        size: px.
        most: pictures that it may hold.

    Raises:
        CaptureError: the file cannot be written.
    """

    def __init__(self, outfile: AtomicFile, size: Size, most: int) -> None:
        self._outfile = outfile
        self._size = size
        self._most = most
        self._colours = PaletteQuantiser(TRANSPARENT)
        self._first_table = b""
        self._shown: npt.NDArray[np.int32] | None = None
        self._pending: bytes | None = None
        self._pending_seconds = 0.0
        self._seconds = 0.0
        self._hundredths = 0
        self._count = 0
        try:
            self._stream = outfile.temporary.open("xb")
        except OSError as error:
            raise unwritable_reason(outfile.temporary.parent, error) from None

    def add(self, surface: pygame.Surface, seconds: float) -> None:
        """Add a picture that is shown for so long.

        Raises:
            CaptureError: there are as many as one gif may hold, or the disk is full.
        """
        # A millionth of slack: 1/50 s is not exact in binary.
        if self._pending is not None and self._pending_seconds < SHORTEST * (1 - 1e-6):
            self._pending_seconds += seconds
            return
        if self._count >= self._most:
            raise CaptureError(
                f"a gif holds at most {self._most:,} frames; record a shorter one, or an mp4, which may be longer"
            )
        self._flush()
        self._pending, self._pending_seconds = self._encoded(rgb_pixels(surface, self._size)), seconds
        self._count += 1

    def close(self) -> Path:
        """Finish the file and return its path.

        Raises:
            CaptureError: it cannot be written, or not a single picture was added. Nothing is left then.
        """
        try:
            if not self._count:
                raise CaptureError("a recording needs at least one frame")
            self._flush()
            try:
                self._stream.write(END)
                self._stream.close()
            except OSError as error:
                raise unwritable_reason(self._outfile.temporary.parent, error) from None
            return self._outfile.place()
        finally:
            self.cancel()

    def cancel(self) -> None:
        """Leave nothing behind."""
        with suppress(OSError):  # a full disk; the file goes anyway
            self._stream.close()
        self._outfile.discard()

    def _flush(self) -> None:
        """Write the picture that waited to know how long it is shown."""
        if self._pending is None:
            return
        self._seconds += self._pending_seconds
        until = math.floor(self._seconds * 100.0 + 0.5)
        shown = min(max(until - self._hundredths, 1), 0xFFFF)
        self._hundredths += shown
        # Disposal 1: it stays, and the next is drawn over it.
        control = struct.pack("<BBBBHBB", 0x21, 0xF9, 4, 1 << 2 | 1, shown, TRANSPARENT, 0)
        try:
            self._stream.write(control + self._pending)
        except OSError as error:
            raise unwritable_reason(self._outfile.temporary.parent, error) from None
        finally:
            self._pending = None

    def _encoded(self, picture: npt.NDArray[np.uint8]) -> bytes:
        """Return a picture's block: its place, its colours where they are not the first ones, its pixels."""
        cells, index, renewed = self._colours.reduce(picture)
        left, top = 0, 0
        if self._shown is not None and not renewed:
            changed = cells != self._shown
            left, top, right, bottom = _box(changed)
            kept = changed[top:bottom, left:right]
            index = np.where(kept, index[top:bottom, left:right], np.uint8(TRANSPARENT))
        self._shown = cells
        table = b""
        if not self._first_table:
            self._first_table = self._colours.table
            self._write_header()
        elif self._colours.table != self._first_table:
            table = self._colours.table
        height, width = index.shape
        place = struct.pack("<BHHHHB", 0x2C, left, top, width, height, 0x87 if table else 0)
        return place + table + _compressed(index)

    def _write_header(self) -> None:
        screen = struct.pack("<HHBBB", *self._size, 0xF7, 0, 0)
        try:
            self._stream.write(b"GIF89a" + screen + self._first_table + LOOP)
        except OSError as error:
            raise unwritable_reason(self._outfile.temporary.parent, error) from None


def _box(changed: npt.NDArray[np.bool_]) -> tuple[int, int, int, int]:
    """Return left, top, right, bottom of what has changed; one pixel where nothing has."""
    rows, columns = np.flatnonzero(changed.any(axis=1)), np.flatnonzero(changed.any(axis=0))
    if not len(rows):
        return 0, 0, 1, 1
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1


def _compressed(index: Indices) -> bytes:
    """Return indices as a gif stores them: LZW, in blocks. Pillow does it, as a gif of its own."""
    stream = BytesIO()
    # As a grey picture, the indices are what it is made of, and no palette is in the way.
    Image.fromarray(np.ascontiguousarray(index)).save(stream, "GIF", optimize=False, interlace=0)
    data = stream.getvalue()
    at = 13 + _table_length(data[10])
    while data[at] == 0x21:  # extensions: a label, then blocks of stated lengths up to an empty one
        at += 2
        while data[at]:
            at += data[at] + 1
        at += 1
    at += 10 + _table_length(data[at + 9])
    return data[at : data.rindex(END)]


def _table_length(flags: int) -> int:
    """Return the bytes of the colour table that a byte of flags announces."""
    return 3 << (flags & 7) + 1 if flags & 0x80 else 0
