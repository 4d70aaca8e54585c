"""Taking: screenshots, films and recordings of what the window shows, each told as a message and on the terminal."""

from collections.abc import Callable
from pathlib import Path

import pygame

from sandbox.play.footage.capture import Recorder, recorder_in, screenshot, size_within
from sandbox.play.footage.outfile import CaptureError, Outfile, unwritable
from sandbox.play.running.live import Live
from sandbox.play.running.stored import Stored

FILM_RATE = 25.0
"""pictures a second"""
FILM_WIDTH = 960
"""px; a larger window is made smaller"""

Tell = Callable[[str, str], None]
"""(text, level)"""


class Taking:
    """What is being kept of a window."""

    def __init__(self, folder: Path, film: str, tell: Tell) -> None:
        """Take nothing yet.

        Args:
            folder: where files go.
            film: `.gif` or `.mp4`.
            tell: who is told.
        """
        self._folder, self._film, self._tell = folder, film, tell
        self._recorder: Recorder | None = None
        self._seconds, self._due = 0.0, 0.0
        self._waiting: tuple[Live, str] | None = None  # a session that is on its way, and the name to keep it by

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

    def session(self, show: Live | Stored | None, name: str) -> None:
        """Keep the session, to be replayed."""
        if not isinstance(show, Live):
            self._tell("a stored run is already saved" if show is not None else "no session to save", "warning")
            return
        if show.busy is not None:  # where it is going is what is to be kept, not somewhere on the way
            self._waiting = show, name
            self._tell("the session is saved once the jump in time is complete", "info")
            return
        outfile = Outfile.numbered(self._folder, name, ".json")
        try:
            show.session.recording().save(outfile.temporary)
            self._tell(f"session: {outfile.place()}", "info")
            show.session.note_saved()
        except (CaptureError, OSError) as error:
            outfile.discard()
            why = str(error) if isinstance(error, CaptureError) else str(unwritable(self._folder, error))
            self._tell(f"cannot save the session: {why}", "error")
