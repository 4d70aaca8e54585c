"""Mp4: films in h264, which every player shows; pixels are piped to ffmpeg."""

import math
import subprocess
import tempfile
from contextlib import suppress
from pathlib import Path

import imageio_ffmpeg
import pygame

from sandbox.window.capture.image_files import AtomicFile, CaptureError, Size, rgb_pixels, unwritable_reason

QUALITY = 18
"""ffmpeg's constant rate factor, from 0, lossless, to 51; at 18 no loss is seen."""
NEW_GROUP = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
"""Windows alone has it. Ctrl-C is for the sandbox, which then tells ffmpeg."""


class Mp4Recorder:
    """A film of a constant rate: each picture is shown as often as its seconds fill, on the whole exactly.

    Args:
        outfile: where it goes.
        size: px; an odd side loses its last row or column, as h264's colours are shared by 2 x 2 pixels.
        fps: pictures a second.

    Raises:
        CaptureError: ffmpeg is not there, or the file cannot be written.
    """

    def __init__(self, outfile: AtomicFile, size: Size, fps: float) -> None:
        self._outfile = outfile
        self._size = size
        self._fps = fps
        self._seconds = 0.0
        self._written = 0
        even = size[0] // 2 * 2, size[1] // 2 * 2
        try:
            program = imageio_ffmpeg.get_ffmpeg_exe()
        except RuntimeError as error:
            raise CaptureError(f"ffmpeg not found: {error}") from None
        command = [
            *(program, "-v", "error", "-y", "-nostdin"),
            *("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{even[0]}x{even[1]}", "-r", f"{fps:.9g}", "-i", "-"),
            *("-vf", "scale=out_color_matrix=bt709:out_range=tv", "-c:v", "libx264", "-crf", str(QUALITY)),
            *("-pix_fmt", "yuv420p", "-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709"),
            *("-movflags", "+faststart", "-f", "mp4", str(outfile.temporary.absolute())),
        ]
        try:
            outfile.temporary.open("xb").close()  # what cannot be written shows now, in words better than ffmpeg's
            self._complaint = tempfile.TemporaryFile()  # noqa: SIM115, lives as long as the recorder
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=self._complaint,
                start_new_session=True,
                creationflags=NEW_GROUP,
            )
        except OSError as error:
            outfile.discard()
            raise unwritable_reason(outfile.temporary.parent, error) from None
        assert self._process.stdin is not None  # it was asked for
        self._pipe = self._process.stdin

    def add(self, surface: pygame.Surface, seconds: float) -> None:
        """Add a picture that is shown for so long.

        Raises:
            CaptureError: ffmpeg takes no more.
        """
        self._seconds += seconds
        due = math.floor(self._seconds * self._fps + 0.5) - self._written
        if due <= 0:
            return
        width, height = self._size
        picture = rgb_pixels(surface, self._size)[: height // 2 * 2, : width // 2 * 2].tobytes()
        try:
            for _ in range(due):
                self._pipe.write(picture)
                self._written += 1
        except (OSError, ValueError) as error:  # it has ended; a closed pipe is a ValueError
            raise self._failure(str(error)) from None

    def close(self) -> Path:
        """Finish the file and return its path.

        Raises:
            CaptureError: ffmpeg failed, or not a single picture was added. Nothing is left then.
        """
        try:
            with suppress(OSError):  # it has ended already, and its status says how
                self._pipe.close()
            status = self._process.wait()
            if not self._written:
                raise CaptureError("a recording needs at least one frame")
            if status != 0:
                raise self._failure(f"status {status}")
            return self._outfile.place()
        finally:
            self.cancel()

    def cancel(self) -> None:
        """End ffmpeg and leave nothing behind."""
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        with suppress(OSError):  # what it still held has nowhere to go
            self._pipe.close()
        self._complaint.close()
        self._outfile.discard()

    def _failure(self, otherwise: str) -> CaptureError:
        """Return what ffmpeg complains of, in one line."""
        self._complaint.seek(0)
        lines = self._complaint.read().decode("utf-8", "replace").split("\n")
        said = "; ".join(line.strip() for line in lines if line.strip())
        return CaptureError(f"ffmpeg: {said[:300] or otherwise}")
