"""Thumbnail: a small picture of a scene at its start, with a faint look at where its bodies are a moment later."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pygame

from sandbox.engines.contract import Divergence, Exhaustion
from sandbox.engines.registry import able, start
from sandbox.play.camera import Box, Camera
from sandbox.play.drawing.picture import Picture
from sandbox.play.framing import framing, lies_down
from sandbox.play.sight import Sight
from sandbox.scene.compile.generators import GeneratorError
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import load
from sandbox.scene.scene import Scene
from sandbox.trajectory import Frame

FEW = 40
"""Bodies up to which a look ahead can still be read."""
WORK = 4000
"""bodies times solver steps that a look ahead may take"""
AHEAD = 0.12
"""share of a scene's duration that is looked ahead, at most half a second"""
BURST = 0.02
"""Where all begin within this share of what is framed, they are shown in flight instead."""
FLOWN = 0.5
"""share of a scene's duration for which they then have flown"""


@dataclass(frozen=True, eq=False)
class Found:
    """What a file holds: a scene, or what is wrong with it."""

    scene: Scene | None = None
    fault: str = ""


def read(path: Path) -> Found:
    """Read a scene, with its bodies laid out, or the first of its faults."""
    try:
        scene = load(path)
        _ = scene.bodies
    except SceneError as error:
        first = str(error.faults[0]).removeprefix(f"{path}:").strip()
        return Found(fault=f"line {first}" if first[:1].isdigit() else first)
    except GeneratorError as error:
        return Found(fault=str(error))
    return Found(scene)


def thumbnail(scene: Scene, size: tuple[int, int], picture: Picture, unit: float) -> pygame.Surface:
    """Return a picture of a scene, size px wide and high."""
    made = pygame.Surface(size)
    box = framing(scene)
    flown = _bursts(scene, box)
    tells = not flown and scene.play.area is None  # at a table nothing happens until somebody strikes
    later = _later(scene) if tells and 0 < len(scene.bodies) <= FEW else None
    frame = frame_in_flight(scene, FLOWN * scene.world.duration if flown else 0.0)
    camera = Camera.fitting(box, size, margin=0.08, turned=lies_down(scene, size))
    picture.draw(made, camera, Sight(scene, scene.bodies, frame, ghost=later), unit=unit)
    return made


def _bursts(scene: Scene, box: Box) -> bool:
    """Tell whether many bodies that meet nothing begin at about one place."""
    bodies = scene.bodies
    if len(bodies) < 2 or any(element.collides != "none" for element in bodies.elements):
        return False
    (left, bottom), (right, top) = box
    extent = float(np.ptp(bodies.position, axis=0).max())
    return extent < BURST * max(right - left, top - bottom)


def frame_in_flight(scene: Scene, time: float = 0.0) -> Frame:
    """Return where the bodies are after a time in which they meet nothing, in still air without drag."""
    bodies = scene.bodies
    gravity = np.where(bodies.fixed[:, None], 0.0, np.asarray(scene.world.gravity))
    return Frame(
        time,
        bodies.position + bodies.velocity * time + 0.5 * gravity * time**2,
        bodies.velocity + gravity * time,
        bodies.angle + bodies.angular_velocity * time,
        bodies.angular_velocity.copy(),
        np.ones(len(bodies), np.bool_),
    )


def _later(scene: Scene) -> Frame | None:
    """Return the bodies a moment later, or None where no engine tells that cheaply."""
    settings = scene.solver
    most = WORK // (len(scene.bodies) * settings.substeps)
    steps = min(round(min(AHEAD * scene.world.duration, 0.5) / settings.dt), most)
    if steps < 1 or "pymunk" not in able(scene):
        return None
    simulation = start(scene, "pymunk")
    try:
        for _ in range(steps):
            simulation.step()
        return simulation.frame()
    except (Divergence, Exhaustion):
        return None
    finally:
        simulation.close()
