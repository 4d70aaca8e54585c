"""Films of runs without a player, drawn as `sandbox export` does."""

from collections.abc import Callable
from pathlib import Path

import sandbox
from sandbox.measure.run.runner import run
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.camera import Camera
from sandbox.window.capture.export import MIN_CAPTION_WIDTH, RunRenderer
from sandbox.window.capture.image_files import offscreen
from sandbox.window.playback.recorded import RecordedRun

from .files import image_of, save_gif

SUPERSAMPLING = 2
"""Pictures are drawn larger by this factor, and averaged."""


def film(
    scene: str, size: tuple[int, int], until: float, *, engine: str = "pymunk", fps: float = 20.0, colours: int = 64
) -> Callable[[Path], None]:
    """Return a function that films a scene.

    Args:
        scene: name of the scene.
        size: size of the film, px.
        until: duration of the run, s.
        engine: name of the engine.
        fps: frames per second.
        colours: number of colours of the palette.
    """

    def make(path: Path) -> None:
        recorded = RecordedRun(run(sandbox.load(find(scene), [f"world.duration={until}"]), engine, audit=False), scene)
        renderer = RunRenderer(recorded)
        large = size[0] * SUPERSAMPLING, size[1] * SUPERSAMPLING
        surface, camera, frames = offscreen(large), Camera.fitting(recorded.bounds, large), []
        for k in range(round(until * fps) + 1):
            renderer.draw(surface, camera, k / fps, caption=size[0] >= MIN_CAPTION_WIDTH)
            frames.append(image_of(surface).reduce(SUPERSAMPLING))
        save_gif(frames, path, fps, colours, 0.8)

    return make
