"""MP4 recorder: films in H.264, which all players support; pixels are piped to ffmpeg.

`imageio_ffmpeg.write_frames` is not used: it ignores the exit status of ffmpeg and leaves its messages to the terminal,
so a film cut short by a full disk would count as complete.
"""

import math
import subprocess
import tempfile
from contextlib import suppress
from pathlib import Path

import imageio_ffmpeg
import pygame

from sandbox.window.capture.image_files import AtomicFile, PictureError, Size, rgb_pixels, unwritable_reason

RATE_FACTOR = 18
"""ffmpeg's constant rate factor, 0 (lossless) to 51; at 18 no loss is visible"""
NEW_GROUP = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
"""Windows only: Ctrl-C is sent to the sandbox only, which then ends ffmpeg"""


class Mp4Recorder:
    """Writes a film of constant frame rate: pictures are repeated or dropped so that the total time is exact.

    Args:
        outfile: the file.
        size: px; an odd side loses its last row or column, as 2 x 2 pixels share a colour in yuv420p.
        fps: pictures/s.

    Raises:
        PictureError: ffmpeg is missing, or the file cannot be written.
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
            raise PictureError(f"ffmpeg not found: {error}") from None
        command = [
            *(program, "-v", "error", "-y", "-nostdin"),
            *("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{even[0]}x{even[1]}", "-r", f"{fps:.9g}", "-i", "-"),
            *("-vf", "scale=out_color_matrix=bt709:out_range=tv", "-c:v", "libx264", "-crf", str(RATE_FACTOR)),
            *("-pix_fmt", "yuv420p", "-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709"),
            *("-movflags", "+faststart", "-f", "mp4", str(outfile.temporary.absolute())),
        ]
        try:
            outfile.temporary.open("xb").close()  # if it cannot be written, this error is clearer than ffmpeg's
            self._messages = tempfile.TemporaryFile()  # noqa: SIM115, lives as long as the recorder
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=self._messages,
                start_new_session=True,
                creationflags=NEW_GROUP,
            )
        except OSError as error:
            outfile.discard()
            raise unwritable_reason(outfile.temporary.parent, error) from None
        assert self._process.stdin is not None  # stdin=PIPE
        self._pipe = self._process.stdin

    def add(self, surface: pygame.Surface, seconds: float) -> None:
        """Add a picture and its duration, s.

        Raises:
            PictureError: ffmpeg has ended.
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
        except (OSError, ValueError) as error:  # ffmpeg has ended; a closed pipe raises ValueError
            raise self._failure(str(error)) from None

    def close(self) -> Path:
        """Finish the file and return its path.

        Raises:
            PictureError: ffmpeg failed, or no picture was added. Nothing is left then.
        """
        try:
            with suppress(OSError):  # ffmpeg has ended already; its exit status is checked below
                self._pipe.close()
            status = self._process.wait()
            if not self._written:
                raise PictureError("a recording needs at least one frame")
            if status != 0:
                raise self._failure(f"status {status}")
            return self._outfile.place()
        finally:
            self.cancel()

    def cancel(self) -> None:
        """End ffmpeg and remove the temporary file."""
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        with suppress(OSError):  # buffered pixels cannot be written any more
            self._pipe.close()
        self._messages.close()
        self._outfile.discard()

    def _failure(self, default: str) -> PictureError:
        """Return an error with ffmpeg's messages in one line."""
        self._messages.seek(0)
        lines = self._messages.read().decode("utf-8", "replace").split("\n")
        messages = "; ".join(line.strip() for line in lines if line.strip())
        return PictureError(f"ffmpeg: {messages[:300] or default}")
