"""Filming: a stored run to a file, as a still picture or a film."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sandbox.interrupt import uninterrupted
from sandbox.window.camera import Camera
from sandbox.window.capture.film import RecordedRun, frame_times
from sandbox.window.capture.image_files import AtomicFile, Size, offscreen
from sandbox.window.capture.recorder import Recorder, recorder_for, save_image
from sandbox.window.view_bounds import should_rotate

Progress = Callable[[float], None]
"""Called with the share of the film that is done, 0 to 1."""


@dataclass(frozen=True)
class ExportOptions:
    """What is to be seen of a run."""

    start: float
    """s"""
    end: float
    """s; a still shows this moment"""
    size: Size = (960, 540)
    fps: float = 30.0
    """pictures/s of a film"""
    speed: float = 1.0
    """as a share of real time"""
    overlays: frozenset[str] = frozenset({"shapes"})
    """of `sight.OVERLAYS`"""


def export_images(film: RecordedRun, shot: ExportOptions, path: Path, progress: Progress | None = None) -> int:
    """Write a run to a `.png`, `.gif` or `.mp4`, and return how many pictures it has.

    Needs no display, and leaves nothing behind where it is interrupted.

    Raises:
        CaptureError: the file cannot be made.
    """
    surface = offscreen(shot.size)
    camera = Camera.fitting(film.box, shot.size, turned=should_rotate(film.scene, shot.size))
    if path.suffix.lower() == ".png":
        film.draw(surface, camera, shot.end, shot.overlays, shot.speed)
        save_image(surface, AtomicFile.at(path))
        return 1
    times, shown = frame_times(shot.start, shot.end, shot.fps, shot.speed)
    recorder: Recorder | None = None
    try:
        with uninterrupted():
            recorder = recorder_for(path, shot.size, shot.fps)
        for k, (time, seconds) in enumerate(zip(times.tolist(), shown.tolist(), strict=True)):
            film.draw(surface, camera, time, shot.overlays, shot.speed)
            recorder.add(surface, seconds)
            if progress is not None:
                progress((k + 1) / len(times))
        recorder.close()
    finally:
        if recorder is not None:
            with uninterrupted():
                recorder.cancel()
    return len(times)
