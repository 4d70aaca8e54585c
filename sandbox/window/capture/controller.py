"""Capture controller: screenshots, films and session recordings of a window, each announced by a message."""

from collections.abc import Callable
from pathlib import Path

import pygame

from sandbox.window.capture.image_files import AtomicFile, PictureError, Size, screenshot, unwritable_reason
from sandbox.window.capture.recorder import FilmRecorder, recorder_in, size_within
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.recorded import RecordedView

FRAME_RATE = 25.0
"""pictures/s of a film"""
MIN_FRACTION = 0.7
"""Fraction of the pictures of a film below which its notice names the command that makes all of them."""
MAX_WIDTH = 960
"""px, width of a film; a wider window is scaled down"""

Notify = Callable[[str, str], None]
"""(text, level)"""


class CaptureController:
    """Captures what a window shows.

    Args:
        folder: folder of the files.
        film: suffix of films, `.gif` or `.mp4`.
        notify: shows a message.
    """

    def __init__(self, folder: Path, film: str, notify: Notify) -> None:
        self._folder, self._film, self._notify = folder, film, notify
        self._recorder: FilmRecorder | None = None
        self._seconds, self._pending_seconds, self._pictures = 0.0, 0.0, 0
        self._seeking: tuple[LiveView, str] | None = None
        """session to be saved once its jump in time is complete, and its name"""

    @property
    def status(self) -> str | None:
        """Format and length of the film that is being recorded."""
        return f"{self._film[1:]} {self._seconds:.1f} s" if self._recorder is not None else None

    @property
    def is_recording(self) -> bool:
        """Whether a film is being recorded."""
        return self._recorder is not None

    def save_screenshot(self, surface: pygame.Surface, name: str) -> None:
        """Save a surface as a numbered PNG."""
        try:
            self._notify(f"screenshot: {screenshot(surface, self._folder, name)}", "info")
        except PictureError as error:
            self._notify(str(error), "error")

    def start_recording(self, size: Size, name: str) -> None:
        """Start a film of pictures of a size, px."""
        try:
            self._recorder = recorder_in(self._folder, name, self._film, size_within(size, MAX_WIDTH), FRAME_RATE)
        except PictureError as error:
            self._notify(str(error), "error")
            return
        self._seconds = self._pending_seconds = 0.0
        self._pictures = 0

    def update(self, picture: Callable[[], pygame.Surface], elapsed: float) -> None:
        """Add a picture to the film if it is due, and save a session whose jump in time is complete.

        Args:
            picture: draws the picture of a film.
            elapsed: time since the last call, s.
        """
        if self._seeking is not None and self._seeking[0].busy is None:
            (view, name), self._seeking = self._seeking, None
            self.save_session(view, name)
        if self._recorder is None:
            return
        self._seconds += elapsed
        self._pending_seconds += elapsed
        if self._pending_seconds < 1.0 / FRAME_RATE:
            return
        try:
            self._recorder.add(picture(), self._pending_seconds)
            self._pictures += 1
        except PictureError as error:
            self._notify(str(error), "warning")
            self.stop_recording()
        self._pending_seconds = 0.0

    def stop_recording(self) -> None:
        """Finish the film, if one is being recorded."""
        recorder, self._recorder = self._recorder, None
        if recorder is None:
            return
        try:
            text = f"recorded: {recorder.close()}"
            if self._pictures < MIN_FRACTION * self._seconds * FRAME_RATE:
                rate = f"{self._pictures / self._seconds:.0f} pictures a second"
                text += f", {rate}; save with Ctrl+S, and `sandbox export SESSION.json --to film{self._film}` makes all"
            self._notify(text, "info")
        except PictureError as error:
            self._notify(str(error), "error")

    def save_session(self, view: LiveView | RecordedView | None, name: str) -> None:
        """Save a live session as a recording that `sandbox replay` reads; during a jump in time, after it."""
        if not isinstance(view, LiveView):
            self._notify("a stored run is already saved" if view is not None else "no session to save", "warning")
            return
        if view.busy is not None:
            self._seeking = view, name
            self._notify("the session is saved once the jump in time is complete", "info")
            return
        outfile = AtomicFile.numbered(self._folder, name, ".json")
        try:
            view.session.recording().save(outfile.temporary)
            self._notify(f"session: {outfile.place()}", "info")
            view.session.log.saved = view.session.log.all
        except (PictureError, OSError) as error:
            outfile.discard()
            reason = str(error) if isinstance(error, PictureError) else str(unwritable_reason(self._folder, error))
            self._notify(f"cannot save the session: {reason}", "error")
