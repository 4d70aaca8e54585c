"""Drawing of a recorded run, and its export to a picture or film file."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pygame

from sandbox.arrays import FloatArray
from sandbox.progress import Progress, ProgressCallback
from sandbox.signals import defer_interrupt
from sandbox.window.camera import Camera
from sandbox.window.capture.image_files import AtomicFile, Size, offscreen, save_image
from sandbox.window.capture.recorder import FilmRecorder, recorder_for
from sandbox.window.playback.recorded import RecordedRun
from sandbox.window.render.palette import FAINT, INK
from sandbox.window.render.renderer import InsetRenderer, Renderer
from sandbox.window.render.text import draw_text, text_size
from sandbox.window.ui.energy_plot import RunGraph
from sandbox.window.view_bounds import should_rotate

MIN_CAPTION_WIDTH = 320
"""px; a caption would cover too much of a narrower picture"""


@dataclass(frozen=True)
class ExportOptions:
    """Part of a run to export, and how it is shown."""

    start: float
    """s"""
    end: float
    """s; a still picture shows this time"""
    size: Size = (960, 540)
    fps: float = 30.0
    """pictures/s of a film"""
    speed: float = 1.0
    """playback speed, relative to real time"""
    overlays: frozenset[str] = frozenset({"shapes"})
    """names of overlays, from `snapoptions.OVERLAYS`"""


class RunRenderer:
    """Draws a recorded run as the window draws a session."""

    def __init__(self, run: RecordedRun) -> None:
        self.run = run
        self._renderer, self._inset = Renderer(), InsetRenderer()
        self._graph = RunGraph(run.trajectory, run.scene, run.bodies)

    def draw(
        self,
        surface: pygame.Surface,
        camera: Camera,
        time: float,
        overlays: frozenset[str] = frozenset({"shapes"}),
        speed: float = 1.0,
        caption: bool = True,
    ) -> None:
        """Draw the state at a time, s.

        Args:
            surface: target; it needs no display.
            camera: visible part of the world.
            time: time of the run, s.
            overlays: names of overlays, from `snapoptions.OVERLAYS`.
            speed: playback speed, relative to real time.
            caption: write title, engine and time into the upper left corner, if the surface is wide enough.
        """
        ui_scale = ui_scale_of(surface.get_size())
        snapshot = self.run.snapshot(time, overlays, speed)
        self._renderer.draw(surface, camera, snapshot, ui_scale=ui_scale)
        self._inset.draw(surface, camera, snapshot, surface.get_rect(), ui_scale=ui_scale)
        if "energy" in overlays:
            self._graph.draw(surface, time, ui_scale)
        if caption and surface.get_width() >= MIN_CAPTION_WIDTH:
            self._write_caption(surface, time, ui_scale)

    def _write_caption(self, surface: pygame.Surface, time: float, ui_scale: float) -> None:
        left, size = 14.0 * ui_scale, 17.0 * ui_scale
        title = self.run.scene.title or "untitled"
        draw_text(surface, title, (left, 12.0 * ui_scale), size, INK, bold=True)
        digits = max(2, len(f"{self.run.duration:.2f}"))
        text = f"{self.run.trajectory.info['engine']}   {time:{digits}.2f} s"
        height = text_size(title, size, bold=True)[1]
        draw_text(surface, text, (left, 12.0 * ui_scale + 1.15 * height), 14.0 * ui_scale, FAINT, mono=True)


def ui_scale_of(size: tuple[int, int]) -> float:
    """Return the factor by which lines and text are scaled in a picture of a size, px; 1 at 960 x 540."""
    return max(0.75, min(size[0] / 960.0, size[1] / 540.0))


def frame_times(start: float, end: float, fps: float, speed: float = 1.0) -> tuple[FloatArray, FloatArray]:
    """Return the times of a film's pictures, (K,) s of the run, and their durations, (K,) s, with the exact sum.

    Args:
        start: start of the film, s of the run.
        end: end of the film, s of the run.
        fps: pictures/s.
        speed: playback speed, relative to real time.
    """
    seconds = (end - start) / speed
    count = max(
        1, math.ceil(seconds * fps - 0.5 - 1e-9)
    )  # exactly half a picture is rounded down, despite rounding errors
    shown: FloatArray = np.full(count, 1.0 / fps)
    if seconds > 0.0:
        shown[-1] = seconds - (count - 1) / fps
    return np.asarray(start + np.arange(count) * (speed / fps)), shown


def export_images(
    run: RecordedRun, options: ExportOptions, path: Path, on_progress: ProgressCallback | None = None
) -> int:
    """Write a run to a `.png`, `.gif` or `.mp4`, and return the number of pictures.

    Needs no display. If it is interrupted, no file is left.

    Raises:
        PictureError: the file cannot be made.
    """
    renderer = RunRenderer(run)
    surface = offscreen(options.size)
    camera = Camera.fitting(run.bounds, options.size, turned=should_rotate(run.scene, options.size))
    if path.suffix.lower() == ".png":
        renderer.draw(surface, camera, options.end, options.overlays, options.speed)
        save_image(surface, AtomicFile.at(path))
        return 1
    times, shown = frame_times(options.start, options.end, options.fps, options.speed)
    recorder: FilmRecorder | None = None
    try:
        with defer_interrupt():
            recorder = recorder_for(path, options.size, options.fps)
        for k, (time, seconds) in enumerate(zip(times.tolist(), shown.tolist(), strict=True)):
            renderer.draw(surface, camera, time, options.overlays, options.speed)
            recorder.add(surface, seconds)
            if on_progress is not None:
                on_progress(Progress(fraction=(k + 1) / len(times)))
        recorder.close()
    finally:
        if recorder is not None:
            with defer_interrupt():
                recorder.cancel()
    return len(times)
