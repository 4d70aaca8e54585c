"""Recorders: turn a series of surfaces into a film file, by suffix."""

import math
from pathlib import Path
from typing import Protocol

import pygame

from sandbox.window.capture.image_files import AtomicFile, PictureError, Size
from sandbox.window.capture.limits import FILM_SUFFIXES, MAX_GIF_FRAMES, NEEDS_VIDEO, can_make_mp4


class FilmRecorder(Protocol):
    """Writes surfaces to a film file."""

    def add(self, surface: pygame.Surface, seconds: float) -> None:
        """Add a picture and its duration, s.

        Raises:
            PictureError: no picture can be added. Earlier ones are kept: `close` writes them.
        """

    def close(self) -> Path:
        """Finish the file and return its path.

        Raises:
            PictureError: the file cannot be finished; it is removed.
        """

    def cancel(self) -> None:
        """Remove the unfinished file. After `close` it has no effect."""


def recorder_for(path: Path, size: Size, fps: float) -> FilmRecorder:
    """Return a recorder by a path's suffix; an existing file is replaced.

    Args:
        path: path that ends in `.gif` or `.mp4`.
        size: size of the film, px; an mp4 omits the last column or row if a side is odd.
        fps: pictures/s of an mp4. In a gif each picture has its own duration.

    Raises:
        PictureError: unknown suffix, missing `video` extra, or the file cannot be written.
    """
    return _recorder(AtomicFile.at(path), path.suffix.lower(), size, fps)


def recorder_in(folder: Path, stem: str, suffix: str, size: Size, fps: float) -> FilmRecorder:
    """Return a recorder that writes the first free of `sandbox-<stem>-1<suffix>`, `…-2<suffix>`, … when it is closed.

    Raises:
        PictureError: as `recorder_for`.
    """
    return _recorder(AtomicFile.numbered(folder, stem, suffix), suffix, size, fps)


def size_within(size: Size, max_width: int) -> Size:
    """Return a size of the same proportions, at most `max_width` px wide; both sides are even."""
    factor = min(1.0, max_width / max(size[0], 1))
    return max(2 * round(size[0] * factor / 2), 2), max(2 * round(size[1] * factor / 2), 2)


def _recorder(outfile: AtomicFile, suffix: str, size: Size, fps: float) -> FilmRecorder:
    if min(size) < 2 or not (math.isfinite(fps) and fps > 0):
        raise PictureError(f"cannot record {size[0]} x {size[1]} pixels at {fps:g} frames per second")
    if suffix == ".gif":
        from sandbox.window.capture.gif import GifRecorder  # Pillow is imported only if a gif is recorded

        return GifRecorder(outfile, size, MAX_GIF_FRAMES)
    if suffix == ".mp4":
        if not can_make_mp4():
            raise PictureError(NEEDS_VIDEO)
        from sandbox.window.capture.mp4 import Mp4Recorder

        return Mp4Recorder(outfile, size, fps)
    raise PictureError(f"a recording is written as {' or '.join(FILM_SUFFIXES)}, not {suffix!r}")
