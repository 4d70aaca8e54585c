"""Capture: pictures of the window as files. It takes surfaces and knows no window."""

import math
from pathlib import Path
from typing import Protocol

import pygame

from sandbox.play.footage.limits import MOST_GIF_PICTURES, NEEDS_VIDEO, can_make_mp4
from sandbox.play.footage.outfile import CaptureError, Outfile, unwritable
from sandbox.play.footage.still import Size, png

FILMS = (".gif", ".mp4")
"""Suffixes of moving pictures."""


class Recorder(Protocol):
    """Surfaces in, a film out."""

    def add(self, surface: pygame.Surface, seconds: float) -> None:
        """Add a picture that is shown for so long.

        Raises:
            CaptureError: no more can be taken. What was added before is safe: `close` keeps it.
        """

    def close(self) -> Path:
        """Finish the file and return its path.

        Raises:
            CaptureError: it cannot be finished; nothing is left of it then.
        """

    def cancel(self) -> None:
        """Leave nothing behind. It does nothing once closed."""


def screenshot(surface: pygame.Surface, folder: Path, stem: str) -> Path:
    """Write a surface as `sandbox-<stem>-<n>.png`, n being the first free number, and return its path.

    Args:
        surface: the picture.
        folder: where.
        stem: the scene's name; what is no letter, digit, - or _ in it becomes -.

    Raises:
        CaptureError: the folder cannot be written to.
    """
    return save(surface, Outfile.numbered(folder, stem, ".png"))


def save(surface: pygame.Surface, outfile: Outfile) -> Path:
    """Write a surface as a PNG, whole or not at all, and return its path.

    Raises:
        CaptureError: the file cannot be written.
    """
    try:
        with outfile.temporary.open("xb") as stream:
            stream.write(png(surface))
    except OSError as error:
        outfile.discard()
        raise unwritable(outfile.temporary.parent, error) from None
    except BaseException:
        outfile.discard()
        raise
    return outfile.place()


def recorder_for(path: Path, size: Size, fps: float) -> Recorder:
    """Return a recorder by a path's suffix, which replaces what the path holds.

    Args:
        path: ends in `.gif` or `.mp4`.
        size: of the film, px; an mp4 leaves out the last column or row of an odd one.
        fps: pictures a second of an mp4. A gif keeps each picture as long as it is shown.

    Raises:
        CaptureError: another suffix, the `video` extra is missing, or the file cannot be written.
    """
    return _recorder(Outfile.at(path), path.suffix.lower(), size, fps)


def recorder_in(folder: Path, stem: str, suffix: str, size: Size, fps: float) -> Recorder:
    """Return a recorder into the first free of `sandbox-<stem>-1<suffix>` and so on, chosen when it is closed.

    Raises:
        CaptureError: as `recorder_for`.
    """
    return _recorder(Outfile.numbered(folder, stem, suffix), suffix, size, fps)


def size_within(size: Size, width: int) -> Size:
    """Return a size of the same proportions, no wider than so many pixels, both sides even."""
    share = min(1.0, width / max(size[0], 1))
    return max(2 * round(size[0] * share / 2), 2), max(2 * round(size[1] * share / 2), 2)


def _recorder(outfile: Outfile, suffix: str, size: Size, fps: float) -> Recorder:
    if min(size) < 2 or not (math.isfinite(fps) and fps > 0):
        raise CaptureError(f"cannot record {size[0]} x {size[1]} pixels at {fps:g} frames per second")
    if suffix == ".gif":
        from sandbox.play.footage.gif import GifRecorder  # the window itself needs no Pillow

        return GifRecorder(outfile, size, MOST_GIF_PICTURES)
    if suffix == ".mp4":
        if not can_make_mp4():
            raise CaptureError(NEEDS_VIDEO)
        from sandbox.play.footage.mp4 import Mp4Recorder

        return Mp4Recorder(outfile, size, fps)
    raise CaptureError(f"a recording is written as {' or '.join(FILMS)}, not {suffix!r}")
