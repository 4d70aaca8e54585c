"""Taking: screenshots, films and recordings of what the window shows, each told as a message and on the terminal.

Limits: what films can be, known without making one. It imports nothing that draws.

Capture: pictures of the window as files. It takes surfaces and knows no window.
"""

import math
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Protocol

import pygame

from sandbox.window.capture.image_files import AtomicFile, CaptureError, Size, png_bytes, unwritable_reason
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.recorded import RecordedView

MAX_GIF_RATE = 50.0
"""pictures/s: viewers show what is quicker than 0.02 s at a tenth of its speed"""
MAX_GIF_FRAMES = 3000
"""Of one gif, which viewers unpack into memory as a whole: 100 s at 30 a second."""
NEEDS_VIDEO = 'mp4 needs the `video` extra: pip install -e ".[video]"; gif works without it'


def can_make_mp4() -> bool:
    """Tell whether the `video` extra is installed."""
    return find_spec("imageio_ffmpeg") is not None


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
    return save_image(surface, AtomicFile.numbered(folder, stem, ".png"))


def save_image(surface: pygame.Surface, outfile: AtomicFile) -> Path:
    """Write a surface as a PNG, whole or not at all, and return its path.

    Raises:
        CaptureError: the file cannot be written.
    """
    try:
        with outfile.temporary.open("xb") as stream:
            stream.write(png_bytes(surface))
    except OSError as error:
        outfile.discard()
        raise unwritable_reason(outfile.temporary.parent, error) from None
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
    return _recorder(AtomicFile.at(path), path.suffix.lower(), size, fps)


def recorder_in(folder: Path, stem: str, suffix: str, size: Size, fps: float) -> Recorder:
    """Return a recorder into the first free of `sandbox-<stem>-1<suffix>` and so on, chosen when it is closed.

    Raises:
        CaptureError: as `recorder_for`.
    """
    return _recorder(AtomicFile.numbered(folder, stem, suffix), suffix, size, fps)


def size_within(size: Size, width: int) -> Size:
    """Return a size of the same proportions, no wider than so many pixels, both sides even."""
    share = min(1.0, width / max(size[0], 1))
    return max(2 * round(size[0] * share / 2), 2), max(2 * round(size[1] * share / 2), 2)


def _recorder(outfile: AtomicFile, suffix: str, size: Size, fps: float) -> Recorder:
    if min(size) < 2 or not (math.isfinite(fps) and fps > 0):
        raise CaptureError(f"cannot record {size[0]} x {size[1]} pixels at {fps:g} frames per second")
    if suffix == ".gif":
        from sandbox.window.capture.gif import GifRecorder  # the window itself needs no Pillow

        return GifRecorder(outfile, size, MAX_GIF_FRAMES)
    if suffix == ".mp4":
        if not can_make_mp4():
            raise CaptureError(NEEDS_VIDEO)
        from sandbox.window.capture.mp4 import Mp4Recorder

        return Mp4Recorder(outfile, size, fps)
    raise CaptureError(f"a recording is written as {' or '.join(FILMS)}, not {suffix!r}")


FILM_RATE = 25.0
"""pictures a second"""
FILM_WIDTH = 960
"""px; a larger window is made smaller"""

Notify = Callable[[str, str], None]
"""(text, level)"""


class CaptureController:
    """What is being kept of a window."""

    def __init__(self, folder: Path, film: str, tell: Notify) -> None:
        """Take nothing yet.

        Args:
            folder: where files go.
            film: `.gif` or `.mp4`.
            tell: who is told.
        """
        self._folder, self._film, self._tell = folder, film, tell
        self._recorder: Recorder | None = None
        self._seconds, self._due = 0.0, 0.0
        self._waiting: tuple[LiveView, str] | None = None  # a session that is on its way, and the name to keep it by

    @property
    def told(self) -> str | None:
        """What is being recorded, and for how long."""
        return f"{self._film[1:]} {self._seconds:.1f} s" if self._recorder is not None else None

    @property
    def filming(self) -> bool:
        """Whether a film is being recorded."""
        return self._recorder is not None

    def picture(self, surface: pygame.Surface, name: str) -> None:
        """Keep what is seen."""
        try:
            self._tell(f"screenshot: {screenshot(surface, self._folder, name)}", "info")
        except CaptureError as error:
            self._tell(str(error), "error")

    def begin_film(self, size: tuple[int, int], name: str) -> None:
        """Begin to record."""
        try:
            self._recorder = recorder_in(self._folder, name, self._film, size_within(size, FILM_WIDTH), FILM_RATE)
        except CaptureError as error:
            self._tell(str(error), "error")
            return
        self._seconds = self._due = 0.0

    def roll(self, surface: pygame.Surface, elapsed: float) -> None:
        """Record what is seen, where a picture is due, and keep a session that has come to where it was going."""
        if self._waiting is not None and self._waiting[0].busy is None:
            (show, name), self._waiting = self._waiting, None
            self.session(show, name)
        if self._recorder is None:
            return
        self._seconds += elapsed
        self._due += elapsed
        if self._due < 1.0 / FILM_RATE:
            return
        try:
            self._recorder.add(surface, self._due)
        except CaptureError as error:
            self._tell(str(error), "warning")
            self.end_film()
        self._due = 0.0

    def end_film(self) -> None:
        """Finish the film."""
        recorder, self._recorder = self._recorder, None
        if recorder is None:
            return
        try:
            self._tell(f"recorded: {recorder.close()}", "info")
        except CaptureError as error:
            self._tell(str(error), "error")

    def session(self, show: LiveView | RecordedView | None, name: str) -> None:
        """Keep the session, to be replayed."""
        if not isinstance(show, LiveView):
            self._tell("a stored run is already saved" if show is not None else "no session to save", "warning")
            return
        if show.busy is not None:  # where it is going is what is to be kept, not somewhere on the way
            self._waiting = show, name
            self._tell("the session is saved once the jump in time is complete", "info")
            return
        outfile = AtomicFile.numbered(self._folder, name, ".json")
        try:
            show.session.recording().save(outfile.temporary)
            self._tell(f"session: {outfile.place()}", "info")
            show.session.note_saved()
        except (CaptureError, OSError) as error:
            outfile.discard()
            why = str(error) if isinstance(error, CaptureError) else str(unwritable_reason(self._folder, error))
            self._tell(f"cannot save the session: {why}", "error")
